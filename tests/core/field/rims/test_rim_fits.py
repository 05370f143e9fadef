"""The lowest lines over samples at rims, and which samples count."""

from itertools import product

import numpy as np
import pytest

from core.field.rims.rim_fits import beside, lowest_lines
from core.neighbourhoods.cloud import Cloud


def test_the_lowest_line_is_the_upper_hull(random):
    along, up = random.uniform(-5, 5, (50, 12)), -random.random((50, 12))
    along[:, 0] = up[:, 0] = 0
    up[:, 1:] += random.choice([0.0, 1.0], (50, 1))
    found, slope = lowest_lines(along, up, 8)
    for row in range(50):
        s, h = along[row], up[row]
        chords = [
            (h[i] * s[j] - h[j] * s[i]) / (s[j] - s[i]) for i, j in product(range(12), repeat=2) if s[i] < 0 < s[j]
        ]
        assert found[row] == pytest.approx(max([0.0, *chords]), abs=0.02 * 5) or abs(slope[row]) > 1.9
        assert (found[row] + slope[row] * s - h).min() > -1e-9


def test_samples_beside_are_seen_along_the_rim_and_out_of_it(random):
    """In lengths of each; of other sheets, across a bay and past the window none counts, but the sample itself does."""
    points = np.array([[0, 0, 0], [3, 0.5, 0], [-2, -1, 0], [1, 3, 0], [0.5, 0, 1], [9, 0, 0]], float)
    normals = np.tile([0.0, 0, 1], (len(points), 1))
    cloud = Cloud.of(points, normals, np.ones(len(points)))
    around = beside(np.array([0]), np.array([[0.0, 1, 0]]), np.array([2.0]), cloud, 4.0, 6)
    place = np.argsort(around.other[0])
    np.testing.assert_allclose(around.along[0, place], -points[:, 0] / 2)
    np.testing.assert_allclose(around.up[0, place], points[:, 1] / 2)
    np.testing.assert_array_equal(around.counts[0, place], [True, True, True, False, False, False])
    assert around.window == [4.0]


def test_of_each_bin_the_outermost_sample_is_kept(random):
    points = np.column_stack([random.uniform(-4, 4, 300), -random.random(300), np.zeros(300)])
    points[0] = 0
    normals = np.tile([0.0, 0, 1], (300, 1))
    row, out, cloud = np.array([0]), np.array([[0.0, 1, 0]]), Cloud.of(points, normals, np.ones(300))
    around = beside(row, out, np.ones(1), cloud, 4.0, 300)
    along, up = around.outermost(4.0, 8)
    assert along[0, 0] == up[0, 0] == 0
    for bin_ in range(8):
        inside = (around.along[0] >= bin_ - 4) & (around.along[0] < bin_ - 3) & around.counts[0]
        assert up[0, 1 + bin_] == around.up[0, inside].max()
