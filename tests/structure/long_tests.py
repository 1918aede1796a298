#!/usr/bin/env python3
"""Prints, as an expression for ctest --exclude-regex, the tests of a build that took long.

usage: long_tests.py BUILD_FOLDER

A test takes long if its last run took more than a second. The shortest test of each suite counts as
long above ten seconds only, so that other builds run something of nearly every suite.
"""

import pathlib
import re
import sys

LONG = 1
LONG_FOR_THE_SHORTEST = 10


def seconds_of_tests(build):
    """Of each test, from what ctest keeps for its next run: NAME RUNS SECONDS, and then `---`."""
    costs = build / "Testing/Temporary/CTestCostData.txt"
    if not costs.exists():
        sys.exit(f"{costs} is missing; run the tests of that build first: ./dev test")
    lines = costs.read_text().partition("---")[0]
    return {name: float(seconds) for name, _, seconds in map(str.split, lines.splitlines())}


def long_tests(seconds):
    suites = {}
    for name in seconds:
        suites.setdefault(name.partition(".")[0], []).append(name)
    found = []
    for names in suites.values():
        shortest = min(names, key=seconds.get)
        found += [name for name in names if seconds[name] > LONG and
                  (name != shortest or seconds[name] > LONG_FOR_THE_SHORTEST)]
    return sorted(found)


def main():
    names = long_tests(seconds_of_tests(pathlib.Path(sys.argv[1])))
    print("^(" + "|".join(map(re.escape, names)) + ")$")


if __name__ == "__main__":
    main()
