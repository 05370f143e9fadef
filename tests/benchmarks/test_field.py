"""The measures behind docs/field.md where the answer is known, and the page on made-up numbers."""

import json

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from benchmarks import field_baselines as baselines
from benchmarks import field_tables as tables
from benchmarks.field import CLOSED, OPEN, UP, main, write_page
from benchmarks.field_cost import PUBLISHED_FIELD, PUBLISHED_NORMALS, cost
from benchmarks.field_metrics import ratios
from benchmarks.field_offsets import level_set
from benchmarks.field_rims import hemisphere, rim_points
from benchmarks.field_verdicts import verdicts
from benchmarks.geometry import closest_points, surface_points
from benchmarks.revolved import Revolved, bottle, hat
from core import DistanceField, Mesh
from tests import shapes

CELL = 1 / 32


@pytest.fixture
def random():
    return np.random.default_rng(0)


@pytest.fixture
def plane(random):
    """Samples of the square z = 0 with axes of random sign, and queries above its inside."""
    points = shapes.square(2000)
    axes = np.array([0, 0, 1.0]) * random.choice([-1.0, 1.0], (len(points), 1))
    return points, axes, random.uniform([-0.8, -0.8, -0.3], [0.8, 0.8, 0.3], (500, 3))


@pytest.mark.parametrize("way", ["projection_field", "blended_planes", "discs"])
def test_on_a_plane_planes_are_exact_and_samples_are_further(plane, way):
    points, axes, x = plane
    found = getattr(baselines, way)(points, axes, x)
    if way == "discs":
        assert (found >= np.abs(x[:, 2]) - 1e-12).all()
        assert np.median(found - np.abs(x[:, 2])) < 1e-12
    else:
        np.testing.assert_allclose(found, np.abs(x[:, 2]), atol=1e-12)
    assert (baselines.nearest_sample(points, x) >= np.abs(x[:, 2])).all()


def test_past_a_rim_planes_go_on_and_discs_and_the_bracket_end(plane):
    points, axes, _ = plane
    beyond = np.array([[1.5, 0.0, 0.0]])
    assert baselines.projection_field(points, axes, beyond) == pytest.approx(0)
    for way in (baselines.discs, baselines.bracketed):
        assert 0.4 < way(points, axes, beyond)[0] < 0.5
    assert 0.5 < baselines.nearest_sample(points, beyond)[0] < 0.55


def test_a_revolved_segment_is_a_cylinder_and_a_revolved_arc_a_sphere(random):
    x = random.uniform(-2, 2, (500, 3))
    cylinder = Revolved(np.array([[1.0, -1.0], [1.0, 1.0]]))
    np.testing.assert_allclose(cylinder.distance(x), shapes.cylinder_distance(x))
    angle = np.linspace(-np.pi / 2, np.pi / 2, 2000)
    sphere = Revolved(np.stack([np.cos(angle), np.sin(angle)], axis=1))
    np.testing.assert_allclose(sphere.distance(x), shapes.sphere_distance(x), atol=1e-5)


def test_points_of_a_cone_are_uniform_by_area(random):
    points = Revolved(np.array([[0.0, 1.0], [1.0, 0.0]])).points(20_000, random)
    radius = np.hypot(points[:, 0], points[:, 1])
    np.testing.assert_allclose(radius + points[:, 2], 1)
    assert (radius < np.sqrt(0.5)).mean() == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("shape", [hat, bottle])
def test_the_hat_and_the_bottle_fill_the_box_of_a_case(shape, random):
    points = shape().points(5000, random)
    assert np.ptp(points, axis=0).max() == pytest.approx(0.8, abs=0.01)
    np.testing.assert_allclose(shape().distance(points), 0, atol=1e-12)
    assert np.isfinite(shape().distance(random.uniform(-0.5, 0.5, (100, 3)))).all()


def test_a_level_set_lies_at_its_level():
    shape = (65, 65, 65)
    origin = -CELL * (np.array(shape) - 1) / 2
    nodes = origin + CELL * np.moveaxis(np.indices(shape), 0, -1)
    field = DistanceField(np.linalg.norm(nodes, axis=-1).astype(np.float32), origin, CELL)
    mesh = level_set(field, 0.5)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 0.5, atol=0.1 * CELL)
    assert mesh.border_loops() == 0


def test_the_hemisphere_is_one_and_points_fill_its_rim():
    mesh = hemisphere()
    assert mesh.border_loops() == 1
    x = np.random.default_rng(0).uniform(-0.5, 0.5, (500, 3))
    np.testing.assert_allclose(closest_points(x, mesh)[0], 0.4 * shapes.hemisphere_distance(x / 0.4), atol=1e-4)
    samples = surface_points(mesh, 1000, np.random.default_rng(0))
    rim = rim_points(samples, mesh)
    np.testing.assert_allclose(rim[:, 2], 0, atol=1e-12)
    turn = np.sort(np.arctan2(rim[:, 1], rim[:, 0]))
    gaps = 0.4 * np.diff(turn, append=turn[0] + 2 * np.pi)
    assert 0.5 < gaps.max() / gaps.min() < 2.5


