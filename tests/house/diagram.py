#!/usr/bin/env python3
"""The pipeline in services/README.md shows the channels that services/*/main.cpp binds: every arrow, and no other.

A channel stands in main.cpp as `.name = "CHANNEL",  // in: ...` or `// out: ...`. An input that no service publishes comes from a
node that is no service; an output that no service takes goes to one. Labels that are not in capitals are no channels.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BINDING = re.compile(r'\.\w+ = "([A-Z0-9_]+)",\s*// (in|out):')
BOUND = re.compile(r'\.\w+ = "[A-Z0-9_]+"')
ARROW = re.compile(r"^\s*(\w+)(?:\(.*?\)\]?\)?)? -->\|([^|]+)\| (\w+)", re.MULTILINE)
OUTSIDE = "(outside)"


def bindings():
    """(service, channel, "in" or "out") of every main.cpp."""
    for main in sorted((ROOT / "services").glob("*/main.cpp")):
        text = main.read_text()
        found = BINDING.findall(text)
        if len(found) != len(BOUND.findall(text)):
            raise SystemExit(f"{main.relative_to(ROOT)}: a channel without '// in:' or '// out:' on its line")
        for channel, direction in found:
            yield main.parent.name, channel, direction


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
    for arrow in sorted(expected - found):
        print("services/README.md: the diagram lacks {} --{}--> {}".format(*arrow))
    for arrow in sorted(found - expected):
        print("services/README.md: no service has {} --{}--> {}".format(*arrow))
    if expected == found:
        print(f"{len(found)} arrows, as the services bind them")
    return 0 if expected == found and found else 1


if __name__ == "__main__":
    sys.exit(main())
