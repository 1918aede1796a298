"""View factors of given facets."""

import csv
import json

import numpy as np
import pytest
import scipy.sparse

import rebounce
from conftest import ROOT, box


def cases():
    lines = (ROOT / "tests/reference/view_factors.tsv").read_text().splitlines()
    for row in csv.DictReader((l for l in lines if not l.startswith("#")), delimiter="\t"):
        geometry = json.loads(row["geometry_json"])
        if "A1" in geometry:
            yield pytest.param(geometry["A1"], geometry["A2"], float(row["F12"]), id=row["id"])


@pytest.mark.parametrize("a, b, factor", cases())
def test_agree_with_closed_forms(a, b, factor):
    facets = [list(range(len(a))), list(range(len(a), len(a) + len(b)))]
    F, sky = rebounce.view_factors(a + b, facets, progress=False)
    blocked = rebounce.view_factors_report(a + b, facets, progress=False).blocked
    assert isinstance(F, scipy.sparse.csr_matrix) and F.shape == (2, 2)
    assert F[0, 1] == pytest.approx(factor, rel=5e-3, abs=1e-9)
    assert F[0, 1] + sky[0] + blocked[0] == pytest.approx(1, abs=1e-12)


def test_a_box_is_closed_and_its_exchange_factors_add_up():
    vertices, faces = box(high=(1, 2, 3))
    found = rebounce.view_factors_report(vertices, faces, "low", closed=True)
    F, area = found.F, found.area
    assert np.allclose(F.sum(axis=1), 1, atol=1e-5)
    exchange = scipy.sparse.diags(area) @ F
    assert abs(exchange - exchange.T).max() < 1e-15
    emissivity = np.linspace(0.2, 0.9, 6)
    G, lost = rebounce.exchange_factors(F, found.sky, area, emissivity)
    assert np.allclose(G.sum(axis=1) + lost, 1, atol=1e-4)
    right = np.linalg.solve(np.eye(6) - F.toarray() * (1 - emissivity), F.toarray() * emissivity)
    assert np.allclose(G, right, atol=1e-5)


def test_view_factors_that_cannot_be_are_refused():
    F = np.array([[0, 0.5], [0.25, 0]])
    area, half = np.array([1.0, 2.0]), np.array([0.5, 0.75])

    def exchange(F, area=area):
        return rebounce.exchange_factors(F, half, area, 0.5)[0]

    assert np.array_equal(exchange(F.astype(np.float32)), exchange(F))
    for broken in (F * [[1, 1.1], [1, 1]], F * [[1, 1], [0, 1]]):
        with pytest.raises(rebounce.Error, match="from facet [12] to facet [12] and the one back"):
            exchange(broken)
    for factor in (-0.5, np.nan, np.inf):
        with pytest.raises(rebounce.Error, match="is not a number from 0 on"):
            exchange(np.where(F > 0, factor, 0))
    with pytest.raises(rebounce.Error, match="the area of facet 2 is not a number above 0"):
        exchange(F, np.array([1.0, 0.0]))


def test_exchange_factors_leave_the_matrix_as_it_is():
    """Its columns are in no order, and one entry is in two parts."""
    given = [0.2, 0.25, 0.25, 0.5, 0.2], [2, 1, 1, 0, 0], [0, 3, 4, 5]
    F = scipy.sparse.csr_matrix(given, shape=(3, 3))
    found = rebounce.exchange_factors(F, 0.3, 1.0, 0.5)[0]
    assert [list(part) for part in (F.data, F.indices, F.indptr)] == list(given)
    assert np.array_equal(found, rebounce.exchange_factors(F.toarray(), 0.3, 1.0, 0.5)[0])


def test_obstructions_have_no_row():
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    at = [[(x, y, z) for x, y, _ in square] for z in (0, 0.5, 1)]
    vertices = np.array(at).reshape(-1, 3)
    found = rebounce.view_factors_report(
        vertices, [[0, 1, 2, 3], [11, 10, 9, 8]], "low", obstructions=[[4, 5, 6, 7]]
    )
    assert found.F.shape == (2, 2) and found.sky.shape == (2,)
    assert found.F[0, 1] < 1e-4
    assert found.blocked[0] == pytest.approx(0.415253, abs=4e-3)


def test_wrong_facets_are_refused():
    vertices = np.eye(3)
    with pytest.raises(ValueError, match=r"\[v, 3\]"):
        rebounce.view_factors(vertices[:, :2], [[0, 1, 2]])
    with pytest.raises(ValueError, match="whole numbers"):
        rebounce.view_factors(vertices, [[0.5, 1, 2]])
    with pytest.raises(ValueError, match="below 0"):
        rebounce.view_factors(vertices, [[-1, 1, 2]])
    with pytest.raises(ValueError, match="facet 0 names a vertex that is not there: 4294967296"):
        rebounce.view_factors(vertices, [[1 << 32, 1, 2]])
    with pytest.raises(ValueError, match="quality"):
        rebounce.view_factors(vertices, [[0, 1, 2]], "best")
    with pytest.raises(rebounce.Error, match="facet 1 names vertex 4 of 3"):
        rebounce.view_factors(vertices, [[0, 1, 3]])
    with pytest.raises(rebounce.Error, match="no enclosure"):
        rebounce.view_factors(vertices, [[0, 1, 2]], closed=True)
    with pytest.raises(ValueError, match=r"F has the shape \[2, 3\], and needs \[2, 2\]"):
        rebounce.exchange_factors(np.ones((2, 3)), 0.0, 1.0, 0.5)
    for F, sky, match in (
        ([[0, 1.5], [1.5, 0]], 0.0, "add up to 1.5, above 1"),
        ([[0, 0.5], [0.5, 0]], 0.6, "add up to 1.1, above 1"),
        ([[0, 0.5], [0.5, 0]], np.nan, "sky of facet 1 is not"),
        ([[0, 0.5], [0.5, 0]], -0.1, "sky of facet 1 is not"),
    ):
        with pytest.raises(rebounce.Error, match=match):
            rebounce.exchange_factors(F, sky, 1.0, 0.5)


def test_files_of_facets(tmp_path):
    path = tmp_path / "a.vs3"
    path.write_text("F 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 0 1 0\nS 1 1 2 3 0 0 0 0.9 a\nO 2 3 2 1 0\n")
    vertices, facets, obstructions = rebounce.read_facets(path)
    assert vertices.shape == (3, 3)
    assert facets == [[0, 1, 2]] and obstructions == [[2, 1, 0]]
