import numpy as np
import pytest

from core import Settings, fit_local_surface, reconstruct
from core.field.rims.line_creases import samples_beside_creases
from core.neighbourhoods.cloud import Cloud
from core.points import local_spacing
from tests import shapes


def ring(radius, height, count):
    angle = np.arange(count) * 2 * np.pi / count
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, height)], axis=1)


def can(rings: int, around: int = 128, lids=(0.0, 2.0)) -> np.ndarray:
    """A cylinder of rings, with lids at some heights, as dense as these are along themselves."""
    wall = [ring(1, height, around) for height in np.linspace(0, 2, rings)]
    inner = [(k / 20, int(around * k / 20)) for k in range(1, 20)]
    lid = [ring(radius, 0, max(count, 6)) for radius, count in inner]
    return np.concatenate([*wall, *(each + np.array([0, 0, end]) for end in lids for each in lid)])


@pytest.mark.parametrize(("rings", "turn"), [(4, 0), (6, 1), (10, 2), (12, 3)])
def test_cylinders_of_few_rings_meet_their_lids(rings, turn):
    """Rings 4 to 14 steps apart; a slit was left beside each lid, which came off."""
    points = can(rings)
    result = reconstruct(points @ shapes.random_rotation(turn).T, Settings(resolution=64, surface="both"))
    assert result.report["meshes"]["single"]["borders"] == 0
    assert shapes.euler(result.sheet) == 2
    assert shapes.signed_volume(result.sheet) == pytest.approx(2 * np.pi, rel=0.02)
    assert len(result.points) == len(points)
    assert result.field.near.sample.max() < len(points)
    assert (np.linalg.norm(result.normals, axis=1) > 0.99).all()


@pytest.mark.parametrize("lids", [(), (0.0,)])
def test_ends_without_a_lid_stay_open(lids):
    points = can(6, lids=lids)
    result = reconstruct(points @ shapes.random_rotation(3).T, Settings(resolution=64, surface="single"))
    assert result.report["meshes"]["single"]["borders"] == 2 - len(lids)


def test_samples_are_added_on_the_wall_beside_the_lid():
    points = can(6, lids=(2.0,))
    at_lid = np.isclose(points[:, 2], 2.0)
    wall = points * [1, 1, 0]
    normals = np.where(at_lid[:, None], [0, 0, 1.0], wall / np.maximum(np.linalg.norm(wall, axis=1), 1e-9)[:, None])
    spacing = local_spacing(points)
    local = fit_local_surface(points, normals, np.ones(len(points)), spacing, 3.0)
    n = len(points)
    np.testing.assert_array_equal(local.source[:n], np.arange(n))
    added, beside = local.points[n:], local.source[n:]
    assert len(added) == 128
    np.testing.assert_allclose(np.hypot(*points[beside, :2].T), 1)
    np.testing.assert_allclose(np.hypot(*added[:, :2].T), 1, atol=1e-9)
    np.testing.assert_allclose(added[:, 2], 2 - spacing[beside])
    assert np.abs(local.normals[n:, 2]).max() < 1e-9
    assert not samples_beside_creases(local.rims, Cloud.of(local.points, local.normals, local.spacing)).beside.size
    heights = np.linspace(0.01, 1.99, 50)
    on_wall = np.stack([np.cos(heights), np.sin(heights), heights], axis=1)
    assert local.project(on_wall).distance.max() < 0.01


def test_clouds_without_lines_are_as_they_were(random):
    points = shapes.scattered_box(2000, (1.0, 1.0, 1.0))
    normals = random.normal(size=points.shape)
    local = fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)
    assert len(local.points) == len(points)
