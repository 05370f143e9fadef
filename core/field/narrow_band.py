"""The distance field of a narrow band: evaluated near the surface alone, so that its cost grows with the surface, not
with the box.

Next to the surface the distance is the projection's, and further out that to the feet of the nodes there, both as in
the whole box (see :mod:`.integration`).
"""

import numpy as np

from ..progress import Progress
from ..records import joined
from .blocks import SIDE, Blocks, blocks_of, table_shape
from .feet import Feet, no_farther_than_feet, settled_feet
from .grid import CORNERS, Grid
from .groups import HALF, MARGIN, groups_near
from .integration import BAND
from .local_surface import LocalSurface
from .near_nodes import sample_reach
from .outwards import carried_outwards
from .projection import FROM_NODES
from .steps import NearBand

_PIECE = 1 << 17  # nodes or groups at a time


def banded_field(surface: LocalSurface, grid: Grid, width: float, progress=None) -> tuple[Blocks, NearBand, Feet]:
    """Unsigned distance at the nodes within `width` cells of the surface, float32, in the units of the samples; the
    others have the value of that width. Also the nodes in which it is known with its direction, and the feet of those
    close to the surface.

    No array of the grid's size is made but a table of its blocks.
    """
    progress = Progress.of(progress)
    groups = groups_near(surface, grid, width, progress.part(0.0, 0.1))
    node, near = _projected(surface, groups, progress.part(0.1, 0.6))
    feet = _feet(surface, grid, node, near, progress.part(0.6, 0.75))
    block = np.unique(np.ravel_multi_index(tuple((groups.corner // SIDE).T), table_shape(grid.shape)))
    values, nearer = blocks_of(grid.shape, block, np.float32(width * grid.spacing)), []
    for rows in progress.part(0.75, 0.8).chunks(len(node), _PIECE):
        found = feet.nearest(grid.positions(node[rows]) - grid.origin)
        row, step = no_farther_than_feet(near[rows], node[rows], feet, found, grid)  # a slice: the distances are these
        nearer.append((rows.start + row, step))
        values.put(node[rows], near.distance[rows])
    carried_outwards(values, groups, feet, surface, width, progress.part(0.8, 1.0))
    nearer = tuple(map(np.concatenate, zip(*nearer, strict=True))) or None
    return values.merged(), NearBand(grid.shape, node, near.step, near.past_rim, near.sample, nearer), feet


def trimmed(values: Blocks, band: float) -> Blocks:
    """Distances, signed or not, cut off at a narrower band."""
    limit = np.float32(band)
    return values.map(lambda u: np.clip(u, -limit, limit)).merged()


def _projected(surface, groups, progress):
    """The nodes within BAND of the surface, ascending, and where they fall on it. Groups whose middle is farther than
    the rest of its nodes could make up for are left out first."""
    grid, reach, found = groups.grid, sample_reach(surface), []
    for rows, turn in progress.pieces(len(groups), _PIECE):
        part = groups[rows]
        part = part[part.to_samples(surface) <= reach[part.sample] + grid.spacing * (BAND + 2 * HALF)]
        projected = surface.project(part.middles, turn.part(0, 0.2))
        part = part[projected.distance <= grid.spacing * (BAND + HALF + MARGIN)]
        node = np.sort(np.concatenate([part.members(octant)[0] for octant in CORNERS]))
        projection = surface.project(grid.positions(node), turn.part(0.2, 1), FROM_NODES)
        inside = projection.distance <= BAND * grid.spacing
        found.append((node[inside], projection[inside]))
    node = np.concatenate([node for node, _ in found])
    order = np.argsort(node)
    return node[order], joined([near for _, near in found])[order]


def _feet(surface, grid, node, near, progress):
    found = [
        settled_feet(surface, grid, node[rows], near[rows], turn)[1]
        for rows, turn in progress.pieces(len(node), _PIECE)
    ]
    return Feet(
        *(np.concatenate([getattr(feet, name) for feet in found], axis=-1) for name in ("centres", "normals", "radius"))
    )
