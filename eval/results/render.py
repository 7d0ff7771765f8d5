"""Result documents of `understory eval --json` as Markdown tables."""

import os
import re
import statistics

# Stored documents of older versions carry older terms: they are mapped when read, never edited.
METHODS = {"source": "baseline", "ours": "smoothing", "ours, as published": "smoothing, as published live"}
TERMS = (
    (r"\bstanding-(\d+h)", r"stationary-\1"),
    (r"(NEES of the pose, |in groups of 50, )standing", r"\1stationary"),
    (r"lidar: standing", "lidar: stationary"),
    (r"what it says of it", "standard deviation reported for it"),
    (r"not standing", "not upright"),
)


def term(text):
    """The text with today's terms."""
    for old, new in TERMS:
        text = re.sub(old, new, text)
    return text


def method(row):
    """Today's name of the row's method."""
    return METHODS.get(row.get("method"), row.get("method"))


def number(value, digits=2):
    """A number with that many decimals; "-" for none."""
    return "-" if value is None else f"{value:.{digits}f}"


def figure(value):
    """A number with four significant digits, as short as it gets; "-" for none."""
    if value is None:
        return "-"
    if value != 0 and abs(value) >= 1000:
        return f"{value:.0f}"
    return f"{value:.4g}"


def table(head, rows):
    """Markdown table of texts."""
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def folded(summary, lines):
    """Lines that a reader opens on demand."""
    return ["<details>", f"<summary>{summary}</summary>", "", *lines, "", "</details>"]


def pair(row, prefix=""):
    """RPE / LPE [cm] of an accuracy row, or the published ones."""
    rpe, lpe = row.get(prefix + "rpe_cm"), row.get(prefix + "lpe_cm")
    return "-" if rpe is None else f"{rpe:.2f} / {number(lpe)}"


def cells(rows, *keys):
    """Rows grouped by the values of the keys, in order: {values: {method: row}}."""
    groups = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), {})[method(row)] = row
    return groups


# ---------------------------------------------------------------- accuracy (paths, density, noise)

def errors_of(row):
    """Whether detections share errors from scan to scan; documents of before have independent ones alone."""
    return row.get("errors") or "independent"


def with_errors(document, errors):
    """The rows whose detections have those errors."""
    return [row for row in document["rows"] if errors_of(row) == errors]


def _ratios(row):
    """RPE and LPE over the oracle's; none where runs lost their map: their errors are in the frame of the first one."""
    if row.get("runs_with_new_maps"):
        return "-", "-"
    return number(row["ratio"], 3), number(row["ratio_lpe"], 3)


def accuracy_summary(document, key):
    """One line per path or forest and kind of errors: published, the thesis's method, smoothing, limit. Errors of runs that lost their
    map are in the frame of the first one and say nothing."""
    rows = [row | {"errors": errors_of(row)} for row in document["rows"]]
    lines = []
    for (name, errors), by in cells(rows, key, "errors").items():
        smoothing = by["smoothing"]
        lines.append((name, errors, pair(smoothing, "published_"), pair(by["baseline"]), f"**{pair(smoothing)}**",
                      pair(by["oracle"]), *_ratios(smoothing),
                      f"{number(smoothing['updates'], 1)} of {smoothing['updates_possible']}", number(smoothing["ate_cm"]),
                      f"{smoothing.get('runs_with_new_maps', 0)} of {smoothing['runs']}"))
    return table((key, "errors of detections", "published", "baseline", "**smoothing**", "oracle", "RPE ratio", "LPE ratio", "updates", "ATE of the last map cm",
                  "runs that lost their map"), lines)


def _share(value):
    return "-" if value is None else f"{value:g} %"


def accuracy_rows(document):
    """Every row with every column."""
    lines = []
    for row in document["rows"]:
        sigma = row["sigma_cm"]
        updates = "-" if row.get("updates") is None else f"{number(row['updates'], 1)} of {row['updates_possible']}"
        lines.append((row["path"], row["forest"], "-" if sigma is None else f"{sigma:g}", _share(row["detection_pct"]),
                      "-" if sigma is None else errors_of(row), method(row), f"{number(row['rpe_cm'])} ± {number(row['rpe_cm_sd'])}", number(row["lpe_cm"]),
                      number(row["ratio"], 3), number(row["ratio_lpe"], 3), updates, row["wrong_updates"],
                      number(row["map_recall_pct"], 1), number(row["false_landmarks_pct"]), number(row["ate_cm"]),
                      number(row["nees"]), pair(row, "published_"), number(row.get("published_updates"), 1)))
    return table(("path", "forest", "noise cm", "detection", "errors", "method", "RPE cm ± sd of a run", "LPE cm", "RPE ratio",
                  "LPE ratio", "updates", "wrong", "recall %", "false %", "ATE cm", "NEES (3)",
                  "published RPE / LPE", "published updates"), lines)


