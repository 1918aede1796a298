#!/usr/bin/env python3
"""Writes scenes for reports and benches beside the Cornell box, all of boxes, in metres:

    two_rooms.gltf       two rooms with a door between them, closed
    three_rooms.gltf     three furnished rooms in a row with doors between them, closed
    furnished_room.gltf  a room with table, chairs, sofa, bed and shelves, closed
    white_room.gltf      a room of reflectance 0.9 with two blocks, closed
    pavilion.gltf        columns under a roof before a wall, open to the sky, seen from outside

Usage: make_rooms.py [FOLDER]; the same bytes on every machine.
"""

import itertools
import math
import pathlib
import sys

from gltf_document import GltfDocument

CAMERA_FOV = math.radians(60)


def rectangles(axis, at, facing, us, vs, holes=()):
    """The cells of a grid across `axis` at coordinate `at`, but those whose middle is in a hole.

    `us` and `vs` are the lines of the grid along the two axes after `axis`, in turn; `facing` is +1
    or -1; a hole is (u0, u1, v0, v1).
    """
    quads = []
    for (u0, u1), (v0, v1) in itertools.product(itertools.pairwise(us), itertools.pairwise(vs)):
        u, v = (u0 + u1) / 2, (v0 + v1) / 2
        if any(h[0] < u < h[1] and h[2] < v < h[3] for h in holes):
            continue
        corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]
        if facing < 0:
            corners.reverse()
        quads.append(tuple(point(axis, at, *corner) for corner in corners))
    return quads


def point(axis, at, u, v):
    place = [0.0, 0.0, 0.0]
    place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3] = at, u, v
    return tuple(place)


def box(low, high, inwards=False, without=()):
    """The faces of a box but those `without`, each named by an axis and a side: "-x", "+y"..."""
    quads = []
    for axis, side in itertools.product(range(3), (-1, 1)):
        if f"{'-' if side < 0 else '+'}{'xyz'[axis]}" in without:
            continue
        us, vs = (
            (low[(axis + k) % 3], high[(axis + k) % 3]) for k in (1, 2)
        )
        at = low[axis] if side < 0 else high[axis]
        quads += rectangles(axis, at, -side if inwards else side, us, vs)
    return quads


def standing(low, high):
    """A box that stands on something."""
    return box(low, high, without=("-y",))


def looking(position, target):
    """The rotation of a camera at `position` that looks at `target`, +Y upwards."""
    x, y, z = (t - p for t, p in zip(target, position))
    yaw, pitch = math.atan2(-x, -z), math.atan2(y, math.hypot(x, z))
    cy, sy, cp, sp = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    return [round(q, 6) for q in (cy * sp, sy * cp, -sy * sp, cy * cp)]


def document(name, position, target, generator="make_rooms.py"):
    gltf = GltfDocument(generator, name)
    gltf.add_camera("view", position, CAMERA_FOV, looking(position, target), aspect_ratio=4 / 3)
    return gltf


def two_rooms():
    gltf = document("Two rooms with a door", (0.4, 1.7, 3.6), (5.0, 1.0, 1.7))
    length, height, wall, depth = 4.0, 2.6, 0.2, 4.0
    door = (1.5, 2.5, 0.0, 2.1)  # z and y
    far = length + wall
    white = gltf.add_material("white", [0.75, 0.75, 0.72])
    red = gltf.add_material("red", [0.65, 0.12, 0.1])
    blue = gltf.add_material("blue", [0.12, 0.2, 0.6])
    wood = gltf.add_material("wood", [0.45, 0.3, 0.18])
    gltf.add_quads("first room", box((0, 0, 0), (length, height, depth), True, ("-x", "-y", "+x")), white)
    gltf.add_quads("second room", box((far, 0, 0), (far + length, height, depth), True, ("+x", "-y", "-x")), white)
    zs = (0, door[0], door[1], depth)
    gltf.add_quads("partition", partition(length, far, height, zs, door), white)
    gltf.add_quads("red wall", rectangles(0, 0, 1, (0, height), (0, depth)), red)
    gltf.add_quads("blue wall", rectangles(0, far + length, -1, (0, height), (0, depth)), blue)
    floor = rectangles(1, 0, 1, zs, (0, length)) + rectangles(1, 0, 1, (door[0], door[1]), (length, far))
    floor += rectangles(1, 0, 1, zs, (far, far + length))
    gltf.add_quads("floor", floor, wood)
    gltf.add_quads("cupboard", standing((0.8, 0, 0.2), (2.0, 1.4, 0.7)), wood)
    gltf.add_quads("table", standing((5.6, 0, 1.4), (6.8, 0.75, 2.4)), white)
    return gltf


