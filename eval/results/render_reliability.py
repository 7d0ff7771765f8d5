"""Real processes while messages are held back and processes are stopped, as Markdown tables."""

from render import number, table

CHANNELS = (("slam", "SLAM_POSE"), ("ekf", "EKF_POSE"))
# An error that nobody is told of must not be larger [m].
UNANNOUNCED_M = 0.3
# HEALTH comes once a second and counts the latest messages [s].
TELLS_WITHIN_S = 2.0


def bound_95(hits, count):
    """Upper bound of a share, 95 % one-sided (Clopper and Pearson), by bisection; 1 where there is no trial."""
    if hits >= count:
        return 1.0
    low, high = hits / count, 1.0
    for _ in range(60):
        share = 0.5 * (low + high)
        term = total = (1.0 - share) ** count
        for k in range(1, hits + 1):
            term *= (count - k + 1) / k * share / (1.0 - share)
            total += term
        low, high = (share, high) if total > 0.05 else (low, share)
    return high


def _count(hits, count):
    return f"{hits} of {count} (below {number(100 * bound_95(hits, count), 1)} %)" if count else "-"


def _promises(drives):
    faults = [fault for drive in drives for fault in drive["faults"]]
    rows = [("delays drawn", *[str(len(faults))] * 2, "")]

    def row(name, promise, of):
        rows.append((name, *(of(channel) for channel, _ in CHANNELS), promise))

    def scores(channel):
        return [fault[channel] for fault in faults]

    row("poses outside of the delays within 3 sigma", ">= 99 %", lambda c: number(
        100 * sum(s["within_3_sigma"] for s in scores(c)) / max(1, sum(s["poses"] for s in scores(c))), 2) + " %")
    row("largest step of the error over a delay, m", "", lambda c: number(max(s["step_m"] for s in scores(c)), 3))
    row(f"delays with a step over {UNANNOUNCED_M} m that is not told", "0", lambda c: _count(
        sum(s["unannounced_m"] > UNANNOUNCED_M for s in scores(c)), len(faults)))
    row(f"delays after which HEALTH is OK for {TELLS_WITHIN_S:.0f} s while the pose is over 1 m off", "0", lambda c: _count(
        sum(s["ok_while_far_s"] > TELLS_WITHIN_S for s in scores(c)), len(faults)))
    row("delays after which no pose comes", "0",
        lambda c: _count(sum(not s["goes_on"] for s in scores(c)), len(faults)))
    row("poses that are not finite, of no covariance, or out of order", "0",
        lambda c: str(sum(sum(drive[f"{c}_broken"].values()) for drive in drives)))
    return table(("", *(name for _, name in CHANNELS), "promise"), rows)


def _kinds(drives):
    faults = [fault for drive in drives for fault in drive["faults"]]
    rows = []
    for what in sorted({fault["what"] for fault in faults}):
        some = [fault for fault in faults if fault["what"] == what]
        cells = []
        for channel, _ in CHANNELS:
            scores = [fault[channel] for fault in some]
            share = sum(s["within_3_sigma"] for s in scores) / max(1, sum(s["poses"] for s in scores))
            cells += [number(100 * share, 2), number(max(s["step_m"] for s in scores), 3)]
        rows.append((what, str(len(some)), number(max(fault["seconds"] for fault in some), 1), *cells))
    return table(("delay", "number", "longest s", "SLAM_POSE in 3 sigma %", "largest step m", "EKF_POSE in 3 sigma %",
                  "largest step m"), rows)


def reliability(document):
    """The promises first, then a line for each kind of delay."""
    drives = document["rows"]
    p99 = sorted(drive["latency_p99_ms"] for drive in drives)
    lost = sum(drive["lost"] for drive in drives)
    seconds = sum(drive["drive_s"] for drive in drives)
    return [f"{len(drives)} drives of {number(seconds / 60, 0)} minutes in all, {document['config'].get('jobs', 1)} at a time, load {document['config']['load']}; {lost} messages lost "
            f"(sockets that overflow while a process stops). `SLAM_POSE` behind the end of its sweep, outside of delays: p99 "
            f"{number(p99[len(p99) // 2], 0)} ms (median of the drives).",
            "", *_promises(drives), "", *_kinds(drives)]


def undelayed(document):
    """What the poses of the same drives are, at the same times, when nothing is late."""
    drives = document["rows"]
    rows = []
    for channel, name in CHANNELS:
        shares = []
        for drive in drives:
            scores = [fault[channel] for fault in drive["faults"]]
            shares.append((sum(s["within_3_sigma"] for s in scores), sum(s["poses"] for s in scores)))
        steps = [fault[channel]["step_m"] for drive in drives for fault in drive["faults"]]
        below = [drive["seed"] for drive, (hits, count) in zip(drives, shares) if hits < 0.99 * count]
        rows.append((name, number(100 * sum(h for h, _ in shares) / max(1, sum(c for _, c in shares)), 2),
                     number(max(steps), 3), f"{sum(step > UNANNOUNCED_M for step in steps)} of {len(steps)}",
                     ", ".join(map(str, below)) or "-"))
    return [f"{len(drives)} drives through the stages in one process, judged at the times at which the delays of the drives above end. What is "
            "missing here is no matter of delays.", "",
            *table(("", "within 3 sigma %", "largest step m", f"steps over {UNANNOUNCED_M} m",
                    "seeds of drives with less than 99 % within 3 sigma"), rows)]
