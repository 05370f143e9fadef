"""Which samples are on lines, on which, and which way these run."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from core.neighbourhoods.lines import find_lines
from core.points import local_spacing
from tests import shapes


def lines_of(points):
    return find_lines(points, local_spacing(points), KDTree(points).query(points, k=9)[1][:, 1:])


def test_lines_side_by_side_are_told_apart_and_have_their_direction():
    rng = np.random.default_rng(0)
    along, place = (x.reshape(-1) for x in np.meshgrid(np.arange(100) * 0.01, np.arange(5) * 0.08))
    points = np.stack([along + rng.uniform(-2e-3, 2e-3, 500), place, 0.1 * np.sin(5 * along)], axis=1)
    turn = shapes.random_rotation(3)
    lines = lines_of(points @ turn.T)
    on = lines.number >= 0
    assert on.mean() > 0.98
    assert all(len(np.unique(lines.number[on & (place == y)])) == 1 for y in np.unique(place))
    assert len(np.unique(lines.number[on])) == 5
    way = np.stack([np.ones(500), np.zeros(500), 0.5 * np.cos(5 * along)], axis=1)
    cosine = np.abs(np.einsum("ni,ni->n", lines.along @ turn, way)) / np.linalg.norm(way, axis=1)
    assert cosine[on].min() > 0.99
    assert not lines.along[~on].any()
    own = np.flatnonzero(on)[:3]
    steps = np.stack([lines.along[own], turn @ [0.0, 1.0, 0.0] + 0 * lines.along[own]], axis=1)
    assert lines.aside(own, steps).tolist() == [[False, True]] * 3


@pytest.mark.parametrize(
    "points",
    [
        shapes.scattered_sphere(3000),
        shapes.square(900),
        np.random.default_rng(0).random((3000, 3)),
        shapes.moebius(900),
    ],
    ids=["random sphere", "lattice", "volume", "band"],
)
def test_elsewhere_there_are_none(points):
    assert (lines_of(points).number == -1).all()


def test_a_few_in_a_row_are_no_line():
    row = np.stack([3 + np.arange(7) * 0.001, np.zeros(7), np.zeros(7)], axis=1)
    points = np.concatenate([shapes.scattered_sphere(500), row])
    assert (lines_of(points).number == -1).all()
