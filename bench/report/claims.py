"""What the summary says, each figure with the rows that it comes from."""

import dataclasses
import re

import results

LAG_BUDGETS = (250, 500, 1000, 2000)
EQUAL_TIMES = (50, 100, 250, 1000)  # microseconds
SHARE = "share of bandwidth"
LAG, FINE_LAG = "lag after a switch", "lag after a switch to 0.1 %"


@dataclasses.dataclass
class Claim:
    """A figure of the summary; `claims.csv` holds all of them."""

    scene: str
    patches: int
    subject: str  # what is claimed: "equal error", "equally compressed", "lag"...
    condition: str  # change of the light and error, or path and budget
    inverse: str  # how the inverse did it
    inverse_value: float
    rival: str
    rival_value: float
    unit: str
    inverse_bytes: int | None = None  # of the matrices that a side has to hold; None: of no interest
    rival_bytes: int | None = None
    inverse_never: int | None = None  # of a lag: the switches after which the error is not reached
    rival_never: int | None = None

    @property
    def ratio(self):
        """None where it is not known: a lag with switches that never get there is but a bound."""
        known = self.inverse_value and not self.inverse_never and not self.rival_never
        return self.rival_value / self.inverse_value if known else None


def time_claim(result, subject, change, target, inverse, rival, time="microseconds"):
    if inverse is None or rival is None:
        return None
    return Claim(
        result.scene,
        result.patches,
        subject,
        f"{change}, error {target:g}",
        results.describe(inverse),
        inverse[time],
        results.describe(rival),
        rival[time],
        "microseconds",
        inverse["bytes"],
        rival["bytes"],
    )


def equal_error(result, change, target, rivals=results.GAUSS_SEIDEL, time="microseconds"):
    """Times to an error against the exact solution, each side in its best form."""
    subject = "equal error" if time == "microseconds" else "equal error, cold caches"
    if rivals != results.GAUSS_SEIDEL:
        subject += ", any iteration"
    return time_claim(
        result,
        subject,
        change,
        target,
        result.fastest(change, results.INVERSES, target, time=time),
        result.fastest(change, rivals, target, time=time),
        time,
    )


def equally_compressed(result, change, tolerance=0.001):
    """Y and F both compressed to `tolerance`, and both to be within twice that of the exact solution:
    once for what is lost by compression, once for what iterations have left."""
    name = results.percent(tolerance)
    return time_claim(
        result,
        "equally compressed",
        change,
        2 * tolerance,
        result.fastest(change, ("inverse",), 2 * tolerance, form=f"hierarchical {name}"),
        result.fastest(change, results.GAUSS_SEIDEL, 2 * tolerance, form=f"compressed {name}"),
    )


def whole_frame(result, change, target):
    """The same with direct light and outputs, which both sides need: a frame as an engine has it."""
    claim = equal_error(result, change, target)
    if claim is None:
        return None
    rest = result["rest_of_frame"]
    more = rest["direct_microseconds"] + rest["outputs_microseconds"]
    return dataclasses.replace(
        claim,
        subject="whole frame",
        inverse_value=claim.inverse_value + more,
        rival_value=claim.rival_value + more,
    )


def share_of_bandwidth(result, change, target):
    """How fast the sides of equal_error read their matrices, as a part of the memory's bandwidth:
    the same share of it means that neither has the better tuned kernels."""
    inverse = result.fastest(change, results.INVERSES, target)
    rival = result.fastest(change, results.GAUSS_SEIDEL, target)
    if inverse is None or rival is None:
        return None

    def share(row):
        return row["bytes_read"] / (1e-6 * row["microseconds"]) / result["memory_bandwidth"]

    return Claim(
        result.scene,
        result.patches,
        SHARE,
        f"{change}, error {target:g}",
        results.describe(inverse),
        share(inverse),
        results.describe(rival),
        share(rival),
        "part of the memory's bandwidth",
    )


def equal_time(result, change, microseconds):
    """The least errors that either side reaches in this time."""
    inverse = result.most_exact(change, results.INVERSES, microseconds)
    rival = result.most_exact(change, results.GAUSS_SEIDEL, microseconds)
    if inverse is None or rival is None:
        return None
    return Claim(
        result.scene,
        result.patches,
        "equal time",
        f"{change}, {microseconds} microseconds",
        results.describe(inverse),
        inverse["error"],
        results.describe(rival),
        rival["error"],
        "relative error",
    )


