"""A report of one drive in one HTML file: python3 -m understory.report RUN.lcm REPORT.html

The map with the live poses, what poses state and how far off they are (where the log has the truth),
what the processes said of themselves, their times and memory, and what the log holds. Needs Debian's
python3-matplotlib.
"""

import base64
import collections
import html
import io
import pathlib
import sys
import time

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend must be chosen before)
import numpy as np  # noqa: E402

from understory import log  # noqa: E402
from understory.drive import HEALTH_STATE, STATUS, Drive, errors_m  # noqa: E402
from understory.plot import draw_errors, draw_map  # noqa: E402

_COLOUR = {"STARTING": "#9bb7d4", "OK": "#5a9e5a", "DEGRADED": "#e0a030", "ERROR": "#c0392b", "STOPPING": "#999999"}
_MOST_ROWS = 200
_STYLE = """
body { font: 15px/1.45 sans-serif; max-width: 70em; margin: 2em auto; padding: 0 1em; color: #222 }
table { border-collapse: collapse; margin: 0.5em 0 1.5em } th, td { padding: 0.15em 0.8em; text-align: right }
th { border-bottom: 1px solid #888 } td:first-child, th:first-child, td.text { text-align: left }
img { max-width: 100% } h1 { font-size: 1.5em } h2 { font-size: 1.15em; margin-top: 2em }
"""


def _picture(draw, size):
    """A figure as an <img> with embedded data."""
    figure, axes = plt.subplots(figsize=size, layout="constrained")
    draw(axes)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100, bbox_inches="tight")
    plt.close(figure)
    return f'<img alt="" src="data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}">'


def _table(heading, rows):
    """Cells are escaped; numbers are right-aligned."""
    lines = ["<table><tr>" + "".join(f"<th>{html.escape(one)}</th>" for one in heading) + "</tr>"]
    for row in rows:
        cells = (
            f'<td class="text">{html.escape(one)}</td>' if isinstance(one, str) else f"<td>{one}</td>" for one in row
        )
        lines.append("<tr>" + "".join(cells) + "</tr>")
    return "\n".join([*lines, "</table>"])


def _path_m(poses):
    """Length of the live path; steps between maps and jumps of 5 m and more are left out."""
    steps = np.hypot(np.diff(poses["x_m"]), np.diff(poses["y_m"]))
    return steps[(np.diff(poses["map_id"]) == 0) & (steps < 5.0)].sum()


def _summary(drive):
    poses, truth = drive.poses(), drive.truth()
    begin = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(poses["t_s"][0]))
    rows = [
        ("begin", begin),
        ("duration", f"{poses['t_s'][-1] - poses['t_s'][0]:.1f} s"),
        ("path by the live poses", f"{_path_m(poses):.1f} m"),
        ("maps", str(len(set(poses["map_id"])))),
        ("landmarks in the last MAP", str(len(drive.landmarks()))),
        ("keyframes in the last MAP", str(len(drive.keyframes()))),
    ]
    counts = collections.Counter(int(status) for status in poses["status"])
    rows += [(f"poses {STATUS[status]}", str(count)) for status, count in sorted(counts.items())]
    if len(truth) > 1 and len(set(poses["map_id"])) == 1:
        errors = errors_m(poses, truth)
        known = errors[np.isfinite(errors)]
        if len(known) > 0:
            rows.append(("live poses, ATE (RMS after alignment)", f"{np.sqrt(np.mean(known**2)):.3f} m"))
            rows.append(("largest error of them", f"{known.max():.3f} m"))
    return _table(("what", ""), rows)


