#!/usr/bin/env python3
"""Checks README.md, CHANGELOG.md and the pages in notes/: their length, their words, their links.

See RULES. Entries of the lab are kept as they were written, and only their links are looked at.

Usage: check_pages.py [ROOT]
"""

import pathlib
import re
import sys
import unicodedata

MOST_WORDS_OF_README = 700
MOST_LINES = 150
GENERATED = "<!-- Written by "

# What tells of the program's past instead of what it is.
PAST = re.compile(r"\b(now|earlier versions?|not run|the version before)\b", re.IGNORECASE)

FENCED = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
CODE_SPAN = re.compile(r"`[^`\n]*`")
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
LINK = re.compile(r"\[[^\]\[]*(?:\[[^\]]*\][^\]\[]*)*\]\(([^()\s]+(?:\([^()]*\))?)\)")
HEADING = re.compile(r"^#+ +(.*)$", re.MULTILINE)

# Numbers of README: those of the report stand between markers, and some names have one.
FIGURES = re.compile(r"<!-- figures -->.*?<!-- /figures -->", re.DOTALL)
NUMBER = re.compile(r"(?<![\w.])\d[\d,]*(?:\.\d+)?")
NAMES_WITH_NUMBERS = re.compile(r"Debian 12|x86-64|OpenGL \d\.\d|glTF 2\.0|Embree \d")

# Where sources name pages, and the tensors that pages explain.
CITED = re.compile(r"notes/[\w/-]+\.(?:md|csv)")
CITED_ENTRY = re.compile(r"\blab/(\d{3})\b")
SOURCES = ("transfer", "runtime", "precompute", "bench", "tests")
TESTS_OF_THIS = "tests/pages/test_pages.py"  # names pages that it makes up
SOURCE_SUFFIXES = {".h", ".cpp", ".c", ".py", ".txt", ".cmake"}

# Code spans that name something of the code: with _ or a capital inside.
NAME = re.compile(r"`(?:\w+(?:::|\.))*(\w*(?:\w_\w|[a-z][A-Z])\w*)(?:\(\))?`")
PAGES_WITH_NAMES = ("notes/contributing/", "notes/concepts/")
PAGES_ON_NAMING = ("notes/contributing/conventions.md",)

SITE = "tests/pages/mkdocs.yml"
# Folders whose pages site.py finds, and one that is not in the site.
NOT_BY_NAME = ("notes/lab/", "notes/reference/cpp/", "notes/pictures/")

TENSOR_NAMES = "transfer/file/transfer_file_format.h"
TENSOR = re.compile(r'"((?:\w+\.)+\w+)"')


class Pages:
    """The pages of a source tree by their path from its root."""

    def __init__(self, root):
        self.root = pathlib.Path(root)
        paths = [self.root / "README.md", self.root / "CHANGELOG.md"]
        paths += sorted((self.root / "notes").rglob("*.md"))
        self.text = {
            path.relative_to(self.root).as_posix(): path.read_text(encoding="utf-8") for path in paths
        }

    def outside_lab(self):
        return {p: t for p, t in self.text.items() if not p.startswith("notes/lab/")}


def without_code(text):
    """With blanks for blocks of code, on as many lines."""
    return FENCED.sub(lambda match: "\n" * match.group().count("\n"), text)


def line_of(text, place):
    return text.count("\n", 0, place) + 1


def readme_is_short(pages):
    """README has few words, blocks of code apart."""
    words = len(without_code(pages.text["README.md"]).split())
    if words > MOST_WORDS_OF_README:
        yield f"README.md: {words} words, at most {MOST_WORDS_OF_README}"


def figures_are_measured(pages):
    """README has numbers between its markers alone, where bench/report/performance.py writes and
    checks them, and in names."""
    prose = FIGURES.sub("", without_code(pages.text["README.md"]))
    prose = re.sub(r"\]\([^)]*\)", "]", CODE_SPAN.sub("", COMMENT.sub("", prose)))
    for text in NUMBER.findall(NAMES_WITH_NUMBERS.sub("", prose)):
        yield f"README.md: {text} is not among the figures that performance.py writes"


def pages_are_short(pages):
    """No page is long, unless it is written by a script."""
    for path, text in pages.outside_lab().items():
        lines = text.count("\n")
        if path.startswith("notes/") and GENERATED not in text and lines > MOST_LINES:
            yield f"{path}: {lines} lines, at most {MOST_LINES}"


