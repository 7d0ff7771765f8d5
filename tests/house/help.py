#!/usr/bin/env python3
"""`--help` of every process lists the channels that its adapter.hpp declares, and the usage line has the executable's name.

    tests/house/help.py BUILD
"""

import re
import subprocess
import sys
from pathlib import Path

from diagram import ROOT, bindings

SHOWN = re.compile(r'visit\.template operator\(\)<\w[\w:]*>\(\s*"([A-Z0-9_]+)"')


def declared(service):
    """The channels of a service as (direction, channel); those of the viewer's page stand in a list of their own."""
    shown = SHOWN.findall((ROOT / "services/viewer/scene_channels.hpp").read_text()) if service == "viewer" else []
    return {("in", channel) for channel in shown} | {(way, channel) for name, channel, way in bindings() if name == service}


def problems(executable, service):
    text = subprocess.run([executable, "--help"], capture_output=True, text=True, timeout=60, check=True).stdout
    if f"Usage: {executable.name} " not in text:
        yield f"{executable.name}: the usage line has another name"
    listed = re.search(r"^Channels:\n(.*?)\n\n", text, re.MULTILINE | re.DOTALL)
    found = set(re.findall(r"^  (in|out) +([A-Z][A-Z0-9_]+)  ", listed.group(1) if listed else "", re.MULTILINE))
    for way, channel in sorted(declared(service) - found):
        yield f"{executable.name} --help lacks {channel} ({way})"
    for way, channel in sorted(found - declared(service)):
        yield f"{executable.name} --help lists {channel} ({way}), which is not declared"


def main(arguments):
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    services = sorted(main.parent.name for main in (ROOT / "services").glob("*/main.cpp"))
    wrong = [problem for service in services
             for problem in problems(Path(arguments[0]) / "bin" / f"understory-{service.replace('_', '-')}", service)]
    print("\n".join(wrong) if wrong else f"{len(services)} processes list their channels")
    return 1 if wrong or not services else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
