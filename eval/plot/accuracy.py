"""Plots of eval paths, density and noise: python3 accuracy.py RESULTS.json TRACES.json

Beside RESULTS.json: RESULTS.CELL.map.png (trajectory and map against the truth),
RESULTS.CELL.along.png (error along the run), RESULTS.CELL.matches.png (GeoSLAM's Fig. 4.9, first and
filtered associations), RESULTS.CELL.graph.png (its Fig. 4.10), and RESULTS.ratio.png.
"""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

COLOURS = {"baseline": "tab:red", "smoothing": "tab:blue", "oracle": "tab:green",
           "lidar": "tab:purple", "lidar-ekf": "tab:orange"}


def columns(points):
    return [p[0] for p in points], [p[1] for p in points]


def plot_map(trace, file):
    # A filter has poses alone.
    methods = {name: run for name, run in trace["methods"].items() if run["landmarks"]}
    if not methods:
        return
    figure, axes = plt.subplots(1, len(methods), figsize=(7 * len(methods), 7), squeeze=False)
    for axis, (method, run) in zip(axes[0], methods.items()):
        axis.plot(*columns(run.get("true_trunks", trace["true_trunks"])), "o", color="0.75", markersize=5, label="trunks")
        axis.plot(*columns(run.get("true_path", trace["true_path"])), "-", color="black", linewidth=1, label="true path")
        axis.plot(*columns(run["landmarks"]), "x", color=COLOURS[method], markersize=4, label="map")
        axis.plot(*columns(run["poses"]), ".-", color=COLOURS[method], linewidth=1, markersize=3,
                  label="keyframes")
        axis.set_title(method)
        axis.set_aspect("equal")
        axis.set_xlabel("x [m]")
        axis.legend(loc="upper right", fontsize="small")
    axes[0][0].set_ylabel("y [m], frame of the first keyframe")
    figure.tight_layout()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def plot_along(trace, file):
    figure, axes = plt.subplots(3, 1, figsize=(9, 9), sharex=True)
    names = {"rpe_cm": "mean over poses", "lpe_cm": "mean over landmarks",
             "newest_pose_cm": "newest pose"}
    for axis, (key, name) in zip(axes, names.items()):
        for method, run in trace["methods"].items():
            if key == "lpe_cm" and not run["landmarks"]:
                continue
            axis.plot(run["travelled_m"], run[key], color=COLOURS[method], label=method)
        axis.set_ylabel(f"{name} [cm]")
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    axes[0].legend()
    axes[0].set_title("error of the map state along the run")
    axes[-1].set_xlabel("driven [m]")
    figure.tight_layout()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def draw_hierarchy(axis, points, polygons, shift):
    xs = [p[0] + shift for p in points]
    ys = [p[1] for p in points]
    for polygon in polygons:
        ring = polygon + polygon[:1]
        axis.plot([xs[i] for i in ring], [ys[i] for i in ring], "-", color="0.6", linewidth=0.7)
    axis.plot(xs, ys, ".", color="black", markersize=4)
    return xs, ys


