"""Consistent winding of a mesh, as far as it can be had."""

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix

from ...linalg import cross, dots
from ..mesh import Mesh, at_corners, edge_numbers, faces_across
from ..signs.spreading import spread_signs


def orient(mesh: Mesh) -> tuple[Mesh, int]:
    """The mesh wound alike across every edge that has two faces, and the number of such edges where that fails.

    Faces are visited breadth-first within each patch (patches end at borders and at edges with three or more faces),
    so failures lie along one line of a patch that cannot be oriented, a Moebius band's for instance, and around quads.
    A patch is turned so that its area-weighted normals point away from the mesh's centre; a closed one points outwards.
    """
    n = len(mesh.faces)
    if not n:
        return mesh, 0
    edge, count = edge_numbers(mesh.faces, len(mesh.vertices))
    pair, forward = faces_across(edge, count), mesh.faces < np.roll(mesh.faces, -1, axis=1)
    against = np.bincount(edge.reshape(-1), forward.reshape(-1))[count == 2] != 1

    links = coo_matrix((np.where(against, 2, 1), pair), shape=(n, n)).tocsr()
    links = links.maximum(links.T)
    links.data = np.where(links.data == 2, -1, 1)
    sign, patch = spread_signs(links)
    turned = sign < 0

    a, b, c = at_corners(mesh.vertices - mesh.vertices.mean(axis=0), mesh.faces)
    outwards = dots(cross(b - a, c - a), a)
    inwards = np.bincount(patch, np.where(turned, -outwards, outwards)) < 0
    turned ^= inwards[patch]
    halves = np.arange(2 * mesh.pairs).reshape(2, -1)
    whole = patch[halves[0]] == patch[halves[1]]
    turned[halves[1, whole]] = turned[halves[0, whole]]
    failures = int((against != (turned[pair[0]] ^ turned[pair[1]])).sum())
    return _with_turned(mesh, turned), failures


def _with_turned(mesh, turned):
    """The mesh with the faces marked in `turned`, (f,) bool, wound the other way; quads of which one half is are two
    triangles."""
    faces, first, second = mesh.faces, turned[: mesh.pairs], turned[mesh.pairs : 2 * mesh.pairs]
    row = np.arange(len(faces))
    row[: 2 * mesh.pairs] += np.concatenate([first & second] * 2) * np.repeat([mesh.pairs, -mesh.pairs], mesh.pairs)
    faces = np.where(turned[:, None], faces[:, [0, 2, 1]], faces)[row]
    return replace(mesh, faces=faces).of_faces(np.ones(len(faces), bool), first == second)
