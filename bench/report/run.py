#!/usr/bin/env python3
"""Measures scenes with bench_report, keeps what is finished, and writes the report.

./dev report calls it; notes/reference/benchmarks.md says what is measured.
"""

import argparse
import datetime
import hashlib
import json
import pathlib
import re
import signal
import subprocess
import sys
import time
import urllib.parse

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
SIZES, QUICK_SIZES = (1000, 4000), (1000,)
# Sizes that some of the scenes have beside these. The largest take half an hour each: the scenes in
# which the inverse gained least and most there (lab/161).
FURTHER = (
    ("cornell_box", 100), ("cornell_box", 300), ("two_rooms", 16000), ("white_room", 16000),
)

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
    partial = ("scenes", "quick", "only", "sizes", "repeats", "no_truth")
    if options.keep and any(getattr(options, name) for name in partial):
        parser.error("--keep is for the whole report; leave out scenes, --quick, --only, --sizes, "
                     "--repeats and --no-truth")
    return options


class Job:
    """One scene at one size."""

    def __init__(self, scene, patches, folder):
        self.scene, self.patches = pathlib.Path(scene), patches
        self.result = folder / f"{self.scene.stem}-{patches}.json"
        self.conditions = self.result.with_suffix(".conditions.json")

    def __str__(self):
        return f"{self.scene.stem} at {self.patches:,}"

    def load(self):
        """Its result and the conditions under which it was made; None, None if they are not there."""
        try:
            result, conditions = (
                json.loads(path.read_text(encoding="utf-8")) for path in (self.result, self.conditions)
            )
        except (OSError, ValueError):
            return None, None
        same = all(result.get(key) == value for key, value in conditions["program"].items())
        return (result, conditions) if same else (None, None)


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
        jobs += [Job(ROOT / f"tests/scenes/{name}.gltf", n, folder) for name, n in FURTHER]
    return jobs


def settings_of(options):
    return ["--threads", str(options.threads), "--repeats", str(options.repeats)]


def hash_of(scene):
    """Of the contents of a scene and of the files that a .gltf names; None if one is missing, as
    bench_report will say."""
    try:
        text = scene.read_bytes()
        digest = hashlib.sha256(text)
        for name in files_of(json.loads(text)) if scene.suffix == ".gltf" else ():
            digest.update((scene.parent / urllib.parse.unquote(name)).read_bytes())
        return digest.hexdigest()
    except (OSError, ValueError):
        return None


def files_of(gltf):
    parts = gltf.get("buffers", []) + gltf.get("images", [])
    return [part["uri"] for part in parts if not part.get("uri", "data:").startswith("data:")]


def conditions_of(job, options, program):
    """What a result depends on; `program` is the bench as it describes itself."""
    many = program["commit"] == "unknown" or program["commit"].endswith("-modified")
    return {
        "program": program,
        "bench": hash_of(options.bench) if many else None,  # a clean commit has one
        "quick": options.quick,
        "repeats": options.repeats,
        "truth": not options.no_truth,
        "scene": hash_of(job.scene),
    }


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


def measure(job, conditions, options, folder):
    command = [options.bench, job.scene, "--patches", str(job.patches), "--output", folder]
    command += settings_of(options)
    if options.quick:
        command.append("--quick")
    if options.no_truth:
        command.append("--no-truth")
    job.conditions.unlink(missing_ok=True)
    process = subprocess.Popen([str(word) for word in command])
    try:
        if process.wait() != 0:
            return False
    except KeyboardInterrupt:
        process.send_signal(signal.SIGINT)  # a terminal has sent it already; twice does no harm
        process.wait()
        raise
    job.conditions.write_text(json.dumps(conditions, indent=1) + "\n", encoding="utf-8")
    return True


