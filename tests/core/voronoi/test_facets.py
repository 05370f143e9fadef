import time

import numpy as np
import pytest
from scipy.spatial import Voronoi

from core import Cancelled
from core.points import local_spacing
from core.voronoi import blocks
from core.voronoi.facets import CLIP_RADIUS, REACH, Facets, clip_radius, voronoi_facets
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


def test_facets_wider_than_the_ball_are_its_whole_disc_and_samples_far_apart_have_none():
    points = np.array([[0, 0, 0], [0.02, 0, 0], [0, 5, 0], [0, 0, 5.0]])
    facets = voronoi_facets(points, np.full(4, 0.01))
    assert facets.pairs.tolist() == [[0, 1]]
    np.testing.assert_allclose(facets.area, np.pi * (0.01 * CLIP_RADIUS) ** 2, rtol=1e-9)


def test_areas_inside_the_ball_are_those_of_scipy(random):
    points = random.random((300, 3))
    spacing = local_spacing(points)
    areas = matrix(voronoi_facets(points, spacing), len(points))
    voronoi, compared = Voronoi(points), 0
    for (i, j), ridge in zip(voronoi.ridge_points, voronoi.ridge_vertices, strict=True):
        corners = voronoi.vertices[ridge] - (points[i] + points[j]) / 2
        if np.linalg.norm(points[i] - points[j]) > REACH * max(spacing[i], spacing[j]):
            assert areas[i, j] == 0
            continue
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


def test_distances_of_very_different_sizes():
    """A cone sampled alike at every scale; Qhull gives up its tetrahedra as they come."""
    rng = np.random.default_rng(0)
    radius, angle = 10 ** rng.uniform(-6, 0, 8000), rng.uniform(0, 2 * np.pi, 8000)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), radius], axis=1)
    facets = voronoi_facets(points, local_spacing(points))
    middle = np.flatnonzero((radius > 1e-5) & (radius < 0.5))
    count = np.bincount(facets.pairs.reshape(-1), minlength=8000)[middle]
    assert (count >= 3).mean() > 0.99
    assert (facets.area > 0).all()


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


def test_a_dense_ball_beside_sparse_points_is_fast():
    """In the frame of those the jitter of its own spacing is lost in rounding: half a minute, where it is all there."""
    ball = shapes.scattered_sphere(4000, 1) * 0.007 + [1.014, 0, 0]
    points = np.concatenate([shapes.scattered_sphere(3000), ball])
    spacing, start = local_spacing(points), time.process_time()
    facets = voronoi_facets(points, spacing)
    assert time.process_time() - start < 5
    assert len(np.unique(facets.pairs)) == len(points)


def test_areas_follow_scale_motion_and_order(random):
    points = shapes.torus(500)
    areas = facets_of(points)
    moved = 7 * points @ shapes.random_rotation(1).T + [1, 2, 3]
    tolerance = 1e-3 * areas.max()
    np.testing.assert_allclose(facets_of(moved) / 49, areas, atol=tolerance)
    order = random.permutation(len(points))
    np.testing.assert_allclose(facets_of(points[order]), areas[np.ix_(order, order)], atol=tolerance)


BLOCKWISE = {
    "torus": shapes.torus(3000),
    "uneven sheet": np.column_stack([np.random.default_rng(1).random((3000, 2)) ** 2, np.zeros(3000)]),
    "volume": np.random.default_rng(2).random((1500, 3)),
    "outliers": np.concatenate([shapes.scattered_sphere(2000), np.random.default_rng(3).normal(size=(20, 3)) * 3]),
    "two scales": np.concatenate([shapes.torus(1500), shapes.torus(1500) * 0.02 + 2]),
}


@pytest.mark.parametrize("points", BLOCKWISE.values(), ids=BLOCKWISE)
def test_blocks_give_the_facets_of_the_whole(points, monkeypatch):
    spacing, n = local_spacing(points), len(points)
    whole = voronoi_facets(points, spacing)
    monkeypatch.setattr(blocks, "SIZE", 300)
    found = voronoi_facets(points, spacing)
    unit = clip_radius(spacing, *whole.pairs.T) ** 2, clip_radius(spacing, *found.pairs.T) ** 2
    _, both, again = np.intersect1d(whole.pairs @ [n, 1], found.pairs @ [n, 1], return_indices=True)
    np.testing.assert_allclose((found.area / unit[1])[again], (whole.area / unit[0])[both], rtol=1e-9, atol=1e-9)
    for facets, size, shared in ((whole, unit[0], both), (found, unit[1], again)):
        assert (np.delete(facets.area / size, shared) < 1e-8).all()


def test_number_of_threads_does_not_show(monkeypatch):
    monkeypatch.setattr(blocks, "SIZE", 100)
    points = shapes.torus(1500)
    several = voronoi_facets(points, local_spacing(points))
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    one = voronoi_facets(points, local_spacing(points))
    assert one.pairs.tobytes() == several.pairs.tobytes()
    assert one.area.tobytes() == several.area.tobytes()


def test_reports_progress_and_cancels_between_blocks(monkeypatch):
    monkeypatch.setattr(blocks, "SIZE", 100)
    points, seen = shapes.torus(1500), []
    voronoi_facets(points, local_spacing(points), progress=lambda fraction, _: seen.append(fraction))
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    assert len(seen) > 20
    looks = []
    with pytest.raises(Cancelled):
        voronoi_facets(
            points, local_spacing(points), progress=lambda fraction, _: looks.append(fraction) or fraction < 0.3
        )
    assert max(looks) < 0.5
