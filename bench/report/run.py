#!/usr/bin/env python3
"""Measures scenes with bench_report, keeps what is finished, and writes the report.

./dev report calls it; notes/reference/benchmarks.md says what is measured.
"""

import argparse
import datetime
import json
import pathlib
import re
import signal
import subprocess
import sys
import time

import aims
import claims as claims_module
import formats
import page as page_module
import performance
import plots
import results as results_module
import rows
import summary
import tables

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = ("cornell_box", "two_rooms", "furnished_room", "pavilion", "white_room")
SIZES, QUICK_SIZES = (1000, 4000, 16000), (1000,)
TINY = (("cornell_box", 100), ("cornell_box", 300))

# Seconds that a measurement takes on two cores that do nothing else: those of any size, and those
# of 1,000 patches, which grow with this exponent of their number (lab/128). What finished ones took
# scales them.
ANY_SECONDS, SECONDS, QUICK_SECONDS, EXPONENT = 135, 26, 20, 1.3


def parse_arguments():
    parser = argparse.ArgumentParser(prog="./dev report", description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", help="other scenes (.glb, .gltf) beside the shipped ones")
    parser.add_argument("--quick", action="store_true", help="a small part of everything, 1,000 patches")
    parser.add_argument("--only", action="store_true", help="only the scenes that are named")
    parser.add_argument("--sizes", help="numbers of patches, separated by commas")
    parser.add_argument("--minutes", type=float, help="begin nothing that would take longer in all")
    parser.add_argument("--threads", type=int, default=0, help="threads of offline work; 0: all")
    parser.add_argument("--repeats", type=int, default=0, help="timings of each thing; 0: as usual")
    parser.add_argument("--no-truth", action="store_true", help="leave the path tracer out")
    parser.add_argument("--page-only", action="store_true", help="measure nothing, show what there is")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "report-out")
    parser.add_argument(
        "--bench", type=pathlib.Path, default=ROOT / "build/release/bench/bench_report"
    )
    parser.add_argument(
        "--keep",
        action="store_true",
        help="put the claims into bench/results/, and what they say into notes/ and README.md",
    )
    options = parser.parse_args()
    if options.keep and (options.quick or options.only or options.sizes):
        parser.error("--keep is for the whole report; leave out --quick, --only and --sizes")
    return options


class Job:
    """One scene at one size."""

    def __init__(self, scene, patches, folder):
        self.scene, self.patches = pathlib.Path(scene), patches
        self.result = folder / f"{self.scene.stem}-{patches}.json"

    @property
    def name(self):
        return self.scene.stem


def list_scenes(options):
    """The shipped scenes and those that are named, or these alone; each with a name of its own, by
    which its results are kept."""
    scenes = {name: ROOT / f"tests/scenes/{name}.gltf" for name in SCENES}
    named = [pathlib.Path(scene) for scene in options.scenes]
    for scene in named:
        known = scenes.setdefault(scene.stem, scene)
        if known.resolve() != scene.resolve():
            raise SystemExit(f"{scene} has the name of {known}, and results are kept by name; rename it")
    if options.only:
        scenes = {scene.stem: scene for scene in named}
    return list(scenes.values())


def list_jobs(options, folder):
    """The smallest sizes of all scenes first, so that an early end leaves the most."""
    sizes = QUICK_SIZES if options.quick else SIZES
    if options.sizes:
        sizes = tuple(int(n) for n in options.sizes.split(","))
    scenes = list_scenes(options)
    jobs = [Job(scene, n, folder) for n in sorted(sizes) for scene in scenes]
    if not options.quick and not options.only and not options.sizes:
        jobs += [Job(ROOT / f"tests/scenes/{name}.gltf", n, folder) for name, n in TINY]
    return jobs


def finished(job, commit):
    """Its result if it is there and of this commit, else None."""
    try:
        result = json.loads(job.result.read_text(encoding="utf-8"))
        return result if result["commit"] == commit else None
    except (OSError, ValueError, KeyError):
        return None


def usual_seconds(patches, quick):
    if quick:
        return QUICK_SECONDS * (patches / 1000) ** EXPONENT
    return ANY_SECONDS + SECONDS * (patches / 1000) ** EXPONENT


def estimate(job, done, quick):
    """Seconds; from the finished measurement of the nearest size, if there is one."""
    seconds = usual_seconds(job.patches, quick)
    if not done:
        return seconds
    patches, took = min(done, key=lambda known: abs(known[0] - job.patches))
    return took * seconds / usual_seconds(patches, quick)


