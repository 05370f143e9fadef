"""What the nearest neighbours of each sample look like: a plane, a wire, or neither."""

import numpy as np
from scipy.spatial import KDTree

from ..linalg import row_dots
from ..parallel import even_chunks, work_through
from ..points import SPACING_NEIGHBOURS
from ..progress import Progress

FEWEST = 100  # samples; fewer leave nothing to compare one with
NEIGHBOURS = 8
SHEET = 0.25  # thickness of a wider neighbourhood, below which a sheet may be seen in it, a noisy one, too
_SPARSE = 2.5  # spacing over the median of the cloud
_THICK = 0.2  # thickness of a neighbourhood over its size: a surface has .1, a cloud .3
_CURVE = 0.1  # second extent over the size: below it neighbours lie along a wire and have no plane
_WIREFRAME = 0.2  # share of samples along wires from which on all of them count as such
_CHUNK = 8192  # samples


class Surroundings:
    """Of samples (n,3) and their eight nearest neighbours.

    neighbours    : (n,9) int64, nearest first, the sample itself before them     tree : of the samples
    centre        : (n,3) mean of the neighbours     along, across : (n,3) unit, of their largest and least extent
    spacing       : (n,) local spacing               thickness     : (n,) least extent over the size
    lonely, off   : (n,) spacing, and distance from the neighbours' plane, over the neighbours' median spacing
    sparse, thick : (n,) bool, against the whole cloud; as no surface is
    curve         : (n,) bool, whether the neighbours lie along a wire
    wire          : (n,) bool, whether they or most of their own do, or so many in the cloud that all count as such
    wireframe     : whether so many do
    """

    def __init__(self, points: np.ndarray, progress: Progress):
        n = len(points)
        self.points = points
        self.spacing, self.thickness, off_plane, theirs = np.empty((4, n))
        self.neighbours, self.curve = np.empty((n, NEIGHBOURS + 1), np.int64), np.empty(n, bool)
        self.centre, self.along, self.across = np.empty((3, n, 3))
        self.tree = KDTree(points)

        def look(part):
            distance, self.neighbours[part] = self.tree.query(points[part], k=NEIGHBOURS + 1)
            self.spacing[part] = distance[:, 1 : SPACING_NEIGHBOURS + 1].mean(axis=1)
            group = points[self.neighbours[part, 1:]]
            centre = group.mean(axis=1)
            group = group - centre[:, None]
            squared, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", group, group))
            self.centre[part], self.along[part], self.across[part] = centre, axes[:, :, 2], axes[:, :, 0]
            extent = np.sqrt(np.maximum(squared, 0.0))
            size = np.maximum(np.linalg.norm(extent, axis=1), np.finfo(float).tiny)
            self.thickness[part] = extent[:, 0] / size
            self.curve[part] = extent[:, 1] < _CURVE * size
            off_plane[part] = np.abs(row_dots(points[part] - centre, axes[:, :, 0]))

        work_through(look, even_chunks(n, _CHUNK, progress.part(0.0, 0.9)))
        for part in progress.part(0.9, 1.0).chunks(n, _CHUNK):
            theirs[part] = np.median(self.spacing[self.neighbours[part, 1:]], axis=1)
        theirs = np.maximum(theirs, np.finfo(float).tiny)
        self.lonely, self.off = self.spacing / theirs, off_plane / theirs
        self.sparse, self.thick = self.spacing > _SPARSE * np.median(self.spacing), self.thickness > _THICK
        self.wireframe = self.curve.mean() > _WIREFRAME
        self.wire = self.curve | (self.curve[self.neighbours[:, 1:]].mean(axis=1) > 0.5) | self.wireframe


def thickness(groups: np.ndarray) -> np.ndarray:
    """Of each group of points (n,k,3) the least extent over its size, like that of neighbourhoods, (n,)."""
    groups = groups - groups.mean(axis=1, keepdims=True)
    squared = np.linalg.eigvalsh(np.einsum("nki,nkj->nij", groups, groups))
    return np.sqrt(np.maximum(squared[:, 0], 0.0) / np.maximum(squared.sum(axis=1), np.finfo(float).tiny))
