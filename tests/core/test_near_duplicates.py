import itertools

import numpy as np
import pytest

from core import Settings, reconstruct
from core.near_duplicates import find_near_duplicates
from core.points import prepare_samples
from tests import shapes

SCATTERED = shapes.scattered_sphere(3000)
SPACING = np.sqrt(4 * np.pi / len(SCATTERED))


def _random_torus(n):
    rng = np.random.default_rng(3)
    turn, around, kept = rng.uniform(0, 2 * np.pi, 3 * n), rng.uniform(0, 2 * np.pi, 3 * n), rng.uniform(0, 1.4, 3 * n)
    out = 1 + 0.4 * np.cos(around)
    torus = np.stack([out * np.cos(turn), out * np.sin(turn), 0.4 * np.sin(around)], axis=1)
    return torus[kept < out][:n]


def _lines(n):
    rng = np.random.default_rng(4)
    return np.stack([rng.uniform(0, 1000, n), 100.0 * rng.integers(0, 3, n), np.zeros(n)], axis=1)


@pytest.mark.parametrize(
    "points",
    [
        SCATTERED,
        shapes.sphere(3000),
        shapes.lattice(12),
        shapes.square(900),
        _lines(3000),
        np.random.default_rng(5).normal(size=(3000, 3)),
        SCATTERED * np.where(np.random.default_rng(6).random(3000) < 0.5, 1.0, 1.02)[:, None],
        SCATTERED[:17],
    ],
    ids=["random", "even", "lattice", "square", "lines", "cloud", "two shells", "few"],
)
def test_a_cloud_without_copies_stays_whole(points):
    assert not find_near_duplicates(points).any()


@pytest.mark.parametrize(
    ("share", "jitter"), [*itertools.product([1.0, 0.3, 0.03], [1e-12, 1e-6, 1e-3]), (1.0, 0.03), (0.3, 0.03)]
)
def test_copies_go_and_the_first_of_each_stays(share, jitter):
    rng = np.random.default_rng(0)
    again = rng.choice(len(SCATTERED), int(share * len(SCATTERED)), replace=False)
    copies = SCATTERED[again] + rng.uniform(-1, 1, (len(again), 3)) * jitter * SPACING / np.sqrt(3)
    found = find_near_duplicates(np.vstack([SCATTERED, copies]))
    assert found[len(SCATTERED) :].all()
    assert found[: len(SCATTERED)].mean() < 0.04


def test_many_copies_of_each():
    rng = np.random.default_rng(1)
    copies = [SCATTERED + rng.normal(size=SCATTERED.shape) * 0.005 * SPACING for _ in range(6)]
    found = find_near_duplicates(np.vstack([SCATTERED, *copies]))
    assert found[len(SCATTERED) :].mean() > 0.99
    assert found[: len(SCATTERED)].mean() < 0.04


def _cubes(count, apart):
    corners = np.indices((2, 2, 2)).reshape(3, -1).T.astype(float)
    return (apart * np.indices((count, count, 1)).reshape(3, -1).T[:, None] + corners).reshape(-1, 3)


@pytest.mark.parametrize("apart", [20, 24, 30, 50, 1000])
def test_points_of_a_few_small_parts_far_apart_are_no_copies(apart):
    assert not find_near_duplicates(_cubes(2, apart)).any()


@pytest.mark.parametrize("apart", [20, 24, 30, 50])
def test_points_of_many_small_parts_far_apart_are_no_copies(apart):
    rng = np.random.default_rng(7)
    parts = 2 * rng.random((36, 10, 3)) + apart * np.indices((6, 6, 1)).reshape(3, -1).T[:, None]
    assert not find_near_duplicates(_cubes(6, apart)).any()
    assert not find_near_duplicates(parts.reshape(-1, 3)).any()


def test_copies_are_found_in_any_order():
    """Those of two scanners that took turns, too, where every other row of many is looked at."""
    points = shapes.scattered_sphere(8192)
    points[1::4] = points[3::4] + 1e-9
    found = find_near_duplicates(points)
    assert found[3::4].all()
    assert found.mean() < 0.26
    order = np.random.default_rng(8).permutation(len(points))
    assert find_near_duplicates(points[order]).sum() == found.sum()


def test_a_part_that_is_there_twice():
    torus = _random_torus(4000)
    twice = np.flatnonzero(torus[:, 0] > 0)
    samples = prepare_samples(np.vstack([torus, torus[twice].astype(np.float32)]))
    assert (samples.source_index < len(torus)).all()
    assert len(samples.points) > 0.98 * len(torus)
    assert len(samples.warnings) == 1
    assert f"of {len(torus) + len(twice)} points dropped: near copies" in samples.warnings[0]


def test_a_cloud_and_its_single_precision_copy_give_the_surface_of_one():
    torus = _random_torus(4000)
    result = reconstruct(np.vstack([torus, torus.astype(np.float32)]), Settings(resolution=64))
    assert shapes.euler(result.surface) == 0
    assert len(shapes.components(result.surface)) == 2
    assert np.abs(shapes.torus_distance(result.surface.vertices)).max() < 0.03
