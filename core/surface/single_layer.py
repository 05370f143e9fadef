"""The single layer: one sheet, open where the surface is open, non-manifold where sheets meet."""

import numpy as np

from ..field.grid import Grid
from ..field.local_surface import LocalSurface
from ..progress import Progress
from .crossings import Crossings
from .holes import fill_pinholes
from .mesh import Mesh
from .orientation import orient
from .pieces import pieces_with_samples
from .sides import Sides
from .signed import signed_mesh
from .triangles import triangles

_ROUNDS = 2


def single_layer(values, crossings: Crossings, sides: Sides, surface: LocalSurface, grid: Grid, progress=None):
    """The surface as one sheet: the boundary of the inside, where that is the whole surface; else :func:`dual_contour`.

    values : (nx,ny,nz) float32 or Blocks, unsigned distances
    Returns the mesh, wound alike wherever it can be, and the number of edges where it cannot (see :func:`orient`).
    """
    if sides.complete:
        return signed_mesh(sides.sign(values), surface, grid, progress), 0
    return orient(dual_contour(crossings, surface, grid, progress))


def dual_contour(crossings: Crossings, surface: LocalSurface, grid: Grid, progress=None) -> Mesh:
    """Dual contouring of the zero set (Ju et al., ACM TOG 21(3), 2002), by the edges its two sides are told apart on.

    Every cell that the surface passes has one vertex, the mean of its crossings taken to its foot point; every crossed
    grid edge one quad, split in two; what pinholes are left are closed. Two sheets within one cell share its vertex.
    """
    progress = Progress.of(progress)
    cell, quads = np.unique(crossings.cells_around(grid), return_inverse=True)
    quads = quads.reshape(-1, 4)
    weight = np.bincount(quads.reshape(-1), minlength=len(cell))
    place = np.repeat(crossings.place, 4, axis=0)
    vertices = np.stack([np.bincount(quads.reshape(-1), place[:, a], len(cell)) for a in range(3)], axis=1)
    vertices /= weight[:, None]
    for turn in range(_ROUNDS):
        vertices = vertices - surface.project(vertices, progress.part(0.5 * turn, 0.5 + 0.5 * turn)).step
    mesh = pieces_with_samples(Mesh(vertices, triangles(vertices, quads)), surface.tree, grid.spacing)
    return fill_pinholes(mesh, surface, grid.spacing)
