"""Plots of eval frontend --only forest-plots: python3 forest_plots.py RESULTS.json PLOTS.json

RESULTS.NAME.png for each plot: the cloud from above (1 m to 3 m above the ground), the stems as they were
estimated by others, and what the landmark extractor found from all stations with 32 beams.
"""
import json
import pathlib
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def draw(name, trace, file):
    figure, plan = plt.subplots(figsize=(11, 11))
    points = [p for p in trace["points"] if p[2] > 1.0]
    dots = plan.scatter([p[0] for p in points], [p[1] for p in points], s=1, c=[p[2] for p in points],
                        cmap="Greys", vmin=-1, vmax=4)
    figure.colorbar(dots, ax=plan, shrink=0.6, label="above the ground [m]")
    for x, y, radius, should, found in trace["stems"]:
        plan.add_patch(plt.Circle((x, y), radius, fill=False, color="tab:green", linewidth=1.5))
        plan.annotate(f"{found}/{should}", (x + radius, y + radius), fontsize=8, color="tab:green")
    for right, colour, label in ((True, "tab:blue", "found, a stem of the list"),
                                 (False, "tab:red", "found, not in the list")):
        chosen = [d for d in trace["detections"] if (d[3] >= 0) == right]
        plan.plot([d[0] for d in chosen], [d[1] for d in chosen], "+", color=colour, markersize=5,
                  markeredgewidth=0.7, label=f"{label}: {len(chosen)}")
    plan.plot([s[0] for s in trace["stations"]], [s[1] for s in trace["stations"]], "^",
              color="tab:orange", markersize=4, label=f"stations: {len(trace['stations'])}")
    plan.plot([], [], "o", color="tab:green", fillstyle="none",
              label="stems of the list, found / had to be found")
    plan.set_aspect("equal")
    plan.set_xlabel("x [m]")
    plan.set_ylabel("y [m]")
    plan.set_title(f"{name}: 32 beams")
    plan.legend(loc="upper left", fontsize="small")
    figure.tight_layout()
    figure.savefig(file, dpi=90)
    plt.close(figure)


def main():
    results_file, traces_file = map(pathlib.Path, sys.argv[1:3])
    for name, trace in json.loads(traces_file.read_text()).items():
        slug = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
        draw(name, trace, f"{results_file.with_suffix('')}.{slug}.png")


if __name__ == "__main__":
    main()
