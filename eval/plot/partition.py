"""Plots of eval partition, partition-loop, partition-dynamic and partition-dynamic-loop: python3 partition.py RESULTS.json

RESULTS.sizes.png: each policy's distance from the uncut trajectory (open) or from the truth (closed), with the 95 %
interval over the runs, beside the thesis's.
RESULTS.ROUTE.png, for each route and front end (thesis on submaps, figures 5.1 to 5.12): trajectories with the cut
points of run 0, and over time the distance from the uncut trajectory (open) or the truth (closed).
"""
import json
import math
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

METHODS = {"baseline": ("thesis's method", "tab:red"), "smoothing-condensed": ("ours, as driven", "tab:blue"),
           "smoothing": ("ours, settled at the end", "tab:green")}
# What is less is drawn there: a tenth of a millimetre.
LEAST_CM = 1e-2
DRAWN = ("100 m", "300 m", "500 m", "sparse < 2", "dense > 5", "turn of 45 deg")


def sizes(document, file):
    """One panel for each route and front end."""
    rows = [row for row in document["rows"] if row["method"] in METHODS and row["policy"] != "uncut"
            and row["runs"] > 0]
    closed = document["config"]["is_closed"]
    key = "rmse_to_reference_m" if closed else "rmse_to_uncut_m"
    panels = list(dict.fromkeys((row["route"], row["front_end"]) for row in rows))
    figure, axes = plt.subplots(1, len(panels), figsize=(4.2 * len(panels), 4.2), squeeze=False, sharey=True)
    for axis, (route, front_end) in zip(axes[0], panels):
        own = [row for row in rows if (row["route"], row["front_end"]) == (route, front_end)]
        labels = list(dict.fromkeys(row["label"] for row in own))
        for method, (name, colour) in METHODS.items():
            points = [row for row in own if row["method"] == method]
            if points:
                axis.errorbar([labels.index(row["label"]) for row in points],
                              [max(LEAST_CM, 100 * row[key]) for row in points],
                              yerr=[min(100 * row[key + "_ci95"], max(0.0, 100 * row[key] - LEAST_CM)) for row in points],
                              fmt="o", capsize=3, color=colour, label=name, markersize=4)
        thesis = [row for row in own if row["method"] == "baseline" and "thesis_rmse_m" in row]
        if thesis:
            axis.plot([labels.index(row["label"]) for row in thesis], [100 * row["thesis_rmse_m"] for row in thesis],
                      "x", color="black", label="published, real drive")
        if not closed:
            axis.axhline(1.0, color="grey", linewidth=0.7, linestyle=":")
        axis.set_yscale("log")
        axis.set_ylim(bottom=0.8 * LEAST_CM)
        axis.set_xticks(range(len(labels)), labels, rotation=60, ha="right", fontsize=7)
        axis.set_title(f"{route}, {front_end}", fontsize=9)
        axis.grid(alpha=0.3)
    axes[0][0].set_ylabel("RMSE to the truth [cm]" if closed else "RMSE to the uncut trajectory [cm]")
    axes[0][0].legend(fontsize=7)
    figure.suptitle(f"{document['experiment']}: {document['config']['runs']} drives", fontsize=10)
    figure.tight_layout()
    figure.savefig(file.with_suffix(".sizes.png"), dpi=110)
    plt.close(figure)


def distance(trace, reference):
    """Times and distances of poses with the same time."""
    where = {round(1e3 * pose[0]): pose for pose in reference["poses"]}
    times, metres = [], []
    for time, x, y in trace["poses"]:
        other = where.get(round(1e3 * time))
        if other is not None:
            times.append(time)
            metres.append(math.hypot(x - other[1], y - other[2]))
    return times, metres


def route(traces, closed, file):
    """Trajectories with their cuts, and error over time."""
    uncut = next(one for one in traces if one["label"] == "uncut" and one["method"] == "smoothing")
    truth = next((one for one in traces if one["label"] == "truth"), None)
    reference = truth if closed and truth else uncut
    figure, (plan, error) = plt.subplots(1, 2, figsize=(11.5, 4.8))
    if truth:
        plan.plot([p[1] for p in truth["poses"]], [p[2] for p in truth["poses"]], "-", color="black", linewidth=0.8,
                  label="truth")
    plan.plot([p[1] for p in uncut["poses"]], [p[2] for p in uncut["poses"]], "--", color="grey", linewidth=0.8,
              label="uncut")
    labels = [label for label in DRAWN if any(one["label"] == label for one in traces)]
    for number, label in enumerate(labels):
        colour = f"C{number}"
        for method, style in (("baseline", "-"), ("smoothing-condensed", "--"), ("smoothing", ":")):
            trace = next((one for one in traces if one["label"] == label and one["method"] == method
                          and one["poses"]), None)
            if trace is None:
                continue
            times, metres = distance(trace, reference)
            error.plot(times, [max(LEAST_CM, 100 * one) for one in metres], style, color=colour, linewidth=0.9,
                       label=f"{label}, {METHODS[method][0]}")
            if method == "baseline":
                plan.plot([p[1] for p in trace["poses"]], [p[2] for p in trace["poses"]], "-", color=colour,
                          linewidth=0.7, label=label)
                cuts = {round(1e3 * cut) for cut in trace["cuts_s"]}
                points = [p for p in trace["poses"] if round(1e3 * p[0]) in cuts]
                plan.plot([p[1] for p in points], [p[2] for p in points], "o", color=colour, markersize=4)
    plan.set_aspect("equal")
    plan.set_xlabel("x [m]")
    plan.set_ylabel("y [m]")
    plan.set_title("trajectories of the thesis's method, dots: cuts", fontsize=9)
    plan.legend(fontsize=6)
    error.set_yscale("log")
    error.set_xlabel("time [s]")
    error.set_ylabel("distance from the truth [cm]" if closed else "distance from the uncut trajectory [cm]")
    error.legend(fontsize=5, ncol=2)
    error.grid(alpha=0.3)
    figure.suptitle(f"{uncut['route']}, {uncut['front_end']}, run 0", fontsize=10)
    figure.tight_layout()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def main():
    file = pathlib.Path(sys.argv[1])
    document = json.loads(file.read_text())
    sizes(document, file)
    traces_file = file.with_suffix(".traces.json")
    if not traces_file.exists():
        return
    traces = json.loads(traces_file.read_text())
    for name, front_end in dict.fromkeys((one["route"], one["front_end"]) for one in traces):
        own = [one for one in traces if (one["route"], one["front_end"]) == (name, front_end)]
        route(own, document["config"]["is_closed"], file.with_suffix(f".{name}-{front_end}.png"))


if __name__ == "__main__":
    main()
