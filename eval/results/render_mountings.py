"""One wrong mounting, unit or sign of a sensor on each drive, as a Markdown table."""

from render import number, table

# Named so long after the start of motion [s]; of a hundred poses so many may be outside of 3 sigma.
IN_TIME_S = 10.0
OUTSIDE = 0.01


def _is_named(row):
    return row["named_s"] is not None and row["named_s"] <= IN_TIME_S


def _is_inside(row):
    return all(row[channel]["outside"] <= OUTSIDE * row[channel]["poses"] for channel in ("slam", "ekf"))


def _line(title, some):
    named = [row for row in some if _is_named(row)]
    rest = [row for row in some if not _is_named(row)]
    moving = [row["named_s"] for row in named if row["named_s"] > 0.0]
    latest = number(max(moving), 1) if moving else "at rest" if named else "-"
    far = number(max(row["slam"]["largest_m"] for row in rest if not _is_inside(row)), 2) \
        if any(not _is_inside(row) for row in rest) else "-"
    return (title, str(len(some)), str(len(named)), latest, str(sum(map(_is_inside, rest))),
            str(sum(not _is_inside(row) for row in rest)), far, str(sum(bool(row["blamed"]) for row in some)))


def mountings(document):
    """A line for each kind of fault, then all faults, then the sound drives."""
    rows = document["rows"]
    faulty = [row for row in rows if row["culprit"] != "none"]
    lines = []
    for culprit in dict.fromkeys(row["culprit"] for row in faulty):
        of_one = [row for row in faulty if row["culprit"] == culprit]
        for kind in dict.fromkeys(row["kind"] for row in of_one):
            lines.append(_line(kind, [row for row in of_one if row["kind"] == kind]))
    lines.append(_line("**all**", faulty))
    sound = [row for row in rows if row["culprit"] == "none"]
    blamed = sum(bool(row["blamed"]) for row in sound)
    inside = sum(map(_is_inside, sound))
    return [*table(("what is wrong", "drives", "named within 10 s of motion", "latest s", "else within 3 sigma", "neither",
                    "largest error there m", "another sensor blamed"), lines), "",
            f"Sound drives: {len(sound)}, a sensor blamed on {blamed}; poses within 3 sigma (99 %) on {inside}."]
