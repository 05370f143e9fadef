"""Pinholes of a single layer: border loops around a place where the surface is."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..field.local_surface import LocalSurface
from .mesh import Mesh

_LONGEST = 32  # edges of a loop that may be closed


def fill_pinholes(mesh: Mesh, surface: LocalSurface, near: float) -> Mesh:
    """Close simple border loops by a fan of triangles around their middle: those of at most 32 edges that are no
    wider than the bridging length or whose middle and spokes lie within `near` of the surface. Openings stay."""
    edges, counts = mesh.edge_counts()
    border = edges[counts == 1]
    if not len(border):
        return mesh
    corner, local = np.unique(border, return_inverse=True)
    local = local.reshape(-1, 2)
    graph = coo_matrix((np.ones(len(local), bool), tuple(local.T)), shape=(len(corner),) * 2)
    count, loop = connected_components(graph, directed=False)
    length = np.bincount(loop[local[:, 0]], minlength=count)
    degree = np.bincount(local.reshape(-1), minlength=len(corner))
    simple = np.ones(count, bool)
    simple[loop[degree != 2]] = False
    size = np.bincount(loop, minlength=count)
    at = mesh.vertices[corner]
    middle = np.stack([np.bincount(loop, at[:, a], count) for a in range(3)], axis=1) / size[:, None]
    found = surface.project(middle)
    spokes = surface.project(0.5 * (at + middle[loop]))
    farthest = found.distance.copy()
    np.maximum.at(farthest, loop, spokes.distance)
    radius = np.zeros(count)
    np.maximum.at(radius, loop, np.linalg.norm(at - middle[loop], axis=1))
    narrow = 2 * radius <= surface.bridge * surface.spacing[surface.tree.query(middle, workers=-1)[1]]
    closed = simple & (length <= _LONGEST) & (narrow | (farthest <= near))

    new = len(mesh.vertices) + np.cumsum(closed) - 1
    rim = border[closed[loop[local[:, 0]]]]
    apex = new[loop[local[closed[loop[local[:, 0]]], 0]]]
    fan = np.concatenate([rim, apex[:, None]], axis=1)
    return Mesh(
        np.concatenate([mesh.vertices, middle[closed] - found.step[closed]]),
        np.concatenate([mesh.faces, fan]).astype(np.int32),
    )
