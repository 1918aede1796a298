"""Markdown of what the program's --help says."""

import re
import subprocess

# Where descriptions begin; one has a line of its own if the name before it is too long.
COLUMN = 30
EXTRA = re.compile(r"(?:^| )(?:REQUIRED|Excludes: \S+|Needs: \S+|\.\.\.)")

# What an option takes: its type, what checks it, its default.
VALUE = re.compile(
    r"(?P<kind>UINT|INT|FLOAT|TEXT)"
    r"(?::(?:\{(?P<choices>.*)\}|(?:\w+ in )?\[(?P<least>\S+) - (?P<most>\S+)\]|(?P<sign>[A-Z]+)))?"
    r"(?:=(?P<default>.*))?"
)
SIGNS = {"POSITIVE": ", above 0", "NONNEGATIVE": ", at least 0"}


def help_of(program, *words):
    done = subprocess.run([program, *words, "--help"], capture_output=True, text=True, check=True)
    return done.stdout


def sections_of(text):
    """The text before the first section, and each section's name with its lines."""
    head, *rest = re.split(r"^(?=[A-Z][\w ]*:$)", text, flags=re.MULTILINE)
    return head.strip(), {part.splitlines()[0][:-1]: part.splitlines()[1:] for part in rest}


def entries_of(lines):
    """What is named and what is said of it, of the lines of a section."""
    entries = []
    lines = [line for line in lines if line.strip()]
    for line, following in zip(lines, [*lines[1:], ""]):
        if line.startswith(" " * COLUMN):
            entries[-1] = (entries[-1][0], line.strip())
        elif following.startswith(" " * COLUMN):
            entries.append((line.strip(), ""))
        else:
            entries.append((line[:COLUMN].strip(), line[COLUMN:].strip()))
    return entries


def values_of(words):
    """What an option takes, in words, and its default: "TEXT:{a,b}=a" as "`a`, `b`" and "`a`"."""
    value = EXTRA.sub("", words).strip()
    if not value:
        return "", ""
    match = VALUE.fullmatch(value)
    takes = {"TEXT": "text", "FLOAT": "a number"}.get(match["kind"], "a whole number")
    if match["choices"]:
        takes = ", ".join(f"`{choice}`" for choice in match["choices"].split(","))
    elif match["least"]:
        takes += f", {match['least']} to {match['most']}"
    elif match["sign"]:
        takes += SIGNS[match["sign"]]
    if " ..." in words:
        takes = "a list"
    default = f"`{match['default']}`" if match["default"] else ""
    return takes, "must be given" if " REQUIRED" in words else default


def option_row(name, said):
    signs, _, words = name.partition(" ")
    takes, default = values_of(words)
    shown = ", ".join(f"`{sign}`" for sign in signs.split(","))
    excluded = re.findall(r"(Excludes|Needs): (\S+)", words)
    for how, other in excluded:
        said += f"{'; not with' if how == 'Excludes' else '; with'} `{other}`"
    return f"| {shown} | {takes} | {default} | {in_cell(said)} |"


def in_cell(text):
    text = text.replace("|", "\\|").replace("<", "&lt;")
    return re.sub(r"(?<![\w`-])(--[a-z][\w-]*)", r"`\1`", text)


def command_section(program, command):
    head, sections = sections_of(help_of(program, command))
    said = head.splitlines()[0]
    taken = " ".join(name.split()[0].upper() for name, _ in entries_of(sections.get("Positionals", [])))
    parts = [f"## rebounce {command}", f"{said}.", f"```text\nrebounce {command} {taken} [options]\n```"]
    rows = [option_row(*e) for e in entries_of(sections.get("Positionals", []))]
    rows += [option_row(*e) for e in entries_of(sections["Options"]) if not e[0].startswith("-h")]
    parts.append("\n".join(["| option | takes | default | what it does |", "|---|---|---|---|", *rows]))
    return "\n\n".join(parts)


def commands_of(program):
    return [name.split()[0] for name, _ in entries_of(sections_of(help_of(program))[1]["Subcommands"])]


def markdown(program):
    """A table of options for each command."""
    return "\n\n".join(command_section(program, command) for command in commands_of(program))
