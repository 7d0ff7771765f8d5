#!/usr/bin/env python3
"""Runs the checks with the packages of the formats' own makers; see README.md beside this folder.

Packages go into the build directory, never into the source tree. Exit status 77 = skipped: there is no npm, or its registry
cannot be reached.
"""
import argparse
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
SKIPPED = 77
OLDEST_NODE = 18
INSTALL = ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts", "--prefer-offline", "--fetch-retries=1"]
# What npm says where it is the network that fails; everything else is a fault of ours.
UNREACHABLE = ("ENOTFOUND", "EAI_AGAIN", "ECONNREFUSED", "ECONNRESET", "ETIMEDOUT", "ENETUNREACH", "EHOSTUNREACH", "ENOTCACHED",
               "E403", "E502", "E503", "ERR_SOCKET_TIMEOUT")


def skip(why):
    """Ends as skipped."""
    print(f"skipped: {why}")
    sys.exit(SKIPPED)


def require_node():
    """Skips without a node and npm that are new enough."""
    for program in ("node", "npm"):
        if shutil.which(program) is None:
            skip(f"{program} is not installed (Debian packages nodejs, npm)")
    version = subprocess.run(["node", "--version"], capture_output=True, text=True, check=True).stdout.strip()
    if int(version.lstrip("v").split(".")[0]) < OLDEST_NODE:
        skip(f"node {version} is older than {OLDEST_NODE}")


def install(build):
    """The packages of the lock file, once for each of its contents."""
    build.mkdir(parents=True, exist_ok=True)
    for file in HERE.glob("*.js*"):
        shutil.copy(file, build)
    lock = (HERE / "package-lock.json").read_text()
    stamp = build / "installed-lock.json"
    if stamp.exists() and stamp.read_text() == lock:
        return
    try:
        done = subprocess.run(INSTALL, cwd=build, capture_output=True, text=True, timeout=200, check=False)
    except subprocess.TimeoutExpired:
        skip("npm ci: no answer from the registry")
    if done.returncode != 0:
        said = done.stdout + done.stderr
        if any(code in said for code in UNREACHABLE):
            skip("npm ci: the registry cannot be reached")
        sys.exit(f"npm ci failed:\n{said}")
    stamp.write_text(lock)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=lambda text: pathlib.Path(text).resolve(), required=True, help="directory for packages and files")
    parser.add_argument("--understory", required=True, help="the command")
    parser.add_argument("--peer", type=lambda text: pathlib.Path(text).resolve(), required=True, help="foxglove_test_peer")
    options = parser.parse_args()

    require_node()
    install(options.build)
    log = options.build / "drive.lcm"
    file = options.build / "drive.mcap"
    subprocess.run([options.peer, "log", log], check=True)
    subprocess.run([options.understory, "export", log, "--format", "mcap", "--out", file], check=True)
    for check in (["check_schemas.js", file], ["check_mcap.js", file], ["check_client.js", options.peer, log]):
        subprocess.run(["node", *map(str, check)], cwd=options.build, check=True, timeout=120)
    return 0


if __name__ == "__main__":
    sys.exit(main())
