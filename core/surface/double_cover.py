"""The double cover: a closed two-sided mesh that hugs the surface from both sides."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..field.grid import Grid
from ..field.local_surface import LocalSurface
from ..progress import Progress
from .isosurface import isosurface
from .mesh import Mesh

_ROUNDS = 2
_CLAMP = 2.0  # cells beyond the offset; farther nodes do not matter and are made background
_LONGEST_STEP = 2.0  # offsets
_SAMPLE_AT = 1.5  # cells, a piece of the mesh with no sample this close to a vertex is no surface


def double_cover(values, surface: LocalSurface, grid: Grid, offset: float, progress=None) -> Mesh:
    """The iso-surface of the distance field at `offset` cells, pulled onto the zero set.

    values : (nx,ny,nz) float32 distances at the grid's nodes, units of the samples

    The idea of shrinking a double cover is DCUDF's (Hou et al., ACM TOG 42(6), 2023); here every vertex goes straight
    to its foot point on the local surface, twice, instead of descending a mesh energy. The mesh is closed and each of
    its edges has two faces, wound so that normals point away from the surface on either side; an open sheet gives one
    piece, a closed one an outer and an inner piece. Flattened against the surface, rims have thin triangles.
    """
    progress = Progress.of(progress)
    level = np.float32(offset * grid.spacing)
    clamped = np.minimum(values, np.float32(level + _CLAMP * grid.spacing))
    cells, faces = isosurface(clamped, level)
    vertices = grid.origin + grid.spacing * cells
    for turn in range(_ROUNDS):
        step = surface.project(vertices, progress.part(turn / _ROUNDS, (turn + 1) / _ROUNDS)).step
        length = np.linalg.norm(step, axis=1, keepdims=True)
        vertices = vertices - step * np.minimum(1.0, _LONGEST_STEP * level / np.maximum(length, np.finfo(float).tiny))
    mesh = Mesh(vertices, _triangles(vertices, faces).astype(np.int32))
    return _pieces_with_samples(mesh, surface.tree, _SAMPLE_AT * grid.spacing)


def _triangles(vertices, faces):
    """Split quads along the shorter diagonal, but never along an edge that the mesh has already."""
    if faces.shape[1] == 3:
        return faces
    a, b, c, d = (vertices[faces[:, k]] for k in range(4))
    other = np.einsum("fi,fi->f", b - d, b - d) < np.einsum("fi,fi->f", a - c, a - c)
    taken = _keys(faces[:, [0, 1, 2, 3]], faces[:, [1, 2, 3, 0]], len(vertices)).reshape(-1)
    diagonals = np.stack(
        [_keys(faces[:, 0], faces[:, 2], len(vertices)), _keys(faces[:, 1], faces[:, 3], len(vertices))], axis=1
    )
    clash = np.isin(diagonals, taken)
    other = np.where(clash[:, 0] != clash[:, 1], clash[:, 0], other)
    chosen = np.take_along_axis(diagonals, other[:, None].astype(int), axis=1)[:, 0]
    _, first, count = np.unique(chosen, return_index=True, return_counts=True)
    repeated = np.setdiff1d(np.flatnonzero(np.isin(chosen, chosen[first[count > 1]])), first)
    other[repeated] = ~other[repeated]
    turned = np.where(other[:, None], np.roll(faces, -1, axis=1), faces)
    return np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])


def _pieces_with_samples(mesh, tree, near):
    """The mesh without the crumbs that the field may leave between sheets."""
    touched = tree.query(mesh.vertices, distance_upper_bound=near, workers=-1)[0] < np.inf
    ends = mesh.faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    graph = coo_matrix((np.ones(len(ends), bool), tuple(ends.T)), shape=(len(mesh.vertices),) * 2)
    count, piece = connected_components(graph, directed=False)
    kept = np.bincount(piece, weights=touched, minlength=count)[piece] > 0
    row = np.cumsum(kept) - 1
    return Mesh(mesh.vertices[kept], row[mesh.faces[kept[mesh.faces[:, 0]]]].astype(np.int32))


def _keys(tail, head, n):
    return np.minimum(tail, head) * n + np.maximum(tail, head)
