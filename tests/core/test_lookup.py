"""Against NumPy's own sets of numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from core.lookup import edge_keys, grouped, is_among, least_of_each, mask_of, numbered, rows_of, sums_of_each

NUMBERS = arrays(np.int64, st.integers(0, 30), elements=st.integers(-5, 20))


@given(NUMBERS, NUMBERS)
def test_rows_are_where_the_numbers_stand(wanted, others):
    ascending = np.unique(others)
    row = rows_of(wanted, ascending)
    assert (row >= 0).tolist() == is_among(wanted, ascending).tolist() == np.isin(wanted, ascending).tolist()
    assert ascending[row[row >= 0]].tolist() == wanted[row >= 0].tolist()


@pytest.mark.parametrize("shape", [(0,), (7,), (3, 4), (0, 2)])
def test_answers_have_the_shape_of_the_question(shape, random):
    wanted, ascending = random.integers(0, 9, shape), np.array([1, 4, 5])
    assert rows_of(wanted, ascending).shape == is_among(wanted, ascending).shape == shape
    assert (rows_of(wanted, ascending[:0]) == -1).all()
    assert numbered(wanted)[1].shape == shape


@given(arrays(np.int64, st.tuples(st.integers(0, 9), st.integers(0, 3)), elements=st.integers(0, 20)))
def test_a_mask_of_rows_marks_those(rows):
    assert np.flatnonzero(mask_of(rows, 21)).tolist() == sorted(set(rows.reshape(-1).tolist()))


@given(NUMBERS)
def test_distinct_numbers_in_order_and_which_each_is(keys):
    distinct, number = numbered(keys)
    assert distinct.tolist() == sorted(set(keys.tolist()))
    assert distinct[number].tolist() == keys.tolist()


@given(st.lists(st.integers(0, 5), max_size=30))
def test_rows_of_equal_numbers_are_grouped_in_order(numbers):
    order, first = grouped(np.array(numbers, np.int64))
    groups = [group.tolist() for group in np.split(order, first[1:])] if numbers else []
    assert groups == [[row for row, each in enumerate(numbers) if each == one] for one in sorted(set(numbers))]


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 2), st.integers(-2, 2)), max_size=30))
def test_the_least_of_each_key_is_the_first_by_its_costs(rows):
    keys, first, second = np.array(rows, np.int64).reshape(-1, 3).T
    found = least_of_each(keys, first, second)
    ordered = sorted(range(len(rows)), key=lambda row: rows[row])
    assert found.tolist() == [next(row for row in ordered if rows[row][0] == key) for key in sorted(set(keys.tolist()))]


def test_sums_of_each_number_are_those_of_its_rows(random):
    number, rows = random.integers(0, 4, 50), random.normal(size=(50, 3))
    found = sums_of_each(number, rows, 6)
    np.testing.assert_allclose(found, [rows[number == each].sum(axis=0) for each in range(6)], atol=1e-14)


def test_edges_have_one_key_either_way():
    edges = np.array([[0, 1], [1, 0], [0, 2], [1, 2]], np.int32)
    first, again, *others = edge_keys(edges, 3).tolist()
    assert first == again
    assert len({first, *others}) == 3
