"""The results of bench_report, and the questions that the report asks of them."""

import json
import math
import pathlib

GAUSS_SEIDEL = ("gauss-seidel", "symmetric-gauss-seidel")
ITERATIONS = (*GAUSS_SEIDEL, "gathering", "conjugate-gradient", "hierarchical radiosity")
INVERSES = ("inverse", "dense inverse", "refine")
PRODUCTS = ("inverse", "dense inverse", "low rank")

FROM_ZERO, SWITCHED, REPAINTED = "from zero", "switched", "repainted"
TARGETS = (0.01, 0.005, 0.003, 0.001, 0.0001)


def percent(part):
    return f"{100 * part:g} %"


def moved(part):
    """The name of the change by which a lamp moves by this part of the scene's diagonal."""
    return f"moved {percent(part)}"


class Result:
    """One scene with one number of patches."""

    def __init__(self, path):
        self.path = pathlib.Path(path)
        self.data = json.loads(self.path.read_text(encoding="utf-8"))
        self.data["frames"] = [with_infinity(row) for row in self.data["frames"]]

    def __getitem__(self, key):
        return self.data[key]

    def get(self, key):
        return self.data.get(key)

    @property
    def scene(self):
        return self.data["scene"]

    @property
    def patches(self):
        return self.data["patches"]

    @property
    def title(self):
        return f"{self.scene.replace('_', ' ')}, {self.patches:,} patches"

    def changes(self):
        return list(dict.fromkeys(row["change"] for row in self["accuracy"]))

    def accuracy(self, change, methods):
        """Rows of a change; without those that have no error, as nothing was reflected."""
        return [
            r
            for r in self["accuracy"]
            if r["change"] == change and r["method"] in methods and r["error"] is not None
        ]

    def fastest(self, change, methods, target, error="error", form=None, time="microseconds"):
        """The row of least time whose error is within `target`, or None."""
        rows = [
            r
            for r in self.accuracy(change, methods)
            if r[error] <= target and (form is None or form in (r["form"], r["transfer"]))
        ]
        return min(rows, key=lambda r: r[time], default=None)

    def most_exact(self, change, methods, microseconds):
        """The row of least error among those that take no longer, or None."""
        rows = [
            r for r in self.accuracy(change, methods) if r["microseconds"] <= microseconds
        ]
        return min(rows, key=lambda r: r["error"], default=None)

    def envelope(self, change, methods):
        """The rows that no faster row of the same methods beats, by time."""
        best, rows = float("inf"), []
        for row in sorted(self.accuracy(change, methods), key=lambda r: r["microseconds"]):
            if 0 < row["error"] < best:
                best = row["error"]
                rows.append(row)
        return rows

    def paths(self):
        return list(dict.fromkeys(row["path"] for row in self["frames"]))

    def fits(self, budget, methods):
        """Whether a product or a sweep of any of the methods fits into a budget."""
        return any(
            r["budget_microseconds"] == budget and r["sweeps"] > 0 and r["method"] in methods
            for r in self["frames"]
        )

    def best_frames(self, path, methods, budget):
        """The row of least mean error over a light path at a budget, or None if nothing fits."""
        rows = [
            r
            for r in self["frames"]
            if r["path"] == path
            and r["method"] in methods
            and r["budget_microseconds"] == budget
            and r["sweeps"] > 0
        ]
        return min(rows, key=lambda r: r["error_mean"], default=None)

    def seconds(self, phase):
        return sum(c["seconds"] for c in self["costs"] if c["phase"] == phase)


def with_infinity(row):
    """JSON has no infinite numbers: the errors of a method that diverged are null there."""
    errors = [math.inf if e is None else e for e in row.get("errors", [])]
    return {k: math.inf if v is None else v for k, v in row.items()} | {"errors": errors}


def lag_of(row, key):
    """Mean frames from a switch to an error, infinite if no switch reached it before the next one;
    and the number of switches that did not, which count as the frames up to the next."""
    lag = row[key]
    never = lag.get("never", 0)
    # It is as far from each switch to the next, so that the mean is the worst if none reached it.
    none = never and math.isclose(lag["mean"], lag["worst"])
    return math.inf if none else lag["mean"], never


def describe(row):
    """How a row did it: "gauss-seidel, compressed 0.1 %, 3 sweeps"; after a switch iterations may
    start in the dark, "3 sweeps from zero"."""
    parts = [row["method"], row["transfer"], row["form"]]
    if row["sweeps"] > 0 and row["form"]:
        start = " from zero" if row.get("cold") and row["change"] == SWITCHED else ""
        parts.append(f"{row['sweeps']} sweep{'s' if row['sweeps'] != 1 else ''}{start}")
    return ", ".join(p for p in parts if p)


def load(paths):
    """Results by scene in the order given, then by patches."""
    results = [Result(path) for path in paths]
    order = list(dict.fromkeys(r.scene for r in results))
    return sorted(results, key=lambda r: (order.index(r.scene), r.patches))
