"""A picture of a drive: python3 -m understory.plot RUN.lcm PICTURE.png

Left the map with the live poses (and the true path where the log has it), right the standard
deviation of the position along the drive, and its error with the first pose held. Needs Debian's
python3-matplotlib.
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend must be chosen before)
import numpy as np  # noqa: E402

from understory.drive import Drive, errors_m  # noqa: E402


def draw_map(axes, drive):
    """Landmarks and the live poses, frame map."""
    landmarks, poses = drive.landmarks(), drive.poses()
    axes.plot(landmarks["x_m"], landmarks["y_m"], "g.", ms=3, label=f"{len(landmarks)} landmarks")
    axes.plot(poses["x_m"], poses["y_m"], "r-", lw=1, label=f"{len(poses)} live poses")
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(loc="upper right", fontsize="small")


def draw_errors(axes, drive):
    """The stated standard deviation of each pose, and its error if the truth is known."""
    poses, truth = drive.poses(), drive.truth()
    t_s = poses["t_s"] - poses["t_s"][0]
    sigma_m = np.sqrt(np.trace(poses["covariance"][:, :2, :2], axis1=1, axis2=2))
    axes.semilogy(t_s, 100 * sigma_m, "k-", lw=1, label="stated standard deviation")
    if len(truth) > 1:
        axes.semilogy(t_s, 100 * errors_m(poses, truth, hold_first=True), "r-", lw=1, label="error, first pose held")
    axes.set_xlabel("time of the drive [s]")
    axes.set_ylabel("position [cm]")
    axes.legend(fontsize="small")


def draw(log_file, picture):
    """Draws the drive of a log into a picture. Raises ValueError if the log has no SLAM_POSE."""
    drive = Drive(log_file)
    if len(drive.poses()) == 0:
        raise ValueError(f"{log_file}: no SLAM_POSE in it (run understory replay first)")
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 6), layout="constrained")
    draw_map(left, drive)
    draw_errors(right, drive)
    figure.savefig(picture, dpi=110)
    plt.close(figure)


def main():
    """The command."""
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    try:
        draw(sys.argv[1], sys.argv[2])
    except (ValueError, OSError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