def plot_matches(snapshot, file):
    """The keyframe beside the map; lines join associated landmarks. What polygons match only where the method does so."""
    panels = [("filtered_associations", "tab:green", "associations of the update")]
    if "first_associations" in snapshot:
        panels = [("first_associations", "tab:blue", "first associations, by polygons alone"),
                  ("filtered_associations", "tab:green", "filtered associations")]
    figure, axes = plt.subplots(len(panels), 1, figsize=(13, 7.5 * len(panels)), squeeze=False)
    width = (max(p[0] for p in snapshot["keyframe"]) - min(p[0] for p in snapshot["keyframe"]))
    left_of_map = min(p[0] for p in snapshot["map"])
    shift = left_of_map - max(p[0] for p in snapshot["keyframe"]) - 0.2 * width
    for axis, (key, colour, title) in zip(axes[:, 0], panels):
        local = draw_hierarchy(axis, snapshot["keyframe"], snapshot.get("keyframe_polygons", []), shift)
        whole = draw_hierarchy(axis, snapshot["map"], snapshot.get("map_polygons", []), 0.0)
        for i, j in snapshot[key]:
            axis.plot([local[0][i], whole[0][j]], [local[1][i], whole[1][j]], "-", color=colour,
                      linewidth=0.6, alpha=0.7)
        if key == "filtered_associations":
            new = columns(snapshot["new_landmarks"])
            axis.plot(*new, "o", color="tab:purple", markersize=6, label="new landmarks")
            if snapshot["new_landmarks"]:
                axis.legend(loc="upper right")
        axis.set_title(f"{title}: {len(snapshot[key])} (keyframe left, map right)")
        axis.set_aspect("equal")
    figure.tight_layout()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def plot_graph(snapshot, file):
    figure, axis = plt.subplots(figsize=(9, 9))
    axis.plot(*columns(snapshot["old_landmarks"]), "o", color="tab:red", markersize=4,
              label="old landmarks")
    current = [snapshot["map"][i] for i in snapshot["current"]]
    axis.plot(*columns(current), "o", color="tab:green", markersize=5,
              label=f"{len(current)} associated now")
    axis.plot(*columns(snapshot["new_landmarks"]), "o", color="tab:purple", markersize=6,
              label=f"{len(snapshot['new_landmarks'])} new")
    axis.plot(*columns(snapshot["poses"]), "^", color="tab:blue", markersize=5, label="poses")
    axis.plot(*columns([snapshot["pose"]]), "^", color="black", markersize=9, label="current pose")
    title = "graph state"
    if snapshot["degrees_of_freedom"] > 0:
        title += f", innovation chi^2 {snapshot['chi2']:.1f} of {snapshot['degrees_of_freedom']}"
    axis.set_title(title)
    axis.set_aspect("equal")
    axis.set_xlabel("x [m]")
    axis.set_ylabel("y [m]")
    axis.legend(loc="upper right")
    figure.tight_layout()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def cell_label(row):
    return (f"{row['path']}\n{row['forest']}\n{row['sigma_cm']:.0f} cm {row['detection_pct']:.0f}%"
            f"\n{row['interval_cm']:.0f} cm step" + ("" if row["errors"] in (None, "independent") else f"\n{row['errors']}"))


def plot_ratios(rows, file):
    """RPE and LPE over the oracle's; the published figures over the same oracle as crosses. A cell with runs that lost their
    map has no ratio: its errors are in the frame of the first map."""
    lost = {cell_label(r): r["runs_with_new_maps"] for r in rows if r.get("runs_with_new_maps")}
    oracle = {cell_label(r): r for r in rows if r["method"] == "oracle" and r["rpe_cm"] > 1e-4 and cell_label(r) not in lost}
    if not oracle:
        return
    labels = list(oracle)
    figure, axes = plt.subplots(2, 1, figsize=(max(8, 0.7 * len(labels)), 9), sharex=True)
    for axis, key, name in [(axes[0], "rpe_cm", "RPE"), (axes[1], "lpe_cm", "LPE")]:
        for number, method in enumerate(["baseline", "smoothing"]):
            found = [(labels.index(cell_label(r)), r[key] / oracle[cell_label(r)][key])
                     for r in rows if r["method"] == method and cell_label(r) in oracle]
            if found:
                axis.bar([x + 0.4 * number - 0.2 for x, _ in found], [y for _, y in found], 0.4,
                         color=COLOURS[method], label=method)
        published = [(labels.index(label), r["published_" + key] / r[key])
                     for label, r in oracle.items() if "published_" + key in r]
        axis.plot([x for x, _ in published], [y for _, y in published], "x", color="black",
                  label="published")
        axis.axhline(1.0, color="tab:green", linewidth=1)
        axis.set_yscale("log")
        axis.set_ylabel(f"{name} / oracle")
        axis.grid(axis="y", which="both", alpha=0.3)
    axes[0].legend()
    if lost:
        axes[0].set_title(f"left out: {len(lost)} cells with shared errors, where {sum(lost.values())} runs lost their map", fontsize=9)
    # Many of them would lie over each other.
    axes[1].set_xticks(range(len(labels)), labels, fontsize=7, rotation=90 if len(labels) > 12 else 0)
    figure.tight_layout()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def main():
    results_file, traces_file = map(pathlib.Path, sys.argv[1:3])
    results = json.loads(results_file.read_text())
    traces = json.loads(traces_file.read_text())
    stem = str(results_file.with_suffix(""))
    plot_ratios(results["rows"], f"{stem}.ratio.png")
    for trace in traces:
        plot_map(trace, f"{stem}.{trace['cell']}.map.png")
        plot_along(trace, f"{stem}.{trace['cell']}.along.png")
    # The figures of a single keyframe look alike in every cell: one cell is enough.
    snapshots = traces[0]["methods"]
    for method, run in snapshots.items():
        if "snapshot" in run:
            name = f"{stem}.{traces[0]['cell']}.{method}"
            plot_matches(run["snapshot"], f"{name}.matches.png")
            plot_graph(run["snapshot"], f"{name}.graph.png")


if __name__ == "__main__":
    main()
