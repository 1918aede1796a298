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

# The public headers of C++, in the order in which one meets them, with what each holds.
CPP_HEADERS = {
    "runtime/engine": "`Engine`: frames by lights and sky, or by a direct irradiance of the caller's",
    "transfer/transfer_file": "loading and saving; what is known of the operator",
    "transfer/lights": "lamps, and luminaires by their photometric data",
    "runtime/sky": "the sky, its cells, CIE skies",
    "runtime/outputs": "the light of the last frame at vertices, lightmap texels, probes and in air",
    "runtime/solvers": "`Solver`: the same light by iteration on the form factors of the file",
    "transfer/scene_data": "patches, display mesh, materials, cameras, maps",
    "transfer/operators": "kinds and precisions of operators, by name",
    "transfer/scheduler": "`Scheduler`: where loops run",
    "transfer/error": "`Error`, `Unsupported`, `Cancelled`",
    "transfer/types": "small types",
    "transfer/version": "the version of the library",
    "precompute/build": "`build_transfer`: the offline stage",
    "precompute/build_settings": "all settings of the offline stage",
    "precompute/build_report": "what a build has done",
}

COMMAND_LINE = """# Command line

One program, `rebounce`, with a command for each task. Long work shows its progress and stops cleanly
on Ctrl-C. The exit status is 0 when all is done, 1 when the input or a file is bad (one line says
what, where, and what to do) or when the file that was written misses its tolerance (the line says
so), and 2 when a command, an option or the kind of a value is unknown. [Summaries for scripts](json.md)
has the fields of `--json`."""

C_INTERFACE = """# C interface

`#include <rebounce.h>`; [in C](../guide/in_c.md) has a program from end to end, and
[versions](versions.md) says what stays."""


CPP_INTERFACE = """# C++ interface

The public headers, a page each; nothing else is installed, and each compiles alone. [In an
engine](../../guide/in_an_engine.md) has a program from end to end, and [versions](../versions.md) says what
stays. Those of `precompute` are in the component of that name, all others in `runtime`."""


def generated_from(source):
    return f"<!-- Written by tests/pages/reference.py from {source}. Change that, not this. -->"


def public_headers():
    floors = ("transfer", "runtime", "precompute")
    found = {
        f"{floor}/{path.stem}" for floor in floors for path in (ROOT / floor / "include/rebounce").glob("*.h")
    }
    if found != CPP_HEADERS.keys():
        raise SystemExit(f"CPP_HEADERS of {__file__} and the folders differ: {found ^ CPP_HEADERS.keys()}")
    return [pathlib.Path(floor) / "include/rebounce" / f"{name}.h"
            for floor, name in (header.split("/") for header in CPP_HEADERS)]


def cpp_page(header):
    text = (ROOT / header).read_text(encoding="utf-8")
    body = header_pages.markdown(text, "cpp", lambda page: relative_link(page, "../../"))
    title = f"# rebounce/{header.name}"
    return "\n\n".join([title, generated_from(header), f"`#include <rebounce/{header.name}>`", body])


def cpp_index():
    rows = ["| header | holds | component |", "|---|---|---|"]
    for header, holds in CPP_HEADERS.items():
        floor, name = header.split("/")
        component = "precompute" if floor == "precompute" else "runtime"
        rows.append(f"| [rebounce/{name}.h]({name}.md) | {holds} | `{component}` |")
    return "\n\n".join([CPP_INTERFACE, generated_from("the list in it"), "\n".join(rows)])


def relative_link(page, up):
    """The link to notes/`page`.md from a page of notes that lies `up` below it."""
    return f"{up}{page}.md"


def header_files():
    pages = {REFERENCE / "cpp" / "README.md": cpp_index()}
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
