"""Crossings against exact bands: steps of closed-form shapes, no samples in between."""

import numpy as np
import pytest

from core import Cancelled, estimate_normals
from core.field.grid import Grid, fit_grid, node_strides
from core.field.integration import BAND, distance_field
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.edges.crossings import _HAIR, Crossings, _beside, _in_whole_cells, _may_be_covered, find_crossings
from core.surface.edges.meetings import Meetings
from tests import shapes
from tests.bands import near_band

NO_MEETINGS = Meetings(*np.zeros((4, 0), bool))
GRID = Grid(np.array([-1.31, -1.29, -1.33]), 0.1, (28, 27, 28))


def exact_band(foot, surface):
    """The band of a shape of which `foot` gives the foot points (m,3) of positions (m,3)."""
    every = np.arange(np.prod(GRID.shape))
    at = GRID.positions(every)
    step = at - foot(at)
    near = np.linalg.norm(step, axis=1) <= BAND * GRID.spacing
    return near_band(GRID.shape, every[near], step[near], sample=surface.tree.query(at[near])[1])


def local(points, normals):
    return fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)


@pytest.fixture(scope="module")
def sphere():
    points = shapes.sphere(1500)
    surface = local(points, points)
    return exact_band(lambda x: x / np.linalg.norm(x, axis=1, keepdims=True), surface), surface


@pytest.fixture(scope="module")
def sphere_crossings(sphere):
    return find_crossings(*sphere, GRID)


def truly_crossed(inside):
    """Keys of the grid edges that a shape with `inside`, (nodes,) bool, crosses."""
    inside, keys = inside.reshape(GRID.shape), []
    node = np.arange(inside.size).reshape(GRID.shape)
    for axis in range(3):
        low = np.delete(node, -1, axis=axis)
        change = np.delete(inside, -1, axis=axis) != np.delete(inside, 0, axis=axis)
        keys.append(3 * low[change] + axis)
    return np.sort(np.concatenate(keys))


def test_a_sphere_crosses_the_edges_that_it_does(sphere_crossings):
    """As seen from nodes that are moved by the hair that keeps them off surfaces."""
    nodes = GRID.positions(np.arange(np.prod(GRID.shape))) + _HAIR * GRID.spacing
    found = 3 * sphere_crossings.node + sphere_crossings.axis
    true = truly_crossed(np.linalg.norm(nodes, axis=1) < 1)
    assert len(np.setxor1d(found, true)) < 0.005 * len(true)


def test_every_face_is_crossed_an_even_number_of_times(sphere_crossings):
    cells = sphere_crossings.cells_around(GRID)
    pairs = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    assert set(np.unique(pairs, axis=0, return_counts=True)[1]) == {2}


def test_places_lie_on_the_surface_and_on_their_edges(sphere_crossings):
    assert shapes.sphere_distance(sphere_crossings.place).max() < 0.02 * GRID.spacing
    low = GRID.positions(sphere_crossings.node)
    offset = (sphere_crossings.place - low) / GRID.spacing
    along = np.take_along_axis(offset, sphere_crossings.axis[:, None], axis=1)
    assert -0.6 < along.min() < along.max() < 1.6
    assert 0.4 < along.mean() < 0.6


def test_edges_in_whole_cells_have_four_of_them_around():
    shape = (5, 6, 7)
    marked = np.random.default_rng(0).random(shape) < 0.93
    band = near_band(shape, np.flatnonzero(marked), np.zeros((marked.sum(), 3)))
    lowest, _ = band.whole_cells(np.arange(len(band.node)))
    whole = np.zeros(np.array(shape) + 1, bool)
    whole[1:, 1:, 1:].flat[band.node[lowest]] = True
    edge = np.arange(3 * len(band.node))
    expected = []
    for row, axis in zip(*np.divmod(edge, 3), strict=True):
        at, sides = np.array(np.unravel_index(band.node[row], shape)) + 1, np.delete(np.eye(3, dtype=int), axis, axis=0)
        expected.append(all(whole[tuple(at - step @ sides)] for step in ((0, 0), (0, 1), (1, 0), (1, 1))))
    assert 5 < np.sum(expected) < 0.5 * len(edge)
    np.testing.assert_array_equal(_in_whole_cells(band, lowest, edge), expected)


