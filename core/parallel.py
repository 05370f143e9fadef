"""Work on independent chunks by all cores, with results in order."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext
from itertools import chain, islice
from threading import local

from .memory import starting_threads
from .progress import Progress

_AHEAD = 2  # chunks in work or waiting for it, per core
_HELD = 16  # chunks begun and not yet handed on, per core: those behind a large one go on meanwhile
_FEW = 2048  # rows, hardly worth a thread: fewer wait for the interpreter more often than they work
_MOST_CORES = 8  # more hardly gain, and each holds chunks in memory

_kept = local()  # `pool`, the threads that work for this one, where it has some


@contextmanager
def workers() -> Iterator[None]:
    """Within, all that the calling thread shares out is worked on by the same threads, which end with it. Each new one
    is waited for and has no memory at hand yet: a run that takes new ones for every loop takes some per cent longer."""
    if hasattr(_kept, "pool"):
        yield
        return
    _kept.pool = ThreadPoolExecutor(cores())
    try:
        yield
    finally:
        pool = _kept.pool
        del _kept.pool
        pool.shutdown(cancel_futures=True)


def in_order(work: Callable, chunks: Iterable) -> Iterator[tuple]:
    """Yields (chunk, work(chunk)) in the order of `chunks`, a few of which are worked on at a time.

    Threads serve, since NumPy and SciPy let go of the interpreter in their loops. What an iterator of `chunks` does
    (report progress, cancel) happens in the caller's thread; when it raises, no thread is left at work.
    """
    chunks = iter(chunks)
    ahead = list(islice(chunks, 2))
    if len(ahead) < 2:
        yield from ((chunk, work(chunk)) for chunk in ahead)
        return
    at_once, chunks, begun = cores(), chain(ahead, chunks), deque()
    with nullcontext(_kept.pool) if hasattr(_kept, "pool") else ThreadPoolExecutor(at_once) as pool:
        try:
            while True:
                busy = [result for _, result in begun if not result.done()]
                fresh = min(at_once * _AHEAD - len(busy), at_once * _HELD - len(begun))
                for chunk in islice(chunks, fresh):
                    with starting_threads():
                        begun.append((chunk, pool.submit(work, chunk)))
                if not begun:
                    return
                if begun[0][1].done():
                    chunk, result = begun.popleft()
                    yield chunk, result.result()
                else:
                    wait([result for _, result in begun if not result.done()], return_when=FIRST_COMPLETED)
        finally:
            wait([result for _, result in begun if not result.cancel()])


def work_through(work: Callable, chunks: Iterable) -> None:
    """Does `work` on all chunks as :func:`in_order` does, where it puts what it finds in place itself."""
    for _ in in_order(work, chunks):
        pass


@contextmanager
def beside(work: Callable) -> Iterator[Callable]:
    """Does `work`, a function without arguments, while the block goes on in the calling thread; gives a function that
    waits for what it returns. It should report no progress, as that would come from another thread."""
    with nullcontext(_kept.pool) if hasattr(_kept, "pool") else ThreadPoolExecutor(1) as pool:
        with starting_threads():
            begun = pool.submit(work)
        try:
            yield begun.result
        except BaseException:
            begun.cancel()
            raise
        finally:
            if not begun.cancelled():
                wait([begun])


def side_by_side(*looks: Callable) -> list:
    """What functions without arguments return, called at the same time."""
    return [found for _, found in in_order(lambda look: look(), looks)]


def even_chunks(count: int, most: int, progress: Progress) -> Iterator[slice]:
    """Slices of at most `most` rows that cover `count` in order, so many that no core waits for others at the end; with
    a report before each, see :meth:`Progress.chunks`."""
    chunks = max(cores() * -(-count // (cores() * most)), 1)
    return progress.chunks(count, min(max(-(-count // chunks), _FEW), most))


def over_rows(work: Callable, count: int, most: int) -> None:
    """Does `work` on slices of at most `most` rows that cover `count`, by all cores."""
    work_through(work, even_chunks(count, most, Progress()))


def cores() -> int:
    """How many chunks are worked on at a time."""
    return min(os.cpu_count() or 1, _MOST_CORES)
