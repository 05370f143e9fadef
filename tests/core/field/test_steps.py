"""Distances read between the nodes, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from core import Settings, reconstruct
from core.field.grid import CORNERS, fit_grid
from core.field.integration import distance_field
from core.field.local_surface import fit_local_surface
from core.field.narrow_band import banded_field
from core.points import local_spacing
from tests import shapes
from tests.bands import near_band

SHAPE = (24, 20, 28)


def band(foot_of, width=2.0):
    """Nodes of the grid within `width` cells of a surface given by its foot points, and the steps to them."""
    nodes = np.indices(SHAPE).reshape(3, -1).T.astype(float)
    step = nodes - foot_of(nodes)
    near = np.flatnonzero(np.linalg.norm(step, axis=1) <= width)
    return near_band(SHAPE, near, step[near])


def distances(band, x):
    row, step = band.between(x, 1.0)
    return row, np.linalg.norm(step, axis=1)


def onto_plane(normal, offset):
    normal = np.array(normal) / np.linalg.norm(normal)
    return lambda x: x - (x @ normal - offset)[:, None] * normal


def positions(seed=0, count=4000):
    return np.random.default_rng(seed).uniform(0, np.array(SHAPE) - 1, (count, 3))


@pytest.mark.parametrize("normal", [(0, 0, 1), (1, 2, 3)])
def test_plane_is_exact_on_and_off_the_surface(normal):
    foot = onto_plane(normal, 9.3)
    x = np.concatenate([positions(), foot(positions(1))])
    x = x[((x >= 0) & (x <= np.array(SHAPE) - 1)).all(axis=1)]
    true = np.linalg.norm(x - foot(x), axis=1)
    row, distance = distances(band(foot), x)
    assert np.isin(np.flatnonzero(true < 0.2), row).all()
    np.testing.assert_allclose(distance, true[row], atol=1e-9)


def test_straight_rim_and_single_point_are_exact():
    rim = lambda x: np.stack([x[:, 0], np.full(len(x), 9.4), np.full(len(x), 13.7)], axis=1)  # noqa: E731
    point = lambda x: np.tile([11.2, 9.4, 13.7], (len(x), 1))  # noqa: E731
    for foot in (rim, point):
        x = positions(count=40000)
        row, distance = distances(band(foot), x)
        assert len(row) > 20
        np.testing.assert_allclose(distance, np.linalg.norm(x - foot(x), axis=1)[row], atol=1e-9)


def test_sphere_errs_by_the_square_of_a_cell():
    centre, radius = np.array([11.5, 9.5, 13.5]), 7.0
    foot = lambda x: centre + radius * (x - centre) / np.linalg.norm(x - centre, axis=1, keepdims=True)  # noqa: E731
    x = foot(positions())
    row, distance = distances(band(foot), x)
    assert len(row) > 0.99 * len(x)
    assert distance.max() < 1 / radius
    assert distance.mean() < 0.25 / radius


@pytest.mark.parametrize("gap", [2.0, 2.5, 3.5])
def test_no_sheet_appears_midway_between_two(gap):
    low, high = 13.0 - gap / 2, 13.0 + gap / 2

    def foot(x):
        return np.column_stack([x[:, :2], np.where(x[:, 2] < 13.2, low, high)])

    x = positions()
    x[:, 2] = np.random.default_rng(2).uniform(low - 1, high + 1, len(x))
    true = np.minimum(np.abs(x[:, 2] - low), np.abs(x[:, 2] - high))
    row, distance = distances(band(foot), x)
    assert np.abs(distance - true[row]).max() < 0.5


def test_edges_have_both_ends_in_the_band_and_end_at_the_sides_of_the_box():
    shape, marked = (4, 5, 6), np.random.default_rng(0).random((4, 5, 6)) < 0.6
    node = np.flatnonzero(marked)
    band = near_band(shape, node, np.zeros((len(node), 3)))
    for axis in range(3):
        expected = np.moveaxis(marked, axis, 0)[:-1] & np.moveaxis(marked, axis, 0)[1:]
        at = np.argwhere(np.moveaxis(np.insert(expected, len(expected), False, axis=0), 0, axis))
        low, high = (np.ravel_multi_index(tuple((at + step).T), shape) for step in (0, np.eye(3, dtype=int)[axis]))
        found = band.edges(axis)
        np.testing.assert_array_equal(node[found[0]], low)
        np.testing.assert_array_equal(node[found[1]], high)


def random_band(share=0.6, shape=(4, 5, 6)):
    """A band of some nodes of a small grid, and a table of their rows, -1 for the others, with a layer of -1 around."""
    node = np.flatnonzero(np.random.default_rng(1).random(shape) < share)
    table = np.full(np.array(shape) + 2, -1)
    table[1:-1, 1:-1, 1:-1].flat[node] = 0
    table[table == 0] = np.arange(len(node))
    return near_band(shape, node, np.zeros((len(node), 3))), table


def test_neighbours_are_those_of_the_grid_and_steps_may_follow_each_other():
    band, table = random_band()
    at = np.argwhere(table >= 0)
    for axis, way in enumerate(np.eye(3, dtype=int)):
        for found, step in ((band.ahead, way), (band.behind, -way)):
            np.testing.assert_array_equal(found[axis, :-1], table[tuple((at + step).T)])
    assert (band.ahead[:, -1] == -1).all()
    assert (band.behind[:, -1] == -1).all()


def test_whole_cells_are_those_with_eight_corners_in_the_band():
    band, table = random_band(0.85)
    at = np.argwhere(table >= 0)
    corner = np.stack([table[tuple((at + step).T)] for step in CORNERS])
    expected = np.flatnonzero((corner >= 0).all(axis=0))
    assert 5 < len(expected) < 0.5 * len(at)
    asked = np.append(np.arange(len(at)), -1)
    whole, found = band.whole_cells(asked)
    np.testing.assert_array_equal(whole, expected)
    np.testing.assert_array_equal(found, corner[:, expected])
    turned = band.whole_cells(asked[::-1])
    np.testing.assert_array_equal(asked[::-1][turned[0]], expected[::-1])
    np.testing.assert_array_equal(turned[1], corner[:, expected[::-1]])


def test_nodes_know_their_nearest_sample():
    points = shapes.sphere(800)
    surface = fit_local_surface(points, points, np.ones(len(points)), local_spacing(points), 3.0)
    grid = fit_grid(points, 24)
    for band in (distance_field(surface, grid)[1], banded_field(surface, grid, 4.0)[1]):
        away = np.linalg.norm(grid.positions(band.node) - points[band.sample], axis=1)
        np.testing.assert_allclose(away, surface.tree.query(grid.positions(band.node))[0])


def test_positions_away_from_the_band_are_left_out():
    row, _ = distances(band(onto_plane((0, 0, 1), 5.0)), positions())
    assert len(row)
    assert (np.abs(positions()[row, 2] - 5.0) < 3).all()


def test_steps_lead_to_the_foot_points_and_those_past_rims_can_be_left_out():
    foot, x = onto_plane((1, 2, 3), 9.3), positions()
    known = band(foot)
    at = np.stack(np.unravel_index(known.node, SHAPE), axis=1)
    rimmed = replace(known, past_rim=at[:, 0] > 11)
    row, step = rimmed.between(x, 1.0)
    np.testing.assert_allclose(step, (x - foot(x))[row], atol=1e-9)
    fewer, _ = rimmed.between(x, 1.0, off_rims=True)
    np.testing.assert_array_equal(fewer, row[x[row, 0] < 11])


@pytest.mark.parametrize("band", [None, 4])
def test_a_field_is_zero_on_its_surface_and_stays_a_distance_beside_it(band):
    points = shapes.sphere(1500)
    field = reconstruct(3 * points + 7, Settings(resolution=40, surface="none", band=band)).field
    on = 3 * shapes.scattered_sphere(1000) + 7
    assert field.sample(on).mean() < 0.02 * field.spacing
    off = 7 + (on - 7) * np.random.default_rng(0).uniform(0.9, 1.1, (1000, 1))
    np.testing.assert_allclose(field.sample(off), np.abs(np.linalg.norm(off - 7, axis=1) - 3), atol=0.1 * field.spacing)
