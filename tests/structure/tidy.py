#!/usr/bin/env python3
"""Runs clang-tidy on every source of a build that is not known to be clean.

usage: tidy.py BUILD_FOLDER

clean_sources.txt beside this file has a digest of each source that was clean when it was last
checked: of its content and that of the project headers that it includes, its compiler flags, the
configuration and clang-tidy's version. A source whose digest is another one is checked. The file is
written anew; commit it with the change. Sources that are compiled together are checked together:
most of the time goes into headers of others. A source that several programs are built from is
checked once. Exit status 1 if there is a finding.
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
CLEAN = pathlib.Path(__file__).with_name("clean_sources.txt")
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


def digest_of(source, command, tool):
    digest = hashlib.sha256(tool)
    digest.update(command.replace(str(ROOT), "").encode())
    for file in included_files(source):
        digest.update(str(file.relative_to(ROOT)).encode())
        digest.update(hashlib.sha256(file.read_bytes().replace(os.fsencode(ROOT), b"")).digest())
    return digest.hexdigest()


def compiled_sources(unit):
    """What a file of the build compiles: itself, or the sources that CMake includes into it."""
    if unit.parent.name != "Unity":
        return {unit}
    return {pathlib.Path(os.fsdecode(name)) for name in INCLUDE.findall(unit.read_bytes())}


def units_to_check(build):
    """Of each source one unit, with its command; those that compile most come first."""
    entries = json.loads(pathlib.Path(build, "compile_commands.json").read_text())
    units = {pathlib.Path(entry["file"]): entry["command"] for entry in entries}
    sources = {unit: compiled_sources(unit) for unit in units}
    seen, chosen = set(), {}
    for unit in sorted(units, key=lambda unit: -len(sources[unit])):
        if not sources[unit] <= seen:
            seen |= sources[unit]
            chosen[unit.resolve()] = units[unit]
    return chosen


def check(source, build):
    return subprocess.run(
        ["clang-tidy", "--quiet", "-p", build, "--extra-arg=-Wno-unknown-warning-option",
         "--extra-arg=-Wno-ignored-optimization-argument", str(source)],
        capture_output=True, text=True, check=False)


def name_of(source):
    return str(source.relative_to(ROOT))


def read_digests():
    lines = CLEAN.read_text().splitlines() if CLEAN.exists() else []
    return dict(reversed(line.split()) for line in lines)


def write_digests(digests):
    CLEAN.write_text("".join(f"{digests[name]} {name}\n" for name in sorted(digests)))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    build = sys.argv[1]
    version = re.search(rb"version \S+", subprocess.check_output(["clang-tidy", "--version"]))[0]
    tool = (ROOT / ".clang-tidy").read_bytes() + version
    digests = {source: digest_of(source, command, tool)
               for source, command in units_to_check(build).items()}
    known = read_digests()
    clean = {name_of(source): digest for source, digest in digests.items()
             if known.get(name_of(source)) == digest}
    waiting = [source for source in digests if name_of(source) not in clean]
    waiting.sort(key=lambda source: -sum(file.stat().st_size for file in included_files(source)))
    print(f"clang-tidy: {len(clean)} sources unchanged, {len(waiting)} to check", flush=True)

    failed = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for source, result in zip(waiting, pool.map(lambda s: check(s, build), waiting)):
            if result.returncode == 0:
                clean[name_of(source)] = digests[source]
                write_digests(clean)
            else:
                failed += 1
                print(f"{name_of(source)}:\n{result.stdout}{result.stderr}", flush=True)
    write_digests(clean)
    print(f"clang-tidy: {failed} sources with findings")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
