"""Plot of eval landmarks-vs-error: python3 landmarks_vs_error.py RESULTS.json TRACES.json

RESULTS.error.png, a row for each route: along the first drive the filter's change of the error
(running mean) above the number of landmarks used (figures 4.4-4.6 of the thesis on submaps); its mean for each
number of landmarks with the number of samples (figures 4.7-4.9); and the error of a second's way,
which no older error of the heading is in, of the filter and of the mapper.
"""
import json
import pathlib
import sys
from collections import defaultdict

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

FEW = 50  # samples: paler, a mean of so few says little
COLOURS = {"EKF_POSE": "tab:blue", "SLAM_POSE": "tab:green"}


def running_mean(values, width=10):
    sums = [0.0]
    for value in values:
        sums.append(sums[-1] + value)
    half = width // 2
    spans = [(max(0, i - half), min(len(values), i + half + 1)) for i in range(len(values))]
    return [(sums[b] - sums[a]) / (b - a) for a, b in spans]


def along(axis, samples):
    first = [s for s in samples if s[0] == 0]
    times = [s[1] for s in first]
    axis.plot(times, running_mean([1e3 * s[3] for s in first]), "-", color="tab:blue", linewidth=0.9)
    axis.set_yscale("log")
    axis.set_ylabel("change of error [mm]", color="tab:blue")
    axis.set_xlabel("time [s]")
    counts = axis.twinx()
    counts.fill_between(times, [s[2] for s in first], step="mid", color="tab:orange", alpha=0.35)
    counts.set_ylabel("landmarks used", color="tab:orange")
    counts.set_ylim(0, 2.5 * max([1] + [s[2] for s in first]))


def by_number(axis, rows):
    numbers = [r["landmarks"] for r in rows if r["samples"] > 0]
    counted = {r["landmarks"]: r for r in rows}
    for number in numbers:
        few = counted[number]["samples"] < FEW
        axis.bar(number, 1e3 * counted[number]["mean_error_change_m"], color="tab:blue",
                 alpha=0.3 if few else 1.0)
    axis.set_ylabel("mean change [mm]", color="tab:blue")
    axis.set_xlabel("landmarks used")
    samples = axis.twinx()
    samples.plot(numbers, [counted[n]["samples"] for n in numbers], ".-", color="tab:orange")
    samples.set_ylabel("samples", color="tab:orange")


def of_a_second(axis, rows_by_estimate):
    for estimate, rows in rows_by_estimate.items():
        enough = [r for r in rows if r["seconds"] >= FEW]
        axis.plot([r["landmarks"] for r in enough],
                  [1e3 * r["mean_error_of_a_second_m"] for r in enough],
                  "o-", color=COLOURS[estimate], markersize=3, label=estimate)
    axis.set_yscale("log")
    axis.set_ylabel("error of a second's way [mm]")
    axis.set_xlabel("landmarks used, mean of the second")
    axis.legend()


def main():
    results_file, traces_file = map(pathlib.Path, sys.argv[1:3])
    rows = defaultdict(lambda: defaultdict(list))
    for row in json.loads(results_file.read_text())["rows"]:
        rows[row["route"]][row["estimate"]].append(row)
    traces = [t for t in json.loads(traces_file.read_text()) if t["estimate"] == "EKF_POSE"]
    figure, axes = plt.subplots(len(traces), 3, figsize=(16, 3.4 * len(traces)), squeeze=False)
    for row, trace in zip(axes, traces):
        along(row[0], trace["samples"])
        by_number(row[1], rows[trace["route"]]["EKF_POSE"])
        of_a_second(row[2], rows[trace["route"]])
        row[0].set_title(trace["route"])
    figure.tight_layout()
    figure.savefig(f"{results_file.with_suffix('')}.error.png", dpi=90)


if __name__ == "__main__":
    main()
