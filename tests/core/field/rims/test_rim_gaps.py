"""Gaps in the sampling at straight rims, on squares whose sides are known. Lengths are usual spacings, about 0.02."""

from dataclasses import replace

import numpy as np
import pytest

from core.field.local_surface import fit_local_surface
from core.field.rims import rim_lines
from core.field.rims.rim_gaps import RimGaps, find_rim_gaps, spacing_around
from core.neighbourhoods.cloud import Cloud
from core.points import local_spacing
from tests import shapes

SPACING = 0.02
NONE = RimGaps(np.empty(0, int), np.empty((0, 3)), np.empty(0))


def square(n=2500, seed=0):
    return np.random.default_rng(seed).random((n, 2))


def jittered_grid():
    x, y = np.meshgrid(np.arange(50.0), np.arange(50.0))
    jitter = np.random.default_rng(0).uniform(-0.2, 0.2, (2500, 2))
    return SPACING * (np.column_stack([x.ravel(), y.ravel()]) + jitter)


def surface_of(points):
    points = np.column_stack([points, np.zeros(len(points))])
    normals = np.tile([0.0, 0, 1], (len(points), 1))
    return fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)


def gaps_at(surface, row, outward):
    cloud = Cloud.of(surface.points, surface.normals, surface.spacing)
    return find_rim_gaps(row, outward, *spacing_around(row, cloud), cloud)


def below(surface, depth):
    """Samples at rims this near the lower side, and the way out there."""
    rim = surface.rims.open
    row = np.flatnonzero(rim & (surface.points[:, 1] < depth * SPACING) & (abs(surface.points[:, 0] - 0.5) < 0.3))
    return row, np.tile([0.0, -1, 0], (len(row), 1))


def share_covered(surface, x):
    return (surface.project(np.column_stack([x, np.zeros(len(x))])).distance < 1e-3).mean()


@pytest.mark.parametrize("seed", range(4))
def test_samples_in_a_gap_at_a_straight_side_know_how_far_off_it_is(seed):
    points = square(seed=seed)
    points = points[np.hypot(points[:, 0] - 0.5, points[:, 1]) > 2 * SPACING]
    surface = surface_of(points)
    row, outward = below(surface, 3)
    gaps = gaps_at(surface, row, outward)
    inside = abs(surface.points[row[gaps.of], 0] - 0.5) < 1.5 * SPACING
    deep = surface.points[row[gaps.of], 1]
    assert (deep[inside] > SPACING).any()
    assert (gaps.depth[inside] < deep[inside] + 0.3 * SPACING).all()
    assert (gaps.depth[inside] > deep[inside] - 0.8 * SPACING).all()
    assert (gaps.up[inside, 1] < -0.95).all()


def test_rims_run_across_gaps_of_chance(monkeypatch):
    """Of a strip of half a spacing along the sides of random squares a sixth less is missing."""
    t = np.random.default_rng(1).random((600, 2)) * [1, 0.5 * SPACING]
    x = np.concatenate([t, t[:, ::-1], 1 - t, 1 - t[:, ::-1]])

    def missing():
        return np.mean([1 - share_covered(surface_of(square(seed=seed)), x) for seed in range(4)])

    across = missing()
    monkeypatch.setattr(rim_lines, "find_rim_gaps", lambda *_: NONE)
    assert across < 0.83 * missing()


def test_the_rim_of_a_gap_may_lie_far_from_its_samples(monkeypatch):
    """More than a spacing and a half, beyond which nothing else is covered."""

    def gaps(row, outward, usual, at_random, cloud, *_):
        points = cloud.points
        of = np.flatnonzero((abs(points[row, 0] - 0.5) < 2 * SPACING) & (points[row, 1] < 4 * SPACING))
        return RimGaps(of, np.tile([0.0, -1, 0], (len(of), 1)), points[row[of], 1])

    points = jittered_grid()
    points = points[(abs(points[:, 0] - 0.5) > 2 * SPACING) | (points[:, 1] > 2.5 * SPACING)]
    surface = surface_of(points)
    deep = surface.points[below(surface, 4)[0], :2]
    deep = deep[(abs(deep[:, 0] - 0.5) < 2 * SPACING) & (deep[:, 1] > 2.5 * SPACING)]
    x = np.column_stack([deep[:, 0], np.full(len(deep), 0.2 * SPACING)])
    assert len(x) > 0
    assert share_covered(surface, x) == 0
    monkeypatch.setattr(rim_lines, "find_rim_gaps", gaps)
    assert share_covered(surface_of(points), x) == 1


