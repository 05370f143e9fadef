"""Scraps along the lines where sheets meet: a few faces between edges of three faces or more that show nothing.

A spur is a small patch that ends in a border right past the line, or hangs on a vertex there. A pocket is closed by
patches that are all small: two of them with one rim, for instance.
"""

import numpy as np

from ...field.local_surface import LocalSurface
from ...linalg import row_dots
from ...lookup import grouped
from ...parts import connected_parts, extents
from ..mesh import Mesh

_SMALL = 32  # faces of a patch
_PAST = 1.75  # cells, that a spur goes past the line
_SIZE = 0.1  # of a patch's own extent, counted beside its distance from the surface
_ROUNDS = 4


def without_scraps(mesh: Mesh, surface: LocalSurface, cell: float) -> Mesh:
    """The mesh without spurs, and with one patch less in each pocket: of those that close it, the one farthest from the
    surface. Patches are connected across edges of two faces. No border is made where there was none."""
    edge, counts = mesh.edges.number, mesh.edges.count.copy()
    if (counts <= 2).all():
        return mesh
    label = _patches(edge, counts)
    face = np.flatnonzero(np.bincount(label)[label] <= _SMALL)
    kept = np.ones(len(mesh.faces), bool)
    for _ in range(_ROUNDS):
        label = _patches(edge[face], counts)
        shared = counts[edge[face]] == 2
        shared &= np.bincount(edge[face].reshape(-1), minlength=len(counts))[edge[face]] == 1  # with a larger patch
        alone = (np.bincount(label, shared.any(axis=1)) == 0)[label]
        face, label = face[alone], np.unique(label[alone], return_inverse=True)[1]
        dropped = _scraps(mesh, face, label, edge, counts, surface, cell)
        if not dropped.any():
            break
        kept[face[dropped]] = False
        np.subtract.at(counts, edge[face[dropped]], 1)
        face = face[~dropped]
    if kept.all():
        return mesh
    return mesh.part(kept)


def _patches(edge, counts):
    """Number of each face's patch, (f,), by its edges (f,3)."""
    two = counts[edge] == 2
    owner, number = np.nonzero(two)[0], edge[two]
    order = np.argsort(number, kind="stable")
    owner, number = owner[order], number[order]
    pair = np.flatnonzero(number[1:] == number[:-1])
    return connected_parts(owner[pair], owner[pair + 1], len(edge))


def _scraps(mesh, face, label, edge, counts, surface, cell):
    """Which of some faces (m,), in patches `label` (m,), go."""
    corners = mesh.vertices[mesh.faces[face]]
    rim = counts[edge[face]] != 2
    open_patch = np.bincount(label, (counts[edge[face]] == 1).any(axis=1)) > 0
    order, first = grouped(label)
    parts = np.split(order, first[1:])
    off = surface.project(corners.mean(axis=1)).distance
    size = extents(np.repeat(label, 3), corners.reshape(-1, 3))
    cost = np.maximum.reduceat(off[order], first) + _SIZE * size
    dropped, left = np.zeros(len(face), bool), counts.copy()

    def drop(part):
        sides = edge[face[part]][rim[part]]
        number, times = np.unique(sides, return_counts=True)
        if ((left[number] - times == 1) & (left[number] > 1)).any():
            return
        left[number] -= times
        dropped[part] = True

    shared = np.bincount(mesh.faces.reshape(-1), minlength=len(mesh.vertices))
    for patch in np.flatnonzero(open_patch):
        if _is_spur(mesh, face[parts[patch]], edge, counts, shared, cell):
            drop(parts[patch])
    rims = _Independent()
    for patch in np.argsort(cost, kind="stable"):
        part = parts[patch]
        if not open_patch[patch] and not rims.add(edge[face[part]][rim[part]]):
            drop(part)
    return dropped


class _Independent:
    """Sets of edges, none of them the sum (symmetric difference) of others: patches whose rims add up to nothing close
    a pocket. Kept in echelon form, sets as the bits of integers (linear algebra over GF(2))."""

    def __init__(self):
        self._by_highest, self._bit = {}, {}

    def add(self, edges) -> bool:
        """Whether a set, edges (m,) of which those there an even number of times do not count, is no sum of others;
        only then it is one of them from now on."""
        row = 0
        for number in edges.tolist():
            row ^= 1 << self._bit.setdefault(number, len(self._bit))
        while row and row.bit_length() in self._by_highest:
            row ^= self._by_highest[row.bit_length()]
        if row:
            self._by_highest[row.bit_length()] = row
        return bool(row)


def _is_spur(mesh, face, edge, counts, faces_at, cell):
    """Whether all vertices of a patch with a border lie within 1.75 cells of a line that it ends at, or of the vertices
    that it has in common with others where it ends at none; `faces_at` (v,) are all faces of each vertex."""
    tail, head = mesh.faces[face], np.roll(mesh.faces[face], -1, axis=1)
    line = counts[edge[face]] > 2
    own, times = np.unique(tail, return_counts=True)
    start, stop = mesh.vertices[tail[line]], mesh.vertices[head[line]]
    if not line.any():
        start = stop = mesh.vertices[own[times < faces_at[own]]]
    if not len(start):
        return False
    x = mesh.vertices[own]
    along = stop - start
    share = row_dots(x[:, None] - start, along) / np.maximum((along**2).sum(axis=1), 1e-300)
    foot = start + np.clip(share, 0, 1)[..., None] * along
    return (np.linalg.norm(x[:, None] - foot, axis=2).min(axis=1) <= _PAST * cell).all()
