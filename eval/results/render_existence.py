"""Tables of what is still there: see tables.py."""

from render import errors_of, folded, number, table


def _of_drive(rows, keys):
    """Rows of all forests together, drive by drive, in the order of the document."""
    groups = {}
    for row in rows:
        groups.setdefault(tuple(row.get(key) for key in (*keys, "drive")), []).append(row)
    for group, some in groups.items():
        yield group[:-1], group[-1], some, lambda key, some=some: sum(row[key] for row in some)


def _ate_mm(some):
    return number(1e3 * (sum(row["ate_m"] ** 2 for row in some) / len(some)) ** 0.5, 1)


def existence_drives(document):
    """A table for each part: trees that change, a stack that hides some, false detections."""
    rows = document["rows"]
    of = lambda part: [row for row in rows if row.get("part", "changes") == part]
    precision = lambda total: number(total("right") / max(1, total("in_use")), 3)
    recall = lambda total: number(total("found") / max(1, total("standing")), 3)
    lines = table(("map", "drive", "forests", "trees", "landmarks in use", "stored", "precision", "recall", "felled and unused",
                   "wrongly unused", "ATE mm", "mapping needed"),
                  [(keeping, drive, len(some), total("standing"), total("in_use"), total("stored"), precision(total), recall(total),
                    f'{total("felled_unused")} of {total("felled")}', total("wrongly_unused"), _ate_mm(some),
                    f'{total("mapping_needed")} of {len(some)}')
                   for (keeping,), drive, some, total in _of_drive(of("changes"), ("keeping",))])
    if of("stack"):
        lines += ["", *table(("a stack of timber", "drive", "forests", "trees that it hides", "of them out of use",
                              "felled and unused", "of them behind it", "wrongly unused", "precision", "recall", "ATE mm"),
                             [(keeping, drive, len(some), total("hidden"), total("hidden_unused"),
                               f'{total("felled_unused")} of {total("felled")}',
                               f'{total("felled_hidden_unused")} of {total("felled_hidden")}', total("wrongly_unused"),
                               precision(total), recall(total), _ate_mm(some))
                              for (keeping,), drive, some, total in _of_drive(of("stack"), ("keeping",))])]
    if of("false detections"):
        lines += ["", *table(("false detections", "map", "drive", "forests", "landmarks in use", "of them false", "false %",
                              "recall", "stored", "ATE mm"),
                             [(f"{number(100 * wanted, 0)} %", keeping, drive, len(some), total("in_use"),
                               total("in_use") - total("right"),
                               number(100 * (1 - total("right") / max(1, total("in_use"))), 1), recall(total), total("stored"),
                               _ate_mm(some))
                              for (wanted, keeping), drive, some, total in
                              _of_drive(of("false detections"), ("false_wanted", "keeping"))])]
    return lines


def existence(document):
    """Which points still exist: worlds, occluders, births, Big Woods; all rows of the worlds folded."""
    rows = document["rows"]
    of = lambda part: [row for row in rows if row["part"] == part]
    world = lambda row: (row["method"], number(row["missed_pct"], 0), number(row["changed_pct"], 0), row["drives"], row["points"],
                         number(row["auc"], 4), number(row["average_precision"], 3), number(row["brier"], 4),
                         number(row["found_at_1_pct"], 1), number(row["wrongly_removed_pct"]), number(row["gone_removed_pct"], 1),
                         number(row["rest_auc"], 3))
    head = ("method", "missed per drive %", "gone %", "drives", "points", "AUC", "average precision", "Brier",
            "found at 1 % wrongly removed", "wrongly removed %", "gone removed %", "AUC of the rest")
    lines = table(head, [world(row) for row in of("worlds") if row["changed_pct"] == 20])
    lines += ["", *folded("all shares changed", table(head, [world(row) for row in of("worlds")]))]
    lines += ["", *table(("occluder", "days since mapping", "ranges", "method", "hidden", "hidden removed %", "gone removed %"),
                         [(part, number(row["gap_days"], 0), "yes" if row["has_ranges"] else "no", row["method"],
                           row["hidden_points"], number(row["hidden_removed_pct"], 1), number(row["gone_removed_pct"], 1))
                          for part in ("occlusion-trap", "clear-cut") for row in of(part)])]
    lines += ["", *table(("Big Woods", "missed per drive %", "drives", "points", "AUC", "found at 1 % wrongly removed",
                          "wrongly removed %", "gone removed %", "Brier"),
                         [(row["method"], number(row["missed_pct"], 0), row["drives"], row["points"], number(row["auc"], 4),
                           number(row["found_at_1_pct"], 1), number(row["wrongly_removed_pct"]), number(row["gone_removed_pct"], 1),
                           number(row["brier"], 4)) for row in of("forest")])]
    lines += ["", *table(("Big Woods without change", "missed per drive %", "drives", "wrongly removed %"),
                         [(row["method"], number(row["missed_pct"], 0), row["drives"], number(row["wrongly_removed_pct"]))
                          for row in of("forest-control") if row["drives"] == 5])]
    lines += ["", *table(("false sightings % of looks", "method", "AUC", "gone removed %"),
                         [(number(row["false_rate_pct"], 1), row["method"], number(row["auc"], 4), number(row["gone_removed_pct"], 1))
                          for row in of("false-sightings")])]
    lines += ["", *table(("births that are false %", "false in the map %", "real kept %"),
                         [(number(row["false_pct"], 0), number(row["false_in_map_pct"]), number(row["real_kept_pct"], 1))
                          for row in of("births")])]
    for row in of("mortality"):
        lines += ["", f"Mortality of {row['trees']} trees of Barro Colorado, {row['died']} of which died: "
                      f"{number(row['rate_pct_per_year'])} +- {number(row['sigma_pct_per_year'])} % a year; deaths over tree years: "
                      f"{number(row['plain_pct_per_year'])} %."]
    return lines


