"""The report in words: a Markdown file for notes/ and the block that README quotes."""

import claims as claims_module
import results as results_module
from results import REPAINTED, SWITCHED, moved, percent

AIM_ERROR = 0.001
AIM_SWITCH, AIM_WARM, AIM_LAG = 7, 3, 3
WARM = moved(0.01)
TIGHTEST_BUDGET = claims_module.LAG_BUDGETS[0]
README_BEGIN, README_END = "<!-- report -->", "<!-- /report -->"
PATH_BUDGET = 500


def times(ratio):
    return "–" if ratio is None else f"{ratio:.1f}" if ratio < 10 else f"{ratio:.0f}"


def number(value):
    return "–" if value is None else f"{value:.3g}" if value < 1000 else f"{value:,.0f}"


def markdown_table(names, rows):
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    return "\n".join(lines + ["| " + " | ".join(str(c) for c in row) + " |" for row in rows])


def name_of(result):
    return result.scene.replace("_", " ")


def ratio_of(claims, subject, condition):
    claim = claims_module.find(claims, subject, condition)
    return None if claim is None else claim.ratio


class Headline:
    """The figures that the aims are about, of one result."""

    def __init__(self, result):
        self.result = result
        self.claims = claims_module.all_claims(result)
        at_aim = f", error {AIM_ERROR:g}"
        self.switch = ratio_of(self.claims, "equal error", SWITCHED + at_aim)
        self.warm = ratio_of(self.claims, "equal error", WARM + at_aim)
        self.switch_compressed = ratio_of(self.claims, "equally compressed", SWITCHED)
        self.warm_compressed = ratio_of(self.claims, "equally compressed", WARM)
        self.switch_any = ratio_of(self.claims, "equal error, any iteration", SWITCHED + at_aim)
        self.lag = claims_module.find(
            self.claims, "lag after a switch", f"{TIGHTEST_BUDGET:g} microseconds"
        )

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


def span(values):
    values = [v for v in values if v is not None]
    if not values:
        return "–"
    low, high = times(min(values)), times(max(values))
    return low if low == high else f"{low} to {high}"


def aim_line(text, values, aim):
    known = [v for v in values if v is not None]
    met = sum(v >= aim for v in known)
    return f"- {text}: {span(known)} times faster; at least {aim} in {met} of {len(known)} cases."


def aims(headlines):
    """The aims beside what was measured, met or not."""
    lags = [h.lag for h in headlines if h.lag is not None]
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
    if lags:
        lines.append(
            f"- Lag after a switch to an error of 1 % at {TIGHTEST_BUDGET} µs a frame: the inverse "
            f"{span([c.inverse_value for c in lags])} frames, Gauss-Seidel "
            f"{span([c.rival_value for c in lags])}; {AIM_LAG} or more in "
            f"{sum(c.rival_value >= AIM_LAG for c in lags)} of {len(lags)} cases."
        )
    return "\n".join(lines)


def losses(headlines):
    """The conditions under which Gauss-Seidel is as fast or faster."""
    return [
        (name_of(h.result), f"{c.patches:,}", c.condition, number(c.inverse_value), c.rival,
         number(c.rival_value), times(c.ratio))
        for h in headlines
        for c in h.claims
        if c.subject == "equal error" and c.ratio is not None and c.ratio <= 1
    ]


LOSS_NAMES = ("scene", "patches", "change, error", "inverse, µs", "Gauss-Seidel", "µs", "ratio")


def largest_motion(headline, target):
    """The largest motion, a part of the diagonal, at which Gauss-Seidel is as fast; 0: none."""
    largest = 0.0
    for motion in headline.result["settings"]["motions"]:
        ratio = ratio_of(headline.claims, "equal error", f"{moved(motion)}, error {target:g}")
        if ratio is not None and ratio <= 1:
            largest = max(largest, motion)
    return largest


def motion_rows(headlines):
    return [
        (
            name_of(h.result),
            f"{h.result.patches:,}",
            *(percent(m) if (m := largest_motion(h, t)) else "none" for t in results_module.TARGETS),
        )
        for h in headlines
    ]


