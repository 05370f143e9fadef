"""The two layers of a double cover laid apart, so that they do not pass through each other.

Both are pulled onto the surface, and where it bends the triangles of either are other chords of it.
"""

import numpy as np

from ...linalg import dots, lengths, unit
from ...parallel import work_through
from ...progress import Progress
from ...trees import k_nearest, quick_tree
from ..mesh import Mesh, at_corners, face_normals, turns_around
from ..meshing.centring import Bend, bend_of

HAIR = 3e-4  # cells, between the layers
_SHIFT = 0.5  # cells, by which layers are held apart in looking for faces of the other
_NEAREST = 8  # faces that are tried
_REACH = 0.75  # cells, farther sheets are others
_OPPOSITE = -0.5  # largest cosine between the normals of either layer
_SLIVER = 1e-6  # squared cells, twice the area of faces that have no direction
_CHUNK = 1 << 12  # places


def laid_apart(mesh: Mesh, cell: float, progress=None) -> Mesh:
    """The mesh, whose vertices lie on the surface, with layers that are wound away from each other laid apart.

    Vertices move outwards along their normals, by as much as the faces around them dip below the surface: so each layer
    stays on its own side of the surface, however the triangles of the other lie. Where the mesh bends within a face or
    two, at creases, rims and thin parts, that cannot be told from the normals, and most of it would be for nothing; nor
    where samples are too few for both sides to have the same foot points. So both layers move by half of what vertices,
    and where the mesh bends the middles of edges, lack to clear the other one.

    cell : length of one, in the units of the mesh
    """
    progress, bend, dip = Progress.of(progress), bend_of(mesh), np.zeros(len(mesh.vertices))
    progress(0.2)
    np.maximum.at(dip, mesh.faces.reshape(-1), np.repeat(np.maximum(bend.at_centroids(), bend.at_edges()), 3))
    return _cleared(bend.moved(mesh, dip + HAIR * cell), bend, cell, progress.part(0.4, 1.0))


def _cleared(mesh: Mesh, bend: Bend, cell: float, progress: Progress) -> Mesh:
    beside = mesh.around(bend.sharp)
    edges = np.stack([mesh.edges.low, mesh.edges.high])
    ends = np.concatenate([np.tile(np.arange(len(beside)), (2, 1)), edges[:, beside[edges].all(axis=0)]], axis=1)
    place, outward = (0.5 * (x[ends[0]] + x[ends[1]]) for x in (mesh.vertices, bend.normal))
    outward = unit(outward)
    behind, face = _other_layer(mesh, place, outward, cell, progress)
    lack = 0.5 * np.maximum(HAIR * cell - behind, 0.0)
    step = np.zeros(len(mesh.vertices))
    for corner in (*ends, *mesh.faces[face].T):
        np.maximum.at(step, corner, lack)
    return mesh.moved(mesh.vertices + step[:, None] * bend.normal)


def _other_layer(mesh, place, outward, cell, progress):
    """Along the lines through places (m,3), how far behind them the nearest face of the other layer lies, (m,) float64,
    inf where there is none within reach, and which it is, (m,)."""
    behind, which = np.full(len(place), np.inf), np.zeros(len(place), np.intp)
    if not len(place):
        return behind, which
    corners = at_corners(mesh.vertices, mesh.faces)
    normal = face_normals(*corners)
    normal /= np.maximum(lengths(normal), _SLIVER * cell**2)
    held = sum(corners) / 3 - _SHIFT * cell * normal
    progress(0.0)
    tree = quick_tree(held.T)

    def look(part):
        at, way = place[part].T, outward[part].T
        face = k_nearest(tree, (at + _SHIFT * cell * way).T, _NEAREST)[1].T
        other = normal.take(face, axis=1)
        along = dots(other, way[:, None])
        a, b, c = (corner.take(face, axis=1) - at[:, None] for corner in corners)
        turns = turns_around(a, b, c, way[:, None])
        depth = -dots(a, other) / np.minimum(along, _OPPOSITE)  # of others, it does not count
        hit = (turns.max(axis=0) <= 0) & (along < _OPPOSITE) & (np.abs(depth) < _REACH * cell)
        nearest = np.where(hit, np.abs(depth), np.inf).argmin(axis=0), np.arange(face.shape[1])
        which[part] = face[nearest]
        behind[part] = np.where(hit[nearest], depth[nearest], np.inf)

    work_through(look, progress.chunks(len(place), _CHUNK))
    return behind, which
