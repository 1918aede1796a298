"""Light: lamps, skies, frames and solutions by iteration."""

import dataclasses
import math
import os
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _core

if TYPE_CHECKING:
    from .transfer import TransferData

Floats = npt.NDArray[np.float32]
Triple = Union[Tuple[float, float, float], Sequence[float], npt.NDArray[Any]]


@dataclasses.dataclass
class Light:
    """A lamp, with the fields and units of KHR_lights_punctual and of light files.

    type: "point", "spot", "directional", "sphere", "rectangle" or "disc".
    position: metres. direction: the way the light travels, of unit length.
    color: linear Rec.709, >= 0. intensity: >= 0; candela (point, spot), lux (directional), cd/m²
    (surfaces). range: metres, 0 for none. Cone angles: radians, inner <= outer <= pi / 2.
    radius: metres, > 0, of spheres and discs. size: metres, > 0, of rectangles, along `tangent` and
    across it. profile: of a luminaire, from load_profile; `intensity` is then a factor of its
    candelas, and `tangent` the way of its horizontal angle 0.
    """

    type: str = "point"
    name: str = ""
    position: Triple = (0.0, 0.0, 0.0)
    direction: Triple = (0.0, -1.0, 0.0)
    color: Triple = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    range: float = 0.0
    inner_cone_angle: float = 0.0
    outer_cone_angle: float = math.pi / 4
    radius: float = 0.0
    size: Sequence[float] = (0.0, 0.0)
    tangent: Triple = (1.0, 0.0, 0.0)
    profile: Optional["_core.Profile"] = None


@dataclasses.dataclass
class Sky:
    """What is seen where nothing is hit.

    luminance: cd/m², >= 0. color: linear Rec.709, >= 0.
    distribution: [146], >= 0, the luminance of each cell in parts of `luminance`, or None for the same in
    all directions. Cell 0 is all that is below the horizon, 1 to 145 are Tregenza's.
    """

    luminance: float = 0.0
    color: Triple = (1.0, 1.0, 1.0)
    distribution: Optional[npt.ArrayLike] = None


def cie_sky(kind: int, sun_direction: Triple, ground_reflectance: float = 0.2) -> Floats:
    """[146] the CIE standard general sky number `kind`, 1 to 15, in parts of the zenith's luminance.

    sun_direction: the way that sunlight travels, of any length but 0. ground_reflectance: in [0, 1].
    Raises Error if an argument is out of range.
    """
    return _core.cie_sky(kind, [float(x) for x in sun_direction], ground_reflectance)


def sky_cell_directions(per_side: int = 4) -> Tuple[Floats, npt.NDArray[np.uint32]]:
    """Unit directions spread evenly over the 145 cells above the horizon, per_side² in each:
    [145 per_side², 3], and their cells [145 per_side²]."""
    places = [(a + 0.5) / per_side for a in range(per_side)]
    points = [
        _core.point_of_sky_cell(cell, (a, b)) for cell in range(1, 146) for a in places for b in places
    ]
    cells = np.repeat(np.arange(1, 146, dtype=np.uint32), per_side * per_side)
    return np.array(points, np.float32), cells


def load_profile(path: Union[str, "os.PathLike[str]"]) -> "_core.Profile":
    """The light distribution of a luminaire from an IES file (LM-63, type C), for Light.profile.

    Its `vertical` and `horizontal` angles are in radians; `intensity(vertical, horizontal)` gives
    candela. Raises Error if the file is no such file.
    """
    with open(path, encoding="latin-1") as file:
        return _core.parse_profile(file.read(), os.fspath(path))


def load_lights(path: Union[str, "os.PathLike[str]"], scale: float = 1.0) -> Tuple[List[Light], Sky]:
    """The lamps and the sky of a light file (.json), or the lamps of a .glb or .gltf.

    It takes what `rebounce solve --lights` takes: profiles of luminaires and CIE skies too. `scale`
    is the length of the unit of a .glb or .gltf in metres, above 0, as in load_scene; a .json file
    is in metres. Raises Error with the light and the field if one is wrong.
    """
    if not (scale > 0 and math.isfinite(scale)):
        raise ValueError(f"scale is {scale}; it must be above 0")
    lights, luminance, color, cells, _ = _core.read_lights(os.fspath(path), scale)
    return [Light(**fields) for fields in lights], Sky(luminance, color, cells)


def load_emitters(path: Union[str, "os.PathLike[str]"]) -> Dict[str, Triple]:
    """What a light file says of surfaces that emit: factors [3] for Engine.set_emission_scale, by
    the name of the material. Raises Error as load_lights does."""
    return dict(_core.read_lights(os.fspath(path), 1.0)[4])


