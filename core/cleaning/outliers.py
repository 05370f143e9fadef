"""Stray samples: scattered through space, hovering beside a surface, or in detached clouds.

A sample is never judged by its density alone, which would eat wires, rims and sparsely scanned parts: it must also
stand off the plane of its neighbours, or lie among samples that form no surface, or off all wires.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, KDTree

from ..given_arrays import finite_points
from ..linalg import row_dots
from ..parallel import even_chunks, work_through
from ..points import SPACING_NEIGHBOURS
from ..progress import Progress
from .quadrics import fit_quadrics

MINIMUM_SAMPLES = 100  # fewer leave nothing to compare a sample with

_NEIGHBOURS = 8
_ROUNDS = 4  # strays hide strays
_SPARSE = 2.5  # spacing over the median of the cloud: candidates for scattered strays
_LONELY = 2.0  # spacing over that of the neighbours
_ALONE = 5.0  # so lonely that the plane no longer matters
_OFF = 2.0  # distance from the neighbours' plane over their spacing
_THICK = 0.2  # thickness of a neighbourhood over its size: a surface has .1, a cloud .3
_CHUNK = 8192  # samples
_CURVE = 0.1  # second extent over the first: below it neighbours lie along a wire and have no plane
_WIREFRAME = 0.2  # share of samples along wires from which on all of them count as such
_ASTRAY, _FEW = 0.01, 5  # share and number of samples off all wires above which they are strays: ends of wires are, too
_AT_ITS_HEIGHT = 24, 6, 0.15  # neighbours; so many of them this close to its height, over their spacing, are a sheet
_PROUD = 1.2, 0.9, 8.0  # spacing over that of the neighbours; off their plane, over their spacing, and as they are
_MANY_PROUD = 0.00125  # share of such samples above which they are strays: corners have some
_PEERS, _AS_SPARSE, _IN_LINE = 6, 0.5, 3  # nearest samples with this share of a sample's spacing; so many make a line
_STRAIGHT = 0.98  # least cosine to the direction of a line
_COMPANY = 40  # sparse samples that vote whether they are strays
_MAJORITY = 0.6
_DETACHED = 4.0  # a gap this many times the local spacing on either side separates parts
_SMALL_PART, _OF_LARGEST = 0.02, 0.1  # of all samples, and of the largest part
_LOOKS, _SLIGHT = 256, 0.25  # samples of a part whose wider neighbourhoods are looked at; a sheet is thinner in some
_SCANTY = 40, 4.0  # samples that are too few to tell a part by, no wire, where so many times as sparse as the cloud
_SHELL = 16, 0.85, 0.15  # least number of samples; so many of them this close to the convex hull, spacings, are a shell
_DENSER = 0.75  # spacing over the median of the cloud, below which a thick part of fewer samples is a cloud

_DIRTY, _NONE = 0.0005, 1  # share and number of strays above which those close to the surface are looked for as well
_STRICT = 0.7  # share of the limits above that then holds for those beside a surface
_FITTED = 20  # neighbours of the quadrics that those are measured against
_HOVERING = 6.0  # distance from the quadric over the largest of the medians around each neighbour
_HOVERING_FAR = 0.3  # and over the local spacing; of the neighbours' plane, too


def find_outliers(points, progress=None) -> np.ndarray:
    """(n,) bool: which samples (n,3), float64 and finite, are strays.

    - beside a surface: lonelier than its neighbours and off their plane, or far lonelier;
    - proud, where there are more than a few such: a little lonely and off the neighbours' plane where none of them is;
    - scattered: sparse against the whole cloud, where most sparse samples around form no surface, nor all of them one;
    - among wires, where there are more than a few such: lonely, on no line of a wire nearby nor in line with samples
      as sparse, which may be a wire sampled less;
    - detached: in a small part of its own that is a cloud rather than a sheet, be it a noisy one, or the shell of a
      convex body; of too few samples to tell, if it is denser than the cloud or sparse;
    - hovering, in a cloud with some strays of the other kinds: far off its neighbours' quadric where they are not.

    A sample with others around at its own height is neither proud nor hovering: it is in a sheet close beside another.
    """
    progress = Progress.of(progress)
    stray = np.zeros(len(points), bool)
    if len(points) < MINIMUM_SAMPLES:
        return stray
    for turn in range(_ROUNDS):
        part = progress.part(turn / _ROUNDS, (turn + 1) / _ROUNDS)
        kept = np.flatnonzero(~stray)
        around = _Surroundings(points[kept], part.part(0.0, 0.6))
        dirty = stray.sum() > max(_DIRTY * len(points), _NONE)
        found = around.beside(_STRICT if dirty else 1.0) | around.scattered(part.part(0.6, 0.7))
        part(0.7)
        found |= around.detached()
        off_wires = around.off_wires()
        if dirty or _many(off_wires, _ASTRAY):
            found |= off_wires
        proud = around.proud()
        if _many(proud, _MANY_PROUD):
            found |= proud
        if dirty:
            found |= around.hovering(part.part(0.8, 1.0))
        stray[kept[found]] = True
        if not found.any() or (~stray).sum() < MINIMUM_SAMPLES:
            break
    return stray


def remove_outliers(points, progress=None) -> tuple[np.ndarray, np.ndarray]:
    """The samples (n',3) of (n,3) that are no strays, and their rows (n',) int64, see :func:`find_outliers`.

    Raises :class:`InputError` for points that are not finite.
    """
    points = finite_points(points)
    kept = np.flatnonzero(~find_outliers(points, progress))
    return points[kept], kept


def _many(found, share):
    return found.sum() > max(share * len(found), _FEW)


class _Surroundings:
    """What the nearest neighbours of each sample look like."""

    def __init__(self, points, progress):
        n = len(points)
        self.points = points
        self.spacing, self.thickness, off_plane, theirs = np.empty((4, n))
        self.neighbours, curve = np.empty((n, _NEIGHBOURS + 1), np.int64), np.empty(n, bool)
        self.centre, self.along, self.across = np.empty((3, n, 3))
        self.tree = tree = KDTree(points)

        def look(part):
            distance, self.neighbours[part] = tree.query(points[part], k=_NEIGHBOURS + 1)
            self.spacing[part] = distance[:, 1 : SPACING_NEIGHBOURS + 1].mean(axis=1)
            group = points[self.neighbours[part, 1:]]
            centre = group.mean(axis=1)
            group = group - centre[:, None]
            squared, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", group, group))
            self.centre[part], self.along[part], self.across[part] = centre, axes[:, :, 2], axes[:, :, 0]
            extent = np.sqrt(np.maximum(squared, 0.0))
            size = np.maximum(np.linalg.norm(extent, axis=1), np.finfo(float).tiny)
            self.thickness[part] = extent[:, 0] / size
            curve[part] = extent[:, 1] < _CURVE * size
            off_plane[part] = np.abs(row_dots(points[part] - centre, axes[:, :, 0]))

        work_through(look, even_chunks(n, _CHUNK, progress.part(0.0, 0.9)))
        for part in progress.part(0.9, 1.0).chunks(n, _CHUNK):
            theirs[part] = np.median(self.spacing[self.neighbours[part, 1:]], axis=1)
        theirs = np.maximum(theirs, np.finfo(float).tiny)
        self.sparse = self.spacing > _SPARSE * np.median(self.spacing)
        self.curve = curve
        self.wireframe = curve.mean() > _WIREFRAME
        self.wire = curve | (curve[self.neighbours[:, 1:]].mean(axis=1) > 0.5) | self.wireframe
        self.lonely = self.spacing / theirs
        self.off = off_plane / theirs

    def beside(self, share):
        off_plane = (self.lonely > share * _LONELY) & (self.off > share * _OFF)
        return (off_plane | (self.lonely > share * _ALONE)) & ~self.wire

    def proud(self):
        lonely, off, over_theirs = _PROUD
        found = (self.lonely > lonely) & (self.off > off) & ~self.wire
        return self._stands_out(found, self.off, over_theirs)

    def _stands_out(self, found, height, times):
        """Which of the samples `found` have so many times the largest of the median heights around each neighbour, and
        are in no sheet of their own."""
        row = np.flatnonzero(found)
        theirs = np.median(height[self.neighbours[self.neighbours[row]]], axis=2).max(axis=1)
        found[row] = (height[row] > times * theirs) & ~self._in_sheet(row)
        return found

    def _in_sheet(self, row):
        """Which of samples `row` (m,) lie in a sheet of their own close beside another one: samples around are at their
        height above the flattest neighbourhood near them."""
        count, fewest, off = _AT_ITS_HEIGHT
        near = self.neighbours[row, 1:]
        flattest = near[np.arange(len(row)), self.thickness[near].argmin(axis=1)]
        around = self.tree.query(self.points[row], k=range(2, min(count, len(self.points)) + 1))[1]
        height = np.einsum("mki,mi->mk", self.points[around] - self.points[row, None], self.across[flattest])
        return (np.abs(height) < off * self.spacing[flattest, None]).sum(axis=1) >= fewest

    def scattered(self, progress):
        found = np.zeros(len(self.points), bool)
        sparse = np.flatnonzero(self.sparse)
        if not len(sparse):
            return found
        astray = (self.thickness > _THICK) | ((self.off > _OFF) & ~self.wire)
        k = min(_COMPANY, len(sparse))
        tree = KDTree(self.points[sparse])
        for part in progress.chunks(len(sparse), _CHUNK):
            around = tree.query(self.points[sparse[part]], k=k, workers=-1)[1].reshape(-1, k)
            astray_there = astray[sparse[around]].mean(axis=1) > _MAJORITY
            found[sparse[part]] = astray_there & (_thickness(self.points[sparse[around]]) > _SLIGHT)
        return found

    def off_wires(self):
        found = np.zeros(len(self.points), bool)
        row = np.flatnonzero(self.wire & (self.lonely > _LONELY))
        near = self.neighbours[row, 1:]
        cosine = _cosines(self.points[row, None] - self.centre[near], self.along[near])
        row = row[~((cosine > _STRAIGHT) & self.curve[near]).any(axis=1)]
        half_octave = np.floor(2 * np.log2(self.spacing[row])) / 2
        for power in np.unique(half_octave):
            own = row[half_octave == power]
            peers = self.points[self.spacing >= _AS_SPARSE * 2.0**power]
            nearest = KDTree(peers).query(self.points[own], k=min(_PEERS + 1, len(peers)), workers=-1)[1]
            step = peers[nearest.reshape(len(own), -1)[:, 1:]] - self.points[own, None]
            lined = (_cosines(step[:, :, None], step[:, None]) > _STRAIGHT).sum(axis=2) >= _IN_LINE
            found[own] = ~lined.any(axis=1)
        return found

    def hovering(self, progress):
        height = fit_quadrics(self.points, np.arange(len(self.points)), _FITTED, progress).left_out()
        far = (height > _HOVERING_FAR * self.spacing) & (self.off > _HOVERING_FAR)
        return self._stands_out(far & ~self.wire, height, _HOVERING)

    def detached(self):
        rows = np.repeat(np.arange(len(self.points)), _NEIGHBOURS)
        columns = self.neighbours[:, 1:].reshape(-1)
        gap = np.linalg.norm(self.points[rows] - self.points[columns], axis=1)
        joined = gap < _DETACHED * np.minimum(self.spacing[rows], self.spacing[columns])
        links = coo_matrix((joined[joined], (rows[joined], columns[joined])), shape=(len(self.points),) * 2)
        count, part = connected_components(links, directed=False)
        size = np.bincount(part, minlength=count)
        fewest, times = _SCANTY
        relative = self.spacing / np.median(self.spacing)
        thick, denser, sparse, sparser, wires = (
            np.bincount(part, weights=samples, minlength=count) > 0.5 * size
            for samples in (self.thickness > _THICK, relative < _DENSER, self.sparse, relative > times, self.wire)
        )
        scanty = (sparse & (size < _SHELL[0]) | sparser & (size < fewest) & ~wires) & ~self.wireframe
        small = size < min(_SMALL_PART * len(self.points), _OF_LARGEST * size.max())
        clouds = (thick & (denser | (size >= _SHELL[0])) | scanty) & small
        ends = np.cumsum(size)
        by_part = np.argsort(part, kind="stable")
        for number in np.flatnonzero(clouds & ~scanty & (size >= _SHELL[0])):
            row = by_part[ends[number] - size[number] : ends[number]]
            sheet = _is_sheet(self.points[row]) or _is_shell(self.points[row], self.spacing[row])
            clouds[number] = not sheet
        return clouds[part]


def _is_sheet(points):
    """Whether a part's points (m,3) are a sheet with noise: thin in some neighbourhoods wider than their noise."""
    tree, some = KDTree(points), points[:: -(-len(points) // _LOOKS)]
    k = 2 * _NEIGHBOURS
    while k <= len(points):
        if np.median(_thickness(points[tree.query(some, k=k)[1]])) < _SLIGHT:
            return True
        k *= 2
    return False


def _thickness(groups):
    """Of each group of points (n,k,3) the least extent over its size, like that of neighbourhoods."""
    groups = groups - groups.mean(axis=1, keepdims=True)
    squared = np.linalg.eigvalsh(np.einsum("nki,nkj->nij", groups, groups))
    return np.sqrt(np.maximum(squared[:, 0], 0.0) / np.maximum(squared.sum(axis=1), np.finfo(float).tiny))


def _is_shell(points, spacing):
    """Whether nearly all of a part's points (m,3) lie on its convex hull."""
    _, most, near = _SHELL
    points = points - points.mean(axis=0)
    faces = ConvexHull(points, qhull_options="QJ").equations
    depth = -(points @ faces[:, :3].T + faces[:, 3]).max(axis=1)
    return (depth < near * spacing).mean() >= most


def _cosines(a, b):
    """Of the angles between lines along the vectors (...,3) of either; 0 for vectors without a length."""
    squares = row_dots(a, a) * row_dots(b, b)
    product = np.abs(row_dots(a, b))
    return product / np.sqrt(np.maximum(squares, np.finfo(float).tiny))
