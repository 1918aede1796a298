#!/usr/bin/env python3
"""Tests of the scripts of the report, on figures that are made up."""

import json
import math
import pathlib
import sys
import tempfile
import types
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/report"))

import aims
import claims
import formats
import performance
import results
import rows
import summary
import tables

try:
    import plots
    import run
except ModuleNotFoundError:  # ./dev test installs it
    plots = run = None
needs_matplotlib = unittest.skipIf(run is None, "needs python3-matplotlib")


def claim(subject="equal error", condition="switched, error 0.001", inverse=1.0, rival=2.0, **more):
    where = {"scene": "room", "patches": 1000, "unit": "microseconds"} | more
    return claims.Claim(
        subject=subject, condition=condition, inverse="inverse", inverse_value=inverse, rival="rival",
        rival_value=rival, **where
    )


def headline(*some, scene="room", patches=1000):
    return aims.Headline(performance.Measured(scene, patches), list(some))


def result(**data):
    made = results.Result.__new__(results.Result)
    made.data = {"scene": "room", "patches": 1000} | data
    return made


class Formats(unittest.TestCase):
    def test_numbers_near_a_power_of_ten(self):
        self.assertEqual([formats.number(v) for v in (999.4, 999.7, 1234.5)], ["999", "1,000", "1,234"])
        self.assertEqual([formats.times(v) for v in (9.94, 9.96, 44.4)], ["9.9", "10", "44"])
        self.assertEqual(
            [performance.duration(v) for v in (99.4, 99.7, 3600, 99700, 1230000)],
            ["99 µs", "0.1 ms", "3.6 ms", "100 ms", "1,230 ms"],
        )
        self.assertEqual(aims.time_and_size(1, 1234.5e6)[1], "1,234")


class Losses(unittest.TestCase):
    def test_each_condition_has_the_fastest_iteration(self):
        found = rows.time_losses([headline(
            claim(inverse=4, rival=3),
            claim("equal error, any iteration", inverse=4, rival=2),
            claim("equal error, cold caches", inverse=4, rival=4),
            claim("equal error, any iteration", "moved 1 %, error 0.01", inverse=4, rival=1),
            claim("equal error", "moved 1 %, error 0.01", inverse=4, rival=5),
        )])
        self.assertEqual(
            [(row[2], row[6]) for row in rows.loss_rows(found)],
            [("moved 1 %, error 0.01", "1"), ("switched, error 0.001", "2"),
             ("switched, error 0.001, cold caches", "4")],
        )

    def test_a_table_that_is_cut_says_so(self):
        for count, said in ((12, False), (13, True)):
            lost = [claim("equal error, any iteration", f"moved {k} %, error 0.01", 2) for k in range(count)]
            text = summary.where_gauss_seidel_wins([headline(*lost)])
            self.assertIn(f"takes no more time to an error: {count}.", text)
            self.assertEqual("The first 12:" in text, said)
            self.assertEqual(text.count("| room | 1,000 | moved"), 12)

    def test_caches_that_are_cold_are_claimed_for_every_iteration(self):
        times = {"microseconds": 1, "microseconds_cold_cache": 2, "error": 0.0005, "bytes": 1,
                 "bytes_read": 1, "transfer": "", "form": "", "sweeps": 1, "change": "switched"}
        accuracy = [times | {"method": name} for name in ("inverse", "gauss-seidel", "gathering")]
        rest = {"direct_microseconds": 0, "outputs_microseconds": 0}
        made = claims.all_claims(result(
            accuracy=accuracy, frames=[], costs=[], rest_of_frame=rest, memory_bandwidth=1
        ))
        self.assertIn("equal error, cold caches, any iteration", {c.subject for c in made})

    def test_motions_that_were_not_measured(self):
        one = headline(
            claim(condition="moved 1 %, error 0.01"),
            claim(condition="moved 5 %, error 0.01"),
            claim(condition="moved 1 %, error 0.001", inverse=2),
        )
        self.assertEqual([rows.largest_motion(one, t) for t in (0.01, 0.001, 0.0001)], ["none from 1 %", "1 %", "–"])


def frames_row(method, mean, worst=30, **lag):
    return {"method": method, "transfer": "", "form": "", "budget_microseconds": 250, "sweeps": 1,
            "error_mean": 0.1, "path": "switching", "lag_1_percent": {"mean": mean, "worst": worst, **lag}}


