"""Chunks in order, whatever each of them takes."""

import os
import threading

import pytest

from core.parallel import _HELD, in_order

CORES = os.cpu_count() or 1
pytestmark = pytest.mark.skipif(CORES < 2, reason="one core works on chunks one after another")


def test_results_come_in_the_order_of_the_chunks():
    assert list(in_order(lambda x: x * x, range(100))) == [(x, x * x) for x in range(100)]
    assert list(in_order(str, [])) == []


def test_chunks_behind_a_large_one_go_on_meanwhile_but_not_without_end():
    """The first waits until as many as may be held are done; one more would never come."""
    last, done = CORES * _HELD - 1, threading.Event()
    started = []

    def work(chunk):
        if chunk == 0:
            assert done.wait(20)
        elif chunk == last:
            done.set()
        return chunk

    def chunks():
        for chunk in range(2 * CORES * _HELD):
            started.append(chunk)
            yield chunk

    results = in_order(work, chunks())
    assert next(results) == (0, 0)
    assert len(started) == last + 1
    assert [chunk for chunk, _ in results] == list(range(1, 2 * CORES * _HELD))


def test_where_chunks_raise_no_thread_is_left():
    def chunks():
        yield from range(2 * CORES)
        raise RuntimeError("cancelled")

    before = threading.active_count()
    with pytest.raises(RuntimeError, match="cancelled"):
        list(in_order(str, chunks()))
    assert threading.active_count() == before


def test_what_work_raises_comes_out():
    with pytest.raises(ZeroDivisionError):
        list(in_order(lambda x: 1 / x, [1, 0, 1]))
