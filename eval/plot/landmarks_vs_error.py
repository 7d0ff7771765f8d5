"""Plot of eval landmarks-vs-error: python3 landmarks_vs_error.py RESULTS.json TRACES.json

RESULTS.error.png: for each route the change of the error along the drive above the number of
landmarks used (the source's figures 4.4-4.6), and its mean for each number of landmarks with the
number of samples (figures 4.7-4.9).
"""
import json
import pathlib
import sys
from collections import defaultdict

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def along(axis, samples):
    times = [s[0] for s in samples]
    axis.plot(times, [1e3 * s[2] for s in samples], "-", color="tab:blue", linewidth=0.6)
    axis.set_ylabel("change of error [mm]", color="tab:blue")
    axis.set_ylim(0, max(1.0, 1.5 * sorted(1e3 * s[2] for s in samples)[int(0.99 * (len(samples) - 1))]))
    axis.set_xlabel("time [s]")
    counts = axis.twinx()
    counts.plot(times, [s[1] for s in samples], "-", color="tab:orange", linewidth=0.6)
    counts.set_ylabel("landmarks used", color="tab:orange")


def by_number(axis, samples):
    changes = defaultdict(list)
    for _, landmarks, change in samples:
        changes[landmarks].append(1e3 * change)
    numbers = sorted(changes)
    axis.bar(numbers, [sum(changes[n]) / len(changes[n]) for n in numbers], color="tab:blue")
    axis.set_ylabel("mean change [mm]", color="tab:blue")
    axis.set_xlabel("landmarks used")
    counts = axis.twinx()
    counts.plot(numbers, [len(changes[n]) for n in numbers], ".-", color="tab:orange")
    counts.set_ylabel("samples", color="tab:orange")


def main():
    results_file, traces_file = map(pathlib.Path, sys.argv[1:3])
    traces = json.loads(traces_file.read_text())
    figure, axes = plt.subplots(len(traces), 2, figsize=(13, 3.4 * len(traces)), squeeze=False)
    for row, trace in zip(axes, traces):
        along(row[0], trace["samples"])
        by_number(row[1], trace["samples"])
        row[0].set_title(trace["route"])
    figure.tight_layout()
    figure.savefig(f"{results_file.with_suffix('')}.error.png", dpi=110)


if __name__ == "__main__":
    main()
