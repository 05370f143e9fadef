"""Work on independent chunks by all cores, with results in order."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice

_AHEAD = 2  # chunks in work or waiting, per core


def in_order(work: Callable, chunks: Iterable) -> Iterator[tuple]:
    """Yields (chunk, work(chunk)) in the order of `chunks`, a few of which are worked on at a time.

    Threads serve, since NumPy and SciPy let go of the interpreter in their loops. What an iterator of `chunks` does
    (report progress, cancel) happens in the caller's thread; when it raises, no thread is left.
    """
    cores = os.cpu_count() or 1
    chunks = iter(chunks)
    with ThreadPoolExecutor(cores) as pool:
        try:
            waiting = [(chunk, pool.submit(work, chunk)) for chunk in islice(chunks, cores * _AHEAD)]
            while waiting:
                chunk, result = waiting.pop(0)
                yield chunk, result.result()
                waiting += [(chunk, pool.submit(work, chunk)) for chunk in islice(chunks, 1)]
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
