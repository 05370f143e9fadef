"""Progress reports that double as the place where a run can be cancelled."""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Event, Thread
from typing import Any, NamedTuple

import numpy as np

from .errors import Cancelled
from .memory import starting_threads

ProgressCallback = Callable[[float, str], bool | None]

_SILENCE = 0.2  # seconds, after which a callback hears the last report again
_FAREWELL = 0.5  # seconds that a cancelled run is given to look up and end


class Progress:
    """A slice of a progress bar, handed down to stages and their loops.

    Calling it reports a fraction in [0, 1] *of this slice*; the user's callback receives the fraction of the whole
    run and the stage's name. A callback that returns ``False``, NumPy's too, cancels the run; ``None`` goes on.

    Example
    -------
    >>> seen = []
    >>> progress = Progress(lambda fraction, text: seen.append((fraction, text)))
    >>> progress.part(0.5, 1.0, "field")(0.5)
    >>> seen
    [(0.75, 'field')]
    """

    def __init__(self, callback: ProgressCallback | None = None, start: float = 0.0, stop: float = 1.0, text: str = ""):
        self._callback, self._start, self._stop, self._text = callback, start, stop, text

    @classmethod
    def of(cls, progress: "Progress | ProgressCallback | None") -> "Progress":
        """Accept what a public stage function accepts: a slice, a plain callback or nothing. Fractions that a plain
        callback hears never fall: where a stage is done late, whose slice of the bar lies further back, it hears the
        highest one so far until that is passed."""
        return progress if isinstance(progress, cls) else cls(progress and _rising(progress))

    def part(self, start: float, stop: float, text: str | None = None) -> "Progress":
        """The sub-slice from `start` to `stop` (fractions of this slice), under a new stage name if one is given."""
        width = self._stop - self._start
        return Progress(
            self._callback,
            self._start + start * width,
            self._start + stop * width,
            self._text if text is None else text,
        )

    def chunks(self, count: int, size: int) -> Iterator[slice]:
        """Slices of `size` that cover `count` rows in order; reports before each, so that no more than `size` rows are
        ever worked through without a look."""
        for first in range(0, count, size):
            self(first / count)
            yield slice(first, min(first + size, count))

    def pieces(self, count: int, size: int) -> Iterator[tuple[slice, "Progress"]]:
        """Slices of `size` that cover `count` rows in order, and the part of the progress that each takes."""
        for first in range(0, count, size):
            last = min(first + size, count)
            yield slice(first, last), self.part(first / count, last / count)

    def each(self, items: Sequence) -> Iterator:
        """The items in order; reports before each."""
        for number, item in enumerate(items):
            self(number / len(items))
            yield item

    def turns(self, items: Collection) -> Iterator[tuple[Any, "Progress"]]:
        """The items in order, and the part of the progress that each takes."""
        for number, item in enumerate(items):
            yield item, self.part(number / len(items), (number + 1) / len(items))

    def __call__(self, fraction: float) -> None:
        """Report; raises :class:`Cancelled` where the callback says so."""
        if self._callback is None:
            return
        answer = self._callback(self._start + fraction * (self._stop - self._start), self._text)
        if isinstance(answer, bool | np.bool_) and not answer:
            raise Cancelled(f"cancelled during '{self._text}'; nothing was written")


def _rising(callback):
    """A callback that passes reports on, of each fraction and all before the largest."""
    farthest = 0.0

    def report(fraction, text):
        nonlocal farthest
        farthest = max(farthest, fraction)
        return callback(farthest, text)

    return report


class _Outcome(NamedTuple):
    result: Any
    error: BaseException | None


def watched(work: Callable[[Progress], Any], progress: Progress | ProgressCallback | None) -> Any:
    """What `work` returns or raises; it is given a :class:`Progress` to report to.

    A callback hears of the progress in the caller's thread while the work is done in another: at every report, and
    the last one again where the work is silent for long. So a cancel is heeded at once, even while a library sorts
    millions of numbers and cannot be stopped; the work ends at its next look, and nobody hears of it again. With a
    `Progress` or nothing to report to, all is done in the caller's thread.
    """
    if progress is None or isinstance(progress, Progress):
        with starting_threads():
            return work(Progress.of(progress))
    reports, cancelled = SimpleQueue(), Event()

    def look(*report):
        reports.put(report)
        return not cancelled.is_set()

    def run():
        try:
            with starting_threads():
                reports.put(_Outcome(work(Progress(look)), None))
        except BaseException as error:  # noqa: BLE001  raised again in the caller's thread
            reports.put(_Outcome(None, error))

    thread, last, callback = Thread(target=run, daemon=True), None, _rising(progress)
    with starting_threads():
        thread.start()
    try:
        while True:
            with suppress(Empty):
                last = reports.get(timeout=_SILENCE)
            if isinstance(last, _Outcome):
                break
            if last is not None:
                Progress(callback, text=last[1])(last[0])
    finally:
        cancelled.set()
        thread.join(_FAREWELL)
    if last.error is not None:
        raise last.error
    return last.result
