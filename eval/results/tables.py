#!/usr/bin/env python3
"""Writes eval/results/README.md and the results in the project's README.md from eval/results/*.json.

  tables.py           write both
  tables.py --check   change nothing; exit status 1 when either is out of step, or a picture is stored that no page names
"""

import json
import re
import sys
from pathlib import Path

sys.dont_write_bytecode = True
import pictures  # noqa: E402
import render  # noqa: E402
import render_closures  # noqa: E402
import render_existence  # noqa: E402
import render_gaps  # noqa: E402
import render_mountings  # noqa: E402
import render_partition  # noqa: E402
import render_places  # noqa: E402
import render_reliability  # noqa: E402
import render_returns  # noqa: E402
from experiments import EXPERIMENTS, printed  # noqa: E402

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
BEGIN, END = "<!-- results: begin (eval/results/tables.py) -->", "<!-- results: end -->"

# Documents of before the field "date": the day on which they were stored.
STORED_ON = {name: "2026-11-21" for name in ("density", "large-map", "noise", "noise-10cm", "paths", "frontend-filter",
                                             "baseline-batches", "baseline-paths")}
STORED_BY_DEFAULT = "2026-11-22"

GEOSLAM = "GeoSLAM (Castellarin 2024)"
PARTITION = "the thesis on map partition (Relfsson 2020)"


def _accuracy(summary):
    return lambda document: [*summary(document), "", *render.folded("all rows", render.accuracy_rows(document))]


def _noise(document):
    return [*render.noise_matrix(document), "", *render.noise_worst(document), "", *render.noise_shared(document),
            *render.folded("all rows", render.accuracy_rows(document))]


def _figures(document):
    return render.figures(document["rows"])


