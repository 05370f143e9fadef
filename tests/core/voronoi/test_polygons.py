import numpy as np
import pytest

from core.points import local_spacing
from core.voronoi import blocks
from core.voronoi.facets import CLIP_RADIUS, clip_radius, voronoi_facets
from core.voronoi.polygons import facet_polygons, triangle_areas
from tests import shapes


@pytest.fixture(
    scope="module",
    params=[shapes.junction(700), shapes.scattered_sphere(500), np.random.default_rng(1).random((300, 3))],
    ids=["junction", "sphere", "volume"],
)
def case(request):
    points = request.param
    spacing = local_spacing(points)
    return points, spacing, facet_polygons(points, spacing)


def fans(polygons):
    triangles, polygon = polygons.triangles()
    return np.bincount(polygon, weights=triangle_areas(triangles), minlength=len(polygons.facets.pairs))


def test_polygons_are_those_of_the_facets(case):
    points, spacing, polygons = case
    facets = voronoi_facets(points, spacing)
    np.testing.assert_array_equal(polygons.facets.pairs, facets.pairs)
    np.testing.assert_array_equal(polygons.facets.area, facets.area)


def test_areas_agree_with_the_sums_over_sides(case):
    _, spacing, polygons = case
    radius = clip_radius(spacing, *polygons.facets.pairs.T)
    lost = (polygons.facets.area - fans(polygons)) / (np.pi * radius**2)
    assert lost.min() > -1e-7
    assert lost.max() < 0.01


def test_areas_of_polygons_inside_the_ball_are_exact(random):
    points = random.random((300, 3))
    spacing = local_spacing(points)
    polygons = facet_polygons(points, spacing)
    radius = clip_radius(spacing, *polygons.facets.pairs.T)
    triangles, polygon = polygons.triangles()
    reach = np.linalg.norm(triangles[:, 1] - points[polygons.facets.pairs].mean(axis=1)[polygon], axis=1)
    whole = np.maximum.reduceat(reach, polygons.first[:-1]) < 0.999 * radius
    assert whole.sum() > 500
    np.testing.assert_allclose(fans(polygons)[whole], polygons.facets.area[whole], atol=1e-7 * spacing.mean() ** 2)


def test_polygons_are_convex_counter_clockwise_and_on_the_bisector(case):
    points, spacing, polygons = case
    (a, b, c), polygon = polygons.triangles()[0].transpose(1, 0, 2), polygons.triangles()[1]
    i, j = polygons.facets.pairs[polygon].T
    axis = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i], axis=1)[:, None]
    signed = np.einsum("ij,ij->i", np.cross(b - a, c - a), axis)
    assert (signed > -1e-6 * spacing[i] ** 2).all()
    off = np.einsum("ij,ij->i", b - 0.5 * (points[i] + points[j]), axis)
    assert np.abs(off).max() < 1e-4 * spacing.max()
    assert (np.linalg.norm(b - 0.5 * (points[i] + points[j]), axis=1) < 1.0001 * clip_radius(spacing, i, j)).all()


def test_a_facet_wider_than_the_ball_becomes_a_disc():
    points = np.array([[0, 0, 0], [0.02, 0, 0], [0, 5, 0], [0, 0, 5.0]])
    polygons = facet_polygons(points, np.full(4, 0.01))
    assert polygons.facets.pairs.tolist() == [[0, 1]]
    radius = 0.01 * CLIP_RADIUS
    around = polygons.corners - np.repeat(points[polygons.facets.pairs].mean(axis=1), np.diff(polygons.first), axis=0)
    np.testing.assert_allclose(np.linalg.norm(around, axis=1), radius, rtol=1e-9)
    np.testing.assert_allclose(fans(polygons), np.pi * radius**2, rtol=0.011)


def test_blocks_give_the_polygons_of_the_whole(monkeypatch):
    points = shapes.torus(1200)
    spacing = local_spacing(points)
    whole = facet_polygons(points, spacing)
    monkeypatch.setattr(blocks, "SIZE", 100)
    found = facet_polygons(points, spacing)
    np.testing.assert_array_equal(found.facets.pairs, whole.facets.pairs)
    np.testing.assert_allclose(fans(found), fans(whole), rtol=1e-6)
