import numpy as np
import pytest

from core import Cancelled
from core.normals.estimate import estimate_normals
from core.normals.mirrors import Mirrors
from core.normals.reflection import reflection_sweeps
from core.normals.walls import normals_of_walls
from core.points import local_spacing
from core.voronoi.facets import voronoi_facets
from tests import shapes

COUNT = 4000


def swept(points):
    """Local spacing, Mirrors, and axes as the sweeps leave them."""
    spacing = local_spacing(points)
    mirrors = Mirrors(points, spacing, voronoi_facets(points, spacing))
    return spacing, mirrors, reflection_sweeps(mirrors)[0]


def wall(thickness):
    """Random points on two concentric spheres, so many spacings of either apart, and their normals."""
    gap = thickness * np.sqrt(4 * np.pi / COUNT)
    normals = np.concatenate([shapes.scattered_sphere(COUNT, seed) for seed in (0, 1)])
    return normals * np.repeat([1 - gap / 2, 1 + gap / 2], COUNT)[:, None], normals


def degrees(a, b):
    return np.degrees(np.arccos(np.minimum(np.abs(np.einsum("ni,ni->n", a, b)), 1.0)))


@pytest.mark.parametrize("thickness", [0.2, 0.3, 0.5, 0.8])
def test_both_sheets_of_a_wall_have_their_normals(thickness):
    points, truth = wall(thickness)
    spacing, mirrors, before = swept(points)
    axes, parted = normals_of_walls(points, spacing, mirrors, before)
    assert np.median(degrees(before, truth)) > 1
    assert np.percentile(degrees(axes, truth), 90) < 0.5 * np.median(degrees(before, truth))
    side = np.arange(len(points)) < COUNT
    across = side[mirrors.site] != side[mirrors.other]
    assert np.average(across, weights=mirrors.weight) > 0.08
    assert np.average(across, weights=parted.weight) < 0.01
    assert parted.confidence(axes).mean() > 0.99


def test_normals_are_estimated_so():
    points, truth = wall(0.5)
    axes, confidence, _ = estimate_normals(points, local_spacing(points))
    assert np.percentile(degrees(axes, truth), 90) < 2
    assert confidence.mean() > 0.99


def test_beside_a_wall_nothing_is_lost():
    """One half of a sphere has a second sheet, the other none."""
    points, truth = wall(0.4)
    kept = (np.arange(len(points)) < COUNT) | (points[:, 2] > 0)
    points, truth = points[kept], truth[kept]
    spacing, mirrors, before = swept(points)
    axes, _ = normals_of_walls(points, spacing, mirrors, before)
    far = points[:, 2] < -0.2
    np.testing.assert_array_equal(axes[far], before[far])
    near = (points[:, 2] > -0.2) & (points[:, 2] < 0.2)
    assert np.mean(degrees(axes, truth)[near]) < 0.7 * np.mean(degrees(before, truth)[near])


@pytest.mark.parametrize(
    "points",
    [
        shapes.scattered_sphere(2000),
        shapes.cube(3000),
        shapes.junction(3000),
        shapes.sheets(3000, 0.2),
        shapes.scattered_sphere(2000) * (1 + 0.02 * np.random.default_rng(2).normal(size=(2000, 1))),
        np.random.default_rng(1).normal(size=(500, 3)),
        np.random.default_rng(1).normal(size=(9, 3)),
    ],
    ids=["sphere", "cube", "junction", "far sheets", "noise", "everywhere", "few"],
)
def test_where_no_sheets_run_close_nothing_changes(points):
    spacing, mirrors, before = swept(points)
    axes, same = normals_of_walls(points, spacing, mirrors, before)
    assert (axes == before).all(axis=1).mean() > 0.99
    assert (np.abs(same.weight - mirrors.weight) > 0.01).mean() < 0.005


def test_fixed_rows_stay():
    points, _ = wall(0.4)
    spacing, mirrors, before = swept(points)
    fixed = np.arange(0, len(points), 5)
    axes, _ = normals_of_walls(points, spacing, mirrors, before, fixed)
    np.testing.assert_array_equal(axes[fixed], before[fixed])
    assert (axes != before).any(axis=1).mean() > 0.7


def test_it_can_be_cancelled():
    points, _ = wall(0.4)
    with pytest.raises(Cancelled):
        normals_of_walls(points, *swept(points), progress=lambda fraction, text: fraction < 0.7)