def partition(x0, x1, height, zs, door):
    """A wall from `x0` to `x1` with a door (z0, z1, y0, y1), without its threshold.

    `zs` are the lines of the floor, which the wall's edges have too.
    """
    hole = ((door[2], door[3], door[0], door[1]),)
    ys = (0, door[3], height)
    quads = rectangles(0, x0, -1, ys, zs, hole) + rectangles(0, x1, 1, ys, zs, hole)
    return quads + box((x0, 0, door[0]), (x1, door[3], door[1]), True, ("-x", "+x", "-y"))


def three_rooms():
    gltf = document("Three rooms with doors", (0.4, 1.7, 3.6), (5.0, 1.0, 1.7))
    white = gltf.add_material("white", [0.8, 0.8, 0.78])
    red = gltf.add_material("red", [0.65, 0.12, 0.1])
    blue = gltf.add_material("blue", [0.12, 0.2, 0.6])
    wood = gltf.add_material("wood", [0.45, 0.3, 0.18])
    cloth = gltf.add_material("cloth", [0.15, 0.35, 0.3])
    height, depth, wall = 2.6, 4.0, 0.2
    rooms = ((0.0, 4.2), (4.2 + wall, 8.0), (8.0 + wall, 12.4))  # from and to, x
    doors = ((0.4, 1.3, 0.0, 2.1), (2.6, 3.5, 0.0, 2.1))
    zs = (0, *doors[0][:2], *doors[1][:2], depth)
    floor, walls = [], []
    for x0, x1 in rooms:
        walls += box((x0, 0, 0), (x1, height, depth), True, ("-x", "-y", "+x"))
        floor += rectangles(1, 0, 1, zs, (x0, x1))
    for (_, x0), (x1, _), door in zip(rooms, rooms[1:], doors):
        walls += partition(x0, x1, height, zs, door)
        floor += rectangles(1, 0, 1, door[:2], (x0, x1))
    gltf.add_quads("walls", walls, white)
    gltf.add_quads("red wall", rectangles(0, 0, 1, (0, height), zs), red)
    gltf.add_quads("blue wall", rectangles(0, rooms[-1][1], -1, (0, height), zs), blue)
    gltf.add_quads("floor", floor, wood)
    gltf.add_quads("sofa", sofa(1.2, 0.1), cloth)
    gltf.add_quads("shelves", shelves(0.05, 1.6), wood)
    gltf.add_quads("low table", table((1.5, 1.8), (2.6, 2.5), 0.45), wood)
    gltf.add_quads("table", table((5.4, 1.5), (6.9, 2.4), 0.75), wood)
    for name, (x, z), back in (("chair north", (5.9, 0.95), "-z"), ("chair south", (5.9, 2.5), "+z")):
        gltf.add_quads(name, chair(x, z, back), wood)
    gltf.add_quads("bed", standing((10.2, 0, 0.4), (12.3, 0.45, 1.9)), cloth)
    gltf.add_quads("cupboard", standing((8.3, 0, 0.1), (9.5, 2.0, 0.65)), white)
    return gltf


def furnished_room():
    gltf = document("Furnished room", (4.7, 1.6, 3.7), (1.8, 0.7, 1.2))
    white = gltf.add_material("white", [0.8, 0.8, 0.78])
    ochre = gltf.add_material("ochre", [0.7, 0.5, 0.25])
    parquet = gltf.add_material("parquet", [0.4, 0.26, 0.15])
    oak = gltf.add_material("oak", [0.5, 0.36, 0.2])
    cloth = gltf.add_material("cloth", [0.15, 0.35, 0.3])
    linen = gltf.add_material("linen", [0.75, 0.72, 0.65])
    gltf.add_quads("walls", box((0, 0, 0), (5, 2.7, 4), True, ("-y", "-x")), white)
    gltf.add_quads("ochre wall", rectangles(0, 0, 1, (0, 2.7), (0, 4)), ochre)
    gltf.add_quads("floor", rectangles(1, 0, 1, (0, 4), (0, 5)), parquet)
    gltf.add_quads("table", table((1.6, 1.4), (3.0, 2.3), 0.75), oak)
    for name, (x, z), back in (
        ("chair north", (2.1, 0.85), "-z"),
        ("chair south", (2.1, 2.4), "+z"),
        ("chair west", (1.05, 1.65), "-x"),
    ):
        gltf.add_quads(name, chair(x, z, back), oak)
    gltf.add_quads("sofa", sofa(3.2, 0.1), cloth)
    gltf.add_quads("bed", standing((0.1, 0, 2.9), (2.2, 0.45, 3.9)), linen)
    gltf.add_quads("shelves", shelves(0.05, 0.3), oak)
    return gltf