def test_cells_around_an_edge_share_it():
    strides = node_strides(GRID.shape)
    assert strides.tolist() == [27 * 28, 28, 1]
    node = np.full(3, strides @ [5, 6, 7])
    crossings = Crossings(node, np.arange(3), np.zeros((3, 3)), np.zeros((3, 3)), NO_MEETINGS)
    for axis, around in enumerate(crossings.cells_around(GRID)):
        corners = np.stack(np.unravel_index(around, GRID.shape), axis=1) - [5, 6, 7]
        assert set(corners[:, axis]) == {0}
        assert sorted(map(tuple, np.delete(corners, axis, axis=1))) == [(-1, -1), (-1, 0), (0, -1), (0, 0)]
        assert (np.abs(corners - np.roll(corners, 1, axis=0)).sum(axis=1) == 1).all()


def test_nothing_is_crossed_past_the_rim():
    points = shapes.disc(1500)

    def foot(x):
        lateral = np.hypot(x[:, 0], x[:, 1])[:, None]
        return x * [1, 1, 0] / np.maximum(lateral, 1)

    surface = local(points, np.tile([0.0, 0, 1], (len(points), 1)))
    found = find_crossings(exact_band(foot, surface), surface, GRID)
    assert set(found.axis) == {2}
    lateral = np.linalg.norm(GRID.positions(found.node)[:, :2], axis=1)
    assert lateral.max() < 1 + 0.6 * GRID.spacing
    assert len(found.node) == pytest.approx(np.pi * (1 / GRID.spacing + 0.5) ** 2, rel=0.03)


def test_a_sheet_through_grid_nodes_is_one_plane_of_edges():
    """Every node of the plane takes the same side, so the sheet is flat and nothing in it is crossed."""
    plane = GRID.origin[2] + 13 * GRID.spacing
    points = shapes.square(1500) + np.array([0, 0, plane])
    surface = local(points, np.tile([0.0, 0, 1], (len(points), 1)))
    noise = np.random.default_rng(0).normal(scale=1e-9, size=(np.prod(GRID.shape), 3))
    band = exact_band(lambda x: np.clip(x, [-1, -1, plane], [1, 1, plane]) + noise[: len(x)], surface)
    found = find_crossings(band, surface, GRID)
    assert set(found.axis) == {2}
    assert len(set(np.unravel_index(found.node, GRID.shape)[2])) == 1


def test_a_band_without_a_whole_cell_crosses_nothing(sphere):
    band, surface = sphere
    found = find_crossings(near_band(GRID.shape, band.node[:1], band.step[:1]), surface, GRID)
    assert len(found.node) == 0


def test_stops_when_told(sphere):
    with pytest.raises(Cancelled):
        find_crossings(*sphere, GRID, lambda *_: False)


def test_an_edge_crossed_twice_changes_no_side():
    node, axis = np.array([500, 500, 500, 501]), np.array([0, 0, 1, 0])
    crossings = Crossings(node, axis, np.zeros((4, 3)), np.zeros((4, 3)), NO_MEETINGS)
    assert crossings.changing_sides.tolist() == [1501, 1503]


@pytest.mark.parametrize("name", ["sphere", "disc", "junction"])
def test_edges_left_unprojected_change_nothing(name, monkeypatch):
    points = {"sphere": shapes.sphere(1000), "disc": shapes.disc(500), "junction": shapes.junction(1500)}[name]
    spacing = local_spacing(points)
    normals, confidence, _ = estimate_normals(points, spacing)
    surface = fit_local_surface(points, normals, confidence, spacing, 3.0)
    grid = fit_grid(points, 64)
    _, band = distance_field(surface, grid)
    found = find_crossings(band, surface, grid)
    spared = []

    def all_of_them(band, edge, share, grid):
        spared.append((~_may_be_covered(band, edge, share, grid)).mean())
        return np.ones(len(edge), bool)

    def all_nodes(band, row):
        spared.append((~_beside(band, row)).mean())
        return np.ones(len(band.node), bool)

    monkeypatch.setattr("core.surface.edges.crossings._may_be_covered", all_of_them)
    monkeypatch.setattr("core.surface.edges.crossings._beside", all_nodes)
    expected = find_crossings(band, surface, grid)
    assert min(spared) > 0.3
    assert len(found.node) > 500
    np.testing.assert_array_equal(found.node, expected.node)
    np.testing.assert_array_equal(found.axis, expected.axis)
    np.testing.assert_allclose(found.place, expected.place, atol=1e-6)
