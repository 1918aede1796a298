#!/usr/bin/env python3
"""Each rule of include_graph.py finds what breaks it, in small made-up trees, and nothing else."""

import contextlib
import io
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

import include_graph

# A tree that breaks no rule.
SOUND = {
    "transfer/format/block.h": "struct Block {};\n",
    "transfer/kernels/multiply_impl.h": '#include "transfer/format/block.h"\n',
    "transfer/kernels/avx2.cpp": '#include "transfer/kernels/multiply_impl.h"\n',
    "transfer/operator/apply.cpp": '#include "rebounce/apply.h"\n',
    "transfer/include/rebounce/apply.h": "void apply();\n",
    "runtime/frame/engine.cpp": '#include "rebounce/engine.h"\n#include <vector>\n',
    "runtime/include/rebounce/engine.h": '#include "rebounce/apply.h"\n',
    "precompute/cli/main.cpp": '#include "rebounce/engine.h"\n#include "console.h"\n',
    "precompute/cli/console.h": "",
    "runtime/demo/picture/main.cpp": "",
    "tests/transfer/kernels/test_multiply.cpp": '#include "transfer/kernels/multiply_impl.h"\n',
}


@contextlib.contextmanager
def tree_of(files):
    with tempfile.TemporaryDirectory() as root:
        for path, text in files.items():
            target = pathlib.Path(root, path)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")
        yield include_graph.Tree(root)


def violations(files):
    with tree_of({**SOUND, **files}) as tree:
        return include_graph.violations(tree)


