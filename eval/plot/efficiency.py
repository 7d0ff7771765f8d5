"""Plot of eval efficiency: python3 efficiency.py RESULTS.json TRACES.json

RESULTS.time.png: time per keyframe and component along each scenario, with its running median.
"""
import json
import pathlib
import statistics
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

COMPONENTS = {"keyframer_ms": "tab:orange", "mapper_ms": "tab:blue"}


def running_median(values, width):
    half = max(1, width // 2)
    return [statistics.median(values[max(0, i - half):i + half + 1]) for i in range(len(values))]


def main():
    results_file, traces_file = map(pathlib.Path, sys.argv[1:3])
    traces = json.loads(traces_file.read_text())
    yardstick = json.loads(results_file.read_text())["config"]["yardstick_ms"]
    figure, axes = plt.subplots(len(traces), 1, figsize=(10, 3.6 * len(traces)), squeeze=False)
    for axis, trace in zip(axes[:, 0], traces):
        for key, colour in COMPONENTS.items():
            values = trace[key]
            axis.plot(trace["position"], values, ".", color=colour, markersize=2, alpha=0.4)
            axis.plot(trace["position"], running_median(values, max(5, len(values) // 50)), "-",
                      color=colour, label=key.replace("_ms", ""))
        axis.axhline(yardstick, color="0.5", linewidth=1, linestyle="--",
                     label="Delaunay of 13,770 points")
        axis.set_yscale("log")
        axis.set_title(f"{trace['scenario']}, {trace['method']}")
        axis.set_ylabel("ms per keyframe")
        stationary = trace["scenario"].startswith("stationary")
        axis.set_xlabel("stationary [h]" if stationary else "driven [m]")
        axis.grid(alpha=0.3)
        axis.legend(loc="upper left", fontsize="small")
    figure.tight_layout()
    figure.savefig(f"{results_file.with_suffix('')}.time.png", dpi=110)


if __name__ == "__main__":
    main()
