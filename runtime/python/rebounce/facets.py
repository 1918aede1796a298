"""View factors between polygons as they are given."""

import os
from typing import Any, Iterable, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt
import scipy.sparse

from . import _core
from ._progress import Progress, log, reporting

Doubles = npt.NDArray[np.float64]
Facets = Union[Sequence[Sequence[int]], npt.NDArray[Any]]


class ViewFactors(NamedTuple):
    """What view_factors() gives: `F, sky = result[:2]`, or by name."""

    F: "scipy.sparse.csr_matrix"  #: [m, m] of float64
    sky: Doubles  #: [m] fraction of the light of each facet that meets nothing
    blocked: Doubles  #: [m] fraction that meets backs and obstructions
    area: Doubles  #: [m] in the square of the unit of the vertices
    raw_row_sum: Doubles  #: [m] row sums before the correction
    raw_sky: Doubles  #: [m] the sky by rays, measured apart from the rows


class _Pair(NamedTuple):
    F: "scipy.sparse.csr_matrix"
    sky: Doubles


def _corner_lists(facets: Facets) -> Tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    if isinstance(facets, np.ndarray):
        if facets.ndim != 2:
            raise ValueError(f"facets have the shape {list(facets.shape)}, and need [m, corners]")
        lists: Iterable[Any] = list(facets)
    else:
        lists = facets
    counts, corners = [0], []
    for number, facet in enumerate(lists):
        index = np.asarray(facet)
        if index.ndim != 1 or (index.size and index.dtype.kind not in "iu"):
            raise ValueError(f"facet {number} is no list of whole numbers")
        if index.size and index.min() < 0:
            raise ValueError(f"facet {number} names a vertex below 0")
        if index.size and int(index.max()) >= 1 << 32:
            raise ValueError(f"facet {number} names a vertex that is not there: {index.max()}")
        corners.append(index)
        counts.append(index.size)
    joined = np.concatenate(corners) if corners else np.zeros(0)
    return np.cumsum(counts).astype(np.uint32), joined.astype(np.uint32)


def view_factors_report(
    vertices: npt.ArrayLike,
    facets: Facets,
    quality: str = "default",
    obstructions: Optional[Facets] = None,
    *,
    closed: bool = False,
    seed: int = 1,
    progress: Progress = None,
) -> ViewFactors:
    """As view_factors(), with all that is known of the rows. Raises what that does."""
    if quality not in ("low", "default", "high"):
        raise ValueError(f'quality is "low", "default" or "high", not {quality!r}')
    points = np.ascontiguousarray(vertices, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"vertices have the shape {list(points.shape)}, and need [v, 3]")
    begin, corners = _corner_lists(facets)
    count = len(begin) - 1
    obstructs = np.zeros(count, np.uint8)
    if obstructions is not None:
        more_begin, more = _corner_lists(obstructions)
        begin = np.concatenate([begin, begin[-1] + more_begin[1:]]).astype(np.uint32)
        corners = np.concatenate([corners, more])
        obstructs = np.concatenate([obstructs, np.ones(len(more_begin) - 1, np.uint8)])
    with reporting(progress) as report:
        found = _core.view_factors(
            points, begin, corners, obstructs, quality, closed, seed, report
        )
    log.info("%d facets, %d rays, %d view factors", count, found["ray_count"], len(found["data"]))
    matrix = scipy.sparse.csr_matrix(
        (found["data"], found["indices"].view(np.int32), found["indptr"]),
        shape=(len(begin) - 1, len(begin) - 1),
    )
    if obstructions is not None:
        matrix = matrix[:count, :count]
    rows = (found[name][:count] for name in ("sky", "blocked", "area", "raw_row_sum", "raw_sky"))
    return ViewFactors(matrix, *rows)


