#!/usr/bin/env python3
"""Checks the layout of the source tree by its include graph.

A unit is a header with the sources of the same base name in the same folder; a public header, in
FLOOR/include, belongs to the unit of its name on that floor. The check fails where units include
each other in a circle, where an include runs up the order of rooms, and where a folder, a file or
a unit is too large. See RULES below for all of them.

Usage: include_graph.py [--list | --unit NAME] [ROOT]
"""

import argparse
import collections
import dataclasses
import pathlib
import re
import sys

# The rooms, lowest first, each with what it is for. A unit may include units of its own room and of
# rooms above it in this list. A file belongs to the room with the longest path that it lies in.
ROOMS = {
    "transfer/base": "Small types, errors, half floats, norms, and the loop that a scheduler runs.",
    "transfer/data": "What a scene is described by: patches' roles, lamps, sky, probes, lightmap.",
    "transfer/format": "How the numbers of an operator lie in memory and in a file.",
    "transfer/kernels": "Products with those numbers, a file for each instruction set.",
    "transfer/operator": "Y as dense and hierarchical operators, and their product.",
    "transfer/exchange": "Form factors as they are stored, their product and their sweeps.",
    "transfer/file": "The transfer file: reading, checking and writing it.",
    "runtime/rays": "Triangles, boxes, sample points, and the one file that calls Embree.",
    "runtime/images": "Pixels of PNG and JPEG files, decoded and encoded.",
    "runtime/lights": "Kinds of lamps, a file each; skies; what of their light arrives at a point.",
    "runtime/outputs": "Light of patches taken to vertices, texels and probes.",
    "runtime/frame": "One frame: direct light, one product, radiosity; the same for C.",
    "runtime/gpu": "A frame on the graphics card, by compute shaders of OpenGL; the same for C.",
    "runtime/solvers": "The same light by iteration.",
    "runtime/web/module": "The runtime for WebAssembly: what a page calls, and exceptions there.",
    "runtime/demo/image": "Images, colours, exposure, tone curve, textures, PNG.",
    "runtime/demo/shading": "What arrives at a point of the surface, and what it reflects.",
    "runtime/demo/picture": "Cameras, and a picture without a window.",
    "runtime/demo/bake": "A lit scene as a .glb.",
    "runtime/demo/motion": "What moves from frame to frame, and how a frame is solved.",
    "runtime/demo/viewer/gl": "The picture by OpenGL.",
    "runtime/demo/viewer/window": "The viewer: window, panels, controls.",
    "precompute/base": "BLAS, sets, tables, progress, and files of numbers.",
    "precompute/sampling": "Points and rays on triangles and hemispheres, and boxes to find them.",
    "precompute/import": "Files to scenes and lights: glTF, light files.",
    "precompute/patches": "A scene to patches: cuts, clusters, sides that are seen, selections.",
    "precompute/exchange/pairs": "Form factors between all pairs of patches, and their closure.",
    "precompute/exchange/links": "Form factors between sets of patches.",
    "precompute/lights": "Lights to fit and to measure operators with, and exact solutions.",
    "precompute/inverse": "Y from form factors: dense, or as products that are solved for.",
    "precompute/compression": "Y and form factors to a tolerance, as blocks of low rank.",
    "precompute/outputs": "Lightmap, probes, bent normals, weights and rows of vertices and texels.",
    "precompute/facets": "View factors between given polygons, and their files.",
    "precompute/build": "The offline stage from end to end.",
    "precompute/cli": "The command line.",
    "runtime/python": "The Python package: its module in C++, and what is written in Python.",
    "tests/scenes": "Scenes that tests, benchmarks and pages share.",
    "tests/support": "Made-up scenes, readers and counters that tests and benchmarks share.",
    "tests/gl": "OpenGL without a display: a context, buffers of light, shadow maps.",
    "bench/support": "Tables, timing, scenes and light changes that the benchmarks share.",
    "bench/reference": "The reference path tracer, and the comparison with it.",
    "bench/apply": "The product: microseconds, bytes, and the bandwidth that is reached.",
    "bench/frame": "A whole frame by stages.",
    "bench/gpu": "A frame on the graphics card by stages.",
    "bench/first_frames": "The first frames of processes, each by itself.",
    "bench/build": "The offline stage by phases.",
    "bench/solve": "Sweeps over form factors, and operators under fresh lights against their bounds.",
    "bench/receivers": "Rows of vertices: errors of their sets, bytes and times.",
    "bench/report": "Everything that ./dev report shows.",
    "bench/truth": "The offline stage and the runtime against the path tracer.",
    "tests/fuzz": "Hostile input for what reads files and for the C interface.",
    "tests": "A folder for each room of the libraries.",
}
ROOM_ORDER = {room: place for place, room in enumerate(ROOMS)}