def readable(seconds):
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"


def measure(job, options, folder):
    command = [options.bench, job.scene, "--patches", str(job.patches), "--output", folder]
    command += ["--threads", str(options.threads), "--repeats", str(options.repeats)]
    if options.quick:
        command.append("--quick")
    if options.no_truth:
        command.append("--no-truth")
    process = subprocess.Popen([str(word) for word in command])
    try:
        return process.wait() == 0
    except KeyboardInterrupt:
        process.send_signal(signal.SIGINT)  # a terminal has sent it already; twice does no harm
        process.wait()
        raise


def measure_all(jobs, options, folder, commit):
    """Measures what is not finished; returns the jobs that are, in the end."""
    waiting = [job for job in jobs if not finished(job, commit)]
    done = [(job.patches, r["seconds"]) for job in jobs if (r := finished(job, commit))]
    total = sum(estimate(job, done, options.quick) for job in waiting)
    print(f"{len(jobs) - len(waiting)} measurements are there, {len(waiting)} to make: "
          f"about {readable(total)} on two idle cores", flush=True)
    begun = time.monotonic()
    for k, job in enumerate(waiting):
        seconds = estimate(job, done, options.quick)
        spent = time.monotonic() - begun
        if options.minutes and spent + seconds > 60 * options.minutes:
            print(f"{job.name} at {job.patches:,}: about {readable(seconds)}, left out", flush=True)
            continue
        print(f"[{k + 1}/{len(waiting)}] {job.name} at {job.patches:,}: about {readable(seconds)}",
              flush=True)
        if not measure(job, options, folder):
            print(f"{job.name} at {job.patches:,} failed, and is left out", file=sys.stderr)
            continue
        done.append((job.patches, finished(job, commit)["seconds"]))
    return [job for job in jobs if finished(job, commit)]


def draw(headlines, folder):
    """The figures that the summary shows, by name."""
    all_results = [h.result for h in headlines]
    largest = {}
    for result in all_results:
        if result.scene not in largest or result.patches > largest[result.scene].patches:
            largest[result.scene] = result
    most = rows.shown_on_paths(all_results)
    changes = [results_module.SWITCHED, aims.WARM]
    pictures = {
        "accuracy": plots.accuracy(list(largest.values()), changes, folder / "report_accuracy.png"),
        "winners": plots.winners(list(largest.values()), folder / "report_winners.png"),
        "frames": plots.frames(most, rows.PATH_BUDGET, folder / "report_frames.png"),
        "scenes": {},
    }
    for scene, result in largest.items():
        if result.get("pictures"):
            path = folder / f"report_{scene}.jpg"
            pictures["scenes"][scene] = plots.pictures(result, result.path.parent, path)
    return pictures


def write_page(headlines, missing, date, pictures, folder):
    page = page_module.Page("The stored inverse against Gauss-Seidel")
    all_results = [h.result for h in headlines]
    page.paragraph(summary.provenance(all_results, date))
    page.paragraph(summary.missing_line(missing).replace("*", ""))
    for error in aims.HEADLINE_ERRORS:
        shown = [h.row(error) for h in headlines if h.equal_error(error)]
        page.table(aims.HEADLINE_NAMES, shown, f"To an error of {results_module.percent(error)}")
    page.table(aims.LAG_NAMES, [h.lag_row() for h in headlines], "Equally compressed, and lag")
    for line in aims.aims(headlines).splitlines():
        page.paragraph(line)
    page.heading("Accuracy and time")
    page.picture(pictures["accuracy"], "error against time")
    page.picture(pictures["winners"], "ratios")
    page.table(rows.EQUAL_TIME_NAMES, rows.equal_time_rows(headlines), "Equal time, switched")
    for h in headlines:
        page.table(*claim_table(h), f"Equal error: {h.result.title}")
    page.heading("Where Gauss-Seidel wins")
    page.table(rows.MOTION_NAMES, rows.motion_rows(headlines), "Up to a motion of")
    slow = rows.losses(headlines, rows.TIME_SUBJECTS)
    page.table(rows.LOSS_NAMES, rows.loss_rows(slow), "As fast or faster")
    paths = rows.losses(headlines, rows.PATH_SUBJECTS)
    page.table(rows.PATH_LOSS_NAMES, rows.path_loss_rows(paths), "Less error on a light path")
    page.heading("Light paths")
    for h in headlines:
        for budget in budgets_shown(h.result):
            path = folder / f"{h.result.path.stem}-frames-{budget}.png"
            page.picture(plots.frames(h.result, budget, path), "error by frame")
            page.table(rows.FRAME_NAMES, rows.frame_rows(h.result, budget),
                       f"{h.result.title}, {budget} µs a frame")
            path.unlink()
    page.heading("What it costs to have")
    page.table(rows.COST_SUMMARY_NAMES, rows.cost_summary_rows(headlines))
    for h in headlines:
        page.table(rows.COST_NAMES, rows.cost_rows(h.result), h.result.title)
    page.heading("Truth")
    page.table(rows.TRUTH_NAMES, rows.truth_rows(headlines))
    page.heading("Pictures")
    for scene, path in pictures["scenes"].items():
        page.picture(path, scene)
    page.heading("Settings")
    for h in headlines:
        page.paragraph(f"{h.result.title}: {json.dumps(h.result['settings'])}")
    page.write(folder / "report.html")


