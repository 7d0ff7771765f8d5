"""Plot of eval backend: python3 backend.py RESULTS.json TRACES.json

RESULTS.png: processor time of every update, with its running median, per data set.
"""
import json
import pathlib
import statistics
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def running_median(values, width):
    half = max(1, width // 2)
    return [statistics.median(values[max(0, i - half):i + half + 1])
            for i in range(0, len(values), half)], list(range(0, len(values), half))


def main():
    results_file, traces_file = map(pathlib.Path, sys.argv[1:3])
    rows = json.loads(results_file.read_text())["rows"]
    traces = json.loads(traces_file.read_text())
    columns = 2
    lines = (len(traces) + columns - 1) // columns
    figure, axes = plt.subplots(lines, columns, figsize=(12, 2.8 * lines), squeeze=False)
    for axis, row, trace in zip(axes.flat, rows, traces):
        values = trace["update_ms"]
        axis.plot(values, ".", color="tab:blue", markersize=1.5, alpha=0.4)
        median, at = running_median(values, max(5, len(values) // 50))
        axis.plot(at, median, "-", color="tab:blue", label="running median")
        reference = row.get("reference")
        if reference:
            axis.axhline(reference["ms_p99"], color="tab:red", linewidth=1, linestyle="--",
                         label="p99 of the reference")
            axis.axhline(reference["ms_p50"], color="tab:red", linewidth=1, linestyle=":",
                         label="median of the reference")
        axis.set_yscale("log")
        axis.set_title(f"{row['dataset']}: {row['total_s']:.2f} s", fontsize=9)
        axis.set_xlabel("update")
        axis.set_ylabel("ms")
        axis.legend(fontsize=7)
    for axis in list(axes.flat)[len(traces):]:
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(results_file.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
