"""Consistent winding of a mesh, as far as it can be had."""

from dataclasses import replace

import numpy as np

from ...linalg import dots, symmetric, unit_columns
from ...parts import connected_parts
from ..mesh import Mesh, at_corners, face_normals
from ..signs.spreading import spread_signs, spread_strongest
from .facing import facing_one_side

_SMOOTH = 0.7  # least cosine between the normals of two faces across whose edge a surface is smooth
_LEAST = 1.01  # what makes cosines strengths


def orient(mesh: Mesh) -> tuple[Mesh, int]:
    """The mesh wound alike across every edge that has two faces, and the number of such edges where that fails.

    Faces are visited breadth-first within each patch (patches end at borders and at edges with three or more faces),
    first what is smooth and off such edges, whose parts are then turned to agree with each other. So failures of a
    patch that cannot be oriented lie along bends, or where a line of three faces has a gap; else along one line, a
    Moebius band's for instance, and around quads.
    A patch is turned so that its area-weighted normals point away from the mesh's centre; a closed one points outwards.
    Others are turned together where they can all face one side, see :func:`facing_one_side`.
    """
    n = len(mesh.faces)
    if not n:
        return mesh, 0
    pair, against = np.stack(mesh.edges.beside), ~mesh.edges.alike
    corners = at_corners(mesh.vertices - mesh.vertices.mean(axis=0), mesh.faces)
    normal = face_normals(*corners)
    sign, patch = _spread(np.where(against, -1.0, 1.0), pair, normal, _beside_lines(mesh))
    inwards = np.bincount(patch, sign * dots(normal, corners[0])) < 0
    opened = np.bincount(patch, (mesh.edges.count != 2)[mesh.edges.number].any(axis=1)) > 0
    open_patch, some = np.flatnonzero(opened), np.flatnonzero(opened[patch])
    middle = np.mean([corner[:, some] for corner in corners], axis=0)
    facing = facing_one_side(sign[some] * normal[:, some], middle, patch[some])
    if facing is not None:
        inwards[open_patch] = facing[open_patch] < 0
    turned = (sign < 0) ^ inwards[patch]
    halves = np.arange(2 * mesh.pairs).reshape(2, -1)
    whole = patch[halves[0]] == patch[halves[1]]
    turned[halves[1, whole]] = turned[halves[0, whole]]
    failures = int((against != (turned[pair[0]] ^ turned[pair[1]])).sum())
    return _with_turned(mesh, turned), failures


def _beside_lines(mesh):
    """Which faces have a vertex in common with one at an edge of three faces or more, (f,) bool."""
    at_line = (mesh.edges.count > 2)[mesh.edges.number].any(axis=1)
    return mesh.faces_at(mesh.vertices_of(at_line))


def _spread(relation, pair, normal, beside):
    """Signs of the faces, (f,), and the number of the patch of each, (f,), from the `relation` -1 or 1 (p,) of the two
    faces of a `pair` (2,p), first of smooth ones that are not `beside` lines, (f,) bool, then between the parts that
    this leaves, by the smoothest. Where all are wound alike that makes every sign 1."""
    if (relation > 0).all():
        return np.ones(normal.shape[1]), connected_parts(*pair, normal.shape[1])
    unit = unit_columns(normal)
    cosine = relation * dots(*(unit.take(face, axis=1) for face in pair))
    smooth = (cosine > _SMOOTH) & ~beside[pair].any(axis=0)
    links = symmetric(relation[smooth], *pair[:, smooth], normal.shape[1])
    links.data = np.sign(links.data)
    sign, part = spread_signs(links)
    one, other = part[pair]
    across = one != other
    agreement = (relation * sign[pair[0]] * sign[pair[1]] * (_LEAST + cosine))[across]
    whole, patch = spread_strongest(symmetric(agreement, one[across], other[across], part.max() + 1))
    return sign * whole[part], patch[part]


def _with_turned(mesh, turned):
    """The mesh with the faces marked in `turned`, (f,) bool, wound the other way; quads of which one half is are two
    triangles."""
    faces, first, second = mesh.faces, turned[: mesh.pairs], turned[mesh.pairs : 2 * mesh.pairs]
    row = np.arange(len(faces))
    row[: 2 * mesh.pairs] += np.concatenate([first & second] * 2) * np.repeat([mesh.pairs, -mesh.pairs], mesh.pairs)
    faces = np.where(turned[:, None], faces[:, [0, 2, 1]], faces)[row]
    return replace(mesh, faces=faces).with_quads(first == second)
