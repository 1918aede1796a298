"""Transfer data: what precompute makes, and the operators in it."""

import json
import os
from operator import index
from typing import Any, Dict, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt
import scipy.sparse
from scipy.sparse.linalg import LinearOperator

from . import _core
from ._progress import Progress, log, reporting
from .frame import Light
from .scene import Scene

Path = Union[str, "os.PathLike[str]"]
Array = npt.NDArray[Any]


def _block(x: Array, rows: int, dtype: Any) -> Array:
    """`x` as a C-contiguous block [rows, columns]; the same memory if it is one."""
    block = x.reshape(rows, -1) if x.ndim == 1 else x
    return np.ascontiguousarray(block, dtype=dtype)


def _whole(value: Any, name: str) -> int:
    """`value` as an int. Raises ValueError if it is no whole number."""
    try:
        return index(value)
    except TypeError:
        raise ValueError(f"{name} must be a whole number, not {value!r}") from None


class ProductOperator(LinearOperator):  # type: ignore[misc]
    """Y, or one channel of it, as TransferOperator says."""

    def __init__(self, data: "TransferData", channel: Optional[int], dtype: npt.DTypeLike) -> None:
        size = data.patch_count * (3 if channel is None else 1)
        self._data = data
        self._channel = channel
        super().__init__(np.dtype(dtype), (size, size))

    def __matmul__(self, x: Any) -> Any:
        # Without the checks of LinearOperator, which take longer than a small product.
        if type(x) is np.ndarray and 1 <= x.ndim <= 2 and x.shape[0] == self.shape[1]:
            return self._data._core.apply(x, False, self._channel)
        return super().__matmul__(x)

    def _matmat(self, x: Array) -> Array:
        return self._data._core.apply(x, False, self._channel)

    def _rmatmat(self, x: Array) -> Array:
        return self._data._core.apply(x, True, self._channel)

    _matvec = _matmat
    _rmatvec = _rmatmat


class TransferOperator(ProductOperator):
    """Y = F (I - rho F)^-1: takes initial exitance in lx to indirect irradiance in lx.

    Shape [3n, 3n], channel by channel: entry c n + i is channel c of patch i. `op @ x` for x [3n] or
    [3n, k]; float32 stays float32. Columns (hours, lamps) go through together, without copies of x
    where they lie one after the other in memory (order="F"); the result lies as x does.
    `op.H` is the adjoint, A Y A^-1 with the areas A. `op.channel(c)` is one channel, [n, n]. Products
    raise ValueError if x has a number that is not finite.
    """

    def __init__(self, data: "TransferData", dtype: npt.DTypeLike = np.float32) -> None:
        super().__init__(data, None, dtype)

    @property
    def bound(self) -> float:
        """A bound of the relative error of indirect light: no more than one in 80 of further lights of
        a kind exceed it, with 95 % confidence (one in five where nothing is compressed)."""
        return float(self._data.record["error_bound"])

    @property
    def error(self) -> float:
        """The relative area-weighted L2 error of indirect light that was measured, in the mean."""
        return float(self._data.record["error_mean"])

    @property
    def tolerance(self) -> float:
        """The error that was asked for."""
        return float(self._data.record["tolerance"])

    def channel(self, c: int) -> "ChannelOperator":
        """One channel, 0 to 2, as an operator of shape [n, n]. Raises ValueError for another."""
        if c not in (0, 1, 2):
            raise ValueError(f"channels are 0, 1 and 2, not {c}")
        return ChannelOperator(self._data, c, self.dtype)


class ChannelOperator(ProductOperator):
    """One channel of Y, of shape [n, n].

    Three columns cost what one column of all channels does; so does a single one alone, since the
    channels share most of the operator.
    """


