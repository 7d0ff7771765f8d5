"""Draws what `understory log accuracy --json` wrote: plot_drive.py DRIVE.json PICTURE.png

Left the trajectory and the map against the truth, right the error of the live position along the
drive. Needs Debian's python3-matplotlib, so run it with /usr/bin/python3.
"""

import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend must be chosen before)


def column(rows, index):
    return [row[index] for row in rows]


def draw_map(axes, drive):
    truth, landmarks = drive["true_landmarks_m"], drive["map_landmarks_m"]
    axes.plot(column(truth, 0), column(truth, 1), "o", ms=4, mfc="none", mec="0.6", label="trees")
    axes.plot(column(landmarks, 0), column(landmarks, 1), "g.", ms=3, label="map")
    live = drive["live"]
    axes.plot(column(live, 3), column(live, 4), "k-", lw=1, label="true path")
    axes.plot(column(live, 1), column(live, 2), "r-", lw=1, label="published live")
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(loc="upper right", fontsize="small")
    if drive["lpe_cm"] is not None:
        axes.set_title(f"landmarks: mean error {drive['lpe_cm']:.1f} cm")


def draw_error(axes, drive):
    live, keyframes = drive["live"], drive["map_keyframes"]
    start = live[0][0] if live else 0.0
    axes.plot([row[0] - start for row in live], [100 * row[5] for row in live], "r-", lw=1,
              label=f"published live, mean {drive['live_mean_cm']:.1f} cm")
    axes.plot([row[0] - start for row in keyframes], [100 * row[5] for row in keyframes], "b-", lw=1,
              label=f"keyframes in the final map, mean {drive['rpe_cm']:.1f} cm")
    axes.set_xlabel("time of the drive [s]")
    axes.set_ylabel("position error [cm]")
    axes.set_ylim(bottom=0)
    axes.legend(fontsize="small")


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        drive = json.load(file)
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 6), layout="constrained")
    draw_map(left, drive)
    draw_error(right, drive)
    figure.savefig(sys.argv[2], dpi=110)


if __name__ == "__main__":
    main()
