"""From the local surface to distances in the whole box.

Near the surface the blended projection distance is accurate and is kept, but where a foot point is closer: between
patches that do not quite meet. Further out the paper solves a Poisson equation, see :mod:`poisson`. By default the
distance is carried from the foot points of the near nodes instead, which errs less, most of all at the medial axis, and
needs no linear solve, see :mod:`transport`.
"""

import numpy as np

from ..progress import Progress
from ..records import joined
from ..settings import Settings
from .feet import no_farther_than_feet, settled_feet
from .grid import Grid
from .local_surface import LocalSurface
from .near_nodes import near_nodes
from .poisson import poisson
from .projection import FROM_NODES
from .steps import NearBand
from .transport import transport

BAND = 2.0  # cells, where the projection distance itself is kept
_PIECE = 1 << 21  # nodes projected at a time: where few points reach over large parts of the box most are outside


def distance_field(
    surface: LocalSurface, grid: Grid, integration: str = "transport", diffusion: str = "kernel", progress=None
) -> tuple[np.ndarray, NearBand]:
    """Unsigned distance at every node of the grid, float32 of its shape, in the units of the samples, and the band
    in which it is known with its direction. Outside the band by `integration`: "transport" or "poisson", the latter
    with directions by `diffusion`: "kernel" or "grid". Raises :class:`SettingsError` for other words, and
    :class:`InputError` for a grid that does not hold the surface."""
    Settings(integration=integration, diffusion=diffusion)
    grid.check(surface.points)
    progress = Progress.of(progress)
    node, near = _projected(surface, grid, progress.part(0.0, 0.6))
    nearer = None
    if integration == "poisson":
        known = np.full(grid.shape, np.nan)
        known.flat[node] = near.distance
        values = poisson(surface, grid, known, diffusion, progress.part(0.6, 1.0))
        values.flat[node] = near.distance
    else:
        held, feet = settled_feet(surface, grid, node, near, progress.part(0.6, 0.8))
        values, number = transport(grid, held, feet, progress.part(0.8, 1.0))
        found = values.flat[node], number.flat[node]
        nearer = no_farther_than_feet(near, node, feet, found, grid)
        values.flat[node] = near.distance
    return values, NearBand(grid.shape, node, near.step, near.past_rim, near.sample, nearer)


def near_band(surface: LocalSurface, grid: Grid, progress=None) -> NearBand:
    """The band of :func:`distance_field` alone: the nodes within two cells of the surface."""
    node, near = _projected(surface, grid, Progress.of(progress))
    return NearBand(grid.shape, node, near.step, near.past_rim, near.sample)


def _projected(surface, grid, progress):
    """Flat indices of the nodes within the band, and where they fall on the surface."""
    node, found = near_nodes(surface, grid, BAND, progress.part(0.0, 0.1)), []
    for rows, part in progress.part(0.1, 1.0).pieces(len(node), _PIECE):
        near = surface.project(grid.positions(node[rows]), part, FROM_NODES)
        inside = near.distance <= BAND * grid.spacing
        found.append((node[rows][inside], near[inside]))
    return np.concatenate([node for node, _ in found]), joined([near for _, near in found])