class Lag(unittest.TestCase):
    def lag(self, *frames):
        return claims.lag(result(frames=list(frames)), 250)

    def test_switches_after_which_the_error_is_not_reached(self):
        made = self.lag(frames_row("inverse", 21.5, never=6), frames_row("gauss-seidel", 29.9999999999, never=9))
        self.assertEqual((made.inverse_value, made.inverse_never), (21.5, 6))
        self.assertEqual((made.rival_value, made.rival_never), (math.inf, 9))
        self.assertIsNone(made.ratio)
        self.assertEqual(headline(made).lag_row()[4], "> 21.5 / never")

    def test_results_that_do_not_say(self):
        made = self.lag(frames_row("inverse", 0.0, 0), frames_row("gauss-seidel", 30.0))
        self.assertEqual(headline(made).lag_row()[4], "0.0 / 30.0")

    def test_the_best_form_gets_there(self):
        made = self.lag(frames_row("inverse", 0, 0), frames_row("gauss-seidel", 4, never=1),
                        frames_row("symmetric-gauss-seidel", 5, never=0))
        self.assertEqual((made.rival, made.rival_value), ("symmetric-gauss-seidel", 5))

    def test_spans_leave_out_what_does_not_get_there(self):
        some = [claim(claims.LAG, "", 0.0, rival, inverse_never=0, rival_never=never)
                for rival, never in ((1.0, 0), (2.5, 0), (12.0, 3), (math.inf, 9))]
        line, = aims.lag_line("1 %", some)
        self.assertIn("0.0 with the inverse, 1.0 to 2.5 with Gauss-Seidel, which needs 3 or more in 2 of 4", line)
        self.assertTrue(line.endswith("in no span: 0 of the inverse, 2 of Gauss-Seidel."))

    def test_claims_come_back_from_the_csv(self):
        some = [claim(claims.LAG, "250 microseconds a frame", 3.5, math.inf, inverse_never=1, rival_never=9), claim()]
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "claims.csv"
            tables.write(path, tables.claim_rows(some))
            read = performance.Report(path, path.read_text(encoding="utf-8")).headlines[0].claims
        self.assertEqual(read, some)


class Words(unittest.TestCase):
    def test_settings_of_all_results(self):
        made = [
            result(processor="P", processors=2, compiler="c", build_type="Release", commit="a", threads=2,
                   settings={"solve_threads": 1, "repeats": repeats},
                   accuracy=[{"spread": s} for s in spreads])
            for repeats, spreads in ((7, (0.01, 0.02)), (3, (0.03, 0.1)))
        ]
        text = summary.provenance(made, "today")
        self.assertIn("medians of 3 to 7 rounds", text)
        self.assertIn("÷ median) 2.5 %.", text)

    def test_figures_of_readme_count_the_cases(self):
        at = [claim(condition=f"switched, error {e}") for e in ("0.01", "0.001")]
        at.append(claim("whole frame", "switched, error 0.01"))
        report = types.SimpleNamespace(processor="P", path="p", headlines=[
            headline(*at, scene="furnished_room", patches=4000), headline(claim(), patches=1000), headline()])
        self.assertIn("In 2 cases (2 scenes, 1,000 to 4,000 patches), to 0.1 %", performance.readme_line(report))

    def test_nothing_is_written_where_a_page_cannot_be(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "README.md").write_text("no markers", encoding="utf-8")
            path = root / "bench/results/p/report.csv"
            with self.assertRaises(SystemExit):
                performance.write(root, {path: "# a\n# P, b\nscene\n"})
            self.assertFalse(path.exists())


# Describes itself, or writes a result and a line in `log`.
BENCH = """#!/usr/bin/env python3
import json, pathlib, sys
here, words = pathlib.Path(__file__).parent, sys.argv
program = {"commit": (here / "commit").read_text(), "threads": int(words[words.index("--threads") + 1])}
if "--describe" in words:
    print(json.dumps(program))
else:
    scene, patches = pathlib.Path(words[1]), words[words.index("--patches") + 1]
    name = f"{scene.stem}-{patches}.json"
    (pathlib.Path(words[words.index("--output") + 1]) / name).write_text(json.dumps(program | {"seconds": 1}))
    with open(here / "log", "a") as log: log.write(name + " ")
"""


