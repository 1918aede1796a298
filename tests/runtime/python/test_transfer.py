"""Scenes, transfer data and operators."""

import inspect
import logging

import numpy as np
import pytest
import scipy.sparse.linalg

import rebounce
from conftest import SCENE, box, triangles_of


# SciPy 1.12 has another name for it.
_TOLERANCE = "rtol" if "rtol" in inspect.signature(scipy.sparse.linalg.gmres).parameters else "tol"
RELATIVE = {_TOLERANCE: 1e-6, "atol": 0}


def relative(a, b):
    return np.linalg.norm(a - b) / np.linalg.norm(b)


def test_scene_of_arrays_keeps_ids_and_values(small_room):
    assert set(small_room.patch_ids) == set(range(10, 16))
    assert small_room.area.sum() == pytest.approx(24, rel=1e-5)
    assert np.allclose(small_room.reflectance, [0.5, 0.6, 0.7])
    assert small_room.sky_visibility.max() < 1e-5
    for face in range(6):
        mine = small_room.patch_ids == 10 + face
        assert small_room.area[mine].sum() == pytest.approx(4, rel=1e-5)


def test_large_ids_stay_apart():
    vertices, faces = box()
    scene = rebounce.Scene(vertices, triangles_of(faces)[:3], ids=[2**53 + 1, 2**53, -1])
    assert list(scene._ids) == [-1, 2**53, 2**53 + 1]


def test_file_and_arrays_of_a_scene():
    scene = rebounce.load_scene(SCENE)
    assert scene.triangles.max() < len(scene.vertices)
    assert scene.vertices.dtype == np.float32 and not scene.vertices.flags.writeable
    assert "triangles" in repr(scene)


def test_wrong_shapes_are_value_errors(small_room):
    vertices, faces = box()
    with pytest.raises(ValueError, match=r"\[v, 3\]"):
        rebounce.Scene(vertices[:, :2], triangles_of(faces))
    with pytest.raises(ValueError, match="not there"):
        rebounce.Scene(vertices, [[0, 1, 8]])
    for broken in ([[0, 1, 2.7]], [[0, 1, float("nan")]]):
        with pytest.raises(ValueError, match="triangles must be whole numbers"):
            rebounce.Scene(vertices, broken)
    for ids in ([0.5], [1 << 63]):
        with pytest.raises(ValueError, match="ids must be whole numbers"):
            rebounce.Scene(vertices, [[0, 1, 2]], ids=ids)
    with pytest.raises(ValueError, match="reflectance has the shape"):
        rebounce.Scene(vertices, triangles_of(faces), reflectance=np.ones((5, 3)))
    with pytest.raises(ValueError, match="reflectance is not in"):
        rebounce.Scene(vertices, triangles_of(faces), reflectance=1.5)
    with pytest.raises(ValueError):
        small_room.transfer @ np.ones(7, np.float32)
    with pytest.raises(ValueError, match="form_factors is None"):
        rebounce.precompute(SCENE, form_factors="all")
    with pytest.raises(ValueError, match="tolerance"):
        rebounce.precompute(SCENE, tolerance=2)
    for size in (0, -1, float("nan")):
        with pytest.raises(ValueError, match="patch_size must be above 0"):
            rebounce.precompute(SCENE, patch_size=size)
    with pytest.raises(ValueError, match="operator is .*, not 'exact'"):
        rebounce.precompute(SCENE, operator="exact")
    with pytest.raises(ValueError, match="patches must be a whole number, not 100.5"):
        rebounce.precompute(SCENE, patches=100.5)
    for seed in (-1, 1 << 64):
        with pytest.raises(ValueError, match="seed is not in"):
            rebounce.precompute(SCENE, seed=seed)
    with pytest.raises(ValueError, match="channels are"):
        small_room.transfer.channel(3)


def test_errors_are_one_line(tmp_path, small_room):
    with pytest.raises(rebounce.Error) as error:
        rebounce.load_scene(tmp_path / "none.glb")
    assert "\n" not in str(error.value)
    with pytest.raises(rebounce.Error):
        rebounce.load(tmp_path / "none.safetensors")
    bare = rebounce.precompute(SCENE, patches=60, quality="low", progress=False)
    assert not bare.has_form_factors
    with pytest.raises(rebounce.Error, match="form factors"):
        bare.form_factors


