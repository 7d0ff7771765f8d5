#!/usr/bin/env python3
"""What the guide and the READMEs of all folders name exists: files of the tree, parameters, commands with their options.

    names.py --understory COMMAND [ROOT]

A file is any `path/to/file` whose first part is a folder of the tree; what its name goes on with may be missing (`docs/decisions/020`). Parameters are the first cells of the tables in docs/tuning.md, in the
section of their process; docs/parameters.md, made from the processes, has all. Processes and channels of the picture of the architecture are those of
services/*/adapter.hpp. A command is `understory WORD ...` in code: `--help` of its
words must succeed and name its options.
"""
import argparse
import functools
import pathlib
import re
import subprocess
import sys

CODE = re.compile(r"```[^\n]*\n(.*?)```|`([^`\n]+)`", re.DOTALL)
PATH = re.compile(r"[\w.-]+(?:/[\w.-]+)+/?")
COMMAND = re.compile(r"(?:^|[\s/$])understory((?: [a-z][a-z0-9-]*(?:\|[a-z-]+)*)+)(.*)")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
SECTION = re.compile(r"^## (.+)$", re.MULTILINE)
# Folders that a build or a run makes, and names in the place of which a reader puts another one.
MADE = ("build/", "out/", "state/")


def pages(root):
    """The guide and all READMEs. What tells of earlier versions (decisions, results, changes) may name what is gone."""
    readmes = [root / "README.md"]
    for folder in (entry for entry in root.iterdir() if entry.is_dir() and entry.name not in ("build", "out", "docs")):
        readmes += [file for file in folder.rglob("README.md") if "node_modules" not in file.parts and file != root / "eval/results/README.md"]
    return sorted({*readmes, *(root / "docs").glob("*.md"), *(root / "docs/stages").glob("*.md")})


def code(text):
    """Each line of code blocks and each code span."""
    for block, span in CODE.findall(text):
        yield from (block or span).splitlines()


def missing_files(root, page, lines):
    folders = {entry.name for entry in root.iterdir() if entry.is_dir()}
    for line in lines:
        for path in PATH.findall(line):
            named = path.split("/")[0] in folders and not path.startswith(MADE) and "NAME" not in path
            if named and not (root / path).exists() and not list(root.glob(path.rstrip("/") + "[.-]*")):
                yield f"{page}: {path} is not there"


def missing_parameters(root):
    sections = {}
    head = None
    for line in (root / "docs/parameters.md").read_text().splitlines():
        if line.startswith("## "):
            head = line.removeprefix("## ").removeprefix("understory-").replace("-", "_")
        elif found := re.match(r"\| `([\w.]+)` \|", line):
            sections.setdefault(head, set()).add(found.group(1))
    text = (root / "docs/tuning.md").read_text()
    parts = SECTION.split(text)[1:]
    for process, body in zip(parts[::2], parts[1::2]):
        known = set().union(*(sections.get(name, set()) for name in [*process.split(", "), "Every process"]))
        if not known:
            yield f"docs/tuning.md: \"{process}\" is no process"
        for row in re.findall(r"^\| (`[^|]+`) \|", body, re.MULTILINE):
            for key in re.findall(r"`([^`]+)`", row):
                if key not in known:
                    yield f"docs/tuning.md: {process} has no parameter {key}"


def missing_in_picture(root):
    """The picture of the architecture: boxes of processes, labels with channels."""
    mains = sorted((root / "services").glob("*/main.cpp"))
    processes = {main.parent.name for main in mains}
    channels = {channel for main in mains
                for channel in re.findall(r'\ball\.(?:in|out)\(\s*"([A-Z0-9_]+)"', (main.parent / "adapter.hpp").read_text())}
    text = (root / "docs/pictures/architecture.svg").read_text()
    boxes = set(re.findall(r'class="n"[^>]*>([a-z_]+)<', text))
    labels = {name for label in re.findall(r'class="l"[^>]*>([^<]+)<', text) for name in re.findall(r"\b[A-Z][A-Z_]{2,}\b", label)}
    yield from (f"architecture.svg: no channel {name}" for name in sorted(labels - channels - {"HEALTH"}))
    drivers = {name for name in processes if name.endswith("_driver")}  # One box for all.
    yield from (f"architecture.svg: no box for {name}" for name in sorted(processes - drivers - boxes))
    yield from (f"architecture.svg: no process {name}" for name in sorted(boxes - processes - {"sensors"}))


@functools.cache
def printed_help(understory, words):
    return subprocess.run([understory, *words, "--help"], capture_output=True, text=True, timeout=60, check=True).stdout


def help_of(understory, words):
    """The help of a command; None where a word is neither a subcommand nor the first argument of a command."""
    text = printed_help(understory, ())
    for i, word in enumerate(words):
        listed = re.search(r"^Subcommands:\n(.*)", text, re.MULTILINE | re.DOTALL)
        names = re.findall(r"^  ([a-z][\w, -]*?)(?:  |$)", listed.group(1), re.MULTILINE) if listed else []
        if any(word in name.split(", ") for name in names):
            text = printed_help(understory, words[:i + 1])
        else:
            return text if "Positionals:" in text else None
    return text


def missing_commands(understory, page, lines):
    for line in lines:
        found = COMMAND.search(line.split("#")[0])
        if not found:
            continue
        words, rest = found.groups()
        for last in words.split()[-1].split("|"):
            call = (*words.split()[:-1], last)
            text = help_of(understory, call)
            if text is None:
                yield f"{page}: `understory {' '.join(call)}` is no command"
            if text is None or "Subcommands:" in text and "Positionals:" not in text:
                continue  # Options behind a group are those of its subcommands.
            for option in OPTION.findall(rest.split(" understory ")[0].split("|")[0]):
                if option != "--help" and option not in text:
                    yield f"{page}: `understory {' '.join(call)}` has no option {option}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--understory", required=True)
    parser.add_argument("root", nargs="?", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[2])
    options = parser.parse_args()
    wrong, counted = [*missing_parameters(options.root), *missing_in_picture(options.root)], 0
    for file in pages(options.root):
        lines = list(code(file.read_text()))
        page = file.relative_to(options.root)
        wrong += [*missing_files(options.root, page, lines), *missing_commands(options.understory, page, lines)]
        counted += len(lines)
    print("\n".join(wrong) if wrong else f"{len(pages(options.root))} pages, {counted} pieces of code: all names exist")
    return 1 if wrong or counted == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
