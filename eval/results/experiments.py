"""The list of stored results: what makes each, and how long it takes. Read by `tables.py` and `refresh`."""

from dataclasses import dataclass

FOREST_GRAPHS = """w100.graph g2o_intel.g2o sesync_CSAIL.g2o g2o_manhattanOlson3500.g2o
isam_manhattanOlson3500.txt""".split()
GRAPHS = ([f"DATA/pose_graphs/{name}" for name in FOREST_GRAPHS]
          + ["DATA/victoria_park_landmark/victoriaPark_isam.txt"]
          + [f"DATA/pose_graphs/{name}" for name in """isam_cityTrees10000.txt sesync_city10000.g2o parking-garage.g2o
tinyGrid3D.g2o smallGrid3D.g2o sphere2500.g2o torus3D.g2o rrr_NewCollege.g2o""".split()])


# Drives are made once for all partition experiments.
PARTITION = "--seed 1 --jobs 2 --front-end ideal,lidar --recordings OUT/partition-drives"
TOWN = f"{PARTITION} --runs 20 --lidar-runs 20 --routes urban"
COUNTRY = f"{PARTITION} --runs 20 --lidar-runs 20 --routes urban-countryside"
# Drives at their own speed, four minutes each (`deploy/campaign --long`).
RELIABILITY = "reliability --first-seed 1001 --length-m 1000 --config deploy/config/lidar"
SUBMAP_SIZES = "--size-m 20,100,200,300,400,500"


@dataclass(frozen=True)
class Experiment:
    """One result file `NAME.json`.

    `commands` are run in order from the root of the repository; `understory` stands for the built
    command, DATA for the folder of recordings ($UNDERSTORY_DATA) and OUT for the folder of new results.
    `minutes` is an estimate on two cores at 2.5 GHz. `needs` are folders or files below DATA.
    """

    name: str
    commands: tuple
    minutes: float
    needs: tuple = ()


def _eval(name, arguments, minutes, needs=(), before=()):
    return Experiment(name, (*before, f"understory eval {arguments} --json OUT/{name}.json"), minutes, needs)


def _recording(name, source, title, config, minutes, needs):
    """A recording: imported into a log first, then played through the whole chain."""
    named = f' --name "{title}"' if title else ""
    return _eval(name, f"recording OUT/{name}.lcm{named} --config deploy/config/{config}", minutes, needs,
                 before=(f"understory import {source} --out OUT/{name}.lcm",))


def _recorded_walks():
    """Two recorded walks of stem frames. The standard deviations are those of the recording's true poses (decision 156)."""
    unpack = ("mkdir -p OUT/recorded-walks",
              *(f"tar xzf DATA/stem_frames/{walk}.tar.gz -C OUT/recorded-walks" for walk in ("V01", "V02")))
    return _eval("recorded-walks", "shared-errors --recorded OUT/recorded-walks/V01 OUT/recorded-walks/V02 --truth-sigma-m 0.076 "
                 "--truth-sigma-deg 0.03 --runs 20 --seed 1 --jobs 2", 10, ("stem_frames",), before=unpack)


def _stem_frames():
    """Drives of stem frames through surveyed forests, on which the recogniser was not tuned, and their scores: each
    within itself, and all in one drive of another day. Forests lie 100 km apart, so a drive of one has
    no match in another."""
    woods = "DATA/stem_censuses/big_woods.csv --truth-offset 100000 --dbh-cm"
    longleaf = "DATA/tree_maps/longleaf.csv"
    drives = (
        ("longleaf-day-1", f"{longleaf} --path wander --length 1000 --seed 201"),
        ("longleaf-day-2", f"{longleaf} --path wander --length 1000 --seed 201 --visit 1"),
        ("waka-laps", "DATA/tree_maps/waka.csv --truth-offset 200000 --path laps --length 600 --seed 203"),
        ("big-woods-2008", f"{woods} dbh_2008_cm --path there-and-back --length 800 --seed 204"),
        ("big-woods-2014", f"{woods} dbh_2014_cm --path there-and-back --length 800 --seed 204 --visit 1"),
        ("kitti-00-way", f"{woods} dbh_2008_cm --path DATA/pole_maps/seq00_traj.csv --spacing 6 --seed 205"),
        ("longleaf-third", f"{longleaf} --path laps --length 1000 --seed 206 --seen 0.34"),
    )
    made = tuple(f"understory sim stem-frames {what} --out OUT/stem-frames/{name}" for name, what in drives)
    folders = " ".join(f"OUT/stem-frames/{name}" for name, _ in drives)
    maps = "OUT/stem-frames/longleaf-day-1 OUT/stem-frames/big-woods-2008"
    return _eval("place-recognition",
                 f"place-recognition {folders} --map {maps} --protocol within-50-frames between-5-m --jobs 2", 10,
                 ("tree_maps", "stem_censuses", "pole_maps"), before=made)