def test_patches_are_finer_in_the_light_of_the_lamps_of_the_scene():
    vertices, faces = box(high=(4, 4, 4))
    scene = rebounce.Scene(vertices, triangles_of(faces), reflectance=0.5)
    lamp = rebounce.Light(position=(1, 0.5, 1), intensity=10)

    def largest_below_lamp(lights):
        data = rebounce.precompute(
            scene, patches=300, lights=lights, quality="low", tolerance=0.05, progress=False
        )
        assert data.patch_count == pytest.approx(300, rel=0.03)
        return data.area[np.linalg.norm(data.centroid - (1, 0, 1), axis=1) < 0.8].max()

    assert 2 * largest_below_lamp([lamp]) < largest_below_lamp(None)
    bad = rebounce.Light(position=(1, float("nan"), 1))
    with pytest.raises(rebounce.Error, match="light 0"):
        rebounce.precompute(scene, patches=100, lights=[bad], progress=False)


def test_save_and_load(tmp_path, cornell):
    path = tmp_path / "box.safetensors"
    rebounce.save(path, cornell)
    again = rebounce.load(path)
    x = np.random.default_rng(1).random(3 * cornell.patch_count, np.float32)
    assert np.array_equal(again.transfer @ x, cornell.transfer @ x)
    assert again.record["error_bound"] == cornell.record["error_bound"]


def test_transfer_is_the_inverse_of_form_factors(small_room):
    """Y = F (I - rho F)^-1, channel by channel."""
    F = small_room.form_factors.toarray()
    n = len(F)
    whole = small_room.transfer
    for c in range(3):
        rho = small_room.reflectance[:, c].astype(float)
        Y = F @ np.linalg.inv(np.eye(n) - rho[:, None] * F)
        assert relative(whole.channel(c) @ np.eye(n), Y) < 1e-5
        x = np.zeros(3 * n)
        x[c * n : (c + 1) * n] = 1
        assert relative((whole @ x)[c * n : (c + 1) * n], Y.sum(axis=1)) < 1e-5


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_operators_are_linear_with_an_adjoint(cornell, dtype):
    random = np.random.default_rng(2)
    operators = [cornell.transfer, cornell.transfer.channel(1), cornell.form_factors]
    for op in operators:
        x, y = random.random((2, op.shape[1])).astype(dtype)
        assert (op @ x).dtype == dtype
        assert (op @ x).shape == x.shape
        assert np.dot(op @ x, y) == pytest.approx(np.dot(x, op.H @ y), rel=1e-4)
        many = random.random((op.shape[1], 37)).astype(dtype)
        together = op @ many
        assert together.shape == many.shape and together.dtype == dtype
        for k in (0, 15, 16, 36):
            assert relative(op @ many[:, k], together[:, k]) < 1e-5
        assert relative(op @ np.asfortranarray(many), together) < 1e-6
        assert relative(op @ (2 * x), 2 * (op @ x)) < 1e-5


def test_products_of_every_layout(cornell):
    """Any order, type and number of columns, of all channels and of one: the same light."""
    random = np.random.default_rng(5)
    n = cornell.patch_count
    area = np.tile(cornell.area, 3)[:, None]
    whole = cornell.transfer
    Y = whole @ np.eye(3 * n, dtype=np.float32)
    for op, part in [(whole, slice(None))] + [
        (whole.channel(c), slice(c * n, (c + 1) * n)) for c in range(3)
    ]:
        for columns in (0, 1, 2, 3, 5, 12, 16, 17, 70):
            x = random.random((op.shape[1], columns), np.float32)
            wanted = Y[part, part].astype(float) @ x
            for same in (x, np.asfortranarray(x), x.astype(float), x[::-1].copy()[::-1],
                         np.repeat(x, 2, axis=1)[:, ::2]):  # fmt: skip
                product = op @ same
                assert product.shape == x.shape and product.dtype == same.dtype
                if columns > 0:
                    assert relative(product, wanted) < 1e-3
                if columns > 1 and (same.flags.c_contiguous or same.flags.f_contiguous):
                    assert product.flags.c_contiguous == same.flags.c_contiguous
            if columns > 0:
                adjoint = area[part] * (Y[part, part].astype(float) @ (x / area[part]))
                assert relative(op.H @ x, adjoint) < 1e-3
    assert relative(whole @ np.ones(3 * n, int), whole @ np.ones(3 * n)) == 0
    for wrong in (np.ones(n), np.ones((n, 2)), np.ones((1, 3 * n)), np.array(["light"] * 3 * n)):
        with pytest.raises(ValueError):
            whole @ wrong
    for op in (whole, whole.H, whole.channel(0), cornell.form_factors, cornell.form_factors.H):
        with pytest.raises(ValueError, match="light must be real, not complex"):
            op @ np.full(op.shape[1], 1 + 1j)
        for dtype in (np.float32, np.float64):
            light = np.ones(op.shape[1], dtype)
            light[5] = np.nan
            with pytest.raises(ValueError, match="light has a number that is not finite"):
                op @ light