# Name of the result, title, published beside it, table.
SECTIONS = (
    ("paths", "Accuracy on six paths", f"{GEOSLAM}, Table 5.4",
     _accuracy(lambda document: render.accuracy_summary(document, "path"))),
    ("paths-lidar", "The same paths from simulated LIDAR", f"{GEOSLAM}, Table 5.4", render.accuracy_rows),
    ("density", "Accuracy in three forests", f"{GEOSLAM}, Table 5.5",
     _accuracy(lambda document: render.accuracy_summary(document, "forest"))),
    ("noise", "Noise and detection rate, a scan every 20 cm", f"{GEOSLAM}, Tables 5.6 and 5.7", _noise),
    ("noise-10cm", "Noise and detection rate, a scan every 10 cm", f"{GEOSLAM}, Tables 5.6 and 5.7", _noise),
    ("baseline-batches", "GeoSLAM's method in batches: circle", f"{GEOSLAM}, Table 5.4", render.batches),
    ("baseline-paths", "GeoSLAM's method in batches: other paths", f"{GEOSLAM}, Table 5.4", render.batches),
    ("large-map", "One-shot localisation in a square kilometre", f"{GEOSLAM}, §5.4", render.large_map),
    ("one-shot", "One-shot localisation in surveyed forests", None, render.one_shot),
    ("map-merge", "Two maps become one", None, render_places.map_merge),
    ("place-recognition", "Frames of stems found again", None, render_places.place_recognition),
    ("loops", "Loops found while tracking goes on", None, render_places.loops),
    ("loops-blind", "Loops found while tracking goes on, no stem seen on a third of the way", None, render_places.loops),
    ("loops-strangers", "Queries that have no match", None, render_places.loop_queries),
    ("shared-errors", "Detections that share errors from frame to frame", None, render_places.shared_errors),
    ("recorded-walks", "Recorded walks among detected stems", None, render_places.shared_errors),
    ("closures", "Wrong loop closures that agree, and ways to keep them out", None, render_closures.closures),
    ("few-landmarks", "Two or three landmarks in a scan", None, render_places.few_landmarks),
    ("returns", "Drives that drift and come back near themselves", None, render_returns.returns),
    ("loop-detectors", "Loop detectors and verifiers", "named in the thesis on submaps, §2.4, without figures",
     render_places.loop_detectors),
    ("existence", "What is still there", None, render_existence.existence),
    ("existence-drives", "A forest that changes, from raw LIDAR", None, render_existence.existence_drives),
    ("existence-needed", "When to map again, from raw LIDAR", None, render_existence.existence_needed),
    ("existence-census", "Big Woods at both censuses, through the processes", None, render_existence.existence_census),
    ("existence-camera", "A camera that comes back to an old map", None, render_existence.existence_camera),
    ("partition", "The map cut after a distance: town", f"{PARTITION}, Table 5.1", render_partition.partition_all),
    ("partition-country", "The map cut after a distance: town to country", f"{PARTITION}, Table 5.2", render_partition.partition_all),
    ("partition-loop", "The map cut after a distance, closed", f"{PARTITION}, Table 5.3", render_partition.partition_all),
    ("partition-dynamic", "The map cut by landmarks, turns and size: town", f"{PARTITION}, Table 5.4", render_partition.partition_all),
    ("partition-dynamic-country", "The map cut by landmarks, turns and size: town to country", f"{PARTITION}, Table 5.5",
     render_partition.partition_all),
    ("partition-dynamic-loop", "The map cut by landmarks, turns and size, closed", f"{PARTITION}, Table 5.6",
     render_partition.partition_all),
    ("partition-designs", "Ways to condense a submap", None, render_partition.partition_designs),
    ("long-drive", "A road with its path condensed behind the vehicle", None, render_partition.long_drive),
    ("long-drive-100km", "100 km of road with submaps on the disk", None, render_partition.long_drive_sections),
    ("long-drive-loop", "The same round a block of 700 m", None, render_partition.long_drive),
    ("efficiency", "Time per keyframe", f"{GEOSLAM}, §5.5 (a figure only)", render.efficiency),
    ("laps", "Known ground: what must not grow", None, render.laps),
    ("laps-held", "Localisation only: what must not change", None, render.laps),
    ("health", "What HEALTH says of wrong poses", None, render.health),
    ("reliability-load-0", "Real processes while messages and processes are late", None, render_reliability.reliability),
    ("reliability-undelayed", "The same drives without delays", None, render_reliability.undelayed),
    ("reliability-load-8", "The same on a busy computer", None, render_reliability.reliability),
    ("gaps", "Processes that hang, sensors that are silent", None, render_gaps.gaps),
    ("mountings", "Wrong mountings, units and signs of sensors", None, render_mountings.mountings),
    ("misstated", "Sensors that are not as stated", None, render.misstated),
    ("victoria-park", "A real drive: Victoria Park", "stated figures of the batch solution", render.victoria_park),
    ("frontend-chain", "From raw sensors: simulated drives", None, _figures),
    ("frontend-forest", "From raw sensors: the forest drive alone", None, _figures),
    ("recording-victoria-park", "From raw sensors: Victoria Park", None, _figures),
    ("recording-kitti-0002", "From raw sensors: KITTI 0002", None, _figures),
    ("recording-kitti-0005", "From raw sensors: KITTI 0005", None, _figures),
    ("recording-vlp16", "From raw sensors: VLP-16 packets", None, _figures),
    ("frontend-limit", "The limit of the whole chain", None, _figures),
    ("frontend-planar", "A laser with one plane while the vehicle turns", None, _figures),
    ("frontend-parts", "Extraction and tracks", None, _figures),
    ("forest-plots", "Trunks in real forest plots", None, _figures),
    ("frontend-filter", "The filter's consistency", None, _figures),
    ("frontend-mismatch", "The filter where its assumptions are wrong", None, _figures),
    ("wheels", "Do wheels help?", None, _figures),
    ("frontend-filter-lidar", "The filter behind the simulated LIDAR", None, _figures),
    ("frontend-faults", "Faults of sensors", None, _figures),
    ("landmarks-vs-error", "Error against the number of landmarks", f"{PARTITION}, ch. 4 (figures only)",
     render.landmarks_vs_error),
    ("backend", "The smoother on standard graphs", "stated figures of GTSAM's ISAM2",
     lambda document: [*render.backend(document), *render.backend_moments(document), "",
                       *render.backend_shares(document)]),
)

HEADER = f"""# eval/results

Generated by `eval/results/tables.py` from the result files beside it and from `remarks.md`: do not edit. `eval/results/refresh`
makes the result files anew. JSON is written by `understory eval --json`; traces beside it are not stored.

Methods: **smoothing** is this project's method; **baseline** is the method of GeoSLAM, rebuilt here; **oracle** is the
maximum-likelihood limit with true association, on the same runs; **published** is what a thesis prints. RPE and LPE are errors of
all poses and landmarks over all states of the map, as GeoSLAM §4.5.8 defines them, here in cm as "RPE / LPE"; ratios are
smoothing / oracle. NEES is shown with its exact mean in brackets.

The published figures are those of

- D. Castellarin, *Geo-SLAM: Using Geometric Hierarchies to Support Localization and Mapping in Forest Environments*, Master's
  thesis, Rochester Institute of Technology, 2024;
- E. Relfsson, *Map Partition and Loop Closure in a Factor Graph Based SAM System*, Master's thesis, Linköping University,
  LiTH-ISY-EX-20/5350-SE, 2020.

Accuracy follows from the seed alone. Times are those of the machine that a table names.
"""