def table(low, high, height, top=0.05, leg=0.06):
    """A table over (x, z) from `low` to `high`."""
    under = height - top
    quads = box((low[0], under, low[1]), (high[0], height, high[1]))
    for x, z in itertools.product((low[0] + leg, high[0] - 2 * leg), (low[1] + leg, high[1] - 2 * leg)):
        quads += box((x, 0, z), (x + leg, under, z + leg), without=("-y", "+y"))
    return quads


def chair(x, z, back, size=0.45, seat=0.45, thickness=0.05, height=0.9):
    """A chair whose back is on the side `back`."""
    quads = table((x, z), (x + size, z + size), seat, thickness, 0.04)
    low, high = [x, seat, z], [x + size, height, z + size]
    axis = "xyz".index(back[1])
    if back[0] == "-":
        high[axis] = low[axis] + thickness
    else:
        low[axis] = high[axis] - thickness
    return quads + standing(tuple(low), tuple(high))


def sofa(x, z):
    """A seat, a back and two arms that touch it."""
    quads = standing((x + 0.2, 0, z + 0.2), (x + 1.5, 0.42, z + 0.85))
    quads += standing((x, 0, z), (x + 1.7, 0.8, z + 0.2))
    for arm in (x, x + 1.5):
        quads += standing((arm, 0, z + 0.2), (arm + 0.2, 0.6, z + 0.85))
    return quads


def shelves(x, z, width=1.6, depth=0.3, height=2.0, count=4, board=0.03):
    """Shelves along the x = 0 wall, open to the room, between two sides."""
    quads = standing((x, 0, z), (x + depth, height, z + board))
    quads += standing((x, 0, z + width - board), (x + depth, height, z + width))
    for k in range(1, count + 1):
        y = height * k / count - board
        quads += box((x, y, z + board), (x + depth, y + board, z + width - board), without=("-z", "+z"))
    return quads


def white_room():
    gltf = document("White room", (3.7, 1.6, 2.8), (1.0, 0.8, 0.8))
    white = gltf.add_material("white", [0.9, 0.9, 0.9])
    gltf.add_quads("room", box((0, 0, 0), (4, 2.5, 3), True), white)
    gltf.add_quads("low block", standing((0.6, 0, 1.6), (1.6, 0.6, 2.4)), white)
    gltf.add_quads("tall block", standing((1.2, 0, 0.5), (1.9, 1.5, 1.1)), white)
    return gltf


def pavilion():
    gltf = document("Pavilion", (9.5, 3.0, 11.0), (-0.5, 1.2, 0.0))
    stone = gltf.add_material("stone", [0.6, 0.57, 0.5])
    grass = gltf.add_material("grass", [0.12, 0.25, 0.08])
    brick = gltf.add_material("brick", [0.5, 0.2, 0.14])
    gltf.add_quads("ground", rectangles(1, 0, 1, (-12, 12), (-12, 12)), grass)
    gltf.add_quads("base", standing((-5, 0, -3.5), (5, 0.4, 3.5)), stone)
    gltf.add_quads("back wall", standing((-4.6, 0.4, -3.2), (4.6, 3.4, -2.8)), brick)
    columns = []
    for x, z in itertools.product((-4.6, -1.7, 1.2, 4.1), (2.6, -0.2)):
        columns += box((x, 0.4, z), (x + 0.5, 3.4, z + 0.5), without=("-y", "+y"))
    gltf.add_quads("columns", columns, stone)
    gltf.add_quads("roof", box((-5, 3.4, -3.5), (5, 3.8, 3.5)), stone)
    gltf.add_quads("garden wall", standing((-11, 0, -8), (-10.6, 2, 8)), brick)
    return gltf


SCENES = {
    "two_rooms": two_rooms,
    "three_rooms": three_rooms,
    "furnished_room": furnished_room,
    "white_room": white_room,
    "pavilion": pavilion,
}


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else __file__)
    folder = folder if folder.is_dir() else folder.parent
    for name, make in SCENES.items():
        (folder / f"{name}.gltf").write_text(make().text(), encoding="utf-8")
