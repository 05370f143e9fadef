import time

import numpy as np
import pytest
from scipy.spatial import Voronoi

from core.points import local_spacing
from core.voronoi.facets import CLIP_RADIUS, Facets, clip_radius, voronoi_facets
from tests import shapes


def matrix(facets: Facets, n: int) -> np.ndarray:
    areas = np.zeros((n, n))
    areas[tuple(facets.pairs.T)] = facets.area
    return areas + areas.T


def facets_of(points, seed=0):
    return matrix(voronoi_facets(points, local_spacing(points), seed), len(points))


def uv_sphere(rings: int) -> np.ndarray:
    polar, azimuth = np.meshgrid(np.linspace(0.05, np.pi - 0.05, rings), np.arange(2 * rings) * np.pi / rings)
    ring = np.sin(polar)
    return np.stack([ring * np.cos(azimuth), ring * np.sin(azimuth), np.cos(polar)], axis=-1).reshape(-1, 3)


def grid(*sides: int) -> np.ndarray:
    return np.indices(sides).reshape(len(sides), -1).T.astype(np.float64)


def test_cube_grid_has_unit_squares_between_neighbours_and_nothing_else():
    points = grid(5, 5, 5)
    areas = matrix(voronoi_facets(points, np.ones(len(points))), len(points))
    inner = ((points > 0) & (points < 4)).all(axis=1)
    apart = np.abs(points[:, None] - points[None]).sum(axis=2)[np.ix_(inner, inner)]
    np.testing.assert_allclose(areas[np.ix_(inner, inner)], np.where(apart == 1, 1.0, 0.0), atol=1e-4)


def test_facets_of_a_plane_are_strips_cut_off_by_the_ball():
    points = np.column_stack([grid(9, 9), np.zeros(81)])
    areas = matrix(voronoi_facets(points, np.ones(81)), 81)
    middle = 4 * 9 + 4
    strip = np.sqrt(CLIP_RADIUS**2 - 0.25) + 2 * CLIP_RADIUS**2 * np.arcsin(0.5 / CLIP_RADIUS)
    np.testing.assert_allclose(areas[middle, [middle - 9, middle - 1, middle + 1, middle + 9]], strip, rtol=1e-4)
    assert areas[middle].sum() == pytest.approx(4 * strip, rel=1e-3)


def test_facets_wider_than_the_ball_are_its_whole_disc():
    tetrahedron = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    facets = voronoi_facets(tetrahedron, np.full(4, 0.01))
    assert len(facets.pairs) == 6
    np.testing.assert_allclose(facets.area, np.pi * (0.01 * CLIP_RADIUS) ** 2, rtol=1e-9)


def test_areas_inside_the_ball_are_those_of_scipy(random):
    points = random.random((300, 3))
    spacing = local_spacing(points)
    areas = matrix(voronoi_facets(points, spacing), len(points))
    voronoi, compared = Voronoi(points), 0
    for (i, j), ridge in zip(voronoi.ridge_points, voronoi.ridge_vertices, strict=True):
        corners = voronoi.vertices[ridge] - (points[i] + points[j]) / 2
        if -1 in ridge or np.linalg.norm(corners, axis=1).max() > clip_radius(spacing, i, j):
            continue
        area = np.linalg.norm(np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)) / 2
        assert areas[i, j] == pytest.approx(area, abs=1e-4 * spacing[i] ** 2)
        compared += 1
    assert compared > 500


def test_pairs_are_sorted_distinct_and_every_sample_has_some():
    facets = voronoi_facets(shapes.moebius(800), local_spacing(shapes.moebius(800)))
    i, j = facets.pairs.T
    assert (i < j).all()
    assert (np.diff(i * 800 + j) > 0).all()
    assert (facets.area > 0).all()
    assert len(np.unique(facets.pairs)) == 800


def test_same_seed_same_bytes_and_another_seed_nearly_the_same():
    points = shapes.scattered_sphere(400)
    spacing = local_spacing(points)
    first, again, other = (voronoi_facets(points, spacing, seed) for seed in (3, 3, 4))
    assert first.area.tobytes() == again.area.tobytes()
    assert first.area.tobytes() != other.area.tobytes()
    np.testing.assert_allclose(matrix(first, 400), matrix(other, 400), atol=1e-3 * spacing.mean() ** 2)


@pytest.mark.parametrize(
    "points",
    [uv_sphere(70), np.column_stack([grid(100, 100), np.zeros(10_000)]), grid(22, 22, 22)],
    ids=["uv sphere", "plane", "cube"],
)
def test_cospherical_and_coplanar_grids_are_fast(points):
    """Without the jitter about ten thousand points of a sphere take a quarter of a minute."""
    spacing = local_spacing(points)
    start = time.process_time()
    voronoi_facets(points, spacing)
    assert time.process_time() - start < 5


def test_areas_follow_scale_motion_and_order(random):
    points = shapes.torus(500)
    areas = facets_of(points)
    moved = 7 * points @ shapes.random_rotation(1).T + [1, 2, 3]
    tolerance = 1e-3 * areas.max()
    np.testing.assert_allclose(facets_of(moved) / 49, areas, atol=tolerance)
    order = random.permutation(len(points))
    np.testing.assert_allclose(facets_of(points[order]), areas[np.ix_(order, order)], atol=tolerance)
