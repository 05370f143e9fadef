"""The single layer of a surface with two sides: where its signed distances are zero, as far as its rims."""

import numpy as np

from ...field.blocks import Blocks
from ...field.grid import Grid
from ...field.local_surface import LocalSurface
from ...field.steps import NearBand
from ...lookup import mask_of, numbered, sums_of_each
from ...parts import connected_parts
from ...progress import Progress
from ..edges.first_steps import first_steps
from ..mesh import Mesh, in_use
from ..mesh_edges import Edges
from ..meshing.evening import evened
from ..meshing.pieces import pieces_with_samples
from ..meshing.settling import settled
from ..meshing.triangles import mesh_of
from ..signs.thin_parts import find_thin_parts
from ..signs.zero_set import zero_set

_NEAR = 1.0  # cells, distance of the node next to a vertex; farther ones are where the distances end
_COVERED = 0.4  # cells, a face whose middle is this close to the surface is on it, a farther one past its rim
_FAR = 1.0  # cells, that faces past a rim reach off the surface; those in cracks and along creases do not


def open_sheet(
    values: np.ndarray | Blocks,
    band: NearBand,
    passing: np.ndarray,
    surface: LocalSurface,
    grid: Grid,
    progress=None,
) -> Mesh:
    """The zero set of signed distances (nx,ny,nz) float32 or Blocks near the surface, which :func:`two_sided` gives, on
    its foot points and without what is past its rims: two faces at each edge or one, wound alike, with ragged borders.

    passing : (n,) bool, the samples close to lines along which sheets pass through one another, see :class:`ThinParts`
    """
    progress, cell = Progress.of(progress), grid.spacing
    thin = find_thin_parts(values, passing, surface, grid, progress.part(0.0, 0.1))
    if thin:  # past a rim distances are those to the sheet continued, which is no place to lift it
        thin = thin.away_from(grid.positions(band.node[band.past_rim]))
    vertices, faces = zero_set(values, thin, surface, grid, progress.part(0.1, 0.2), _NEAR * cell)
    vertices, faces = _trimmed(vertices, faces, band, surface, grid, progress.part(0.2, 0.4))
    vertices = evened(vertices, faces)
    step = surface.project(vertices, progress.part(0.4, 0.8)).step
    mesh = mesh_of(settled(vertices, step, surface, cell, progress.part(0.8, 1.0)), faces)
    return pieces_with_samples(mesh, surface.tree, cell)


def _trimmed(vertices, faces, band, surface, grid, progress):
    """The vertices and faces but for faces whose middle is off the surface, if they are connected to ones far off it.
    Vertices that such faces had are put in the middle of the foot points of their faces that are left."""
    step, past_rim = first_steps(vertices, band, surface, grid, progress.part(0.0, 0.5))
    limit, middle = _COVERED * grid.spacing, vertices[faces].mean(axis=1)
    row = np.flatnonzero((past_rim | (np.linalg.norm(step, axis=1) > limit))[faces].any(axis=1))
    found = surface.project(middle[row], progress.part(0.5, 1.0))
    middle[row] -= found.step
    off = found.distance > limit
    kept = np.ones(len(faces), bool)
    kept[row[off]] = ~_connected_to(found.distance[off] > _FAR * grid.spacing, faces[row[off]])
    corner, at = faces[kept].reshape(-1), np.repeat(middle[kept], faces.shape[1], axis=0)
    share = np.bincount(corner, minlength=len(vertices))
    rim = np.flatnonzero(mask_of(faces[~kept], len(vertices)) & (share > 0))
    total = sums_of_each(corner, at, len(vertices))
    vertices = vertices.copy()
    vertices[rim] = total[rim] / share[rim, None]
    return _apart(*in_use(vertices, faces[kept]))


def _apart(vertices, faces):
    """With a vertex for each of the sheets that have no more than it in common."""
    sheet = _connected(Edges(faces, len(vertices)).number).astype(np.int64)
    key, corners = numbered(faces + len(vertices) * sheet[:, None])
    return vertices[key % len(vertices)], corners


def _connected_to(marked, faces):
    """Which faces (f,k) are marked, (f,) bool, or connected to one that is, (f,) bool."""
    part = _connected(faces)
    return np.isin(part, part[marked])


def _connected(shared):
    """Number of the connected set of each face, (f,), where faces with the same number among their `shared` (f,k), of
    vertices or edges, are connected."""
    count, owner = len(shared), np.repeat(np.arange(len(shared)), shared.shape[1])
    return connected_parts(owner, count + shared.reshape(-1), count + shared.max(initial=-1) + 1)[:count]