class IncludeGraphTest(unittest.TestCase):
    def assert_only(self, lines, *parts):
        """One line is there, and each of `parts` in it."""
        self.assertEqual(len(lines), 1, lines)
        for part in parts:
            self.assertIn(part, lines[0])

    def test_a_sound_tree_breaks_no_rule(self):
        self.assertEqual(violations({}), [])

    def test_finds_a_cycle_and_names_its_includes(self):
        lines = violations(
            {
                "runtime/rays/a.h": '#pragma once\n#include "runtime/rays/b.h"\n',
                "runtime/rays/b.h": "",
                "runtime/rays/b.cpp": '#include "runtime/rays/b.h"\n#include "c.h"\n',
                "runtime/rays/c.h": '#include "../rays/./a.h"\n',
                "runtime/rays/outside.cpp": '#include "runtime/rays/a.h"\n',
            }
        )
        self.assert_only(
            lines,
            "cycle among 3 units",
            "runtime/rays/a.h:2 includes runtime/rays/b.h",
            "runtime/rays/b.cpp:2 includes runtime/rays/c.h",
            "runtime/rays/c.h:1 includes runtime/rays/a.h",
        )

    def test_finds_each_of_two_cycles(self):
        pairs = {}
        for room in ("transfer/file", "runtime/rays"):
            name = room.rpartition("/")[2]
            pairs[f"{room}/{name}_a.h"] = f'#include "{name}_b.h"\n'
            pairs[f"{room}/{name}_b.h"] = f'#include "{name}_a.h"\n'
        lines = violations(pairs)
        self.assertEqual(len(lines), 2, lines)
        self.assertTrue(all("cycle among 2 units" in line for line in lines))

    def test_a_header_and_its_source_are_no_cycle(self):
        self.assertEqual(
            violations(
                {
                    "runtime/rays/a.h": "",
                    "runtime/rays/a.cpp": '#include "a.h"\n#include "runtime/rays/b.h"\n',
                    "runtime/rays/b.h": "",
                }
            ),
            [],
        )

    def test_finds_an_include_that_runs_up_between_rooms(self):
        lines = violations(
            {
                "precompute/base/low.cpp": '#include <map>\n\n#include "precompute/build/high.h"\n',
                "precompute/build/high.h": "",
            }
        )
        self.assert_only(
            lines, "precompute/base/low.cpp:3", "from precompute/base to precompute/build"
        )

    def test_finds_an_include_that_runs_up_through_a_public_header(self):
        lines = violations({"transfer/file/read.cpp": "#include <rebounce/engine.h>\n"})
        self.assert_only(lines, "transfer/file/read.cpp:1", "from transfer/file to runtime/frame")

    def test_the_longest_path_names_the_room(self):
        lines = violations({"tests/scenes/room.h": '#include "tests/all.h"\n', "tests/all.h": ""})
        self.assert_only(lines, "from tests/scenes to tests")

    def test_finds_files_in_no_room(self):
        self.assert_only(violations({"precompute/lost.h": ""}), "precompute/lost.h", "no room")

    def test_a_public_header_without_source_needs_a_room(self):
        files = {
            "runtime/include/rebounce/light.h": '#include "rebounce/apply.h"\n',
            "transfer/file/write.cpp": '#include "rebounce/light.h"\n',
        }
        self.assert_only(violations(files), "rebounce/light.h", "PUBLIC_HEADER_ROOMS")
        rooms = {"runtime/light": "runtime/lights"}
        with mock.patch.object(include_graph, "PUBLIC_HEADER_ROOMS", rooms):
            self.assert_only(violations(files), "from transfer/file to runtime/lights")
        with mock.patch.object(include_graph, "PUBLIC_HEADER_ROOMS", {"runtime/light": "attic"}):
            self.assert_only(violations(files), "attic is not in ROOMS")

    def test_finds_a_crowded_folder(self):
        most = {f"runtime/rays/u{k}.h": "" for k in range(30)} | {"runtime/rays/u0.cpp": ""}
        self.assertEqual(violations(most), [])
        lines = violations({**most, "runtime/rays/more.cpp": ""})
        self.assert_only(lines, "runtime/rays: 31 units")

    def test_finds_a_long_file_but_for_kernels(self):
        lines = "\n".join(["/* not", "code */", "", "// int x;", *(["int x;  // x"] * 500)])
        self.assertEqual(violations({"runtime/rays/long.cpp": lines}), [])
        lines += "\nint y;\n"
        self.assert_only(violations({"runtime/rays/long.cpp": lines}), "501 lines of code")
        self.assertEqual(violations({"transfer/kernels/long.cpp": lines}), [])

    def test_finds_a_unit_that_includes_too_many(self):
        files = {f"runtime/rays/u{k}.h": "" for k in range(16)}
        included = [f'#include "runtime/rays/u{k}.h"\n' for k in range(16)]
        files["runtime/rays/hub.h"] = "".join(included[:8])
        files["runtime/rays/hub.cpp"] = '#include "hub.h"\n' + "".join(included[7:15])
        self.assertEqual(violations(files), [])
        files["runtime/rays/hub.cpp"] += included[15]
        self.assert_only(violations(files), "runtime/rays/hub", "includes 16 others")

    def test_finds_a_name_of_two_units(self):
        lines = violations({"transfer/file/probe.h": "", "precompute/outputs/probe.cpp": ""})
        self.assert_only(lines, "probe: ", "precompute/outputs/probe, transfer/file/probe")

    def test_finds_a_public_header_named_as_a_private_one(self):
        lines = violations({"runtime/frame/engine.h": ""})
        keys = "runtime/frame/engine, runtime/include/rebounce/engine"
        self.assert_only(lines, f"engine: the name of 2 units: {keys}")

    def test_tests_and_bench_may_be_named_as_they_like(self):
        self.assertEqual(violations({"tests/a/engine.h": "", "bench/support/engine.h": ""}), [])

    def test_finds_a_private_header_reached_from_another_floor(self):
        include = '#include "transfer/kernels/multiply_impl.h"\n'
        lines = violations({"runtime/frame/fast.cpp": include})
        self.assert_only(lines, "runtime/frame/fast.cpp:1", "private to transfer")
        lines = violations({"tests/runtime/test_fast.cpp": include})
        self.assert_only(lines, "tests/runtime/test_fast.cpp:1", "private to transfer")
        lines = violations(
            {
                "runtime/rays/box_impl.h": "",
                "precompute/base/x.cpp": '#include "runtime/rays/box_impl.h"\n',
            }
        )
        self.assert_only(lines, "box_impl.h, which is private to runtime")

    def test_finds_includes_of_what_is_not_there(self):
        text = '\n#include "nowhere.h"\n#include <nowhere.h>\n#include "commit.h"\n'
        lines = violations({"runtime/rays/a.h": text})
        self.assert_only(lines, "runtime/rays/a.h:2", '"nowhere.h" is no file')

    def test_includes_are_found_as_the_compiler_finds_them(self):
        files = {
            "bench/rebounce/engine.h": "",
            "bench/near.cpp": '#include "rebounce/engine.h"\n',
            "bench/far.cpp": "#include <rebounce/engine.h>\n",
            "bench/outside.cpp": '#include "../../engine.h"\n',
        }
        with tree_of({**SOUND, **files}) as tree:
            near, far = tree.files["bench/near.cpp"], tree.files["bench/far.cpp"]
            self.assertEqual(near.includes, [(1, "bench/rebounce/engine.h")])
            self.assertEqual(far.includes, [(1, "runtime/include/rebounce/engine.h")])
            self.assertEqual(tree.files["bench/outside.cpp"].missing, [(1, "../../engine.h")])

    def test_includes_in_comments_and_literals_do_not_count(self):
        text = (
            '// #include "a.h"\n/*\n#include "b.h"\n*/ # include "format/c.h"\n'
            'auto s = "/*";\nauto r = R"x(\n// )" */\n)x";\n'
            "auto n = 1'000;  // it's\n"
            '#include "format/d.h"\n'
        )
        files = {"transfer/x.cpp": text, "transfer/format/c.h": "", "transfer/format/d.h": ""}
        with tree_of(files) as tree:
            file = tree.files["transfer/x.cpp"]
            self.assertEqual(
                file.includes, [(4, "transfer/format/c.h"), (10, "transfer/format/d.h")]
            )
            self.assertEqual(file.missing, [])
            self.assertEqual(file.code_lines, 7)


