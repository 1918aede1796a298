"""Inverse lighting: which lamps of a ceiling give the light that one wants on the floor?

Every lamp alone is a column of direct light; the operator takes all of them to all bounces in one
product; non-negative least squares finds their intensities. Writes which_lamps.png.
"""

import pathlib
import sys

import numpy as np
from scipy.optimize import nnls

import rebounce

room = pathlib.Path(__file__).parents[3] / "tests/scenes/cornell_box.gltf"
data = rebounce.precompute(room, patches=300 if "--quick" in sys.argv else 2000)
engine = rebounce.Engine(data)

# What a lamp of one candela gives, at each of 5 x 5 places under the ceiling.
low, high = data.mesh["position"].min(axis=0), data.mesh["position"].max(axis=0)
places = [(x, high[1] - 0.1, z) for x in np.linspace(low[0] + 0.2, high[0] - 0.2, 5)
          for z in np.linspace(low[2] + 0.2, high[2] - 0.2, 5)]  # fmt: skip
columns = []
for place in places:
    engine.relight([rebounce.Light(position=place, intensity=1)])
    columns.append(engine.initial_exitance.T.ravel().copy())
light = np.stack(columns, axis=1)  # [3n, 25]
rho = data.reflectance.T.ravel()[:, None]
radiosity = light + rho * (data.transfer @ light)  # all bounces of all lamps

# Wanted: as if two of the lamps had 40 and 90 candela. Looked at: green light of the floor.
n = data.patch_count
floor = np.flatnonzero((data.normal[:, 1] > 0.9) & (data.centroid[:, 1] < low[1] + 0.05))
weight = np.sqrt(data.area[floor])[:, None]
matrix = radiosity[n + floor]
wanted = matrix[:, 6] * 40 + matrix[:, 18] * 90
candela, rest = nnls(weight * matrix, weight[:, 0] * wanted)
for k in np.flatnonzero(candela > 0.5):
    print(f"lamp {k} at {np.round(places[k], 2)}: {candela[k]:.1f} cd")
error = rest / np.linalg.norm(weight[:, 0] * wanted)
print(f"the floor is off by {100 * error:.2f} %")
assert error < 0.01 and abs(candela[6] - 40) < 4 and abs(candela[18] - 90) < 4

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError:
    print("no picture: matplotlib is not installed")
    sys.exit()
figure, axes = plt.subplots(1, 2, figsize=(8, 4), sharey=True)
for axis, title, values in ((axes[0], "wanted", wanted), (axes[1], "found", matrix @ candela)):
    x, z = data.centroid[floor, 0], data.centroid[floor, 2]
    axis.scatter(x, z, c=values, s=60, marker="s", vmin=0, vmax=wanted.max())
    axis.set_title(f"light of the floor, {title} (lx)")
    axis.set_aspect("equal")
x, _, z = np.array(places).T
axes[1].scatter(x, z, s=2 * candela, facecolors="none", edgecolors="red")
figure.savefig("which_lamps.png", dpi=100)
