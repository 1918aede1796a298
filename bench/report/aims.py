"""The aims, and what was measured of them."""

import claims as claims_module
from formats import name_of, span, times
from results import SWITCHED, moved, percent

AIM_ERROR = 0.001
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

    def row(self):
        claim = claims_module.find(
            self.claims, "equal error", f"{SWITCHED}, error {AIM_ERROR:g}"
        )
        return (
            name_of(self.result),
            f"{self.result.patches:,}",
            "–" if claim is None else f"{claim.inverse_value:.0f}",
            "–" if claim is None else f"{claim.rival_value:.0f}",
            times(self.switch),
            times(self.warm),
            times(self.switch_compressed),
            times(self.warm_compressed),
            "–" if self.lag is None else f"{self.lag.inverse_value:.1f}",
            "–" if self.lag is None else f"{self.lag.rival_value:.1f}",
        )


HEADLINE_NAMES = (
    "scene",
    "patches",
    "inverse, µs",
    "Gauss-Seidel, µs",
    "after a switch",
    "moved 1 %",
    "after a switch, equally compressed",
    "moved 1 %, equally compressed",
    "lag of the inverse",
    "lag of Gauss-Seidel",
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
            "After a switch, both matrices compressed to 0.1 %, Gauss-Seidel forgiven what that "
            "does to its solution",
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
    return [
        f"- Frames after a switch until the error is within {error}, at {TIGHTEST_BUDGET} µs a frame: "
        f"{span([c.inverse_value for c in lags])} with the inverse, {span([c.rival_value for c in lags])} with "
        f"Gauss-Seidel, which needs {AIM_LAG} or more in {sum(c.rival_value >= AIM_LAG for c in lags)} of "
        f"{len(lags)} cases."
    ]
