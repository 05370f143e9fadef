"""Sides of nodes, from exact distances and crossings of balls."""

from dataclasses import replace

import numpy as np
import pytest

from core.field.grid import Grid
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.progress import Progress
from core.surface.edges.crossings import Crossings
from core.surface.edges.meetings import Meetings
from core.surface.signs.sides import Sides, _numbered, _sides, find_sides, may_be_closed
from tests import shapes

NO_MEETINGS = Meetings(*np.zeros((4, 1500), bool))
GRID = Grid(np.full(3, -1.41), 0.1, (29, 29, 29))
RADIUS = np.linalg.norm(GRID.positions(np.arange(29**3)), axis=1).reshape(GRID.shape)


@pytest.fixture(scope="module")
def surface():
    points = shapes.sphere(1500)
    return fit_local_surface(points, points, np.ones(len(points)), local_spacing(points), 3.0)


def crossings_of(inside):
    node, axis = [], []
    flat = np.arange(inside.size).reshape(inside.shape)
    for a in range(3):
        change = np.delete(inside, -1, axis=a) != np.delete(inside, 0, axis=a)
        node.append(np.delete(flat, -1, axis=a)[change])
        axis.append(np.full(change.sum(), a))
    node, axis = np.concatenate(node), np.concatenate(axis)
    return Crossings(node, axis, GRID.positions(node), np.zeros((len(node), 3)), NO_MEETINGS)


def without(crossings, dropped):
    kept = (array[~dropped] for array in (crossings.node, crossings.axis, crossings.place))
    return Crossings(*kept, crossings.normal[~dropped], NO_MEETINGS)


@pytest.mark.parametrize(
    ("inside", "distance"),
    [
        (RADIUS < 1, np.abs(RADIUS - 1)),
        ((RADIUS < 1) & (RADIUS > 0.5), np.minimum(np.abs(RADIUS - 1), np.abs(RADIUS - 0.5))),  # hollow
        (np.zeros(GRID.shape, bool), np.full(GRID.shape, 9.0)),
    ],
)
def test_exact_crossings_give_exact_sides(surface, inside, distance):
    sides = find_sides(distance, crossings_of(inside), surface, GRID)
    np.testing.assert_array_equal(sides.inside, inside)
    assert (sides.share, sides.spanned, sides.largest, len(sides.alike)) == (0, 0, 0, 0)
    assert sides.closed
    assert sides.complete


@pytest.mark.parametrize("share", [0.02, 0.1, 0.2])
def test_missing_crossings_are_outvoted(surface, share):
    """At random, out of all; what is spanned says how many."""
    crossings = crossings_of(RADIUS < 1)
    dropped = np.random.default_rng(0).random(len(crossings.node)) < share
    sides = find_sides(np.abs(RADIUS - 1), without(crossings, dropped), surface, GRID)
    assert (sides.inside != (RADIUS < 1)).sum() <= share * 100
    assert sides.spanned == pytest.approx(share / (1 - share), rel=0.5)


@pytest.mark.parametrize(("height", "closed"), [(0.99, True), (0.4, False), (-0.2, False)])
def test_a_wide_opening_lets_the_outside_in(surface, height, closed):
    """A sphere without its cap: no crossings there, and distances to the rest."""
    crossings = crossings_of(RADIUS < 1)
    z = GRID.origin[2] + GRID.spacing * np.arange(29)
    above = (z > height * RADIUS) & (RADIUS > 0)
    lateral = np.sqrt(np.maximum(RADIUS**2 - z**2, 0))
    rim = np.hypot(lateral - np.sqrt(1 - height**2), z - height)
    opened = without(crossings, crossings.place[:, 2] > height)
    sides = find_sides(np.where(above, rim, np.abs(RADIUS - 1)), opened, surface, GRID)
    assert sides.closed == closed
    if not closed:
        assert not sides.complete
        assert sides.share > 0.5
        assert not sides.within.any()
        np.testing.assert_allclose(np.linalg.norm(sides.alike, axis=1), 1, atol=GRID.spacing)