def noise_matrix(document):
    """Smoothing by noise and detection rate; in brackets the published figures, then the ratio to the oracle."""
    groups = cells(with_errors(document, "independent"), "sigma_cm", "detection_pct")
    rates = sorted({rate for _, rate in groups}, reverse=True)
    lines = []
    for sigma in sorted({sigma for sigma, _ in groups}):
        line = [f"{sigma:g} cm"]
        for rate in rates:
            row = groups[sigma, rate]["smoothing"]
            line.append(f"**{pair(row)}** ({pair(row, 'published_')}), {number(row['ratio'], 3)}")
        lines.append(line)
    return table(("noise", *(f"{rate:g} %" for rate in rates)), lines)


def noise_worst(document):
    """Worst ratio, lost and wrong updates of smoothing over all cells with independent errors."""
    rows = [row for row in with_errors(document, "independent") if method(row) == "smoothing"]
    worst = max(row["ratio"] for row in rows if row["ratio"] is not None)
    lost = sum(row["updates"] != row["updates_possible"] for row in rows)
    wrong = sum(row["wrong_updates"] for row in rows)
    above = [f"{row['sigma_cm']:g} cm / {row['detection_pct']:g} %" for row in rows
             if row["rpe_cm"] > row["published_rpe_cm"] or row["lpe_cm"] > row["published_lpe_cm"]]
    beaten = "below the published figures in every cell" if not above else \
        f"below the published figures except at {', '.join(above)}"
    return [f"Smoothing: worst RPE ratio {worst:.3f}; {beaten}; cells with lost updates: {lost}; wrong updates: {wrong}."]


def noise_shared(document):
    """The cells that are measured with shared errors as well, with the independent ones beside them; nothing where there are none."""
    rows = [row | {"errors": errors_of(row)} for row in document["rows"]]
    shared = {(row["sigma_cm"], row["detection_pct"]) for row in rows if row["errors"] != "independent"}
    lines = []
    for (sigma, rate, errors), by in cells(rows, "sigma_cm", "detection_pct", "errors").items():
        if (sigma, rate) in shared:
            smoothing = by["smoothing"]
            lines.append((f"{sigma:g} cm, {rate:g} %", errors, pair(by["baseline"]), f"**{pair(smoothing)}**", pair(by["oracle"]),
                          *_ratios(smoothing),
                          f"{number(smoothing['updates'], 1)} of {smoothing['updates_possible']}", number(smoothing["ate_cm"]), f"{smoothing['runs_with_new_maps']} of {smoothing['runs']}"))
    head = ("noise, detection", "errors of detections", "baseline", "**smoothing**", "oracle", "RPE ratio", "LPE ratio", "updates",
            "ATE of the last map cm", "runs that lost their map")
    return table(head, lines) + [""] if lines else []


