"""Frames of depth cameras, whose depth comes in steps, moved onto the surface between the steps.

Cameras that see depth by stereo or by a pattern of light measure disparity, one over depth, in steps of one size (K.
Khoshelham and S. O. Elberink, Sensors 12(2), 2012). Far from them a wall seen askew is a flight of terraces that many
samples share, and reads as many sheets. In the space of the picture, along whose axes are pixels and steps of
disparity, all steps are of one size, planes are planes, and what is beside a sample is beside it in the picture. There
samples are moved onto quadrics, as noisy ones are in space.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from ..linalg import shortened
from ..neighbourhoods.quadrics import fit_quadrics
from ..progress import Progress

_LEVELS, _ON_EACH = 16, 16  # distinct depths, and samples at each of them on average, at least
_EVEN, _EVENER = 0.1, 0.5  # median deviation of gaps between disparities from their median, and of that for depths
_PIXELS = 0.05  # deviation of the distance to the next pixel from its median, of four samples in five, at most
_BESIDE, _AREAS = 3, 0.1  # of the four nearest pixels at a sample's own depth; share of samples with so many, at least
_NEIGHBOURS = 100, 60, 25  # samples, pass by pass
_LONGEST, _NO_FARTHER = 2.0, 2.0  # steps, that a sample moves at most; times its depth


@dataclass(frozen=True)
class Frame:
    """How a picture lies in space, seen from the origin.

    axis  : along which depth is seen, 0 to 2     sign : on which side of the origin, -1.0 or 1.0
    pixel : float, pitch of the pixels at depth 1     step : float, of disparity, one over input units
    """

    axis: int
    sign: float
    pixel: float
    step: float

    def seen(self, points: np.ndarray) -> np.ndarray:
        """Points (n,3) of space, input units, as pixels and steps of disparity, (n,3) float64."""
        depth = self.sign * points[:, self.axis]
        across = np.delete(points, self.axis, axis=1) / (self.pixel * depth[:, None])
        return np.insert(across, self.axis, 1 / (self.step * depth), axis=1)

    def in_space(self, seen: np.ndarray) -> np.ndarray:
        """The reverse of :meth:`seen`."""
        depth = 1 / (self.step * seen[:, self.axis])
        across = np.delete(seen, self.axis, axis=1) * (self.pixel * depth[:, None])
        return np.insert(across, self.axis, self.sign * depth, axis=1)


def find_frame(points: np.ndarray) -> Frame | None:
    """The frame of a depth camera at the origin whose steps of depth points (n,3), input units, lie in; None where they
    lie in none. They do where one coordinate has one sign and takes few values, and

    - gaps between one over these values are even, far more so than gaps between the values themselves, which are even
      in contours and slices;
    - seen from the origin, points are a pixel apart, and share their depth with others all around, not along lines.
    """
    for axis, depth in enumerate(points.T):
        levels = np.unique(np.abs(depth))
        if len(levels) < _LEVELS or len(points) < _ON_EACH * len(levels) or depth.min() * depth.max() <= 0:
            continue
        gaps = np.diff(1 / levels[::-1])
        if _unevenness(gaps) > min(_EVEN, _EVENER * _unevenness(np.diff(levels))):
            continue
        frame = Frame(axis, float(np.sign(depth[0])), 1.0, float(np.median(gaps)))
        picture = np.delete(frame.seen(points), axis, axis=1)
        apart, beside = KDTree(picture).query(picture, k=5, workers=-1)
        low, pixel, high = np.percentile(apart[:, 1], (10, 50, 90))
        alike = (depth[beside[:, 1:]] == depth[:, None]).sum(axis=1) >= _BESIDE
        if max(high - pixel, pixel - low) <= _PIXELS * pixel and alike.mean() >= _AREAS:
            return replace(frame, pixel=float(pixel))
    return None


def between_steps(points: np.ndarray, progress=None) -> tuple[np.ndarray, Frame | None]:
    """Points (n,3), input units, moved off the steps of depth that they lie in, and the frame of these; the very array
    given and None where they lie in none.

    No point moves by more than two steps, nor to more than twice its depth; one at the origin, where cameras put pixels
    that they see nothing in, stays.
    """
    row = np.flatnonzero(points.any(axis=1))
    frame = find_frame(points[row])
    if frame is None:
        return points, None
    progress, steps, placed = Progress.of(progress), frame.seen(points[row]), points.copy()
    moved, every = steps.copy(), np.arange(len(row))
    for k, part in progress.turns(_NEIGHBOURS):
        moved += fit_quadrics(moved, every, k, part).step
    moved = steps + shortened(moved - steps, _LONGEST)
    disparity = moved[:, frame.axis]
    np.maximum(disparity, steps[:, frame.axis] / _NO_FARTHER, out=disparity)
    placed[row] = frame.in_space(moved)
    return placed, frame


def _unevenness(gaps):
    """Median deviation of some gaps from their median, relative to it; inf where most are too small to be seen."""
    middle = np.median(gaps)
    return np.median(np.abs(gaps - middle)) / middle if middle > 0 else np.inf
