"""Places that are found again, loops and their detectors, maps that are merged, as Markdown tables."""

import math

from render import number, table


def map_merge(document):
    """Pairs of maps, a line per forest and setting."""
    rows = document["rows"]
    apart = sum(row["trials"] for row in rows if row["overlap_pct"] == 0)
    wrong = sum(row["wrong_merges"] for row in rows)
    lines = table(
        ("maps", "overlap %", "trees seen %", "trials", "merged", "wrong merges", "doubled %", "doubled before %",
         "median offset error cm", "largest cm", "median stated sigma cm", "mean NEES", "median ms", "max ms"),
        [(row["maps"], "drawn" if row["overlap_pct"] is None else number(row["overlap_pct"], 0),
          number(row["common_pct"], 0), row["trials"], row["merged"], row["wrong_merges"], number(row["doubled_pct"]),
          number(row["doubled_before_pct"]), number(100 * row["offset_p50_m"], 1), number(100 * row["offset_max_m"], 1),
          number(100 * row["stated_sigma_p50_m"], 1), number(row["nees_mean"]), number(row["ms_p50"], 0),
          number(row["ms_max"], 0))
         for row in rows])
    return lines + ["", f"{wrong} wrong merges in all; {apart} pairs of maps had no overlap "
                        f"(95 % bound: {number(300 / apart)} %)."]


def place_recognition(document):
    """Frames of stems found again: a line per protocol, drive and map; then what no query has a match for."""
    rows = [row for row in document["rows"] if row["queries"] > 0]
    lines = table(
        ("protocol", "drive", "map", "frames", "diameters", "queries", "recall@1", "max F1", "recall at 0 wrong", "accepted",
         "wrong accepted", "pose m", "stems m", "median ms", "bytes/frame"),
        [(row["protocol"], row["drive"], row["map"], row["frames_per_query"], "yes" if row["with_diameters"] else "no",
          row["queries"], number(row["recall_at_1"], 3), number(row["max_f1"], 3), number(row["recall_zero_wrong"], 3),
          number(row["recall_accepted"], 3), row["wrong_accepted"], number(row["error_m_p50"], 3),
          number(row["stem_residual_m_p50"], 3), number(row["ms_p50"], 1), number(row["bytes_per_frame"], 0))
         for row in rows])
    single = [row for row in document["rows"] if row["frames_per_query"] == 1 and row["protocol"] != "between-3-m"]
    for with_diameters in (True, False):
        some = [row for row in single if row["with_diameters"] == with_diameters]
        none = sum(row["queries_without_match"] for row in some)
        wrong = sum(row["wrong_accepted_no_match"] for row in some)
        lines += ["", f"Queries that have no match, {'with' if with_diameters else 'without'} diameters: {none}, of them "
                      f"accepted {wrong}" + (f" (95 % bound {3 / none:.1e})." if none and not wrong else ".")]
    return lines


def loops(document):
    """Drives that come back: a line each, the mean of its runs."""
    rows = document["rows"]
    lines = []
    for drive in dict.fromkeys(row["drive"] for row in rows):
        some = [row for row in rows if row["drive"] == drive]
        mean = lambda key: sum(row[key] for row in some) / len(some)
        total = lambda key: sum(row[key] for row in some)
        lines.append((drive, len(some), number(mean("length_m"), 0), number(mean("odometry_end_m"), 1),
                      number(mean("error_without_m"), 3), number(mean("error_m"), 3),
                      number(mean("error_recognisable_m"), 3), number(mean("error_batch_m"), 3),
                      number(mean("ate_m"), 3), number(mean("ate_recognisable_m"), 3), number(mean("ate_batch_m"), 3),
                      number(mean("ate_m") / mean("ate_recognisable_m"), 2),
                      total("queries"), total("sent"), total("accepted"), total("wrong_accepted"),
                      number(mean("search_ms_p50"), 1), number(max(row["largest_closure_ms"] for row in some), 0)))
    return table(("drive", "runs", "length m", "odometry, end m", "without m", "with loop closer m", "recognisable m", "batch m",
                  "ATE m", "recognisable", "batch", "ATE ratio", "queries", "sent", "accepted", "wrong",
                  "search, median ms", "closing, most ms"), lines)


def loop_queries(document):
    """What the loop closer sent on drives beside a mapper that only reckons."""
    rows = document["rows"]
    total = lambda key: sum(row[key] for row in rows)
    none, wrong = total("queries_without_match"), total("sent_wrong")
    return table(("drives", "queries", "have a match", "have none", "sent", "wrong", "95 % bound"),
                 [(len(rows), total("queries"), total("queries_with_match"), none, total("sent"), wrong,
                   f"{3 / none:.1e}" if none and not wrong else "")])