def test_ratios_tell_bias_from_scatter():
    d = np.ones(1000)
    assert ratios(0.9 * d, d) == {
        "mean": pytest.approx(0.9), "off": pytest.approx(0.1), "p05": pytest.approx(0.9), "p95": pytest.approx(0.9),
        "points": 1000,
    }  # fmt: skip
    scattered = ratios(d + np.where(np.arange(1000) % 2, 0.1, -0.1), d)
    assert (scattered["mean"], scattered["off"]) == (pytest.approx(1), pytest.approx(0.1))
    assert ratios(d[:3], d[:3])["mean"] is None


def test_costs_are_measured(tmp_path):
    square = Mesh(shapes.square(4) * 0 + [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.array([[0, 1, 2], [0, 2, 3]]))
    np.savez(
        tmp_path / "a.npz",
        points=np.eye(3),
        normals=np.eye(3),
        gt_v=square.vertices,
        gt_f=square.faces,
        nm_curve=np.empty((0, 3)),
        meta=json.dumps({"category": "open"}),
    )
    run = cost(tmp_path / "a.npz", 500, 16)
    assert (run["points"], run["resolution"]) == (500, 16)
    assert run["field"]["cpu"] > 0
    assert run["normals"]["seconds"] > 0


def numbers(ours: float, rim: float) -> dict:
    """What `measure` returns, for one case of this error near the surface and this u / d past rims; all else is 1."""
    errors = {"box": 1.0, "near": 1.0, "nodes": 1.0}
    ways = dict.fromkeys(tables.WAYS, errors) | {"ours": {"box": 1.0, "near": ours, "nodes": ours}, "grid": None}
    ratio = {"mean": rim, "off": abs(rim - 1), "p05": rim, "p95": rim, "points": 100}
    past = {way: {"4": ratio, "8": ratio, "16": ratio, "near": 1.0} for way in (*tables.BORDERS, "nearest")}
    place = np.linspace(0, 1, 20)
    line = {"place": place, "u": place, "d": place, "nearest": place, "cell": 0.01}
    off = {"mean": 0.1, "max": 0.2}
    clock = {"seconds": 2.0, "cpu": 3.0}
    return {
        "versions": {"Python": "3"},
        "quality": {"uniform": [{"case": "a", "category": "open", **ways}]},
        "densities": [{"case": name, "points": 500, **ways} for name in (CLOSED, OPEN)],
        "offsets": [
            {"case": "a", "cell": 0.01, "levels": [{"level": 0.02, "vertices": 9, "mean": 1.0, "p99": 2.0, "max": 3.0}]}
        ],
        "lines": {name: line | {"line": off, "plane": off} for name in ("hat", "bottle")},
        "rims": [{"case": "a", "sampling": "as sampled", "points": 100, "spacing": 1.0, "ways": past}],
        "agreement": [{"points": 500, "cells": 0.5, "resolution": 20, "near": 1.0, "held": 2.0, "lost": None}],
        "cost": [
            {"points": n, "resolution": r, "normals": clock, "field": clock, "peak_memory_mb": 100.0}
            for n in PUBLISHED_NORMALS
            for r in PUBLISHED_FIELD
        ],
    }


def cut(axis: int) -> dict:
    side = [[0.0] if k == axis else np.linspace(0, 0.1, 9) for k in range(3)]
    nodes = np.stack(np.meshgrid(*side, indexing="ij"), -1).squeeze(axis)
    u = np.linalg.norm(nodes, axis=-1)
    return {"nodes": nodes, "axis": axis, "place": 0.2, "u": u, "d": u}


def pictures() -> dict:
    shells = {0.0: Mesh(0.1 * np.eye(4)[:, :3] - 0.05, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))}
    u, ends = cut(1)["u"].ravel(), np.array([[0.0, 0, 0], [0.1, 0, 0.1]])
    return {
        "lines": {name: cut(1) | {"ends": ends} for name in ("hat", "bottle")},
        "offsets": {name: cut(0 if up else 1) | {"meshes": shells} for name, up in UP.items()},
        "densities": cut(1) | {"up": 2, "truth": u, "projection": [u] * 3, "ours": [u] * 3},
    }


def test_verdicts_follow_the_numbers():
    good, bad = (list(verdicts(numbers(*pair))) for pair in ((0.4, 1.05), (1.0, 0.8)))
    assert [line.startswith("**Met**") for line in good] == [True] * 6 + [False, False, True]
    assert [line.startswith("**Met**") for line in bad] == [True] + [False] * 8
    assert good[6].endswith("on no clean case; at the nodes on none.")
    assert "a (1.00, ours 1.00)" in bad[2]
    assert "within 20.0% of d" in bad[8]


def test_the_page_shows_tables_and_plots(tmp_path):
    page = write_page(numbers(0.4, 1.05), pictures(), tmp_path).read_text(encoding="utf-8")
    assert "| a | 0.400 | 1.000 | – | 1.000 |" in page
    assert "| 1,000 | 32 | 2.00 / 3.00 | 0.46 | 0.2 | 100 MiB |" in page
    assert "| 100,000 | 256 | 2.00 / 3.00 | – | – | 100 MiB |" in page
    for name in ("lines", "offsets_closed", "offsets_open", "densities", "density_cuts"):
        assert f"(field/{name}.png)" in page
        assert 1000 < (tmp_path / "field" / f"{name}.png").stat().st_size < 150_000
    assert json.loads((tmp_path / "field" / "numbers.json").read_text())["cost"][0]["points"] == 1000


def test_a_folder_without_cases_is_one_line(tmp_path, capsys):
    pytest.importorskip("open3d", exc_type=ImportError)
    assert main([str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith("error: ")