MOTION_NAMES = ("scene", "patches", *(f"error {percent(t)}" for t in results_module.TARGETS))


def frame_rows(result, budget=PATH_BUDGET):
    rows = []
    for path in result.paths():
        for label, methods in (
            ("inverse", results_module.INVERSES),
            ("Gauss-Seidel", results_module.GAUSS_SEIDEL),
            ("conjugate gradients", ("conjugate-gradient",)),
            ("low rank", ("low rank", "first bounce + low rank")),
            ("hierarchical radiosity", ("hierarchical radiosity",)),
        ):
            row = result.best_frames(path, methods, budget)
            if row is None:
                rows.append((path, label, "does not fit", "", "", "", ""))
                continue
            lag = row.get("lag_1_percent")
            rows.append(
                (
                    path,
                    label,
                    results_module.describe(row),
                    f"{row['error_mean']:.1e}",
                    f"{row['error_p95']:.1e}",
                    f"{row['error_worst']:.1e}",
                    f"{lag['mean']:.1f}" if lag else "",
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


def provenance(results, date):
    r = results[0]
    commits = ", ".join(dict.fromkeys(x["commit"] for x in results))
    return (
        f"{r['processor']}, {r['processors']} processors; {r['compiler']}, {r['build_type']}; "
        f"commit {commits}; {date}. Offline work on {r['threads']} threads, relighting on "
        f"{r['settings']['solve_threads']}. Times are medians of {r['settings']['repeats']} rounds in "
        f"which all methods take turns; median spread of a time (interquartile range ÷ median) "
        f"{percent(round(median_spread(results), 3))}."
    )


def median_spread(results):
    spreads = sorted(row["spread"] for r in results for row in r["accuracy"])
    return spreads[len(spreads) // 2]


METHOD = """Errors are of the light that patches reflect after it came from other patches, B − M0: relative,
area-weighted L2 over three channels, mean over {lamps} lamps, against Gauss-Seidel in double precision to 1e-10
on the exact form factors. The truth of the light paths is the dense inverse, which is within {dense:.0e} of that.

Each side has its best form. The inverse: hierarchical at several tolerances, dense, or refined. Gauss-Seidel: forward or
symmetric, on exact form factors or on compressed ones at several tolerances, whichever is fastest to the error. Warm
starts begin at the converged solution of the frame before on the same form. Caches hold what the method's own last run
left; `accuracy.csv` has the same with caches that something else has used. Sweeps that fit into a budget are told by the
measured times, so that a light path has the same errors in every run with the same times; a method that makes no
sweep within the budget is left out. Lamps are points of 1 cd in free space, alone: the scene's own emitters are dark."""


def missing_line(missing):
    if not missing:
        return ""
    return "\n**Not run:** " + ", ".join(f"{s.replace('_', ' ')} at {n:,}" for s, n in missing) + ".\n"


def readme_block(headlines):
    rows = [h.row() for h in headlines]
    return (
        f"{markdown_table(HEADLINE_NAMES, rows)}\n\n"
        f"Microseconds to an error of {percent(AIM_ERROR)} after a lamp was switched for another, one "
        f"thread, and how many times faster the inverse is; lag in frames to 1 % at {TIGHTEST_BUDGET} µs "
        "a frame. [notes/report.md](notes/report.md) has the conditions, and where Gauss-Seidel wins.\n\n"
        f"{aims(headlines)}"
    )


def markdown(headlines, missing, date, pictures):
    """The whole file; `pictures` maps "accuracy", "winners", "frames" and scenes to paths."""
    all_results = [h.result for h in headlines]
    largest = max(all_results, key=lambda r: r.patches)
    parts = [
        "# The stored inverse against Gauss-Seidel",
        "Written by `./dev report`; the raw figures are in `report-out/` after a run, each claim with its "
        "rows in `report_claims.csv` beside this file.",
        provenance(all_results, date) + missing_line(missing),
        "## Summary",
        markdown_table(HEADLINE_NAMES, [h.row() for h in headlines]),
        f"Microseconds to an error of {percent(AIM_ERROR)} after a lamp was switched for another; then how many "
        f"times faster the inverse is. Lag: frames after a switch until the error is within 1 %, at "
        f"{TIGHTEST_BUDGET} µs a frame.",
        aims(headlines),
        "## How it was measured",
        METHOD.format(
            lamps=largest["settings"]["lamps"],
            dense=max(r["dense_error"] for r in all_results),
        ),
        "## Accuracy and time",
        f"![Error against time]({pictures['accuracy']})",
        f"![How many times faster the inverse is]({pictures['winners']})",
        "Ratio of the times to an error, Gauss-Seidel ÷ inverse, by change of the light: red, the inverse is faster.",
        "## Where Gauss-Seidel wins",
        where_gauss_seidel_wins(headlines),
        "## Light paths",
        f"{largest.title}, {PATH_BUDGET} µs a frame, each method in its best form and warm from its last frame:",
        f"![Error by frame]({pictures['frames']})",
        markdown_table(FRAME_NAMES, frame_rows(largest)),
        "## What it costs to have",
        markdown_table(COST_SUMMARY_NAMES, cost_summary_rows(headlines)),
        "Break-even: after so many switched frames at an error of 0.1 % the inverse has saved the seconds that it takes "
        "beyond what compressing F takes.",
        "## Truth",
        markdown_table(TRUTH_NAMES, truth_rows(headlines)),
        "Against the path tracer under a key light. *Discretisation* is what is left with 64 shadow rays for every pair and "
        "the dense inverse: one value per patch, lamps looked at at eight points. *Form factors* and *compression* are the "
        "difference that each makes to H. An error below the noise is not known. The furnace: every surface reflects half, "
        "and openings send in what surfaces would.",
        "## Pictures",
        *(f"![{scene}]({path})" for scene, path in pictures["scenes"].items()),
    ]
    return "\n\n".join(parts) + "\n"


def where_gauss_seidel_wins(headlines):
    rows = losses(headlines)
    cold = [
        c.ratio
        for h in headlines
        for c in h.claims
        if c.subject == "equal error, cold caches" and c.condition.startswith(f"{SWITCHED}, error 0.001")
    ]
    any_iteration = [h.switch_any for h in headlines]
    repainted = [ratio_of(h.claims, "equal error", REPAINTED) for h in headlines]
    parts = [
        "The largest motion of a lamp, as a part of the scene's diagonal, at which Gauss-Seidel, warm, is as fast as "
        "the inverse:",
        markdown_table(MOTION_NAMES, motion_rows(headlines)),
        f"Conditions measured in which it is at least as fast: {len(rows)}."
        + (" The ten in which it wins by most:" if len(rows) > 10 else ""),
    ]
    if rows:
        ordered = sorted(rows, key=lambda r: float(r[-1]))
        parts.append(markdown_table(LOSS_NAMES, ordered[:10]))
    parts.append(
        f"- Repainted (the commonest material reflects half of what it did): the operator is wrong, and helps only as a "
        f"preconditioner; time of the best iteration ÷ time of the best method that uses it: {span(repainted)}."
    )
    parts.append(
        f"- Against the best iteration of any kind instead of Gauss-Seidel, after a switch to 0.1 %: {span(any_iteration)}."
    )
    parts.append(f"- With caches that something else has used, after a switch to 0.1 %: {span(cold)}.")
    parts.append(
        "- The rule that `--method auto` uses ([solvers.md](solvers.md)) follows from these figures."
    )
    return "\n\n".join(parts[:3 + bool(rows)]) + "\n\n" + "\n".join(parts[3 + bool(rows):])


def quote_in_readme(path, block):
    """Replaces what stands between the markers of README."""
    text = path.read_text(encoding="utf-8")
    before, _, rest = text.partition(README_BEGIN)
    _, end, after = rest.partition(README_END)
    if not end:
        raise SystemExit(f"{path} has no {README_BEGIN} ... {README_END} to quote the summary in")
    path.write_text(
        f"{before}{README_BEGIN}\n{block}\n{README_END}{after}", encoding="utf-8"
    )
