#!/usr/bin/env python3
"""The pipeline and the table in services/README.md show the channels that services/*/adapter.hpp declares: every one, and no other.

A declaration is `all.in("CHANNEL", ...)` or `all.out("CHANNEL", ...)`. An input that no service publishes comes from a node that is no
service; an output that no service takes goes to one. Labels that are not in capitals are no channels. The inputs of `viewer` are
left out: it hears nearly all channels.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DECLARED = re.compile(r'\ball\.(in|out)\(\s*"([A-Z0-9_]+)"')
CHANNEL = re.compile(r"`([A-Z][A-Z0-9_]+)`")
ARROW = re.compile(r"^\s*(\w+)(?:\(.*?\)\]?\)?)? -->\|([^|]+)\| (\w+)", re.MULTILINE)
OUTSIDE = "(outside)"


def bindings():
    """(service, channel, "in" or "out") of every service."""
    for header in sorted((ROOT / "services").glob("*/adapter.hpp")):
        found = DECLARED.findall(header.read_text())
        if not found:
            raise SystemExit(f"{header.relative_to(ROOT)}: declares no channel")
        for direction, channel in found:
            yield header.parent.name, channel, direction


def tabled():
    """(service, channel, "in" or "out") of the table of processes."""
    for service, cell in re.findall(r"^\| `(\w+)` \| `understory-[\w-]+` \| (.+) \|$", (ROOT / "services/README.md").read_text(), re.MULTILINE):
        for part in cell.split(";"):  # "in -> out; with a store in -> out; where wanted out"
            taken, arrow, given = part.partition("->")
            yield from ((service, channel, "in") for channel in CHANNEL.findall(taken) if arrow)
            yield from ((service, channel, "out") for channel in CHANNEL.findall(given if arrow else taken))


def wanted(bound):
    """The arrows (from, channel, to) that follow from the bindings."""
    sources, sinks = {}, {}
    for service, channel, direction in bound:
        (sources if direction == "out" else sinks).setdefault(channel, set()).add(service)
    return {(source, channel, sink) for channel in sources | sinks
            for source in sources.get(channel, {OUTSIDE}) for sink in sinks.get(channel, {OUTSIDE})}


def drawn(services):
    """The arrows of the diagram; a node that is no service is outside."""
    diagram = re.search(r"```mermaid\n(.*?)```", (ROOT / "services" / "README.md").read_text(), re.DOTALL)
    if not diagram:
        raise SystemExit("services/README.md: no mermaid diagram")
    arrows = set()
    for source, label, sink in ARROW.findall(diagram.group(1)):
        ends = [node if node in services else OUTSIDE for node in (source, sink)]
        arrows |= {(ends[0], channel, ends[1]) for channel in re.split(r",\s*", label.strip())
                   if re.fullmatch(r"[A-Z0-9_]+", channel)}
    return arrows


def main():
    bound = list(bindings())
    expected, found = wanted(bound), drawn({service for service, *_ in bound})
    listed = set(tabled())
    for service, channel, direction in sorted(set(bound) - listed):
        print(f"services/README.md: the table lacks {channel} ({direction}) of {service}")
    for service, channel, direction in sorted(listed - set(bound)):
        print(f"services/README.md: {service} does not declare {channel} ({direction})")
    for arrow in sorted(expected - found):
        print("services/README.md: the diagram lacks {} --{}--> {}".format(*arrow))
    for arrow in sorted(found - expected):
        print("services/README.md: no service has {} --{}--> {}".format(*arrow))
    is_right = expected == found and set(bound) == listed and found
    if is_right:
        print(f"{len(found)} arrows, as the services declare them")
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main())
