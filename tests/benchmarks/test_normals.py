"""The measures behind docs/normals.md on shapes whose normals are known, and the page on made-up numbers."""

import json

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from benchmarks.cases import Case
from benchmarks.normal_cost import exponent, stage_cost
from benchmarks.normal_quality import (
    CURVE_SWEEPS,
    PRINTED,
    Problem,
    best_pca,
    combinations,
    mean_turns,
    rounded_normals,
    surface_problem,
)
from benchmarks.normals import main, verdicts, write_page
from core import Mesh
from core.normals.energy import EnergyWeights
from core.normals.reflection import TOLERANCE, reflection_sweeps
from tests import shapes

TETRAHEDRON = Mesh(
    0.4 * np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]),
    np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], np.int32),
)
NO_CURVE = np.empty((0, 3))


@pytest.fixture
def sphere():
    points = shapes.scattered_sphere(600)
    return Problem.of(points, points)


def tetrahedron_case():
    return Case("tetrahedron", *(np.empty((0, 3)),) * 2, TETRAHEDRON, NO_CURVE, {"category": "watertight"})


def test_points_of_the_surface_come_with_the_normals_of_their_faces():
    problem = surface_problem(tetrahedron_case(), 400)
    height = np.abs(np.einsum("ni,ni->n", problem.normals, problem.given))
    np.testing.assert_allclose(height, 0.4 / np.sqrt(3), rtol=1e-6)


def test_rounded_normals_are_those_of_the_vertices_and_between_them():
    """On a low pyramid, wound at random: upright at the top, between both faces at a corner, and halfway halfway."""
    vertices = np.array([[0, 0, 0.2], [1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    pyramid = Mesh(vertices, np.array([[0, 1, 2], [0, 3, 2], [0, 3, 4], [0, 1, 4]], np.int32))
    corner = np.array([0.2, 0.2, 2.0]) / np.linalg.norm([0.2, 0.2, 2.0])
    halfway = 0.5 * (corner + np.array([0, 0, 1]))
    expected = np.stack([[0, 0, 1], corner, halfway / np.linalg.norm(halfway)])
    found = rounded_normals(pyramid, np.stack([vertices[0], vertices[1], vertices[:2].mean(axis=0)]))
    np.testing.assert_allclose(np.abs(np.einsum("ni,ni->n", found, expected)), 1, atol=1e-9)


def test_the_best_pca_is_the_best_of_those_tried(sphere):
    found = [best_pca(sphere, [k]) for k in (4, 8, 60)]
    assert best_pca(sphere, [4, 8, 60]) == max(found, key=lambda one: one["nc"])


def test_every_method_finds_the_normals_of_a_sphere(sphere):
    for axes in (sphere.sweeps(), sphere.sweeps(sphere.random_start()), sphere.adam(sphere.energy())):
        assert sphere.agreement(axes)["nc"] > 0.98


def test_turns_are_those_of_the_solver(sphere):
    turns = mean_turns(sphere.mirrors, sphere.mirrors.plane_fit(), CURVE_SWEEPS)
    _, count = reflection_sweeps(sphere.mirrors)
    assert count < CURVE_SWEEPS
    assert [turn < np.degrees(TOLERANCE) for turn in turns[:count]] == [False] * (count - 1) + [True]


def test_the_seven_combinations_are_the_papers():
    found = [(w.alignment, w.distance, w.gradient) for w in combinations(PRINTED)]
    reference, others = (1e2, 1, 1e-3), [(1e2, 1, 1e-2), (1e2, 1, 1e-4), (1e2, 10, 1e-3), (1e2, 0.1, 1e-3)]
    np.testing.assert_allclose(found, [reference, *others, (1e3, 1, 1e-3), (1e1, 1, 1e-3)])
    assert combinations(EnergyWeights())[0] == EnergyWeights()


def test_the_exponent_of_a_power_law_is_found():
    runs = [{"points": n, "cpu": 3 * n**1.25 if n > 5000 else 7.0} for n in (1_000, 10_000, 100_000, 1_000_000)]
    assert exponent(runs, "cpu") == pytest.approx(1.25)


def test_costs_are_measured(tmp_path):
    np.savez(
        tmp_path / "a.npz",
        points=np.eye(3),
        normals=np.eye(3),
        gt_v=TETRAHEDRON.vertices,
        gt_f=TETRAHEDRON.faces,
        nm_curve=NO_CURVE,
        meta=json.dumps({"category": "watertight"}),
    )
    run = stage_cost(tmp_path / "a.npz", 1_000)
    assert run["points"] == 1_000
    assert run["stage_cpu"] > run["facets_cpu"] > 0
    assert run["delaunay_cpu"] > 0


def measured(nc: float, stage_cpu: float) -> dict:
    """What `measure` returns, with one case of this NC beside a PCA of .98, and this time beside Delaunay's 1."""

    def agreement(nc, **more):
        return {"nc": nc, "nc_p05": nc, "nc_curve": None, **more}

    case = {
        "case": "a",
        "category": "open",
        "points": 100,
        "sweeps": agreement(nc),
        "pca": agreement(0.98, k=7),
        "closer_pca": agreement(0.97, k=4),
        **dict.fromkeys(("open3d", "adam", "printed"), agreement(0.9)),
        "error_ratio": (1 - nc) / 0.02,
        "faceting": 0.1,
        "start_gap": 0.0,
        "distance_ratio": 1.2,
        "cleaned": None,
    }
    runs = [
        dict(
            points=n, stage_cpu=stage_cpu, facets_cpu=1.0, stage_seconds=2.0, delaunay_cpu=1.0, delaunay_seconds=1.0,
            peak_memory_mb=100.0,
        )
        for n in (1_000, 10_000, 100_000)
    ]  # fmt: skip
    return {
        "versions": {"Python": "3"},
        "quality": {"uniform": [case]},
        "ablation": [{"points": 3000, "sweeps": 0.99, "printed": [0.9] * 7, "default": [0.95] * 7}],
        "convergence": {"dense": {"points": 100, "energy": [1.0, 0.5], "turns": [10.0, 1.0], "sweeps": 31}},
        "cost": runs,
    }


def test_verdicts_follow_the_numbers():
    good, bad = (list(verdicts(measured(nc, cpu))) for nc, cpu in ((0.995, 2.0), (0.97, 4.0)))
    assert [line.startswith("**Met**") for line in good] == [True, True, True, False, False, True, True, True]
    assert "a 1.50 (0.10)" in bad.pop(1)
    assert [line.startswith("**Met**") for line in bad] == [False, False, True, False, False, False, False, True]
    assert good[4].endswith("than the sweeps on no case.")
    assert "a (0.9700, 0.9800 at k = 7)" in bad[1]


def test_the_page_shows_tables_and_plots(tmp_path):
    page = write_page(measured(0.995, 2.0), tmp_path).read_text(encoding="utf-8")
    assert "| a | 0.9950 | 0.9800 | 0.9000 | 0.9000 | 0.9000 | 7 | 0.25 | 0.10 |" in page
    assert "| 10,000 | 2.00 | 2.00 | 50% | 100 MiB |" in page
    for name in ("convergence", "growth"):
        assert f"(normals/{name}.png)" in page
        assert (tmp_path / "normals" / f"{name}.png").stat().st_size > 1000
    assert json.loads((tmp_path / "normals" / "numbers.json").read_text())["cost"][0]["points"] == 1000


def test_a_folder_without_cases_is_one_line(tmp_path, capsys):
    pytest.importorskip("open3d", exc_type=ImportError)
    assert main([str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith("error: ")
