#!/usr/bin/env python3
"""Checks that the files which the pages name are there.

In README.md and the pages of notes/ but those of the lab, every code span that looks like a path of the source tree (it begins
with a folder at the top, or ends like a source) is to be a folder or file, or the end of the path
of one: `lamp_kind.h` for runtime/lights/lamp_kind.h. A suffix may be left out, and a * stands for
anything.

Usage: note_paths.py [ROOT]
"""

import fnmatch
import pathlib
import re
import sys

TOP_FOLDERS = ("transfer", "runtime", "precompute", "bench", "tests", "notes")
SOURCE_SUFFIXES = (".h", ".cpp", ".c", ".py", ".cmake", ".md")
SKIPPED_FOLDERS = {"node_modules", "__pycache__"}

PATH = re.compile(r"`((?:[\w.*-]+/)*[\w.*-]+/?)`")
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def paths_of(root):
    """Every file and folder of the tree, from its root, with /."""
    found = {path.name for path in root.iterdir()}
    folders = [root / top for top in TOP_FOLDERS if (root / top).is_dir()]
    while folders:
        for path in folders.pop().iterdir():
            if path.name in SKIPPED_FOLDERS:
                continue
            found.add(path.relative_to(root).as_posix())
            if path.is_dir() and not path.is_symlink():
                folders.append(path)
    return found


def looks_like_path(text):
    top, slash, rest = text.partition("/")
    return text.endswith(SOURCE_SUFFIXES) or bool(slash and rest and top in TOP_FOLDERS)


def missing_paths(root):
    root = pathlib.Path(root)
    known = paths_of(root)
    pages = [page for page in sorted((root / "notes").rglob("*.md")) if page.parent.name != "lab"]
    for page in (root / "README.md", *pages):
        text = FENCED.sub(lambda m: "\n" * m.group().count("\n"), page.read_text(encoding="utf-8"))
        for match in PATH.finditer(text):
            name = match.group(1).rstrip("/")
            if not looks_like_path(name):
                continue
            patterns = [name, f"*/{name}", f"{name}.*", f"*/{name}.*"]
            if not any(fnmatch.filter(known, pattern) for pattern in patterns):
                line = text.count("\n", 0, match.start()) + 1
                yield f"{page.relative_to(root)}:{line}: {name} is no file of the project"


def main():
    root = sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parents[2]
    missing = list(missing_paths(root))
    print("\n".join([*missing, f"{len(missing)} names of files that are not there"]))
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
