#!/usr/bin/env python3
"""Writes notes/performance.md and the line of figures in README.md, from the claims of the report.

The claims are bench/results/MACHINE/report.csv, which ./dev report --keep puts there. With --check
nothing is written, and text that is not as it would be is an error.
"""

import argparse
import csv
import dataclasses
import pathlib
import statistics
import sys

import aims
import claims as claims_module
import results
import summary
from formats import span, times

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = "bench/results/*/report.csv"
PAGE = pathlib.Path("notes/performance.md")
README = pathlib.Path("README.md")
BEGIN, END = "<!-- figures -->", "<!-- /figures -->"

# What README shows.
SCENE, PATCHES = "furnished_room", 4000
COARSE, FINE = 0.01, 0.001

CONDITIONS = """Errors are of the light that patches reflect after it came from other patches: relative,
area-weighted L2 over three channels, against conjugate gradients in double precision on the exact form factors. Each
side has its best form. The inverse: hierarchical at several tolerances, dense, or refined. Gauss-Seidel: forward or
symmetric, on exact form factors or on compressed ones at several tolerances, whichever is fastest to the error. Warm
starts begin at the solution of the frame before; after a switch iterations start there or in the dark, whichever is
faster. Times are of the light of the patches alone, but for a whole frame.
Relighting runs on one thread."""


@dataclasses.dataclass
class Measured:
    """What the claims about one scene with one number of patches are about."""

    scene: str
    patches: int


class Report:
    """The claims of one file."""

    def __init__(self, path, text):
        self.path = path
        lines = text.splitlines()
        self.notes = [line.removeprefix("# ") for line in lines if line.startswith("#")]
        claims = [claim_of(row) for row in csv.DictReader(l for l in lines if not l.startswith("#"))]
        subjects = dict.fromkeys((claim.scene, claim.patches) for claim in claims)
        self.headlines = [
            aims.Headline(
                Measured(*subject), [c for c in claims if (c.scene, c.patches) == subject]
            )
            for subject in subjects
        ]

    @property
    def processor(self):
        return self.notes[1].split(",")[0]


def claim_of(row):
    values = {field.name: row.get(field.name) for field in dataclasses.fields(claims_module.Claim)}
    values["patches"] = int(values["patches"])
    for name in ("inverse_value", "rival_value"):
        values[name] = float(values[name])
    for name in ("inverse_bytes", "rival_bytes", "inverse_never", "rival_never"):
        values[name] = int(values[name]) if values[name] else None
    return claims_module.Claim(**values)


def reports(root, changed):
    """One for each machine; `changed` are results that are still to be written, text by path."""
    texts = {path: path.read_text(encoding="utf-8") for path in root.glob(RESULTS)} | changed
    found = [Report(path, text) for path, text in sorted(texts.items())]
    if not found:
        raise SystemExit(f"there is no {RESULTS}; ./dev report --keep makes one")
    return found


def duration(microseconds):
    if microseconds < 99.5:
        return f"{microseconds:.0f} µs"
    return f"{microseconds / 1000:{'.2g' if microseconds < 99500 else ',.0f'}} ms"


def readme_line(report):
    """The figures of README: one scene, and the span over all of them."""
    shown = next(
        (h for h in report.headlines if (h.result.scene, h.result.patches) == (SCENE, PATCHES)), None
    )
    if shown is None:
        raise SystemExit(f"{report.path} has no {SCENE} of {PATCHES:,} patches; ./dev report --keep writes it anew")
    switched = [h for h in report.headlines if h.switch is not None]
    patches = [h.result.patches for h in switched]
    scenes = {h.result.scene for h in switched}
    switches = [h.switch for h in switched]
    repainted = [r for h in report.headlines if (r := aims.ratio_of(h.claims, "equal error", summary.REPAINTED))]
    return (
        f"**Figures.** {SCENE.replace('_', ' ').capitalize()}, {PATCHES:,} patches, one thread of an "
        f"{report.processor}: the bounced light of a lamp that was just switched on takes "
        f"{times_to(shown, COARSE)} and {times_to(shown, FINE)} of the exact solution on these patches. "
        f"A whole frame to {results.percent(COARSE)} takes {duration(frame_of(shown, COARSE))}. "
        f"In {len(switched)} cases ({len(scenes)} scenes, {min(patches):,} to {max(patches):,} patches), "
        f"to {results.percent(aims.AIM_ERROR)}, the product is {span(switches)} times faster than Gauss-Seidel (median {times(statistics.median(switches))}), "
        f"{span([h.warm for h in report.headlines])} times after a lamp moved a little, and "
        f"{span([h.switch_any for h in report.headlines])} times faster than the best iteration of any kind. "
        f"Once surfaces are repainted the operator only helps to refine, and iteration takes {span(repainted)} of the time of that. "
        f"[All figures, and where Gauss-Seidel wins]({PAGE})."
    )


def times_to(headline, error):
    claim = headline.equal_error(error)
    return (
        f"{duration(claim.inverse_value)} to within {results.percent(error)} "
        f"(Gauss-Seidel: {duration(claim.rival_value)})"
    )


def frame_of(headline, error):
    """Microseconds of a whole frame after a switch."""
    condition = f"{results.SWITCHED}, error {error:g}"
    return claims_module.find(headline.claims, "whole frame", condition).inverse_value


def page(found, root=ROOT):
    parts = [
        "# Performance",
        "<!-- Written by bench/report/performance.py from bench/results. Change that, not this. -->",
        "The stored inverse against Gauss-Seidel, in scenes that the checkout has. "
        "[The solvers](concepts/solvers.md) says which method to take when.",
        CONDITIONS,
    ]
    for report in found:
        parts.append(f"## {report.processor}")
        parts.append(
            "; ".join(report.notes) + f". Claims: `{report.path.relative_to(root).as_posix()}`."
        )
        for part in (*summary.headline_parts(report.headlines), "### Accuracy and time",
                     *summary.accuracy_parts(report.headlines)):
            parts.append("#" + part if part.startswith("## ") else part)
    return "\n\n".join(parts) + "\n"


def with_line(readme, line):
    """README with `line` between its markers."""
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise SystemExit(f"{README} has no {BEGIN} ... {END} for the figures")
    return f"{before}{begin}\n{line}\n{end}{after}"


def pages(root=ROOT, changed=None):
    """The text of each file that is written here."""
    found = reports(root, changed or {})
    readme = (root / README).read_text(encoding="utf-8")
    return {PAGE: page(found, root), README: with_line(readme, readme_line(found[0]))}


def write(root=ROOT, changed=None):
    """Writes the pages and the results that are `changed`, once the text of all of them is there."""
    for path, text in ((changed or {}) | pages(root, changed)).items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(text, encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    if not parser.parse_args().check:
        write()
        return 0
    stale = [
        path
        for path, text in pages().items()
        if not (ROOT / path).exists() or (ROOT / path).read_text(encoding="utf-8") != text
    ]
    for path in stale:
        print(f"{path} is not what bench/report/performance.py writes; run that")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
