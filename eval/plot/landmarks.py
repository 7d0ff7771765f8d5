#!/usr/bin/env python3
"""Landmarks over the sweep that they were found in, seen from above.

    landmarks.py FILE.json OUT.png

FILE.json: {"title": ..., "points": [[x, y, height], ...], "landmarks": [{"kind": "trunk" | "corner", "x", "y",
"radius", "bearing", "sigma"}, ...], "truth": [[x, y], ...] (optional)}, all in m and rad, frame vehicle_level.
Grey: returns near the ground, blue: from knee height to 4 m; red circles: trunks (thin: 3 sigma); orange: corners.
"""

import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        data = json.load(file)
    points = np.array(data["points"], dtype=float).reshape(-1, 3)
    figure, axes = plt.subplots(figsize=(12, 12))
    low = points[:, 2] < 0.3
    axes.scatter(*points[low, :2].T, s=0.2, c="0.8", linewidths=0)
    axes.scatter(*points[~low, :2].T, s=0.6, c="tab:blue", linewidths=0)
    for x, y in data.get("truth", []):
        axes.plot(x, y, "+", color="black", markersize=9)
    for mark in data["landmarks"]:
        place = (mark["x"], mark["y"])
        if mark["kind"] == "corner":
            axes.plot(*place, "s", color="tab:orange", markersize=7, fillstyle="none")
            ahead = np.array([np.cos(mark["bearing"]), np.sin(mark["bearing"])])
            axes.plot(*np.transpose([place, place + 1.5 * ahead]), color="tab:orange")
        else:
            axes.add_patch(plt.Circle(place, max(0.05, mark["radius"]), fill=False, color="tab:red"))
            axes.add_patch(plt.Circle(place, 0.6, fill=False, color="tab:red", linewidth=0.4))
        axes.add_patch(plt.Circle(place, 3.0 * mark["sigma"], fill=False, color="tab:green", linewidth=0.4))
    axes.plot(0.0, 0.0, "^", color="black")
    axes.set_aspect("equal")
    axes.set_xlim(-32, 32)
    axes.set_ylim(-32, 32)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title(data.get("title", ""))
    figure.savefig(sys.argv[2], dpi=110, bbox_inches="tight")


if __name__ == "__main__":
    main()