def batches(document, size=10):
    """Mean of the thesis's method over batches of runs, as many as the thesis averages."""
    lines = []
    for row in document["rows"]:
        line = [row["path"], row["runs"] // size]
        for name in ("rpe_cm", "lpe_cm"):
            runs = row[name + "_runs"]
            means = [statistics.mean(runs[i:i + size]) for i in range(0, len(runs), size)]
            mean, spread = statistics.mean(means), 1.96 * statistics.stdev(means)
            line += [number(mean), f"{mean - spread:.1f} .. {mean + spread:.1f}", number(row["published_" + name])]
        lines.append(line)
    return table(("path", "batches of ten", "RPE cm", "95 % of a batch", "published", "LPE cm", "95 % of a batch",
                  "published"), lines)


# ------------------------------------------------------------------------------------ other experiments

def large_map(document):
    """One-shot localisation, a line per setting."""
    return table(
        ("setting", "keyframes", "within 0.10 m", "first scan alone within 0.10 m", "wrong", "not sure", "median error cm",
         "largest error cm", "median ms", "p99 ms", "max ms", "median / Delaunay build", "bytes per landmark"),
        [(row["setting"], row["keyframes"], row["within_0_10m"], row["base_within_0_10m"], row["wrong"], row["unsure"],
          number(row["error_p50_cm"]), number(row["error_max_cm"]), number(row["ms_p50"], 3), number(row["ms_p99"], 3),
          number(row["ms_max"], 3), number(row["ratio"], 4), number(row["bytes_per_landmark"], 0))
         for row in document["rows"]])


def one_shot(document):
    """Single scans in surveyed maps, a line per map and setting, and the six maps together."""
    rows = document["rows"]
    six = [row for row in rows if row["map"] != "big-woods-all"]
    total = {key: sum(row[key] for row in six) for key in ("scans", "found", "wrong", "off_unstated", "beyond_99_9_pct")}
    lines = table(
        ("map", "range m", "sigma cm", "detection %", "false %", "scans", "found", "wrong", "0.1-1 m off, unstated",
         "outside 99.9 %", "gave up, has an answer", "mean NEES", "99.9 % NEES", "median error cm", "largest error cm",
         "median ms", "max ms", "most look-ups"),
        [(row["map"], number(row["range_m"], 0), number(row["sigma_cm"], 0), number(row["detection_pct"], 0),
          number(row["false_pct"], 0), row["scans"], row["found"], row["wrong"], row["off_unstated"],
          row["beyond_99_9_pct"], row["gave_up_with_answer"], number(row["nees_mean"]), number(row["nees_p99_9"], 1),
          number(row["error_p50_cm"]), number(row["error_max_cm"], 1), number(row["ms_p50"]), number(row["ms_max"], 1),
          number(row["lookups_max"], 0))
         for row in rows])
    return lines + ["", f"The six maps together: {total['scans']} scans, {total['found']} found, {total['wrong']} wrong, "
                        f"{total['off_unstated']} unstated, {total['beyond_99_9_pct']} outside their 99.9 % ellipsoid."]


def efficiency(document):
    """Time per keyframe by scenario, method and component."""
    lines = table(
        ("scenario", "method", "component", "keyframes", "p50 ms", "p99 ms", "max ms", "p50 of the first tenth ms",
         "p50 of the last tenth ms", "p50 / Delaunay build", "RSS MB"),
        [(term(row["scenario"]), method(row), row["component"], row["keyframes"], number(row["ms_p50"], 3),
          number(row["ms_p99"], 3), number(row["ms_max"], 3), number(row["ms_p50_first_tenth"], 3),
          number(row["ms_p50_last_tenth"], 3), number(row["p50_per_yardstick"], 4), number(row["rss_mb"], 0))
         for row in document["rows"]])
    return lines + ["", f"Yardstick: a CGAL Delaunay triangulation of 13,770 points takes "
                        f"{document['config']['yardstick_ms']:.2f} ms."]


def victoria_park(document):
    """GPS fixes against the paths, trees, time per scan."""
    rows = document["rows"]
    run = rows[0]
    lines = table(("trajectory", "fix to pose, median m", "90 % m", "fix to path, median m", "90 % m"),
                  [(method(row), number(row["fix_median_m"]), number(row["fix_p90_m"]), number(row["path_median_m"]),
                    number(row["path_p90_m"])) for row in rows])
    localised = run["keyframes"] - run["not_sure"] - run["rolled_back"]
    return lines + [
        "",
        f"{run['keyframes']} keyframes: {localised} localised, {run['not_sure']} not sure, {run['rolled_back']} rolled "
        f"back, {run['keyframes_withheld']} withheld; longest gap {run['longest_gap_s']:.1f} s. {run['landmarks']} "
        f"landmarks; of {run['trees']} curated trees {run['trees_found']} found, {run['trees_doubled']} doubled; "
        f"{run['landmarks_elsewhere']} landmarks belong to no curated tree. Observations of a tree spread by "
        f"{run['tree_spread_median_m']:.2f} m (median); its landmark is {run['tree_distance_median_m']:.2f} m off. Time "
        f"per scan: {run['ms_p50']:.3f} ms median, {run['ms_p99']:.2f} ms p99, {run['ms_max']:.2f} ms max; of it "
        f"extraction {run['extractor_ms_p50']:.3f} ms median, {run['extractor_ms_p99']:.3f} ms p99."]


def backend(document):
    """Standard graphs through the smoother, beside ISAM2's stated figures."""
    lines = []
    for row in document["rows"]:
        theirs = row.get("reference", {})
        excess = 100 * (row["chi2_final"] / row["chi2_batch"] - 1)
        lines.append((row["dataset"], row["poses"], row["factors"], number(row["total_s"]), number(theirs.get("total_s")),
                      number(row["ms_p50"], 3), number(theirs.get("ms_p50"), 2), number(row["ms_p99"]),
                      number(theirs.get("ms_p99"), 1), number(row["ms_max"]), number(theirs.get("ms_max"), 0),
                      number(row["whole_ms"]), figure(row["chi2_final"]), f"{excess:.4f}",
                      figure(row.get("chi2_odometry", row.get("chi2_dead_reckoning"))), number(row["rss_mb"], 0)))
    return table(("graph", "poses", "factors", "total s", "ISAM2 s", "p50 ms", "ISAM2 ms", "p99 ms", "ISAM2 ms", "max ms",
                  "ISAM2 ms", "one fresh factorisation ms", "chi²", "above the batch optimum %",
                  "chi² of a batch from odometry", "RSS MB"), lines)


def backend_moments(document):
    """The runs at their checkpoints beside the batch solutions of those moments, and where batch solvers end."""
    lines = []
    for row in document["rows"]:
        if "moments" not in row:
            continue
        moments, theirs = row["moments"], row.get("reference", {})
        lines.append((row["dataset"], moments["count"] - moments["unverified"], number(100 * moments["excess_p50"], 4),
                      number(100 * moments["excess_max"], 2), number(moments["sigma_p50"], 3), number(moments["sigma_p99"], 3),
                      number(moments["newest_m_max"], 3), number(row["ms_max_with_settle"]), number(row["refactorisation_ms"]),
                      figure(row["chi2_batch"]), figure(row["chi2_odometry"]), figure(row.get("chi2_chordal")),
                      figure(row.get("chi2_known")), figure(theirs.get("optimum"))))
    if not lines:
        return []
    return ["", *table(("graph", "batch solutions", "chi² above them %, median", "largest", "newest pose and what it sees: sigma, "
                        "median", "p99", "newest pose m, largest", "largest update or settle ms", "CHOLMOD refactorisation ms",
                        "chi² of a batch from here", "from odometry", "from chordal initialisation", "stored optimum",
                        "optimum of ISAM2's file"), lines)]


def backend_shares(document):
    """Medians of total and p99 time, as shares of ISAM2's."""
    def share(key, spatial):
        values = [row[key] / row["reference"][key] for row in document["rows"]
                  if "reference" in row and row["dataset"] != "isam_manhattanOlson3500"  # M3500 once more
                  and (row["dataset"] in ("parking-garage", "sphere2500", "torus3D")) in spatial]
        return statistics.median(values)
    return [f"Median share of ISAM2's figures: total {share('total_s', (False,)):.2f} in the plane, "
            f"{share('total_s', (True,)):.2f} in space; p99 {share('ms_p99', (False, True)):.2f} over all graphs."]


def landmarks_vs_error(document):
    """Error against the number of landmarks used: a table per route and estimate, numbers binned as in print."""
    bins = ((0, 0), (1, 1), (2, 2), (3, 3), (4, 6), (7, 9), (10, 15), (16, 10**9))
    lines = []
    for (route, estimate) in dict.fromkeys((row["route"], row["estimate"]) for row in document["rows"]):
        for low, high in bins:
            rows = [row for row in document["rows"]
                    if (row["route"], row["estimate"]) == (route, estimate) and low <= row["landmarks"] <= high]
            sweeps, seconds = sum(row["samples"] for row in rows), sum(row["seconds"] for row in rows)
            if not sweeps:
                continue
            change = sum(row["samples"] * (row["mean_error_change_m"] or 0) for row in rows) / sweeps
            second = sum(row["seconds"] * (row["mean_error_of_a_second_m"] or 0) for row in rows) / max(seconds, 1)
            label = f"{low}" if low == high else f"{low} .. {high if high < 10**9 else ''}"
            lines.append((route, estimate, label, sweeps, number(1e3 * change), number(1e3 * second, 1)))
    return table(("route", "estimate", "landmarks", "sweeps", "change of error mm (thesis eq. 4.1)",
                  "error over one second mm"), lines)


# -------------------------------------------------- rows of figures with targets (frontend, recordings)

def laps(document):
    """The same way again and again: some of the laps, some of the hours, and the slopes."""
    lines = []
    config = document["config"]
    for part, title in (("laps", f"{config['laps']} laps of {config['length_m']:.0f} m from raw LIDAR, {config['beams']} beams"),
                        ("hours", f"{config['hours']:.0f} hours from the landmarks and odometry of one lap, repeated")):
        rows = [row for row in document["rows"] if row["part"] == part]
        if not rows:
            continue
        shown = sorted({min(len(rows), max(1, round(len(rows) * share))) for share in (0.0, 0.02, 0.1, 0.25, 0.5, 0.75, 1.0)})
        lines += ["", f"{title}; the heap's slope over the last half is **{config[f'slope_{part}_mib_per_h']:.2f} MiB/h**:", ""]
        lines += table(("lap" if part == "laps" else "half hour", "hours", "heap MiB", "mapper's state MiB", "mapper's message p99 ms", "longest ms",
                        "ATE mm", "NEES (3)", "largest NEES", "poses", "not localised", "keyframes refused"),
                       [(rows[i - 1]["number"], number(rows[i - 1]["hours"]), number(rows[i - 1]["heap_mib"], 1),
                         number(rows[i - 1]["mapper_state_mib"]),
                         number(rows[i - 1]["mapper_p99_ms"], 1), number(rows[i - 1]["mapper_largest_ms"], 1),
                         number(1e3 * rows[i - 1]["ate_m"], 1), number(rows[i - 1]["mean_nees"]),
                         number(rows[i - 1]["largest_nees"], 0), rows[i - 1]["poses"],
                         rows[i - 1]["unsure"], rows[i - 1]["refused"]) for i in shown])
    if config.get("localisation_only"):
        lines += ["", "The hours are localisation only in the map of a lap. Its file afterwards: "
                      + ("the same bytes, and no change was told." if config["map_unchanged"] else "**changed**.")]
    return lines


def health(document):
    """Drives with and without a fault: how long HEALTH was OK, and which errors it did not name."""
    return table(("fault from 25 s to 45 s of 60 s", "drives", "OK % of the time", "errors", "not named within 10 s",
                  "largest error m", "reasons"),
                 [(row["fault"], row["drives"], number(row["ok_percent"], 1), row["errors"], row["errors_unnoticed"],
                   number(row["largest_error_m"]),
                   ", ".join(f"{name} {count}" for name, count in sorted(row["reasons"].items())) or "-")
                  for row in document["rows"]])


def misstated(document):
    """Drives with something wrong from the first scan on, beside those with nothing wrong."""
    return table(("drive", "what is wrong", "drives", "keyframes localised", "poses", "over 1 m off", "`SLAM_POSE` m", "to nothing wrong",
                  "`EKF_POSE` m", "to nothing wrong", "NEES (3)", "named by HEALTH"),
                 [(row["drive"], row["what"], row["runs"],
                   f"{row['updates']} of {row['updates_possible']}" if row["drive"] == "circle" else "-", row["poses"], row["wrong"],
                   number(row["slam_m"], 4), number(row["slam_ratio"]),
                   *((number(row["filter_m"], 4), number(row["filter_ratio"])) if row["drive"] == "forest" else ("-", "-")),
                   number(row["nees"]), f"{row['runs_named']} of {row['runs']}" if row["drive"] == "forest" else "-")
                  for row in document["rows"]])


def _columns(settings):
    """A caption that all settings share, and what is left of each."""
    if len(settings) == 1:
        return settings[0], ["value"]
    shared = os.path.commonprefix(settings)
    shared = shared[:max(shared.rfind(", "), shared.rfind(": ")) + 1]
    return shared.rstrip(" ,:"), [setting[len(shared):].strip() for setting in settings]


def _with_target(settings, names, label):
    """Cells of a row; a target that not all settings share stands in the cell."""
    targets = {settings[name][label][1] for name in names}
    shared = targets.pop() if len(targets) == 1 else ""
    cells_of_row = [value + (f" (target {target})" if target and not shared else "")
                    for value, target in (settings[name][label] for name in names)]
    return (label + (f", target {shared}" if shared else ""), *cells_of_row)


def figures(rows):
    """Rows of {setting, what, value, unit, target, pass}: settings with the same figures share a table."""
    settings = {}
    for row in rows:
        label = term(row["what"]) + (f" [{row['unit']}]" if row["unit"] else "")
        value = figure(row["value"]) + (" **missed**" if row["pass"] is False else "")
        settings.setdefault(term(row["setting"]), {})[label] = (value, row["target"])
    groups = {}
    for setting, values in settings.items():
        groups.setdefault(tuple(values), []).append(setting)
    lines = []
    for labels, names in groups.items():
        caption, heads = _columns(names)
        lines += ([""] if lines else []) + ([f"*{caption}*", ""] if caption else [])
        lines += table(("figure", *heads), [_with_target(settings, names, label) for label in labels])
    return lines