def lag(result, budget, key="lag_1_percent"):
    """Frames after a switch until the error is within 1 %, each side in its best form: that which
    gets there after the most switches, and soonest."""

    def order(row):
        frames, never = results.lag_of(row, key)
        return never, frames, row["error_mean"]

    def best(methods):
        rows = [
            r
            for r in result["frames"]
            if r["method"] in methods
            and r["budget_microseconds"] == budget
            and r["sweeps"] > 0
            and key in r
        ]
        return min(rows, key=order, default=None)

    inverse, rival = best(results.INVERSES), best(results.GAUSS_SEIDEL)
    if inverse is None or rival is None:
        return None
    inverse_frames, inverse_never = results.lag_of(inverse, key)
    rival_frames, rival_never = results.lag_of(rival, key)
    return Claim(
        result.scene,
        result.patches,
        LAG if key == "lag_1_percent" else FINE_LAG,
        f"{budget:g} microseconds a frame",
        results.describe(inverse),
        inverse_frames,
        results.describe(rival),
        rival_frames,
        "frames",
        inverse_never=inverse_never,
        rival_never=rival_never,
    )


def frame_errors(result, path, budget):
    inverse = result.best_frames(path, results.INVERSES, budget)
    rival = result.best_frames(path, results.GAUSS_SEIDEL, budget)
    if inverse is None or rival is None:
        return None
    return Claim(
        result.scene,
        result.patches,
        f"light path: {path}",
        f"{budget:g} microseconds a frame",
        results.describe(inverse),
        inverse["error_mean"],
        results.describe(rival),
        rival["error_mean"],
        "mean relative error",
    )


def break_even(result, change=results.SWITCHED, target=0.001):
    """Frames after which the inverse has earned its offline seconds, over compressed F's."""
    times = equal_error(result, change, target)
    inverse = result.fastest(change, results.INVERSES, target)
    rival = result.fastest(change, results.GAUSS_SEIDEL, target)
    if times is None or times.rival_value <= times.inverse_value:
        return None
    needed = result.seconds("operator") + result.seconds(inverse["transfer"])
    spared = result.seconds(f"form factors {rival['form']}")
    frames = max(0.0, needed - spared) / (times.rival_value - times.inverse_value) * 1e6
    return Claim(
        result.scene,
        result.patches,
        "break-even",
        times.condition,
        times.inverse,
        needed,
        times.rival,
        frames,
        "offline seconds (inverse), frames (rival)",
    )


def all_claims(result):
    """Every claim about one result, in the order of the summary."""
    claims = []
    changes = [c for c in result.changes() if c != results.REPAINTED]
    for change in changes:
        for target in results.TARGETS:
            claims.append(equal_error(result, change, target))
            claims.append(equal_error(result, change, target, results.ITERATIONS))
            claims += [
                equal_error(result, change, target, rivals, "microseconds_cold_cache")
                for rivals in (results.GAUSS_SEIDEL, results.ITERATIONS)
            ]
            claims.append(whole_frame(result, change, target))
            claims.append(share_of_bandwidth(result, change, target))
        claims.append(equally_compressed(result, change))
        claims += [equal_time(result, change, t) for t in EQUAL_TIMES]
    claims.append(repainted(result))
    for budget in LAG_BUDGETS:
        claims.append(lag(result, budget))
        claims.append(lag(result, budget, "lag_0.1_percent"))
        claims += [frame_errors(result, path, budget) for path in result.paths()]
    claims.append(break_even(result))
    return [c for c in claims if c is not None]


def repainted(result, target=0.001):
    """After surfaces were repainted the operator serves refinement at best."""
    return time_claim(
        result,
        "equal error",
        results.REPAINTED,
        target,
        result.fastest(results.REPAINTED, results.INVERSES, target),
        result.fastest(results.REPAINTED, results.ITERATIONS, target),
    )


def motions(claims):
    """The motions that claims are about, as parts of the scene's diagonal, ascending."""
    found = (re.match(r"moved ([\d.]+) %, error", claim.condition) for claim in claims)
    return sorted({float(match.group(1)) / 100 for match in found if match})


def find(claims, subject, condition):
    """The claim of that subject whose condition begins so, or None."""
    return next(
        (c for c in claims if c.subject == subject and c.condition.startswith(condition)), None
    )
