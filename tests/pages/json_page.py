#!/usr/bin/env python3
"""Checks that notes/reference/json.md names the fields of every command's --json, and no others.

usage: json_page.py PROGRAM
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "notes/reference/json.md"
SCENE = ROOT / "tests/scenes/cornell_box.gltf"

# What a run with the options below does not have.
COMPRESSED = {"form_factor_error_mean", "form_factor_error_max"}
ONLY_SOMETIMES = {
    "precompute": {"estimate_after_links", "error_without_rows"} | COMPRESSED,
    "info": COMPRESSED,
}

COMMANDS = {
    "precompute": [SCENE, "-o", "box", "--patches", "100", "--quality", "low", "--store-form-factors"],
    "info": ["box"],
    "solve": ["box", "-o", "light.csv"],
    "render": ["box", "-o", "box.png", "--size", "16x16", "--show", "error"],
    "bake": ["box", "-o", "box.glb", "--triangles", "100"],
    "view": ["box", "--screenshot", "view.png", "--size", "16x16"],
    "export": ["box", "--what", "patches", "-o", "patches.npz"],
    "view-factors": ["box.stl", "-o", "factors.npz", "--quality", "low"],
}


# Two facets that face each other.
FACETS = """solid two
facet
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endfacet
facet
vertex 0 0 1
vertex 0 1 1
vertex 1 0 1
endfacet
endsolid
"""


def fields_of_page():
    """By command."""
    found = {}
    for section in re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
        name, _, text = section.partition("\n")
        cells = re.findall(r"^\| (`[^|]*) \|", text, re.MULTILINE)
        found[name] = {field for cell in cells for field in re.findall(r"`(\w+)`", cell)}
    found["precompute"] |= found["info"]
    return found


def fields_of_program(program, folder):
    (pathlib.Path(folder) / "box.stl").write_text(FACETS, encoding="utf-8")
    found = {}
    for command, words in COMMANDS.items():
        done = subprocess.run(
            [program, command, *words, "--json"], cwd=folder, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True,
        )
        if done.returncode != 0:
            raise SystemExit(f"rebounce {command}: {done.stderr}")
        found[command] = json.loads(done.stdout).keys() | ONLY_SOMETIMES.get(command, set())
    return found


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        given = fields_of_program(program, folder)
    told = fields_of_page()
    broken = [f"{PAGE.name}: {name} is told of, and is no command" for name in told.keys() - given.keys()]
    for command, fields in given.items():
        for field in sorted(fields - told.get(command, set())):
            broken.append(f"{PAGE.name}: {command} gives {field}, of which it does not tell")
        for field in sorted(told.get(command, set()) - fields):
            broken.append(f"{PAGE.name}: {command} does not give {field}")
    print("\n".join([*broken, f"{len(broken)} fields that differ"]))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
