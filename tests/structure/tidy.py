#!/usr/bin/env python3
"""Runs clang-tidy on every source of a build and remembers by content what was clean.

usage: tidy.py BUILD_FOLDER

A source is checked again when it, a project header that it includes, its compiler flags, the
configuration or clang-tidy itself has changed. What was clean is kept as empty files in
$XDG_CACHE_HOME/rebounce-tidy (default ~/.cache). The sources of a folder that are compiled together
are checked together: most of the time goes into headers of others. Exit status 1 if there is a
finding.
"""

import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
INCLUDE = re.compile(rb'^\s*#\s*include\s*["<]([^">]+)[">]', re.MULTILINE)
INCLUDE_ROOTS = [ROOT, *(ROOT / floor / "include" for floor in ("transfer", "runtime", "precompute"))]


def included_files(source):
    """The source and every project header that it reaches, sorted."""
    found, waiting = set(), [source]
    while waiting:
        file = waiting.pop()
        if file in found:
            continue
        found.add(file)
        for name in INCLUDE.findall(file.read_bytes()):
            for folder in (file.parent, *INCLUDE_ROOTS):
                header = folder / os.fsdecode(name)
                if header.is_file() and ROOT in header.resolve().parents:
                    waiting.append(header.resolve())
                    break
    return sorted(found)


def content_key(source, command, tool):
    digest = hashlib.sha256(tool)
    digest.update(command.replace(str(ROOT), "").encode())
    for file in included_files(source):
        digest.update(str(file.relative_to(ROOT)).encode())
        digest.update(hashlib.sha256(file.read_bytes().replace(os.fsencode(ROOT), b"")).digest())
    return digest.hexdigest()


def check(source, build):
    return subprocess.run(
        ["clang-tidy", "--quiet", "-p", build, "--extra-arg=-Wno-unknown-warning-option",
         "--extra-arg=-Wno-ignored-optimization-argument", str(source)],
        capture_output=True, text=True, check=False)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    build = sys.argv[1]
    tool = (ROOT / ".clang-tidy").read_bytes() + subprocess.check_output(["clang-tidy", "--version"])
    cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "rebounce-tidy"
    cache.mkdir(parents=True, exist_ok=True)

    marks = {}
    for entry in json.loads(pathlib.Path(build, "compile_commands.json").read_text()):
        source = pathlib.Path(entry["file"]).resolve()
        marks[source] = cache / content_key(source, entry["command"], tool)
    waiting = [source for source, mark in marks.items() if not mark.exists()]
    waiting.sort(key=lambda source: -sum(file.stat().st_size for file in included_files(source)))
    print(f"clang-tidy: {len(marks) - len(waiting)} sources unchanged, {len(waiting)} to check",
          flush=True)

    failed = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for source, result in zip(waiting, pool.map(lambda s: check(s, build), waiting)):
            if result.returncode == 0:
                marks[source].touch()
            else:
                failed += 1
                print(f"{source.relative_to(ROOT)}:\n{result.stdout}{result.stderr}", flush=True)
    print(f"clang-tidy: {failed} sources with findings")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
