#!/usr/bin/env python3
"""Tests of the scripts beside it."""

import pathlib
import tempfile
import unittest

import check_pages
import header_pages
import help_page

HEADER = """#pragma once

// What there is
// to know; see notes/reference/versions.md.

#include <span>

namespace rebounce {

/// Adds two numbers: first_number and kSecond.
///
/// | a | b |
/// |---|---|
/// | 1 | 2 |
int add(int first_number, int second);
int add(int first_number);

class Keeper {
 public:
  void keep();  ///< kept

  int kept() const;

 private:
  int kept_;
};

}  // namespace rebounce
"""

C_HEADER = """/* Of C.
 *
 *   f(1);
 *   f(2); */

#ifndef REBOUNCE_H
#define REBOUNCE_H

/* ---- One part ---- */

/* Takes [n] numbers. */
int f(const float* numbers,
      int n); /* n > 0 */

#endif
"""

HELP = """Draws
Usage: rebounce draw [OPTIONS] file

Positionals:
  file TEXT REQUIRED          A file

Options:
  -h,--help                   Print this help message and exit
  --rays INT:INT in [64 - 1000000]=2048
                              Rays of each
  --show TEXT:{one,two}=one   What
  --other TEXT Excludes: --show
                              Something else
  --some TEXT ...             Names, as of --show
  --least FLOAT:POSITIVE      A limit
"""


class HeaderPages(unittest.TestCase):
    def test_comments_are_text_and_declarations_code(self):
        text = header_pages.markdown(HEADER, "cpp", lambda page: f"../{page}.md")
        self.assertTrue(text.startswith("What there is to know; see [versions](../reference/versions.md)."))
        self.assertIn("### `add`\n\nAdds two numbers: `first_number` and `kSecond`.\n\n| a | b |\n|---|---|\n", text)
        self.assertIn("```cpp\nint add(int first_number, int second);\nint add(int first_number);\n```", text)

    def test_what_is_private_is_left_out(self):
        text = header_pages.markdown(HEADER, "cpp", str)
        self.assertIn("### `Keeper`", text)
        self.assertTrue(text.endswith("  void keep();  ///< kept\n\n  int kept() const;\n};\n```"))

    def test_sections_and_indented_code_of_c(self):
        text = header_pages.markdown(C_HEADER, "c", str)
        self.assertTrue(text.startswith("Of C.\n\n```c\nf(1);\nf(2);\n```\n\n## One part\n\n### `f`\n\nTakes [n] numbers."))
        self.assertIn("```c\nint f(const float* numbers,\n      int n); /* n > 0 */\n```", text)


class HelpPage(unittest.TestCase):
    def setUp(self):
        sections = help_page.sections_of(HELP)[1]
        self.rows = [help_page.option_row(*entry) for entry in help_page.entries_of(sections["Options"])]

    def test_types_become_words(self):
        self.assertIn("| `--rays` | a whole number, 64 to 1000000 | `2048` | Rays of each |", self.rows)
        self.assertIn("| `--show` | `one`, `two` | `one` | What |", self.rows)
        self.assertIn("| `--least` | a number, above 0 |  | A limit |", self.rows)
        self.assertIn("| `--some` | a list |  | Names, as of `--show` |", self.rows)

    def test_what_excludes_an_option_is_said(self):
        self.assertIn("| `--other` | text |  | Something else; not with `--show` |", self.rows)


class Rules(unittest.TestCase):
    """Each rule on a small tree."""

    def broken(self, rule, files):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for path, text in {"README.md": "", "CHANGELOG.md": "", **files}.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text(text, encoding="utf-8")
            return list(rule(check_pages.Pages(root)))

    def test_words_of_readme_without_code(self):
        text = "```sh\n" + "word " * 1000 + "\n```\n" + "word " * 700
        self.assertEqual(self.broken(check_pages.readme_is_short, {"README.md": text}), [])
        self.assertEqual(len(self.broken(check_pages.readme_is_short, {"README.md": text + "word"})), 1)

    def test_figures_that_were_not_measured(self):
        text = "Debian 12 `13` [14](15.md) <!-- figures -->\n16 ms\n<!-- /figures --> 17 ms <!-- 18 -->"
        broken = self.broken(check_pages.figures_are_measured, {"README.md": text})
        self.assertEqual([line.split()[1] for line in broken], ["14", "17"])

    def test_lines_of_pages_that_people_write(self):
        long = "line\n" * 151
        files = {"notes/guide/a.md": long, "notes/lab/b.md": long, "notes/c.md": check_pages.GENERATED + long}
        self.assertEqual(
            self.broken(check_pages.pages_are_short, files), ["notes/guide/a.md: 151 lines, at most 150"]
        )

    def test_words_of_the_past(self):
        files = {"notes/a.md": "It is known.\nIt is now `now`.", "notes/lab/b.md": "now"}
        self.assertEqual(
            self.broken(check_pages.pages_tell_what_is, files), ['notes/a.md:2: "now" is for the lab alone']
        )

    def test_links_and_headings(self):
        files = {
            "notes/a.md": "# `A` and (b)\n[x](b.md) [y](#a-and-b) [z](https://nowhere) `[n](no)`",
            "notes/b.md": "[a](a.md#a-and-b)\n[c](a.md#c) [d](d.md)",
        }
        self.assertEqual(
            self.broken(check_pages.links_lead_somewhere, files),
            ["notes/b.md:2: a.md#c: there is no such heading", "notes/b.md:2: d.md leads nowhere"],
        )

    def test_pages_that_sources_name(self):
        files = {"transfer/a.h": "// notes/b.md\n// notes/c.md\n", "notes/b.md": ""}
        self.assertEqual(
            self.broken(check_pages.sources_name_pages, files), ["transfer/a.h:2: notes/c.md is not there"]
        )

    def test_entries_that_sources_name(self):
        files = {"transfer/a.h": "// lab/001\n// lab/002: few\n", "notes/lab/001-first.md": ""}
        self.assertEqual(
            self.broken(check_pages.sources_name_pages, files), ["transfer/a.h:2: lab/002 is no entry"]
        )

    def test_names_that_are_gone(self):
        files = {
            "runtime/a.h": "void kept_name(); TEST(Suite, ItHolds)",
            "notes/contributing/a.md": "`kept_name` `Type::kept_name()` `Suite.ItHolds` `word`\n`gone_name`",
        }
        self.assertEqual(
            self.broken(check_pages.names_are_in_the_code, files),
            ["notes/contributing/a.md:2: no source has gone_name"],
        )

    def test_pages_out_of_the_navigation(self):
        files = {
            check_pages.SITE: "nav:\n  - A: a.md\n  - B:\n      - b/README.md\n  - Lab: lab\n",
            **dict.fromkeys(("notes/a.md", "notes/c.md", "notes/lab/d.md"), ""),
        }
        wanted = ["notes/b/README.md is no page", "notes/c.md is not in the navigation"]
        self.assertEqual(
            self.broken(check_pages.navigation_names_pages, files),
            [f"{check_pages.SITE}: {line}" for line in wanted],
        )

    def test_tensors_without_a_word(self):
        files = {check_pages.TENSOR_NAMES: '"mesh.a" "mesh.b"', "notes/reference/file_format.md": "`mesh.a`"}
        broken = self.broken(check_pages.tensors_are_explained, files)
        self.assertEqual([line.split()[-1] for line in broken], ["mesh.b"])


if __name__ == "__main__":
    unittest.main()
