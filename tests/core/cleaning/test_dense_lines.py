"""Lines whose samples lie much closer than a cell and than the next line are thinned; nothing else is."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.cleaning.clean import clean
from core.cleaning.dense_lines import thinned_lines
from core.points import prepare_samples
from tests import shapes

LONG = 1.0


def parallel_lines(gap, step, even=False):
    """Eight lines of samples some `step` apart, at random or nearly even, both ends among them."""
    rng, count = np.random.default_rng(0), int(LONG / step)
    x = np.sort(rng.uniform(0, LONG, (8, count)), axis=1)
    if even:
        x = LONG * (np.arange(count) + rng.uniform(-0.3, 0.3, (8, count))) / (count - 1)
    x[:, 0], x[:, -1] = 0, LONG
    place = gap * np.arange(8)[:, None] + 0 * x
    return np.stack([x, place, 0.1 * np.sin(4 * x)], axis=2)


def slices_of_a_ball(count, each):
    rng = np.random.default_rng(0)
    height = np.linspace(-0.95, 0.95, count)[:, None] + np.zeros(each)
    turn, radius = rng.uniform(0, 2 * np.pi, height.shape), np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=2).reshape(-1, 3)


@pytest.mark.parametrize(("gap", "apart"), [(0.06, 0.01), (0.3, 0.02), (0.9, 0.02)])
@pytest.mark.parametrize("step", [0.003, 3e-4])
def test_samples_are_left_half_to_once_a_cell_apart_or_a_sixth_of_the_way_to_the_next_line(gap, apart, step):
    lines = parallel_lines(gap, step)
    left = thinned_lines(lines.reshape(-1, 3), cell=0.02).reshape(lines.shape[:2])
    for line, some in zip(lines, left, strict=True):
        assert np.abs(line[some, 0][[0, -1]] - [0, LONG]).max() < 0.3 * apart, "an end is lost"
        before, between = (np.linalg.norm(np.diff(x, axis=0), axis=1) for x in (line, line[some]))
        assert 0.5 * apart < between.mean() < 1.1 * apart
        assert between.max() < 1.6 * apart + before.max()


def test_a_ring_is_thinned_all_around_and_branches_to_their_ends():
    turn = np.random.default_rng(1).uniform(0, 2 * np.pi, 4000)
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    branch = np.linspace([1, 0, 0.001], [1, 0, 1.0], 700)
    points = np.concatenate([ring, branch])
    left = thinned_lines(points, cell=0.05)
    around = np.sort(turn[left[:4000]])
    assert np.diff(around, append=around[0] + 2 * np.pi).max() < 0.13
    assert 110 < left[:4000].sum() < 260
    assert left[-1]
    assert 18 < left[4000:].sum() < 50


@pytest.mark.parametrize(
    ("points", "cell"),
    [
        (shapes.scattered_sphere(20000), 0.1),
        (shapes.square(10000), 0.2),
        (np.random.default_rng(0).random((5000, 3)), 0.1),
        (parallel_lines(0.3, 0.01, even=True).reshape(-1, 3), 0.015),
        (parallel_lines(0.03, 0.005, even=True).reshape(-1, 3), 0.2),
        (shapes.sphere(5), 1.0),
    ],
    ids=["sphere", "grid", "cloud", "lines as far apart as cells", "lines close to each other", "few"],
)
def test_all_else_stays(points, cell):
    assert thinned_lines(points, cell).all()


def test_lines_are_thinned_beside_a_surface_that_stays():
    sphere, lines = shapes.scattered_sphere(4000), parallel_lines(0.3, 1e-3).reshape(-1, 3) + np.array([0, 2, 0])
    left = thinned_lines(np.concatenate([sphere, lines]), cell=0.05)
    assert left[:4000].all()
    assert left[4000:].mean() < 0.04


def test_what_is_left_does_not_hang_on_order_and_is_said():
    points, order = slices_of_a_ball(12, 600), np.random.default_rng(2).permutation(12 * 600)
    one, done = clean(prepare_samples(points).in_spatial_order())
    other, _ = clean(prepare_samples(points[order]).in_spatial_order())
    assert set(one.source_index) == set(order[other.source_index])
    [said] = one.warnings
    assert said.startswith(f"{7200 - len(one.points)} of 7200 points dropped from lines")
    assert done == {"outliers": 0, "thinned": 7200 - len(one.points)}
    kept, _ = clean(prepare_samples(points), Settings(outliers=False))
    assert len(kept.points) == len(points)


@pytest.mark.parametrize("each", [200, 2500])
def test_slices_of_a_ball_are_one_sheet_however_dense_they_are(each):
    result = reconstruct(slices_of_a_ball(20, each), Settings(resolution=64, surface="single"))
    [sheet] = shapes.components(result.sheet)
    assert shapes.euler(sheet) == 0
    assert sheet.edge_counts()[1].max() == 2
    assert np.abs(shapes.sphere_distance(sheet.vertices)).mean() < 0.003
