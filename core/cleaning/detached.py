"""Small parts of a cloud, far from the others, that are no surface of their own."""

import numpy as np
from scipy.spatial import ConvexHull, KDTree

from ..parts import connected_parts
from ..progress import Progress
from ..trees import k_nearest
from .surroundings import NEIGHBOURS, SHEET, Surroundings, thickness

_GAP = 4.0  # times the local spacing on either side, that separates parts
_OF_ALL, _OF_LARGEST = 0.02, 0.1  # of all samples, and of the largest part: larger ones are no strays
_LOOKS = 256  # samples of a part whose wider neighbourhoods are looked at
_FURTHER = 64  # samples nearest to each of a part, itself among them
_BESIDE = 3.5  # spacings of either, others of these closer than that are beside the part
_FACING = 0.06  # of its samples, at least, have such others
_ENOUGH = 16  # samples, of which fewer do not tell a shell from a cloud
_HULL = 0.95, 0.15  # so many samples this close to the convex hull, local spacings, are a shell
_CHUNK = 8192  # samples
_SCANTY = 40, 4.0  # fewer samples do not tell what a part is that is no wire and so many times as sparse as the cloud


def detached_clouds(around: Surroundings, progress: Progress) -> np.ndarray:
    """(n,) bool: which samples are in a small part of their own that shows no surface: it is neither a sheet, be it a
    noisy one, nor the shell of a convex body, or it is sparse and of too few samples to tell. Parts with others beside
    them, hardly further away than their own samples, are left in."""
    part = _parts(around)
    size = np.bincount(part)
    fewest, times = _SCANTY
    sparser = around.spacing > times * np.median(around.spacing)
    thick, sparse, sparser, wires = (
        np.bincount(part, weights=samples) > 0.5 * size
        for samples in (around.thick, around.sparse, sparser, around.wire)
    )
    scanty = (sparse & (size < _ENOUGH) | sparser & (size < fewest) & ~wires) & ~around.wireframe
    cloud = (thick | scanty) & (size < min(_OF_ALL * len(part), _OF_LARGEST * size.max()))
    if not around.wireframe:
        cloud[_beside_others(around, part, cloud, progress)] = False
    ends, by_part = np.cumsum(size), np.argsort(part, kind="stable")
    for number in np.flatnonzero(cloud & ~scanty & (size >= _ENOUGH)):
        row = by_part[ends[number] - size[number] : ends[number]]
        cloud[number] = not (_is_sheet(around.points[row]) or _is_shell(around.points[row], around.spacing[row]))
    return cloud[part]


def _parts(around):
    """The number of the part that each sample is in, (n,)."""
    n = len(around.points)
    one, other = np.repeat(np.arange(n), NEIGHBOURS), around.neighbours[:, 1:].reshape(-1)
    gap = np.linalg.norm(around.points[one] - around.points[other], axis=1)
    joined = gap < _GAP * np.minimum(around.spacing[one], around.spacing[other])
    return connected_parts(one[joined], other[joined], n)


def _beside_others(around, part, marked, progress):
    """The numbers of the parts `marked` (p,) that lie beside others, which are not, with more than a few samples: at
    the end of a thin part the eight nearest neighbours of each sample may be of that end, though others are hardly
    further. A clump that hovers over a surface has its lowest samples near it alone."""
    rows, spacing = np.flatnonzero(marked[part]), around.spacing
    found = np.zeros(len(rows), bool)
    for some in progress.chunks(len(rows), _CHUNK):
        distance, other = k_nearest(around.tree, around.points[rows[some]], _FURTHER, workers=-1)
        close = distance < _BESIDE * np.minimum(spacing[rows[some], None], spacing[other])
        found[some] = (close & ~marked[part[other]]).any(axis=1)
    facing, size = (np.bincount(part[some], minlength=len(marked)) for some in (rows[found], rows))
    return np.flatnonzero(facing >= _FACING * np.maximum(size, 1))


def _is_sheet(points):
    """Whether a part's points (m,3) are a sheet with noise: thin in some neighbourhoods wider than their noise."""
    tree, some = KDTree(points), points[:: -(-len(points) // _LOOKS)]
    k = 2 * NEIGHBOURS
    while k <= len(points):
        if np.median(thickness(points[tree.query(some, k=k)[1]])) < SHEET:
            return True
        k *= 2
    return False


def _is_shell(points, spacing):
    """Whether nearly all of a part's points (m,3) lie on its convex hull."""
    most, near = _HULL
    points = points - points.mean(axis=0)
    faces = ConvexHull(points, qhull_options="QJ").equations
    depth = -(points @ faces[:, :3].T + faces[:, 3]).max(axis=1)
    return (depth < near * spacing).mean() >= most