def test_an_inner_wall_has_the_inside_on_both_faces(surface):
    inside = RADIUS < 1
    crossings = crossings_of(inside)
    flat = np.arange(inside.size).reshape(inside.shape)
    wall = flat[:, :, 14][inside[:, :, 14] & inside[:, :, 15]]
    both = Crossings(
        np.concatenate([crossings.node, wall]),
        np.concatenate([crossings.axis, np.full(len(wall), 2)]),
        np.concatenate([crossings.place, GRID.positions(wall)]),
        np.zeros((len(crossings.node) + len(wall), 3)),
        NO_MEETINGS,
    )
    z = GRID.origin[2] + GRID.spacing * np.arange(29)
    distance = np.minimum(np.abs(RADIUS - 1), np.hypot(z - 0.04, np.maximum(RADIUS - 1, 0)))
    sides = find_sides(distance, both, surface, GRID)
    assert not sides.complete
    assert sides.within.mean() > 0.9
    assert sides.share > 0.05


def ball_and_square(share):
    """A ball of radius 1/2 below an open square, of which that share of the samples is: distances to both, whether
    nodes lie inside the ball, crossings, how many of them are the square's, and the surface."""
    count = int(share * 1500)
    height = GRID.positions(np.arange(29**3)).reshape(*GRID.shape, 3) - [0, 0, 0.96]
    ball = np.linalg.norm(height - [0, 0, -1.46], axis=-1)
    square = np.linalg.norm(np.maximum(np.abs(height) - [0.8, 0.8, 0], 0), axis=-1)
    flat = np.arange(29**3).reshape(GRID.shape)
    above = flat[(np.abs(height[..., :2]) < 0.8).all(axis=-1) & (height[..., 2] < 0) & (height[..., 2] > -0.1)]
    around = crossings_of(ball < 0.5)
    both = Crossings(
        np.append(around.node, above),
        np.append(around.axis, np.full(len(above), 2)),
        np.zeros((len(around.node) + len(above), 3)),
        np.zeros((len(around.node) + len(above), 3)),
        NO_MEETINGS,
    )
    place = np.random.default_rng(0).uniform([-0.8, -0.8, 0.96], [0.8, 0.8, 0.96], (count, 3))
    out = shapes.sphere(1500 - count)
    normals = np.concatenate([np.tile([0.0, 0.0, 1.0], (count, 1)), out])
    points = np.concatenate([place, [0, 0, -0.5] + 0.5 * out])
    surface = fit_local_surface(points, normals, np.ones(1500), np.full(1500, 0.06), 3.0)
    return np.minimum(np.abs(ball - 0.5), square), ball < 0.5, both, len(above), surface


@pytest.mark.parametrize(("share", "inside_found"), [(0.0, True), (0.4, True), (0.6, False), (1.0, False)])
def test_with_the_outside_on_both_sides_of_most_samples_nothing_is_inside(share, inside_found):
    distance, in_ball, crossings, above, surface = ball_and_square(share)
    sides = find_sides(distance, crossings, surface, GRID)
    np.testing.assert_array_equal(sides.inside, in_ball & inside_found)
    assert sides.share == pytest.approx(above / len(crossings.node) if inside_found else 1.0)
    assert not sides.within.any()
    assert sides.spanned == 0


@pytest.mark.parametrize(("share", "expected"), [(0.0, True), (0.04, True), (0.1, False), (0.4, False), (1.0, False)])
def test_a_shape_with_the_outside_on_both_sides_of_many_samples_is_not_closed(share, expected):
    distance, _, _, _, surface = ball_and_square(share)
    assert may_be_closed(distance, surface, GRID) == expected


def test_walls_so_close_that_no_region_lies_between_may_be_closed(surface):
    """Then no sample has a region on both sides."""
    assert may_be_closed(np.where(RADIUS > 1, RADIUS - 1, 0.0), surface, GRID)


