import threading
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core import Cancelled, VADError
from core.progress import Progress, watched

fractions = st.floats(0, 1)


def recorder():
    seen = []
    return seen, lambda fraction, text: seen.append((fraction, text))


@given(fractions, fractions, fractions, fractions, fractions)
def test_nested_parts_map_onto_the_whole(a, b, c, d, at):
    seen, callback = recorder()
    Progress(callback).part(a, b, "outer").part(c, d)(at)
    ((fraction, text),) = seen
    assert fraction == pytest.approx(a + (b - a) * (c + (d - c) * at), abs=1e-12)
    assert text == "outer"


def test_a_part_can_be_renamed():
    seen, callback = recorder()
    Progress(callback).part(0, 0.5, "one").part(0, 1, "two")(1)
    assert seen == [(0.5, "two")]


@pytest.mark.parametrize("answer", [None, True, 0, ""])
def test_only_false_cancels(answer):
    Progress(lambda *_: answer).part(0, 1, "field")(0.5)


@pytest.mark.parametrize("answer", [False, np.False_])
def test_false_cancels_and_names_the_stage(answer):
    with pytest.raises(Cancelled, match=r"field.*nothing was written"):
        Progress(lambda *_: answer).part(0, 1, "field")(0.5)
    assert issubclass(Cancelled, VADError)


def test_nothing_to_call_is_fine():
    Progress.of(None).part(0.2, 0.8, "field")(0.5)


def test_of_keeps_a_slice_and_wraps_a_callback():
    seen, callback = recorder()
    part = Progress(callback).part(0.5, 1.0)
    assert Progress.of(part) is part
    Progress.of(callback)(0.25)
    assert seen == [(0.25, "")]


def test_what_the_callback_raises_comes_through():
    def broken(*_):
        raise RuntimeError("broken")

    with pytest.raises(RuntimeError, match="broken"):
        Progress(broken)(0.5)


@given(st.integers(0, 50), st.integers(1, 20))
def test_chunks_cover_every_row_once_and_look_before_each(count, size):
    seen, callback = recorder()
    rows = np.arange(count)
    parts = [rows[part] for part in Progress(callback).part(0.5, 1.0).chunks(count, size)]
    assert np.concatenate([rows[:0], *parts]).tolist() == rows.tolist()
    assert all(len(part) <= size for part in parts)
    assert len(seen) == len(parts)
    assert all(0.5 <= fraction < 1.0 for fraction, _ in seen)


def test_chunks_can_be_cancelled():
    chunks = Progress(lambda fraction, _: fraction < 0.5).chunks(10, 3)
    with pytest.raises(Cancelled):
        list(chunks)


def test_turns_take_parts_one_after_another():
    seen, callback = recorder()
    for item, part in Progress(callback).part(0.5, 1.0).turns(("a", "b")):
        for fraction in (0.0, 0.5):
            part.part(0.0, 1.0, item)(fraction)
    assert seen == [(0.5, "a"), (0.625, "a"), (0.75, "b"), (0.875, "b")]


class TestWatched:
    def test_the_callback_hears_everything_in_the_callers_thread(self):
        heard = []

        def work(progress):
            for fraction in progress.each([0, 0, 0, 0]):
                assert fraction == 0
            return threading.get_ident()

        where = watched(work, lambda *report: heard.append((*report, threading.get_ident())))
        assert where != threading.get_ident()
        assert {ident for *_, ident in heard} == {threading.get_ident()}
        assert sorted({fraction for fraction, *_ in heard}) == [0, 0.25, 0.5, 0.75]

    @pytest.mark.parametrize("progress", [None, Progress()])
    def test_without_a_callback_there_is_no_thread(self, progress):
        assert watched(lambda _: threading.get_ident(), progress) == threading.get_ident()

    def test_a_cancel_does_not_wait_for_work_that_is_silent_and_the_work_ends_at_its_next_look(self):
        awake, looked = threading.Event(), threading.Event()

        def work(progress):
            progress(0.1)
            awake.wait(20)
            try:
                progress(0.2)
            finally:
                looked.set()
            raise AssertionError("worked on")

        answers = iter([True, True, False])
        begun = time.perf_counter()
        with pytest.raises(Cancelled):
            watched(work, lambda *_: next(answers))
        assert time.perf_counter() - begun < 10
        assert not looked.is_set()
        awake.set()
        assert looked.wait(10)

    def test_is_never_heard_to_go_back(self):
        seen = []

        def work(progress):
            for fraction in (0.4, 0.7, 0.2, 0.8):
                progress(fraction)

        watched(work, lambda fraction, _: seen.append(fraction))
        assert seen == sorted(seen)
        assert {0.4, 0.7, 0.8} == set(seen)

    def test_what_either_raises_comes_through(self):
        def broken(*_):
            raise RuntimeError("broken")

        with pytest.raises(RuntimeError, match="broken"):
            watched(broken, lambda *_: True)
        with pytest.raises(RuntimeError, match="broken"):
            watched(lambda progress: progress(0.5), broken)


def test_what_a_plain_callback_hears_never_falls():
    seen, callback = recorder()
    progress = Progress.of(callback)
    progress.part(0.5, 1.0, "late")(0.8)
    progress.part(0.0, 0.5, "early")(0.4)
    progress.part(0.5, 1.0, "late")(1.0)
    assert seen == [(0.9, "late"), (0.9, "early"), (1.0, "late")]
