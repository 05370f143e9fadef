"""The single layer where sheets run closer than the samples on each."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.surface.meshing.misfit import distances
from core.surface.single.layer import SingleLayer
from tests import shapes


def glued_roll(count=8000, gap=0.04):
    """Random samples of a sheet rolled up 1.3 times, whose inner turn lies on its start and leaves it by so much."""
    rng = np.random.default_rng(0)
    turn = rng.uniform(0, 1.3, count)
    radius, angle = 0.5 + np.maximum(turn - 1, 0) / 0.3 * gap, 2 * np.pi * turn
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0, 1, count)])
    return points @ shapes.random_rotation(1).T


def single(points, resolution=96):
    return reconstruct(points, Settings(surface="single", resolution=resolution, denoise=0))


def off(run):
    return distances(run.sheet, run.points) / run.field.spacing


@pytest.mark.parametrize("resolution", [96, 128])
def test_a_glued_roll_shows_both_its_turns(resolution):
    run = single(glued_roll(), resolution)
    assert off(run).mean() < 0.01
    assert (off(run) > 0.5).mean() < 0.0005


def test_without_the_room_of_samples_it_does_not(monkeypatch):
    monkeypatch.setattr(SingleLayer, "told_apart", lambda layer: layer)
    run = single(glued_roll())
    assert off(run).mean() > 0.012
    assert (off(run) > 0.5).mean() > 0.005