def test_operators_work_in_solvers(small_room):
    """(I - rho F) B = M0 by gmres, and lamps found from light by lsqr."""
    n = small_room.patch_count
    F = small_room.form_factors
    rho = small_room.reflectance[:, 0].astype(float)
    system = scipy.sparse.linalg.LinearOperator((n, n), lambda b: b - rho * (F @ b), dtype=float)
    M0 = np.random.default_rng(3).random(n)
    B, info = scipy.sparse.linalg.gmres(system, M0, **RELATIVE)
    assert info == 0
    assert relative(B, M0 + rho * (small_room.transfer.channel(0) @ M0)) < 1e-4
    op = small_room.transfer.channel(0)
    # I + rho Y is the inverse of that system; SciPy puts it together.
    inverse = scipy.sparse.linalg.aslinearoperator(scipy.sparse.identity(n)) + (
        scipy.sparse.linalg.aslinearoperator(scipy.sparse.diags(rho)) @ op
    )
    again, info = scipy.sparse.linalg.gmres(inverse, B, **RELATIVE)
    assert info == 0
    assert relative(again, M0) < 1e-3
    found = scipy.sparse.linalg.lsqr(op, op @ M0, atol=1e-9, btol=1e-9, iter_lim=2000)[0]
    assert relative(op @ found, op @ M0) < 1e-3


def test_form_factors_as_matrices(small_room, cornell):
    F = small_room.form_factors
    dense, sparse = F.toarray(), F.tocsr()
    assert np.array_equal(sparse.toarray(), dense)
    area = small_room.area.astype(float)
    assert np.allclose(area[:, None] * dense, (area[:, None] * dense).T, rtol=1e-12, atol=0)
    assert np.allclose(dense.sum(axis=1), 1, atol=1e-4)
    fewer = F.tocsr(threshold=0.01)
    assert fewer.nnz < sparse.nnz and abs(fewer - sparse).max() < 0.01 * 4
    x = np.random.default_rng(4).random(cornell.patch_count)
    assert relative(cornell.form_factors @ x, cornell.form_factors.tocsr() @ x) < 1e-5
    compressed = rebounce.precompute(
        SCENE, patches=100, form_factors="compressed", quality="low", progress=False
    )
    assert compressed.form_factors.toarray().shape == (compressed.patch_count,) * 2
    with pytest.raises(rebounce.Error, match='form_factors="exact"'):
        compressed.form_factors.tocsr()


def test_bound_and_error(cornell):
    op = cornell.transfer
    assert 0 < op.error <= op.bound < 0.2
    assert op.error <= op.tolerance == 0.005


def test_progress_and_logging(caplog):
    calls = []
    with caplog.at_level(logging.INFO, "rebounce"):
        rebounce.precompute(
            SCENE, patches=60, quality="low", progress=lambda phase, done: calls.append((phase, done))
        )
    assert calls and all(0 <= done <= 1 for _, done in calls)
    assert len({phase for phase, _ in calls}) > 2
    assert any("patches" in record.message for record in caplog.records)


def test_exceptions_of_progress_stop_the_work():
    def stop(phase, done):
        raise LookupError(phase)

    with pytest.raises(LookupError):
        rebounce.precompute(SCENE, patches=60, progress=stop)
