import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from core import Cancelled, InputError, MissingDependency, Settings, SettingsError, reconstruct
from core.normals.energy_torch import torch_device
from core.normals.estimate import checked_constraints, estimate_normals
from core.normals.pca import pca_normals
from core.points import local_spacing
from tests import shapes

NUMPY = Settings(resolution=16, solver="energy", backend="numpy", surface="none")
POINTS = shapes.torus(500)


def degrees(a, b):
    return np.degrees(np.arccos(np.minimum(np.abs(np.einsum("ni,ni->n", a, b)), 1.0)))


@pytest.mark.parametrize("solver", ["reflection", "energy", "pca"])
def test_every_solver_finds_a_sphere_and_holds_constraints(solver):
    points = shapes.sphere(400)
    held, given = np.array([3, 77]), np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0]])
    settings = Settings(solver=solver, backend="numpy")
    free, confidence, _ = estimate_normals(points, local_spacing(points), settings)
    assert degrees(free, points).max() < 8
    assert degrees(free, points).mean() < 2
    assert ((confidence >= 0) & (confidence <= 1)).all()
    normals, *_ = estimate_normals(points, local_spacing(points), settings, (held, given))
    assert normals[held].tobytes() == given.tobytes()


def test_a_dense_ball_beside_sparse_points_has_its_own_normals():
    """Facets between it and those are as large as theirs."""
    plane, ball = shapes.square(400), shapes.scattered_sphere(300, 1)
    points = np.concatenate([plane, 0.001 * ball + [0.02, 0.03, 0.0012]])
    normals, confidence, _ = estimate_normals(points, local_spacing(points))
    assert degrees(normals[400:], ball).max() < 5
    assert np.median(confidence[400:]) > 0.99


def test_a_point_that_occurs_twice_is_refused():
    points = np.concatenate([POINTS, POINTS[:1]])
    with pytest.raises(InputError, match="occur twice"):
        estimate_normals(points, local_spacing(points))


def test_energy_solver_goes_through_the_whole_method():
    result = reconstruct(POINTS, NUMPY)
    report = result.report["normals"]
    ring = POINTS * [1, 1, 0] / np.linalg.norm(POINTS[:, :2], axis=1, keepdims=True)
    assert degrees(result.normals, (POINTS - ring) / 0.4).mean() < 4
    assert report["backend"] == "numpy"
    assert report["energy"][0] > 1.05 * min(report["energy"]) > 0
    assert report["bisector_samples"] > report["facets"] > 500


def test_energy_solver_reports_progress_and_cancels():
    seen = []
    reconstruct(POINTS, NUMPY, progress=lambda fraction, text: seen.append((fraction, text)))
    inside = [fraction for fraction, text in seen if text == "normals"]
    assert len(inside) > 20
    assert inside == sorted(inside)
    with pytest.raises(Cancelled, match="normals"):
        reconstruct(POINTS, NUMPY, progress=lambda fraction, text: fraction < 0.125)


def test_energy_solver_is_deterministic():
    first, again = (estimate_normals(POINTS, local_spacing(POINTS), NUMPY)[0] for _ in range(2))
    assert first.tobytes() == again.tobytes()


def test_torch_gives_the_normals_of_numpy():
    pytest.importorskip("torch")
    spacing = local_spacing(POINTS)
    by_numpy, _, _ = estimate_normals(POINTS, spacing, NUMPY)
    by_torch, _, report = estimate_normals(POINTS, spacing, Settings(solver="energy", backend="torch"))
    auto = estimate_normals(POINTS, spacing, Settings(solver="energy"))[2]
    assert np.median(degrees(by_numpy, by_torch)) < 0.5
    assert report["backend"] == auto["backend"] == "torch"
    assert report["device"] in {"cpu", "cuda"}


