import numpy as np
import pytest
from scipy.spatial import KDTree

from core import Cancelled
from core.field.local_surface import fit_local_surface
from core.field.projection import CHUNK, MEMBER, membership
from core.points import local_spacing
from tests import shapes

UP = np.array([0.0, 0.0, 1.0])
SHAPES = {
    "sphere": (shapes.sphere(1500), shapes.sphere(1500), shapes.sphere_distance),
    "random sphere": (shapes.scattered_sphere(1500), shapes.scattered_sphere(1500), shapes.sphere_distance),
    "hemisphere": (shapes.hemisphere(1500), shapes.hemisphere(1500), shapes.hemisphere_distance),
    "disc": (shapes.disc(800), np.tile(UP, (800, 1)), shapes.disc_distance),
    "cylinder": (shapes.cylinder(2000), shapes.cylinder(2000) * [1, 1, 0], shapes.cylinder_distance),
}


def fit(points, normals, bridge=3.0):
    return fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), bridge)


def around(points, random, width=0.6, n=3000):
    """Queries spread a local spacing or so around the samples."""
    spacing = np.median(local_spacing(points))
    return points[random.choice(len(points), n)] + width * spacing * random.normal(size=(n, 3))


@pytest.mark.parametrize(("points", "normals", "true"), SHAPES.values(), ids=SHAPES.keys())
def test_distance_and_foot_are_those_of_the_closed_form(points, normals, true, random):
    x = around(points, random)
    found = fit(points, normals).project(x)
    spacing = np.median(local_spacing(points))
    error = np.abs(found.distance - true(x)) / spacing
    assert error.mean() < 0.005
    assert np.percentile(error, 95) < 0.03
    assert error.max() < 0.6
    np.testing.assert_allclose(np.linalg.norm(found.step, axis=1), found.distance, atol=1e-9)
    assert np.percentile(true(x - found.step), 95) < 0.05 * spacing


@pytest.mark.parametrize(("n", "most"), [(100, 0.01), (300, 0.002)])
def test_where_samples_of_a_curved_sheet_are_few_feet_do_not_jump(n, most):
    """From the cell of one nearest sample to the next."""
    points = shapes.torus(n)
    ring = points * [1, 1, 0] / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
    surface = fit(points, (points - ring) / 0.4)
    i, j = KDTree(points).query_pairs(0.9 * np.median(surface.spacing), output_type="ndarray").T
    halfway, way = 0.5 * (points[i] + points[j]), points[j] - points[i]
    here, there = (surface.project(halfway + side * way) for side in (-1e-6, 1e-6))
    jump = np.linalg.norm(here.step - there.step, axis=1) / np.median(surface.spacing)
    assert np.percentile(jump, 90) < most


def test_the_more_off_each_others_sheets_for_their_distance_the_less_samples_are_of_one():
    between = np.array([[1.0, 1.0, 2.0, 1.0], [0, 0, 0, 0], [0, 0, 0, 0]])[:, None]
    heights = np.array([[0.0, 0.2, 0.4, 0.4]]), np.array([[0.0, 0.2, -0.4, 0.4]])
    member = membership(between, *heights, np.array([[np.inf]]))[0]
    assert member[0] == 1
    assert member[1] == member[2] > MEMBER > member[3] > 0


def test_beside_another_sheet_half_way_to_it_no_sample_is_of_ones_own_however_far_along():
    between, room = np.array([[1.0, 3.0, 9.0, 27.0], [0, 0, 0, 0], [0, 0, 0, 0]])[:, None], np.array([[0.1]])
    for height, own in ((0.0, True), (0.05, True), (0.102, False), (0.2, False)):
        member = membership(between, np.full((1, 4), height), np.full((1, 4), height), room)
        assert ((member > MEMBER) == own).all()


