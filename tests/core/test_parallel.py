"""Chunks in order, whatever each of them takes."""

import os
import threading
import time
from contextlib import nullcontext

import numpy as np
import pytest

from core import Settings, reconstruct
from core.parallel import _FEW, _HELD, beside, even_chunks, in_order, over_rows, workers
from core.progress import Progress

CORES = os.cpu_count() or 1
pytestmark = pytest.mark.skipif(CORES < 2, reason="one core works on chunks one after another")


def test_results_come_in_the_order_of_the_chunks():
    assert list(in_order(lambda x: x * x, range(100))) == [(x, x * x) for x in range(100)]
    assert list(in_order(str, [])) == []


def test_one_chunk_is_worked_on_in_the_thread_of_the_caller():
    here = threading.current_thread()

    def threads(chunks):
        return [thread for _, thread in in_order(lambda _: threading.current_thread(), chunks)]

    assert threads([0]) == [here]
    assert here not in threads([0, 1])


@pytest.mark.parametrize("count", [0, 1, _FEW, 10 * _FEW + 7])
def test_every_row_is_worked_on_once(count):
    times = np.zeros(count, int)

    def work(part):
        times[part] += 1

    over_rows(work, count, 2 * _FEW)
    assert (times == 1).all()


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


def test_loops_within_share_threads_that_end_with_it():
    def threads():
        return {thread for _, thread in in_order(lambda _: threading.current_thread(), range(4 * CORES))}

    before = threading.active_count()
    with workers():
        found = threads()
        with workers():
            found |= threads()
        found |= threads()
        assert len(found) <= CORES
        assert threading.active_count() > before
    assert threading.active_count() == before
    assert not threads() & found


def test_loops_may_be_begun_by_work_and_while_others_go_on():
    with workers():
        inner = in_order(lambda x: sum(y for _, y in in_order(abs, range(-x, 0))), range(4 * CORES))
        outer = in_order(lambda pair: pair[1] + 1, inner)
        assert [found for _, found in outer] == [x * (x + 1) // 2 + 1 for x in range(4 * CORES)]


def test_what_waits_for_a_thread_is_not_begun_once_something_was_raised():
    begun, go_on = [], threading.Event()

    def work(chunk):
        begun.append(chunk)
        assert chunk == 0 or go_on.wait(20)

    def run():
        loop = in_order(work, range(4 * CORES))
        with workers():
            next(loop)
            threading.Timer(0.2, go_on.set).start()
            raise RuntimeError("cancelled")

    with pytest.raises(RuntimeError, match="cancelled"):
        run()
    assert len(begun) <= CORES + 1


def test_what_work_raises_comes_out():
    with pytest.raises(ZeroDivisionError):
        list(in_order(lambda x: 1 / x, [1, 0, 1]))
    with beside(lambda: 1 / 0) as result:
        pass
    with pytest.raises(ZeroDivisionError):
        result()


@pytest.mark.parametrize("shared", [workers, nullcontext])
def test_work_beside_a_block_is_done_meanwhile_and_ends_with_it(shared):
    met, before = threading.Barrier(2, timeout=20), threading.active_count()

    def work():
        met.wait()
        return [y for _, y in in_order(abs, range(-4 * CORES, 0))], threading.current_thread()

    with shared():
        with beside(work) as result:
            met.wait()  # both are at it
            assert [y for _, y in in_order(abs, range(4 * CORES))] == list(range(4 * CORES))
        found, thread = result()
        assert found == list(range(4 * CORES, 0, -1))
        assert thread is not threading.current_thread()
    assert threading.active_count() == before


def test_work_that_waits_for_a_thread_is_done_though_the_block_is_over():
    with workers():
        busy = in_order(lambda _: time.sleep(0.1), range(2 * CORES))
        next(busy)
        with beside(lambda: "done") as result:
            pass
        assert result() == "done"
        list(busy)


def test_where_the_block_raises_work_beside_it_ends_first():
    done, go_on = [], threading.Event()

    def run():
        with beside(lambda: go_on.wait(20) and done.append(True)):
            threading.Timer(0.2, go_on.set).start()
            raise RuntimeError("cancelled")

    with pytest.raises(RuntimeError, match="cancelled"):
        run()
    assert done


@pytest.mark.parametrize("count", [1, _FEW, _FEW + 1, 8192, 8193, 20_000, 50_000, 1_000_000])
@pytest.mark.parametrize("cores", [1, 2, 3, 8])
def test_even_chunks_keep_all_cores_at_work_to_the_end(count, cores, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    parts = list(even_chunks(count, 8192, Progress()))
    assert np.array_equal(np.concatenate([np.arange(count)[part] for part in parts]), np.arange(count))
    *_, last = sizes = [part.stop - part.start for part in parts]
    size, chunks = sizes[0], len(parts)
    assert size <= 8192
    assert chunks % cores == 0 or size == min(_FEW, count)
    assert chunks == 1 or last > size - chunks or size == _FEW


def test_no_rows_are_no_chunks():
    assert list(even_chunks(0, 8192, Progress())) == []


def test_what_comes_out_does_not_depend_on_the_number_of_cores(monkeypatch):
    points = np.random.default_rng(0).normal(size=(3000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points = points[points[:, 2] < 0.6]
    found = []
    for cores in (1, 2, 5):
        monkeypatch.setattr(os, "cpu_count", lambda cores=cores: cores)
        found.append(reconstruct(points, Settings(resolution=48, surface="both")))
    for other in found[1:]:
        assert np.array_equal(other.field.values, found[0].field.values)
        for kind in ("surface", "sheet"):
            meshes = getattr(other, kind), getattr(found[0], kind)
            assert np.array_equal(*(mesh.vertices for mesh in meshes))
            assert np.array_equal(*(mesh.faces for mesh in meshes))


@pytest.mark.parametrize("callback", [None, lambda *_: True])
def test_where_no_thread_can_be_started_memory_is_short(callback, monkeypatch):
    def none_left(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", none_left)
    with pytest.raises(MemoryError, match="no further thread can be started"):
        list(in_order(str, range(9)))
    with pytest.raises(MemoryError, match="no further thread can be started"):
        reconstruct(np.random.default_rng(0).normal(size=(50, 3)), Settings(resolution=16), progress=callback)