def pages_tell_what_is(pages):
    """No page but those of the lab tells what the program was."""
    for path, text in pages.outside_lab().items():
        prose = CODE_SPAN.sub(lambda match: " " * len(match.group()), without_code(text))
        for match in PAST.finditer(prose):
            yield f'{path}:{line_of(text, match.start())}: "{match.group()}" is for the lab alone'


def anchors_of(text):
    """What can follow the # of a link to a page."""
    found = set()
    for heading in HEADING.findall(without_code(text)):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        ascii_only = unicodedata.normalize("NFKD", plain).encode("ascii", "ignore").decode()
        found.add(re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", ascii_only).strip().lower()))
    return found


def links_lead_somewhere(pages):
    """Every link to a file of the project leads to one, and to a heading of it."""
    for path, text in pages.text.items():
        prose = CODE_SPAN.sub(lambda match: " " * len(match.group()), without_code(text))
        for match in LINK.finditer(prose):
            link = match.group(1)
            if re.match(r"\w+:", link):
                continue
            name, _, anchor = link.partition("#")
            target = (pages.root / path).parent / name if name else pages.root / path
            where = f"{path}:{line_of(text, match.start())}: {link}"
            if not target.exists():
                yield f"{where} leads nowhere"
            elif anchor and anchor not in anchors_of(target.read_text(encoding="utf-8")):
                yield f"{where}: there is no such heading"


def sources_name_pages(pages):
    """Every page, and every entry of the lab, that a comment, a message or a script names is there."""
    lab = "notes/lab/"
    entries = {path[len(lab) :][:3] for path in pages.text if path.startswith(lab)}
    for path in source_files(pages.root):
        where = path.relative_to(pages.root)
        text = path.read_text(encoding="utf-8", errors="replace")
        for match in CITED.finditer(text):
            if not (pages.root / match.group()).exists():
                yield f"{where}:{line_of(text, match.start())}: {match.group()} is not there"
        for match in CITED_ENTRY.finditer(text):
            if match.group(1) not in entries:
                yield f"{where}:{line_of(text, match.start())}: {match.group()} is no entry"


def source_files(root):
    for top in SOURCES:
        for path in sorted((root / top).rglob("*")):
            if path.suffix in SOURCE_SUFFIXES and path.relative_to(root).as_posix() != TESTS_OF_THIS:
                yield path


def names_are_in_the_code(pages):
    """What pages for contributors name (functions, types, tests) is a word of a source."""
    named = {p: t for p, t in pages.text.items() if p.startswith(PAGES_WITH_NAMES)}
    words = set()
    for path in source_files(pages.root) if named else ():
        words.update(re.findall(r"\w+", path.read_text(encoding="utf-8", errors="replace")))
    for path, text in named.items():
        for match in NAME.finditer(without_code(text)):
            if match.group(1) not in words and path not in PAGES_ON_NAMING:
                yield f"{path}:{line_of(without_code(text), match.start())}: no source has {match.group(1)}"


def tensors_are_explained(pages):
    """The pages of the file format name every tensor."""
    explained = "".join(t for p, t in pages.text.items() if p.startswith("notes/reference/file_format"))
    for name in TENSOR.findall((pages.root / TENSOR_NAMES).read_text(encoding="utf-8")):
        short = name.replace("form_factor.hierarchical", "")
        if f"`{name}`" not in explained and f"`{short}`" not in explained:
            yield f"{TENSOR_NAMES}: no page of the file format explains {name}"


def navigation_names_pages(pages):
    """The navigation of the site names every page but those of some folders, and no other."""
    named = re.findall(r"\S+\.md$", (pages.root / SITE).read_text(encoding="utf-8"), re.MULTILINE)
    named = {f"notes/{path}" for path in named}
    there = {p for p in pages.text if p.startswith("notes/") and not p.startswith(NOT_BY_NAME)}
    for path in sorted(named ^ there):
        yield f"{SITE}: {path} is {'no page' if path in named else 'not in the navigation'}"


RULES = (
    readme_is_short,
    figures_are_measured,
    pages_are_short,
    pages_tell_what_is,
    links_lead_somewhere,
    sources_name_pages,
    names_are_in_the_code,
    tensors_are_explained,
    navigation_names_pages,
)


def main():
    root = sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parents[2]
    pages = Pages(root)
    broken = [line for rule in RULES for line in rule(pages)]
    print("\n".join([*broken, f"{len(pages.text)} pages, {len(broken)} violations"]))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