@pytest.mark.parametrize("gap", [0.2, 0.5])
def test_the_two_sheets_of_a_thin_wall_are_where_they_are(gap, random):
    """From outside of either, at places that see the other through the voids in it."""
    points, apart = random.uniform(-1, 1, (3000, 3)) * [1, 1, 0], gap * 0.03
    points[::2, 2] = apart
    x = np.column_stack([random.uniform(-0.9, 0.9, (4000, 2)), random.uniform(0.01, 0.03, 4000)])
    surface = fit(points, np.tile(UP, (3000, 1)))
    for shift, side in ((0.0, -1), (apart, 1)):
        found = surface.project(x * [1, 1, side] + shift * UP)
        assert np.abs(found.distance - x[:, 2]).mean() < 0.1 * apart


@pytest.mark.parametrize(("points", "normals", "true"), SHAPES.values(), ids=SHAPES.keys())
def test_never_beyond_the_nearest_sample_and_never_negative(points, normals, true, random):
    x = around(points, random, width=2)
    distance = fit(points, normals).project(x).distance
    assert distance.min() >= 0
    assert (distance <= KDTree(points).query(x)[0] + 1e-12).all()


@pytest.mark.parametrize(("points", "normals", "true"), SHAPES.values(), ids=SHAPES.keys())
def test_where_patches_agree_the_foot_is_on_the_surface(points, normals, true, random):
    x, surface = around(points, random), fit(points, normals)
    found, spacing = surface.project(x), np.median(local_spacing(points))
    agreed = found.spread < 0.02 * spacing
    assert agreed.mean() > 0.5
    assert not (agreed & found.past_rim).any()
    assert np.percentile(surface.project((x - found.step)[agreed]).distance, 99) < 0.02 * spacing


def test_feet_are_off_by_less_than_their_spread(random):
    """Where normals scatter, patches do."""
    points = shapes.sphere(1500)
    normals = points + 0.1 * random.normal(size=points.shape)
    surface, x = fit(points, normals / np.linalg.norm(normals, axis=1, keepdims=True)), around(points, random)
    found = surface.project(x)
    assert (surface.project(x - found.step).distance <= found.spread).mean() > 0.99


def test_samples_lie_on_the_surface():
    points = shapes.torus(2000)
    ring = points * [1, 1, 0] / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
    assert fit(points, (points - ring) / 0.4).project(points).distance.max() < 0.01 * np.median(local_spacing(points))


def test_signs_of_normals_do_not_matter(random):
    points, normals, _ = SHAPES["hemisphere"]
    x = around(points, random)
    here = fit(points, normals).project(x)
    there = fit(points, normals * random.choice([-1.0, 1.0], (len(points), 1))).project(x)
    np.testing.assert_allclose(there.distance, here.distance, atol=1e-9)
    np.testing.assert_allclose(there.step, here.step, atol=1e-9)


def test_moves_and_scales_with_the_points(random):
    points, normals, _ = SHAPES["hemisphere"]
    x = around(points, random)
    rotation, shift, factor = shapes.random_rotation(5), np.array([1.0, 2.0, -3.0]), 37.0
    here = fit(points, normals).project(x)
    there = fit(factor * points @ rotation.T + shift, normals @ rotation.T).project(factor * x @ rotation.T + shift)
    off = np.abs(there.distance / factor - here.distance)
    assert (off < 1e-7).mean() > 0.999
    assert off.max() < 0.1 * np.median(local_spacing(points))


def test_the_order_of_the_points_does_not_matter(random):
    points, normals, _ = SHAPES["random sphere"]
    order = random.permutation(len(points))
    x = around(points, random)
    here, there = fit(points, normals).project(x), fit(points[order], normals[order]).project(x)
    np.testing.assert_allclose(there.distance, here.distance, atol=1e-9)


def test_each_query_is_on_its_own(random):
    """Queries are worked through in chunks; how they fall into them does not matter."""
    points, normals, _ = SHAPES["disc"]
    surface = fit(points, normals)
    x = around(points, random, n=CHUNK + 500)
    whole = surface.project(x)
    part = surface.project(x[CHUNK - 250 : CHUNK + 250])
    np.testing.assert_array_equal(part.distance, whole.distance[CHUNK - 250 : CHUNK + 250])
    np.testing.assert_array_equal(part.step, whole.step[CHUNK - 250 : CHUNK + 250])


