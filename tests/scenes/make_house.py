#!/usr/bin/env python3
"""Writes furnished_house.gltf: two floors of eight furnished rooms each, in metres, closed.

The rooms of a floor are in two rows of four. Doors join those of a row, and two pairs across; a
stair joins the floors.

Usage: make_house.py [FOLDER]; the same bytes on every machine.
"""

import itertools
import pathlib
import sys

from make_rooms import box, chair, document, rectangles, shelves, sofa, standing, table

WIDTH, HEIGHT, DEPTH = 5.0, 2.7, 4.0  # of a room: x, y, z
WALL, SLAB = 0.2, 0.3
COLUMNS, ROWS, FLOORS = 4, 2, 2

DOOR_HEIGHT = 2.1
DOOR_TO_COLUMN = (2.9, 3.8)  # z, in the walls between the rooms of a row
DOOR_TO_ROW = (0.6, 1.5)  # x, in the wall between the rows
COLUMNS_WITH_DOOR = (0, 3)

# The stair is in the last room of the first row. It rises towards -z, and ends at a landing.
STAIR_ROOM = (COLUMNS - 1, 0)
STAIR_X = (3.9, 4.9)
TREADS, TREAD = 13, 0.22
STAIR_Z = (0.94, 0.94 + TREADS * TREAD)
OPENING_Z = (0.94, 3.4)


def living_room(furniture):
    furniture["oak"] += table((1.6, 1.4), (3.0, 2.3), 0.75)
    furniture["oak"] += chair(2.1, 0.85, "-z") + chair(2.1, 2.4, "+z") + chair(1.05, 1.65, "-x")
    furniture["cloth"] += sofa(3.2, 0.1)
    furniture["oak"] += shelves(0.05, 0.3)


def bedroom(furniture):
    furniture["linen"] += standing((2.7, 0, 0.1), (4.8, 0.45, 1.1))
    furniture["white"] += standing((4.3, 0, 1.6), (4.9, 2.0, 2.7))
    furniture["oak"] += table((1.8, 1.2), (2.5, 1.9), 0.75) + chair(1.9, 2.0, "+z")
    furniture["oak"] += shelves(0.05, 0.3)


def kitchen(furniture):
    furniture["white"] += standing((1.7, 0, 0.05), (4.9, 0.9, 0.65))
    furniture["oak"] += table((2.0, 1.5), (3.6, 2.2), 0.75)
    for x, (z, back) in itertools.product((2.2, 3.0), ((1.0, "-z"), (2.3, "+z"))):
        furniture["oak"] += chair(x, z, back)
    furniture["white"] += standing((0.05, 0, 0.9), (0.6, 2.0, 2.2))


def study(furniture):
    furniture["oak"] += table((3.6, 0.5), (4.8, 2.0), 0.75) + chair(3.05, 1.05, "-x")
    furniture["cloth"] += sofa(1.6, 0.1)
    furniture["oak"] += shelves(0.05, 0.3)


def hall(furniture):
    furniture["cloth"] += sofa(1.6, 0.1)
    furniture["oak"] += table((1.9, 1.5), (3.0, 2.2), 0.45) + shelves(0.05, 0.3)


def stair():
    """Treads, risers and both sides of the stair, from the floor to the one above."""
    rise = (HEIGHT + SLAB) / (TREADS + 1)
    quads = []
    for k in range(TREADS):
        front = STAIR_Z[1] - k * TREAD
        back, top = front - TREAD, (k + 1) * rise
        quads += rectangles(1, top, 1, (back, front), STAIR_X)
        quads += rectangles(2, front, 1, STAIR_X, (top - rise, top))
        for x, side in zip(STAIR_X, (-1, 1)):
            quads += rectangles(0, x, side, (0, top), (back, front))
    return quads + rectangles(2, STAIR_Z[0], -1, STAIR_X, (0, TREADS * rise))


