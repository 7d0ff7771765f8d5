#!/usr/bin/env python3
"""docs/faults.md explains every reason that a process can put into HEALTH, and no other.

The reasons are read from the sources: `Reason::kName` in the folder of a service (those of lidar_driver belong to all drivers of lasers), and in
common/bus and common/wire, which every process has. In the chapter a section is headed by the name of the process; the first cell of a row of
its tables holds the reasons as `name`. A condition that a health_watch ties to a channel has a row of its own: `name` on `CHANNEL`.

    faults.py [ROOT]
"""
import pathlib
import re
import sys

SHARED = "Every process"
LAUNCH = "understory launch"
DRIVERS = "The drivers of lasers"
TABLE_ONLY = {"common/bus/reason_counts.cpp", "common/bus/condition.hpp", "common/wire/result.hpp", "common/wire/result.cpp"}
# What a switch returns behind its last case, which no value reaches.
UNREACHED = re.compile(r"\}\n\s*return (?:wire::)?Reason::\w+;")
USED = re.compile(r"\bReason::k(\w+)")
ON_CHANNEL = re.compile(r'Reason::k(\w+),\s*(?:"[^"]*"\s*)+,\s*"([A-Z_]+)"')
LITERAL = re.compile(r'add_degraded\("(\w+)"')


def names(root):
    """The name in HEALTH of each enumerator of wire::Reason."""
    text = (root / "common/wire/result.cpp").read_text()
    return dict(re.findall(r'case Reason::k(\w+):\s*return "(\w+)";', text))


def used(root, folder, name_of):
    """Reasons that the sources below a folder use."""
    found = set()
    for file in sorted([*(root / folder).rglob("*.cpp"), *(root / folder).rglob("*.hpp")]):
        if str(file.relative_to(root)) in TABLE_ONLY:
            continue
        text = UNREACHED.sub("}", file.read_text())
        found |= {name_of[one] for one in USED.findall(text)} | set(LITERAL.findall(text))
    return found


def on_channels(root, folder, name_of):
    """(reason, channel) of the conditions that a service ties to a channel."""
    text = "".join(file.read_text() for file in sorted((root / folder).glob("*.cpp")))
    return [(name_of[reason], channel) for reason, channel in ON_CHANNEL.findall(text)]


def expected(root):
    """The reasons of each section of the chapter."""
    name_of = names(root)
    datagrams = set(re.findall(r'return "(datagram_\w+)"', (root / "common/bus/datagram_fault.cpp").read_text())) - {"datagram_unknown"}
    given_up = set(re.findall(r'kGivenUpCode = "(\w+)"', (root / "deploy/cli/launch_voice.cpp").read_text()))
    sections = {SHARED: used(root, "common/bus", name_of) | used(root, "common/wire", name_of) | datagrams, LAUNCH: given_up,
                DRIVERS: used(root, "services/lidar_driver", name_of)}
    for main in sorted((root / "services").glob("*/main.cpp")):
        name = main.parent.name
        own = used(root, f"services/{name}", name_of)
        if name.endswith("_driver"):
            sections[DRIVERS] |= own
        elif own:
            sections[name] = own
    return sections, set(name_of.values())


def written(chapter):
    """The reasons of each section as the chapter has them; sections without a table of reasons are left out."""
    sections = {}
    for part in re.split(r"^## ", chapter, flags=re.MULTILINE)[1:]:
        head, _, body = part.partition("\n")
        rows = re.findall(r"^\| (`[a-z_`, ]+`)[^|]*\|", body, re.MULTILINE)  # Reasons; a channel may follow.
        if rows and re.search(r"^\| reason", body, re.MULTILINE):
            sections[head.strip().strip("`")] = {name for row in rows for name in re.findall(r"`([a-z_]+)`", row)}
    return sections


def main(arguments):
    root = pathlib.Path(arguments[0]) if arguments else pathlib.Path(__file__).resolve().parents[2]
    wanted, all_reasons = expected(root)
    found = written((root / "docs/faults.md").read_text())
    wrong = [f"docs/faults.md: section \"{head}\" lacks `{one}`" for head in wanted for one in sorted(wanted[head] - found.get(head, set()))]
    wrong += [f"docs/faults.md: section \"{head}\" explains `{one}`, which its sources do not use"
              for head in found for one in sorted(found[head] - wanted.get(head, set()))]
    chapter = (root / "docs/faults.md").read_text()
    for main in sorted((root / "services").glob("*/main.cpp")):
        section = re.search(rf"^## {main.parent.name}\n(.*?)(?=^## |\Z)", chapter, re.MULTILINE | re.DOTALL)
        for reason, channel in on_channels(root, f"services/{main.parent.name}", names(root)):
            if section and f"| `{reason}` on `{channel}` |" not in section.group(1):
                wrong.append(f"docs/faults.md: section \"{main.parent.name}\" lacks a row for `{reason}` on `{channel}`")
    wrong += [f"common/wire/result.cpp: nothing uses `{one}`" for one in sorted(all_reasons - set().union(*wanted.values()))]
    print("\n".join(wrong) if wrong else f"docs/faults.md: {sum(map(len, wanted.values()))} reasons of {len(wanted)} sections")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