# The rooms of public headers without a source of the same name, as "FLOOR/NAME": ROOM.
PUBLIC_HEADER_ROOMS: dict[str, str] = {
    "transfer/error": "transfer/base",
    "transfer/types": "transfer/base",
    "transfer/scheduler": "transfer/base",
    "transfer/lights": "transfer/data",
    "transfer/scene_data": "transfer/data",
    "runtime/engine": "runtime/frame",
    "runtime/outputs": "runtime/outputs",
    "runtime/solvers": "runtime/solvers",
    "runtime/rebounce": "runtime/lights",
    "precompute/build_settings": "precompute/base",
    "precompute/build_report": "precompute/base",
}

# Rooms whose headers serve their own floor alone, and the tests of that floor.
PRIVATE_ROOMS = ("transfer/kernels",)

# Where a file may have as many lines as it needs.
LONG_FILE_ROOMS = ("transfer/kernels",)

TOP_FOLDERS = ("transfer", "runtime", "precompute", "bench", "tests")
LIBRARY_FLOORS = ("transfer", "runtime", "precompute")

# What a build writes.
GENERATED_HEADERS = ("commit.h",)

# Where the compiler looks for an include after the folder of the file that has it.
INCLUDE_ROOTS = ("", "transfer/include", "runtime/include", "precompute/include")

MOST_UNITS_IN_FOLDER = 30
MOST_CODE_LINES = 500
MOST_INCLUDED_UNITS = 15

SUFFIXES = (".h", ".hpp", ".inl", ".c", ".cpp")
HEADER_SUFFIXES = (".h", ".hpp", ".inl")
SKIPPED_FOLDERS = ("node_modules",)

# Programs may all have one.
SHARED_NAMES = ("main",)

# What comments and literals look like; numbers too, whose digits may have a ' between them.
TOKEN = re.compile(
    r"""R"(?P<mark>[^\s()\\]{0,16})\(.*?\)(?P=mark)"|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])+'"""
    r"""|\b\d(?:'?[\w.])*|(?P<comment>//(?:\\\n|[^\n])*|/\*.*?(?:\*/|\Z))""",
    re.DOTALL,
)
INCLUDE = re.compile(r"""^[ \t]*#[ \t]*include[ \t]*(?:"([^"\n]+)"|<([^>\n]+)>)""", re.MULTILINE)


def without_comments(text):
    """`text` with every comment replaced by a blank, on as many lines as before."""

    def replace(match):
        comment = match.group("comment")
        return match.group() if comment is None else " " + "\n" * comment.count("\n")

    return TOKEN.sub(replace, text)


@dataclasses.dataclass
class SourceFile:
    path: str  # from the root of the project, with /
    code_lines: int  # neither blank nor comment alone
    includes: list  # of (line, path of the project's file that is included)
    missing: list  # of (line, name) in quotes that no file of the project has
    unit: "Unit" = None

    @property
    def floor(self):
        return self.path.split("/")[0]

    @property
    def folder(self):
        return self.path.rpartition("/")[0]

    @property
    def name(self):
        return self.path.rpartition("/")[2].rpartition(".")[0]

    @property
    def is_public(self):
        return self.path.startswith(self.floor + "/include/")

    @property
    def is_header(self):
        return self.path.endswith(HEADER_SUFFIXES)


@dataclasses.dataclass
class Unit:
    key: str  # FOLDER/NAME
    room: str = None
    files: list = dataclasses.field(default_factory=list)
    # Each other unit that it includes, with (file, line, included file) of every include.
    includes: dict = dataclasses.field(default_factory=dict)

    @property
    def name(self):
        return self.key.rpartition("/")[2]

    @property
    def code_lines(self):
        return sum(file.code_lines for file in self.files)


def room_of(path):
    """The room that a file or folder lies in, or None."""
    holding = [room for room in ROOMS if path == room or path.startswith(room + "/")]
    return max(holding, key=len, default=None)