class Room:
    """The surfaces of a room with its corner at the origin. Its grids have the same lines."""

    def __init__(self, column, row, floor):
        stairs = (column, row) == STAIR_ROOM
        crossing = column in COLUMNS_WITH_DOOR
        self.doors = {
            "-x": column > 0,
            "+x": column + 1 < COLUMNS,
            "-z": crossing and row > 0,
            "+z": crossing and row + 1 < ROWS,
        }
        self.opening = {"-y": stairs and floor > 0, "+y": stairs and floor + 1 < FLOORS}
        self.xs = sorted({0, *(DOOR_TO_ROW if crossing else ()), *(STAIR_X if stairs else ()), WIDTH})
        self.zs = sorted({0, *DOOR_TO_COLUMN, *(OPENING_Z if stairs else ()), DEPTH})
        self.ys = (0, DOOR_HEIGHT, HEIGHT)

    def wall(self, side):
        if side[1] == "x":
            hole, us, vs = (0, DOOR_HEIGHT, *DOOR_TO_COLUMN), self.ys, self.zs
        else:
            hole, us, vs = (*DOOR_TO_ROW, 0, DOOR_HEIGHT), self.xs, self.ys
        at = 0 if side[0] == "-" else WIDTH if side[1] == "x" else DEPTH
        facing = 1 if side[0] == "-" else -1
        return rectangles("xyz".index(side[1]), at, facing, us, vs, (hole,) if self.doors[side] else ())

    def level(self, side):
        at, facing = (0, 1) if side == "-y" else (HEIGHT, -1)
        hole = ((*OPENING_Z, *STAIR_X),) if self.opening[side] else ()
        return rectangles(1, at, facing, self.zs, self.xs, hole)

    def reveals(self):
        """Frames and thresholds of the doors to the next rooms, and of the opening above."""
        frames, thresholds = [], []
        x, z = (WIDTH, WIDTH + WALL), (DEPTH, DEPTH + WALL)
        if self.doors["+x"]:
            low, high = (x[0], 0, DOOR_TO_COLUMN[0]), (x[1], DOOR_HEIGHT, DOOR_TO_COLUMN[1])
            frames += box(low, high, True, ("-x", "+x", "-y"))
            thresholds += rectangles(1, 0, 1, DOOR_TO_COLUMN, x)
        if self.doors["+z"]:
            low, high = (DOOR_TO_ROW[0], 0, z[0]), (DOOR_TO_ROW[1], DOOR_HEIGHT, z[1])
            frames += box(low, high, True, ("-z", "+z", "-y"))
            thresholds += rectangles(1, 0, 1, z, DOOR_TO_ROW)
        if self.opening["+y"]:
            low, high = (STAIR_X[0], HEIGHT, OPENING_Z[0]), (STAIR_X[1], HEIGHT + SLAB, OPENING_Z[1])
            frames += box(low, high, True, ("-y", "+y"))
        return frames, thresholds


def furnish(column, row, floor):
    """The furniture of a room, quads by material."""
    furniture = {name: [] for name in ("white", "oak", "cloth", "linen")}
    if (column, row) == STAIR_ROOM:
        hall(furniture)
        if floor + 1 < FLOORS:
            furniture["oak"] += stair()
    else:
        kinds = (living_room, kitchen, study, bedroom)
        kinds[(column + 2 * row + floor) % len(kinds)](furniture)
    return furniture


def furnished_house():
    gltf = document("Furnished house", (4.7, 1.6, 3.7), (1.8, 0.7, 1.2), "make_house.py")
    materials = {
        "white": [0.8, 0.8, 0.78],
        "ochre": [0.7, 0.5, 0.25],
        "blue": [0.35, 0.45, 0.6],
        "parquet": [0.4, 0.26, 0.15],
        "oak": [0.5, 0.36, 0.2],
        "cloth": [0.15, 0.35, 0.3],
        "linen": [0.75, 0.72, 0.65],
    }
    quads = {name: [] for name in materials}
    for floor, row, column in itertools.product(range(FLOORS), range(ROWS), range(COLUMNS)):
        corner = (column * (WIDTH + WALL), floor * (HEIGHT + SLAB), row * (DEPTH + WALL))
        room = Room(column, row, floor)
        frames, thresholds = room.reveals()
        coloured = "ochre" if (column + row + floor) % 2 == 0 else "blue"
        parts = {"white": room.level("+y") + frames, "parquet": room.level("-y") + thresholds}
        for side in ("+x", "-z", "+z"):
            parts["white"] += room.wall(side)
        parts[coloured] = room.wall("-x")
        for part in (parts, furnish(column, row, floor)):
            for name, some in part.items():
                quads[name] += moved(some, corner)
    for name, color in materials.items():
        gltf.add_quads(name, quads[name], gltf.add_material(name, color))
    return gltf


def moved(quads, by):
    return [tuple(tuple(c + d for c, d in zip(p, by)) for p in quad) for quad in quads]


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else __file__)
    folder = folder if folder.is_dir() else folder.parent
    (folder / "furnished_house.gltf").write_text(furnished_house().text(), encoding="utf-8")
