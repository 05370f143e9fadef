import numpy as np
import pytest

from core.cleaning import averaged
from core.cleaning.averaged import cells_of_means
from core.cleaning.noise import noisy_samples
from core.points import local_spacing
from tests import shapes


def means(points, side):
    """One sample in each cell of a grid: the mean of the points there."""
    cell = np.unique(np.floor(points / side), axis=0, return_inverse=True)[1].reshape(-1)
    return np.stack([np.bincount(cell, x) / np.bincount(cell) for x in points.T], axis=1)


def box(n, noise):
    """Noisy points of the faces of a box along the axes."""
    chance, size = np.random.default_rng(0), np.array([1.0, 0.8, 0.6])
    points = size * chance.random((n, 3))
    face = chance.integers(0, 6, n)
    points[np.arange(n), face // 2] = size[face // 2] * (face % 2)
    return points + noise * chance.normal(size=(n, 3)) + [0.013, 0.027, 0.041]


MEANS = {
    "sphere": means(shapes.scattered_sphere(100_000), 0.06),
    "noisy sphere": means(shapes.scattered_sphere(100_000) + 0.006 * np.random.default_rng(0).normal(size=3), 0.06),
    "box": means(box(100_000, 0.0), 0.06),
    "noisy box": means(box(100_000, 0.01), 0.06),
    "moebius": means(shapes.moebius(60_000), 0.06),
}
OTHERS = {
    "scattered sphere": shapes.scattered_sphere(3000),
    "even sphere": shapes.sphere(3000),
    "scattered box": box(3000, 0.01),
    "even square": shapes.square(3000),
    "close sheets": shapes.sheets(3000, gap=0.03),
}


@pytest.mark.parametrize("name", MEANS)
@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_cells_of_means_are_found(name, scale):
    points = scale * MEANS[name]
    assert cells_of_means(points, local_spacing(points)) == pytest.approx(0.06 * scale, rel=0.02)


@pytest.mark.parametrize("name", OTHERS)
def test_other_samples_are_no_means_of_cells(name):
    points = OTHERS[name]
    assert cells_of_means(points, local_spacing(points)) is None


def test_noise_that_cells_part_is_no_thin_wall():
    """Where cells part a noisy face that runs along them its means lie in two layers a third of a cell apart."""
    points = means(box(100_000, 0.006), 0.03)
    assert noisy_samples(points, local_spacing(points)).all()


def test_walls_wider_than_the_cells_of_their_means_stay():
    sheets = np.random.default_rng(0).uniform(0, 1, (100_000, 3))
    sheets[:, 2] = 0.033 * (sheets[:, 2] > 0.5) + 0.02 * np.sin(5 * sheets[:, 0])
    points = means(sheets, 0.03)
    assert not noisy_samples(points, local_spacing(points)).any()


def test_parts_far_from_each_other_are_looked_at_one_by_one(monkeypatch):
    """The waves that tell cells apart grow in number with the extent of what is looked at."""
    looked, waves = [], averaged._waves
    monkeypatch.setattr(
        averaged, "_waves", lambda x, frequencies: looked.append(len(frequencies)) or waves(x, frequencies)
    )
    for apart in (0.0, 60_000.0):
        points = np.concatenate([MEANS["sphere"], MEANS["sphere"] + [apart, 0, 2.4]])
        assert cells_of_means(points, local_spacing(points)) == pytest.approx(0.06, rel=0.01)
    assert max(looked) < 10_000


def test_points_of_a_lattice_are_no_means():
    """They share no cells wherever these are."""
    x, y = np.indices((40, 40)).reshape(2, -1)
    points = np.stack([x, y, np.rint(3 * np.sin(x / 7) + 2 * np.cos(y / 5))], axis=1)
    assert cells_of_means(points, local_spacing(points)) is None