class RoomsTest(unittest.TestCase):
    def test_the_page_says_of_each_room_what_it_is_for(self):
        page = (pathlib.Path(__file__).resolve().parents[2] / "notes/contributing/rooms.md").read_text("utf-8")
        for room, purpose in include_graph.ROOMS.items():
            self.assertIn(f"| `{room}` | {purpose} |\n", page)


class CommandTest(unittest.TestCase):
    def run_on(self, files, *arguments):
        output, error = io.StringIO(), io.StringIO()
        with tree_of(files) as tree, mock.patch.object(
            sys, "argv", ["include_graph.py", *arguments, str(tree.root)]
        ), contextlib.redirect_stdout(output), contextlib.redirect_stderr(error):
            return include_graph.main(), output.getvalue(), error.getvalue()

    def test_status_says_whether_a_rule_is_broken(self):
        status, output, _ = self.run_on(SOUND)
        self.assertEqual(status, 0)
        self.assertIn("0 violations", output)
        status, output, _ = self.run_on({**SOUND, "precompute/lost.h": ""})
        self.assertEqual(status, 1)
        self.assertIn("precompute/lost.h", output)

    def test_lists_rooms_with_units_and_lines(self):
        status, output, _ = self.run_on(SOUND, "--list")
        self.assertEqual(status, 0)
        self.assertIn("transfer/kernels: 2 units, 2 lines of code\n", output)
        self.assertIn(f"  {include_graph.ROOMS['transfer/kernels']}\n", output)
        self.assertIn("      1 transfer/kernels/avx2\n", output)

    def test_shows_who_includes_a_unit(self):
        status, output, _ = self.run_on(SOUND, "--unit", "apply")
        self.assertEqual(status, 0)
        self.assertEqual(
            output,
            "transfer/operator/apply (transfer/operator, 2 lines of code)\n"
            "  included by runtime/frame/engine\n",
        )
        status, _, error = self.run_on(SOUND, "--unit", "nothing")
        self.assertEqual(status, 1)
        self.assertIn("no unit is named nothing", error)


if __name__ == "__main__":
    unittest.main()
