"""How figures are written."""

import math


def times(ratio):
    return "–" if ratio is None else f"{ratio:.1f}" if ratio < 9.95 else f"{ratio:.0f}"


def number(value):
    if value is None:
        return "–"
    if math.isinf(value):
        return "diverges"
    return f"{value:.3g}" if value < 999.5 else f"{value:,.0f}"


def lag(frames, never):
    """A lag of so many frames; after `never` of the switches the error was not reached."""
    return "never" if math.isinf(frames) else f"{'> ' if never else ''}{frames:.1f}"


def markdown_table(names, rows):
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    return "\n".join(lines + ["| " + " | ".join(str(c) for c in row) + " |" for row in rows])


def name_of(thing):
    """The scene of a result or a claim, for people."""
    return thing.scene.replace("_", " ")


def span(values, text=times):
    values = [v for v in values if v is not None]
    if not values:
        return "–"
    low, high = text(min(values)), text(max(values))
    return low if low == high else f"{low} to {high}"
