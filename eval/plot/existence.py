"""Plots of eval existence: python3 existence.py RESULTS.json TRACES.json

RESULTS.roc.png: what is gone against what is wrongly removed, and the reliability diagram (20 % changed, first drive).
RESULTS.shell.png: the shell of one point as it learns, drive by drive.
RESULTS.forest.png: Big Woods, gone found at 1 % wrongly removed over the drives.
"""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # noqa: E402

SHOWN = ("log-odds counter", "persistence filter", "joint persistence filter", "Perpetua", "thesis's rules", "icosahedral",
         "von Mises-Fisher", "true rates")


def draw_curves(file, curves):
    """ROC and reliability of the methods."""
    figure, (roc, bins) = plt.subplots(1, 2, figsize=(10, 4.2))
    for index, name in enumerate(name for name in SHOWN if name in curves):
        colour = plt.get_cmap("tab10")(index)
        wrongly, found = zip(*curves[name]["roc"])
        roc.plot(wrongly, found, "-", drawstyle="steps-post", color=colour, linewidth=1.2, label=name)
        filled = [one for one in curves[name]["reliability"] if one["count"] >= 20]
        bins.plot([one["stated"] for one in filled], [one["frequency"] for one in filled], "o-", color=colour,
                  markersize=3, linewidth=1)
    roc.set_xscale("symlog", linthresh=0.01)
    roc.set_xlim(0, 1)
    roc.set_xlabel("share of the points there that is removed")
    roc.set_ylabel("share of the gone points that is removed")
    roc.legend(fontsize=7, loc="lower right")
    bins.plot([0, 1], [0, 1], ":", color="grey")
    bins.set_xlabel("stated probability that a point exists")
    bins.set_ylabel("share that exists")
    for axis in (roc, bins):
        axis.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(file.with_suffix(".roc.png"), dpi=110)


def draw_shell(file, shell):
    """The icosahedron after each drive: faces by visibility, vertices at their reach."""
    stages = shell["stages"]
    figure = plt.figure(figsize=(2.8 * len(stages), 3.2))
    most = max(max(stage["reach_m"]) for stage in stages)
    for index, stage in enumerate(stages):
        axis = figure.add_subplot(1, len(stages), index + 1, projection="3d")
        scaled = []
        for vertex, reach in zip(shell["vertices"], stage["reach_m"]):
            length = sum(x * x for x in vertex) ** 0.5
            scaled.append([x / length * reach for x in vertex])
        faces = [[scaled[vertex] for vertex in face] for face in shell["faces"]]
        colours = [plt.get_cmap("RdYlGn")(visible) for visible in stage["visibility"]]
        axis.add_collection3d(Poly3DCollection(faces, facecolors=colours, edgecolors="k", linewidths=0.4, alpha=0.9))
        axis.set_xlim(-most, most)
        axis.set_ylim(-most, most)
        axis.set_zlim(-most, most)
        axis.set_title(f"drive {index + 1}, P = {stage['probability']:.3f}", fontsize=8)
        axis.tick_params(labelsize=6)
    figure.text(0.5, 0.01, "visibility of a face: red 0, green 0.95; size: reach [m]", fontsize=8, ha="center")
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    figure.savefig(file.with_suffix(".shell.png"), dpi=110)


def draw_forest(file, rows):
    """Gone stems found where 1 % of the others is removed."""
    missed = sorted({row["missed_pct"] for row in rows})
    figure, axes = plt.subplots(1, len(missed), figsize=(4.6 * len(missed), 3.6), squeeze=False, sharey=True)
    for axis, share in zip(axes[0], missed):
        for index, name in enumerate(SHOWN):
            some = [row for row in rows if row["method"] == name and row["missed_pct"] == share]
            axis.plot([row["drives"] for row in some], [row["found_at_1_pct"] for row in some], "o-", markersize=3,
                      linewidth=1.2, color=plt.get_cmap("tab10")(index), label=name)
        axis.set_title(f"{share:.0f} % of the stems missed in each drive", fontsize=9)
        axis.set_xlabel("drives after the change")
        axis.grid(alpha=0.3)
    axes[0][0].set_ylabel("gone found at 1 % wrongly removed [%]")
    axes[0][0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(file.with_suffix(".forest.png"), dpi=110)


def main():
    file = pathlib.Path(sys.argv[1])
    rows = json.loads(file.read_text())["rows"]
    traces = json.loads(pathlib.Path(sys.argv[2]).read_text())
    if "curves" in traces:
        draw_curves(file, traces["curves"])
    if "shell" in traces:
        draw_shell(file, traces["shell"])
    forest = [row for row in rows if row["part"] == "forest"]
    if forest:
        draw_forest(file, forest)


if __name__ == "__main__":
    main()
