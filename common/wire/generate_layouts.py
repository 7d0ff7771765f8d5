#!/usr/bin/env python3
"""Writes layouts.cpp: for each .lcm type the table by which common/wire checks its bytes.

It reads the grammar of lcmtypes/: one struct per file, constants, scalars, arrays of
fixed size, and one dimension of variable size (first, counted by an earlier integer of the same
struct).
"""
import argparse
import pathlib
import re
import sys

SIZES = {"int8_t": 1, "int16_t": 2, "int32_t": 4, "int64_t": 8, "boolean": 1, "byte": 1,
         "float": 4, "double": 8}
KINDS = {"int8_t": "kInt8", "int16_t": "kInt16", "int32_t": "kInt32", "int64_t": "kInt64",
         "boolean": "kBoolean", "byte": "kByte", "float": "kFloat", "double": "kDouble",
         "string": "kString"}
SMALLEST_STRING = 5  # A length of one and the terminator.


def fail(path, text):
    sys.exit(f"{path}: {text}")


def parse(path):
    """One struct: its name and its fields as (name, type, fixed element count, count field)."""
    text = re.sub(r"//[^\n]*", "", pathlib.Path(path).read_text(encoding="utf-8"))
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    match = re.fullmatch(r"\s*package\s+understory\s*;\s*struct\s+(\w+)\s*\{(.*)\}\s*", text, re.S)
    if not match:
        fail(path, "expected: package understory; struct NAME { ... }")
    name, body = match.groups()
    if name != pathlib.Path(path).stem:
        fail(path, f"holds struct {name}")
    fields = []
    for statement in filter(None, (s.strip() for s in body.split(";"))):
        if statement.startswith("const "):
            continue
        match = re.fullmatch(r"(\w+)\s+(\w+)((?:\s*\[\s*\w+\s*\])*)", statement)
        if not match:
            fail(path, f"cannot read `{statement}`")
        kind, field, dimensions = match.groups()
        fixed, counted_by = 1, None
        for place, dimension in enumerate(re.findall(r"\w+", dimensions)):
            if dimension.isdigit():
                fixed *= int(dimension)
            elif place == 0:
                counted_by = dimension
            else:
                fail(path, f"{field}: only the first dimension may vary")
        if counted_by and kind == "string":
            fail(path, f"{field}: arrays of strings are not allowed")
        fields.append((field, kind, fixed, counted_by))
    return name, fields


def min_bytes(types, name):
    """Bytes of the shortest message of this type, without its fingerprint."""
    total = 0
    for _, kind, fixed, counted_by in types[name]:
        if counted_by is None:
            total += fixed * element_bytes(types, kind)
    return total


def element_bytes(types, kind):
    if kind == "string":
        return SMALLEST_STRING
    return SIZES[kind] if kind in SIZES else min_bytes(types, kind)


def in_order(types):
    """Sorts types so that members precede the types that contain them."""
    done = []

    def visit(name):
        if name in done:
            return
        for _, kind, _, _ in types[name]:
            if kind not in KINDS:
                if kind not in types:
                    sys.exit(f"{name}: unknown type {kind}")
                visit(kind)
        done.append(name)

    for name in sorted(types):
        visit(name)
    return done


def table(types, name):
    """C++ for the fields and the layout of one type."""
    slots = {}
    for _, _, _, counted_by in types[name]:
        if counted_by is not None:
            slots.setdefault(counted_by, len(slots))
    rows, seen = [], set()
    for field, kind, fixed, counted_by in types[name]:
        if counted_by is not None and counted_by not in seen:
            sys.exit(f"{name}.{field}: its count {counted_by} must stand before it")
        seen.add(field)
        part = f"&k_{kind}" if kind not in KINDS else "nullptr"
        enum = KINDS.get(kind, "kStruct")
        rows.append(f'    {{"{field}", FieldKind::{enum}, {part}, {fixed}, '
                    f"{slots.get(counted_by, -1)}, {slots.get(field, -1)}}},")
    fields = "\n".join(rows)
    return (f"constexpr Field k_{name}_fields[] = {{\n{fields}\n}};\n"
            f'constexpr Layout k_{name}{{"{name}", k_{name}_fields, {min_bytes(types, name)}}};\n'
            f"static_assert({len(slots)} <= kMostCounts);\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", required=True)
    parser.add_argument("types", nargs="+")
    arguments = parser.parse_args()
    types = dict(parse(path) for path in arguments.types)
    order = in_order(types)
    repeated = sorted({kind for fields in types.values() for _, kind, _, counted_by in fields
                       if counted_by is not None and kind not in KINDS})
    lines = ["// Generated from lcmtypes/*.lcm by common/wire/generate_layouts.py.",
             '#include "common/wire/layout.hpp"', ""]
    lines += [f'#include "understory/{name}.hpp"' for name in sorted(types)]
    lines += ["", "namespace understory::wire {", "namespace {", ""]
    lines += [table(types, name) for name in order]
    lines += ["// Decoding must not need more than four times a message's size."]
    lines += [f"static_assert(sizeof({name}) <= 4 * k_{name}.min_bytes);" for name in repeated]
    lines += ["", "constexpr WireType kTypes[] = {"]
    lines += [f"    {{&k_{name}, &{name}::getHash, {str(types[name][:1] == [('utime', 'int64_t', 1, None)] and types[name][1:2] == [('seq', 'int64_t', 1, None)]).lower()}}},"
              for name in sorted(types)]
    lines += ["};", "", "}  // namespace", "",
              "std::span<const WireType> wire_types() { return kTypes; }", "",
              "}  // namespace understory::wire", ""]
    out = pathlib.Path(arguments.out)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
