"""Markdown of a public header: its comments as text, its declarations as code.

A header is cut into entries at blank lines outside of comments and braces. The comment that an entry
begins with becomes a paragraph, the rest a block of code; what is private is left out. A comment
`/* ---- Title ---- */` becomes a heading.
"""

import dataclasses
import itertools
import re

SECTION = re.compile(r"/\* -{4} (.*?) -{4} \*/")
SKIPPED = re.compile(
    r"#pragma once|#include |#ifndef REBOUNCE_H|#define REBOUNCE_H$|#ifdef __cplusplus|#endif|"
    r'extern "C"|namespace rebounce|}  // namespace|/\* NOLINT|using namespace'
)

FORWARD = re.compile(r"(?:(?:class|struct) \w+;\n?)*")

# What an entry declares, for its heading: the first group that is not empty.
DECLARED = re.compile(
    r"^(?:template <.*?>\s*)?(?:typedef )?(?:struct|enum class|enum|class) (?:alignas\(\w+\) )?(\w+)\b(?!\s*\*)"
    r"|^#define (\w+)|^using (\w+) =|^(?:inline )?constexpr [\w:<>, ]+? (\w+)(?:\{| =)"
    r"|^(?:[\w:<>*&,]+[ ]+)+?[*&]?(\w+)\(",
    re.MULTILINE,
)
IDENTIFIER = re.compile(
    r"(?<![\w`/.-])(--[a-z][\w-]*\w|(?:\w+::)+\w+|[A-Za-z]\w*_\w+(?:\(\))?|k[A-Z]\w+|[a-z]\w+\(\))(?![\w`/-]|\.\w)"
)
NOTES_PAGE = re.compile(r"notes/([\w/]+)\.md")


@dataclasses.dataclass
class Entry:
    """A comment and what it is about; either may be empty."""

    comment: list
    code: list

    @property
    def names(self):
        return list(dict.fromkeys(declared_names("\n".join(self.code))))


def declared_names(code):
    """The names that lines of `code` declare outside of braces, in order."""
    outside, depth = [], 0
    for line in code.splitlines():
        if depth == 0 and not line.startswith((" ", "//", "/*")):
            outside.append(line)
        depth += line.count("{") - line.count("}")
    for match in DECLARED.finditer("\n".join(outside)):
        yield next(name for name in match.groups() if name)


def entries_of(text):
    """The titles (as strings) and entries of a header, in order."""
    for block in blocks_of(text):
        title = SECTION.fullmatch("\n".join(block).strip())
        if title:
            yield title.group(1)
            continue
        comment, code = split_comment(block)
        code = without_private(code)
        if comment or not FORWARD.fullmatch("\n".join(code)):
            yield Entry(comment, code)


def blocks_of(text):
    """Lines between blank lines, with what is in braces or in a comment in one piece."""
    block, depth, in_comment = [], 0, False
    for line in text.splitlines():
        if not in_comment and depth == 0 and SKIPPED.match(line):
            continue
        if not line.strip() and depth == 0 and not in_comment:
            if block:
                yield block
            block = []
            continue
        block.append(line.rstrip())
        if line.lstrip().startswith("/*"):
            in_comment = True
        if in_comment:
            in_comment = "*/" not in line
        else:
            code = re.sub(r"//.*|/\*.*?\*/", "", line)
            depth += code.count("{") - code.count("}")
    if block:
        yield block


def split_comment(block):
    """The text of the comment that `block` begins with, without its signs, and the lines after it."""
    if block[0].startswith("/*"):
        end = next(k for k, line in enumerate(block) if "*/" in line) + 1
        lines = [re.sub(r"^ ?/?\*+ ?|\s*\*/$", "", line) for line in block[:end]]
        return lines, block[end:]
    end = next((k for k, line in enumerate(block) if not line.startswith("//")), len(block))
    return [re.sub(r"^///? ?", "", line) for line in block[:end]], block[end:]


def without_private(code):
    """Without what stands between `private:` and the end of a class."""
    kept, is_private = [], False
    for line in code:
        if line == " private:":
            is_private = True
            while kept and not kept[-1].strip():
                kept.pop()
        elif line == "};":
            is_private = False
        if not is_private:
            kept.append(line)
    return kept


def prose(lines, page_link):
    """Paragraphs, tables and indented code of a comment, as Markdown."""
    parts = []
    for kind, group in itertools.groupby(lines, kind_of):
        group = list(group)
        if kind == "code":
            parts.append("```c\n" + "\n".join(line[2:] for line in group) + "\n```")
        elif kind == "table":
            parts.append("\n".join(group))
        elif kind == "text":
            parts.append(with_code_marks(" ".join(line.strip() for line in group), page_link))
    return "\n\n".join(parts)


def kind_of(line):
    if not line.strip():
        return "blank"
    return "code" if line.startswith("  ") else "table" if line.startswith("|") else "text"


def with_code_marks(text, page_link):
    """With identifiers as code, and with pages of notes as links."""
    text = IDENTIFIER.sub(r"`\1`", text.replace("<", "&lt;"))
    return NOTES_PAGE.sub(lambda m: f"[{m.group(1).rpartition('/')[2].replace('_', ' ')}]"
                          f"({page_link(m.group(1))})", text)


def heading_of(names):
    marked = [f"`{name}`" for name in names]
    return ", ".join(marked) if len(marked) <= 3 else f"{marked[0]} … {marked[-1]}"


def markdown(text, language, page_link):
    """A header as Markdown below a title of the page; `page_link` gives the link to a page."""
    parts = []
    for entry in entries_of(text):
        if isinstance(entry, str):
            parts.append(f"## {entry}")
            continue
        if entry.names:
            parts.append("### " + heading_of(entry.names))
        if entry.comment:
            parts.append(prose(entry.comment, page_link))
        if entry.code:
            parts.append(f"```{language}\n" + "\n".join(entry.code) + "\n```")
    return "\n\n".join(parts)
