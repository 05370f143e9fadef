import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core import Cancelled
from core.voronoi import blocks
from core.voronoi.blocks import overlapping_blocks
from tests import shapes


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(blocks, "SIZE", 20)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 200), st.floats(1e-6, 1), st.booleans(), st.integers(0, 2**32 - 1))
def test_every_point_is_owned_once_and_members_are_those_within_reach(count, scale, flat, seed):
    random = np.random.default_rng(seed)
    points = random.random((count, 3)) * [1, 1, 0 if flat else 1]
    reach = scale * (1e-3 + random.random(count) ** 4)
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    size, blocks.SIZE = blocks.SIZE, 20
    try:
        found = overlapping_blocks(points, reach)
    finally:
        blocks.SIZE = size
    np.testing.assert_array_equal(np.sort(np.concatenate([block.own for block in found])), np.arange(count))
    for block in found:
        near = (apart[block.own] <= reach[block.own, None]).any(axis=0)
        np.testing.assert_array_equal(block.members, np.flatnonzero(near))


def test_points_on_a_sheet_stay_in_small_blocks_whatever_looks_far(small):
    points = np.concatenate([shapes.square(2000), [[0.3, 0.3, 5], [0.7, 0.7, 5]]])
    reach = np.append(np.full(2000, 0.05), [9.0, 9.0])
    found = overlapping_blocks(points, reach)
    *usual, far = found
    assert max(len(block.members) for block in usual) < 200
    assert far.own.tolist() == [2000, 2001]
    assert len(far.members) == 2002


def test_crowded_blocks_stay_together(small):
    points = np.random.default_rng(0).random((500, 3))
    found = overlapping_blocks(points, np.full(500, 2.0))
    assert min(len(block.own) for block in found) > 100


def test_cancels(small):
    with pytest.raises(Cancelled):
        overlapping_blocks(shapes.square(500), np.full(500, 0.1), lambda fraction, _: False)


@pytest.mark.parametrize("kind", ["skew", "rings", "knot"])
def test_lines_are_in_blocks_so_small_that_their_diagrams_are(kind):
    """Of lines that are skew to each other a diagram has as many tetrahedra as the square of their points."""
    t = np.linspace(0, 2 * np.pi, 4000, endpoint=False)
    if kind == "skew":
        points = np.concatenate([np.stack([t, 0 * t, 0 * t], axis=1), np.stack([0 * t + 3, t - 3, 0 * t + 3], axis=1)])
    elif kind == "rings":
        ring = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
        points = np.concatenate([ring, ring[:, [0, 2, 1]] + [1, 0, 0]])
    else:
        points = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1)
    spacing = np.linalg.norm(points[1] - points[0])
    found = overlapping_blocks(points, np.full(len(points), 6 * spacing))
    np.testing.assert_array_equal(np.sort(np.concatenate([block.own for block in found])), np.arange(len(points)))
    assert max(len(block.members) for block in found) <= 500


def test_a_sheet_is_not_cut_up_further():
    assert len(overlapping_blocks(shapes.sphere(2000), np.full(2000, 0.4))) == 1
