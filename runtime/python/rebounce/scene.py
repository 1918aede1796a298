"""Scenes: triangles with reflectances and emission."""

import os
from typing import Any, List, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _core
from .frame import Light

Floats = npt.NDArray[np.float32]


def _rgb(values: npt.ArrayLike, count: int, name: str) -> Floats:
    """Numbers for all, [3], [t] or [t, 3] as [t, 3]."""
    array = np.asarray(values, dtype=np.float32)
    if array.ndim == 1 and array.shape == (count,) and count != 3:
        array = array[:, None]
    try:
        return np.ascontiguousarray(np.broadcast_to(array, (count, 3)))
    except ValueError:
        raise ValueError(
            f"{name} has the shape {list(array.shape)}, and needs a number, [3], [{count}] or [{count}, 3]"
        ) from None


class Scene:
    """Triangles that reflect diffusely and may emit.

    vertices: [v, 3] metres.
    triangles: [t, 3] indices of vertices, counter-clockwise seen from the front.
    reflectance: in [0, 0.99], a number, [3], [t] or [t, 3]. Of three triangles [3] is one colour.
    emission: luminance in cd/m² of the same shapes.
    ids: [t] a whole number for each triangle, that TransferData.patch_ids gives back by patch;
        triangles of different ids share no material. By default 0.
    double_sided: both sides of all triangles reflect and emit.
    name: what messages and records call it.
    Raises ValueError if a shape does not fit or a number is out of range.
    """

    def __init__(
        self,
        vertices: npt.ArrayLike,
        triangles: npt.ArrayLike,
        reflectance: npt.ArrayLike = 0.5,
        emission: npt.ArrayLike = 0.0,
        ids: Optional[npt.ArrayLike] = None,
        double_sided: bool = False,
        name: str = "arrays",
    ) -> None:
        points = np.ascontiguousarray(vertices, dtype=np.float32)
        corners = np.asarray(triangles)
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError(f"vertices have the shape {list(points.shape)}, and need [v, 3]")
        if corners.ndim != 2 or corners.shape[1] != 3:
            raise ValueError(f"triangles have the shape {list(corners.shape)}, and need [t, 3]")
        if corners.size and corners.dtype.kind not in "iu":
            raise ValueError("triangles must be whole numbers, indices of vertices")
        if not np.isfinite(points).all():
            raise ValueError("vertices are not all finite")
        if corners.size and (corners.min() < 0 or corners.max() >= len(points)):
            raise ValueError(f"triangles name vertices that are not there: there are {len(points)}")
        count = len(corners)
        rho = _rgb(reflectance, count, "reflectance")
        luminance = _rgb(emission, count, "emission")
        if not ((rho >= 0) & (rho <= 0.99)).all():
            raise ValueError("reflectance is not in [0, 0.99] everywhere")
        if not ((luminance >= 0) & np.isfinite(luminance)).all():
            raise ValueError("emission is negative or not finite somewhere")
        given: npt.NDArray[Any] = np.zeros(count, np.int64) if ids is None else np.asarray(ids)
        if given.shape != (count,):
            raise ValueError(f"ids have the shape {list(given.shape)}, and need [{count}]")
        if given.size and (given.dtype.kind not in "iu" or int(given.max()) >= 1 << 63):
            raise ValueError("ids must be whole numbers below 2^63")
        numbers = given.astype(np.int64)
        # Ranks in place of ids: float64 does not hold every id.
        rows = np.column_stack([np.unique(numbers, return_inverse=True)[1], rho, luminance])
        kinds, first, group = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        self._ids: Optional[npt.NDArray[np.int64]] = numbers[first]
        self._core = _core.Scene(
            points,
            np.ascontiguousarray(corners, dtype=np.uint32),
            np.ascontiguousarray(group.ravel(), dtype=np.uint32),
            np.ascontiguousarray(rho[first]),
            np.ascontiguousarray(luminance[first]),
            double_sided,
            name,
        )

    @classmethod
    def _of(cls, core: "_core.Scene") -> "Scene":
        scene = cls.__new__(cls)
        scene._core = core
        scene._ids = None
        return scene

    @property
    def name(self) -> str:
        return self._core.name

    @property
    def vertices(self) -> Floats:
        """[v, 3] metres; a view. Not those that were given: each triangle has its own, and triangles
        without area are left out."""
        return self._core.arrays()["vertices"]

    @property
    def triangles(self) -> npt.NDArray[np.uint32]:
        """[t, 3] indices of vertices; a view."""
        return self._core.arrays()["triangles"]

    @property
    def lights(self) -> List[Light]:
        """The lamps of the file."""
        return [Light(**fields) for fields in self._core.lights]

    @property
    def warnings(self) -> List[str]:
        """What was left out or changed, a line each."""
        return self._core.warnings

    def __repr__(self) -> str:
        return f"<rebounce.Scene {self.name}: {len(self.triangles)} triangles>"


def load_scene(path: Union[str, "os.PathLike[str]"], scale: float = 1.0) -> Scene:
    """Reads a .glb or .gltf file; `scale` is the length of its unit in metres, above 0.

    Raises Error, one line, if the file cannot be used.
    """
    return Scene._of(_core.load_scene(os.fspath(path), scale))
