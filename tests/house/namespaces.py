#!/usr/bin/env python3
"""Every public header opens the namespace of its folder: common/geometry/se2.hpp is understory::geometry.

The folders common/, services/ and deploy/ have no namespace of their own. A header may open other namespaces only to declare
what it names (`namespace understory::bus { class Bus; }`), or for the overloads of `archive`, `to_json` and `from_json` that a
library finds by the namespace of their argument.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("common", "services", "sim", "eval", "deploy")
SILENT = ("common", "services", "deploy")
FOUND_BY_ARGUMENT = {"archive", "to_json", "from_json"}
OPENED = re.compile(r"^namespace ([\w:]+) \{", re.MULTILINE)


def expected(header):
    """The namespace of a header's folder."""
    parts = header.relative_to(ROOT).parent.parts
    return "::".join(("understory", *(parts[1:] if parts[0] in SILENT else parts)))


def body(text, begin):
    """The text between the brace that ends at `begin` and the one that closes it."""
    depth = 1
    for end in range(begin, len(text)):
        depth += {"{": 1, "}": -1}.get(text[end], 0)
        if depth == 0:
            return text[begin:end]
    return text[begin:]


def only_declares(text):
    """Whether no type is defined and no function but those that are found by their argument's namespace."""
    text = re.sub(r"//[^\n]*", "", text)
    types = re.search(r"^\s*(class|struct|enum|enum class|concept) [^;(]*\{", text, re.MULTILINE)
    functions = set(re.findall(r"^[a-z][^\n(=]*?\b(\w+)\(", text, re.MULTILINE))
    return not types and functions <= FOUND_BY_ARGUMENT


def problems(header):
    """What is wrong with a header's namespaces."""
    text = header.read_text()
    home = expected(header)
    opened = [(found.group(1), body(text, found.end())) for found in OPENED.finditer(text)]
    if not any(name == home for name, _ in opened):
        yield f"does not open namespace {home}" + (f", but {', '.join(name for name, _ in opened)}" if opened else "")
    for name, content in opened:
        if name != home and name.startswith("understory") and not only_declares(content):
            yield f"defines things in namespace {name}; its folder's is {home}"


def main():
    headers = sorted(file for folder in FOLDERS for file in (ROOT / folder).rglob("*.hpp"))
    found = [f"{header.relative_to(ROOT)}: {problem}" for header in headers for problem in problems(header)]
    print("\n".join(found) if found else f"{len(headers)} headers, each in the namespace of its folder")
    return 1 if found or not headers else 0


if __name__ == "__main__":
    sys.exit(main())