@pytest.mark.parametrize("beside", [False, True])
def test_a_speck_is_no_inside_but_between_sheets_side_by_side(surface, beside):
    """Crossings around a single node that is far from everything else."""
    inside = RADIUS < 1
    inside[2, 2, 2] = True
    distance = np.abs(RADIUS - 1)
    distance[1:4, 1:4, 1:4] = 0.05
    near = np.linalg.norm(surface.points - (GRID.origin + 2 * GRID.spacing), axis=1) < 1.2
    crossings = replace(crossings_of(inside), meetings=NO_MEETINGS.with_beside(near & beside))
    np.testing.assert_array_equal(
        find_sides(distance, crossings, surface, GRID).inside, inside if beside else RADIUS < 1
    )


def test_a_hollow_speck_leaves_nothing_behind(surface):
    """The node in its middle is of the outside around it once the speck is."""
    inside, distance = RADIUS < 1, np.abs(RADIUS - 1)
    inside[2:5, 2:5, 2:5], distance[1:6, 1:6, 1:6] = True, 0.05
    inside[3, 3, 3] = False
    sides = find_sides(distance, crossings_of(inside), surface, GRID)
    np.testing.assert_array_equal(sides.inside, RADIUS < 1)


def test_specks_alone_make_no_inside(surface):
    """As those between the layers of a folded cloth."""
    inside, distance = np.zeros(GRID.shape, bool), np.full(GRID.shape, 9.0)
    inside[2, 2, 2] = True
    distance[1:4, 1:4, 1:4] = 0.05
    crossings = replace(crossings_of(inside), meetings=NO_MEETINGS.with_beside(np.ones(1500, bool)))
    assert not find_sides(distance, crossings, surface, GRID).inside.any()


def test_sides_are_the_least_frustrated_state():
    """Against the dense equations; clusters that edges join several times, one of them outside."""
    rng, n, outside = np.random.default_rng(0), 40, 7
    a, b = rng.integers(0, n, (2, 300))
    crossed = rng.random(300) < 0.2
    matrix = np.zeros((n, n))
    for i, j, weight in zip(a, b, np.where(crossed, -1.0, 1.0), strict=True):
        if i != j:
            matrix[[i, j], [i, j]] += 1
            matrix[[i, j], [j, i]] -= weight
    free = np.arange(n) != outside
    expected = np.ones(n)
    expected[free] = np.linalg.solve(matrix[free][:, free], -matrix[free, outside])
    parts = [(a[:100], b[:100], crossed[:100]), (a[100:], b[100:], crossed[100:])]
    found = _sides(parts, n, outside, Progress())
    np.testing.assert_allclose(found, expected, atol=0.01)


def test_nodes_far_from_the_surface_share_their_unknowns_in_groups():
    """Of the nodes of a box, those of its lower half alone."""
    grid = Grid(np.zeros(3), 0.1, (5, 4, 6))
    node = np.arange(5 * 4 * 6)
    at = np.stack(np.unravel_index(node, grid.shape), axis=1)
    alone = at[:, 0] < 2
    number, n = _numbered(node, alone, grid)
    assert n == alone.sum() + 2 * 2 * 3
    np.testing.assert_array_equal(np.unique(number), np.arange(n))
    same = number[:, None] == number
    grouped = (at[:, None] // 2 == at // 2).all(axis=2) & ~alone & ~alone[:, None]
    np.testing.assert_array_equal(same, grouped | np.eye(len(node), dtype=bool))


def test_signs():
    values = np.ones((2, 2, 2), np.float32)
    inside, nowhere = np.zeros((2, 2, 2), bool), np.empty((0, 3))
    inside[0] = True
    signed = Sides(inside, nowhere, np.empty(0, bool), nowhere, nowhere, 0, GRID).sign(values)
    assert signed.dtype == np.float32
    np.testing.assert_array_equal(signed, np.where(inside, -1, 1))
