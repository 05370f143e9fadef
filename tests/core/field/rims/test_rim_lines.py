"""Rims by lines through the outermost samples, on shapes whose rims are known. Lengths are local spacings of 0.02."""

from dataclasses import replace

import numpy as np
import pytest

from core.field.local_surface import fit_local_surface
from core.field.rims.borders import RIM, chains, find_rims
from core.field.rims.rim_lines import _at_rims, with_rim_lines
from core.neighbourhoods.cloud import Cloud
from core.points import local_spacing
from tests import shapes


def flat(points):
    points = np.column_stack([points, np.zeros(len(points))])
    normals = np.tile([0.0, 0, 1], (len(points), 1))
    return points, normals, local_spacing(points)


def rims_of(points, normals, spacing):
    """Without lines and with them."""
    cloud = Cloud.of(points, normals, spacing)
    rims = find_rims(cloud, np.zeros((len(points), 3, 3)), 3.0)
    return rims, with_rim_lines(rims, cloud)


def scattered(n=2500, seed=0):
    return np.random.default_rng(seed).random((n, 2))


def surface_of(points):
    points, normals, spacing = flat(points)
    return fit_local_surface(points, normals, np.ones(len(points)), spacing, 3.0)


def test_scattered_samples_of_a_square_give_its_sides():
    """Nearer on average than sheets that end at a fixed margin past their samples."""
    points, normals, spacing = flat(scattered())
    surface = surface_of(points[:, :2])
    side = np.linspace(0.05, 0.95, 200)
    x = np.concatenate([np.column_stack([side, 0 * side + end]) for end in (-0.1, 1.1)])
    x = np.column_stack([np.concatenate([x, x[:, ::-1]]), np.zeros(800)])
    off = np.abs(surface.project(x).distance - 0.1)
    plain, _ = rims_of(points, normals, spacing)
    fixed = replace(surface, rims=plain)
    before = np.abs(fixed.project(x).distance - 0.1)
    assert off.mean() < 0.6 * before.mean()


@pytest.mark.parametrize(("n", "seed"), [(400, 3), (400, 6), (3000, 1)])
def test_rims_across_gaps_at_corners_stop_at_the_other_side(n, seed):
    """Without that they ran out of the square by 2 to 2.6 mean distances between samples."""
    surface, apart = surface_of(scattered(n, seed)), np.sqrt(1 / n)
    at = np.arange(-4, 1 / apart + 4, 0.25) * apart
    x = np.stack(np.meshgrid(at, at, [0.0]), axis=3).reshape(-1, 3)
    away = np.linalg.norm(np.maximum(np.maximum(x - 1, -x), 0)[:, :2], axis=1)
    x, away = x[(away > 0) & (away < 4 * apart)], away[(away > 0) & (away < 4 * apart)]
    assert (surface.project(x).distance > away - apart).all()


def test_a_gap_in_the_sampling_of_a_straight_rim_is_closed():
    points = lattice()
    surface = surface_of(points[np.linalg.norm(points - [0.5, 0.0], axis=1) > 0.03])
    x = np.column_stack([np.linspace(0.48, 0.52, 9), np.full(9, 0.004), np.zeros(9)])
    assert surface.project(x).distance.max() < 0.002


def test_a_bay_stays_open():
    """A wedge of forty degrees is no gap in the sampling: its sides move by a spacing at most."""
    points = lattice()
    surface = surface_of(points[np.abs(points[:, 0] - 0.5) > 0.4 * (0.3 - points[:, 1])])
    x = np.column_stack([np.full(20, 0.5), np.linspace(0.0, 0.15, 20), np.zeros(20)])
    away = 0.4 * (0.3 - x[:, 1]) / np.hypot(1, 0.4)
    assert (surface.project(x).distance > away - 0.02).all()


def lattice():
    """A square of samples at random in the cells of a grid of 0.02, its sides sampled too."""
    i = np.stack(np.meshgrid(np.arange(50), np.arange(50)), axis=2).reshape(-1, 2)
    return np.clip(0.02 * (i + np.random.default_rng(0).uniform(-0.3, 0.3, i.shape)), 0, 0.98)


def test_a_closed_surface_has_no_lines():
    points = shapes.sphere(500)
    plain, lined = rims_of(points, points, local_spacing(points))
    assert lined is plain


def test_short_chains_are_no_rims():
    """Four samples around a hole in a grid keep the fixed margin, the grid's own rim does not."""
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    grid = np.column_stack([x.ravel(), y.ravel()])
    hole = np.abs(grid - 19.5).max(axis=1) < 1
    points, normals, spacing = flat(grid[~hole] * 0.02)
    plain, lined = rims_of(points, normals, spacing)
    rim = (grid[~hole] % 39 == 0).any(axis=1)
    np.testing.assert_array_equal(lined.margin[~rim], plain.margin[~rim])
    corner = (grid[~hole] % 39 == 0).all(axis=1)
    assert (lined.margin[rim & ~corner, 0] < 0.5 * RIM * spacing[rim & ~corner]).all()


def test_signs_of_normals_do_not_matter(random):
    points, normals, spacing = flat(scattered(900))
    _, lined = rims_of(points, normals, spacing)
    _, turned = rims_of(points, normals * random.choice([-1.0, 1.0], (len(points), 1)), spacing)
    rim = lined.open
    for margin in (lambda rims: rims.margin[rim, 0], lambda rims: np.sort(rims.margin[rim, 1:], axis=1)):
        np.testing.assert_allclose(margin(turned), margin(lined), atol=0.05 * spacing.mean())


def test_short_rows_are_rims_where_more_than_half_around_them_is_empty():
    rims, _ = rims_of(*flat(scattered()))
    rim = rims.open
    chain = chains(rims, rim)
    row = np.flatnonzero(chain == np.bincount(chain).argmax())
    assert _at_rims(rims)[row].all()
    for count, opening, found in (
        (3, -0.1, False),
        (6, -0.1, True),
        (6, 0.1, False),
        (11, 0.1, False),
        (30, 0.1, True),
    ):
        short = np.isin(np.arange(len(rim)), _in_a_row(rims, row, count))
        left = replace(rims, gap=short, opening=np.where(short, opening, rims.opening))
        np.testing.assert_array_equal(_at_rims(left), short & found)


def _in_a_row(rims, row, count):
    """So many of the samples in a row, one beside the next."""
    chosen = [row[0]]
    for sample in chosen:
        chosen += [other for other in rims.beside[sample].tolist() if other in row and other not in chosen]
        if len(chosen) >= count:
            return chosen[:count]
    return chosen
