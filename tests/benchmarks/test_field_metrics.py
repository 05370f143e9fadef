"""Field metrics on fields whose error is put there on purpose."""

import numpy as np
import pytest

from benchmarks.field_metrics import above_nearest_sample, angle_error, field_errors, past_rims
from core import DistanceField, Mesh

CELL = 1 / 64
SIDE = 24 * CELL
SQUARE = Mesh(
    SIDE * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]], np.int32)
)


def distance_to_square(x):
    beyond = np.maximum(np.abs(x[..., :2]) - SIDE, 0)
    return np.sqrt((beyond**2).sum(axis=-1) + x[..., 2] ** 2)


def field_of(function, band=np.inf) -> DistanceField:
    """The field whose nodes hold `function` of their positions; nodes lie on the square and on its rim."""
    shape = (73, 73, 65)
    origin = -0.5 * CELL * (np.array(shape) - 1)
    nodes = origin + CELL * np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    return DistanceField(function(nodes).astype(np.float32), origin, CELL, band)


@pytest.fixture(scope="module")
def samples() -> np.ndarray:
    grid = np.linspace(-SIDE, SIDE, 60)
    return np.stack(np.meshgrid(grid, grid, [0.0]), axis=-1).reshape(-1, 3)


def test_the_exact_field_has_next_to_no_error(samples):
    found = field_errors(field_of(distance_to_square), SQUARE, samples)
    assert found["box"] < 0.1
    assert found["near"] < 0.2
    assert found["eikonal"] < 1e-3
    assert found["angle"] < 0.1
    assert found["on_surface"] == pytest.approx(0, abs=1e-6)
    assert (found["above_share"], found["above_max"]) == (0, pytest.approx(0, abs=1e-3))


def test_a_shift_shows_in_the_distances_alone(samples):
    exact, shifted = (
        field_errors(field_of(lambda x, s=s: distance_to_square(x) + s), SQUARE, samples) for s in (0, 2e-3)
    )
    assert shifted["box"] - exact["box"] == pytest.approx(2, abs=0.1)
    assert shifted["near"] - exact["near"] == pytest.approx(2, abs=0.2)
    assert shifted["on_surface"] == pytest.approx(2e-3 / CELL, rel=1e-3)
    assert shifted["eikonal"] == pytest.approx(exact["eikonal"], abs=1e-4)
    assert shifted["angle"] == pytest.approx(exact["angle"], abs=0.01)


def test_a_slope_shows_in_the_eikonal_error_and_a_shear_in_the_angle(samples):
    steep = field_errors(field_of(lambda x: 1.1 * distance_to_square(x)), SQUARE, samples)
    assert steep["eikonal"] == pytest.approx(0.1, abs=2e-3)
    assert steep["angle"] < 0.1
    sheared = field_errors(field_of(lambda x: distance_to_square(x) + 0.1 * x[..., 0]), SQUARE, samples)
    assert sheared["angle"] == pytest.approx(np.degrees(np.arctan(0.1)), abs=0.1)


def test_no_direction_is_asked_for_at_the_surface_itself():
    x = np.random.default_rng(0).uniform(-CELL, CELL, (100, 3))
    assert angle_error(field_of(distance_to_square), SQUARE, x) is None


def test_only_what_the_band_holds_is_judged(samples):
    far_off = field_of(lambda x: np.minimum(distance_to_square(x), 0.1), band=0.1)
    assert field_errors(far_off, SQUARE, samples)["box"] < 0.2


def test_u_above_the_nearest_sample_is_found():
    sample = np.array([[0.0, 0, 0]])
    field = field_of(lambda x: np.linalg.norm(x, axis=-1) + np.where(x[..., 0] > 0.01, 0.5 * CELL, -0.5 * CELL))
    x = np.random.default_rng(0).uniform(-0.4, 0.4, (20_000, 3))
    found = above_nearest_sample(field, sample, x)
    assert found["above_share"] == pytest.approx((0.4 - 0.5 * CELL) / 0.8, abs=0.02)
    assert found["above_max"] == pytest.approx(0.5, abs=1e-3)


def test_a_field_without_an_end_leaks_past_the_rim():
    ends, leaks = (
        past_rims(field_of(distance_to_square), SQUARE),
        past_rims(field_of(lambda x: np.abs(x[..., 2])), SQUARE),
    )
    assert set(ends) == {"4", "8", "16"}
    for cells in ends:
        assert ends[cells]["points"] > 1000
        assert [ends[cells][key] for key in ("mean", "p05", "p95")] == pytest.approx([1, 1, 1], abs=0.02)
    for cells in ("4", "8"):
        # |z| / d is the sine of a tilt uniform within 60 degrees
        assert leaks[cells]["mean"] == pytest.approx(0.5 / np.radians(60), abs=0.02)
        assert leaks[cells]["p95"] == pytest.approx(np.sin(np.radians(57)), abs=0.02)


def test_rims_count_only_where_they_are_nearest():
    block = np.array([[29.0, 0, 0], [60, 60, 0], [60, -60, 60], [60, -60, -60]]) * CELL
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
    truth = Mesh(np.concatenate([SQUARE.vertices, block]), np.concatenate([SQUARE.faces, faces + 4]))
    open_air, blocked = (past_rims(field_of(distance_to_square), mesh)["8"] for mesh in (SQUARE, truth))
    assert 0 < blocked["points"] < 0.99 * open_air["points"]
    assert blocked["p95"] == pytest.approx(1, abs=0.02)
    assert blocked["mean"] == pytest.approx(1, abs=5e-3)


def test_closed_shapes_have_no_rims():
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
    assert past_rims(field_of(distance_to_square), Mesh(0.1 * np.eye(4)[:, :3], faces)) == {}
