"""Plot of eval loop-detectors: python3 loop_detectors.py RESULTS.json TRACES.json

RESULTS.curves.png: precision over recall in each set; above the detectors alone, below every verifier behind the
detector with which verifiers find most.
"""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def draw(axis, rows, key):
    """The curves of some rows, each named by its value of `key`."""
    colours = plt.get_cmap("tab10")
    for index, row in enumerate(rows):
        if row["curve"]:
            recall, precision = zip(*row["curve"])
            axis.plot(recall, precision, "-", color=colours(index % 10), linewidth=1.2, label=row[key])
            axis.plot(recall[-1], precision[-1], "o", color=colours(index % 10), markersize=4)
        else:
            axis.plot([], [], color=colours(index % 10), label=row[key])
    axis.set_xlim(-0.02, 1.02)
    axis.set_ylim(-0.02, 1.04)
    axis.grid(alpha=0.3)


def widest(rows):
    """The detector with which the verifiers accept most right answers before the first wrong one, over all sets."""
    sums = {}
    for row in rows:
        if row["verifier"] != "none":
            sums[row["detector"]] = sums.get(row["detector"], 0.0) + row["recall_zero_wrong"]
    return max(sums, key=sums.get) if sums else None


def main():
    file = pathlib.Path(sys.argv[1])
    rows = json.loads(file.read_text())["rows"]
    curves = json.loads(pathlib.Path(sys.argv[2]).read_text())
    for row, drawn in zip(rows, curves):
        row["curve"] = drawn["curve"]
    sets = list(dict.fromkeys(row["set"] for row in rows if not row["is_tuning"])) or list(
        dict.fromkeys(row["set"] for row in rows))
    sets = [name for name in sets if any(row["set"] == name and row["queries"] > 0 for row in rows)]
    chosen = widest(rows)
    figure, axes = plt.subplots(2 if chosen else 1, len(sets), figsize=(2.6 * len(sets) + 1.5, 5.6 if chosen else 3.2),
                                squeeze=False, sharex=True, sharey=True)
    for column, name in enumerate(sets):
        of_set = [row for row in rows if row["set"] == name]
        axes[0][column].set_title(f"{name}\n{of_set[0]['queries']} with a match, "
                                  f"{of_set[0]['queries_without_match']} without", fontsize=8)
        draw(axes[0][column], [row for row in of_set if row["verifier"] == "none"], "detector")
        if chosen:
            draw(axes[1][column], [row for row in of_set if row["detector"] == chosen and row["verifier"] != "none"],
                 "verifier")
        axes[-1][column].set_xlabel("recall")
    axes[0][0].set_ylabel("precision, detectors alone")
    axes[0][-1].legend(fontsize=7, loc="center left", bbox_to_anchor=(1.02, 0.5))
    if chosen:
        axes[1][0].set_ylabel(f"precision, behind {chosen}")
        axes[1][-1].legend(fontsize=7, loc="center left", bbox_to_anchor=(1.02, 0.5))
    figure.tight_layout()
    figure.savefig(file.with_suffix(".curves.png"), dpi=110)


if __name__ == "__main__":
    main()
