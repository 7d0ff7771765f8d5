"""Right and wrong loop closures by what became of them, as Markdown tables."""

from render import number, table

AGREEING = ("one-window", "successive")


def _share(count):
    return f"{count['accepted']} of {count['sent']}"


def _percent(count):
    return f"{_share(count)} ({100.0 * count['accepted'] / count['sent']:.1f} %)" if count["sent"] else "-"


def _agreeing(row):
    """Wrong closures of windows that agree by threes and more, together."""
    return {key: sum(row[kind][key] for kind in AGREEING) for key in ("sent", "accepted")}


def drives(rows):
    """A line for each sort of drives and way."""
    lines = []
    for row in rows:
        lines.append((row["odometry"], row["sent"], row["way"], _percent(row["right"]), _share(row["alone"]),
                      _share(_agreeing(row)), _share(row["rows"]) if row["rows"]["sent"] else "-",
                      number(row["ate_m"]), number(row["largest_ate_m"])))
    return table(("odometry states", "sent", "way", "right ones accepted", "wrong alone", "wrong, windows that agree",
                  "wrong, rows", "ATE m", "of the worst drive"), lines)


def bounds(rows):
    """What the shipped way accepted of all wrong closures, with bounds of 95 %. Sorts are kept apart: honest and
    overconfident odometry were sent the same closures."""
    lines = []
    for row in rows:
        for kinds in (("alone",), AGREEING, ("rows",)):
            count = {key: sum(row[kind][key] for kind in kinds)
                     for key in ("sent", "accepted", "waiting", "refused", "groups", "groups_accepted")}
            if row["way"] == "shipped" and count["sent"]:
                groups = f"{count['groups_accepted']} of {count['groups']}" if count["groups"] else "-"
                lines.append((row["odometry"], row["sent"], " + ".join(kinds), count["sent"], count["accepted"],
                              count["waiting"], count["refused"], _bound(count["accepted"], count["sent"]), groups,
                              _bound(count["groups_accepted"], count["groups"])))
    return table(("odometry states", "sent", "wrong ones", "sent", "accepted", "waiting", "refused", "bound",
                  "groups with one accepted", "bound"), lines)


def _bound(hits, count):
    return f"{100.0 * upper_bound(hits, count):.2f} %" if count else "-"


def upper_bound(hits, count):
    """Upper bound of a share, 95 % one-sided (Clopper and Pearson): about 3 / count without a hit."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _chance(hits, count, middle) > 0.05:
            low = middle
        else:
            high = middle
    return high


def _chance(hits, count, share):
    """Chance of so few hits."""
    term = total = (1.0 - share) ** count
    for i in range(hits):
        term *= (count - i) / (i + 1.0) * share / (1.0 - share)
        total += term
    return total


def plantations(rows):
    """What the loop closer sent between rows."""
    lines = [(f"{row['sigma_m']:g}", row["drives"], _share(row["right"]), _share(row["rows"])) for row in rows]
    return table(("trees off their grid, sigma m", "drives", "right ones accepted", "wrong ones accepted"), lines)


def closures(document):
    """All three."""
    of = lambda part: [row for row in document["rows"] if row["part"] == part]
    return ["Accepted of those sent:", "", *drives(of("drives")), "", "The shipped way, bounds of 95 %:", "",
            *bounds(of("drives")), "", "Sent by the loop closer between rows 4 m apart, a tree every 2.5 m:", "",
            *plantations(of("plantation"))]
