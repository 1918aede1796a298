"""Light meters: illuminance at points with a normal."""

import os
from typing import TYPE_CHECKING, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt
import scipy.sparse

from . import _core
from ._progress import Progress, reporting
from .frame import Engine, Light, Sky

if TYPE_CHECKING:
    from .transfer import TransferData

Floats = npt.NDArray[np.float32]


class Sensors:
    """Light meters of a scene: linear maps from its light to the illuminance at points.

    positions: [m, 3] metres. normals: [m, 3], of any length but 0.
    rays: of each sensor, 1 to 2**20; the noise falls with their number.
    `patches` [m, n] is a csr_matrix and `sky_cells` [m, 146] an array: with radiosity B [n, 3] in lx
    and luminances L [146] in cd/m² the illuminance without lamps is patches @ B + pi sky_cells @ L.
    Raises ValueError if a shape does not fit, a number is not finite or out of range, or a normal has
    no length.
    """

    def __init__(
        self,
        data: "TransferData",
        positions: npt.ArrayLike,
        normals: npt.ArrayLike,
        rays: int = 4096,
        progress: Progress = None,
    ) -> None:
        points = np.ascontiguousarray(positions, dtype=np.float32)
        directions = np.asarray(normals, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError(f"positions have the shape {list(points.shape)}, and need [m, 3]")
        if directions.shape != points.shape:
            raise ValueError(
                f"normals have the shape {list(directions.shape)}, and need {list(points.shape)}"
            )
        if not (np.isfinite(points).all() and np.isfinite(directions).all()):
            raise ValueError("a position or a normal is not finite")
        if not 1 <= rays <= 2**20:
            raise ValueError(f"rays is {rays}, and must be from 1 to 2**20")
        length = np.linalg.norm(directions, axis=1, keepdims=True)
        if not (length > 0).all():
            raise ValueError("a normal has no length")
        self._core = _core.Sensors(
            data._core, points, np.ascontiguousarray(directions / length, dtype=np.float32)
        )
        with reporting(progress) as report:
            indptr, indices, parts, sky = self._core.view(rays, report)
        self.patches: scipy.sparse.csr_matrix = scipy.sparse.csr_matrix(
            (parts, indices.view(np.int32), indptr), shape=(len(points), data.patch_count)
        )
        self.sky_cells: Floats = sky.reshape(len(points), 146)

    def __len__(self) -> int:
        return int(self.sky_cells.shape[0])

    def direct(self, lights: Sequence[Light], samples: int = 16) -> Floats:
        """[m, 3] lx straight from lamps, with shadows; a lamp with a surface has `samples` places, at
        least 1."""
        return self._core.direct(list(lights), samples)

    def illuminance(
        self, engine: Engine, lights: Sequence[Light] = (), sky: Optional[Sky] = None
    ) -> Floats:
        """[m, 3] lx of the last frame of `engine`, which had these lights and this sky."""
        result = self.patches @ engine.radiosity + self.direct(lights)
        if sky is not None:
            cells = np.ones(146) if sky.distribution is None else np.asarray(sky.distribution)
            seen = np.pi * sky.luminance * (self.sky_cells @ cells)
            result = result + seen[:, None] * np.asarray(sky.color)
        return np.asarray(result, dtype=np.float32)


def read_points(path: Union[str, "os.PathLike[str]"]) -> Tuple[Floats, Floats]:
    """The sensors of a .pts file, `x y z dx dy dz` a line with z up: positions and normals, y up.
    Raises ValueError if a line has not six numbers."""
    rows = np.loadtxt(path, ndmin=2)
    if rows.shape[1] != 6:
        raise ValueError(f"{os.fspath(path)}: lines have {rows.shape[1]} numbers, and need 6")
    return y_up(rows[:, :3]), y_up(rows[:, 3:])


def y_up(points: npt.ArrayLike) -> Floats:
    """Points [m, 3] or [3] with z up and y north, as building programs have them, with y up."""
    array = np.asarray(points, dtype=np.float32)
    return np.stack([array[..., 0], array[..., 2], -array[..., 1]], axis=-1)