class Tree:
    """The units of a source tree."""

    def __init__(self, root, include_roots=INCLUDE_ROOTS):
        self.root = pathlib.Path(root)
        self.include_roots = include_roots
        paths = sorted(self._find())
        self._paths = set(paths)
        self.files = {path: self._read(path) for path in paths}
        self.units = {}
        self._make_units()
        self._connect()

    def _find(self):
        for top in TOP_FOLDERS:
            for path in (self.root / top).rglob("*"):
                relative = path.relative_to(self.root)
                if path.suffix in SUFFIXES and not set(relative.parts) & set(SKIPPED_FOLDERS):
                    yield relative.as_posix()

    def _read(self, path):
        code = without_comments((self.root / path).read_text(encoding="utf-8"))
        file = SourceFile(path, sum(1 for line in code.splitlines() if line.strip()), [], [])
        for match in INCLUDE.finditer(code):
            line = code.count("\n", 0, match.start()) + 1
            quoted, angled = match.groups()
            found = self._resolve(file.folder if quoted else None, quoted or angled)
            if found:
                file.includes.append((line, found))
            elif quoted and quoted not in GENERATED_HEADERS:
                file.missing.append((line, quoted))
        return file

    def _resolve(self, folder, name):
        """The project's file that a compiler takes; `folder`: of the including file, or None."""
        for start in ([folder] if folder is not None else []) + list(self.include_roots):
            path = normal(f"{start}/{name}" if start else name)
            if path in self._paths:
                return path
        return None

    def _make_units(self):
        by_name = collections.defaultdict(list)  # units with other than public files
        for file in self.files.values():
            if not file.is_public:
                key = f"{file.folder}/{file.name}"
                if key not in self.units:
                    self.units[key] = Unit(key, room_of(file.path))
                    by_name[file.floor, file.name].append(self.units[key])
                self._add(file, self.units[key])
        for file in self.files.values():
            if file.is_public:
                own = by_name[file.floor, file.name]
                key = f"{file.folder}/{file.name}"
                room = PUBLIC_HEADER_ROOMS.get(f"{file.floor}/{file.name}")
                self._add(file, own[0] if own else self.units.setdefault(key, Unit(key, room)))

    @staticmethod
    def _add(file, unit):
        unit.files.append(file)
        file.unit = unit

    def _connect(self):
        for file in self.files.values():
            for line, path in file.includes:
                other = self.files[path]
                if other.unit is not file.unit:
                    arrows = file.unit.includes.setdefault(other.unit.key, [])
                    arrows.append((file, line, other))


def normal(path):
    """`path` without . and .. ; None if it leaves the root."""
    parts = []
    for part in path.split("/"):
        if part == "..":
            if not parts:
                return None
            parts.pop()
        elif part not in ("", "."):
            parts.append(part)
    return "/".join(parts)


def missing_files(tree):
    """Every include in quotes is a file of the project, or of its build."""
    for file in tree.files.values():
        for line, name in file.missing:
            yield f'{file.path}:{line}: "{name}" is no file of the project'


def homeless_units(tree):
    """Every unit lies in a room."""
    for unit in tree.units.values():
        if unit.room is None and unit.files[0].is_public:
            yield (
                f"{unit.files[0].path}: has no source of its name: say in PUBLIC_HEADER_ROOMS "
                "which room it belongs to"
            )
        elif unit.room is None:
            yield f"{unit.files[0].path}: lies in no room of ROOMS"
        elif unit.room not in ROOMS:
            yield f"{unit.files[0].path}: its room {unit.room} is not in ROOMS"


def cycles(tree):
    """No unit includes itself by way of others."""
    for component in components(tree):
        path = shortest_cycle(tree, component)
        steps = []
        for unit, following in zip(path, path[1:]):
            file, line, other = tree.units[unit].includes[following][0]
            steps.append(f"{file.path}:{line} includes {other.path}")
        yield f"cycle among {len(component)} units: " + ", ".join(steps)


def components(tree):
    """Sets of more than one unit that all reach each other (R. E. Tarjan, 1972)."""
    order, lowest, stack, on_stack, found = {}, {}, [], set(), []
    for start in tree.units:
        if start in order:
            continue
        work = [(start, iter(tree.units[start].includes))]
        order[start] = lowest[start] = len(order)
        stack.append(start)
        on_stack.add(start)
        while work:
            unit, following = work[-1]
            for other in following:
                if other not in order:
                    order[other] = lowest[other] = len(order)
                    stack.append(other)
                    on_stack.add(other)
                    work.append((other, iter(tree.units[other].includes)))
                    break
                if other in on_stack:
                    lowest[unit] = min(lowest[unit], order[other])
            else:
                work.pop()
                if work:
                    lowest[work[-1][0]] = min(lowest[work[-1][0]], lowest[unit])
                if lowest[unit] == order[unit]:
                    component = set()
                    while unit not in component:
                        component.add(stack.pop())
                    on_stack -= component
                    if len(component) > 1:
                        found.append(component)
    return found


def shortest_cycle(tree, component):
    """A shortest way from the first unit of `component` back to it, both ends included."""
    start = min(component)
    came_from, queue = {}, collections.deque([start])
    while start not in came_from:
        unit = queue.popleft()
        for other in sorted(component & tree.units[unit].includes.keys()):
            if other not in came_from:
                came_from[other] = unit
                queue.append(other)
    path = [start, came_from[start]]
    while path[-1] != start:
        path.append(came_from[path[-1]])
    return path[::-1]


