"""Flat pieces: parallelograms, boxes and the lines where they meet."""

from collections.abc import Sequence

import numpy as np

from .surface import Patch

_FACES = {
    "left": [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)],
    "right": [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)],
    "front": [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)],
    "back": [(0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)],
    "bottom": [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)],
    "top": [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}


def quad(corners: Sequence, steps: tuple[int, int] = (1, 1)) -> Patch:
    """The parallelogram with four corners (3,) in order round it, the third of which follows from the others."""
    a, b, _, d = np.asarray(corners, float)
    return Patch(lambda uv: a + uv @ np.stack([b - a, d - a]), steps)


def box(low: Sequence[float], high: Sequence[float], without: Sequence[str] = ()) -> list[Patch]:
    """Faces of an upright box between two corners (3,), but those named in `without`."""
    ends = np.array([low, high], float)
    return [quad([ends[k, range(3)] for k in corners]) for name, corners in _FACES.items() if name not in without]


def line(start: Sequence[float], end: Sequence[float], count: int = 200) -> np.ndarray:
    """Points (count,3) evenly on a segment."""
    return np.linspace(start, end, count)
