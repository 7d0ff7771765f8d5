"""Makes a folder of tests/formats: small logs and maps of everything that a build writes."""

import gzip
import json
import os
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import formats

CONFIG = formats.HERE.parents[1] / "deploy" / "config"
#: The drive that is replayed, and in whose map it is replayed again.
DRIVE = ("intermediate", "--path", "circle", "--length", "40", "--interval", "0.5", "--sensor-range", "15", "--noise", "0.05", "--wheels", "--seed", "7")
#: A drive on which submaps go to the store.
LONG = ("intermediate", "--path", "line", "--length", "250", "--interval", "0.5", "--sensor-range", "12", "--noise", "0.05", "--wheels", "--seed", "7")
#: One that comes back to its beginning: a loop closure.
LOOP = ("intermediate", "--path", "double-circle", "--length", "400", "--interval", "0.5", "--sensor-range", "15", "--wheels", "--seed", "7")
#: From raw sensors.
RAW = ("forest3d", "--distance", "20", "--standstill", "3", "--lidar", "vlp16", "--planar-laser", "--seed", "3")
SURVEY = "x,y,dbh_cm\n401000.5,5654000.25,31\n401012.75,5654003.5,\n401007,5654011.125,18.5\n"
BUS = "udpm://239.255.76.97:7697?ttl=0"


def configuration(folder, base, parameters):
    """A folder that differs from another one by parameters of some processes."""
    folder.mkdir()
    (folder / "launch.toml").write_text(f'base = "{base}"\n')
    for process, text in parameters.items():
        (folder / f"{process}.toml").write_text(f'base = "{base / process}.toml"\n{text}')
    return folder


def drive_with_the_store(understory, config, scratch):
    """A map file as the store keeps it: real processes, since a replay's files are temporary."""
    programs = understory.build / "bin"
    state = scratch / "state"
    log = scratch / "live.lcm"
    launch = subprocess.Popen([programs / "understory", "launch", "--config", config, "--lcm-url", BUS, "--state-dir", state],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=os.environ)
    recorder = subprocess.Popen([programs / "understory", "log", "record", log, "--lcm-url", BUS], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(3)
    understory("sim", *LONG, "--lcm-url", BUS, "--rate", "20")
    time.sleep(2)
    for process in (launch, recorder):
        process.send_signal(signal.SIGINT)
        process.wait(60)
    return next((state / "submap_store" / "maps").glob("*.gpkg")), log


def smallest_of_each_channel(logs, out):
    """A log of one message of each channel: its smallest one."""
    from understory import log

    found = {}
    for file in logs:
        for event in log.read(file):
            if event.message is None:
                continue
            before = found.get(event.channel)
            if before is None or len(event.data) < len(before.data):
                found[event.channel] = event
    with log.LogWriter(out) as writer:
        for _, event in sorted(found.items()):
            writer.write(event.utime, event.channel, bytes(event.data))


def make(understory, folder):
    folder.mkdir()
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        out = scratch / "out"
        out.mkdir()
        scans = configuration(scratch / "scans", CONFIG / "lidar", {"landmark_extractor": "[place_scan]\nperiod_s = 0.5\n"})
        hands_over = configuration(scratch / "hands-over", CONFIG, {"geoslam_mapper": "[smoothing]\nuse_odometry = true\nhand_over_m = 40.0\ncondense_m = 10.0\n"})
        runs = []
        for which, config in ((DRIVE, CONFIG), (RAW, scans), (LONG, hands_over), (LOOP, hands_over)):
            drive, run = scratch / f"{len(runs)}.lcm", scratch / f"{len(runs)}-run.lcm"
            understory("sim", *which, "--out", drive)
            understory("replay", drive, "--config", config, "--out", run)
            runs.append(run)

        understory("log", "cut", scratch / "0.lcm", "--out", out / "drive.lcm")
        stored, live = drive_with_the_store(understory, hands_over, scratch)
        smallest_of_each_channel([*runs, live], out / "channels.lcm")
        understory("map", "import", runs[0], "--out", out / "drive.gpkg")
        (scratch / "survey.csv").write_text(SURVEY)
        understory("map", "import", scratch / "survey.csv", "--out", out / "survey.gpkg", "--crs", "EPSG:25832")
        understory("map", "info", stored)  # Seals it.
        (out / "stored.gpkg").write_bytes(stored.read_bytes())

        expected = {"files": {file.name: formats.reading_of(understory, file, scratch) for file in sorted(out.iterdir())}}
        expected["replayed_poses"] = formats.replay_of(understory, out, scratch)[0]
        for file in sorted(out.iterdir()):
            (folder / f"{file.name}.gz").write_bytes(gzip.compress(file.read_bytes(), 9, mtime=0))
    (folder / "expected.json").write_text(json.dumps(expected, indent=1) + "\n")
