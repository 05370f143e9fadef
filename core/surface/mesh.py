"""Triangle meshes as plain arrays, some of whose triangles may be the halves of quads."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..linalg import cross, dots, lengths, unit_columns
from ..lookup import mask_of, numbered
from ..parallel import over_rows
from ..parts import connected_parts
from .mesh_edges import Edges

AT_ONCE = 1 << 15  # faces


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh of triangles and quads; a quad is there as two triangles.

    vertices : (v,3) float64, input units
    faces    : (f,3) int32, indices into `vertices`, all triangles
    pairs    : number of quads: for k < pairs the faces k and pairs + k are the halves (a,b,c) and (a,c,d) of one
    """

    vertices: np.ndarray
    faces: np.ndarray
    pairs: int = 0

    @property
    def quads(self) -> np.ndarray:
        """(pairs,4), wound as their halves are."""
        return np.column_stack([self.faces[: self.pairs], self.faces[self.pairs : 2 * self.pairs, 2]])

    @property
    def triangles(self) -> np.ndarray:
        """The faces that are no half of a quad, (f - 2 pairs,3)."""
        return self.faces[2 * self.pairs :]

    @cached_property
    def edges(self) -> Edges:
        """Those of its faces, as triangles."""
        return Edges(self.faces, len(self.vertices))

    @cached_property
    def normals(self) -> tuple[np.ndarray, np.ndarray]:
        """What :func:`vertex_normals` gives."""
        return vertex_normals(self.vertices, self.faces)

    def moved(self, vertices: np.ndarray) -> "Mesh":
        """The mesh with its vertices at other places, (v,3), and the same :attr:`edges`."""
        mesh = replace(self, vertices=vertices)
        vars(mesh)["edges"] = self.edges
        return mesh

    def of_faces(self, kept: np.ndarray) -> "Mesh":
        """The mesh of the faces marked in `kept`, (f,) bool, in order; quads stay such where both their halves do."""
        return self._of(kept, kept[: 2 * self.pairs].reshape(2, -1).all(axis=0))

    def with_quads(self, whole: np.ndarray) -> "Mesh":
        """The mesh with only those of its quads that are marked in `whole`, (pairs,) bool; others are two triangles."""
        return self._of(np.ones(len(self.faces), bool), whole)

    def _of(self, kept, whole):
        rest = kept.copy()
        rest[: 2 * self.pairs] &= ~np.tile(whole, 2)
        first = np.flatnonzero(whole)
        rows = np.concatenate([first, self.pairs + first, np.flatnonzero(rest)])
        return replace(self, faces=self.faces[rows], pairs=len(first))

    def with_halves(self, chosen: np.ndarray) -> np.ndarray:
        """The faces `chosen`, (f,) bool, with the other halves of their quads."""
        found, halves = chosen.copy(), chosen[: 2 * self.pairs].reshape(2, -1)
        found[: 2 * self.pairs] = np.tile(halves[0] | halves[1], 2)
        return found

    def vertices_of(self, chosen: np.ndarray) -> np.ndarray:
        """Which vertices faces `chosen`, (f,) bool or rows, have, (v,) bool."""
        return mask_of(self.faces[chosen], len(self.vertices))

    def faces_at(self, chosen: np.ndarray) -> np.ndarray:
        """Which faces have a vertex that is `chosen`, (v,) bool, (f,) bool."""
        first, second, third = (chosen[corner] for corner in self.faces.T)
        return first | second | third

    def around(self, chosen: np.ndarray, rings: int = 1) -> np.ndarray:
        """The vertices that are `chosen`, (v,) bool, and those of so many rings of faces around them, (v,) bool."""
        for _ in range(rings):
            chosen = self.vertices_of(self.faces_at(chosen))
        return chosen

    def part(self, kept: np.ndarray) -> "Mesh":
        """The mesh of the faces marked in `kept`, as :meth:`of_faces`, with their vertices alone."""
        mesh = self.of_faces(kept)
        vertices, faces = in_use(mesh.vertices, mesh.faces)
        return replace(mesh, vertices=vertices, faces=faces.astype(np.int32))

    def joined(self, other: "Mesh") -> "Mesh":
        """This mesh and another one, in one."""
        faces, others, pairs = self.faces, other.faces + np.int32(len(self.vertices)), (self.pairs, other.pairs)
        halves = [each[n * k : n * (k + 1)] for k in (0, 1) for each, n in zip((faces, others), pairs, strict=True)]
        faces = np.concatenate([*halves, faces[2 * pairs[0] :], others[2 * pairs[1] :]])
        return Mesh(np.concatenate([self.vertices, other.vertices]), faces, sum(pairs))

    def with_part(self, near: np.ndarray, row: np.ndarray, part: "Mesh") -> "Mesh":
        """The mesh with the faces of `part` in place of those marked in `near`, (f,) bool; vertices of the part, first
        of all, are the rows `row` of this mesh's, all of which those faces have."""
        vertices, outside = self.vertices.copy(), self.of_faces(~near)
        vertices[row] = part.vertices
        part = replace(part, faces=row[part.faces])
        kinds = (np.split(each.faces, [each.pairs, 2 * each.pairs]) for each in (outside, part))
        faces = np.concatenate([each for both in zip(*kinds, strict=True) for each in both])
        vertices, faces = in_use(vertices, faces)
        return Mesh(vertices, faces.astype(np.int32), outside.pairs + part.pairs)

    def edge_counts(self) -> tuple[np.ndarray, np.ndarray]:
        """Undirected edges, (e,2) int, and how many faces each has, (e,) int: 1 at a border, 2 inside a manifold."""
        edges = self.edges
        return np.stack([edges.low, edges.high], axis=1).astype(self.faces.dtype), edges.count

    def border_loops(self) -> int:
        """Number of connected curves that the border edges (those of one face) form."""
        edges, counts = self.edge_counts()
        corners, ends = numbered(edges[counts == 1])
        return int(connected_parts(*ends.T, len(corners)).max(initial=-1)) + 1

    def face_areas(self) -> np.ndarray:
        """(f,) float64, square input units."""
        columns, found = np.asfortranarray(self.vertices), np.empty(len(self.faces))

        def measure(part):
            found[part] = 0.5 * lengths(face_normals(*at_corners(columns, self.faces[part])))

        over_rows(measure, len(self.faces), AT_ONCE)
        return found