class Engine:
    """Relights one scene: direct light, then one product with the operator.

    One light state, for one thread at a time. Results are views of the last frame, [n, 3] in lx:
    copy what is to outlive the next one.
    points_per_patch: at which lamps are looked at, at least 1. area_light_samples: places of a lamp
    with a surface that each point looks at, 1 to 64. More of either: truer shadows, longer frames.
    Raises Error if one is out of range.
    """

    def __init__(
        self, data: "TransferData", points_per_patch: int = 8, area_light_samples: int = 4
    ) -> None:
        self._core = _core.Engine(data._core, points_per_patch, area_light_samples)
        self._data = data._core
        self._estimator: Optional["_core.ErrorEstimator"] = None
        self._materials: List[str] = data.record["materials"]

    def relight(self, lights: Sequence[Light] = (), sky: Optional[Sky] = None) -> None:
        """One frame. Raises ValueError if a field has no such value, Error, with the number of the
        light, if it is out of range or more than 1e30 lx arrive; the last frame then stays."""
        self._core.relight(list(lights), sky)

    def relight_by_direct(self, direct_irradiance: npt.ArrayLike) -> None:
        """One frame with the direct irradiance [n, 3] in lx of the caller. Raises ValueError for
        another shape, Error if a number is negative, not finite or above 1e30; the last frame then
        stays."""
        self._core.relight_by_direct(np.ascontiguousarray(direct_irradiance, dtype=np.float32))

    def set_emission_scale(self, material: Union[int, str], scale: Union[float, Triple]) -> None:
        """From the next frame on, a material emits `scale` times what the scene says.

        material: its number, or its name. scale: a number or [3], >= 0. Raises ValueError if there is
        no such name, Error if there is no such number or a scale is out of range.
        """
        if isinstance(material, str):
            named = [m for m, name in enumerate(self._materials) if name == material]
            if not named:
                raise ValueError(f"the scene has no material {material!r}")
        else:
            if not 0 <= material < len(self._materials):
                raise _core.Error(f"there is no material {material}; the scene has {len(self._materials)}")
            named = [material]
        for m in named:
            self._core.set_emission_scale(m, [float(x) for x in np.broadcast_to(scale, 3)])

    def estimate_error(self) -> Tuple[float, float]:
        """The error of the indirect irradiance of the last frame, and an upper limit of it.

        Both are relative to the solution with the form factors that the data keep, in the
        area-weighted L2 norm; the limit is inf if too little light arrives to tell. It takes the
        time of two gathers and a product. Raises Error if the data keep no form factors, or the
        operator has receivers or sources.
        """
        if self._estimator is None:
            self._estimator = _core.ErrorEstimator(self._data)
        return self._estimator.estimate_error(self._core)

    @property
    def direct_irradiance(self) -> Floats:
        """[n, 3] lx straight from lamps and sky."""
        return self._core.direct_irradiance

    @property
    def initial_exitance(self) -> Floats:
        """[n, 3] lx: reflectance times direct irradiance, and what the patches emit."""
        return self._core.initial_exitance

    @property
    def indirect_irradiance(self) -> Floats:
        """[n, 3] lx from other patches, after all reflections."""
        return self._core.indirect_irradiance

    @property
    def radiosity(self) -> Floats:
        """[n, 3] lx that leaves the patches."""
        return self._core.radiosity


@dataclasses.dataclass
class Solution:
    """What solve() gives."""

    radiosity: Floats  #: [n, 3] lx
    sweeps: int  #: 0 of the product
    residual: float  #: |M0 + rho F B - B| / |M0|; nan of the product
    converged: bool  #: the residual that was asked for is reached; True of the product
    diverged: bool  #: the residual grew; the best solution is given
    microseconds: float  #: of the sweeps; nan of the product


def solve(
    data: "TransferData",
    initial_exitance: npt.ArrayLike,
    method: str = "transfer",
    residual: float = 1e-6,
    max_sweeps: int = 100,
) -> Solution:
    """Solves (I - rho F) B = M0 for M0 [n, 3] in lx.

    method: "transfer", the product with the operator, or an iteration with the form factors that the
    data keep: "gathering", "jacobi", "gauss-seidel", "symmetric-gauss-seidel",
    "conjugate-gradient", "refine" (from the operator's solution), or "hierarchical" (with links).
    It stops at the relative `residual` (0: never) or after `max_sweeps`, at least 1. Raises
    ValueError for another shape or method, Error if the data lack the form factors it needs or a
    number is out of range.
    """
    exitance = np.ascontiguousarray(initial_exitance, dtype=np.float32)
    if exitance.shape != (data.patch_count, 3):
        raise ValueError(
            f"initial_exitance has the shape {list(exitance.shape)}, and needs [{data.patch_count}, 3]"
        )
    if method != "transfer":
        radiosity, how = _core.solve(data._core, exitance, method, residual, max_sweeps)
        return Solution(radiosity, **how)
    if not (np.isfinite(exitance).all() and (exitance >= 0).all()):
        raise _core.Error("the initial exitance is negative or not finite")
    indirect = (data.transfer @ exitance.T.ravel()).reshape(3, -1).T
    return Solution(exitance + data.reflectance * indirect, 0, math.nan, True, False, math.nan)