def test_past_the_rim_of_a_disc_the_foot_lies_on_the_rim():
    points, normals, _ = SHAPES["disc"]
    spacing = np.median(local_spacing(points))
    turn = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    past = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) * (1 + 2 * spacing) + [0, 0, spacing]
    found = fit(points, normals).project(past)
    assert found.past_rim.all()
    foot = np.linalg.norm(past - found.step, axis=1)
    assert np.abs(foot - 1).max() < 0.6 * spacing
    over = fit(points, normals).project(past * [0.5, 0.5, 1])
    assert not over.past_rim.any()
    np.testing.assert_allclose(over.distance, spacing, rtol=1e-6)


def test_sheets_closer_than_the_spacing_do_not_disturb_each_other(random):
    """From either side of a sheet up to the middle half of the gap, where samples of both are nearest by turns."""
    gap = 0.08
    points = shapes.sheets(1000, gap)
    assert np.median(local_spacing(points)) > gap
    height = gap * random.uniform(0.25, 1, 2000) * random.choice([-1, 1], 2000)
    x = np.column_stack([random.uniform(-0.7, 0.7, (2000, 2)), height])
    distance = fit(points, np.tile(UP, (len(points), 1))).project(x).distance
    np.testing.assert_allclose(distance, np.abs(np.abs(height) - gap / 2), atol=0.02 * gap)


def test_three_sheets_that_meet_in_a_line_are_not_blended_into_a_fourth():
    rng = np.random.default_rng(0)
    turn = 2 * np.pi / 3 * rng.integers(0, 3, 3000)
    along = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    points = rng.uniform(0, 1, (3000, 1)) * along + rng.uniform(-1, 1, (3000, 1)) * [0, 0, 1]
    surface = fit(points, np.cross([0, 0, 1], along))
    size = np.median(surface.spacing)
    x = rng.normal(size=(5000, 3)) * [size, size, 0.4]
    ends = np.exp(2j * np.pi / 3 * np.arange(3)).conj() * (x[:, :1] + 1j * x[:, 1:2])
    true = np.hypot(np.minimum(ends.real, 0), ends.imag).min(axis=1)
    assert (true - surface.project(x).distance > 0.2 * size).mean() < 0.015


@pytest.mark.parametrize("degrees", [45, 50, 60, 90])
def test_neither_sheet_goes_on_past_a_crease(degrees):
    """At 45 and 50 degrees, between patches that count as parallel and patches that do not."""
    rng, turn = np.random.default_rng(0), np.radians(degrees)
    down = np.array([np.cos(turn), 0, -np.sin(turn)])
    across, flat = rng.uniform(0, 2, (3000, 1)), rng.random((3000, 1)) < 0.5
    points = across * np.where(flat, [-1, 0, 0], down) + rng.uniform(-1, 1, (3000, 1)) * [0, 1, 0]
    surface = fit(points, np.where(flat, UP, np.cross(down, [0, 1, 0])))
    size = np.median(surface.spacing)
    x = rng.uniform(-1, 1, (6000, 3)) * [1.5 * size, 0.8, 1.5 * size]
    true = np.minimum(np.hypot(np.maximum(x[:, 0], 0), x[:, 2]), np.linalg.norm(x - _onto(x, down), axis=1))
    assert (true - surface.project(x).distance > 0.15 * size).mean() < 0.02


def _onto(x, down):
    """The feet of x on the half-plane that begins at the y axis and leads `down` from there."""
    return np.maximum(x @ down, 0)[:, None] * down + x * [0, 1, 0]


def test_no_queries():
    points, normals, _ = SHAPES["disc"]
    assert fit(points, normals).project(np.empty((0, 3))).distance.shape == (0,)


def test_can_be_cancelled():
    points, normals, _ = SHAPES["disc"]
    with pytest.raises(Cancelled):
        fit(points, normals).project(points, lambda *_: False)