def _draw_health(health):
    processes = sorted(set(health["process"]))

    def draw(axes):
        start_s = health["t_s"].min()
        for row, process in enumerate(processes):
            said = health[health["process"] == process]
            ends_s = np.append(said["t_s"][1:], said["t_s"][-1] + 1.0)
            for one, end_s in zip(said, ends_s):
                # The state of a process without HEALTH for 3 s is unknown.
                width_s = min(end_s - one["t_s"], 3.0)
                axes.barh(row, width_s, left=one["t_s"] - start_s, color=_COLOUR[HEALTH_STATE[one["state"]]], height=0.7)
        axes.set_yticks(range(len(processes)), processes)
        axes.set_xlabel("time [s]: " + ", ".join(f"{name} {colour}" for name, colour in (("green", "OK"), ("orange", "DEGRADED"), ("red", "ERROR"))))
        axes.invert_yaxis()

    return draw


def _health_rows(drive):
    """Changes of a process's state or reason, with their times."""
    last, rows = {}, []
    start_s = None
    for message in drive.health_messages():
        start_s = message.utime * 1e-6 if start_s is None else start_s
        is_bad = HEALTH_STATE[message.state] in ("DEGRADED", "ERROR")
        now = (message.state, message.last_error if is_bad else "")
        if last.get(message.process) == now:
            continue
        if message.process in last or is_bad:
            rows.append((f"{message.utime * 1e-6 - start_s:.1f}", message.process, HEALTH_STATE[message.state], now[1]))
        last[message.process] = now
    return rows


def _health(drive):
    health = drive.health()
    if len(health) == 0:
        return "<p>The log has no HEALTH (a replay writes none).</p>"
    rows = _health_rows(drive)
    parts = [_picture(_draw_health(health), (12, 0.4 * len(set(health["process"])) + 1.2))]
    if rows:
        parts.append(_table(("time [s]", "process", "state", "why"), rows[:_MOST_ROWS]))
    else:
        parts.append("<p>Every process was OK from its start on.</p>")
    if len(rows) > _MOST_ROWS:
        parts.append(f"<p>{len(rows) - _MOST_ROWS} more changes are not shown.</p>")

    times = []
    for process in sorted(set(health["process"])):
        said = health[health["process"] == process]
        times.append((
            process,
            f"{1e3 * np.median(said['latency_p50_s']):.1f}",
            f"{1e3 * said['latency_p99_s'].max():.1f}",
            f"{said['rss_bytes'].max() / 1e6:.0f}",
        ))
    parts.append(_table(("process", "latency, median [ms]", "largest 99th percentile [ms]", "most memory [MB]"), times))
    return "\n".join(parts)


def _channels(path):
    counts, sizes = collections.Counter(), collections.Counter()
    reader = log.Log(path)
    for event in reader:
        counts[event.channel] += 1
        sizes[event.channel] += len(event.data)
    rows = [(channel, counts[channel], f"{size / 1e6:.2f}") for channel, size in sizes.most_common()]
    damaged = f"<p>{reader.damaged_bytes} bytes of the log are damaged.</p>" if reader.damaged_bytes else ""
    return _table(("channel", "messages", "MB"), rows) + damaged


def report(log_file):
    """The report as HTML. Raises ValueError if the log has no SLAM_POSE or cannot be read."""
    drive = Drive(log_file)
    if len(drive.poses()) == 0:
        raise ValueError(f"{log_file}: no SLAM_POSE in it (run understory replay first)")
    name = html.escape(pathlib.Path(log_file).name)
    return "\n".join([
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{name}</title><style>{_STYLE}</style></head><body>',
        f"<h1>{name}</h1>",
        _summary(drive),
        "<h2>Map and live poses</h2>",
        _picture(lambda axes: draw_map(axes, drive), (9, 8)),
        "<h2>Error and what poses state</h2>",
        _picture(lambda axes: draw_errors(axes, drive), (12, 4)),
        "<h2>Health, times, memory</h2>",
        _health(drive),
        "<h2>What the log holds</h2>",
        _channels(log_file),
        "</body></html>\n",
    ])


def main():
    """The command."""
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    try:
        pathlib.Path(sys.argv[2]).write_text(report(sys.argv[1]), encoding="utf-8")
    except (ValueError, OSError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