_BIG_WOODS = "DATA/stem_censuses/big_woods.csv --dbh-cm dbh_2014_cm --least-diameter 0.12"
_KITTI_00 = "--path DATA/pole_maps/seq00_traj.csv"
_KITTI_02 = "--path DATA/pole_maps/seq02_traj.csv"
_LOOP_DRIVES = (
    ("longleaf-laps", "DATA/tree_maps/longleaf.csv --length 1600 --seed 201"),
    ("lansing-wander", "DATA/tree_maps/lansing.csv --path wander --length 2500 --seed 202"),
    ("lansing-34", "DATA/tree_maps/lansing.csv --path laps --length 1800 --seed 203 --seen 0.34"),
    ("bigwoods-kitti00", f"{_BIG_WOODS} {_KITTI_00} --seed 205 --seen 0.5 --spacing 4 --range 15"),
    ("bigwoods-kitti02", f"{_BIG_WOODS} {_KITTI_02} --seed 206 --range 18"),
    ("bei-kitti00", f"DATA/tree_maps/bei.csv {_KITTI_00} --seed 207"),
)
_STRANGE_DRIVES = tuple(
    (f"{wood}-{way}-{seed}", f"{stems} {path} --seed {seed} --seen {0.34 if seed % 2 else 0.64}")
    for seed in range(220, 230)
    for wood, stems in (("bei", "DATA/tree_maps/bei.csv"), ("bigwoods", f"{_BIG_WOODS} --range 18"))
    for way, path in (("kitti00", _KITTI_00), ("kitti02", _KITTI_02)))


def _loops(name, drives, options, minutes):
    """Drives of stem frames that come back, with the loop closer and without, and the batch solution. Nothing was tuned on
    these seeds."""
    made = tuple(f"understory sim stem-frames {what} --out OUT/{name}-frames/{drive}" for drive, what in drives)
    folders = " ".join(f"OUT/{name}-frames/{drive}" for drive, _ in drives)
    return _eval(name, f"loops {folders} {options} --jobs 2", minutes, ("tree_maps", "stem_censuses", "pole_maps"), before=made)


