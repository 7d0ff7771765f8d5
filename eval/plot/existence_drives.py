"""Plots of eval existence-drives: python3 existence_drives.py RESULTS.json [TRACES.json]

RESULTS.png: precision and recall of the map in use over the drives, with the existence tracker and without.
RESULTS.map.png: maps of the first forest past a stack of timber, landmarks coloured by their probability, with and without ranges.
RESULTS.changes.png: the same of the first forest without a stack, drive by drive.
"""
import json
import math
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def shares(rows, keeping, part, whole):
    """Of all forests together, drive by drive."""
    drives = sorted({row["drive"] for row in rows})
    of = lambda drive: [row for row in rows if row["keeping"] == keeping and row["drive"] == drive]
    return drives, [sum(row[part] for row in of(drive)) / max(1, sum(row[whole] for row in of(drive))) for drive in drives]


def corners(box):
    """Of a box of the stack, seen from above."""
    (x, y), (half_x, half_y), heading = box["at_m"], box["half_size_m"], box["heading_rad"]
    cos, sin = math.cos(heading), math.sin(heading)
    return [(x + cos * u - sin * v, y + sin * u + cos * v)
            for u, v in ((-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y))]


def draw_map(axis, trace):
    """One map: landmarks by probability over what is really there."""
    axis.plot(*zip(*trace["path_m"]), "-", color="tab:blue", linewidth=0.8, zorder=1)
    for box in trace["stack"]:
        axis.fill(*zip(*corners(box)), color="saddlebrown", alpha=0.5, linewidth=0, zorder=1)
    gone = [tree["at_m"] for tree in trace["trees"] if not tree["stands"]]
    hidden = [tree["at_m"] for tree in trace["trees"] if tree["stands"] and tree["is_hidden"]]
    if gone:
        axis.plot(*zip(*gone), "x", color="black", markersize=8, markeredgewidth=0.8, zorder=2, label="felled")
    if hidden:
        axis.plot(*zip(*hidden), "s", color="saddlebrown", markerfacecolor="none", markersize=9, zorder=2, label="stands, hidden")
    drawn = None
    for in_use, marker, size in ((True, "o", 26), (False, "v", 30)):
        some = [one for one in trace["landmarks"] if one["is_in_use"] == in_use]
        if some:
            drawn = axis.scatter(*zip(*(one["at_m"] for one in some)), c=[one["probability"] for one in some], cmap="RdYlGn", vmin=0,
                                 vmax=1, marker=marker, s=size, edgecolors="black", linewidths=0.4, zorder=3,
                                 label="in use" if in_use else "out of use")
    axis.set_aspect("equal")
    axis.tick_params(labelsize=6)
    return drawn


def draw_maps(file, traces, rows, drives):
    """A grid: ways to keep the map downwards, drives to the right."""
    figure, axes = plt.subplots(len(rows), len(drives), figsize=(4.2 * len(drives), 3.9 * len(rows)), squeeze=False, sharex=True,
                                sharey=True, layout="constrained")
    drawn, labels = None, {}
    for line, (keeping, name) in zip(axes, rows):
        for axis, drive in zip(line, drives):
            for trace in traces:
                if trace["keeping"] == keeping and trace["drive"] == drive:
                    drawn = draw_map(axis, trace) or drawn
            handles, names = axis.get_legend_handles_labels()
            labels.update(zip(names, handles))
            axis.set_title(f"{name}, drive {drive}" if name else f"drive {drive}", fontsize=9)
    for axis in axes[-1]:
        axis.set_xlabel("x [m]", fontsize=8)
    for axis in axes[:, 0]:
        axis.set_ylabel("y [m]", fontsize=8)
    figure.colorbar(drawn, ax=axes, label="probability that the landmark exists", shrink=0.7, pad=0.01)
    legend = 0.1 / len(rows)
    figure.get_layout_engine().set(rect=(0, legend, 1, 1 - legend))
    figure.legend(labels.values(), labels.keys(), loc="lower center", ncols=len(labels), fontsize=8)
    figure.savefig(file, dpi=110)
    plt.close(figure)


def draw_traces(file, traces):
    stack = [trace for trace in traces if trace["part"] == "stack"]
    if stack:
        last = max(trace["drive"] for trace in stack)
        draw_maps(file.with_suffix(".map.png"), stack, (("existence tracker", "with ranges"), ("without ranges", "without ranges")),
                  sorted({1, 2, last}))
    changes = [trace for trace in traces if trace["part"] == "changes"]
    if changes:
        last = max(trace["drive"] for trace in changes)
        draw_maps(file.with_suffix(".changes.png"), changes, (("existence tracker", ""),), sorted({1, 2, last}))


def main(file, traces=None):
    if traces:
        draw_traces(pathlib.Path(file), json.loads(pathlib.Path(traces).read_text()))
    rows = [row for row in json.loads(pathlib.Path(file).read_text())["rows"] if row.get("part", "changes") == "changes"]
    if not rows:
        return
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True)
    for keeping, colour in (("existence tracker", "tab:green"), ("nothing removed", "tab:red")):
        for axis, part, whole in ((axes[0], "right", "in_use"), (axes[1], "found", "standing")):
            axis.plot(*shares(rows, keeping, part, whole), "o-", color=colour, label=keeping)
    axes[0].set_ylabel("share")
    axes[0].set_title("precision: landmarks in use where a tree stands")
    axes[1].set_title("recall: standing trees that the map has")
    for axis in axes:
        axis.set_xlabel("drive, 10 % of the trees changed between two")
        axis.set_ylim(0, 1.02)
        axis.grid(alpha=0.3)
    axes[0].legend(loc="lower left")
    figure.tight_layout()
    figure.savefig(pathlib.Path(file).with_suffix(".png"), dpi=130)


if __name__ == "__main__":
    main(*sys.argv[1:])
