"""Which samples have several sheets near them, and what is known of the sheets there."""

import numpy as np
import pytest

from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.edges.meeting_edges import _least
from core.surface.edges.meetings import Meetings, _goes_past, _grown, _linked, _of_lines, find_meetings
from core.surface.edges.sheets import sheets_near
from tests import shapes


def fitted(points, normals):
    return fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)


def crossed(degrees=90):
    """Two squares that cross along the y axis at some angle, z = 0 and, at a right one, x = 0."""
    flat, c, s = shapes.square(1200), np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    normals = np.repeat([[0, 0, 1], [s, 0, -c]], len(flat), axis=0)
    other = flat[:, :1] * [c, 0, s] + flat[:, 1:2] * [0, 1, 0]
    return fitted(np.concatenate([flat, other + np.array([0, 0, 1e-3])]), normals)


def ended(turned):
    """A floor, z = 0, and a wall, x = 0, that ends on it."""
    flat = shapes.square(1200)
    wall = flat[:, [2, 1, 0]] + np.array([0, 0, 1.02])
    normals = np.repeat(np.eye(3)[[2, 0]], len(flat), axis=0)
    if turned:
        return fitted(np.concatenate([wall, flat]), normals[::-1])
    return fitted(np.concatenate([flat, wall]), normals)


def cube():
    """With the normals of its faces."""
    points = shapes.cube(2400)
    normals = np.zeros_like(points)
    normals[np.arange(len(points)), np.abs(points).argmax(axis=1)] = 1
    return fitted(points, normals)


@pytest.mark.parametrize("name", ["sphere", "torus", "cube"])
def test_one_sheet_meets_none(name):
    """Not even at the edges of a cube, where two faces end."""
    if name == "cube":
        surface = cube()
    elif name == "sphere":
        surface = fitted(shapes.sphere(1000), shapes.sphere(1000))
    else:
        points = shapes.torus(2000)
        ring = points * [1, 1, 0] / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
        surface = fitted(points, (points - ring) / 0.4)
    assert not find_meetings(surface).at.any()


def test_samples_are_linked_by_one_that_is_alike_to_both():
    rng, n, k = np.random.default_rng(0), 60, 6
    nearest = np.column_stack([np.arange(n), *(rng.permutation(n)[:n] for _ in range(k - 1))])
    alike, sure = rng.random((n, k)) < 0.4, rng.random(n) < 0.8
    near = np.zeros((n, n), bool)
    for i, j in np.argwhere(alike):
        near[i, nearest[i, j]] |= sure[i] & sure[nearest[i, j]]
    near |= near.T
    i, j = rng.integers(0, n, (2, 500))
    expected = [(near[a] & near[b]).any() for a, b in zip(i, j, strict=True)]
    assert 0.1 < np.mean(expected) < 0.9
    np.testing.assert_array_equal(_linked(i, j, nearest, alike, sure), expected)


@pytest.mark.parametrize("turned", [False, True])
def test_a_sheet_goes_past_another_where_it_has_samples_on_both_sides(turned):
    """A floor goes past a wall that ends on it, and the wall not past the floor, in either order."""
    surface = ended(turned)
    middle = np.hypot(surface.points[:, 0], surface.points[:, 2]) < 2 * np.median(surface.spacing)
    near = np.flatnonzero(middle & (np.abs(surface.points[:, 1]) < 0.6))
    i, j = (each.reshape(-1) for each in np.meshgrid(near, near))
    close = np.linalg.norm(surface.points[i] - surface.points[j], axis=1) < 2 * np.median(surface.spacing)
    same = surface.normals[i, 2] == surface.normals[j, 2]
    for found in _goes_past(i, j, surface):
        assert (found[~same & close] == 1).mean() > 0.9
        assert not found[same].any()
    meet = find_meetings(surface)
    assert meet.at.sum() > 50
    assert meet.through.sum() < 0.05 * meet.at.sum()
    assert not meet.pass_through
    assert not (meet.beside | meet.passing).any()


