"""The aims, and what was measured of them."""

import claims as claims_module
import formats
from formats import name_of, number, span, times
from results import SWITCHED, moved, percent

AIM_ERROR = 0.001
HEADLINE_ERRORS = (0.01, 0.005, AIM_ERROR)
AIM_SWITCH, AIM_WARM, AIM_LAG = 7, 3, 3
WARM = moved(0.01)
TIGHTEST_BUDGET = claims_module.LAG_BUDGETS[0]


def ratio_of(claims, subject, condition):
    claim = claims_module.find(claims, subject, condition)
    return None if claim is None else claim.ratio


class Headline:
    """The figures that the aims are about, of one result (what has a scene, patches) and its claims."""

    def __init__(self, result, claims):
        self.result = result
        self.claims = claims
        at_aim = f", error {AIM_ERROR:g}"
        self.switch = ratio_of(self.claims, "equal error", SWITCHED + at_aim)
        self.warm = ratio_of(self.claims, "equal error", WARM + at_aim)
        self.switch_compressed = ratio_of(self.claims, "equally compressed", SWITCHED)
        self.warm_compressed = ratio_of(self.claims, "equally compressed", WARM)
        self.switch_any = ratio_of(self.claims, "equal error, any iteration", SWITCHED + at_aim)
        budget = f"{TIGHTEST_BUDGET:g} microseconds"
        self.lag = claims_module.find(self.claims, claims_module.LAG, budget)
        self.fine_lag = claims_module.find(self.claims, claims_module.FINE_LAG, budget)

    def equal_error(self, error):
        """The claim after a switch at this error, or None."""
        return claims_module.find(self.claims, "equal error", f"{SWITCHED}, error {error:g}")

    def row(self, error):
        claim = self.equal_error(error)
        frame = ratio_of(self.claims, "whole frame", f"{SWITCHED}, error {error:g}")
        cold = ratio_of(self.claims, "equal error, cold caches", f"{SWITCHED}, error {error:g}")
        moved_lamp = ratio_of(self.claims, "equal error", f"{WARM}, error {error:g}")
        share = claims_module.find(self.claims, claims_module.SHARE, f"{SWITCHED}, error {error:g}")
        return (
            name_of(self.result),
            f"{self.result.patches:,}",
            *time_and_size(claim and claim.inverse_value, claim and claim.inverse_bytes),
            *time_and_size(claim and claim.rival_value, claim and claim.rival_bytes),
            times(claim and claim.ratio),
            times(moved_lamp),
            times(cold),
            times(frame),
            "–" if share is None else f"{share.inverse_value:.0%} / {share.rival_value:.0%}",
        )

    def lag_row(self):
        return (
            name_of(self.result),
            f"{self.result.patches:,}",
            times(self.switch_compressed),
            times(self.warm_compressed),
            *(
                " / ".join(formats.lag(*side) for side in sides_of(c)) if c else "–"
                for c in (self.lag, self.fine_lag)
            ),
        )


def sides_of(claim):
    """The lags of the inverse and of its rival, each with the switches that never get there."""
    return (claim.inverse_value, claim.inverse_never), (claim.rival_value, claim.rival_never)


def time_and_size(microseconds, size):
    return (
        "–" if microseconds is None else f"{microseconds:,.0f}",
        "–" if not size else number(size / 1e6),
    )


HEADLINE_NAMES = (
    "scene",
    "patches",
    "inverse, µs",
    "MB",
    "Gauss-Seidel, µs",
    "MB",
    "times faster",
    "moved 1 %",
    "cold caches",
    "whole frame",
    "share of bandwidth",
)

LAG_NAMES = (
    "scene",
    "patches",
    "switched, equally compressed",
    "moved 1 %, equally compressed",
    "lag to 1 %",
    "lag to 0.1 %",
)


def aim_line(text, values, aim):
    known = [v for v in values if v is not None]
    met = sum(v >= aim for v in known)
    return (
        f"- {text}: {span(known)} times faster. The goal of {aim} times is met in {met} of {len(known)} cases."
    )


def aims(headlines):
    """The aims beside what was measured, met or not."""
    lines = [
        aim_line(
            f"After a switch, error {percent(AIM_ERROR)} against the exact solution",
            [h.switch for h in headlines],
            AIM_SWITCH,
        ),
        aim_line(
            "After a switch, both matrices compressed to 0.1 %, both within 0.2 % of the exact solution",
            [h.switch_compressed for h in headlines],
            AIM_SWITCH,
        ),
        aim_line(
            f"Warm, a lamp moved by 1 % of the diagonal, error {percent(AIM_ERROR)}",
            [h.warm for h in headlines],
            AIM_WARM,
        ),
        aim_line(
            "Warm, equally compressed", [h.warm_compressed for h in headlines], AIM_WARM
        ),
    ]
    lines += lag_line("1 %", [h.lag for h in headlines])
    lines += lag_line("0.1 %", [h.fine_lag for h in headlines])
    return "\n".join(lines)


def lag_line(error, lags):
    lags = [c for c in lags if c is not None]
    if not lags:
        return []
    reached = [[frames for frames, never in side if not never] for side in zip(*map(sides_of, lags))]
    left_out = [len(lags) - len(side) for side in reached]
    line = (
        f"- Frames after a switch until the error is within {error}, at {TIGHTEST_BUDGET} µs a frame: "
        f"{span(reached[0])} with the inverse, {span(reached[1])} with "
        f"Gauss-Seidel, which needs {AIM_LAG} or more in {sum(c.rival_value >= AIM_LAG for c in lags)} of "
        f"{len(lags)} cases."
    )
    if any(left_out):
        line += (
            f" Cases in which some switch never gets there are in no span: {left_out[0]} of the inverse, "
            f"{left_out[1]} of Gauss-Seidel."
        )
    return [line]
