"""Progress reports that double as the place where a run can be cancelled."""

from collections.abc import Callable, Iterator, Sequence

from .errors import Cancelled

ProgressCallback = Callable[[float, str], bool | None]


class Progress:
    """A slice of a progress bar, handed down to stages and their loops.

    Calling it reports a fraction in [0, 1] *of this slice*; the user's callback receives the fraction of the whole
    run and the stage's name. A callback that returns ``False`` (exactly; ``None`` goes on) cancels the run.

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
        """Accept what a public stage function accepts: a slice, a plain callback or nothing."""
        return progress if isinstance(progress, cls) else cls(progress)

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

    def each(self, items: Sequence) -> Iterator:
        """The items in order; reports before each."""
        for number, item in enumerate(items):
            self(number / len(items))
            yield item

    def __call__(self, fraction: float) -> None:
        """Report; raises :class:`Cancelled` where the callback says so."""
        if self._callback is None:
            return
        if self._callback(self._start + fraction * (self._stop - self._start), self._text) is False:
            raise Cancelled(f"cancelled during '{self._text}'; nothing was written")
