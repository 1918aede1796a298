"""All bounces of light in a static scene, in one product.

Arrays are NumPy's, matrices SciPy's. Units are photometric, as in glTF: metres, candela, lux, candela
per square metre; up is +y. Three channels, linear Rec.709 red, green and blue; they may stand for any
three bands. Long work runs without Python's lock; what takes `progress` shows it, and stops on Ctrl-C.

>>> import rebounce
>>> scene = rebounce.load_scene("room.glb")                     # doctest: +SKIP
>>> data = rebounce.precompute(scene, patches=4096)             # doctest: +SKIP
>>> engine = rebounce.Engine(data)                              # doctest: +SKIP
>>> engine.relight([rebounce.Light(position=(0, 1.8, 0), intensity=80)])  # doctest: +SKIP
>>> engine.radiosity                                            # [n, 3] in lx  # doctest: +SKIP
"""

from ._core import Error, __version__, set_threads
from .facets import ViewFactors, exchange_factors, read_facets, view_factors, view_factors_report
from .frame import (
    Engine,
    Light,
    Sky,
    Solution,
    cie_sky,
    load_emitters,
    load_lights,
    load_profile,
    sky_cell_directions,
    solve,
)
from .scene import Scene, load_scene
from .sensors import Sensors
from .transfer import FormFactorOperator, TransferData, TransferOperator, load, precompute, save

__all__ = [
    "Engine",
    "Error",
    "FormFactorOperator",
    "Light",
    "Scene",
    "Sensors",
    "Sky",
    "Solution",
    "TransferData",
    "TransferOperator",
    "ViewFactors",
    "__version__",
    "cie_sky",
    "exchange_factors",
    "load",
    "load_emitters",
    "load_lights",
    "load_profile",
    "load_scene",
    "precompute",
    "read_facets",
    "save",
    "set_threads",
    "sky_cell_directions",
    "solve",
    "view_factors",
    "view_factors_report",
]
