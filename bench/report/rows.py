"""The tables of the report: their columns, and a row for each thing."""

import claims as claims_module
import formats
import results as results_module
from aims import ratio_of
from formats import name_of, number, times
from results import SWITCHED, moved, percent

PATH_BUDGET = 500

# Errors below this are of single precision, and neither side's merit.
ROUNDING = 1e-6


def losses(headlines, subjects):
    """The claims of these subjects in which Gauss-Seidel is as good or better, the clearest first."""
    claims = [
        c
        for h in headlines
        for c in h.claims
        if c.subject.startswith(subjects)
        and c.ratio is not None
        and c.ratio <= 1
        and (c.unit == "microseconds" or c.inverse_value > ROUNDING)
    ]
    return sorted(claims, key=lambda c: c.ratio)


def condition_of(claim):
    return claim.condition + (", cold caches" if "cold caches" in claim.subject else "")


def time_losses(headlines):
    """The conditions in which an iteration of any kind is as fast or faster, each with the fastest."""
    claims = {}
    for c in losses(headlines, ("equal error",)):
        claims.setdefault((c.scene, c.patches, condition_of(c)), c)
    return list(claims.values())


PATH_SUBJECTS = ("light path",)


def loss_rows(claims):
    return [
        (
            name_of(c),
            f"{c.patches:,}",
            condition_of(c),
            c.inverse,
            number(c.inverse_value),
            c.rival,
            number(c.rival_value),
            times(c.ratio),
        )
        for c in claims
    ]


LOSS_NAMES = ("scene", "patches", "change, error", "inverse", "µs", "rival", "µs", "ratio")


def path_loss_rows(claims):
    return [
        (
            name_of(c),
            f"{c.patches:,}",
            c.subject.removeprefix("light path: "),
            c.condition,
            c.inverse,
            f"{c.inverse_value:.1e}",
            c.rival,
            f"{c.rival_value:.1e}",
        )
        for c in claims
    ]


PATH_LOSS_NAMES = ("scene", "patches", "path", "budget", "inverse", "error", "Gauss-Seidel", "error")


def largest_motion(headline, target):
    """The largest motion, a part of the diagonal, at which Gauss-Seidel is as fast; if there is none,
    the smallest that both sides were measured at, or –."""
    ratios = {
        motion: ratio
        for motion in claims_module.motions(headline.claims)
        if (ratio := ratio_of(headline.claims, "equal error", f"{moved(motion)}, error {target:g}"))
    }
    lost = [motion for motion, ratio in ratios.items() if ratio <= 1]
    if lost:
        return percent(max(lost))
    return f"none from {percent(min(ratios))}" if ratios else "–"


def motion_rows(headlines):
    return [
        (
            name_of(h.result),
            f"{h.result.patches:,}",
            *(largest_motion(h, t) for t in results_module.TARGETS),
        )
        for h in headlines
    ]


MOTION_NAMES = ("scene", "patches", *(f"error {percent(t)}" for t in results_module.TARGETS))


EQUAL_TIME_NAMES = (
    "scene",
    "patches",
    *(f"{t:,} µs: inverse / Gauss-Seidel" for t in claims_module.EQUAL_TIMES),
)


def equal_time_rows(headlines):
    rows = []
    for h in headlines:
        cells = []
        for t in claims_module.EQUAL_TIMES:
            c = claims_module.find(h.claims, "equal time", f"{SWITCHED}, {t} microseconds")
            cells.append("–" if c is None else f"{c.inverse_value:.1e} / {c.rival_value:.1e}")
        rows.append((name_of(h.result), f"{h.result.patches:,}", *cells))
    return rows


def shown_on_paths(all_results):
    """Of the largest results the first into whose frames both sides fit."""
    sides = (results_module.INVERSES, results_module.GAUSS_SEIDEL)
    followed = [r for r in all_results if all(r.fits(PATH_BUDGET, side) for side in sides)]
    return max(followed or all_results, key=lambda r: r.patches)


def frame_rows(result, budget=PATH_BUDGET):
    rows = []
    for path in result.paths():
        for label, methods in (
            ("inverse", results_module.INVERSES),
            ("Gauss-Seidel", results_module.GAUSS_SEIDEL),
            ("conjugate gradients", ("conjugate-gradient",)),
            ("low rank", ("low rank",)),
            ("hierarchical radiosity", ("hierarchical radiosity",)),
        ):
            row = result.best_frames(path, methods, budget)
            if row is None:
                rows.append((path, label, "does not fit", "", "", "", ""))
                continue
            key = "lag_1_percent"
            rows.append(
                (
                    path,
                    label,
                    results_module.describe(row),
                    f"{row['error_mean']:.1e}",
                    f"{row['error_p95']:.1e}",
                    f"{row['error_worst']:.1e}",
                    formats.lag(*results_module.lag_of(row, key)) if key in row else "",
                )
            )
    return rows


FRAME_NAMES = ("path", "method", "how", "mean", "95th percentile", "worst", "lag to 1 %, frames")


def cost_rows(result):
    return [
        (c["phase"], f"{c['seconds']:.2f}", number(c["bytes"]) if "bytes" in c else "")
        for c in result["costs"]
    ]


COST_NAMES = ("phase", "seconds", "bytes")


def cost_summary_rows(headlines):
    rows = []
    for h in headlines:
        r = h.result
        even = next((c for c in h.claims if c.subject == "break-even"), None)
        shared = sum(r.seconds(p) for p in ("import", "patches", "form factors"))
        rows.append(
            (
                name_of(r),
                f"{r.patches:,}",
                number(shared),
                number(even.inverse_value) if even else "–",
                number(even.rival_value) if even else "–",
                number(r["file_bytes"] / 1e6),
                number(r["exchange_bytes"] / 1e6),
                number(r["peak_memory_bytes"] / 1e6),
            )
        )
    return rows


COST_SUMMARY_NAMES = (
    "scene",
    "patches",
    "patches and F, s (both need it)",
    "the inverse beyond that, s",
    "break-even, frames",
    "file, MB",
    "of it F, MB",
    "peak memory, MB",
)


def truth_rows(headlines):
    rows = []
    for h in headlines:
        furnace, truth = h.result["furnace"], h.result.get("truth")
        cells = ["–"] * 5
        if truth:
            means, parts = truth["patch_means"], truth["discretisation"]
            cells = [
                f"{percent(round(means['error'], 4))} ± {percent(round(means['noise'], 4))}",
                percent(round(parts["error"], 4)),
                percent(round(truth["form_factors"], 5)),
                percent(round(truth["compression"], 5)),
                percent(round(truth["reconstruction"]["error"], 4)),
            ]
        rows.append(
            (name_of(h.result), f"{h.result.patches:,}", *cells, f"{furnace['error_max']:.1e}")
        )
    return rows


TRUTH_NAMES = (
    "scene",
    "patches",
    "all, patch means ± noise",
    "discretisation",
    "form factors",
    "compression",
    "all, interpolated",
    "furnace, worst",
)
