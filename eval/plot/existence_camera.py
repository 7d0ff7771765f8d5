"""Plots of eval existence-camera: python3 existence_camera.py RESULTS.json TRACES.json

RESULTS.success.png: frames relocalised, samples and points left against the share of things changed, a line per method, a column
per world.
RESULTS.needed.png: ROC of the signals that say that mapping is needed.
"""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

FIGURES = (("success_pct", "frames relocalised [%]"), ("samples_mean", "RANSAC samples a frame"),
           ("map_points", "points left in the map"))


def draw_success(file, rows):
    """A column per world, a row per figure; the reference methods are dashed."""
    worlds = list(dict.fromkeys(row["world"] for row in rows))
    methods = list(dict.fromkeys(row["method"] for row in rows))
    figure, axes = plt.subplots(len(FIGURES), len(worlds), figsize=(3.8 * len(worlds), 2.7 * len(FIGURES)), squeeze=False)
    for column, world in enumerate(worlds):
        for index, method in enumerate(methods):
            some = [row for row in rows if row["world"] == world and row["method"] == method]
            style = {"color": plt.get_cmap("tab10")(index), "linewidth": 1.2, "label": method,
                     "linestyle": "--" if method in ("no removal", "ideal") else "-"}
            for axis, (key, _) in zip(axes[:, column], FIGURES):
                axis.plot([row["changed_pct"] for row in some], [row[key] for row in some], **style)
        axes[0][column].set_title(world, fontsize=9)
        axes[0][column].set_ylim(50, 101)
        axes[-1][column].set_xlabel("things removed or moved [%]")
    for axis, (_, name) in zip(axes[:, 0], FIGURES):
        axis.set_ylabel(name)
    for axis in axes.flat:
        axis.grid(alpha=0.3)
    axes[0][0].legend(fontsize=6, loc="lower left")
    figure.tight_layout()
    figure.savefig(file.with_suffix(".success.png"), dpi=110)


def draw_needed(file, curves):
    """Changed by at least 20 %, and by less, against unchanged drives."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 4), sharey=True)
    for axis, part, title in zip(axes, ("much", "little"), ("20 to 50 % changed", "5 and 10 % changed")):
        for index, (name, both) in enumerate(curves.items()):
            wrongly, found = zip(*both[part])
            axis.plot(wrongly, found, "-", color=plt.get_cmap("tab10")(index), linewidth=1.2, label=name)
        axis.set_title(title, fontsize=9)
        axis.set_xlabel("share of the unchanged drives that ask for mapping")
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("share of the changed drives that do")
    axes[0].legend(fontsize=7, loc="lower right")
    figure.tight_layout()
    figure.savefig(file.with_suffix(".needed.png"), dpi=110)


def main():
    file = pathlib.Path(sys.argv[1])
    rows = json.loads(file.read_text())["rows"]
    traces = json.loads(pathlib.Path(sys.argv[2]).read_text())
    # Ablations have no frames.
    draw_success(file, [row for row in rows if row["part"] == "culling" and not row["occluders_alone"] and "frames" in row])
    draw_needed(file, traces["mapping_needed"])


if __name__ == "__main__":
    main()