def existence_census(document):
    """The processes beside the library and the true rates, drive by drive; then the same forest without a change."""
    rows = [row for row in document["rows"] if row["drives"] in (1, 2, 3, 5)]
    lines = []
    for part, columns in (("change", _census_change), ("control", _census_control)):
        groups = {}
        for row in rows:
            if row["part"] == part:
                groups.setdefault((row["missed_pct"], row["has_ranges"], errors_of(row), row["drives"]), {}).setdefault(row["method"], []).append(row)
        if groups:
            lines += ["", *table(*columns(groups))] if lines else table(*columns(groups))
    return lines


def _of_runs(methods, method, key, digits):
    """Mean over the runs of a setting."""
    some = [row[key] for row in methods[method]]
    return number(sum(some) / len(some), digits)


_CENSUS_METHODS = ("existence tracker", "icosahedral", "true rates")


def _census_change(groups):
    head = ("missed per drive %", "VIEW_RANGES", "errors", "drives", "stems of the map", "gone",
            *(f"AUC: {method}" for method in _CENSUS_METHODS),
            *(f"found at 1 % wrongly removed: {method}" for method in _CENSUS_METHODS), "Brier: existence tracker", "Brier: true rates",
            "gone and out of use", "standing and out of use", "landmarks in use where nothing stands", "doubles in use", "placed", "ATE m")

    def line(key, methods):
        missed, ranges, errors, drives = key
        total = lambda name: sum(row[name] for row in methods["existence tracker"])
        return (number(missed, 0), "yes" if ranges else "no", errors, drives, total("points"), total("gone"),
                *(_of_runs(methods, method, "auc", 4) for method in _CENSUS_METHODS),
                *(_of_runs(methods, method, "found_at_1_pct", 1) for method in _CENSUS_METHODS),
                _of_runs(methods, "existence tracker", "brier", 4), _of_runs(methods, "true rates", "brier", 4),
                f'{total("gone_unused")} of {total("gone")}', f'{total("there_unused")} of {total("there")}', total("ghosts_in_use"),
                total("doubles_in_use"), f'{total("placed")} of {total("updates")}', _of_runs(methods, "existence tracker", "ate_m", 2))

    return head, [line(key, methods) for key, methods in groups.items()]


def _census_control(groups):
    head = ("without change: missed per drive %", "VIEW_RANGES", "errors", "drives", "stems of the map", "out of use", "out of use %",
            "P below 0.2 %: existence tracker", "P below 0.2 %: icosahedral")

    def line(key, methods):
        missed, ranges, errors, drives = key
        total = lambda name: sum(row[name] for row in methods["existence tracker"])
        return (number(missed, 0), "yes" if ranges else "no", errors, drives, total("there"), total("there_unused"),
                number(100 * total("there_unused") / max(1, total("there"))),
                *(_of_runs(methods, method, "wrongly_removed_pct", 2) for method in ("existence tracker", "icosahedral")))

    return head, [line(key, methods) for key, methods in groups.items()]