def load(name):
    """The stored document of that name, or none."""
    file = HERE / f"{name}.json"
    return json.loads(file.read_text()) if file.exists() else None


def stored():
    """All documents of the sections, by name."""
    return {name: document for name, *_ in SECTIONS if (document := load(name)) is not None}


def remarks():
    """Parts of remarks.md by their heading."""
    parts = re.split(r"^## (.+)$", (HERE / "remarks.md").read_text(), flags=re.MULTILINE)
    return {name.strip(): text.strip() for name, text in zip(parts[1::2], parts[2::2])}


def provenance(name, document, versions):
    """Version, date, seed, machine and command of a table, and whether it is to be made again."""
    date = document.get("date", STORED_ON.get(name, STORED_BY_DEFAULT))
    seed = document["config"].get("seed", "none")
    version = document["version"]
    machine = document["machine"]
    lines = [f"Version `{version}`, {date}, seed {seed}, {machine['cpu']}, {machine['cores']} cores.", "", "```"]
    command = next(entry for entry in EXPERIMENTS if entry.name == name)
    lines += [printed(line, name) for line in command.commands] + ["```"]
    if version.endswith("-dirty"):
        lines += ["", "**To be made again**: this table comes from a tree with changes that were not committed."]
    elif versions > 1:
        lines += ["", f"**To be made again**: the tables of this page come from {versions} versions."]
    return lines


def faults_as_text():
    """The table of faults as the test printed it, until its document is stored."""
    text = (HERE / "faults.txt").read_text().rstrip()
    return ["**To be made again**: printed by `build/release/tests/test_chain`; version and date were not recorded.", "",
            *render.folded("as printed", ["```", text, "```"])]


def page(documents):
    """The text of eval/results/README.md."""
    versions = len({document["version"] for document in documents.values()})
    notes = remarks()
    unused = set(notes) - {name for name, *_ in SECTIONS}
    if unused:
        raise SystemExit(f"remarks.md: no table is called {', '.join(sorted(unused))}")
    lines = [HEADER]
    for name, title, published, show in SECTIONS:
        lines += [f"## {title}", "", f"`{name}.json`" + (f"; published: {published}." if published else "."), ""]
        if name in documents:
            lines += [*provenance(name, documents[name], versions), "", *show(documents[name]), ""]
        elif name == "frontend-faults":
            lines += [*faults_as_text(), ""]
        else:
            lines += ["Not stored yet.", ""]
        if name in notes:
            lines += [notes[name], ""]
    return "\n".join(lines)


def row_of(document, **wanted):
    """The row of the document that has those values; `method` in today's terms."""
    for row in document["rows"]:
        if all((render.method(row) if key == "method" else row[key]) == value for key, value in wanted.items()):
            return row
    raise SystemExit(f"{document['experiment']}: no row with {wanted}")


def row_of_existence(document, method):
    """Big Woods after five drives, each of which misses 36 % of the stems."""
    rows = [row for row in document["rows"] if row["part"] == "forest"]
    return next(row for row in rows if (row["method"], row["missed_pct"], row["drives"]) == (method, 36, 5))


