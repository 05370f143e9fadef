import numpy as np
import pytest

from core.points import local_spacing
from core.voronoi.bisectors import bisector_samples
from core.voronoi.facets import clip_radius
from core.voronoi.polygons import facet_polygons
from tests import shapes

POINTS = shapes.torus(600)
SPACING = local_spacing(POINTS)


@pytest.fixture(scope="module")
def polygons():
    return facet_polygons(POINTS, SPACING)


@pytest.fixture(scope="module", params=[0.5, 4.0, 16.0])
def sampled(request, polygons):
    return request.param, bisector_samples(polygons, SPACING, request.param)


def test_weights_share_out_the_area_of_each_facet(polygons, sampled):
    _, samples = sampled
    share = np.bincount(samples.facet, weights=samples.weight, minlength=len(polygons.facets.pairs))
    np.testing.assert_allclose(share, polygons.facets.area, rtol=1e-12)
    for group in np.split(samples.weight, np.flatnonzero(np.diff(samples.facet)) + 1):
        assert np.ptp(group) == 0


def test_samples_lie_on_their_bisector_inside_the_ball_and_next_to_no_one_else(sampled):
    _, samples = sampled
    i, j = samples.facets.pairs[samples.facet].T
    distance = np.linalg.norm(samples.positions[:, None] - POINTS, axis=2)
    every, tolerance = np.arange(len(i)), 1e-4 * SPACING.max()
    assert np.abs(distance[every, i] - distance[every, j]).max() < tolerance
    assert (distance.min(axis=1) > distance[every, i] - tolerance).all()
    middle = 0.5 * (POINTS[i] + POINTS[j])
    assert (np.linalg.norm(samples.positions - middle, axis=1) < 1.0001 * clip_radius(SPACING, i, j)).all()


def test_samples_of_a_facet_keep_apart_and_fill_it(polygons, sampled):
    density, samples = sampled
    side = SPACING[polygons.facets.pairs].mean(axis=1)
    expected = density * polygons.facets.area / side**2
    count = np.bincount(samples.facet)
    large = expected > 20
    if large.any():
        assert 0.7 < count[large].sum() / expected[large].sum() < 1.3
    for k in np.argsort(expected)[-40:]:
        at = samples.positions[samples.facet == k]
        gaps = np.linalg.norm(at[:, None] - at, axis=2)[np.triu_indices(len(at), 1)]
        assert (gaps > np.sqrt(0.75 / density) * side[k]).all()


def test_sums_over_samples_are_integrals(polygons):
    """The first moment of every facet, by its triangles' centroids, against the samples' sum."""
    samples = bisector_samples(polygons, SPACING, 64.0)
    triangles, polygon = polygons.triangles()
    n = len(polygons.facets.pairs)
    area = 0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    for axis in range(3):
        exact = np.bincount(polygon, area * triangles[..., axis].mean(axis=1), n) / np.bincount(polygon, area, n)
        found = np.bincount(samples.facet, samples.weight * samples.positions[:, axis], n) / polygons.facets.area
        assert np.abs(found - exact).mean() < 0.05 * SPACING.mean()
        assert abs((found - exact).mean()) < 0.005 * SPACING.mean()


def test_same_seed_same_samples(polygons):
    first, again, other = (bisector_samples(polygons, SPACING, 2.0, seed).positions for seed in (1, 1, 2))
    assert first.tobytes() == again.tobytes()
    assert first.tobytes() != other.tobytes()


def test_samples_of_a_disc_are_uniform():
    """On the disc between two points with all others far away: a share t of the samples lies within a share t of the
    area around the middle."""
    points = np.array([[0, 0, 0], [0.02, 0, 0], [0, 5, 0], [0, 0, 5.0]])
    spacing = np.full(4, 0.01)
    samples = bisector_samples(facet_polygons(points, spacing), spacing, 200.0)
    i, j = samples.facets.pairs[samples.facet].T
    share = np.linalg.norm(samples.positions - 0.5 * (points[i] + points[j]), axis=1) ** 2
    share /= clip_radius(spacing, i, j) ** 2
    assert len(share) > 2000
    for t in (0.1, 0.25, 0.5, 0.75):
        assert abs((share < t).mean() - t) < 0.02
