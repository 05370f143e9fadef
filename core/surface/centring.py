"""Faces put astride a curved surface, rather than all on one side of it.

Where vertices lie on the surface, faces are chords: all of them inside of a ball, for instance.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from ..parallel import in_order
from .evening import FLAT, vertex_normals
from .mesh import Mesh, at_corners


def centred(mesh: Mesh) -> Mesh:
    """The mesh, whose vertices lie on the surface, with each moved along its normal by half of what the faces around it
    are off at their centroids.

    This is where the squared distances at vertices and at centroids together are least, which DCUDF descends to (Hou et
    al., ACM TOG 42(6), 2023). How far a centroid is off is told by how the normals n of its corners x turn, without
    looking at the surface: for a quadratic one by sum (x_j - x_i).(n_j - n_i) / 18 over the face's edges.

    Vertices at borders stay, and so do those at edges of more than two faces or of two that are wound unlike, and where
    the mesh bends within a face or two, at creases for instance; faces there count as flat.
    """
    vertices, faces = mesh.vertices, mesh.faces
    looks = partial(vertex_normals, vertices, faces), mesh.edge_counts, mesh.face_areas
    (normal, least), (edges, counts), area = (found for _, found in in_order(lambda look: look(), looks))
    free = least >= FLAT
    free[edges[counts != 2]] = False
    place, turned = at_corners(vertices, faces), at_corners(normal, faces)
    off = sum(np.einsum("if,if->f", place[k] - place[k - 1], turned[k] - turned[k - 1]) for k in range(3)) / 18
    off[(least < FLAT)[faces].any(axis=1)] = 0.0
    share, total = (np.bincount(faces.reshape(-1), np.repeat(x, 3), len(vertices)) for x in (area * off, area))
    step = np.where(free, 0.5 * share / np.maximum(total, np.finfo(float).tiny), 0.0)
    return replace(mesh, vertices=vertices + step[:, None] * normal)
