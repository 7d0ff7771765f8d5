"""Plot of eval existence-drives: python3 existence_drives.py RESULTS.json

RESULTS.png: precision and recall of the map in use over the drives, with the existence tracker and without.
"""
import json
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


def main(file):
    rows = [row for row in json.loads(pathlib.Path(file).read_text())["rows"] if row.get("part", "changes") == "changes"]
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
    main(sys.argv[1])