class FormFactorOperator(LinearOperator):  # type: ignore[misc]
    """F of shape [n, n]: F[i, j] is the fraction of the light of patch i that arrives at patch j.

    Raises Error where the data keep no form factors; see precompute(form_factors=...). Products raise
    ValueError if x has a number that is not finite.
    """

    def __init__(self, data: "TransferData", dtype: npt.DTypeLike = np.float32) -> None:
        self._data = data
        self._core = _core.FormFactors(data._core)
        super().__init__(np.dtype(dtype), (data.patch_count, data.patch_count))

    def _apply(self, x: Array, adjoint: bool) -> Array:
        if np.iscomplexobj(x):
            raise ValueError("light must be real, not complex")
        dtype = np.float32 if x.dtype == np.float32 else np.float64
        return self._core.gather(_block(x, self.shape[0], dtype), adjoint)

    def _matvec(self, x: Array) -> Array:
        return self._apply(x, False).reshape(x.shape)

    def _rmatvec(self, x: Array) -> Array:
        return self._apply(x, True).reshape(x.shape)

    def _matmat(self, x: Array) -> Array:
        return self._apply(x, False)

    def _rmatmat(self, x: Array) -> Array:
        return self._apply(x, True)

    def tocsr(self, threshold: float = 0.0) -> "scipy.sparse.csr_matrix":
        """F as a sparse matrix of float64, of pairs with a factor of at least `threshold` either way.

        Raises Error unless the data were made with form_factors="exact".
        """
        indptr, indices, exchange = self._data._core.exchange()
        upper = scipy.sparse.csr_matrix(
            (exchange.astype(np.float64), indices.astype(np.int32), indptr.astype(np.int64)),
            shape=self.shape,
        )
        area = self._data.area.astype(np.float64)
        if threshold > 0:
            pairs = upper.tocoo()
            kept = pairs.data / np.minimum(area[pairs.row], area[pairs.col]) >= threshold
            upper = scipy.sparse.csr_matrix(
                (pairs.data[kept], (pairs.row[kept], pairs.col[kept])), shape=self.shape
            )
        diagonal = scipy.sparse.diags(upper.diagonal())
        return scipy.sparse.csr_matrix(scipy.sparse.diags(1 / area) @ (upper + upper.T - diagonal))

    def toarray(self) -> Array:
        """F as an array [n, n] of float64."""
        if self._data._core.exchange_is_stored:
            return np.asarray(self.tocsr().toarray())
        return np.asarray(self @ np.eye(self.shape[0]))


class TransferData:
    """What precompute makes and files hold: patches, the operator, form factors on request.

    `record` says how: "scene", "tolerance", "error_mean", "error_max" and "error_bound" of the
    indirect light, relative; "residual" of the operator; "operator" and "operator_bytes";
    "materials", their names in order; "settings" and "report" of the build.
    """

    def __init__(self, core: "_core.Data", ids: Optional[npt.NDArray[np.int64]] = None) -> None:
        self._core = core
        self._ids = ids
        self._patches: Dict[str, Array] = core.patches()
        self.record: Dict[str, Any] = core.record()
        self.record["settings"] = json.loads(self.record["settings"] or "{}")
        self.record["report"] = json.loads(self.record["report"] or "{}")

    @property
    def patch_count(self) -> int:
        """n, the number of patches."""
        return self._core.patch_count

    @property
    def area(self) -> npt.NDArray[np.float32]:
        """[n] m²; a view, as all arrays here but patch_ids."""
        return self._patches["area"]

    @property
    def centroid(self) -> npt.NDArray[np.float32]:
        """[n, 3] metres."""
        return self._patches["centroid"]

    @property
    def normal(self) -> npt.NDArray[np.float32]:
        """[n, 3] of unit length."""
        return self._patches["normal"]

    @property
    def reflectance(self) -> npt.NDArray[np.float32]:
        """[n, 3] in [0, 1)."""
        return self._patches["reflectance"]

    @property
    def emitted_exitance(self) -> npt.NDArray[np.float32]:
        """[n, 3] lx: pi times the luminance that a patch emits."""
        return self._patches["emitted_exitance"]

    @property
    def sky_visibility(self) -> npt.NDArray[np.float32]:
        """[n] fraction of the light of a patch that leaves the scene."""
        return self._patches["sky_visibility"]

    @property
    def absorbed(self) -> npt.NDArray[np.float32]:
        """[n] fraction of the light of a patch that meets backs."""
        return self._patches["absorbed"]

    @property
    def mesh(self) -> Dict[str, Any]:
        """What is shown: `position` [v, 3], `triangle` [t, 3], `triangle_patch` and
        `triangle_material` [t]; a triangle without a patch has 4294967295. The first
        `surface_count` triangles stop light, the others are their backs."""
        return self._core.mesh()

    @property
    def patch_ids(self) -> npt.NDArray[np.int64]:
        """[n] the id of each patch, of a Scene made with ids: that of most of its triangles.

        Raises ValueError for data of a file: ids are not kept in files.
        """
        if self._ids is None:
            raise ValueError("there are ids only where precompute was given a Scene made of arrays")
        mesh = self.mesh
        patch, material = mesh["triangle_patch"], mesh["triangle_material"]
        corner = mesh["position"][mesh["triangle"]].astype(np.float64)
        area = np.linalg.norm(
            np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
        )
        known = patch < self.patch_count
        weight = scipy.sparse.csr_matrix(
            (area[known], (patch[known], material[known])),
            shape=(self.patch_count, len(self._ids)),
        )
        result: npt.NDArray[np.int64] = self._ids[np.asarray(weight.argmax(axis=1)).ravel()]
        return result

    @property
    def transfer(self) -> TransferOperator:
        """Y, [3n, 3n]."""
        return TransferOperator(self)

    @property
    def form_factors(self) -> FormFactorOperator:
        """F, [n, n]. Raises Error unless the data keep form factors."""
        return FormFactorOperator(self)

    @property
    def has_form_factors(self) -> bool:
        """Whether the data keep form factors, for solve() and `form_factors`."""
        return self._core.has_form_factors

    def __repr__(self) -> str:
        return (
            f"<rebounce.TransferData {self.record['scene']}: {self.patch_count} patches, "
            f"{self.record['operator']}, {self.record['operator_bytes']} bytes>"
        )


