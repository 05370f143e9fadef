"""The double cover of a sheet: both its sides, joined at its borders and around the edges where sheets meet."""

from dataclasses import dataclass, replace
from numbers import Real

import numpy as np

from ...errors import SettingsError
from ...linalg import lengths
from ..mesh import Mesh, at_corners, face_normals
from ..mesh_edges import corner_after
from .around_edges import order_around
from .layers import HAIR


def both_sides(sheet: Mesh, cell: float) -> Mesh:
    """A closed mesh with a layer on either side of a sheet, wound so that normals point away from it: an outer and an
    inner piece for a closed one with two sides, a single piece for an open one, whose layers meet in its border
    vertices, and for a one-sided one; where sheets meet, a piece for each region that they part.

    sheet : any, wound alike or not     cell : length of one, in the units of the mesh

    The layers are a hair apart, 3e-4 cells. Around an edge, those sides of its faces are joined that face each other.
    Where two pairs of them have the same vertices at both its ends, as where these are on a border, they are joined in
    two halves, and where parts of the sheet touch in a vertex each gets its own, so that every edge of the result has
    two faces and those around a vertex form one fan.

    Raises :class:`SettingsError` for a cell that is not above 0 and finite.
    """
    if not isinstance(cell, Real) or not 0 < cell < np.inf:
        raise SettingsError(f"cell is {cell!r}; it must be a length above 0, as a grid's spacing is")
    if not len(sheet.faces):
        return sheet
    sheet = _turned(sheet)
    sides = _sides(sheet)
    whole = sides.whole_quads(sheet.pairs)
    if not whole.all():
        sheet = sheet.with_quads(whole)
        sides = _sides(sheet)
    place = np.empty(sides.vertex.max(initial=-1) + 1, sheet.faces.dtype)
    place[sides.vertex] = sheet.faces
    vertices = np.concatenate([sheet.vertices[place], sheet.vertices[sides.halved].mean(axis=0)])
    faces = face_normals(*at_corners(sheet.vertices, sheet.faces))
    normal = np.stack([_totals(x, sides, len(vertices)) for x in faces])
    size = lengths(normal)
    normal *= 0.5 * HAIR * cell / np.where(size > 0, size, 1.0)  # at borders both sides cancel
    return _joined(vertices + normal.T, sides, sheet.pairs)


@dataclass(frozen=True)
class _Sides:
    """How the sides of a sheet's faces are joined, the fronts before the backs.

    vertex : (2,f,3) int32, the vertices of a closed mesh at their corners, one for each fan of sides that edges join
    middle : (2,f,3) int32, for the edges from these corners to the next ones the further vertices in their middle, the
             same for both sides that are joined there; -1 where there is none
    halved : (2,m) int32, the vertices of the sheet that these middles are between
    """

    vertex: np.ndarray
    middle: np.ndarray
    halved: np.ndarray

    def whole_quads(self, pairs: int) -> np.ndarray:
        """Which of the sheet's quads have both their halves joined along the diagonal on either side, (pairs,) bool. It
        is an edge of further faces where sheets meet along it."""
        first, second = self.vertex[:, :pairs], self.vertex[:, pairs : 2 * pairs]
        return ((first[..., 0] == second[..., 0]) & (first[..., 2] == second[..., 1])).all(axis=0)


def _sides(sheet):
    """Around each edge its faces are in order of their angles, and the side of each that faces ahead is joined to the
    side of the next one that faces back; of a face alone, both its sides. So the sides around a vertex follow each
    other in cycles: from low end to low end one way, from high end to high end the other."""
    if (sheet.edges.count == 2).all() and sheet.edges.alike.all():
        return _apart(sheet)
    corner, corners = sheet.faces.reshape(-1), sheet.faces.dtype.type(sheet.faces.size)
    edge, count = sheet.edges.number.reshape(-1), sheet.edges.count
    order, several = order_around(sheet), np.repeat(count, count)
    here = np.arange(corners, dtype=corner.dtype)
    after, ends = corner_after(here), sheet.edges.corners_at_ends(here)
    upwards = ends[0] == here
    following, last = np.roll(order, -1), np.cumsum(count) - 1
    following[last] = order[last - count + 1]
    ahead, back = corners * ~upwards[order], corners * upwards[following]
    one, other = ends[:, order] + ahead, ends[:, following] + back
    around = np.empty(2 * corners, sheet.faces.dtype)
    around[one[0]], around[other[1]] = other[0], one[1]
    n, vertex = _cycles(around)
    met = vertex[:corners] == vertex[corners:]
    row = np.flatnonzero((several > 2) | ((several == 2) & (met & met[after])[order]))
    row = row[_alike(edge[order[row]], *vertex[one[:, row]])]
    middle = np.full(2 * corners, -1, sheet.faces.dtype)
    middle[order[row] + ahead[row]] = middle[following[row] + back[row]] = n + np.arange(len(row))
    shape = 2, *sheet.faces.shape
    return _Sides(vertex.reshape(shape), middle.reshape(shape), corner[ends[:, order[row]]])


