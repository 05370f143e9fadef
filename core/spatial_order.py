"""An order of points in which those close in space are mostly close in memory, too.

Scans merged from several and clouds sampled at random jump about, and whatever looks at neighbours then waits for
memory.
"""

import numpy as np

_BITS = 21  # of each coordinate
_SPREAD = (  # shifts, and the bits kept after each, that leave two between those of a coordinate
    (32, 0x001F00000000FFFF),
    (16, 0x001F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)


def spatial_order(points: np.ndarray) -> np.ndarray:
    """Rows (n,) int64 of points (n,3) along a Z-order curve (G. M. Morton, IBM, 1966) through 2^21 cells on the longest
    side of their box; points in one cell, of which a stray may leave few, are in the order of their coordinates. So
    the order given matters to copies alone."""
    low = points.min(axis=0)
    side = max((points.max(axis=0) - low).max(), np.finfo(float).tiny)
    bits = ((points - low) / side * (2**_BITS - 1)).astype(np.uint64)
    for shift, kept in _SPREAD:
        bits = (bits | bits << np.uint64(shift)) & np.uint64(kept)
    x, y, z = bits.T
    cell = x << np.uint64(2) | y << np.uint64(1) | z
    order = np.argsort(cell, kind="stable")
    alike = np.diff(cell[order]) == 0
    several = np.flatnonzero(np.append(alike, False) | np.append(False, alike))
    rows = order[several]
    order[several] = rows[np.lexsort((*points[rows].T[::-1], cell[rows]))]
    return order
