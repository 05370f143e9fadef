"""The nodes that may lie in the band around the surface, told from its patches without projecting anything."""

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..linalg import outer_sum
from ..parallel import work_through
from ..progress import Progress
from .grid import Grid, node_strides
from .local_surface import LocalSurface
from .rims.borders import DISC

_MARGIN = 0.1  # cells, for surfaces blended of patches that differ
_PIECE = 1 << 18  # pairs of sample and node at a time
_OFTEN = 40.0  # times that each node is asked, on average; a distance transform is quicker then
_WIDE = 0.25  # of the box, that the patch of a sample reaches


def sample_reach(surface: LocalSurface) -> np.ndarray:
    """How far the patch of each sample covers the surface, (n,), units of the samples."""
    rims = surface.rims
    return np.maximum(np.maximum(DISC * surface.spacing, rims.farthest), rims.margin.max(axis=1))


def near_nodes(surface: LocalSurface, grid: Grid, width: float, progress=None) -> np.ndarray:
    """Flat indices (b,), ascending, of the nodes that may lie within `width` cells of the surface: those as close, and
    a tenth of a cell more, to the disc of any sample, thickened by what the patch bends away from it. Where the discs
    of dense or of few samples would have every node asked many times, all nodes as close to a ball around the disc."""
    progress, reach = Progress.of(progress), sample_reach(surface) / grid.spacing
    span = np.ceil(reach + width + _MARGIN).astype(np.int64)
    times_asked = np.sum((2.0 * span + 1) ** 3) / np.prod(grid.shape)
    if times_asked > _OFTEN or span.max() > _WIDE * max(grid.shape):
        return _within_balls(surface, grid, reach + width, progress)
    at = (surface.points - grid.origin) / grid.spacing
    bend = np.linalg.norm(surface.bend, axis=(1, 2)) * grid.spacing
    patches = at, surface.normals, reach, np.minimum(0.5 * bend * reach**2, reach)
    pieces = []
    for half in np.unique(span):
        rows = np.flatnonzero(span == half)
        pieces += [(half, part) for part in np.array_split(rows, -(-len(rows) * (2 * half + 1) ** 3 // _PIECE))]
    rim = int(span.max())  # nodes, around the box, so that none needs asking whether it is inside
    found = np.zeros(np.array(grid.shape) + 2 * rim, bool)

    def mark(piece):
        half, rows = piece
        found.flat[_around(found.shape, rim, half, width + _MARGIN, *(each[rows] for each in patches))] = True

    work_through(mark, progress.each(pieces))
    return np.flatnonzero(found[rim:-rim, rim:-rim, rim:-rim])


def _within_balls(surface, grid, radius, progress):
    """Flat indices of the nodes within `radius` (n,), cells, of the nodes next to the nearest samples."""
    home = grid.nearest_nodes(surface.points)
    widest = np.zeros(grid.shape, np.float32)
    np.maximum.at(widest.reshape(-1), home, (radius + 0.5 * np.sqrt(3)).astype(np.float32))
    progress(0.0)
    away, nearest = distance_transform_edt(widest == 0, return_indices=True)
    return np.flatnonzero(away <= widest[tuple(nearest)])


def _around(shape, rim, half, width, at, normals, reach, sag):
    """Flat indices, in a box of `shape` with `rim` nodes more on every side, of the nodes within `width` cells of
    discs, of those up to `half` nodes away along each axis."""
    home, step = np.rint(at.T).astype(np.int64), np.arange(-half, half + 1)[:, None]
    offset = (home - at.T)[:, None] + step
    reach, sag = reach.astype(np.float32), sag.astype(np.float32)
    height = outer_sum((normals.T[:, None] * offset).astype(np.float32))
    lateral = outer_sum((offset**2).astype(np.float32))
    lateral -= height * height
    np.sqrt(np.maximum(lateral, 0, out=lateral), out=lateral)
    off = np.maximum(np.abs(height, out=height) - sag, 0)
    off *= off
    lateral = np.maximum(np.subtract(lateral, reach, out=lateral), 0, out=lateral)
    off += lateral * lateral
    strides = node_strides(shape)
    nodes, homes = outer_sum(step * strides[:, None, None]).reshape(-1), strides @ (home + rim)
    place, sample = np.divmod(np.flatnonzero(off <= np.float32(width**2)), len(homes))
    return nodes.take(place) + homes.take(sample)