def precompute(
    scene: Union[Scene, Path],
    patches: int = 4096,
    tolerance: float = 0.005,
    form_factors: Optional[str] = None,
    *,
    patch_size: Optional[float] = None,
    lights: Optional[Sequence[Light]] = None,
    quality: str = "default",
    operator: str = "hierarchical",
    links: bool = False,
    seed: int = 1,
    progress: Progress = None,
) -> TransferData:
    """The offline stage.

    scene: a Scene, or the path of a .glb or .gltf file.
    patches: wanted number of patches, at least 1. patch_size: their largest length, metres, above 0;
        in place of `patches`.
    lights: the scene's own lamps, in place of those of the file. Patches are finer where their
        light varies.
    tolerance: error of the indirect light that the operator may have in the mean, in [1e-5, 0.5].
    form_factors: None, "compressed" (to the tolerance) or "exact" (all pairs), for `solve` and
        TransferData.form_factors.
    quality: of form factors, "low", "default" (0.5 %) or "high" (0.1 %).
    operator: "hierarchical", "low-rank" or "dense".
    links: keep links, for solve(method="hierarchical").
    seed: of the sample points, in [0, 2^64); every seed gives equally good form factors.
    progress: None for a bar on terminals and in notebooks, True or False for one always or never, or
        a function of (phase, fraction in [0, 1]); what it raises ends the work.
    Compare `record["error_mean"]` with the tolerance: data that miss it are returned all the same.
    Raises Error if the scene cannot be used, ValueError if a setting is out of range,
    KeyboardInterrupt on Ctrl-C.
    """
    if form_factors not in (None, "compressed", "exact"):
        raise ValueError(f'form_factors is None, "compressed" or "exact", not {form_factors!r}')
    if quality not in ("low", "default", "high"):
        raise ValueError(f'quality is "low", "default" or "high", not {quality!r}')
    if operator not in ("hierarchical", "low-rank", "dense"):
        raise ValueError(f'operator is "hierarchical", "low-rank" or "dense", not {operator!r}')
    patches, seed = _whole(patches, "patches"), _whole(seed, "seed")
    if patches < 1:
        raise ValueError("patches must be at least 1")
    if patch_size is not None and not patch_size > 0:
        raise ValueError("patch_size must be above 0")
    if not 0 <= seed < 1 << 64:
        raise ValueError("seed is not in [0, 2^64)")
    if not 1e-5 <= tolerance <= 0.5:
        raise ValueError("tolerance is not in [1e-5, 0.5]")
    if not isinstance(scene, Scene):
        from .scene import load_scene

        scene = load_scene(scene)
    options: Dict[str, Any] = {
        "patches": patches,
        "tolerance": tolerance,
        "quality": quality,
        "operator": operator,
        "seed": seed,
        "store_form_factors": form_factors == "exact",
        "store_links": links,
        "form_factor_tolerance": tolerance if form_factors == "compressed" else 0.0,
    }
    if patch_size is not None:
        options["patch_size"] = patch_size
    if lights is not None:
        options["lights"] = list(lights)
    with reporting(progress) as report:
        core, warnings = _core.build(scene._core, options, report)
    for warning in warnings:
        log.warning("%s", warning)
    data = TransferData(core, scene._ids)
    log.info("%r", data)
    return data


def load(path: Path) -> TransferData:
    """Reads a transfer file. It must not change while the data are in use. Raises Error."""
    return TransferData(_core.load(os.fspath(path)))


def save(path: Path, data: TransferData) -> None:
    """Writes a transfer file whole or not at all. Raises Error."""
    _core.save(os.fspath(path), data._core)
