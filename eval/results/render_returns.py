"""Drives that drift and come back near themselves, as a Markdown table."""

from render import number, table


def returns(document):
    """A line for each map, drift and share seen, over its drives."""
    rows = document["rows"]
    cell = lambda row: (row["map"], row["seen_share"], row["drift_sigma_m"])
    lines = []
    for key in dict.fromkeys(map(cell, rows)):
        some = [row for row in rows if cell(row) == key]
        total = lambda name: sum(row[name] for row in some)
        near = sum(row["last_error_m"] < 1.0 for row in some)
        lines.append((key[0], f"{100.0 * key[1]:.0f} %", number(key[2], 0), len(some), near,
                      total("merges"), total("false_merges"), f"{total('joined')} of {total('doubled')}",
                      f"{total('false_associations')} of {total('associations')}",
                      number(sum(row["mean_nees"] for row in some) / len(some), 1),
                      number(max(row["mean_nees"] for row in some), 1)))
    merges = sum(row["merges"] for row in rows)
    false = sum(row["false_merges"] for row in rows)
    return [*table(("map", "seen on a lap", "drift m", "drives", "end within 1 m", "merges", "false",
                    "doubles that are one", "false associations", "NEES [3]", "of the worst drive"), lines),
            "", f"False merges: {false} of {merges}."]
