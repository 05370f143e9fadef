"""Closed shapes whose walls are thinner than two cells, of samples far denser than the grid."""

from pathlib import Path

import numpy as np
import pytest

from core import Settings, reconstruct
from core.io.points import read_points
from core.surface.meshing.misfit import distances
from tests import shapes

BUST = Path(__file__).parents[3] / "data" / "bust.ply"


def signed(points, turn):
    points = points @ shapes.random_rotation(turn).T
    return reconstruct(points, Settings(resolution=32, surface="signed", denoise=0))


def shelf(thickness):
    """A block of 1 x 2 x 1 with a plate along the middle of one side that sticks out by 1."""
    low, high = 0.5, 0.5 + thickness
    block = [((0, 0, 0), (1, 2, 0)), ((0, 0, 1), (1, 2, 1)), ((0, 0, 0), (0, 2, 1)), ((0, 0, 0), (1, 0, 1))]
    block += [((0, 2, 0), (1, 2, 1)), ((1, 0, 0), (1, 2, low)), ((1, 0, high), (1, 2, 1))]
    plate = [((1, 0, low), (2, 2, low)), ((1, 0, high), (2, 2, high)), ((1, 0, low), (2, 0, high))]
    plate += [((1, 2, low), (2, 2, high)), ((2, 0, low), (2, 2, high))]
    return shapes.scattered_rectangles(block + plate, 12000)


@pytest.mark.parametrize("turn", [0, 1, 2, 3])
@pytest.mark.parametrize("thickness", [0.115, 0.13])
def test_a_plate_of_one_cell_to_two_is_closed(thickness, turn):
    """Most were refused: nodes inside and past a wall see the surface on the same side."""
    run = signed(shapes.scattered_box(9000, np.array([2, 2, thickness])), turn)
    assert 1 < thickness / run.field.spacing < 2
    assert distances(run.surface, run.points).max() < 0.2 * run.field.spacing
    assert shapes.euler(run.surface) == 2
    assert shapes.signed_volume(run.surface) == pytest.approx(4 * thickness, rel=0.05)


@pytest.mark.parametrize(("thickness", "whole"), [(0.03, 7), (0.04, 7), (0.06, 8)])
def test_a_thin_plate_on_a_thick_block_is_closed(thickness, whole):
    """Few nodes lie inside of it, so they were taken for specks. Of less than half a cell it may be torn, in one of
    eight turns."""
    runs = [signed(shelf(thickness), turn) for turn in range(2, 10)]
    assert all(thickness < 0.8 * run.field.spacing for run in runs)
    near = [distances(run.surface, run.points).max() < 0.72 * run.field.spacing for run in runs]
    right = [run for run, close in zip(runs, near, strict=True) if close and shapes.euler(run.surface) == 2]
    assert len(right) >= whole
    for run in right:
        assert shapes.signed_volume(run.surface) == pytest.approx(2 + 2 * thickness, rel=0.02)


def test_an_open_bust_with_a_thin_foot_has_no_handles():
    """It had ten with sheets side by side told by the steps to nodes, and its points were twice as far off."""
    run = reconstruct(read_points(BUST)[::3], Settings(resolution=48))
    assert shapes.euler(run.surface) == 2
    assert distances(run.surface, run.points).mean() < 0.03 * run.field.spacing