def _apart(sheet):
    """The same of a closed sheet that is wound alike, whose fronts are joined to fronts and backs to backs."""
    one, two = np.argsort(sheet.edges.number.reshape(-1), kind="stable").astype(sheet.faces.dtype).reshape(-1, 2).T
    across = np.empty(sheet.faces.size, sheet.faces.dtype)
    across[one], across[two] = two, one
    n, vertex = _cycles(corner_after(across))
    vertex = np.stack([vertex, vertex + n]).reshape(2, *sheet.faces.shape)
    return _Sides(vertex, np.full_like(vertex, -1), np.empty((2, 0), sheet.faces.dtype))


def _cycles(after):
    """How many cycles a permutation (m,) has, and the number of that of each element, (m,), in order of the first ones:
    these are found over 2, 4, 8 ... elements ahead."""
    each = np.arange(len(after), dtype=after.dtype)
    first, least = each, np.minimum(each, after)
    while (least != first).any():
        first, after = least, after.take(after)
        least = np.minimum(first, first.take(after))
    number = np.cumsum(first == each, dtype=after.dtype) - 1
    return int(number[-1]) + 1 if len(number) else 0, number.take(first)


def _alike(*keys):
    """Which of some rows, by their `keys` (m,) each, there are more than one of, (m,) bool."""
    order = np.lexsort(keys)
    same = np.all([np.diff(key[order]) == 0 for key in keys], axis=0)
    found = np.zeros(len(order), bool)
    found[order[1:][same]] = found[order[:-1][same]] = True
    return found


def _totals(x, sides, n):
    """Sums of x (f,) over the sides that each of n vertices has, less over the backs, (n,)."""
    x = np.repeat(x, 3)
    front, back = (np.bincount(of.reshape(-1), x, n) for of in sides.vertex)
    cut = [np.flatnonzero(of.reshape(-1) >= 0) for of in sides.middle]
    ahead, behind = (np.bincount(of.reshape(-1)[at], x[at], n) for of, at in zip(sides.middle, cut, strict=True))
    return (front - back) + (ahead - behind)


def _joined(vertices, sides, pairs):
    """The closed mesh of the sides of faces the first of which are halves of so many `pairs`."""
    halves = np.arange(sides.vertex.shape[1])
    halves[: 2 * pairs] = np.roll(halves[: 2 * pairs], pairs)
    cuts = [pairs, 2 * pairs]

    def both(front, back):
        parts = zip(np.split(front, cuts), np.split(back[halves], cuts), strict=True)
        return np.concatenate([part for both in parts for part in both])

    faces = both(sides.vertex[0], sides.vertex[1][:, [0, 2, 1]])
    return _halved(Mesh(vertices, faces, 2 * pairs), both(sides.middle[0], sides.middle[1][:, ::-1]))


def _halved(mesh, middle):
    """The mesh with the edges of faces halved that have a vertex in the `middle`, (f,3), from each corner to the next;
    -1 where there is none."""
    cut = (middle >= 0).any(axis=1)
    if not cut.any():
        return mesh
    rest, faces, middle = mesh.of_faces(~cut), mesh.faces[cut], middle[cut]
    for _ in range(3):
        cut = (middle >= 0).any(axis=1)
        turn = ((middle >= 0).argmax(axis=1)[:, None] + np.arange(3)) % 3
        (a, b, c), (m, next_, last) = (np.take_along_axis(x, turn, axis=1)[cut].T for x in (faces, middle))
        none = np.full_like(m, -1)
        faces = np.concatenate([faces[~cut], np.stack([a, m, c], axis=1), np.stack([m, b, c], axis=1)])
        middle = np.concatenate([middle[~cut], np.stack([none, none, last], 1), np.stack([none, next_, none], 1)])
    return replace(rest, faces=np.concatenate([rest.faces, faces]))


def _turned(sheet):
    """The sheet with the diagonal of each quad turned that leads from border to border where the other one does not,
    and is no edge."""
    border, quads = sheet.edges.count == 1, sheet.quads
    if not border.any():
        return sheet
    on_border = sheet.edges.ends_at(border) > 0
    row = np.flatnonzero(on_border[quads[:, ::2]].all(axis=1) & ~on_border[quads[:, 1::2]].all(axis=1))
    if not len(row):
        return sheet
    a, b, c, d = quads[row].T
    row = row[(sheet.edges.faces_between(a, c) == 2) & (sheet.edges.faces_between(b, d) == 0)]
    faces = sheet.faces.copy()
    faces[row], faces[sheet.pairs + row] = quads[row][:, [1, 2, 3]], quads[row][:, [1, 3, 0]]
    return replace(sheet, faces=faces)
