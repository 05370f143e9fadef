import numpy as np
import pytest

from core.field.patches import Patches
from core.field.rims.borders import DISC, find_rims
from core.neighbourhoods.cloud import Cloud
from core.points import local_spacing
from tests import shapes

UP = np.array([0.0, 0.0, 1.0])


def rims_of(points, normals, bridge=3.0):
    normals = np.broadcast_to(normals, points.shape)
    cloud = Cloud.of(points, normals, local_spacing(points))
    return find_rims(cloud, np.zeros((len(points), 3, 3)), bridge), cloud.spacing


def test_the_rim_of_a_disc_is_found_and_nothing_else():
    points = shapes.disc(800)
    rims, spacing = rims_of(points, UP)
    inset = (1 - np.linalg.norm(points, axis=1)) / np.median(spacing)
    assert rims.open[inset < 0.3].all()
    assert not rims.gap[inset > 1.5].any()
    rim = rims.open
    outward = np.einsum("ni,ni->n", rims.outward, points / np.linalg.norm(points, axis=1, keepdims=True))
    assert outward[rim].min() > 0.8


def test_a_gap_that_patches_bend_over_is_bridged():
    """Along a slot in a tube, whose far side is off the tangent planes."""
    points = shapes.cylinder(300)
    points = points[np.abs(np.arctan2(points[:, 1], points[:, 0])) > np.radians(25)]
    normals = points * [1, 1, 0]
    tangent = np.stack([-normals[:, 1], normals[:, 0], np.zeros(len(points))], axis=1)
    bend = -np.einsum("ni,nj->nij", tangent, tangent)
    cloud = Cloud.of(points, normals, local_spacing(points))
    beside = (points[:, 0] > 0.4) & (np.abs(points[:, 2]) < 0.6)
    flat, bent = (find_rims(cloud, form, 5.0) for form in (0 * bend, bend))
    assert (flat.gap & beside).any()
    np.testing.assert_array_equal(flat.open[beside], flat.gap[beside])
    assert not bent.open[beside].any()


@pytest.mark.parametrize("points", [shapes.sphere(500), shapes.sphere(3000)])
def test_a_closed_surface_has_none(points):
    rims, _ = rims_of(points, points)
    assert not rims.gap.any()


def test_beside_an_edge_neighbours_beyond_it_fill_the_gap():
    points = shapes.cube(2400)
    side = np.abs(points).argmax(axis=1)
    rims, spacing = rims_of(points, np.eye(3)[side])
    beside = np.sort(np.abs(points), axis=1)[:, 1] > 1 - 0.6 * np.median(spacing)
    assert rims.gap[beside].mean() < 0.03
    assert np.isfinite(rims.limit[beside, 0]).all()
    assert not rims.gap[~beside].any()
    np.testing.assert_allclose(np.einsum("ni,ni->n", rims.crease[beside, 0], np.eye(3)[side[beside]]), 0, atol=1e-9)


@pytest.mark.parametrize(("bridge", "crossed"), [(1.5, False), (3.0, False), (6.0, True), (20.0, True)])
def test_a_hole_is_bridged_when_narrower_than_asked(bridge, crossed):
    points = shapes.holed_square(1000, radius=0.15)
    rims, _ = rims_of(points, UP, bridge)
    around = rims.gap & (np.linalg.norm(points, axis=1) < 0.25)
    assert around.sum() >= 5
    assert (rims.bridged[around] == crossed).all()


def test_a_gap_opens_to_another_sheet_only_when_it_is_level():
    """Two coplanar strips are joined across their gap; lifted off each other they are not."""
    left = shapes.square(800) * [0.5, 1, 1] - [0.6, 0, 0]
    for lift, joined in ((0.0, True), (0.18, False)):
        points = np.concatenate([left, left * [-1, 1, 1] + [0, 0, lift]])
        rims, _ = rims_of(points, UP, bridge=6.0)
        facing = (np.abs(points[:, 0]) < 0.12) & (np.abs(points[:, 1]) < 0.8)
        assert rims.gap[facing].any()
        assert (rims.bridged[facing & rims.gap].mean() > 0.5) == joined


@pytest.mark.parametrize("lean", [-0.003, 0, 0.003])
def test_samples_on_a_crease_end_there(lean):
    """Whichever way their axes lean, neighbours on the other face lie beyond the crease. Taken to lie on this side they
    left a gap of half a turn."""
    u, v = np.meshgrid(np.linspace(0, 1, 17), np.linspace(0, 1, 17)[1:])
    top, wall = (np.stack(axes, axis=-1).reshape(-1, 3) for axes in ((v, u, 0 * u), (0 * u, u, -v)))
    crease = np.stack([0 * u[0], u[0], 0 * u[0]], axis=1)
    axes = [[lean, 0, 1]] * len(crease) + [UP] * len(top) + [[1, 0, -lean]] * len(wall)
    rims, spacing = rims_of(np.concatenate([crease, top, wall]), np.array(axes, float))
    inner = slice(2, len(crease) - 2)
    assert not rims.gap[inner].any()
    assert rims.limit[inner, 0].max() < 0.01 * spacing.min()
    assert rims.crease[inner, 0, 0].max() < -0.99


def test_signs_of_normals_do_not_matter(random):
    points = shapes.hemisphere(500)
    rims, _ = rims_of(points, points)
    flipped, _ = rims_of(points, points * random.choice([-1.0, 1.0], (500, 1)))
    np.testing.assert_array_equal(flipped.gap, rims.gap)
    np.testing.assert_array_equal(flipped.bridged, rims.bridged)
    np.testing.assert_allclose(flipped.outward[rims.gap], rims.outward[rims.gap], atol=1e-9)


class TestExcess:
    def at(self, points, sample, lateral, bridge=3.0):
        rims, spacing = rims_of(points, UP, bridge)
        sample = np.full((len(lateral), 1), sample)
        beyond, step = Patches.of(rims).excess(sample, np.asarray(lateral).T[:, :, None], spacing[sample])
        return beyond[:, 0], step[:, :, 0].T, spacing[sample[0, 0]]

    def test_inside_its_disc_a_sample_covers_and_beyond_it_the_distance_to_the_disc_counts(self):
        points = shapes.disc(500)
        _, _, spacing = self.at(points, 0, np.zeros((1, 3)))
        lateral = np.array([[0.9, 0, 0], [0, 1.1, 0], [3, 4, 0]]) * DISC * spacing
        beyond, step, _ = self.at(points, 0, lateral)
        np.testing.assert_allclose(beyond, np.array([0, 0.1, 4]) * DISC * spacing, atol=1e-12)
        np.testing.assert_allclose(step[2], [2.4 * DISC * spacing, 3.2 * DISC * spacing, 0])

    def test_past_a_rim_the_sheet_ends_soon(self):
        points = shapes.disc(500)
        rim = int(np.linalg.norm(points, axis=1).argmax())
        outward = points[rim] / np.linalg.norm(points[rim])
        _, _, spacing = self.at(points, rim, np.zeros((1, 3)))
        beyond, step, _ = self.at(points, rim, np.array([-0.8, 0.0, 1.0, 4.0])[:, None] * outward * spacing)
        assert beyond[0] == beyond[1] == 0
        assert 0.5 * spacing < beyond[2] < spacing
        assert 3.5 * spacing < beyond[3] < 4 * spacing
        np.testing.assert_allclose(np.linalg.norm(step, axis=1), beyond, atol=1e-12)
        assert step[3] @ outward > 0.95 * beyond[3]
