"""Plot of eval laps: python3 laps.py RESULTS.json

RESULTS.laps.png: memory in use, the mapper's longest and p99 message, error and NEES of SLAM_POSE, over
the hours driven; left from raw LIDAR, right from recorded landmarks.
"""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

PARTS = {"laps": "from raw LIDAR, all six stages", "hours": "from recorded landmarks, keyframer and mapper"}


def column(axes, rows, title):
    hours = [row["hours"] for row in rows]
    axes[0].set_title(title, fontsize=10)
    axes[0].plot(hours, [row["heap_mib"] for row in rows], ".-", color="tab:blue")
    axes[0].set_ylabel("heap in use [MiB]")
    axes[0].set_ylim(0, None)
    axes[1].plot(hours, [row["mapper_largest_ms"] for row in rows], ".", color="tab:gray", label="longest")
    axes[1].plot(hours, [row["mapper_p99_ms"] for row in rows], ".-", color="tab:orange", label="p99")
    axes[1].set_ylabel("mapper, a message [ms]")
    axes[1].set_ylim(0, None)
    axes[1].legend(fontsize=8)
    axes[2].plot(hours, [1e3 * row["ate_m"] for row in rows], ".-", color="tab:green", label="ATE [mm]")
    axes[2].set_ylabel("error of SLAM_POSE [mm]")
    axes[2].set_ylim(0, None)
    axes[2].set_xlabel("hours driven")
    nees = axes[2].twinx()
    nees.plot(hours, [row["mean_nees"] for row in rows], ".-", color="tab:red", linewidth=0.8)
    nees.axhline(3.0, color="tab:red", linewidth=0.6, linestyle="--")
    nees.set_ylim(0, 4)
    nees.set_ylabel("mean NEES (3)", color="tab:red")


def main():
    file = pathlib.Path(sys.argv[1])
    rows = json.loads(file.read_text())["rows"]
    parts = [part for part in PARTS if any(row["part"] == part for row in rows)]
    figure, axes = plt.subplots(3, len(parts), figsize=(5.5 * len(parts), 7.5), squeeze=False, sharex="col")
    for i, part in enumerate(parts):
        column(axes[:, i], [row for row in rows if row["part"] == part], PARTS[part])
    figure.tight_layout()
    figure.savefig(file.with_suffix(".laps.png"), dpi=110)


if __name__ == "__main__":
    main()
