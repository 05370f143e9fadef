import numpy as np
import pytest
from scipy.spatial import KDTree

from core.field.curvature import bending
from core.field.local_surface import fit_local_surface
from core.field.rims import borders, sampling_gaps
from core.field.rims.borders import find_rims
from core.field.rims.sampling_gaps import with_openings_kept, with_sampling_gaps_bridged, with_sparser_parts_joined
from core.neighbourhoods.cloud import Cloud
from core.points import local_spacing
from tests import shapes

UP = np.array([0.0, 0.0, 1.0])


def rims_of(points, normals):
    """What looks at rims is given: rims and cloud."""
    cloud = Cloud.of(points, np.broadcast_to(normals, points.shape), local_spacing(points))
    return find_rims(cloud, np.zeros((len(points), 3, 3)), 3.0), cloud


def before_and_after(points, normals, bend_times=1.0):
    rims, cloud = rims_of(points, normals)
    bend = bend_times * bending(cloud, np.full(len(points), np.inf))
    return rims, with_sampling_gaps_bridged(rims, cloud, bend, 3.0), cloud.spacing


def with_and_without_openings_kept(points, normals):
    rims, cloud = rims_of(points, normals)
    return with_openings_kept(rims, cloud, 3.0), rims, cloud.spacing


def with_and_without_sparser_parts_joined(points, normals):
    rims, cloud = rims_of(points, normals)
    return with_sparser_parts_joined(rims, cloud, 3.0), rims, cloud.spacing


def sparser_to_one_side(points, ratio, random):
    """The points, (m,3) of (n,3), of which one in `ratio` is left where x is negative."""
    return points[(points[:, 0] > 0) | (random.random(len(points)) < 1 / ratio)]


def test_random_samples_of_a_closed_surface_leave_gaps_and_nearly_all_are_bridged():
    points = shapes.scattered_sphere(20_000)
    before, after, spacing = before_and_after(points, points)
    assert before.open.sum() > 50
    assert after.open.sum() < 0.2 * before.open.sum()
    newly = after.bridged & ~before.bridged
    assert (after.reach[newly] >= spacing[newly]).all()
    np.testing.assert_array_equal(after.reach[before.bridged], before.reach[before.bridged])


def test_the_rim_of_a_random_disc_stays_open_and_gaps_inside_are_bridged(random):
    turn, radius = random.uniform(0, 2 * np.pi, 5000), np.sqrt(random.random(5000))
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=1)
    before, after, spacing = before_and_after(points, UP)
    inside = 1 - radius > 2 * spacing
    assert before.open[~inside].sum() > 150
    np.testing.assert_array_equal(after.bridged[~inside], before.bridged[~inside])
    assert after.open[inside].sum() < 0.5 * before.open[inside].sum()


@pytest.mark.parametrize("width", [3.2, 4.0])
def test_a_slit_wider_than_the_bridging_length_stays_open(width, random):
    points = np.pad(random.uniform(-1, 1, (4000, 2)), ((0, 0), (0, 1)))
    side = 0.5 * width * np.median(local_spacing(points))
    points[:, 0] += np.sign(points[:, 0]) * side
    before, after, spacing = before_and_after(points, UP)
    beside = before.open & (np.abs(points[:, 0]) < side + 0.6 * spacing) & (np.abs(points[:, 1]) < 0.8)
    assert beside.sum() > 10
    assert not after.bridged[beside].any()


def test_a_slit_is_not_bridged_from_samples_that_happen_to_be_far_from_their_neighbours(random):
    points = np.pad(random.uniform(-1, 1, (8000, 2)), ((0, 0), (0, 1)))
    side = 0.5 * 3.6 * np.median(local_spacing(points))
    points[:, 0] += np.sign(points[:, 0]) * side
    kept, rims, spacing = with_and_without_openings_kept(points, UP)
    beside = np.abs(points[:, 0]) < side + 2 * spacing
    across = beside & (points[:, 0] * rims.outward[:, 0] < -0.9 * np.abs(points[:, 0]))
    assert (rims.bridged & across).sum() > 10
    assert (kept.bridged & across).sum() < 0.2 * (rims.bridged & across).sum()
    assert not kept.reach[rims.bridged & ~kept.bridged].any()
    assert (kept.bridged != rims.bridged)[~beside].mean() < 1e-3


@pytest.mark.parametrize("seed", [0, 1])
def test_patches_do_not_cover_the_middle_of_a_slit_a_little_wider_than_the_bridging_length(seed):
    """They did along a third of it, where samples beside it were far from their neighbours."""
    random = np.random.default_rng(seed)
    points = np.pad(random.uniform(-1, 1, (8000, 2)), ((0, 0), (0, 1)))
    points[:, 0] += np.sign(points[:, 0]) * 2 * np.median(local_spacing(points))
    spacing = local_spacing(points)
    surface = fit_local_surface(points, np.broadcast_to(UP, points.shape), np.ones(8000), spacing, 3.0)
    middle = np.linspace(-0.9, 0.9, 400)[:, None] * [0, 1, 0]
    assert (surface.project(middle).distance < 0.3 * np.median(spacing)).mean() < 0.02


