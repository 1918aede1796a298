"""A room with a window under six skies and a sun, against a path tracer of its own."""

import numpy as np
import pytest

import rebounce

SIZE = np.array([4.0, 3.0, 6.0])
WINDOW = ((0.5, 3.5), (1.0, 2.5))  # x and y, in the wall at the highest z
REFLECTANCE = {"floor": 0.2, "ceiling": 0.8, "wall": 0.5}
SENSORS = np.array([[2, 0.8, 1.0], [2, 0.8, 3.0], [1, 0.8, 4.5]])
TO_SUN = np.array([0.3, 0.5, 0.81]) / np.linalg.norm([0.3, 0.5, 0.81])
SUN = 40000.0  # lx


def room():
    w, h, d = SIZE
    (x0, x1), (y0, y1) = WINDOW
    quads = [
        [(0, 0, 0), (0, 0, d), (w, 0, d), (w, 0, 0)],
        [(0, h, 0), (w, h, 0), (w, h, d), (0, h, d)],
        [(0, 0, 0), (w, 0, 0), (w, h, 0), (0, h, 0)],
        [(0, 0, 0), (0, h, 0), (0, h, d), (0, 0, d)],
        [(w, 0, 0), (w, 0, d), (w, h, d), (w, h, 0)],
        [(0, 0, d), (0, y0, d), (w, y0, d), (w, 0, d)],
        [(0, y1, d), (0, h, d), (w, h, d), (w, y1, d)],
        [(0, y0, d), (0, y1, d), (x0, y1, d), (x0, y0, d)],
        [(x1, y0, d), (x1, y1, d), (w, y1, d), (w, y0, d)],
    ]
    first = 4 * np.arange(len(quads))[:, None]
    triangles = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    rho = [REFLECTANCE["floor"], REFLECTANCE["ceiling"]] + 7 * [REFLECTANCE["wall"]]
    return rebounce.Scene(
        np.array(quads).reshape(-1, 3), triangles, reflectance=np.tile(rho, 2), double_sided=True
    )


def leaves(p, d):
    """Where rays from `p` along `d` end, on which axis, and whether that is the window."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(d > 0, (SIZE - p) / d, -p / d)
    t = np.where(np.abs(d) > 1e-12, t, np.inf)
    axis = t.argmin(axis=1)
    q = p + t.min(axis=1)[:, None] * d
    (x0, x1), (y0, y1) = WINDOW
    inside = (q[:, 0] > x0) & (q[:, 0] < x1) & (q[:, 1] > y0) & (q[:, 1] < y1)
    return q, axis, inside & (axis == 2) & (d[:, 2] > 0)


def cosine_directions(random, normal):
    """About unit normals [k, 3] along the axes."""
    d = random.normal(size=normal.shape)
    d = normal + d / np.linalg.norm(d, axis=1, keepdims=True)
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def path_traced(position, luminance, sun, rays=50000):
    """Illuminance of a sensor that looks up, in lx."""
    random = np.random.default_rng(1)
    p = np.tile(position, (rays, 1))
    normal = np.tile([0.0, 1.0, 0.0], (rays, 1))
    weight = np.ones(rays)
    total = 0.0
    for _ in range(40):
        facing = normal @ TO_SUN
        lit = leaves(p + 1e-9 * normal, np.tile(TO_SUN, (len(p), 1)))[2] & (facing > 0)
        total += sun * np.sum(weight[lit] * facing[lit])
        d = cosine_directions(random, normal)
        q, axis, out = leaves(p, d)
        cells = rebounce._core.sky_cells(d[out].astype(np.float32))
        total += np.pi * np.sum(weight[out] * luminance[cells])
        p, d, axis, weight = q[~out], d[~out], axis[~out], weight[~out]
        normal = np.zeros_like(p)
        normal[np.arange(len(p)), axis] = -np.sign(d[np.arange(len(p)), axis])
        rho = np.where(
            axis == 1, np.where(d[:, 1] < 0, REFLECTANCE["floor"], REFLECTANCE["ceiling"]), REFLECTANCE["wall"]
        )
        weight = weight * rho
        p = np.clip(p, 0, SIZE)
    return total / rays


@pytest.fixture(scope="module")
def lit_room():
    data = rebounce.precompute(room(), patches=1500, quality="low", progress=False)
    sensors = rebounce.Sensors(data, SENSORS, np.tile([0, 1, 0], (3, 1)), rays=30000)
    return rebounce.Engine(data, points_per_patch=16), sensors


@pytest.mark.parametrize("kind", [1, 3, 5, 7, 12, 15])
def test_skies(lit_room, kind):
    engine, sensors = lit_room
    cells = rebounce.cie_sky(kind, -TO_SUN)
    sky = rebounce.Sky(3000, distribution=cells)
    engine.relight([], sky)
    light = sensors.illuminance(engine, [], sky)[:, 1]
    for position, found in zip(SENSORS, light):
        assert found == pytest.approx(path_traced(position, 3000 * cells, 0.0), rel=0.05)


def test_an_hour_with_sun(lit_room):
    engine, sensors = lit_room
    cells = rebounce.cie_sky(12, -TO_SUN)
    sky, sun = rebounce.Sky(3000, distribution=cells), rebounce.Light("directional", direction=-TO_SUN, intensity=SUN)
    engine.relight([sun], sky)
    light = sensors.illuminance(engine, [sun], sky)[:, 1]
    for position, found in zip(SENSORS, light):
        assert found == pytest.approx(path_traced(position, 3000 * cells, SUN), rel=0.05)