def upward_includes(tree):
    """No include runs up the order of rooms."""
    for unit in tree.units.values():
        for key, arrows in unit.includes.items():
            room = tree.units[key].room
            if {unit.room, room} <= set(ROOMS) and ROOM_ORDER[room] > ROOM_ORDER[unit.room]:
                rooms = f"up from {unit.room} to {room}"
                for file, line, other in arrows:
                    yield f"{file.path}:{line}: includes {other.path}, {rooms}"


def crowded_folders(tree):
    """No folder holds too many units."""
    names = collections.defaultdict(set)
    for file in tree.files.values():
        names[file.folder].add(file.name)
    for folder, units in names.items():
        if len(units) > MOST_UNITS_IN_FOLDER:
            yield f"{folder}: {len(units)} units, at most {MOST_UNITS_IN_FOLDER}"


def long_files(tree):
    """No file is too long."""
    for file in tree.files.values():
        if file.code_lines > MOST_CODE_LINES and room_of(file.path) not in LONG_FILE_ROOMS:
            yield f"{file.path}: {file.code_lines} lines of code, at most {MOST_CODE_LINES}"


def hubs(tree):
    """No unit includes too many others."""
    for unit in tree.units.values():
        if len(unit.includes) > MOST_INCLUDED_UNITS:
            yield (
                f"{unit.files[0].path}: its unit includes {len(unit.includes)} others, "
                f"at most {MOST_INCLUDED_UNITS}"
            )


def shared_names(tree):
    """No two units of the libraries have the same name."""
    named = collections.defaultdict(list)
    for unit in tree.units.values():
        if unit.files[0].floor in LIBRARY_FLOORS and unit.name not in SHARED_NAMES:
            named[unit.name].append(unit.key)
    for file in tree.files.values():  # a second public header joins a unit that has one
        if file.is_public and f"{file.folder}/{file.name}" not in named[file.name]:
            headers = [f for f in file.unit.files if f.is_header and f is not file]
            if headers:
                named[file.name].append(f"{file.folder}/{file.name}")
    for name, keys in named.items():
        if len(keys) > 1:
            yield f"{name}: the name of {len(keys)} units: {', '.join(sorted(keys))}"


def private_includes(tree):
    """No private header is included from another floor."""
    for file in tree.files.values():
        for line, path in file.includes:
            other = tree.files[path]
            is_private = room_of(path) in PRIVATE_ROOMS or (
                other.is_header and other.name.endswith("_impl")
            )
            at_home = file.floor == other.floor or file.path.startswith(f"tests/{other.floor}/")
            if is_private and not at_home:
                yield f"{file.path}:{line}: includes {path}, which is private to {other.floor}"


RULES = (
    missing_files,
    homeless_units,
    cycles,
    upward_includes,
    crowded_folders,
    long_files,
    hubs,
    shared_names,
    private_includes,
)


def violations(tree):
    """A line for everything in the tree that breaks a rule."""
    return [line for rule in RULES for line in rule(tree)]


def print_rooms(tree):
    for room in (*ROOMS, None):
        units = [unit for unit in tree.units.values() if unit.room == room]
        if not units:
            continue
        lines = sum(unit.code_lines for unit in units)
        print(f"{room or 'in no room'}: {len(units)} units, {lines} lines of code")
        if room:
            print(f"  {ROOMS[room]}")
        for unit in sorted(units, key=lambda unit: unit.key):
            print(f"  {unit.code_lines:5} {unit.key}")


def print_unit(tree, name):
    """Returns whether there is such a unit."""
    found = [unit for unit in tree.units.values() if name in (unit.key, unit.name)]
    for unit in found:
        print(f"{unit.key} ({unit.room or 'in no room'}, {unit.code_lines} lines of code)")
        for key in sorted(unit.includes):
            print(f"  includes {key}")
        for other in sorted(tree.units.values(), key=lambda other: other.key):
            if unit.key in other.includes:
                print(f"  included by {other.key}")
    return bool(found)


def main():
    parser = argparse.ArgumentParser(description="Checks the layout of the source tree.")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--list", action="store_true", help="print the rooms and their units")
    what.add_argument("--unit", metavar="NAME", help="print what a unit includes, and who it")
    parser.add_argument("root", nargs="?", default=pathlib.Path(__file__).resolve().parents[2])
    arguments = parser.parse_args()
    tree = Tree(arguments.root)
    if arguments.list:
        print_rooms(tree)
        return 0
    if arguments.unit:
        if print_unit(tree, arguments.unit):
            return 0
        print(f"no unit is named {arguments.unit}", file=sys.stderr)
        return 1
    broken = violations(tree)
    for line in broken:
        print(line)
    arrows = sum(len(unit.includes) for unit in tree.units.values())
    print(f"{len(tree.units)} units, {arrows} includes between them, {len(broken)} violations")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
