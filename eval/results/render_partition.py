"""Maps that are cut, condensed and put together again, as Markdown tables."""

from render import figure, folded, number, table


def long_drive(document):
    """Drives with stretches condensed, a line per length of a stretch; one section each."""
    return table(
        ("stretch m", "runs", "to uncut m", "worst m", "to truth m", "uncut to truth m", "mean NEES", "joining ms", "median ms",
         "p99 ms", "max ms"),
        [(number(row["size_m"], 0), row["runs"], number(row["rmse_to_uncut_m"], 4), number(row["worst_rmse_to_uncut_m"], 4),
          number(row["rmse_to_reference_m"], 4), number(row["uncut_rmse_to_reference_m"], 4), number(row["mean_nees"]),
          number(1e3 * row["closure_s"], 1), *(number(row["sections"][-1][key]) for key in ("ms_p50", "ms_p99", "ms_max")))
         for row in document["rows"]])


def long_drive_sections(document):
    """One drive, a line for each tenth of it."""
    row = document["rows"][0]
    lines = table(("up to km", "median ms", "p99 ms", "max ms", "resident MB"),
                  [(number(1e-3 * one["end_m"], 0), *(number(one[key]) for key in ("ms_p50", "ms_p99", "ms_max")), number(one["rss_mb"], 0))
                   for one in row["sections"]])
    return lines + ["", f"Refused keyframes: {row['refused']}; mean NEES {number(row['mean_nees'])}; on the disk {number(row['disk_mb_per_km'])} MB per km."]


def _interval(row, key, factor=100.0, digits=2):
    """A mean with the half width of its 95 % interval; "-" for no row."""
    if row is None or row["runs"] == 0:
        return "-"
    return f"{factor * row[key]:.{digits}f} ± {factor * row[key + '_ci95']:.{digits}f}"


def _partition_cells(document):
    """Rows by route, front end and policy: {key: {method: row}}."""
    cells = {}
    for row in document["rows"]:
        if row["policy"] not in ("truth",):
            cells.setdefault((row["route"], row["front_end"], row["label"]), {})[row["method"]] = row
    return cells


def partition(document):
    """The thesis's tables, its method and ours, a line per route and policy; all lengths in cm."""
    key = "rmse_to_reference_m" if document["config"]["is_closed"] else "rmse_to_uncut_m"
    head = ("route", "landmarks", "policy", "drives", "submaps", "mean m", "published cm", "thesis's method cm",
            "ours as driven cm", "ours settled cm", "uncut to truth cm", "settled to truth cm",
            "cut ms: published, thesis's, ours", "update ms: published, thesis's, ours", "closing s", "MB / km")
    lines = []
    for (route, front_end, label), methods in _partition_cells(document).items():
        thesis, driven, settled = (methods.get(name) for name in ("baseline", "smoothing-condensed", "smoothing"))
        row = settled or thesis
        published = (thesis or row).get
        times = (f"{figure(published('thesis_' + name))}, {figure(thesis and thesis[name])}, "
                 f"{figure(driven and driven[name])}" for name in ("partition_ms", "iteration_ms"))
        rmse = published("thesis_rmse_m")
        lines.append((route, front_end, label, row["runs"], number(row["submaps"], 1), number(row["mean_submap_m"], 0),
                      "-" if rmse is None else number(100 * rmse), _interval(thesis, key), _interval(driven, key),
                      _interval(settled, key), _interval(row, "uncut_rmse_to_reference_m"),
                      _interval(settled, "rmse_to_reference_m"), *times, figure(settled and settled["closure_s"]),
                      figure(settled and settled["disk_mb_per_km"])))
    return table(head, lines)


def partition_cut_points(document):
    """Errors at the cuts and between them, against the truth, as shares of the uncut solution's there."""
    rows = [row for row in document["rows"] if row["policy"] not in ("truth", "uncut") and row["runs"] > 0]
    return table(("route", "landmarks", "policy", "method", "at cuts cm", "between cm", "at cuts / uncut", "between / uncut"),
                 [(row["route"], row["front_end"], row["label"], row["method"],
                   _interval(row, "rmse_at_cuts_to_reference_m"), _interval(row, "rmse_between_to_reference_m"),
                   _interval(row, "at_cuts_of_uncut", 1.0), _interval(row, "between_of_uncut", 1.0)) for row in rows])


def partition_effects(document):
    """What a cut does to the motion across it, by size of submaps and landmarks at the cut."""
    rows = [row for row in document["effects"] if row["method"] in ("baseline", "smoothing-condensed")]
    top = [row for row in rows if row["cuts"] >= 5]
    return table(("landmarks from", "method", "size m", "landmarks at the cut", "drives", "cuts", "step cm", "step mrad"),
                 [(row["front_end"], row["method"], number(row["size_m"], 0),
                   f"{row['landmarks_from']:g} to {row['landmarks_below']:g}" if row["landmarks_below"] < 1e6
                   else f"from {row['landmarks_from']:g}", row["drives"], number(row["cuts"], 0),
                   *(f"{factor * row[key]:.3f} ± {factor * row[key + '_ci95']:.3f}"
                     for key, factor in (("step_m", 100.0), ("step_mrad", 1.0)))) for row in top])


def partition_designs(document):
    """Ways to condense, a line per size, distance from the uncut solution in cm."""
    methods = ("baseline", "baseline-condensed", "baseline-unscented", "baseline-joint", "baseline-joint-all",
               "baseline-full", "smoothing-condensed", "smoothing")
    return table(("route", "policy", *methods),
                 [(route, label, *(_interval(rows.get(name), "rmse_to_uncut_m") for name in methods))
                  for (route, _, label), rows in _partition_cells(document).items() if label != "uncut"])


def partition_all(document):
    """All tables of a partition experiment."""
    return [*partition(document), "", *folded("errors at the cuts and between them", partition_cut_points(document)), "",
            *folded("what a cut does, by size and landmarks", partition_effects(document))]
