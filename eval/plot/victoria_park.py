"""Plot of eval victoria-park: python3 victoria_park.py RESULTS.json TRACES.json

RESULTS.map.png: the map over the curated trees, the trajectory over the GPS fixes.
RESULTS.time.png: time per scan along the drive.
"""
import json
import math
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def to_world(pose, points):
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    return [x + c * p[0] - s * p[1] for p in points], [y + s * p[0] + c * p[1] for p in points]


def plot_map(traces, row, file):
    world = traces["world_T_map"]
    figure, axis = plt.subplots(figsize=(12, 12))
    trees = traces.get("trees", [])
    axis.plot(*to_world(world, [(t["x_m"], t["y_m"]) for t in trees]), "o", color="0.75",
              markersize=7, label="curated trees")
    doubled = [(t["x_m"], t["y_m"]) for t in trees if t["doubles"]]
    axis.plot(*to_world(world, doubled), "o", color="tab:purple", markersize=12, fillstyle="none",
              label="doubled")
    axis.plot(*to_world(world, traces["landmarks"]), ".", color="tab:green", markersize=4,
              label="map")
    axis.plot([f[1] for f in traces["fixes"]], [f[2] for f in traces["fixes"]], ".",
              color="tab:red", markersize=4, label="GPS")
    axis.plot(*to_world(world, [p[1:3] for p in traces["trajectory"]]), "-", color="tab:blue",
              linewidth=0.8, label="trajectory")
    axis.set_title(f"Victoria Park: median {row['path_median_m']:.2f} m, "
                   f"90 % {row['path_p90_m']:.2f} m from a GPS fix to the path")
    axis.set_xlabel("east [m]")
    axis.set_ylabel("north [m]")
    axis.set_aspect("equal")
    axis.legend(loc="upper left")
    figure.tight_layout()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def plot_time(traces, file):
    figure, axis = plt.subplots(figsize=(10, 4))
    axis.plot(traces["scan_ms"], ".", markersize=2)
    axis.set_yscale("log")
    axis.set_xlabel("scan")
    axis.set_ylabel("time [ms]")
    figure.tight_layout()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def main():
    results_file, traces_file = map(pathlib.Path, sys.argv[1:3])
    traces = json.loads(traces_file.read_text())
    plot_map(traces, traces["rows"][0], results_file.with_suffix(".map.png"))
    plot_time(traces, results_file.with_suffix(".time.png"))


if __name__ == "__main__":
    main()
