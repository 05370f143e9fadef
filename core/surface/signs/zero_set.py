"""Where signed distances are zero, as vertices and faces."""

import numpy as np

from ...field.blocks import Blocks, at_nodes, each
from ...field.grid import Grid
from ...field.local_surface import LocalSurface
from ...progress import Progress
from ..mesh import in_use
from ..meshing.isosurface import isosurface
from .thin_parts import ThinParts


def zero_set(
    values: np.ndarray | Blocks,
    thin: ThinParts | None,
    surface: LocalSurface,
    grid: Grid,
    progress: Progress,
    within: float = np.inf,
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v,3) and quads or triangles (f,4) or (f,3) of the zero set of signed distances (nx,ny,nz) float32 or
    Blocks: at thin parts, which the signs of nodes do not show, they start off the surface and are pulled in, as those
    of a double cover. Only where the nodes nearest to the vertices are `within` that distance: where distances end,
    there is no surface."""
    if thin:
        values = each(np.copy, values)
        thin.lower(values, grid)
    cells, faces = isosurface(values, 0.0)
    vertices = grid.origin + grid.spacing * cells
    if np.isfinite(within):
        near = np.abs(at_nodes(values, grid.nearest_nodes(vertices))) <= within
        vertices, faces = in_use(vertices, faces[near[faces].all(axis=1)])
    if thin:
        lifted = np.flatnonzero(thin.lift(vertices))
        vertices[lifted] -= surface.project(vertices[lifted], progress).step
    return vertices, faces