def budgets_shown(result):
    """Of a quick report one is enough."""
    wanted = [rows.PATH_BUDGET] if result["settings"]["quick"] else claims_module.LAG_BUDGETS
    methods = (*results_module.INVERSES, *results_module.ITERATIONS)
    return [budget for budget in wanted if result.fits(budget, methods)]


def claim_table(headline):
    names = ("condition", "inverse", "µs", "Gauss-Seidel", "µs", "ratio")
    lines = [
        (c.condition, c.inverse, formats.number(c.inverse_value), c.rival,
         formats.number(c.rival_value), formats.times(c.ratio))
        for c in headline.claims
        if c.subject == "equal error"
    ]
    return names, lines


def write_summary(headlines, missing, date, pictures, folder):
    """The summary in Markdown, beside its pictures."""
    named = {
        key: {scene: f"pictures/{p.name}" for scene, p in value.items()}
        if key == "scenes"
        else f"pictures/{value.name}"
        for key, value in pictures.items()
    }
    text = summary.markdown(headlines, missing, date, named)
    (folder / "report.md").write_text(text, encoding="utf-8")


def keep_results(headlines, date, folder):
    """The claims, with the other tables of this machine."""
    result = headlines[0].result
    machine = re.sub(r"[^a-z0-9]+", "-", result["processor"].lower()).strip("-")
    target = ROOT / "bench" / "results" / machine
    target.mkdir(parents=True, exist_ok=True)
    lines = (
        f"# bench_report, commit {result['commit']}, {date}\n"
        f"# {result['processor']}, {result['processors']} processors, {result['threads']} threads; "
        f"{result['compiler']}, {result['build_type']}\n"
    )
    claims = (folder / "claims.csv").read_text(encoding="utf-8")
    (target / "report.csv").write_text(lines + claims, encoding="utf-8")


def main():
    options = parse_arguments()
    # However it is asked to stop, what it has begun stops with it.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    folder = options.out / ("quick" if options.quick else "full")
    folder.mkdir(parents=True, exist_ok=True)
    jobs = list_jobs(options, folder)
    if options.page_only:
        done = [job for job in jobs if job.result.exists()]
    else:
        described = subprocess.run([options.bench, "--describe"], capture_output=True, check=True)
        commit = json.loads(described.stdout)["commit"]
        try:
            done = measure_all(jobs, options, folder, commit)
        except KeyboardInterrupt:
            print("\nStopped. What is finished is kept; run the same again to go on.", file=sys.stderr)
            return 130
    if not done:
        print("There is nothing to report.", file=sys.stderr)
        return 1
    missing = [(job.name, job.patches) for job in jobs if job not in done]
    date = datetime.date.today().isoformat()
    measured = results_module.load(job.result for job in done)
    headlines = [aims.Headline(r, claims_module.all_claims(r)) for r in measured]
    claims = [claim for h in headlines for claim in h.claims]
    tables.write_all(folder, [h.result for h in headlines], claims)
    drawn = folder / "pictures"
    drawn.mkdir(exist_ok=True)
    pictures = draw(headlines, drawn)
    write_page(headlines, missing, date, pictures, folder)
    write_summary(headlines, missing, date, pictures, folder)
    if options.keep:
        keep_results(headlines, date, folder)
        performance.write()
    print(f"\n{aims.aims(headlines)}\n\n{folder / 'report.html'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
