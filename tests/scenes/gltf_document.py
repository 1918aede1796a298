"""glTF documents made of quads, for the scripts beside this one that write scenes."""

import base64
import json
import math
import struct


def ring(outer, inner):
    """The quads between two quads that are wound alike, without T-junctions."""
    nearest = [min(inner, key=lambda p: math.dist(p, corner)) for corner in outer]
    return tuple(
        (outer[i], outer[(i + 1) % 4], nearest[(i + 1) % 4], nearest[i]) for i in range(4)
    )


class GltfDocument:
    """A glTF document that grows by one mesh of quads at a time.

    Lengths are given in units of `unit` metres. The same calls make the same bytes everywhere.
    """

    def __init__(self, generator, scene_name, unit=1.0):
        self.unit = unit
        self.bytes = b""
        self.document = {
            "asset": {"version": "2.0", "generator": generator},
            "extensionsUsed": ["KHR_materials_emissive_strength"],
            "scene": 0,
            "scenes": [{"name": scene_name, "nodes": []}],
            "nodes": [],
            "meshes": [],
            "cameras": [],
            "materials": [],
            "accessors": [],
            "bufferViews": [],
        }

    def add(self, kind, value):
        self.document[kind].append(value)
        return len(self.document[kind]) - 1

    def add_node(self, node):
        self.document["scenes"][0]["nodes"].append(self.add("nodes", node))

    def add_material(self, name, color, luminance=0.0):
        """A diffuse material of linear Rec.709 `color`; returns its index."""
        material = {
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [*color, 1.0],
                "metallicFactor": 0.0,
                "roughnessFactor": 1.0,
            },
        }
        if luminance > 0:
            material["emissiveFactor"] = [1.0, 1.0, 1.0]
            material["extensions"] = {
                "KHR_materials_emissive_strength": {"emissiveStrength": luminance}
            }
        return self.add("materials", material)

    def add_accessor(self, data, description):
        view = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)}
        self.bytes += data + bytes(-len(data) % 4)
        return self.add("accessors", {"bufferView": self.add("bufferViews", view), **description})

    def add_quads(self, name, quads, material):
        """A mesh of quads, each four corners counter-clockwise seen from the front."""
        corners = [[c * self.unit for c in corner] for quad in quads for corner in quad]
        stored = [struct.unpack("<3f", struct.pack("<3f", *corner)) for corner in corners]
        indices = [4 * q + i for q in range(len(quads)) for i in (0, 1, 2, 0, 2, 3)]
        positions = self.add_accessor(
            b"".join(struct.pack("<3f", *corner) for corner in stored),
            {
                "componentType": 5126,
                "count": len(stored),
                "type": "VEC3",
                "min": [min(axis) for axis in zip(*stored)],
                "max": [max(axis) for axis in zip(*stored)],
            },
        )
        triangles = self.add_accessor(
            struct.pack(f"<{len(indices)}H", *indices),
            {"componentType": 5123, "count": len(indices), "type": "SCALAR"},
        )
        primitive = {
            "attributes": {"POSITION": positions},
            "indices": triangles,
            "material": material,
        }
        self.add_node({"name": name, "mesh": self.add("meshes", {"primitives": [primitive]})})

    def add_camera(self, name, position, vertical_fov, rotation, aspect_ratio):
        """A camera; `vertical_fov` in radians, `rotation` a quaternion x, y, z, w from -z."""
        perspective = {
            "yfov": round(vertical_fov, 6),
            "aspectRatio": aspect_ratio,
            "znear": 0.01,
        }
        camera = {"name": name, "type": "perspective", "perspective": perspective}
        self.add_node(
            {
                "name": name,
                "camera": self.add("cameras", camera),
                "translation": [round(c * self.unit, 6) for c in position],
                "rotation": rotation,
            }
        )

    def text(self):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.bytes).decode()
        self.document["buffers"] = [{"byteLength": len(self.bytes), "uri": uri}]
        return json.dumps(self.document, indent=1) + "\n"
