"""Plots of eval frontend: python3 frontend.py RESULTS.json TRACES.json

RESULTS.NAME.png for each drive of the whole chain: the map and the trajectories over the truth
(each aligned as a whole), and the error along the drive.
"""
import bisect
import json
import math
import pathlib
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

KINDS = {"raw": ("dead reckoning", "0.6"), "ekf": ("EKF_POSE", "tab:orange"),
         "slam": ("SLAM_POSE", "tab:blue")}


def pose_at(truth, times, time):
    i = bisect.bisect_left(times, time)
    if i == 0 or i >= len(times):
        return None
    a, b = truth[i - 1], truth[i]
    part = (time - a[0]) / (b[0] - a[0]) if b[0] > a[0] else 0.0
    turn = math.remainder(b[3] - a[3], 2 * math.pi)
    return [time, a[1] + part * (b[1] - a[1]), a[2] + part * (b[2] - a[2]), a[3] + part * turn]


def moved(motion, x, y):
    angle, tx, ty = motion
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y + tx, s * x + c * y + ty


def fit(fixes, poses):
    """The rigid motion (angle, x, y) that takes the poses at the times of `fixes` (t, x, y) best onto them."""
    times = [p[0] for p in poses]
    pairs = [(f, pose_at(poses, times, f[0])) for f in fixes]
    pairs = [(f, p) for f, p in pairs if p]
    n = max(1, len(pairs))
    fx, fy = sum(f[1] for f, _ in pairs) / n, sum(f[2] for f, _ in pairs) / n
    px, py = sum(p[1] for _, p in pairs) / n, sum(p[2] for _, p in pairs) / n
    dot = sum((p[1] - px) * (f[1] - fx) + (p[2] - py) * (f[2] - fy) for f, p in pairs)
    cross = sum((p[1] - px) * (f[2] - fy) - (p[2] - py) * (f[1] - fx) for f, p in pairs)
    angle = math.atan2(cross, dot)
    c, s = math.cos(angle), math.sin(angle)
    return angle, fx - c * px + s * py, fy - s * px - c * py


def draw(name, trace, file):
    truth = trace["truth"]
    times = [t[0] for t in truth]
    figure, (plan, errors) = plt.subplots(1, 2, figsize=(15, 7))
    plan.plot([t[1] for t in truth], [t[2] for t in truth], "-", color="k", linewidth=2.5,
              alpha=0.35, label="truth")
    for key, (label, colour) in KINDS.items():
        poses = trace[key]
        if len(poses) < 2:
            continue
        motion = fit(truth, poses)
        places = [moved(motion, p[1], p[2]) for p in poses]
        plan.plot([p[0] for p in places], [p[1] for p in places], "-", color=colour, linewidth=1,
                  label=label)
        along, off = [], []
        for pose, place in zip(poses, places):
            real = pose_at(truth, times, pose[0])
            if real:
                along.append(pose[0])
                off.append(max(1e-4, math.hypot(place[0] - real[1], place[1] - real[2])))
        errors.plot(along, off, "-", color=colour, linewidth=1, label=label)
        if key == "slam":
            for kind, marker in ((0, "."), (1, "s")):
                spots = [moved(motion, l[0], l[1]) for l in trace["landmarks"] if l[3] == kind]
                plan.plot([p[0] for p in spots], [p[1] for p in spots], marker, color="tab:green",
                          markersize=3, label="trunks" if kind == 0 else "corners")
    plan.set_aspect("equal")
    plan.set_xlabel("x [m]")
    plan.set_ylabel("y [m]")
    plan.set_title(name)
    plan.legend(fontsize="small")
    errors.set_yscale("log")
    errors.set_xlabel("time [s]")
    errors.set_ylabel("position error after alignment [m]")
    errors.grid(alpha=0.3)
    errors.legend(fontsize="small")
    figure.tight_layout()
    figure.savefig(file, dpi=100)
    plt.close(figure)


def draw_fixes(name, trace, file):
    figure, plan = plt.subplots(figsize=(10, 10))
    fixes = trace["fixes"]
    plan.plot([f[1] for f in fixes], [f[2] for f in fixes], ".", color="k", markersize=2,
              label="GNSS fixes")
    for key, (label, colour) in KINDS.items():
        if len(trace[key]) < 2:
            continue
        motion = fit(fixes, trace[key])
        places = [moved(motion, p[1], p[2]) for p in trace[key]]
        plan.plot([p[0] for p in places], [p[1] for p in places], "-", color=colour, linewidth=1,
                  label=label)
        if key == "slam":
            spots = [moved(motion, l[0], l[1]) for l in trace["landmarks"]]
            plan.plot([p[0] for p in spots], [p[1] for p in spots], ".", color="tab:green",
                      markersize=4, label="landmarks")
    plan.set_aspect("equal")
    plan.set_title(name)
    plan.legend(fontsize="small")
    figure.tight_layout()
    figure.savefig(file, dpi=100)
    plt.close(figure)


def draw_sweep(name, picture, file):
    """The sweep from above (points well above the ground darker) with the landmarks found in it."""
    figure, plan = plt.subplots(figsize=(10, 10))
    points = [p for p in picture["points"] if abs(p[0]) < 50 and abs(p[1]) < 50]
    plan.scatter([p[0] for p in points], [p[1] for p in points], s=0.4, c=[p[2] for p in points],
                 cmap="viridis", vmin=-1, vmax=4)
    for x, y, radius, kind in picture["detections"]:
        if kind == 0:
            plan.add_patch(plt.Circle((x, y), max(radius, 0.5), fill=False, color="tab:red"))
        else:
            plan.plot(x, y, "s", color="tab:red", fillstyle="none", markersize=10)
    plan.set_xlim(-50, 50)
    plan.set_ylim(-50, 50)
    plan.set_aspect("equal")
    plan.set_title(f"{name}: a sweep and its landmarks (circle: trunk, square: corner)")
    figure.tight_layout()
    figure.savefig(file, dpi=90)
    plt.close(figure)


def main():
    results_file, traces_file = map(pathlib.Path, sys.argv[1:3])
    for name, trace in json.loads(traces_file.read_text()).items():
        slug = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
        if trace["truth"]:
            draw(name, trace, f"{results_file.with_suffix('')}.{slug}.png")
        elif trace.get("fixes"):
            draw_fixes(name, trace, f"{results_file.with_suffix('')}.{slug}.png")
        for i, picture in enumerate(trace.get("pictures", [])[:3]):
            draw_sweep(name, picture, f"{results_file.with_suffix('')}.{slug}.sweep{i}.png")


if __name__ == "__main__":
    main()
