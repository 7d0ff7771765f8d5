"""Runs the sessions of guides and compares their output with what the guides show.

    check.py --understory COMMAND --inputs DOC_INPUTS [--update] GUIDE.md...

A session is a block between ``` whose first line begins with "$ ". The commands of all guides run in one new folder, in the order of the guides: DOC_INPUTS
has made the recordings there, `deploy` is that of the tree, and "$ cat FILE" makes the file. Numbers may differ by 2 % or by one in the last digit shown: other processors round otherwise. A
block after a line "<!-- not run: REASON -->" is left out and counted. --update writes into the guide what the commands print.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
RELATIVE = 0.02


def sessions(lines):
    """(first line, last line, reason why not) of each block that is a session; the last one is excluded."""
    begin, reason = None, None
    for i, line in enumerate(lines):
        if line.startswith("<!-- not run:"):
            reason = line
        elif line.startswith("```") and begin is None:
            begin = i + 1
        elif line.startswith("```"):
            if lines[begin].startswith("$ "):
                yield begin, i, reason
            begin, reason = None, None


def commands(block):
    """(command, expected lines) of a session."""
    found = []
    for line in block:
        if line.startswith("$ "):
            found.append((line[2:], []))
        else:
            found[-1][1].append(line)
    return found


def same(shown, said):
    """Whether two lines are the same but for the rounding of numbers."""
    if NUMBER.sub("#", re.sub(r"\s+", " ", shown)) != NUMBER.sub("#", re.sub(r"\s+", " ", said)):
        return False
    for a, b in zip(NUMBER.findall(shown), NUMBER.findall(said)):
        digit = 10.0 ** -len(a.partition(".")[2])
        if abs(float(a) - float(b)) > max(RELATIVE * abs(float(a)), 1.01 * digit):
            return False
    return True


def run(command, folder, environment):
    done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=250)
    return done.stdout.decode().splitlines()


def check(guide, folder, environment, update):
    """Whether all sessions of one guide print what it shows."""
    lines = guide.read_text().splitlines()
    blocks = list(sessions(lines))
    left_out = [reason for _, _, reason in blocks if reason]
    wrong, ran, changed = 0, 0, {}
    for begin, end, reason in blocks:
        if reason:
            continue
        new = []
        for command, shown in commands(lines[begin:end]):
            if command.startswith("cat "):
                (pathlib.Path(folder) / command[4:].strip()).write_text("\n".join(shown) + "\n")
            said = run(command, folder, environment)
            ran += 1
            new += ["$ " + command, *said]
            if len(said) == len(shown) and all(map(same, shown, said)):
                continue
            wrong += 1
            print(f"{guide}:{begin + 1}: $ {command}", *("  guide:   " + line for line in shown), *("  command: " + line for line in said), sep="\n")
        changed[begin] = (end, new)
    print(f"{guide}: {ran} commands run, {wrong} print otherwise than the guide shows, {len(left_out)} sessions not run")
    if update:
        for begin in sorted(changed, reverse=True):
            end, new = changed[begin]
            lines[begin:end] = new
        guide.write_text("\n".join(lines) + "\n")
        return True
    if ran == 0:
        print(f"{guide}: no session in it")
    return wrong == 0 and ran > 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("guides", type=pathlib.Path, nargs="+")
    parser.add_argument("--understory", required=True)
    parser.add_argument("--inputs", required=True)
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([pathlib.Path(options.inputs).resolve(), folder], check=True)
        (pathlib.Path(folder) / "deploy").symlink_to(pathlib.Path(__file__).resolve().parents[2] / "deploy")
        environment = dict(os.environ, PATH=f"{pathlib.Path(options.understory).resolve().parent}:{os.environ['PATH']}", HOME=folder)
        results = [check(guide, folder, environment, options.update) for guide in options.guides]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
