"""Arrays in blocks are the same as dense ones: values, regions, gradients."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import label

from core.field.blocks import (
    SIDE,
    Blocks,
    at_nodes,
    blocks_of,
    counts,
    each,
    inner_nodes,
    marked_nodes,
    node_gradient,
    put,
    regions,
    table_shape,
)

SHAPE = (20, 9, 33)  # 3 x 2 x 5 blocks, those at the end cut off by the box


def in_blocks(array, constant):
    """`array` in blocks, those equal to `constant` throughout not stored."""
    table = table_shape(array.shape)
    padded = np.full([SIDE * n for n in table], constant)
    padded[tuple(slice(n) for n in array.shape)] = array
    parts = padded.reshape(table[0], SIDE, table[1], SIDE, table[2], SIDE).transpose(0, 2, 4, 1, 3, 5)
    parts = parts.reshape(-1, SIDE, SIDE, SIDE)
    varied = np.flatnonzero((parts != constant).any(axis=(1, 2, 3)))
    found = blocks_of(array.shape, varied, array.dtype.type(constant))
    found.stored[:] = parts[varied]
    return found


def ball(radius=6.0, centre=(9.3, 4.2, 14.1), limit=4.0):
    """Distance to a sphere in cells, cut off at `limit`."""
    x = np.indices(SHAPE) - np.reshape(centre, (3, 1, 1, 1))
    return np.minimum(np.abs(np.linalg.norm(x, axis=0) - radius), limit).astype(np.float32)


def stored_only(blocks):
    """The whole array, NaN where no block is stored."""
    return replace(blocks, outer=np.full(blocks.slot.shape, np.nan)).dense()


def test_only_blocks_that_vary_are_stored_and_nothing_is_lost():
    blocks = in_blocks(ball(), 4.0)
    assert 0 < len(blocks.stored) < 3 * 2 * 5
    np.testing.assert_array_equal(blocks.dense(), ball())
    node = np.random.default_rng(0).integers(0, ball().size, (50, 7))
    np.testing.assert_array_equal(blocks.at(node), ball().reshape(-1)[node])
    np.testing.assert_array_equal(at_nodes(blocks, node), at_nodes(ball(), node))
    assert blocks.at(node).dtype == np.float32


def test_without_a_stored_block_there_are_constants():
    blocks = blocks_of(SHAPE, np.empty(0, np.int64), np.float32(3))
    assert blocks.at(np.arange(10)).tolist() == [3.0] * 10
    assert blocks.dense().shape == SHAPE
    assert blocks.merged().size == 0
    labels, count = regions(each(lambda u: u > 1, blocks))
    assert count == 1
    assert (labels.dense() == 1).all()


def test_marked_nodes_ascend_and_lie_in_the_box():
    dense = ball() < 2
    np.testing.assert_array_equal(marked_nodes(in_blocks(dense, False)), np.flatnonzero(dense))
    found = marked_nodes(in_blocks(ball(), 4.0).map(lambda u: np.ones_like(u, bool)))
    assert (np.diff(found) > 0).all()
    assert found.max() < np.prod(SHAPE)


def test_inner_nodes_are_off_the_sides():
    blocks = in_blocks(np.random.default_rng(1).random(SHAPE), -1.0)  # all stored
    np.testing.assert_array_equal(inner_nodes(blocks).dense(), inner_nodes(ball()))


def test_values_are_put_where_they_belong():
    blocks, dense = in_blocks(ball(), 4.0), ball()
    node = marked_nodes(each(lambda u: u < 1, blocks))
    for array in (blocks, dense):
        put(array, node, np.arange(len(node)))
    np.testing.assert_array_equal(blocks.dense(), dense)


def test_what_is_put_outside_of_stored_blocks_is_left_out():
    blocks = in_blocks(ball(), 4.0)
    before, outside = blocks.dense().copy(), np.flatnonzero(np.isnan(stored_only(blocks)))
    assert len(outside)
    put(blocks, outside, np.zeros(len(outside)))
    np.testing.assert_array_equal(blocks.dense(), before)


def test_merging_keeps_what_blocks_were_filled_with():
    filled = blocks_of(SHAPE, np.arange(np.prod(table_shape(SHAPE))), np.float32(7))
    filled.stored[:] = np.random.default_rng(0).random(filled.stored.shape)
    filled.stored[3] = 0.5
    merged = filled.merged()
    assert len(merged.stored) == len(filled.stored) - 1
    assert merged.outer.max() == 7
    np.testing.assert_array_equal(merged.dense(), filled.dense())


def test_values_beyond_two_to_the_31_entries_are_found():
    """Two blocks stand for four million."""

    class Many(np.ndarray):
        def __getitem__(self, entry):
            assert (np.asarray(entry) >= 0).all()
            return super().__getitem__(np.asarray(entry) % (2 * SIDE**3))

    blocks = in_blocks(np.random.default_rng(1).random((16, 8, 8)).astype(np.float32), -1.0)
    far = replace(blocks, slot=blocks.slot + np.int32(2**22), stored=blocks.stored.view(Many))
    np.testing.assert_array_equal(far.at(np.arange(1024)), blocks.at(np.arange(1024)))


def test_merging_keeps_both_signs_of_what_becomes_constant():
    inside = np.linalg.norm(np.indices(SHAPE) - np.reshape((9, 4, 16), (3, 1, 1, 1)), axis=0) < 11
    signed = np.where(inside, -1, 1).astype(np.float32) * np.float32(2)
    blocks = in_blocks(signed, 2.0)
    merged = blocks.merged()
    assert len(merged.stored) < len(blocks.stored)
    np.testing.assert_array_equal(merged.dense(), signed)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.2, 0.6, 0.75, 0.95]))
def test_regions_are_those_of_the_dense_array(seed, share):
    """Random sets that run through stored and constant blocks; some blocks are wholly one or the other."""
    random = np.random.default_rng(seed)
    mask = random.random(SHAPE) < share
    for constant in (False, True):
        corner = random.integers(0, 12, 3)
        mask[tuple(slice(c - c % SIDE, c - c % SIDE + 2 * SIDE) for c in corner)] = constant
        expected, number = label(mask)
        found, count = regions(in_blocks(mask, constant))
        found = found.dense()
        assert count == number
        np.testing.assert_array_equal(found > 0, mask)
        pairs = np.unique(np.stack([expected[mask], found[mask]]), axis=1)
        assert pairs.shape[1] == number  # one name each, both ways


def test_counts_are_those_of_the_dense_array():
    mask = in_blocks(ball() < 2, False)
    labels, _ = regions(mask)
    dense, _ = label(ball() < 2)
    assert sorted(counts(labels)[1:]) == sorted(counts(dense)[1:])


def test_gradients_are_those_of_the_dense_array_but_at_the_end_of_the_band():
    dense, blocks = ball(), in_blocks(ball(), 4.0)
    slopes, expected = node_gradient(blocks, 0.5), node_gradient(dense, 0.5)
    assert slopes.stored.shape == (*blocks.stored.shape, 3)
    for axis in range(3):
        part = Blocks(blocks.shape, blocks.slot, slopes.outer, np.ascontiguousarray(slopes.stored[..., axis])).dense()
        inner = inner_nodes(dense)
        known = dense < 2.9
        np.testing.assert_allclose(part[known], expected[known][:, axis], atol=1e-5)
        assert not part[(dense >= 4) & inner].any()
    assert not blocks.inside().all()
    assert not slopes.stored[~blocks.inside()].any()


@pytest.mark.parametrize("shape", [(8, 8, 8), (1, 17, 64)])
def test_a_table_has_room_for_every_node(shape):
    table = np.array(table_shape(shape))
    assert ((SIDE * table >= shape) & (SIDE * (table - 1) < shape)).all()


def test_constant_blocks_count_as_whole_ones():
    mask = blocks_of((24, 24, 24), np.array([13]), np.False_)
    mask.outer[0] = True  # nine blocks along one side
    labels, n = regions(mask)
    assert n == 1
    assert counts(labels)[1] == 9 * SIDE**3