def test_three_sheets_that_end_at_one_line_meet_there():
    """Any two of them are a crease."""
    flat, normals, points = shapes.square(1200, side=1.0) + np.array([0.51, 0, 0]), [], []
    for angle in np.radians([0, 120, 240]):
        c, s = np.cos(angle), np.sin(angle)
        points.append(flat[:, :1] * [c, 0, s] + flat[:, 1:2] * [0, 1, 0])
        normals.append(np.repeat([[s, 0, -c]], len(flat), axis=0))
    for count, meet in ((2, False), (3, True)):
        surface = fitted(np.concatenate(points[:count]), np.concatenate(normals[:count]))
        away = np.hypot(surface.points[:, 0], surface.points[:, 2]) / np.median(surface.spacing)
        found = find_meetings(surface).at
        assert (found[(away < 1.5) & (np.abs(surface.points[:, 1]) < 0.4)] == meet).all()
        assert not found[away > 9].any()


def test_crossing_squares_meet_along_their_line_only():
    surface = crossed()
    away = np.hypot(surface.points[:, 0], surface.points[:, 2]) / np.median(surface.spacing)
    meet = find_meetings(surface)
    found = meet.at
    inside = np.abs(surface.points[:, 1]) < 0.8
    assert found[(away < 1) & inside].all()
    assert not found[away > 9].any()
    assert meet.through.sum() > 0.25 * found.sum()
    assert meet.pass_through
    assert meet.passing[(away < 1.5) & inside].all()
    assert not meet.passing[away > 6].any()


@pytest.mark.parametrize("degrees", [60, 45, 35])
def test_squares_that_cross_askew_meet_along_their_line_only(degrees):
    """Followed over 60 samples, neither went far enough past the other at 35 degrees."""
    surface = crossed(degrees)
    away = np.hypot(surface.points[:, 0], surface.points[:, 2]) / np.median(surface.spacing)
    inside = np.abs(surface.points[:, 1]) < 0.8
    meet = find_meetings(surface)
    assert meet.at[(away < 1.5) & inside].all()
    assert meet.through.sum() > 0.2 * meet.at.sum()
    assert meet.passing[(away < 1.5) & inside].all()
    assert not (meet.at | meet.passing)[away > 9].any()
    assert not meet.side_by_side


@pytest.mark.parametrize(("through", "line", "expected"), [(12, False, True), (8, False, False), (8, True, True)])
def test_few_samples_show_sheets_that_pass_through_each_other_only_along_a_line(through, line, expected):
    """Of 2000, 20 at meetings, as at the ears and toes of a figure."""
    number = np.arange(2000)
    meet = Meetings(number < 20, number < through, number < 0, (number < 30) & line)
    assert not meet.few
    assert meet.pass_through is expected


@pytest.mark.parametrize(("at", "beside", "expected"), [(20, 2, True), (20, 1, False), (9, 9, False)])
def test_few_samples_show_no_sheets_side_by_side(at, beside, expected):
    """Of 2000: as few as are at meetings by chance on rugged ground had its single layer taken for a torn one."""
    number = np.arange(2000)
    meet = Meetings(number < at, number < 0, number < beside, number < 0)
    assert meet.side_by_side is expected


@pytest.mark.parametrize(("more", "expected"), [(5, False), (6, True)])
def test_few_samples_more_at_meetings_or_beside_others_may_be_chance(more, expected):
    """Of 1,000, at most five, none of them at meetings before."""
    number, none = np.arange(1000), np.zeros(1000, bool)
    meet = Meetings(number < 100, none, number < 50, none)
    others = number < 50 + more
    assert (meet.with_beside(others) is not meet) == expected
    assert Meetings(number < 100 + more, none, none, none).adds_to(meet) == expected
    assert not Meetings(number < 10, none, others, none).adds_to(meet)


def test_samples_beside_others_are_at_meetings():
    number, none = np.arange(1000), np.zeros(1000, bool)
    meet = Meetings(number < 100, none, number < 50, number > 800).with_beside(number >= 900)
    np.testing.assert_array_equal(meet.at, (number < 100) | (number >= 900))
    np.testing.assert_array_equal(meet.beside, (number < 50) | (number >= 900))
    np.testing.assert_array_equal(meet.passing, number > 800)