def view_factors(
    vertices: npt.ArrayLike,
    facets: Facets,
    quality: str = "default",
    obstructions: Optional[Facets] = None,
    *,
    closed: bool = False,
    seed: int = 1,
    progress: Progress = None,
) -> Tuple["scipy.sparse.csr_matrix", Doubles]:
    """View factors between flat facets, and what each sees of the sky.

    vertices: [v, 3] in any unit of length.
    facets: m lists of vertex indices, or [m, corners]: counter-clockwise seen from the front, the
        one side that exchanges light. The back stops light.
    quality: "low", "default" (0.5 % of closed forms) or "high" (0.1 %, ten times as long).
    obstructions: further facets that only stop light, on both sides.
    closed: the facets are an enclosure, whose rows add up to 1.
    seed: of the rays; every seed gives equally good factors.
    Returns F [m, m], a csr_matrix of float64, and sky [m]. F[i, j] is the fraction of the light of i
    that arrives at j; area[i] F[i, j] = area[j] F[j, i], and rows and sky add up to 1 but for what
    meets backs and obstructions (view_factors_report(...).blocked).
    Raises ValueError if a shape does not fit, Error, with the number of the facet counted from 1, if
    one cannot be used.

    >>> from rebounce import view_factors
    >>> square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    >>> above = [(x, y, 1) for x, y, _ in square]
    >>> F, sky = view_factors(square + above, [[0, 1, 2, 3], [7, 6, 5, 4]])
    >>> print(f"{F[0, 1]:.3f} {sky[0]:.3f}")
    0.200 0.800
    """
    found = view_factors_report(
        vertices, facets, quality, obstructions, closed=closed, seed=seed, progress=progress
    )
    return _Pair(found.F, found.sky)


def exchange_factors(
    F: "scipy.sparse.spmatrix",
    sky: npt.ArrayLike,
    area: npt.ArrayLike,
    emissivity: npt.ArrayLike,
    *,
    progress: Progress = None,
) -> Tuple[npt.NDArray[np.float32], Doubles]:
    """Exchange (Gebhart) factors of facets with view factors F [m, m], sky [m] and area [m].

    emissivity: in [0.01, 1], a number or [m].
    Returns G [m, m]: the fraction of what i emits that j absorbs after all reflections, and [m] the
    fraction that leaves in the end. Memory grows with m², time with m³. Raises ValueError if a shape
    does not fit, Error if a number is out of range, or area[i] F[i, j] = area[j] F[j, i] does not
    hold to four digits.
    """
    matrix = scipy.sparse.csr_matrix(F, dtype=np.float64, copy=True)
    matrix.sum_duplicates()
    count = matrix.shape[0]
    if matrix.shape != (count, count):
        raise ValueError(f"F has the shape {list(matrix.shape)}, and needs [{count}, {count}]")
    arrays = []
    for name, values in (("sky", sky), ("area", area), ("emissivity", emissivity)):
        array = np.asarray(values, dtype=np.float64)
        if array.shape not in ((), (count,)):
            raise ValueError(f"{name} has the shape {list(array.shape)}, and needs [{count}]")
        arrays.append(np.ascontiguousarray(np.broadcast_to(array, (count,))))
    with reporting(progress) as report:
        factors, lost = _core.exchange_factors(
            matrix.indptr.astype(np.int64),
            matrix.indices.astype(np.uint32),
            matrix.data,
            arrays[1],
            arrays[0],
            arrays[2],
            report,
        )
    return factors.reshape(count, count), lost


def read_facets(path: Union[str, "os.PathLike[str]"]) -> Tuple[Doubles, Any, Any]:
    """The facets of an .stl, .obj or .vs3 file: vertices [v, 3], facets and obstructions as lists of
    indices from 0. Raises Error, with the line, if the file cannot be used."""
    points, begin, corners, obstructs, _ = _core.read_facets(os.fspath(path))
    lists = [part.tolist() for part in np.split(corners, begin[1:-1])]
    only = obstructs if len(obstructs) else np.zeros(len(lists), np.uint8)
    return (
        points.reshape(-1, 3),
        [facet for facet, stops in zip(lists, only) if not stops],
        [facet for facet, stops in zip(lists, only) if stops],
    )