EXPERIMENTS = (
    _eval("paths", "paths --errors independent,shared,shared-wide --runs 10 --seed 1 --jobs 2", 24),
    _eval("paths-lidar", "paths --method lidar --runs 10 --seed 2 --jobs 2", 14),
    _eval("density", "density --runs 10 --seed 1 --jobs 2", 8),
    _eval("noise", "noise --errors independent,shared,shared-wide --runs 5 --seed 1 --jobs 2 --interval 20", 27),
    _eval("noise-10cm", "noise --runs 2 --seed 1 --jobs 2 --interval 10", 25),
    _eval("baseline-batches", "paths --path circle --method baseline --runs 200 --seed 3 --jobs 2 --no-plots", 12),
    _eval("baseline-paths",
          "paths --path line,double-circle,square,triangle --method baseline --runs 100 --seed 3 --jobs 2 --no-plots",
          25),
    _eval("large-map", "large-map --runs 10 --seed 1 --method smoothing", 4),
    _eval("one-shot", "one-shot --scans 1500 --seed 12 --jobs 2 --data DATA", 10, ("tree_maps", "stem_censuses")),
    _eval("map-merge", "map-merge --trials 100 --drives 40 --seed 1 --jobs 2 --data DATA", 5,
          ("tree_maps", "stem_censuses")),
    _stem_frames(),
    _loops("loops", _LOOP_DRIVES, "--runs 3 --seed 301", 3),
    _loops("loops-blind", _LOOP_DRIVES, "--runs 3 --seed 301 --blind 0.1-0.45", 3),
    _loops("loops-strangers", _STRANGE_DRIVES, "--reckon --seed 401", 5),
    _eval("shared-errors", "shared-errors --data DATA --errors shared --seed 1 --jobs 2", 6,
          ("tree_maps", "stem_censuses", "pole_maps")),
    _recorded_walks(),
    _eval("few-landmarks", "few-landmarks --seeds 20 --first-seed 101 --config deploy/config/planar --jobs 2", 2),
    _eval("returns", "returns --runs 12 --seed 13100 --jobs 2 --map DATA/tree_maps/longleaf.csv DATA/tree_maps/lansing.csv DATA/tree_maps/bei.csv", 10,
          ("tree_maps",)),
    _eval("loop-detectors", "loop-detectors --queries 250 --cloud-queries 60 --length-m 900 --seed 1 --jobs 2 --data DATA",
          25, ("tree_maps", "stem_censuses", "pole_maps", "victoria_park_raw")),
    _eval("existence", "existence --runs 40 --seed 1 --jobs 2 --data DATA", 4, ("stem_censuses", "tree_existence")),
    _eval("existence-drives", "existence-drives --runs 4 --seed 1 --jobs 2", 8),
    _eval("existence-needed", "existence-needed --runs 10 --seed 1 --jobs 2", 8),
    _eval("existence-census", "existence-census --errors independent,shared --seed 1 --jobs 2 --data DATA", 20, ("stem_censuses", "tree_existence")),
    _eval("existence-camera", "existence-camera --runs 3 --seed 1 --jobs 2", 6),
    _eval("partition", f"partition {TOWN} {SUBMAP_SIZES}", 12),
    _eval("partition-dynamic", f"partition-dynamic {TOWN}", 3),
    _eval("partition-loop", f"partition-loop {TOWN} {SUBMAP_SIZES}", 3),
    _eval("partition-dynamic-loop", f"partition-dynamic-loop {TOWN}", 3),
    _eval("partition-country", f"partition {COUNTRY} {SUBMAP_SIZES}", 15),
    _eval("partition-dynamic-country", f"partition-dynamic {COUNTRY}", 3),
    _eval("partition-designs", "partition --runs 3 --seed 1 --jobs 2 --routes road --size-m 5,20,100 --all-designs", 3),
    _eval("long-drive", "long-drive --runs 20 --seed 1 --length-m 1000 --size-m 5,10,20,40,100", 6),
    _eval("long-drive-100km", "long-drive --runs 1 --seed 6 --length-m 100000 --size-m 20 --hand-over-m 300 --no-uncut --sections 10 --no-plots", 3),
    _eval("long-drive-loop", "long-drive-loop --runs 20 --seed 1 --size-m 5,10,20,40,100", 7),
    _eval("efficiency", "efficiency --drive-km 10 --stationary-h 2 --hand-over-m 300", 6),
    _eval("laps", "laps --laps 100 --length-m 317 --hours 24", 45),
    _eval("laps-held", "laps --laps 3 --length-m 100 --hours 2 --localise-in OUT/laps-held.gpkg --no-plots", 6),
    _eval("health", "health --drives 1000 --seed 1", 8),
    _eval("closures", "closures --runs 100 --plantations 4 --seed 1 --jobs 2", 8),
    _eval("gaps", "gaps --seeds 5 --first-seed 801 --jobs 2", 15),
    _eval("mountings", "mountings --drives 9 --faults 23 --sound-drives 40 --first-seed 1001 --jobs 2", 4),
    _eval("reliability-load-0", f"{RELIABILITY} --drives 28 --jobs 4 --load 0", 31),
    _eval("reliability-undelayed", f"{RELIABILITY} --drives 28 --jobs 2 --undelayed", 6),
    _eval("reliability-load-8", f"{RELIABILITY} --drives 2 --load 8", 10),
    _eval("misstated", "misstated --runs 10 --seed 2001", 4),
    _eval("victoria-park", "victoria-park --data DATA", 1, ("victoria_park_raw", "victoria_park_landmark")),
    _eval("frontend-chain", "frontend --only chain --config deploy/config/lidar --jobs 2 --data DATA", 25,
          ("pole_maps",)),
    _eval("frontend-forest", "frontend --only forest --config deploy/config/lidar --no-plots", 3),
    _eval("frontend-planar", "frontend --runs 20 --seed 1 --only planar --no-plots", 1),
    _eval("frontend-limit", "frontend --only limit --config deploy/config/lidar --seed 101 --jobs 2 --no-plots", 12),
    _eval("frontend-parts", "frontend --runs 20 --jobs 1 --only extraction tracking", 10),
    _eval("forest-plots", "frontend --only forest-plots --data DATA", 8, ("forest_3d_scans",)),
    _eval("frontend-filter", "frontend --runs 1000 --jobs 2 --only filter", 60),
    _eval("frontend-mismatch", "frontend --runs 20 --seed 11 --only mismatch", 6),
    _eval("wheels", "wheels --seeds 20 --first-seed 100 --length-m 500 --lidar vlp16 --jobs 2", 30),
    _eval("frontend-filter-lidar", "frontend --runs 150 --seed 7 --jobs 2 --only filter", 20),
    _eval("frontend-faults", "frontend --only faults --config deploy/config/lidar", 6),
    _eval("landmarks-vs-error", "landmarks-vs-error --seed 1 --jobs 2", 10),
    _recording("recording-victoria-park", "victoria-park DATA/victoria_park_raw/victoria_park_ascii.zip --raw",
               "Victoria Park", "victoria_park", 1, ("victoria_park_raw",)),
    _recording("recording-kitti-0002", "kitti DATA/kitti_raw_drive0002 --speed-as-wheels", "k2", "kitti", 1,
               ("kitti_raw_drive0002",)),
    _recording("recording-kitti-0005", "kitti-reduced DATA/kitti_raw_drive0005_16ring", "k5", "kitti", 1,
               ("kitti_raw_drive0005_16ring",)),
    _recording("recording-vlp16", "pcap DATA/lidar_packets/velodyne_vlp16_gps.pcap", "VLP-16 capture", "kitti", 1,
               ("lidar_packets",)),
    _eval("backend", "backend --streets 20000 --data " + " ".join(GRAPHS), 15,
          ("pose_graphs", "victoria_park_landmark")),
)


def experiment(name):
    """The experiment of that name. Raises KeyError for an unknown one."""
    for entry in EXPERIMENTS:
        if entry.name == name:
            return entry
    raise KeyError(name)


def printed(command, name):
    """The command as a reader types it: results go to the current folder."""
    return command.replace("OUT/", "")
