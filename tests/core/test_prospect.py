"""What is known before a run is what the run then finds."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.budget import SUITED, suited_resolution
from core.field.grid import fit_grid
from core.points import local_spacing
from core.prospect import look_ahead
from tests import shapes


def rings(count=14, each=2500):
    """Slices of a ball, whose points lie much closer along each than it is to the next one."""
    height = np.linspace(-0.95, 0.95, count)[:, None] + np.zeros(each)
    turn, radius = np.linspace(0, 2 * np.pi, each, endpoint=False), np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=2).reshape(-1, 3)


@pytest.mark.parametrize("resolution", [32, 128])
@pytest.mark.parametrize(
    "points", [rings(), np.vstack([shapes.sphere(800), [[900.0, 0, 0]]])], ids=["rings", "a stray far off"]
)
def test_samples_and_their_spacing_are_those_of_the_run(points, resolution):
    settings = Settings(resolution=resolution, surface="none")
    found, result = look_ahead(points, settings), reconstruct(points, settings)
    np.testing.assert_array_equal(np.sort(found.samples.source_index), result.source_index)
    spacing = np.median(found.samples.local_spacing()) * found.samples.scale
    assert spacing == pytest.approx(result.report["spacing"])
    assert found.cleaning == {key: result.report["cleaning"][key] for key in found.cleaning}
    assert found.prepared == len(points)


def test_the_resolution_that_suits_does_not_depend_on_the_one_asked():
    points = rings()
    suited = {look_ahead(points, Settings(resolution=resolution)).suited for resolution in (32, 128, 512)}
    assert len(suited) == 1
    to_next = 1.9 / 13  # from ring to ring
    apart = SUITED * fit_grid(points, suited.pop()).spacing
    assert to_next / 10 < apart < to_next / 2


def test_what_is_asked_for_whatever_the_offset_can_be_run():
    for offset in (1.0, 1.7, 4.0):
        settings = Settings(offset=offset)
        suited = look_ahead(shapes.sphere(100), settings).suited
        assert suited >= Settings(offset=offset, resolution=suited).coarsest
    assert suited == settings.coarsest > look_ahead(shapes.sphere(100)).suited


def test_without_lines_it_is_that_of_all_samples():
    points = shapes.sphere(800)
    assert look_ahead(points).suited == suited_resolution(points, local_spacing(points))
    assert look_ahead(rings(), Settings(outliers=False)).suited == suited_resolution(rings(), local_spacing(rings()))