def existence_needed(document):
    """What drives in an old map say of it, by what happened since; then how well that tells change."""
    drives = {}
    for row in document["rows"]:
        if row["part"] == "drive":
            drives.setdefault(row["setting"], []).append(row)
    mean = lambda some, key: number(sum(row[key] for row in some) / len(some))
    span = lambda some, key: f"{mean(some, key)} ({number(min(row[key] for row in some))}-{number(max(row[key] for row in some))})"
    lines = table(("since the first drive", "drives", "missing_share, most", "new_share, most", "sum, most", "drives that asked",
                   "keyframes that asked %"),
                  [(setting, len(some), span(some, "missing"), span(some, "new"), span(some, "sum"),
                    f"{sum(row['needed_pct'] > 0 for row in some)} of {len(some)}", mean(some, "needed_pct"))
                   for setting, some in drives.items()])
    areas = [row for row in document["rows"] if row["part"] == "area"]
    return lines + ["", *table(("trees changed %", "against drives with false detections", "signal", "AUC", "changed / unchanged drives"),
                               [(number(row["changed_pct"], 0), "yes" if row["has_false"] else "no", row["signal"], f"{number(row['auc'], 3)} +- {number(row['auc_half95'], 3)}",
                                 f"{number(row['changed_drives'], 0)} / {number(row['unchanged_drives'], 0)}") for row in areas])]


def existence_camera(document):
    """A camera in culled maps: the references and our methods in short, all rows folded; signals that mapping is needed."""
    rows = [row for row in document["rows"] if row["part"] == "culling"]
    change = lambda row: "occluders alone" if row["occluders_alone"] else number(row["changed_pct"], 0)
    camera = lambda row: (row["world"], change(row), row["method"], row["frames"],
                          f"{number(row['success_pct'], 1)} ({number(row['success_low_pct'], 1)}-{number(row['success_high_pct'], 1)})",
                          f"{row['gained_frames']} / {row['given_up_frames']}", row["wrong_accepted"],
                          f"{number(row['samples_mean'], 1)} +- {number(row['samples_half95'], 1)}", number(row["error_p50_cm"]),
                          f"{number(row['ate_cm'])} +- {number(row['ate_half95_cm'])}", number(row["lost_pct"], 1),
                          number(row["map_points"], 0))
    head = ("world", "changed %", "method", "frames", "relocalised % (95 %)", "gained / given up", "wrong accepted", "RANSAC samples",
            "pose cm", "ATE cm", "lost %", "points left")
    looked_for = [row for row in rows if "frames" in row]  # Of ablations only the points are scored.
    short = [row for row in looked_for if row["method"] in ("no removal", "icosahedral", "ideal")]
    lines = [*table(head, [camera(row) for row in short]), "", *folded("all methods", table(head, [camera(row) for row in looked_for]))]
    points = lambda row: (row["world"], change(row), row["method"], row["scored_points"], number(row["gone_of_scored_pct"], 1),
                          number(row["gone_removed_pct"], 1), number(row["wrongly_removed_pct"]), number(row["auc"], 4),
                          number(row["brier"], 4), row["hidden_points"], number(row["hidden_removed_pct"], 1), row["all_points"],
                          number(row["all_gone_removed_pct"], 1), number(row["all_wrongly_removed_pct"], 1),
                          number(row["all_auc"], 4), number(row["all_brier"], 4))
    point_head = ("world", "changed %", "method", "points scored", "gone %", "gone removed %", "wrongly removed %", "AUC", "Brier",
                  "hidden", "hidden removed %", "all points", "gone removed %, all", "wrongly removed %, all", "AUC, all", "Brier, all")
    twenty = [row for row in rows if row["changed_pct"] == 20]
    lines += ["", *table(point_head, [points(row) for row in twenty]), "",
              *folded("points at all shares", table(point_head, [points(row) for row in rows]))]
    signals = [row for row in document["rows"] if row["part"] == "mapping-needed"]
    return lines + ["", *table(
        ("is mapping needed: world", "changed %", "unchanged drives with new occluders", "drives after the change", "signal", "AUC",
         "changed / unchanged drives", "mean, changed", "mean, unchanged"),
        [(row["world"], number(row["from_pct"], 0) + ("" if row["from_pct"] == row["to_pct"] else " and more"),
          "yes" if row["with_occluded"] else "no", row["drives"], row["signal"],
          f"{number(row['auc'], 3)} +- {number(row['auc_half95'], 3)}",
          f"{row['changed_drives']:.0f} / {row['unchanged_drives']:.0f}", number(row["mean_changed"], 3),
          number(row["mean_unchanged"], 3)) for row in signals])]
