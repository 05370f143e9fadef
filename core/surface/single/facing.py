"""Which way the patches of an open mesh face.

What is seen from one side, as in a frame of a depth camera or a scan of terrain from the air, falls apart at every step
of depth. Its patches face that side together.
"""

import numpy as np

from ...linalg import dots, lengths, unit

_ROUNDS = 4
_ASIDE, _FACING = -0.1, 0.9  # least cosine between a face and that side, and least share of the area with it
_IN_FRONT = 0.85  # of the area as seen from there, at least, that is not behind more of it
_PIXEL = 2.0  # square roots of the median area of faces
_DECIDED, _UPRIGHT = 0.1, 0.5  # mean outward cosine, from which on it is heeded; and that of a side that is above


def facing_one_side(normal: np.ndarray, middle: np.ndarray, patch: np.ndarray) -> np.ndarray | None:
    """By which sign, -1 or 1, the normals of each patch are to be multiplied so that all face one side, (p,) float64;
    None where they cannot, or where much is behind something else as seen from there.

    normal : (3,f) float64, normals of faces, twice as long as these are large     middle : (3,f) float64, centroids
    patch  : (f,) int, from 0 to p - 1

    Of the two sides the one away from the centre is taken, or where that is undecided, as of flat ground, the upper.
    """
    area = 0.5 * lengths(normal)
    if not len(area) or not np.median(area):
        return None
    side = np.linalg.eigh(normal / np.maximum(area, np.finfo(float).tiny) @ normal.T)[1][:, 2]
    for _ in range(_ROUNDS):
        sign = np.where(np.bincount(patch, side @ normal) < 0, -1.0, 1.0)
        side = unit(normal @ sign[patch])
    towards = 0.5 * sign[patch] * (side @ normal)
    if area[towards > _ASIDE * area].sum() < _FACING * area.sum() or not _is_in_front(middle, area, towards, side):
        return None
    away = middle - (middle @ area / area.sum())[:, None]
    outwards = 0.5 * sign[patch] @ dots(away, normal) / max(lengths(away) @ area, np.finfo(float).tiny)
    facing = outwards if abs(outwards) >= _DECIDED or abs(side[2]) < _UPRIGHT else side[2]
    return -sign if facing < 0 else sign


def _is_in_front(middle, area, towards, side):
    """Whether little of the faces is behind others, as seen from a `side`, (3,), by the pixels that they fill."""
    across = np.linalg.svd(side[None])[2][1:]
    pixel = _PIXEL * np.sqrt(np.median(area))
    column, row = np.floor(across @ middle / pixel)
    filled = len(np.unique((row - row.min()) * (np.ptp(column) + 1) + column - column.min()))
    return filled * pixel**2 >= _IN_FRONT * np.abs(towards).sum()