def test_samples_that_are_few_of_those_around_them_show_no_line():
    """Along a row of samples, each beside the twelve next to it."""
    n = 200
    nearest = (np.arange(n)[:, None] + np.concatenate([[0], *([-k, k] for k in range(1, 7))])) % n
    many, sparse, short = (np.zeros(n, bool) for _ in range(3))
    many[20:76:2], sparse[100:190:4], short[2:10] = True, True, True
    np.testing.assert_array_equal(_of_lines(many | sparse | short, nearest), many)
    sparse[100:190] = True
    np.testing.assert_array_equal(_of_lines(many | sparse | short, nearest), many | sparse)


def test_weak_marks_count_where_others_lead_to_a_sure_one():
    """Along a row of samples, each beside the four next to it."""
    n = 60
    nearest = (np.arange(n)[:, None] + [0, -1, 1, -2, 2]) % n
    sure, weak = np.zeros(n, bool), np.zeros(n, bool)
    sure[10], weak[5:20] = True, True
    weak[[22, 23]], weak[30:40] = True, True  # two steps on, and too far
    weak[12] = weak[15] = False
    expected = weak & (np.arange(n) < 20)
    np.testing.assert_array_equal(_grown(sure, weak, nearest), expected)
    assert not _grown(np.zeros(n, bool), weak, nearest).any()


def test_sheets_side_by_side_meet():
    """At .7 spacings, seen by samples beyond the nearest few."""
    points = shapes.sheets(2400, gap=0.04)
    surface = fitted(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))
    assert 0.8 * np.median(surface.spacing) > 0.04
    inner = (np.abs(points[:, :2]) < 0.8).all(axis=1)
    meet = find_meetings(surface)
    assert meet.at[inner].mean() > 0.95
    assert not (meet.through | meet.passing).any()
    assert meet.beside.sum() > 0.95 * meet.at.sum()


def test_a_node_near_a_crossing_knows_both_sheets():
    surface, cell = crossed(), 0.05
    rng = np.random.default_rng(0)
    x = rng.uniform([-0.07, -0.5, -0.07], [0.07, 0.5, 0.07], (200, 3))
    nobody = [np.full(len(x), -1)] * 6
    found = sheets_near(surface, x, nobody, cell)
    assert (np.bincount(found.node, minlength=200) == 2).all()
    level = np.abs(found.axis[:, 2]) > 0.7
    np.testing.assert_allclose(np.abs(found.axis[level]) @ [0, 0, 1], 1, atol=1e-6)
    np.testing.assert_allclose(np.abs(found.tau[level]), np.abs(x[found.node[level], 2]), atol=2e-3)
    np.testing.assert_allclose(np.abs(found.tau[~level]), np.abs(x[found.node[~level], 0]), atol=2e-3)


def test_a_sheet_is_told_to_the_neighbour_that_does_not_know_it():
    surface, cell = crossed(), 0.05
    unsure = (np.abs(surface.points[:, 0]) < 1e-9) & (surface.points[:, 1] > 0)
    surface.confidence[unsure] = 0.5
    x = np.array([[0.03, -0.3, 0.02], [0.03, 0.3, 0.02]])
    nobody = np.full(2, -1)
    assert np.bincount(sheets_near(surface, x, [nobody] * 6, cell).node).tolist() == [2, 1]
    told = sheets_near(surface, x, [np.array([1, -1])] + [nobody] * 5, cell)
    assert np.bincount(told.node).tolist() == [2, 2]
    assert np.sort(np.abs(told.tau[told.node == 1])) == pytest.approx([0.02, 0.03], abs=2e-3)


def test_of_lines_of_one_edge_the_first_of_least_cost_is_chosen(random):
    key, cost = random.integers(0, 20, 300), random.integers(0, 4, 300) / 4
    best = {}
    for row, each in enumerate(key.tolist()):
        if each not in best or cost[row] < cost[best[each]]:
            best[each] = row
    assert np.flatnonzero(_least(key, cost)).tolist() == sorted(best.values())
    assert _least(key[:0], cost[:0]).shape == (0,)
