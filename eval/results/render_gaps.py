"""Processes that hang and sensors that are silent for a while, as a Markdown table."""

from render import number, table

# Of chi^2 with three degrees of freedom: three standard deviations.
THREE_SIGMA = 14.16


def _root_mean_square(values):
    return (sum(value * value for value in values) / len(values)) ** 0.5


def _cells(some, none, channel):
    """Of one channel over the drives of a gap; `none`: the same drives without a gap, by seed."""
    all_of = [row[channel] for row in some]
    on = [one for one in all_of if one["goes_on"]]
    judged = [one for one in on if one["nees"] is not None]
    within = sum(one["nees"] <= THREE_SIGMA for one in judged)
    new_maps = sum(one["new_map"] for one in on)
    rms = _root_mean_square([one["rms_m"] for one in all_of])
    without = _root_mean_square([none[row["seed"]][channel]["rms_m"] for row in some])
    step = number(max(one["step_m"] for one in judged), 3) if judged else "-"
    return (f"{len(on)} of {len(all_of)}", number(max((one["waited_s"] for one in on), default=0.0), 1), step,
            f"{within} of {len(judged)}" if judged else "-", str(new_maps),
            str(sum(one["announced"] for one in on)), number(rms / without, 2))


def gaps(document):
    """A line for each gap, over its drives; one table for each channel."""
    rows = document["rows"]
    none = {row["seed"]: row for row in rows if row["seconds"] == 0.0}
    lines = []
    for channel, name in (("ekf", "EKF_POSE"), ("slam", "SLAM_POSE")):
        found = []
        for key in dict.fromkeys((row["what"], row["seconds"]) for row in rows if row["seconds"] > 0.0):
            some = [row for row in rows if (row["what"], row["seconds"]) == key]
            found.append((key[0], number(key[1], 1), *_cells(some, none, channel)))
        lines += [f"*{name}*", "",
                  *table(("missing", "seconds", "goes on", "longest wait s", "largest step m", "within 3 sigma",
                          "new maps", "announced", "RMS error outside / without a gap"), found), ""]
    return lines[:-1]