@pytest.mark.parametrize(("width", "depth"), [(7, 5), (10, 4)])
def test_wide_bays_stay_open(width, depth, monkeypatch):
    """Of a bay hardly more is covered than without a look at gaps."""
    t = np.random.default_rng(1).random((400, 2))
    x = np.column_stack([0.5 + (t[:, 0] - 0.5) * width * SPACING, t[:, 1] * depth * SPACING])

    def covered():
        shares = []
        for seed in range(4):
            points = square(seed=seed)
            bay = (abs(points[:, 0] - 0.5) < width * SPACING / 2) & (points[:, 1] < depth * SPACING)
            shares.append(share_covered(surface_of(points[~bay]), x))
        return np.mean(shares)

    across = covered()
    monkeypatch.setattr(rim_lines, "find_rim_gaps", lambda *_: NONE)
    assert across < covered() + 0.05


def test_curved_rims_have_no_gaps():
    """A round hole's rim falls back from any straight line, by more than chance would leave."""
    points = square()
    radius = np.hypot(*(points - 0.5).T)
    surface = surface_of(points[radius > 6 * SPACING])
    rim = surface.rims.open
    row = np.flatnonzero(rim & (np.hypot(*(surface.points[:, :2] - 0.5).T) < 8 * SPACING))
    outward = 0.5 - surface.points[row] * [1, 1, 0] - [0, 0, 0.5]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    gaps = gaps_at(surface, row, outward)
    assert len(row) > 20
    assert len(gaps.of) <= 0.1 * len(row)


def test_evenly_spaced_samples_leave_no_gaps_by_chance():
    """A notch in the side of a grid is a notch."""
    grid = jittered_grid()
    surface = surface_of(grid[np.hypot(grid[:, 0] - 0.5, grid[:, 1]) > 2.2 * SPACING])
    assert not len(gaps_at(surface, *below(surface, 3)).of)


def test_a_sheet_that_ends_at_another_has_no_deep_gaps_there():
    """What looks like its rim is where the sheets meet."""
    points = np.column_stack([square(seed=1), np.zeros(2500)])
    points = points[np.hypot(points[:, 0] - 0.5, points[:, 1]) > 2 * SPACING]
    wall = square(seed=2) * [1, 0.5] - [0, 0.25]
    wall = np.column_stack([wall[:, 0], np.zeros(2500), wall[:, 1]])
    row = np.flatnonzero(points[:, 1] < 2.5 * SPACING)
    outward, normals = np.tile([0.0, -1, 0], (len(row), 1)), np.tile([0.0, 0, 1], (len(points), 1))

    def deepest(points, normals):
        cloud = Cloud.of(points, normals, local_spacing(points))
        return find_rim_gaps(row, outward, *spacing_around(row, cloud), cloud).depth.max()

    both = np.concatenate([points, wall]), np.concatenate([normals, np.tile([0.0, 1, 0], (2500, 1))])
    assert deepest(points, normals) > 2 * SPACING
    assert deepest(*both) < 1.3 * SPACING


def test_signs_of_normals_do_not_matter(random):
    surface = surface_of(square(900))
    row, outward = below(surface, 3)
    found = gaps_at(surface, row, outward)
    signs = random.choice([-1.0, 1.0], (len(surface.points), 1))
    turned = gaps_at(replace(surface, normals=signs * surface.normals), row, outward)
    np.testing.assert_array_equal(found.of, turned.of)
    np.testing.assert_allclose(found.depth, turned.depth, atol=0.01 * SPACING)


def test_without_rims_there_are_no_gaps():
    points = shapes.sphere(500)
    cloud = Cloud.of(points, points, local_spacing(points))
    none = find_rim_gaps(np.empty(0, int), np.empty((0, 3)), *np.empty((2, 0)), cloud)
    assert len(none.of) == len(none.up) == 0


@pytest.mark.parametrize(("points", "random"), [(square(), True), (jittered_grid(), False)])
def test_random_samples_are_told_from_even_ones(points, random):
    """The usual spacing is the median, whatever the sample's own."""
    surface = surface_of(points)
    cloud = Cloud.of(surface.points, surface.normals, surface.spacing)
    usual, at_random = spacing_around(np.arange(100), cloud)
    assert (at_random == random).mean() > 0.9
    np.testing.assert_allclose(usual, np.median(surface.spacing), rtol=0.3)
