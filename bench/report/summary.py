"""The report in words: a Markdown file, and the parts of it that claims alone give."""

import statistics

import rows
from aims import (
    AIM_ERROR,
    HEADLINE_ERRORS,
    HEADLINE_NAMES,
    LAG_NAMES,
    TIGHTEST_BUDGET,
    aims,
    ratio_of,
)
from formats import markdown_table, span
from results import REPAINTED, SWITCHED, percent

SHOWN_LOSSES = 12


def provenance(results, date):
    r = results[0]
    commits = ", ".join(dict.fromkeys(x["commit"] for x in results))
    return (
        f"{r['processor']}, {r['processors']} processors; {r['compiler']}, {r['build_type']}; "
        f"commit {commits}; {date}. Offline work on {r['threads']} threads, relighting on "
        f"{r['settings']['solve_threads']}. Times are medians of {setting(results, 'repeats')} rounds in "
        f"which all methods take turns; median spread of a time (interquartile range ÷ median) "
        f"{percent(round(median_spread(results), 3))}."
    )


def setting(results, key):
    """A setting, or the least and the greatest where results differ in it."""
    return span([r["settings"][key] for r in results], str)


def median_spread(results):
    return statistics.median(row["spread"] for r in results for row in r["accuracy"])


METHOD = """Errors are of the light that patches reflect after it came from other patches, B − M0: relative,
area-weighted L2 over three channels, mean over {lamps} lamps, against conjugate gradients in double precision to 1e-10
on the exact form factors. The truth of the light paths is the dense inverse, which is within {dense:.0e} of that.

Each side has its best form. The inverse: hierarchical at several tolerances, dense, or refined. Gauss-Seidel: forward or
symmetric, on exact form factors or on compressed ones at several tolerances, whichever is fastest to the error. Warm
starts begin at the converged solution of the frame before on the same form; after a switch iterations start there or
in the dark, whichever is faster. Both sides have the same menu of tolerances;
what only gathers (gathering, conjugate gradients, refinement) has form factors with shared cluster bases, as the inverse
has them. Caches hold what the method's own last run left; cold ones hold what something else has used. Sweeps that fit into a budget are told by the
measured times, so that a light path has the same errors in every run with the same times; a method that makes no
sweep within the budget is left out. Lamps are points, spots, spheres, rectangles and discs in free space, alone: the
scene's own emitters are dark. Of the light that patches then give off, a tenth or more arrives at others."""


def missing_line(missing):
    if not missing:
        return ""
    return "\n**Missing:** " + ", ".join(str(m).replace("_", " ") for m in missing) + ".\n"


def headline_parts(headlines):
    """What the claims say in short: a table, and the goals beside what was measured."""
    parts = [
        "## Summary",
        "Microseconds after a lamp was switched for another, and the megabytes of the matrices that a side has to hold; "
        "then how many times faster the inverse is: after a switch, after a lamp moved by 1 % of the diagonal, after a "
        "switch with cold caches, and in a whole frame with direct light and light at vertices. Share of bandwidth: "
        "how fast the inverse and Gauss-Seidel read their matrices, as a part of the speed of memory; caches can pass it.",
    ]
    for error in HEADLINE_ERRORS:
        shown = [h.row(error) for h in headlines if h.equal_error(error)]
        if shown:
            parts += [f"To an error of {percent(error)}:", markdown_table(HEADLINE_NAMES, shown)]
    return parts + [
        markdown_table(LAG_NAMES, [h.lag_row() for h in headlines]),
        f"Lag: frames after a switch until the error is within 1 % or 0.1 %, at {TIGHTEST_BUDGET} µs a frame, inverse / "
        "Gauss-Seidel. Never: after no switch before the next one; >: after some of them not. Equally compressed: both matrices to 0.1 %, both to be within 0.2 % of the exact solution.",
        aims(headlines),
    ]


def accuracy_parts(headlines):
    return [
        "Least errors after a switch at equal time (–: one side has nothing that fits):",
        markdown_table(rows.EQUAL_TIME_NAMES, rows.equal_time_rows(headlines)),
        "## Where Gauss-Seidel wins",
        where_gauss_seidel_wins(headlines),
    ]