def test_gaps_in_the_sampling_of_a_closed_surface_stay_bridged():
    points = shapes.scattered_sphere(20_000)
    kept, rims, _ = with_and_without_openings_kept(points, points)
    assert rims.bridged.sum() > 200
    np.testing.assert_array_equal(kept.bridged, rims.bridged)


def test_a_round_hole_twice_as_wide_as_the_bridging_length_stays_open():
    points = shapes.holed_square(1000, radius=0.2)
    before, after, spacing = before_and_after(points, UP)
    around = before.open & (np.linalg.norm(points, axis=1) < 0.3)
    assert around.sum() > 5
    assert 6 * np.median(spacing) > 0.4
    np.testing.assert_array_equal(after.bridged, before.bridged)


def test_a_round_gap_that_no_sample_sees_a_wide_angle_of_is_covered(random):
    turn, radius = np.meshgrid(np.arange(12) * np.pi / 6, [1.7, 2.5, 3.4, 4.3, 5.2, 6.1])
    turn = turn + np.pi / 12 * np.arange(6)[:, None]
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=-1).reshape(-1, 3)
    points += np.append(0.02 * random.normal(size=(len(points), 2)), np.zeros((len(points), 1)), axis=1)
    before, after, spacing = before_and_after(points, UP)
    inner = np.linalg.norm(points, axis=1) < 2
    assert not before.gap[inner].any()
    assert after.bridged[inner].sum() >= 5
    assert (after.reach > spacing)[inner & after.bridged].all()
    middle = fit_local_surface(points, np.tile(UP, (len(points), 1)), np.ones(len(points)), spacing, 3.0)
    assert middle.project(np.zeros((1, 3))).distance[0] < 0.1
    assert after.open[np.linalg.norm(points, axis=1) > 6].mean() > 0.9


def test_patches_that_miss_each_other_halfway_are_not_joined(random):
    points = shapes.scattered_sphere(20_000)
    before, after, _ = before_and_after(points, points)
    _, astray, _ = before_and_after(points, points, random.uniform(-30, 30, (len(points), 1, 1)))
    assert (after.bridged & ~before.bridged).sum() > 50
    assert (astray.bridged & ~before.bridged).sum() < 0.5 * (after.bridged & ~before.bridged).sum()


def test_looking_across_some_gaps_at_a_time_changes_nothing(monkeypatch):
    points = shapes.scattered_sphere(20_000)
    whole = before_and_after(points, points)[1]
    monkeypatch.setattr(borders, "_PAIRS", 2000)
    few = before_and_after(points, points)[1]
    np.testing.assert_array_equal(few.bridged, whole.bridged)
    np.testing.assert_array_equal(few.reach, whole.reach)


def test_dense_samples_of_a_closed_surface_are_joined_to_sparse_ones(random):
    points = sparser_to_one_side(shapes.scattered_sphere(20_000), 16, random)
    joined, rims, spacing = with_and_without_sparser_parts_joined(points, points)
    along = rims.open & (np.abs(points[:, 0]) < 0.02)
    assert along.sum() > 50
    assert joined.open[along].sum() < 0.4 * along.sum()
    newly = joined.bridged & ~rims.bridged
    assert np.abs(points[newly, 0]).max() < 0.2
    assert (joined.reach[newly] >= spacing[newly]).all()
    np.testing.assert_array_equal(joined.reach[~newly], rims.reach[~newly])


@pytest.mark.parametrize(("width", "joined"), [(1.8, True), (4.2, False)])
def test_an_opening_beside_a_sparser_part_is_bridged_if_that_one_bridges_it(width, joined, random):
    """Samples 1 and 3 apart, to both sides of an opening of so many times 3."""
    dense = np.stack(np.meshgrid(np.arange(30), np.arange(-45, 46)), axis=-1).reshape(-1, 2)
    sparse = 3 * np.stack(np.meshgrid(-width - np.arange(10), np.arange(-15, 16)), axis=-1).reshape(-1, 2)
    points = np.concatenate([dense + random.uniform(-0.1, 0.1, dense.shape), sparse])
    after, before, _ = with_and_without_sparser_parts_joined(np.pad(points, ((0, 0), (0, 1))), UP)
    beside = (np.abs(points[:, 0]) < 0.5) & (np.abs(points[:, 1]) < 35)
    assert before.open[beside].mean() > 0.9
    assert after.bridged[beside].mean() > 0.8 if joined else not after.bridged[beside].any()


def test_hardly_a_rim_of_evenly_random_samples_is_taken_for_one_of_a_denser_part(random):
    turn, radius = random.uniform(0, 2 * np.pi, 20_000), np.sqrt(random.random(20_000))
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=1)
    joined, rims, _ = with_and_without_sparser_parts_joined(points, UP)
    assert rims.open.sum() > 300
    assert (joined.bridged != rims.bridged).sum() < 5


@pytest.mark.parametrize("count", [300, 3000, 30_000])
def test_the_widest_gap_among_random_samples_is_about_as_wide_as_said(count, random):
    """On a square with wrapped sides, whose density is one sample to a square of length 1."""
    side = np.sqrt(count)
    tree = KDTree(random.uniform(0, side, (count, 2)), boxsize=side)
    widest = 2 * tree.query(random.uniform(0, side, (100 * count, 2)))[0].max()
    assert 0.85 < sampling_gaps._left_by_chance(count) / sampling_gaps._CHANCE / widest < 1.15
