"""Lines of samples that lie much closer along their line than the grid's cells, and than the next line: contours,
slices, wires, the lines of a scanner. Neighbourhoods of some samples then reach no further than the line itself, and
nothing tells how the surface goes on beside it. Fewer samples of a line show as much of it, and the next one as well.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from ..lookup import least_of_each, mask_of
from ..neighbourhoods.lines import find_lines
from ..parts import connected_parts
from ..points import SPACING_NEIGHBOURS
from ..progress import Progress
from ..trees import nearest_others

_APART = 1.0  # cells along a line, that samples are left apart at most
_ACROSS = 1 / 6  # of the way to the next line, at most; by a fourth, thin limbs in slices fall apart
_CLOSE = 0.5  # times as far apart, at most, are those of lines that are thinned
_EVENED = 2  # times that steps are averaged over those around: random samples come in clumps
_STEP = 0.5  # local spacings, from sample to sample of a line
_FEWER = 4.0  # times as many at most are thinned at a time: the next line is then found the farther away
_SOME, _ASKED = 0.02, 2048  # least share of the samples that are so close, and how many are asked
_CHUNK = 16384  # samples


def thinned_lines(points: np.ndarray, cell: float, progress=None) -> np.ndarray:
    """Which of distinct samples (n,3) float64 are left, (n,) bool, when dense lines are thinned for a grid with cells
    of a size, in the units of `points`. The ends of lines are left, and so is all that is not on one.

    Slices of a ball, 2,500 samples each and 60 times as far apart, were 13 to 20 rings; now they are a ball.
    """
    progress, rows = Progress.of(progress), np.arange(len(points))
    while len(rows) > SPACING_NEIGHBOURS and _may_be_dense(points[rows], cell):
        left = _fewer(points[rows], cell, progress)
        if left.all():
            break
        rows = rows[left]
    return mask_of(rows, len(points))


def _may_be_dense(points, cell):
    asked = points[:: max(len(points) // _ASKED, 1)]
    nearest = KDTree(points).query(asked, k=2, workers=-1)[0][:, 1]
    return (nearest < _CLOSE * _APART * cell).mean() >= _SOME


def _fewer(points, cell, progress):
    """Which samples are left, (n,) bool, up to 4 times as far apart as they were."""
    n, tree = len(points), KDTree(points)
    distance, nearest = nearest_others(tree, SPACING_NEIGHBOURS, progress.part(0.0, 0.5))
    kept, spacing = np.ones(n, bool), distance.mean(axis=1)
    lines, step = find_lines(points, spacing, nearest), _STEP * spacing
    own, apart = np.flatnonzero(lines.number >= 0), np.zeros(n)
    for part in progress.part(0.5, 1.0).chunks(len(own), _CHUNK):
        across = lines.to_others(points, own[part], tree)
        apart[own[part]] = np.minimum(_APART * cell, np.where(across > 0, _ACROSS * across, np.inf))
    for _ in range(_EVENED):
        step = step[nearest].mean(axis=1)
    own = own[step[own] < _CLOSE * apart[own]]
    if len(own) < _SOME * n:
        return kept
    stride = np.zeros(n)
    stride[own] = np.minimum(apart[own], _FEWER * step[own])
    kept[own] = False
    row, column = np.nonzero(~kept[:, None] & ~kept[nearest] & (lines.number[nearest] == lines.number[:, None]))
    kept[_one_a_stride(points, own, stride, row, nearest[row, column])] = True
    return kept


def _one_a_stride(points, own, stride, one, other):
    """The rows of samples, some of the `own` ones (m,), that lie a `stride` (n,) apart along lines whose samples links
    (e,) connect."""
    n = len(points)
    strides = np.linalg.norm(points[one] - points[other], axis=1) / np.minimum(stride[one], stride[other])
    links, part = coo_matrix((strides, (one, other)), shape=(n, n)).tocsr(), connected_parts(one, other, n)[own]
    start = own[least_of_each(part)]
    for _ in range(2):  # the sample farthest from any is at an end
        place = dijkstra(links, directed=False, indices=start, min_only=True)[own]
        start = own[least_of_each(part, -place)]
    longest = np.zeros(part.max() + 1)
    np.maximum.at(longest, part, place)
    longest = np.maximum(longest, 0.5)[part]
    place *= np.rint(longest) / longest  # the other end is at a whole number
    turn = np.full(n, -1.0)
    turn[own] = np.rint(place)
    same = turn[one] == turn[other]
    stretch = connected_parts(one[same], other[same], n)[own]
    return own[least_of_each(stretch, np.abs(place - turn[own]))]