def shared_errors(document):
    """Drives whose detections share errors: a line for each map and kind of error; then what closures waited for."""
    lines, reasons = [], {}
    for drive, errors in dict.fromkeys((row["drive"], row["errors"]) for row in document["rows"]):
        some = [row for row in document["rows"] if (row["drive"], row["errors"]) == (drive, errors)]
        mean = lambda key: sum(row[key] for row in some) / len(some)
        total = lambda key: sum(row[key] for row in some)
        lines.append((drive, errors, len(some), number(mean("length_m"), 0), number(mean("ate_m"), 3), number(mean("ate_batch_m"), 3),
                      number(mean("ate_m") / mean("ate_batch_m"), 2), number(mean("ate_live_m"), 3), number(mean("nees"), 1),
                      number(100 * mean("nees_in_band"), 0), number(mean("nees_within_95_pct"), 0),
                      f"{total('closures_sent')} / {total('closures_right')} / {total('closures_accepted')}",
                      total("closures_accepted_wrong"), total("rolled_back"), total("without_pose"), total("keyframes"),
                      number(mean("doubled_pct"), 2), number(mean("frame_ms_first_quarter"), 2), number(mean("frame_ms_last_quarter"), 2)))
        for row in some:
            for reason, count in row["closures_not_accepted"].items():
                reasons[reason] = reasons.get(reason, 0) + count
    return table(("drive", "errors", "drives", "length m", "ATE m", "batch m", "ratio", "ATE live m", "NEES (3)", "drives in the 95 % band %",
                  "keyframes below the 95 % quantile %", "closures sent / right / accepted", "wrong accepted", "rolled back", "without pose",
                  "keyframes", "doubled %", "ms a frame, first quarter", "last quarter"), lines) + [
        "", "Closures that were not accepted at once: "
        + ("; ".join(f"{count} {reason}" for reason, count in sorted(reasons.items())) or "none") + "."]


def few_landmarks(document):
    """One row of all drives: geometric means of ATE, and what became of keyframes and poses."""
    rows = document["rows"]
    total = lambda key: sum(row[key] for row in rows)
    ate = lambda pick: number(math.exp(sum(math.log(pick(row)) for row in rows) / len(rows)), 3)
    return table(("drives", "landmarks a scan", "keyframes accepted", "wrong", "SLAM_POSE ATE m", "of the worst drive", "mean NEES (3)", "coasting",
                  "keyframes as they came m", "final map m", "EKF_POSE m", "odometry m"),
                 [(len(rows), number(total("landmarks") / len(rows), 1), f"{total('accepted')} of {total('updates')}", total("wrong"),
                   ate(lambda row: row["slam"]["ate_m"]), number(max(row["slam"]["ate_m"] for row in rows), 2),
                   number(sum(row["slam"]["nees"] for row in rows) / len(rows), 2), f"{total('coasting')} of {sum(row['slam']['poses'] for row in rows)}",
                   ate(lambda row: row["updates_ate_m"]), ate(lambda row: row["keyframes_ate_m"]), ate(lambda row: row["ekf"]["ate_m"]),
                   ate(lambda row: row["odometry_ate_m"]))])


def loop_detectors(document):
    """Detectors alone, and behind each verifier: recall before the first wrong answer in every set; then all rows."""
    rows = [row for row in document["rows"] if not row["is_tuning"]]
    sets = list(dict.fromkeys(row["set"] for row in rows if row["queries"] > 0))
    by_pair = {}
    for row in rows:
        by_pair.setdefault((row["detector"], row["verifier"]), {})[row["set"]] = row
    lines = ["Recall at zero wrong acceptances:", ""]
    lines += table(
        ("detector", "verifier", *sets, "wrong accepted", "median ms", "bytes/frame"),
        [(detector, verifier,
          *(number(of[name]["recall_zero_wrong"], 3) if name in of and of[name]["queries"] else "" for name in sets),
          sum(row["wrong_accepted"] for row in of.values()),
          " to ".join(number(pick(row["ms_p50"] for row in of.values()), 1) for pick in (min, max)),
          number(max(row["bytes_per_frame"] for row in of.values()), 0))
         for (detector, verifier), of in by_pair.items()])
    queries = {row["set"]: (row["queries"], row["queries_without_match"]) for row in rows}
    none = sum(count for _, count in queries.values())
    lines += ["", "Queries with a match, without one: "
              + ", ".join(f"{name} {count}, {others}" for name, (count, others) in queries.items())
              + f". Nothing accepted of {none} without a match bounds the probability at {3 / none:.1e} (95 %)."]
    return lines