def summary(documents):
    """The rows of the project's README."""
    circle = row_of(documents["paths"], path="circle", method="smoothing")
    limit = row_of(documents["paths"], path="circle", method="oracle")
    # Independent errors, as published: the first row of its cell.
    noisy = row_of(documents["noise"], sigma_cm=40.0, detection_pct=80.0, method="smoothing")
    once = row_of(documents["large-map"], setting="default", method="smoothing")
    park = documents["victoria-park"]["rows"][0]
    chain = {row["what"]: row["value"] for row in documents["frontend-forest"]["rows"]}
    graph = row_of(documents["backend"], dataset="sesync_city10000")
    drive = [row for row in documents["loops-blind"]["rows"] if row["drive"] == "lansing-34"]
    mean = lambda key: sum(row[key] for row in drive) / len(drive)

    def removed(method):
        row = row_of_existence(documents["existence"], method)
        return f"{row['wrongly_removed_pct']:.1f} / {row['gone_removed_pct']:.0f} %"

    def asked(is_wanted):
        drives = [row for row in documents["existence-needed"]["rows"]
                  if row["part"] == "drive" and "false" not in row["setting"] and is_wanted(row["changed_pct"])]
        return f"{sum(row['needed_pct'] > 0 for row in drives)} of {len(drives)}"

    rows = [
        ("Forest, circle of 200 m, no odometry: error of poses / landmarks",
         f"{render.pair(circle, 'published_')} cm (GeoSLAM)",
         f"**{render.pair(circle)} cm** (limit {render.pair(limit)})", "`understory eval paths`"),
        ("The same, noise 40 cm, 20 % of the trunks missed", f"{render.pair(noisy, 'published_')} cm (GeoSLAM)",
         f"**{render.pair(noisy)} cm**", "`understory eval noise`"),
        ("One shot in a square kilometre of forest, no prior", "1244 of 1250 within 0.5 m, 308 ms (GeoSLAM)",
         f"**{once['within_0_10m']} of {once['keyframes']} within 0.1 m (the pose of the first scan alone: "
         f"{once['base_within_0_10m']}), {once['ms_p50']:.2f} ms**",
         "`understory eval large-map`"),
        ("Victoria Park, 4 km real drive: GPS fix to path, median / 90 %", "1.29 / 6.4 m (batch solution)",
         f"**{park['path_median_m']:.2f} / {park['path_p90_m']:.2f} m** (to the pose at the time of the fix: "
         f"{park['fix_median_m']:.2f} / {park['fix_p90_m']:.2f} m)", "`understory eval victoria-park`"),
        ("Raw LIDAR, IMU and wheels to pose, forest of 1 km, no GNSS: ATE", "none",
         f"**{chain['SLAM_POSE ATE']:.3f} m**; `RAW_POSE`, whose velocity the filter corrects, {chain['RAW_POSE ATE']:.3f} m; "
         f"`ODOMETRY` summed, which no landmark touches, {chain['ODOMETRY summed, ATE']:.2f} m",
         "`understory eval frontend --only forest`"),
        ("Smoother, city10000, one pose per update: total time", f"{graph['reference']['total_s']:.1f} s (GTSAM's ISAM2)",
         f"**{graph['total_s']:.1f} s**", "`understory eval backend`"),
        ("1.8 km among real stems, a third of each seen per visit, 650 m of it blind: ATE",
         f"{mean('ate_batch_m'):.2f} m (batch solution with true association)", f"**{mean('ate_m'):.2f} m**", "`understory eval loops`"),
        ("Big Woods at two censuses, five drives that each miss 36 %: standing stems removed / gone ones removed",
         f"{removed('persistence filter')} (persistence filter)", f"**{removed('icosahedral')}**, true rates known {removed('true rates')}",
         "`understory eval existence`"),
        ("Forest driven again with its old map: drives that ask for mapping; nothing changed / a fifth / a third and more of the trees",
         "none", f"**{asked(lambda pct: pct == 0)} / {asked(lambda pct: pct == 20)} / {asked(lambda pct: pct > 20)}**",
         "`understory eval existence-needed`"),
    ]
    used = [documents[name] for name in ("paths", "noise", "large-map", "victoria-park", "frontend-forest", "backend", "loops-blind", "existence", "existence-needed")]
    versions = sorted({document["version"] for document in used})
    lines = render.table(("what", "best published", "here", "command"), rows) + [""]
    if len(versions) > 1 or versions[0].endswith("-dirty"):
        return lines + [f"*To be made again: these figures come from the versions {', '.join(versions)}.*"]
    return lines + [f"*Version {versions[0]}.*"]


def with_summary(readme, lines):
    """The project's README with new lines between the markers."""
    if BEGIN not in readme or END not in readme:
        raise SystemExit(f"README.md: the lines '{BEGIN}' and '{END}' are missing")
    head, rest = readme.split(BEGIN, 1)
    return head + "\n".join([BEGIN, *lines, END]) + rest.split(END, 1)[1]


def main(arguments):
    if arguments not in ([], ["--check"]):
        print(__doc__, file=sys.stderr)
        return 2

    documents = stored()
    front = ROOT / "README.md"
    wanted = {HERE / "README.md": page(documents),
              front: with_summary(front.read_text(), summary(documents))}

    if arguments:
        stale = [file for file, text in wanted.items() if not file.exists() or file.read_text() != text]
        for file in stale:
            print(f"{file.relative_to(ROOT)}: out of step with eval/results/*.json; run eval/results/tables.py",
                  file=sys.stderr)
        vain = pictures.stored_in_vain()
        for name in vain:
            print(f"eval/results/{name}: no page names this picture; name it in eval/results/remarks.md, or delete it", file=sys.stderr)
        return 1 if stale or vain else 0
    for file, text in wanted.items():
        file.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