def markdown(headlines, missing, date, pictures):
    """The whole file; `pictures` maps "accuracy", "winners", "frames" and scenes to paths."""
    all_results = [h.result for h in headlines]
    followed = rows.shown_on_paths(all_results)
    parts = [
        "# The stored inverse against Gauss-Seidel",
        "Written by `./dev report`; the raw figures are beside it, each claim with its rows in `claims.csv`.",
        provenance(all_results, date) + missing_line(missing),
        *headline_parts(headlines),
        "## How it was measured",
        METHOD.format(
            lamps=setting(all_results, "lamps"),
            dense=max(r["dense_error"] for r in all_results),
        ),
        "## Accuracy and time",
        f"![Error against time]({pictures['accuracy']})",
        f"![How many times faster the inverse is]({pictures['winners']})",
        "Ratio of the times to an error, Gauss-Seidel ÷ inverse, by change of the light: red, the inverse is faster.",
        *accuracy_parts(headlines),
        "## Light paths",
        f"{followed.title}, {rows.PATH_BUDGET} µs a frame, each method in its best form and warm from its last frame:",
        f"![Error by frame]({pictures['frames']})",
        markdown_table(rows.FRAME_NAMES, rows.frame_rows(followed)),
        "## What it costs to have",
        markdown_table(rows.COST_SUMMARY_NAMES, rows.cost_summary_rows(headlines)),
        "Break-even: after so many switched frames at an error of 0.1 % the inverse has saved the seconds that it takes "
        "beyond what compressing F takes.",
        "## Truth",
        markdown_table(rows.TRUTH_NAMES, rows.truth_rows(headlines)),
        "Against the path tracer under a key light. *Discretisation* is what is left with 64 shadow rays for every pair and "
        "the dense inverse: one value per patch, lamps looked at at eight points. *Form factors* and *compression* are the "
        "difference that each makes to H. An error below the noise is not known. The furnace: every surface reflects half, "
        "and openings send in what surfaces would.",
        "## Pictures",
        *(f"![{scene}]({path})" for scene, path in pictures["scenes"].items()),
    ]
    return "\n\n".join(parts) + "\n"


def first_rows(names, rows):
    """A table, and where it is cut a line before it that says so."""
    line = f"The first {SHOWN_LOSSES}:\n\n" if len(rows) > SHOWN_LOSSES else ""
    return line + markdown_table(names, rows[:SHOWN_LOSSES])


def where_gauss_seidel_wins(headlines):
    slow = rows.loss_rows(rows.time_losses(headlines))
    paths = rows.losses(headlines, rows.PATH_SUBJECTS)
    path_count = sum(c.subject.startswith(rows.PATH_SUBJECTS) for h in headlines for c in h.claims)
    switch = f"{SWITCHED}, error {AIM_ERROR:g}"
    cold = [ratio_of(h.claims, "equal error, cold caches", switch) for h in headlines]
    repainted = [ratio_of(h.claims, "equal error", REPAINTED) for h in headlines]
    parts = [
        "The largest motion of a lamp, as a part of the scene's diagonal, at which Gauss-Seidel, warm, reaches an error in no "
        "more time than the inverse. None from 1 %: in no motion that was measured, of which 1 % is the smallest. –: the "
        "two were not measured to that error.",
        markdown_table(rows.MOTION_NAMES, rows.motion_rows(headlines)),
        f"Measured conditions in which an iteration of any kind takes no more time to an error: {len(slow)}. "
        "Ratio: its time ÷ that of the inverse.",
    ]
    if slow:
        parts.append(first_rows(rows.LOSS_NAMES, slow))
    parts.append(
        f"Light paths on which Gauss-Seidel, warm from frame to frame, has the smaller mean error at the same budget: {len(paths)} "
        f"of {path_count}."
    )
    if paths:
        parts[-1] += " Where light changes little by little sweeps add up over the frames; a product starts anew in each."
        parts.append(first_rows(rows.PATH_LOSS_NAMES, rows.path_loss_rows(paths)))
    parts.append(
        "\n".join(
            (
                "- Repainted (the commonest material reflects half of what it did): the operator is wrong, and helps only with "
                f"refinement. Time of the best iteration ÷ time of the best method that uses it: {span(repainted)}.",
                f"- Against the best iteration of any kind instead of Gauss-Seidel, after a switch to 0.1 %: "
                f"{span([h.switch_any for h in headlines])}.",
                f"- With caches that something else has used, after a switch to 0.1 %: {span(cold)}.",
                "- Before break-even, and where memory for F is there and for an operator is not.",
            )
        )
    )
    return "\n\n".join(parts)
