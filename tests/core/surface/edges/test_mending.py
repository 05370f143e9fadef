"""A flat sheet of crossed edges in a small grid, damaged."""

import numpy as np
import pytest

from core.surface.edges.mending import mend
from tests.bands import near_band

SIDE = 12
BAND = near_band((SIDE,) * 3, np.arange(SIDE**3), np.zeros((SIDE**3, 3)))
NODE, AXIS = (x.reshape(-1) for x in np.meshgrid(np.arange(SIDE**3), np.arange(3), indexing="ij"))
X, Y, Z = np.unravel_index(NODE, (SIDE,) * 3)
INNER = ((np.stack([X, Y, Z]) > 0) & (np.stack([X, Y, Z]) < SIDE - 2)).all(axis=0)
NODE, AXIS, X, Y, Z = (x[INNER] for x in (NODE, AXIS, X, Y, Z))
SHEET = (AXIS == 2) & (Z == 5)


def mended(crossed, certainty=None):
    crossed = crossed.copy()
    mend(BAND, 3 * NODE + AXIS, crossed, np.ones(len(NODE)) if certainty is None else certainty)
    return crossed


def pick(*places):
    return np.any([(x == X) & (y == Y) & (z == Z) & (axis == AXIS) for x, y, z, axis in places], axis=0)


@pytest.mark.parametrize(
    "damage",
    [
        [],
        [(4, 4, 5, 2)],  # a hole
        [(4, 4, 5, 2), (5, 4, 5, 2), (4, 5, 5, 2), (5, 5, 5, 2)],  # wide
        [(4, 4, 5, 2), (5, 5, 5, 2)],  # two that touch
        [(4, 4, 8, 1)],  # a crumb off the sheet
        [(4, 4, 6, 0)],  # a spur on it
        [(6, 4, 5, 0), (6, 4, 6, 1), (7, 4, 6, 2), (6, 3, 6, 2), (6, 3, 5, 0)],  # a fringe
    ],
)
def test_a_damaged_sheet_is_whole_again(damage):
    crossed = SHEET ^ pick(*damage) if damage else SHEET
    np.testing.assert_array_equal(mended(crossed), SHEET)


def test_a_sheet_with_a_straight_rim_stays():
    half = SHEET & (X < 6)
    np.testing.assert_array_equal(mended(half), half)


def test_notches_and_spurs_are_taken_off_a_rim():
    half = SHEET & (X < 6)
    np.testing.assert_array_equal(mended(half ^ pick((5, 4, 5, 2), (6, 8, 5, 2))), half)


def test_a_small_sheet_does_not_shrink():
    small = SHEET & (X > 3) & (X < 7) & (Y > 3) & (Y < 7)
    np.testing.assert_array_equal(mended(small) & small, small)


def test_a_wide_hole_stays():
    holed = SHEET & ~((X > 0) & (X < 10) & (Y > 0) & (Y < 10))
    np.testing.assert_array_equal(mended(holed), holed)


def test_edges_beyond_those_given_are_not_needed():
    """A hole in which no edge may be crossed."""
    given = ~pick((4, 4, 5, 2), (5, 4, 5, 2), (4, 5, 5, 2), (5, 5, 5, 2))
    crossed = SHEET[given].copy()
    mend(BAND, (3 * NODE + AXIS)[given], crossed, np.ones(given.sum()))
    np.testing.assert_array_equal(crossed, SHEET[given])


def test_nothing_to_mend():
    mend(BAND, np.empty(0, int), np.empty(0, bool), np.empty(0))
