"""Points that are there twice but for rounding: copies of a scan in another precision, overlapping tiles, corners of
unwelded triangles.

Bisectors of two such points tell nothing of the surface, and neighbourhoods that are full of them reach no further than
the next few places. In a random cloud the points with another within a share q of the spacing grow as q^2, or as q
along lines, so within q there are few of those within 4 q; of copies there are nearly all. So it is with small parts
far apart, too, whose points have most of their 16 nearest in others; but those parts are more than the few copies that
there are of a point which was not given in much the same place.
"""

import numpy as np
from scipy.spatial import KDTree

from .lookup import mask_of
from .parts import connected_parts
from .progress import Progress

_CLOSE = 0.01, 0.05, 0.1  # local spacings, within which most copies may lie
_MANY, _COPIES = 0.01, 7  # the same, within which there may be many of a point; in the median, at most, beyond
_WIDER, _MOST = 4.0, 0.7  # of the points with another within 4 times as far, the least share that has one within it
_LEAST, _FEWEST = 0.01, 8  # and if this share of all points has, and so many; of random ones .008 within a twentieth
_MERGED = 2.0  # times as far, the other copies may lie
_NEIGHBOURS = 16
_TRIED = 4096  # points that are looked at first
_MIXED = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)  # odd
_CHUNK = 16384  # points


def find_near_duplicates(points: np.ndarray, progress=None) -> np.ndarray:
    """(n,) bool: which of distinct points (n,3) float64 are copies of earlier ones, at most a fifth of the local
    spacing away, or of copies of such; none where close points are no more than chance leaves.

    The local spacing here is the side of the square that each of a point's 16 nearest has to itself.
    """
    progress, kept = Progress.of(progress), np.arange(len(points))
    while len(kept) > _NEIGHBOURS:
        tree = KDTree(points[kept])
        close = _closeness(tree)
        if close is None:
            break
        places = _first_of_clusters(tree, _MERGED * close, progress)
        if len(places) <= _NEIGHBOURS:  # so few that the spacing was that between their copies
            break
        kept = kept[places]
    return ~mask_of(kept, len(points))


def _closeness(tree):
    """Local spacings within which most copies lie, None where there are none."""
    tried = _some(tree.data)
    distance, _, spacing = _neighbours(tree, tried)
    distance = distance / spacing[:, None]
    for close in _CLOSE:
        paired, around = distance[:, 1] < close, distance < _WIDER * close
        if paired.sum() < max(_FEWEST, _LEAST * len(tried), _MOST * around[:, 1].sum()):
            continue
        if close <= _MANY or np.median(around[paired].sum(axis=1)) <= _COPIES:
            return close
    return None


def _some(points):
    """Rows of at most 4096 points, the same ones in whatever order they come: by a multiplicative hash of their bits
    (D. E. Knuth, The Art of Computer Programming 3, 6.4)."""
    if len(points) <= _TRIED:
        return np.arange(len(points))
    return np.argpartition(np.ascontiguousarray(points).view(np.uint64) @ _MIXED, _TRIED)[:_TRIED]


def _first_of_clusters(tree, reach, progress):
    """The first rows, (m,) ascending, of the points that pairs closer than `reach` local spacings connect."""
    ends = []
    for part in progress.chunks(tree.n, _CHUNK):
        rows = np.arange(part.start, part.stop)
        distance, other, spacing = _neighbours(tree, rows)
        row, column = np.nonzero(distance < reach * spacing[:, None])
        ends.append((rows[row], other[row, column]))
    part = connected_parts(*(np.concatenate(each) for each in zip(*ends, strict=True)), tree.n)
    return np.sort(np.unique(part, return_index=True)[1])


def _neighbours(tree, rows):
    """Distances to a point itself and its 16 nearest, (m,17), which they are, and the local spacing, (m,)."""
    distance, other = tree.query(tree.data[rows], k=_NEIGHBOURS + 1, workers=-1)
    return distance, other, distance[:, -1] * np.sqrt(np.pi / _NEIGHBOURS)
