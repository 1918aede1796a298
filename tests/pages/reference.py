#!/usr/bin/env python3
"""Writes the pages of notes/reference that are made from the program and the public headers.

  reference.py [--check] headers             cpp/*.md and c_interface.md
  reference.py [--check] commands PROGRAM    command_line.md, from what PROGRAM --help says

With --check nothing is written, and a page that is not as it would be is an error.
"""

import argparse
import pathlib
import sys

import header_pages
import help_page

ROOT = pathlib.Path(__file__).resolve().parents[2]
REFERENCE = pathlib.Path("notes/reference")

# The public headers of C++, in the order in which one meets them.
CPP_HEADERS = (
    "runtime/engine",
    "transfer/transfer_file",
    "transfer/lights",
    "runtime/sky",
    "runtime/outputs",
    "runtime/solvers",
    "transfer/scene_data",
    "transfer/operators",
    "transfer/scheduler",
    "transfer/error",
    "transfer/types",
    "transfer/version",
    "precompute/build",
    "precompute/build_settings",
    "precompute/build_report",
)

COMMAND_LINE = """# Command line

One program, `rebounce`, with a command for each task. Long work shows its progress and stops cleanly
on Ctrl-C. The exit status is 0 when all is done, 1 when the input or a file is bad (one line says
what, where, and what to do), and 2 when the command line is wrong."""

C_INTERFACE = """# C interface

`#include <rebounce.h>`; [in C](../guide/in_c.md) has a program from end to end, and
[versions](versions.md) says what stays."""


def generated_from(source):
    return f"<!-- Written by tests/pages/reference.py from {source}. Change that, not this. -->"


def public_headers():
    floors = ("transfer", "runtime", "precompute")
    found = {
        f"{floor}/{path.stem}" for floor in floors for path in (ROOT / floor / "include/rebounce").glob("*.h")
    }
    if found != set(CPP_HEADERS):
        raise SystemExit(f"CPP_HEADERS of {__file__} and the folders differ: {found ^ set(CPP_HEADERS)}")
    return [pathlib.Path(floor) / "include/rebounce" / f"{name}.h"
            for floor, name in (header.split("/") for header in CPP_HEADERS)]


def cpp_page(header):
    text = (ROOT / header).read_text(encoding="utf-8")
    body = header_pages.markdown(text, "cpp", lambda page: relative_link(page, "../../"))
    title = f"# rebounce/{header.name}"
    return "\n\n".join([title, generated_from(header), f"`#include <rebounce/{header.name}>`", body])


def relative_link(page, up):
    """The link to notes/`page`.md from a page of notes that lies `up` below it."""
    return f"{up}{page}.md"


def header_files():
    pages = {}
    for header in public_headers():
        pages[REFERENCE / "cpp" / f"{header.stem}.md"] = cpp_page(header)
    c_header = "runtime/include/rebounce.h"
    text = (ROOT / c_header).read_text(encoding="utf-8")
    body = header_pages.markdown(text, "c", lambda page: relative_link(page, "../"))
    pages[REFERENCE / "c_interface.md"] = "\n\n".join([C_INTERFACE, generated_from(c_header), body])
    return pages


def command_files(program):
    parts = [COMMAND_LINE, generated_from("rebounce --help"), help_page.markdown(program)]
    return {REFERENCE / "command_line.md": "\n\n".join(parts)}


def stale_pages(pages, root=ROOT):
    for path, text in pages.items():
        file = root / path
        if not file.exists() or file.read_text(encoding="utf-8") != text + "\n":
            yield path


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("what", choices=("headers", "commands"))
    parser.add_argument("program", nargs="?", default=ROOT / "build/release/rebounce")
    options = parser.parse_args()
    pages = header_files() if options.what == "headers" else command_files(options.program)
    stale = list(stale_pages(pages))
    if not options.check:
        for path in stale:
            (ROOT / path).parent.mkdir(parents=True, exist_ok=True)
            (ROOT / path).write_text(pages[path] + "\n", encoding="utf-8")
            print(f"{path} is written")
        return 0
    for path in stale:
        print(f"{path} is not what tests/pages/reference.py {options.what} writes; run that, or ./dev docs")
    print(f"{len(pages)} pages, {len(stale)} of them stale")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