def at_corners(x: np.ndarray, faces: np.ndarray) -> list[np.ndarray]:
    """Rows of x (v,3) at each corner of triangles or quads (f,k), k arrays (3,f), component by component."""
    found = np.empty((faces.shape[1], 3, len(faces)), x.dtype)
    for place, corner in zip(found, faces.T.astype(np.intp), strict=True):
        for row, column in zip(place, np.ascontiguousarray(x.T), strict=True):
            np.take(column, corner, out=row, mode="clip")  # which writes there at once, as "raise" does not
    return list(found)


def face_normals(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Normals (3,...) of triangles with corners (3,...) each, twice as long as their areas."""
    return cross(b - a, c - a)


def turns_around(a: np.ndarray, b: np.ndarray, c: np.ndarray, way: np.ndarray) -> np.ndarray:
    """How the sides of triangles with corners a, b, c (3,...) turn around the line through the origin along `way`
    (3,...): (3,...), none below zero or none above it where that line passes the triangle."""
    return np.stack([dots(cross(p, q), way) for p, q in ((a, b), (b, c), (c, a))])


def in_use(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The vertices (v,3) that faces (f,k) have, and the faces with their numbers."""
    used = mask_of(faces, len(vertices))
    return vertices[used], (np.cumsum(used) - 1)[faces]


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (v,3) of the vertices, by area, and the least cosine between each and those of its faces, (v,)."""
    n, corners, columns = len(vertices), faces.T.astype(np.intp), np.asfortranarray(vertices)
    start, end = (0, 1), (2, 3 % len(corners))  # of the diagonals of a quad, of two sides of a triangle
    face, cosine = np.empty((3, len(faces))), np.empty(corners.shape)

    def turn(part):
        places = at_corners(columns, faces[part])
        face[:, part] = cross(*(places[b] - places[a] for a, b in zip(start, end, strict=True)))

    def compare(part):
        unit = unit_columns(face[:, part])
        for corner, found in zip(corners, cosine, strict=True):
            found[part] = np.einsum("if,if->f", unit, normal.take(corner[part], axis=1))

    over_rows(turn, len(faces), AT_ONCE)
    normal = unit_columns(np.stack([sum(np.bincount(corner, x, n) for corner in corners) for x in face]))
    over_rows(compare, len(faces), AT_ONCE)
    least = np.ones(n)
    for corner, found in zip(corners, cosine, strict=True):
        np.minimum.at(least, corner, found)
    return normal.T.copy(), least
