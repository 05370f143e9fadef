"""Few samples far from all the others, as the matching of photographs leaves them.

They may lie in patches, so that nothing about each of them tells a stray. But they make the box many times as large as
what was scanned, for which few cells are left.
"""

import numpy as np

_FEW = 0.02  # of all samples, at most
_TIMES = 3.0  # as far from the middle as the rest reaches: the gap between is as wide as the rest


def far_parts(points: np.ndarray) -> np.ndarray:
    """(n,) bool: which samples (n,3) are further from all the others than these are from each other, if they are 2 % of
    all at most."""
    away = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    outermost = np.sort(away)[-1 - int(_FEW * len(away)) :]
    before_gap = np.flatnonzero(outermost[1:] > _TIMES * outermost[:-1])
    if not len(before_gap):
        return np.zeros(len(points), bool)
    return away > outermost[before_gap[0]]
