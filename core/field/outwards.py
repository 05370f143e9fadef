"""Distances further out in a narrow band, carried there by the feet of the nodes close to the surface.

As in the whole box (see :mod:`.integration`) a node takes the closest of the feet that its neighbours hold. Here these
are groups of 2^3 nodes, each of which holds the feet nearest to its middle: one search for eight nodes.
"""

from functools import partial

import numpy as np

from ..parallel import work_through
from ..progress import Progress
from .blocks import Blocks
from .feet import Feet
from .grid import CORNERS
from .groups import HALF, Groups
from .local_surface import LocalSurface

_HELD = 8  # feet, by each group
_CHUNK = 1 << 13  # groups at a time
_PIECE = 1 << 15


def carried_outwards(
    values: Blocks, groups: Groups, feet: Feet, surface: LocalSurface, width: float, progress: Progress
) -> None:
    """Put into `values`, in place, the distances at the members of the groups that have none there yet, but the limit:
    `width` cells.

    Distances are those to the disc of the closest foot of those that the eight groups around the node hold, or to the
    sample nearest to the middle of its own group where that is closer. All in the units of the samples.
    """
    held, near = _held(groups, feet, surface, width, progress.part(0.0, 0.4))
    lattice, limit = groups.lattice(), np.float32(width * groups.grid.spacing)
    chunks = [near[first : first + _CHUNK] for first in range(0, len(near), _CHUNK)]
    measure = partial(_measure, values, limit, groups, feet, surface, held, lattice)
    work_through(measure, progress.part(0.4, 1.0).each(chunks))


def _held(groups, feet, surface, width, progress):
    """The feet that each group holds, (g,h) int32, and the rows, ascending, of the groups near any foot or sample."""
    count = min(_HELD, len(feet.radius))
    held, near = np.empty((len(groups), count), np.int32), []
    limit = (width + 2 * HALF) * groups.grid.spacing
    for rows in progress.chunks(len(groups), _PIECE):
        part = groups[rows]
        away = part.to_samples(surface)
        if count:
            middles = part.middles - groups.grid.origin
            to_feet, held[rows] = feet.tree.query(middles, np.arange(1, count + 1), workers=-1)
            away = np.minimum(away, to_feet[:, 0])
        near.append(rows.start + np.flatnonzero(away <= limit))
    return held, np.concatenate(near)


def _measure(values, limit, groups, feet, surface, held, lattice, rows):
    for octant in CORNERS:
        node, member = groups[rows].members(octant)
        unknown = values.at(node) == limit
        node, own = node[unknown], rows[member[unknown]]
        x = groups.grid.positions(node)
        distance = np.linalg.norm(x - surface.points[groups.sample[own]], axis=1)
        if held.shape[1]:
            x = np.ascontiguousarray((x - groups.grid.origin).T, np.float32)
            among = np.concatenate(held[_beside(lattice, own, octant)].transpose(0, 2, 1))
            distance = np.minimum(distance, feet.distance(x, feet.closest(x, among)))
        values.put(node, np.minimum(distance, limit))


def _beside(lattice, own, octant):
    """Rows of the eight groups around nodes in an octant of their `own` ones (m,), (8,m); the own one again instead of
    those that are not there."""
    around = own[None]
    for ahead, behind, upper in zip(lattice.ahead, lattice.behind, octant, strict=True):
        around = np.concatenate([around, (ahead if upper else behind)[around]])
    return np.where(around >= 0, around, own)
