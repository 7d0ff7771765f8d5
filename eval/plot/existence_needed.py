"""Plot of eval existence-needed: python3 existence_needed.py RESULTS.json

RESULTS.png: left, what each drive in an old map said at most, by what had happened since; right, the ROC of the sum of both signals for
each share of change, against drives without change.
"""
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

LIMIT = 0.3  # need.changed_above as it ships.


def roc(changed, unchanged):
    """Corners (false alarms, found) of the thresholds from high to low."""
    corners = [(0.0, 0.0)]
    for limit in sorted({*changed, *unchanged}, reverse=True):
        corners.append((sum(value >= limit for value in unchanged) / len(unchanged), sum(value >= limit for value in changed) / len(changed)))
    return corners


def main():
    results = pathlib.Path(sys.argv[1])
    drives = {}
    for row in json.loads(results.read_text())["rows"]:
        if row["part"] == "drive":
            drives.setdefault((row["setting"], row["changed_pct"]), []).append(row["sum"])

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained", width_ratios=(1.4, 1))
    for i, ((setting, changed), sums) in enumerate(drives.items()):
        left.plot(sums, [i] * len(sums), "o", alpha=0.6, color="tab:red" if changed > 0 else "tab:green")
    left.axvline(LIMIT, color="black", linestyle="--", linewidth=0.8, label="mapping is needed")
    left.set_yticks(range(len(drives)), [setting for setting, _ in drives])
    left.invert_yaxis()
    left.set_xlabel("missing_share + new_share, largest of the drive")
    left.legend(fontsize=8)

    of = lambda is_wanted: [value for (setting, changed), sums in drives.items() if changed == 0 and is_wanted(setting) for value in sums]
    plain, everything = of(lambda setting: "false" not in setting), of(lambda setting: True)
    shares = [(changed, sums) for (_, changed), sums in drives.items() if changed > 0]
    for k, (changed, sums) in enumerate(shares):
        color = plt.cm.viridis(k / max(1, len(shares) - 1))
        right.step(*zip(*roc(sums, everything)), where="post", color=color, label=f"{changed:g} % changed")
        right.step(*zip(*roc(sums, plain)), where="post", color=color, linestyle=":")
    right.plot([], [], ":", color="grey", label="without false detections")
    right.set_xlabel("share of the unchanged drives that ask")
    right.set_ylabel("share of the changed drives that ask")
    right.set_ylim(-0.02, 1.04)
    right.legend(fontsize=8)
    figure.savefig(results.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
