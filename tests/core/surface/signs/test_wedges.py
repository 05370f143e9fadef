"""Closed shapes with edges so acute that no node lies near their ends, and flaps beside them."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import KDTree

from core import InputError, Settings, reconstruct
from core.surface.signs.wedges import at_wedges
from tests import shapes

TURN = shapes.random_rotation(0)


def low_pyramid(n, height):
    """A pyramid over a square of side 2, whose faces meet its base at atan(height)."""
    rng, slope = np.random.default_rng(0), np.hypot(1, height)
    face = rng.choice(5, n, p=np.array([4, *4 * [slope]]) / (4 + 4 * slope))
    x, y = rng.uniform(-1, 1, (2, n))
    away = np.maximum(np.abs(x), np.abs(y))
    return np.stack([x, y, np.where(face == 0, 0.0, height * (1 - away))], axis=1)


def hollowed_cube(n, radius=0.62):
    """A cube of side 1 without the ball of that radius in it, which opens all six faces; edges of 36 degrees."""
    rng = np.random.default_rng(0)
    outer, ball = rng.uniform(-0.5, 0.5, (4 * n, 3)), rng.normal(size=(2 * n, 3))
    outer[np.arange(len(outer)), rng.integers(0, 3, len(outer))] = rng.choice([-0.5, 0.5], len(outer))
    ball *= radius / np.linalg.norm(ball, axis=1, keepdims=True)
    ball = ball[: int(2 * np.pi * radius**2 / 3 * len(outer))]
    kept = outer[np.linalg.norm(outer, axis=1) > radius], ball[np.abs(ball).max(axis=1) < 0.5]
    return rng.permutation(np.concatenate(kept))[:n]


@pytest.mark.parametrize("height", [0.2, 0.4])
def test_the_thin_edges_of_a_low_pyramid_are_no_flaps(height):
    """Within a cell of each other the faces are 16 and 7 % of its surface: it was told to be open, and its single layer
    was torn along them."""
    points = low_pyramid(3000, height) @ TURN
    run = reconstruct(points, Settings(resolution=64, surface="both"))
    signed = reconstruct(points, Settings(resolution=64, surface="signed"))
    assert [shapes.euler(mesh) for mesh in (run.sheet, signed.surface, run.surface)] == [2, 2, 4]
    for mesh in (run.sheet, signed.surface):
        assert set(mesh.edge_counts()[1]) == {2}
        assert shapes.signed_volume(mesh) == pytest.approx(4 / 3 * height, rel=0.03)
    assert run.report["warnings"] == signed.report["warnings"] == []


@pytest.mark.parametrize("noise", [0.03, 0.06])
def test_nor_are_they_under_noise(noise):
    """Of that many spacings, in which sheets side by side do not show."""
    points = low_pyramid(5000, 0.3) @ TURN
    points += np.random.default_rng(1).normal(scale=noise * np.sqrt(8.2 / 5000), size=points.shape)
    for kind in ("single", "signed"):
        run = reconstruct(points, Settings(resolution=96, surface=kind))
        assert shapes.euler(run.sheet or run.surface) == 2


def test_nor_are_acute_edges_that_are_curved():
    run = reconstruct(hollowed_cube(6000) @ TURN, Settings(surface="signed"))
    assert shapes.euler(run.surface) == -8
    assert len(shapes.components(run.surface)) == 1


def test_a_wide_flap_at_a_shape_with_thin_edges_is_told():
    """A fin on the tip of the pyramid, of 15 % of the surface."""
    rng = np.random.default_rng(1)
    fin = rng.uniform([-1, 0, 0.2], [1, 0, 1.0], (700, 3))
    points = np.concatenate([low_pyramid(4000, 0.2), fin]) @ TURN
    with pytest.raises(InputError, match="not closed"):
        reconstruct(points, Settings(resolution=64, surface="signed"))


PARTING, NOWHERE = np.array([[0.0, 0, 0]]), np.zeros(30, bool)


def surface(points, beside, crease):
    """Samples a local spacing of 1, of which some are on sheets side by side, or that far from a crease."""
    rims = SimpleNamespace(limit=np.stack([crease, np.full(len(points), np.inf)], axis=1))
    room, spacing = np.where(beside, 0.2, np.inf), np.ones(len(points))
    return SimpleNamespace(points=points, tree=KDTree(points), room=room, spacing=spacing, rims=rims)


@pytest.mark.parametrize(
    ("beside", "crease", "away", "expected"),
    [
        (True, np.inf, 9, True),
        (False, 1.0, 1, True),
        (False, 3.0, 1, False),  # from any crease
        (False, 1.0, 9, False),  # from where the outside ends
        (False, np.inf, 1, False),
    ],
)
def test_samples_tell_two_walls_from_one(beside, crease, away, expected):
    places = np.array([[away, 0, 0], [away + 0.5, 0, 0]])
    found = at_wedges(places, PARTING, NOWHERE, surface(places, np.full(2, beside), np.full(2, crease)), 1.0)
    np.testing.assert_array_equal(found, [expected] * 2)


def test_they_do_so_patch_by_patch_and_where_most_do():
    x = np.arange(30.0)
    places = np.stack([x, np.where(x < 20, 0, 9), 0 * x], axis=1)
    for first, second, expected in ((20, 2, x < 30), (20, 1, x < 20), (13, 4, x < 0)):
        beside = np.concatenate([np.arange(20) < first, np.arange(10) < second])
        found = at_wedges(places, PARTING, NOWHERE, surface(places, beside, np.full(30, np.inf)), 1.0)
        np.testing.assert_array_equal(found, expected)


def test_close_to_lines_where_sheets_pass_through_each_other_there_are_none():
    places = np.arange(30.0)[:, None] * [1, 0, 0]
    passing = places[:, 0] < 10
    found = at_wedges(places, PARTING, passing, surface(places, np.ones(30, bool), np.full(30, np.inf)), 1.0)
    np.testing.assert_array_equal(found, ~passing)


@pytest.mark.parametrize(("height", "count", "expected"), [(0.2, 30, True), (0.2, 29, False), (0.02, 30, False)])
def test_samples_off_one_sheet_tell_it_in_large_patches(height, count, expected):
    """Of a square lattice, above and below a plane by turns; a patch of one in 100 of all crossings, or smaller."""
    x, y = np.indices((9, 9)).reshape(2, -1)
    points = np.stack([x, y, height * (-1.0) ** (x + y)], axis=1)
    places, parting = points[:count], np.tile([[0, 0, 99.0]], (2900, 1))
    given = surface(points, np.zeros(81, bool), np.full(81, np.inf))
    assert at_wedges(places, parting, np.zeros(81, bool), given, 1.0).tolist() == [expected] * count


def test_of_no_places_there_are_none():
    assert at_wedges(np.empty((0, 3)), PARTING, NOWHERE, surface(PARTING, [False], [np.inf]), 1.0).shape == (0,)