def measure_all(jobs, options, folder):
    """Measures what is not finished; returns the jobs that are, in the end."""
    described = subprocess.run(
        [options.bench, "--describe", *settings_of(options)], capture_output=True, check=True
    )
    program = json.loads(described.stdout)
    conditions = {job: conditions_of(job, options, program) for job in jobs}

    def result_of(job):
        result, made = job.load()
        return result if made == conditions[job] else None

    done = [(job.patches, r["seconds"]) for job in jobs if (r := result_of(job))]
    waiting = [job for job in jobs if not result_of(job)]
    total = sum(estimate(job, done, options.quick) for job in waiting)
    print(f"{len(jobs) - len(waiting)} measurements are there, {len(waiting)} to make: "
          f"about {readable(total)} on two idle cores", flush=True)
    begun = time.monotonic()
    for k, job in enumerate(waiting):
        seconds = estimate(job, done, options.quick)
        spent = time.monotonic() - begun
        if options.minutes and spent + seconds > 60 * options.minutes:
            print(f"{job}: about {readable(seconds)}, left out", flush=True)
            continue
        print(f"[{k + 1}/{len(waiting)}] {job}: about {readable(seconds)}", flush=True)
        if not measure(job, conditions[job], options, folder):
            print(f"{job} failed, and is left out", file=sys.stderr)
            continue
        done.append((job.patches, result_of(job)["seconds"]))
    return [job for job in jobs if result_of(job)]


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
    slow = rows.time_losses(headlines)
    page.table(rows.LOSS_NAMES, rows.loss_rows(slow),
               f"An iteration of any kind is as fast or faster: {len(slow)} conditions")
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


def why_not_kept(jobs, done):
    """Why the results are not a whole report by one program, or None."""
    missing = ", ".join(str(job) for job in jobs if job not in done)
    if missing:
        return f"missing are {missing}"
    made = [job.load()[1] for job in jobs]
    if None in made:
        return "of some results it is not known how they were made; measure them again"
    if any(m != made[0] | {"scene": m["scene"]} for m in made):
        return "the results are of several programs, machines or settings; measure them again"
    if made[0]["repeats"] or not made[0]["truth"]:
        return "the results were made with --repeats or --no-truth"
    return None


def sizes_line(headlines):
    """Which sizes of which scenes there are."""
    sizes = {}
    for h in headlines:
        sizes.setdefault(formats.name_of(h.result), []).append(f"{h.result.patches:,}")
    return "patches: " + "; ".join(f"{scene} {', '.join(counts)}" for scene, counts in sizes.items())


def kept_claims(headlines, date, folder):
    """The file of the claims on this machine, and its text."""
    result = headlines[0].result
    machine = re.sub(r"[^a-z0-9]+", "-", result["processor"].lower()).strip("-")
    lines = (
        f"# bench_report, commit {result['commit']}, {date}\n"
        f"# {result['processor']}, {result['processors']} processors, {result['threads']} threads; "
        f"{result['compiler']}, {result['build_type']}\n"
        f"# {sizes_line(headlines)}\n"
    )
    claims = (folder / "claims.csv").read_text(encoding="utf-8")
    return {ROOT / "bench" / "results" / machine / "report.csv": lines + claims}


def keep(jobs, done, headlines, date, folder):
    """Writes what is kept, if the report is whole; returns the exit code."""
    if reason := why_not_kept(jobs, done):
        print(f"Nothing is kept: {reason}.", file=sys.stderr)
        return 1
    performance.write(changed=kept_claims(headlines, date, folder))
    return 0


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
        try:
            done = measure_all(jobs, options, folder)
        except KeyboardInterrupt:
            print("\nStopped. What is finished is kept; run the same again to go on.", file=sys.stderr)
            return 130
    if not done:
        print("There is nothing to report.", file=sys.stderr)
        return 1
    missing = [job for job in jobs if job not in done]
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
    print(f"\n{aims.aims(headlines)}\n\n{folder / 'report.html'}")
    return keep(jobs, done, headlines, date, folder) if options.keep else 0


if __name__ == "__main__":
    sys.exit(main())
