#!/usr/bin/python3
"""Logs and maps that another version of Understory wrote open, and read the same; see README.md.

    formats.py check BUILD             every folder beside this file
    formats.py make BUILD FOLDER       a new folder, of what BUILD writes
"""

import csv
import gzip
import hashlib
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
#: A file in the tree must not be larger [bytes].
LARGEST = 100_000
#: Numbers of exported tables may differ by rounding [of the larger one, and of one].
NEAR = 1e-6
#: A replay is an algorithm's result: of today's poses so many must come, and be so near to the truth [m].
LEAST_POSES, LARGEST_ERROR_M = 0.9, 0.3

failures = []


def must(holds, what):
    if not holds:
        failures.append(what)
        print("FAIL ", what)


class Program:
    """`understory` of a build."""

    def __init__(self, build):
        self.build = Path(build).resolve()
        sys.path.insert(0, str(self.build / "python"))

    def __call__(self, *arguments):
        command = [str(self.build / "bin" / "understory"), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"understory {' '.join(map(str, arguments))}: {done.stdout[-500:]}{done.stderr[-500:]}")
        return done.stdout


def plain(value):
    """A message's fields as JSON has them: floats by their bits, bytes by their values."""
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, (bytes, bytearray)):
        return value.hex()
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if hasattr(value, "__slots__"):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    return value


def reading_of_log(understory, file):
    """What a log says: counts and types, and for each channel a digest of all fields of its messages."""
    from understory import log  # The build's.

    info = json.loads(understory("log", "info", "--json", file))
    channels = {}
    for one in info["channels"]:
        channels[one["channel"]] = {key: one[key] for key in ("type", "events", "bytes", "malformed")}
    digests = {name: hashlib.sha256() for name in channels}
    for event in log.read(file):
        message = event.message
        if message is None:
            raise RuntimeError(f"{file.name}: {event.channel}: of a type that is not known any more")
        if message.encode() != event.data:
            raise RuntimeError(f"{file.name}: {event.channel}: is not written as it was read")
        digests[event.channel].update(json.dumps(plain(message)).encode())
    for name, digest in digests.items():
        channels[name]["fields"] = digest.hexdigest()[:16]
    return {"events": info["events"], "programs": info["programs"], "channels": channels}


def numbers_of(column):
    try:
        return [float(one) for one in column if one]
    except ValueError:
        return None


def summary_of(table):
    """A table in a few numbers: its columns, each by the sum and the sum of squares, or by a digest of its texts."""
    with table.open() as file:
        head, *rows = csv.reader(file)
    columns = {}
    for i, name in enumerate(head):
        column = [row[i] for row in rows]
        numbers = numbers_of(column)
        text = hashlib.sha256("\n".join(column).encode()).hexdigest()[:16]
        columns[name] = text if numbers is None else [math.fsum(numbers), math.fsum(one * one for one in numbers)]
    return {"rows": len(rows), "columns": columns}


def reading_of_map(understory, file, scratch):
    """What a map file says: maps, changes, place on the earth, and its exported tables."""
    info = json.loads(understory("map", "info", "--json", file))
    log = json.loads(understory("map", "log", "--json", file))
    understory("map", "check", file)
    out = Path(scratch) / f"{file.stem}-exported"
    understory("map", "export", file, "--format", "csv", "--out", out)
    tables = {str(one.relative_to(out)): summary_of(one) for one in sorted(out.rglob("*.csv"))}
    return {"maps": info["maps"], "reference": info["reference"], "written_by": info["written_by"],
            "changes": log["changes"], "tables": tables}


def is_near(a, b):
    try:
        x, y = float(a), float(b)
    except (TypeError, ValueError):
        return a == b
    return (math.isnan(x) and math.isnan(y)) or abs(x - y) <= NEAR * max(1.0, abs(x), abs(y))


def compare(what, expected, found):
    """What is there must be there; a later version may say more."""
    if isinstance(expected, dict) and isinstance(found, dict):
        for key, value in expected.items():
            if key not in found:
                must(False, f"{what}: {key} is not told any more")
            else:
                compare(f"{what}: {key}", value, found[key])
    elif isinstance(expected, list) and isinstance(found, list):
        must(len(expected) == len(found), f"{what}: {len(found)} in the place of {len(expected)}")
        for i, (a, b) in enumerate(zip(expected, found)):
            compare(f"{what} [{i}]", a, b)
    else:
        must(is_near(expected, found), f"{what}: {found} in the place of {expected}")


def reading_of(understory, file, scratch):
    return reading_of_log(understory, file) if file.suffix == ".lcm" else reading_of_map(understory, file, scratch)


def replay_of(understory, folder, scratch, *options):
    """Poses that a replay of the drive gives, and how far off the farthest one is [m]."""
    out, result = Path(scratch) / "replayed.lcm", Path(scratch) / "replayed.json"
    understory("replay", folder / "drive.lcm", "--config", HERE.parents[1] / "deploy" / "config", *options, "--out", out)
    understory("log", "accuracy", out, "--json", result)
    poses = json.loads(result.read_text())["live"]
    return len(poses), max((one[5] for one in poses), default=math.inf)


def unpacked(folder, scratch):
    """The files of a folder as they were; and the folder they are in."""
    out = Path(scratch) / folder.name
    out.mkdir()
    for file in sorted(folder.glob("*.gz")):
        must(file.stat().st_size < LARGEST, f"{file}: is larger than {LARGEST} bytes")
        (out / file.stem).write_bytes(gzip.decompress(file.read_bytes()))
    return out, sorted(one for one in out.iterdir())


def check(understory):
    folders = sorted(one.parent for one in HERE.glob("*/expected.json"))
    must(folders, "there is no folder of a version")
    for folder in folders:
        expected = json.loads((folder / "expected.json").read_text())
        with tempfile.TemporaryDirectory() as scratch:
            out, files = unpacked(folder, scratch)
            must({one.name for one in files} == set(expected["files"]), f"{folder.name}: the files are not those of expected.json")
            for file in files:
                try:
                    compare(f"{folder.name}/{file.name}", expected["files"].get(file.name), reading_of(understory, file, scratch))
                    print(f"read  {folder.name}/{file.name}")
                except RuntimeError as error:
                    must(False, f"{folder.name}/{file.name}: {error}")
            for name, options in (("alone", ()), ("in the map", ("--map", out / "drive.gpkg", "--map-id", "1", "--localisation-only"))):
                poses, error_m = replay_of(understory, out, scratch, *options)
                must(poses >= LEAST_POSES * expected["replayed_poses"], f"{folder.name}: a replay {name} gives {poses} poses")
                must(error_m < LARGEST_ERROR_M, f"{folder.name}: a replay {name} is {error_m:.2f} m off")
                print(f"plays {folder.name}/drive.lcm {name}: {poses} poses, at most {error_m:.2f} m off")


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "check":
        check(Program(sys.argv[2]))
    elif len(sys.argv) == 4 and sys.argv[1] == "make":
        import make_formats

        make_formats.make(Program(sys.argv[2]), HERE / sys.argv[3])
    else:
        sys.exit(__doc__)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
