"""Work on independent chunks by all cores, with results in order."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from itertools import chain, islice

from .progress import Progress

_AHEAD = 2  # chunks in work or waiting for it, per core
_HELD = 16  # chunks begun and not yet handed on, per core: those behind a large one go on meanwhile
_FEW = 2048  # rows, hardly worth a thread: fewer wait for the interpreter more often than they work
_MOST_CORES = 8  # more hardly gain, and each holds chunks in memory


def in_order(work: Callable, chunks: Iterable) -> Iterator[tuple]:
    """Yields (chunk, work(chunk)) in the order of `chunks`, a few of which are worked on at a time.

    Threads serve, since NumPy and SciPy let go of the interpreter in their loops. What an iterator of `chunks` does
    (report progress, cancel) happens in the caller's thread; when it raises, no thread is left.
    """
    chunks = iter(chunks)
    ahead = list(islice(chunks, 2))
    if len(ahead) < 2:
        yield from ((chunk, work(chunk)) for chunk in ahead)
        return
    at_once, chunks, begun = cores(), chain(ahead, chunks), deque()
    with ThreadPoolExecutor(at_once) as pool:
        try:
            while True:
                busy = [result for _, result in begun if not result.done()]
                fresh = min(at_once * _AHEAD - len(busy), at_once * _HELD - len(begun))
                begun += [(chunk, pool.submit(work, chunk)) for chunk in islice(chunks, fresh)]
                if not begun:
                    return
                if begun[0][1].done():
                    chunk, result = begun.popleft()
                    yield chunk, result.result()
                else:
                    wait([result for _, result in begun if not result.done()], return_when=FIRST_COMPLETED)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def work_through(work: Callable, chunks: Iterable) -> None:
    """Does `work` on all chunks as :func:`in_order` does, where it puts what it finds in place itself."""
    for _ in in_order(work, chunks):
        pass


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