def test_missing_torch_is_an_error_when_asked_for_and_numpy_otherwise(monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    spacing = local_spacing(POINTS)
    with pytest.raises(MissingDependency, match="pip install torch"):
        estimate_normals(POINTS, spacing, Settings(solver="energy", backend="torch"))
    assert estimate_normals(POINTS, spacing, Settings(solver="energy"))[2]["backend"] == "numpy"


def test_a_gpu_is_used_where_there_is_one_and_refused_where_not(monkeypatch):
    cuda = pytest.importorskip("torch").cuda
    monkeypatch.setattr(cuda, "is_available", lambda: False)
    assert (torch_device("auto"), torch_device("cpu")) == ("cpu", "cpu")
    spacing = local_spacing(POINTS)
    estimate_normals(POINTS, spacing, Settings(device="cuda"))  # has no part in the other solvers
    monkeypatch.setattr("core.normals.estimate.facet_polygons", None)  # before any work is done
    for backend in ("torch", "auto"):
        with pytest.raises(MissingDependency, match=r"sees no Nvidia GPU; .* or use device 'cpu'"):
            estimate_normals(POINTS, spacing, Settings(solver="energy", backend=backend, device="cuda"))
    with pytest.raises(SettingsError, match="'numpy', which uses no GPU"):
        estimate_normals(POINTS, spacing, Settings(solver="energy", backend="numpy", device="cuda"))
    monkeypatch.setattr(cuda, "is_available", lambda: True)
    assert (torch_device("auto"), torch_device("cuda"), torch_device("cpu")) == ("cuda", "cuda", "cpu")


@pytest.mark.parametrize("settings", ["solver='reflection'", "solver='energy', backend='numpy'"])
def test_torch_is_not_imported_unless_asked_for(settings):
    script = f"""
import sys
from core import Settings, reconstruct
from tests.shapes import sphere
reconstruct(sphere(60), Settings(resolution=16, surface="none", {settings}))
print("torch" in sys.modules)
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, cwd=Path(__file__).parents[3], check=True
    )
    assert done.stdout.strip() == "False"


def test_constraints_are_given_by_rows_of_the_input():
    given = [5, 2, 9], [[0, 0, 2], [3e200, 0, 4e200], [1, 0, 0]]
    (rows, axes), warnings = checked_constraints(given, np.array([0, 2, 5, 7]), 10)
    assert rows.tolist() == [2, 1]
    np.testing.assert_allclose(axes, [[0, 0, 1], [0.6, 0, 0.8]])
    assert warnings == ("1 of 3 constraints ignored: their points were dropped",)
    assert checked_constraints(None, np.arange(3), 3) == (None, ())


def test_constraints_on_dropped_points_are_reported():
    points = np.vstack([[[np.nan, 0, 0]], shapes.sphere(200)])
    result = reconstruct(points, Settings(resolution=16, surface="none"), ([0, 1], [[0, 0, 1], [1, 0, 0]]))
    np.testing.assert_array_equal(result.normals[0], [1, 0, 0])
    assert "1 of 2 constraints ignored: their points were dropped" in result.report["warnings"]


@pytest.mark.parametrize(
    ("constraints", "message"),
    [
        (3, "not \\(indices, axes\\)"),
        (([0], [[1, 0]]), "shapes \\(1,\\) and \\(1, 2\\)"),
        (([0.5], [[1, 0, 0]]), "constraint indices are float64; give whole numbers"),
        ((np.ones(4, bool), [[1, 0, 0]] * 4), r"are bool; .* of a mask what numpy.flatnonzero\(mask\) does"),
        (([0], [[0, 0, 0]]), "no direction"),
        (([0], [[np.nan, 0, 0]]), "no direction"),
        (([0, 1], [[1, 0, 0], [0, np.inf, 0]]), "^1 constraint axes have no direction"),
        (([0, 4], [[1, 0, 0], [0, 1, 0]]), "1 constraints are for rows outside the input, row 4 the first.* 0 to 3"),
        (([-1], [[1, 0, 0]]), "row -1 the first"),
        (([2, 0, 2], [[1, 0, 0], [1, 0, 0], [1, 1, 0]]), "row 2 is constrained to axes that differ"),
    ],
)
def test_unusable_constraints_are_refused(constraints, message):
    with pytest.raises(InputError, match=message):
        checked_constraints(constraints, np.arange(4), 4)


def test_one_axis_may_be_given_twice_whatever_its_sign_and_length():
    (rows, axes), _ = checked_constraints(([2, 2], [[1, 1, 0], [-3, -3, 0]]), np.arange(4), 4)
    np.testing.assert_array_equal(rows, [2, 2])
    np.testing.assert_allclose(np.abs(axes), np.sqrt([[0.5, 0.5, 0]] * 2))


def test_plane_fit_baseline_is_exact_on_a_plane_and_unsure_in_a_volume(random):
    axes, confidence = pca_normals(shapes.square(200))
    np.testing.assert_allclose(np.abs(axes[:, 2]), 1.0)
    np.testing.assert_allclose(confidence, 1.0)
    assert pca_normals(random.random((200, 3)))[1].mean() < 0.8
