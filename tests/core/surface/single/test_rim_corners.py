"""Corners of borders against outlines whose corners are known. Lengths are local spacings."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.surface.single.rim_corners import Border

STEP = 0.25  # between vertices
SIDE = 16.0


def outline(corners, closed=True):
    """Vertices (v,3) along straight lines through corners (c,2)."""
    ends = np.roll(corners, -1, axis=0) if closed else corners[1:]
    along = np.arange(0, 1, STEP / SIDE)[:, None]
    sides = [a + along * (b - a) for a, b in zip(corners, ends, strict=False)]
    return np.pad(np.concatenate(sides), ((0, 0), (0, 1)))


def zigzag(x, seed, height=0.15):
    """Moved as borders of random samples are: about the same way over a spacing."""
    noise = np.random.default_rng(seed).normal(size=(len(x), 2))
    width = int(1 / STEP)
    mean = sum(np.roll(noise, shift, axis=0) for shift in range(width)) / np.sqrt(width)
    return x + np.pad(height * mean, ((0, 0), (0, 1)))


def border(x, loop):
    """Of vertices (v,3) in order round a closed border, with the numbers `loop` (l,) in any order."""
    return Border(x, loop, np.stack([loop - 1, loop + 1], axis=1) % len(x))


def corners_of(x, order=None):
    """Which of the vertices (v,3) of a closed border are corners, (v,) bool."""
    loop, found = np.arange(len(x)) if order is None else order, np.zeros(len(x), bool)
    found[loop] = border(x, loop).corners(np.ones(len(x)))
    return found


SQUARE = SIDE * np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


def test_those_of_a_square_are_found_exactly():
    x = outline(SQUARE)
    np.testing.assert_array_equal(np.flatnonzero(corners_of(x)), np.arange(4) * int(SIDE / STEP))


def test_those_of_random_squares_are_found_nearby():
    found = [(x := zigzag(outline(SQUARE), seed))[corners_of(x), :2] for seed in range(30)]
    assert np.mean([len(corners) == 4 for corners in found]) > 0.85
    away = [np.linalg.norm(corners[:, None] - SQUARE, axis=2).min(axis=0) for corners in found]
    assert np.mean(np.array(away) < 0.7) > 0.98


@pytest.mark.parametrize("radius", [8.0, 20.0])
def test_round_borders_have_none(radius):
    turn = np.arange(0, 2 * np.pi, STEP / radius)
    circle = radius * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    found = [corners_of(zigzag(circle, seed)).sum() for seed in range(10)]
    assert np.mean(found) < 0.5


@pytest.mark.parametrize(("degrees", "expected"), [(40, 0), (80, 1), (140, 1)])
def test_a_border_that_turns_little_has_none(degrees, expected):
    """A rhombus, whose other corners are as sharp as is left of the half turn; asked at the first."""
    turn = np.radians(degrees)
    way = np.array([np.cos(turn), np.sin(turn)])
    x = outline(SIDE * np.array([[0.0, 0], way, way + np.array([1, 0]), [1, 0]])[::-1])
    first = np.linalg.norm(x[:, :2] - SIDE * way, axis=1) < 1
    assert corners_of(x)[first].sum() == expected


def test_a_cut_off_corner_counts_where_the_sides_would_meet():
    cut = SIDE * np.array([[0.0, 0], [1, 0], [1, 1 - 0.5 / SIDE], [1 - 0.5 / SIDE, 1], [0, 1]])
    x = outline(cut)
    place = x[corners_of(x), :2]
    assert len(place) == 4
    assert np.linalg.norm(place - SIDE, axis=1).min() < 0.6


def test_the_order_of_vertices_does_not_matter():
    x = zigzag(outline(SQUARE), 3)
    np.testing.assert_array_equal(corners_of(x, np.random.default_rng(0).permutation(len(x))), corners_of(x))


@pytest.mark.parametrize(("past", "expected"), [(0.5, 0), (4.0, 1)])
def test_there_are_none_right_beside_the_end_of_a_border(past, expected):
    """Where it runs into a line at which sheets meet, one of whose vertices is the last, so far past the corner."""
    x = outline(SQUARE[:3], closed=False)
    loop = np.arange(1, int((SIDE + past) / STEP))
    assert border(x, loop).corners(np.ones(len(loop))).sum() == expected


def test_what_is_within_reach_of_a_corner_along_the_border():
    x = outline(SQUARE)
    n, loop = len(x), np.arange(len(x))
    found = border(x, loop).within(np.full(n, 0.6), loop == 0)
    np.testing.assert_array_equal(np.flatnonzero(found), [0, 1, 2, n - 2, n - 1])


def test_single_layers_keep_their_corners(monkeypatch):
    """Of random squares, that the border is nearer to than without."""
    clouds = [np.pad(np.random.default_rng(seed).random((1500, 2)), ((0, 0), (0, 1))) for seed in range(6)]
    corners = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])

    def missed():
        sheets = [reconstruct(points, Settings(resolution=64, surface="single")).sheet for points in clouds]
        away = [np.linalg.norm(sheet.vertices[:, None, :2] - corners, axis=2).min(axis=0) for sheet in sheets]
        return np.mean(away)

    kept = missed()
    monkeypatch.setattr(Border, "corners", lambda border, spacing: np.zeros(len(border.loop), bool))
    assert kept < 0.75 * missed()
