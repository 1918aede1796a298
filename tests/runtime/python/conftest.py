"""What the tests of the Python package share."""

import pathlib

import numpy as np
import pytest

import rebounce

ROOT = pathlib.Path(__file__).resolve().parents[3]
SCENE = ROOT / "tests/scenes/cornell_box.gltf"


def box(low=(0, 0, 0), high=(1, 1, 1)):
    """Vertices [8, 3] and faces [6, 4] of a box seen from inside."""
    corner = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    vertices = np.array(low) + corner * (np.array(high) - np.array(low))
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    middle = vertices.mean(axis=0)
    turned = []
    for face in faces:
        p = vertices[list(face)]
        outward = np.dot(np.cross(p[1] - p[0], p[2] - p[0]), p[0] - middle)
        turned.append(face[::-1] if outward > 0 else face)
    return vertices, np.array(turned)


def triangles_of(quads):
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


@pytest.fixture(scope="session")
def cornell():
    return rebounce.precompute(SCENE, patches=300, form_factors="exact", links=True, progress=False)


@pytest.fixture(scope="session")
def small_room():
    """A box of 2 m of reflectance 0.5, 0.6, 0.7, whose ids are the numbers of its faces."""
    vertices, faces = box(high=(2, 2, 2))
    scene = rebounce.Scene(
        vertices,
        triangles_of(faces),
        reflectance=(0.5, 0.6, 0.7),
        ids=np.tile(np.arange(6), 2) + 10,
    )
    return rebounce.precompute(
        scene, patches=200, operator="dense", form_factors="exact", quality="low", progress=False
    )
