"""A room relit in ten lines: precompute once, then a frame for every place of the lamp."""

import pathlib

import numpy as np

import rebounce

room = pathlib.Path(__file__).parents[3] / "tests/scenes/cornell_box.gltf"
data = rebounce.precompute(room, patches=500, tolerance=0.01)
engine = rebounce.Engine(data)
for x in np.linspace(0.1, 0.5, 5):
    engine.relight([rebounce.Light(position=(x, 0.4, 0.2), intensity=20)])
    flux = data.area @ engine.radiosity
    print(f"lamp at x = {x:+.2f} m: {flux.round(1)} lm leave the walls")
