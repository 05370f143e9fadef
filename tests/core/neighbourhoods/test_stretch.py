"""How much closer samples lie along lines than these to each other, on lines and next to creases."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from core.points import local_spacing
from core.voronoi.lines import across_lines
from tests import shapes

STEP, BETWEEN = 0.01, 0.04


def stretch_of(points):
    return across_lines(points, local_spacing(points))[1]


def rows(count=12, between=BETWEEN, places=60):
    """Samples (n,3) in rows, the numbers of these (n,), and of the places along them, (n,)."""
    number, place = (x.reshape(-1) for x in np.meshgrid(np.arange(count), np.arange(places), indexing="ij"))
    shift = np.random.default_rng(1).random(count)[number]
    return np.stack([STEP * (place + shift), between * number, 0.0 * place], axis=1), number, place


def test_rows_have_their_direction_and_their_ratio():
    points, _, place = rows()
    turn = shapes.random_rotation(2)
    found = stretch_of(points @ turn.T)
    inner = (place > 5) & (place < 54)
    np.testing.assert_allclose(np.abs(found.along[inner] @ turn), np.tile([1.0, 0, 0], (inner.sum(), 1)), atol=1e-9)
    np.testing.assert_allclose(found.across[inner], BETWEEN, rtol=0.02)
    np.testing.assert_allclose(found.ratio[inner], BETWEEN / STEP, rtol=0.02)


def test_so_has_the_row_next_to_a_wall_that_does_not_look_like_a_line():
    floor, number, place = rows()
    x, height = (a.reshape(-1) for a in np.meshgrid(STEP * np.arange(60), STEP * (np.arange(30) + 0.5)))
    points = np.concatenate([floor, np.stack([x, np.full(len(x), -1.2 * STEP), height], axis=1)])
    found = stretch_of(points)
    next_to_it = np.flatnonzero((number == 0) & (place > 5) & (place < 54))
    np.testing.assert_allclose(np.abs(found.along[next_to_it, 0]), 1.0, atol=1e-6)
    np.testing.assert_allclose(found.ratio[next_to_it], BETWEEN / STEP, rtol=0.05)
    wall = np.arange(len(floor), len(points))[points[len(floor) :, 2] > 4 * BETWEEN]
    assert (found.ratio[wall] == 1).all()
    assert not found.along[wall].any()


def test_the_nearest_by_the_stretch_are_as_many_to_the_side_as_along():
    points, number, place = rows()
    own = np.flatnonzero((number == 6) & (place == 30))
    distance, other = stretch_of(points).nearest(own, points, KDTree(points), 24)
    assert own[0] not in other
    along, across = np.abs(points[other[0]] - points[own[0]]).T[:2]
    np.testing.assert_allclose(distance[0], np.hypot(along, across * STEP / BETWEEN), rtol=0.02)
    assert across.max() == pytest.approx(2 * BETWEEN)
    assert along.max() < 3.5 * STEP


@pytest.mark.parametrize("ratio", [4, 7])
def test_they_are_those_that_are_nearest_once_all_is_shortened_to_the_side(ratio):
    points, number, place = rows(16, ratio * STEP, 120)
    own = np.flatnonzero((number == 8) & (place == 60))
    found = stretch_of(points)
    distance, other = found.nearest(own, points, KDTree(points), 64)
    shortened = points / [1, found.ratio[own[0]], 1]
    expected, nearest = KDTree(shortened).query(shortened[own], k=65)
    assert set(other[0]) == set(nearest[0, 1:])
    np.testing.assert_allclose(distance, expected[:, 1:], rtol=1e-6)


@pytest.mark.parametrize("points", [shapes.scattered_sphere(2000), shapes.torus(1500), shapes.square(900)])
def test_elsewhere_there_is_none(points):
    assert stretch_of(points) is None
