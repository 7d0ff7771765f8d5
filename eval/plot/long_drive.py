"""Plot of eval partition and partition-loop: python3 partition.py RESULTS.json

RESULTS.sizes.png: over the length of a condensed stretch, the distance of the final trajectory from that of the uncut
drive and from the truth, mean NEES, and the mapper's time per keyframe.
"""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def main():
    file = pathlib.Path(sys.argv[1])
    document = json.loads(file.read_text())
    rows = document["rows"]
    sizes = [row["size_m"] for row in rows]
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.4))
    axes[0].plot(sizes, [100 * row["rmse_to_reference_m"] for row in rows], "o-", label="from the truth")
    if "rmse_to_uncut_m" in rows[0]:
        axes[0].plot(sizes, [100 * row["uncut_rmse_to_reference_m"] for row in rows], "--", label="uncut, from the truth")
        axes[0].plot(sizes, [100 * row["rmse_to_uncut_m"] for row in rows], "s-", label="from the uncut drive")
        axes[0].plot(sizes, [100 * row["worst_rmse_to_uncut_m"] for row in rows], "v:", label="the same, worst run")
        axes[0].axhline(1.0, color="grey", linewidth=0.6, linestyle=":")
    axes[0].set_yscale("log")
    axes[0].set_ylabel("RMS of the trajectory [cm]")
    axes[0].legend(fontsize=7)

    axes[1].plot(sizes, [row["mean_nees"] for row in rows], "o-", color="tab:red")
    axes[1].axhline(3.0, color="grey", linewidth=0.6, linestyle="--")
    axes[1].set_ylim(0, None)
    axes[1].set_ylabel("mean NEES (3 is exact)")

    for key, style in (("ms_p50", "o-"), ("ms_p99", "s-"), ("ms_max", "v:")):
        axes[2].plot(sizes, [row["sections"][-1][key] for row in rows], style, label=key[3:])
    axes[2].set_ylim(0, None)
    axes[2].set_ylabel("mapper, a keyframe [ms]")
    axes[2].legend(fontsize=7)

    for axis in axes:
        axis.set_xscale("log")
        axis.set_xticks(sizes, [f"{size:g}" for size in sizes])
        axis.minorticks_off()
        axis.set_xlabel("length of a condensed stretch [m]")
        axis.grid(alpha=0.3)
    config = document["config"]
    figure.suptitle(f"{document['experiment']}: {config['runs']} drives of {config['length_m']:g} m", fontsize=10)
    figure.tight_layout()
    figure.savefig(file.with_suffix(".sizes.png"), dpi=110)


if __name__ == "__main__":
    main()