@needs_matplotlib
class Measuring(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.bench, self.scene = self.folder / "bench", self.folder / "room.gltf"
        self.write("bench", BENCH)
        self.bench.chmod(0o755)
        self.write("commit", "abc")
        self.write("room.gltf", '{"buffers": [{"uri": "room%201.bin"}, {"uri": "data:,"}]}')
        self.write("room 1.bin", "")
        self.options = types.SimpleNamespace(
            bench=self.bench, threads=2, repeats=0, quick=False, no_truth=False, minutes=None)

    def write(self, name, text):
        (self.folder / name).write_text(text, encoding="utf-8")

    def jobs(self, *sizes):
        return [run.Job(self.scene, n, self.folder) for n in sizes or (1000,)]

    def measured(self, jobs=None):
        """The names of what is measured, if these are asked for."""
        self.write("log", "")
        jobs = jobs or self.jobs()
        with mock.patch("builtins.print"):
            self.assertEqual(run.measure_all(jobs, self.options, self.folder), jobs)
        return (self.folder / "log").read_text().split()

    def test_what_is_finished_has_the_same_conditions(self):
        self.assertEqual(self.measured(self.jobs(1000, 4000)), ["room-1000.json", "room-4000.json"])
        self.assertEqual(self.measured(), [])
        changes = {
            **{key: lambda key=key, value=value: setattr(self.options, key, value)
               for key, value in (("threads", 1), ("repeats", 3), ("quick", True), ("no_truth", True))},
            "scene": lambda: self.scene.write_text(self.scene.read_text() + " "),
            "a file of the scene": lambda: self.write("room 1.bin", "x"),
            "commit": lambda: self.write("commit", "def-modified"),
            "program of a modified commit": lambda: self.write("bench", BENCH + "# other\n"),
        }
        for name, change in changes.items():
            with self.subTest(name):
                change()
                self.assertEqual(self.measured(), ["room-1000.json"])
                self.assertEqual(self.measured(), [])

    def test_a_clean_commit_has_one_program(self):
        self.measured()
        self.write("bench", BENCH + "# other\n")
        self.assertEqual(self.measured(), [])

    def test_a_result_that_something_else_has_written(self):
        self.measured()
        self.write("room-1000.json", '{"commit": "abc", "threads": 1}')
        self.assertEqual(self.measured(), ["room-1000.json"])

    def kept(self, jobs, done):
        """What --keep says, and whether it writes."""
        folder = self.folder / "out"
        folder.mkdir(exist_ok=True)
        tables.write(folder / "claims.csv", tables.claim_rows([claim()]))
        described = result(commit="abc", processor="A b", processors=2, threads=2, compiler="c", build_type="d")
        one = types.SimpleNamespace(result=described)
        with mock.patch.object(performance, "write") as write, mock.patch("builtins.print") as said:
            code = run.keep(jobs, done, [one], "today", folder)
        self.assertEqual(code, 0 if write.called else 1)
        return str(said.call_args), write.call_args

    def test_a_whole_report_is_kept(self):
        jobs = self.jobs(1000, 4000)
        self.measured(jobs)
        (path, text), = self.kept(jobs, jobs)[1].kwargs["changed"].items()
        self.assertEqual(path, ROOT / "bench/results/a-b/report.csv")
        self.assertIn("# patches: room 1,000\nscene,", text)

    def test_what_is_missing_keeps_nothing(self):
        jobs = self.jobs(1000, 4000)
        self.measured(jobs)
        said, written = self.kept(jobs, jobs[:1])
        self.assertIn("missing are room at 4,000", said)
        self.assertIsNone(written)

    def test_mixed_results_keep_nothing(self):
        jobs = self.jobs(1000, 4000)
        self.measured(jobs)
        self.write("commit", "def")
        self.measured(jobs[:1])
        self.assertIn("several programs", self.kept(jobs, jobs)[0])
        jobs[0].conditions.unlink()
        self.assertIn("not known", self.kept(jobs, jobs)[0])

    def test_results_with_fewer_timings_keep_nothing(self):
        self.options.repeats = 3
        self.measured()
        jobs = self.jobs()
        self.assertIn("--repeats", self.kept(jobs, jobs)[0])

    def test_what_keep_does_not_go_with(self):
        for words in (["--no-truth"], ["--repeats", "3"], ["room.gltf"], ["--quick"]):
            with self.subTest(words), mock.patch.object(sys, "argv", ["run.py", "--keep", *words]):
                with mock.patch("sys.stderr"), self.assertRaises(SystemExit):
                    run.parse_arguments()
        with mock.patch.object(sys, "argv", ["run.py", "--keep", "--minutes", "5"]):
            self.assertTrue(run.parse_arguments().keep)


@needs_matplotlib
class Winners(unittest.TestCase):
    def test_panels_with_other_changes_have_their_own_labels(self):
        times = {"error": 0.0005, "bytes": 1, "bytes_read": 1, "transfer": "", "form": "", "sweeps": 1}
        made = [
            result(accuracy=[times | {"change": change, "method": method, "microseconds": microseconds}
                             for change in changes for method, microseconds in (("inverse", 1), ("gauss-seidel", 9.96))])
            for changes in (["switched", "moved 5 %"], ["switched", "moved 5 %"], ["switched"])
        ]
        with mock.patch.object(plots, "save", lambda figure, path: figure):
            axes = plots.winners(made, None).axes
        labels = [[label.get_text() for label in panel.get_yticklabels()] for panel in axes]
        self.assertEqual([[text for text in some if text] for some in labels], [["switched", "moved 5 %"], [], ["switched"]])
        self.assertEqual(axes[0].texts[0].get_text(), "10")


if __name__ == "__main__":
    unittest.main()
