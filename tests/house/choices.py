#!/usr/bin/env python3
"""Every choice that a `--help` names is accepted, and another one is refused by the option's name.

    tests/house/choices.py UNDERSTORY UNDERSTORY_EVAL

A list in braces is what the command line is checked against: each choice is given together with an option that does not exist,
which is refused only where the choice was taken, before any work begins. What may refuse a choice later is run: short drives for
all of `sim`. A list in words stands in WORDS with a run for each of its words.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

UNKNOWN = "--no-such-option"
WRONG = "no-such-choice"
OPTION = re.compile(r"^  ((?:-\w,)?--?[\w,-]+|\w+)(?: (TEXT|INT|UINT|FLOAT|BOOLEAN))?(?::(\{[^}]*\}|FILE|\S+ in \[(\S+) - \S+\]))?(?:=(\S+))?(.*)$")
IN_WORDS = re.compile(r"\b[a-z][a-z0-9-]+(?:, [a-z][a-z0-9-]+){2,}")

# Lists in words: the words and a run that ends with status 0 for each; None = another test runs them.
WORDS = {
    ("sim", "world"): (["dense", "intermediate", "sparse", "forest3d", "urban", "urban-countryside", "countryside"],
                       ["sim", "{}", "--length", "5", "--distance", "20", "--lidar", "none", "--standstill", "0", "--out", "{dir}/a.lcm"]),
    ("sim stem-frames", "--path"): (["laps", "there-and-back", "wander"],
                                    ["sim", "stem-frames", "{dir}/stems.csv", "--path", "{}", "--length", "50", "--out", "{dir}/{}"]),
    ("why pose", "utime"): (["last", "worst"], ["why", "pose", "{}", "{dir}/run.lcm"]),  # slowest: of a live run (tests/cli)
    ("import bag", "--model"): None,   # tests/packets: a decoder for each
    ("import pcap", "--model"): None,  # likewise
}
# Choices in braces whose run is short: option and a run that ends with status 0 for each.
RUNS = [
    ("sim", "--path", ["sim", "dense", "--path", "{}", "--length", "5", "--out", "{dir}/a.lcm"], []),
    ("sim", "--path", ["sim", "forest3d", "--path", "{}", "--distance", "20", "--lidar", "none", "--standstill", "0", "--out", "{dir}/a.lcm"],
     ["stationary"]),  # The help says so.
    ("sim", "--forest", ["sim", "forest3d", "--forest", "{}", "--distance", "20", "--lidar", "none", "--standstill", "0", "--out", "{dir}/a.lcm"], []),
    ("sim", "--lidar", ["sim", "forest3d", "--lidar", "{}", "--distance", "20", "--standstill", "0", "--out", "{dir}/a.lcm"], []),
    ("sim changes", "--world", ["sim", "changes", "--world", "{}", "--no-lidar", "--copies", "1", "--out", "{dir}/{}"], []),
    ("export", "--format", ["export", "{dir}/run.lcm", "--format", "{}", "--out", "{dir}/out-{}"], ["geojson"]),  # Needs a georeferenced map.
]


def run(words):
    return subprocess.run(words, capture_output=True, text=True, timeout=120, stdin=subprocess.DEVNULL)


class Option:
    """One entry of a help: its first name, its choices and a value that it takes."""

    def __init__(self, found, text):
        names, self.type, self.kind, low, _, rest = found.groups()
        self.name = next((name for name in names.split(",") if name.startswith("--")), names)
        self.choices = self.kind[1:-1].split(",") if self.kind and self.kind.startswith("{") else []
        self.is_required = "REQUIRED" in rest
        self.count = int(count.group(1)) if (count := re.search(r"^ x (\d+)", rest)) else 1
        self.text = text
        self.low = low

    def words(self, value=None):
        value = value or (self.choices[0] if self.choices else __file__ if self.kind == "FILE" else self.low or "1")
        return [*([self.name] if self.name.startswith("-") else []), *[value] * self.count]


def options_of(text):
    """The options and positionals of a help."""
    entries = []
    for line in text.split("\nSubcommands:\n")[0].splitlines():
        if line.startswith("  ") and not line.startswith("   ") and (found := OPTION.match(line)):
            entries.append([found, re.split(r" {2,}", found.group(6), maxsplit=1)[-1]])
        elif entries and line.startswith("   "):
            entries[-1][1] += " " + line.strip()
        elif line and not line.startswith(" "):
            continue
    return [Option(found, text) for found, text in entries]


def commands(executable, words=()):
    """(words, help) of each command."""
    text = run([executable, *words, "--help"]).stdout
    yield list(words), text
    listed = re.search(r"^Subcommands:\n(.*)", text, re.MULTILINE | re.DOTALL)
    for name in re.findall(r"^  ([a-z][\w-]*)", listed.group(1), re.MULTILINE) if listed else []:
        if (words, name) != ((), "eval"):  # A program of its own.
            yield from commands(executable, (*words, name))


def problems_of_list(executable, words, options, option):
    needed = [word for one in options if one.is_required and one is not option for word in one.words()]
    call = [executable, *words, *needed]
    for choice in option.choices:
        said = run([*call, *option.words(choice), UNKNOWN]).stderr
        if UNKNOWN not in said:
            yield f"{' '.join(words)} {option.name} {choice}: named and not taken: {said.strip()}"
    said = run([*call, *option.words(WRONG), UNKNOWN]).stderr
    if UNKNOWN in said or option.name not in said:
        yield f"{' '.join(words)} {option.name} {WRONG}: not named and not refused: {said.strip()}"


def problems_of_words(words, option):
    found = IN_WORDS.search(option.text)
    if not found or option.choices or option.type != "TEXT":
        return
    known = WORDS.get((" ".join(words), option.name), ())
    if known == ():
        yield f"{' '.join(words)} {option.name} lists \"{found.group()}\" in words: braces (CLI::IsMember) or WORDS of this test"
    elif known:
        yield from (f"{' '.join(words)} {option.name} does not name {one}" for one in known[0] if not re.search(rf"\b{one}\b", option.text))


def problems_of_runs(understory, helps, folder):
    rows = [(*one[:2], one[2], [c for o in helps[one[0]] if o.name == one[1] for c in o.choices if c not in one[3]]) for one in RUNS]
    rows += [(*key, row[1], row[0]) for key, row in WORDS.items() if row]
    for command, name, template, choices in rows:
        if not choices:
            yield f"{command} {name}: no choices in its help"
        for choice in choices:
            done = run([understory, *(word.replace("{dir}", str(folder)).replace("{}", choice) for word in template)])
            if done.returncode != 0:
                yield f"{command} {name} {choice}: status {done.returncode}: {done.stderr.strip()}"


def prepare(understory, folder):
    """A short drive with the mapper's output, and a table of stems."""
    (folder / "stems.csv").write_text("x_m,y_m,dbh_m\n" + "".join(f"{8 * (i % 12)},{8 * (i // 12)},0.3\n" for i in range(144)))
    for words in (["sim", "dense", "--length", "20", "--out", folder / "drive.lcm"],
                  ["replay", folder / "drive.lcm", "--stages", "keyframer,geoslam_mapper", "--out", folder / "run.lcm"]):
        if (done := run([understory, *words])).returncode != 0:
            raise SystemExit(done.stderr)


def main(arguments):
    if len(arguments) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    wrong, lists, helps = [], 0, {}
    for executable in arguments:
        for words, text in commands(executable):
            options = options_of(text)
            if executable == arguments[0]:
                helps[" ".join(words)] = options
            for option in options:
                wrong += problems_of_words(words, option)
                if option.choices:
                    lists += 1
                    wrong += problems_of_list(executable, words, options, option)
    with tempfile.TemporaryDirectory() as folder:
        prepare(arguments[0], Path(folder))
        wrong += problems_of_runs(arguments[0], helps, Path(folder))
    print("\n".join(wrong) if wrong else f"{lists} lists of choices, as they are named")
    return 1 if wrong or lists < 30 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
