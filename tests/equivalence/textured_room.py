"""A small room with what no shipped scene has: a texture, a cut-out, second texture coordinates."""

import base64
import json
import struct
import zlib

W, H, D = 4.0, 2.5, 3.0
# Quads of the room and of a screen in it, counter-clockwise from the front.
QUADS = [
    ((0, 0, D), (W, 0, D), (W, 0, 0), (0, 0, 0)),
    ((0, H, 0), (W, H, 0), (W, H, D), (0, H, D)),
    ((0, 0, 0), (W, 0, 0), (W, H, 0), (0, H, 0)),
    ((W, 0, D), (0, 0, D), (0, H, D), (W, H, D)),
    ((0, 0, D), (0, 0, 0), (0, H, 0), (0, H, D)),
    ((W, 0, 0), (W, 0, D), (W, H, D), (W, H, 0)),
    ((1.2, 0.3, 1.2), (2.4, 0.3, 1.4), (2.4, 1.6, 1.4), (1.2, 1.6, 1.2)),
]
CORNERS = ((0, 0), (1, 0), (1, 1), (0, 1))
CHARTS = 3  # along each side of the page


def png(size):
    """A chequered RGBA image with holes; stored, not deflated: the same bytes everywhere."""

    def chunk(kind, data):
        length, check = struct.pack(">I", len(data)), struct.pack(">I", zlib.crc32(kind + data))
        return length + kind + data + check

    rows = b"".join(
        b"\0"
        + b"".join(
            bytes((40 + 200 * ((x ^ y) & 1), 90 + 8 * x, 220 - 8 * y, 0 if x * y % 5 == 4 else 255))
            for x in range(size)
        )
        for y in range(size)
    )
    header = struct.pack(">IIBBBBB", size, size, 8, 6, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows, 0))
        + chunk(b"IEND", b"")
    )


def charts():
    """Second texture coordinates: a chart for each quad, side by side with a margin."""
    return [
        ((q % CHARTS + 0.125 + 0.75 * u) / CHARTS, (q // CHARTS + 0.125 + 0.75 * v) / CHARTS)
        for q in range(len(QUADS))
        for u, v in CORNERS
    ]


def data_uri(kind, data):
    return f"data:{kind};base64," + base64.b64encode(data).decode()


class Buffer:
    """The bytes of a document, its views and accessors."""

    def __init__(self):
        self.bytes, self.views, self.accessors = b"", [], []

    def add(self, data, component, kind, count, **limits):
        view = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)}
        self.bytes += data + bytes(-len(data) % 4)
        self.views.append(view)
        meaning = {"componentType": component, "type": kind, "count": count}
        self.accessors.append({"bufferView": len(self.views) - 1} | meaning | limits)
        return len(self.accessors) - 1

    def add_floats(self, rows, kind, **limits):
        data = b"".join(struct.pack(f"<{len(row)}f", *row) for row in rows)
        return self.add(data, 5126, kind, len(rows), **limits)

    def add_indices(self, indices):
        return self.add(struct.pack(f"<{len(indices)}H", *indices), 5123, "SCALAR", len(indices))


def attributes(buffer, positions, seconds):
    limits = {"min": [min(a) for a in zip(*positions)], "max": [max(a) for a in zip(*positions)]}
    return {
        "POSITION": buffer.add_floats(positions, "VEC3", **limits),
        "TEXCOORD_0": buffer.add_floats(CORNERS * (len(positions) // 4), "VEC2"),
        "TEXCOORD_1": buffer.add_floats(seconds, "VEC2"),
    }


def mesh(buffer, name, quads, material):
    """A mesh of some of the quads."""
    positions = [struct.unpack("<3f", struct.pack("<3f", *p)) for q in quads for p in QUADS[q]]
    seconds = [charts()[4 * q + k] for q in quads for k in range(4)]
    indices = [4 * q + k for q in range(len(quads)) for k in (0, 1, 2, 0, 2, 3)]
    primitive = {
        "attributes": attributes(buffer, positions, seconds),
        "indices": buffer.add_indices(indices),
        "material": material,
    }
    return {"name": name, "primitives": [primitive]}


def materials():
    screen = {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0}
    wall = {"baseColorFactor": [0.6, 0.55, 0.5, 1.0], "metallicFactor": 0.0}
    return [
        {"name": "wall", "pbrMetallicRoughness": wall},
        {"name": "floor", "pbrMetallicRoughness": screen},
        {
            "name": "screen",
            "pbrMetallicRoughness": screen,
            "alphaMode": "MASK",
            "doubleSided": True,
        },
    ]


def text():
    """The scene, as a glTF file with everything in it."""
    buffer = Buffer()
    meshes = [
        mesh(buffer, "walls", [1, 2, 3, 4, 5], 0),
        mesh(buffer, "floor", [0], 1),
        mesh(buffer, "screen", [6], 2),
    ]
    camera = {"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.01}}
    view = {"name": "view", "camera": 0, "translation": [3.0, 1.4, 2.8]}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2, 3]}],
        "nodes": [{"mesh": m, "name": meshes[m]["name"]} for m in range(3)] + [view],
        "cameras": [camera],
        "meshes": meshes,
        "materials": materials(),
        "textures": [{"source": 0}],
        "images": [{"uri": data_uri("image/png", png(16))}],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [
            {
                "byteLength": len(buffer.bytes),
                "uri": data_uri("application/octet-stream", buffer.bytes),
            }
        ],
    }
    return json.dumps(document, indent=1) + "\n"
