"""The edges of a mesh's faces."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix


@dataclass(frozen=True, eq=False)
class Edges:
    """The undirected edges of triangles or quads, in order of their lower ends, then of their higher ones; what is
    known of them is found when it is first asked for.

    faces : (f,k) int, vertices     n : int, number of vertices
    """

    faces: np.ndarray
    n: int

    @cached_property
    def low(self) -> np.ndarray:
        """The lower end of each edge, (e,) int64."""
        return np.repeat(np.arange(self.n), np.diff(self._table.indptr))

    @cached_property
    def high(self) -> np.ndarray:
        """The higher end of each, (e,) int64."""
        return self._table.indices.astype(np.int64)

    @property
    def count(self) -> np.ndarray:
        """How many faces each edge has, (e,) int32: 1 at a border, 2 inside a manifold."""
        return self._table.data

    @cached_property
    def number(self) -> np.ndarray:
        """The edge from each corner to the next, (f,k) int."""
        table = self._table
        numbers = csr_matrix((np.arange(len(table.data)), table.indices, table.indptr), table.shape)
        return _looked_up(numbers, self.faces, np.roll(self.faces, -1, axis=1))

    @cached_property
    def beside(self) -> tuple[np.ndarray, np.ndarray]:
        """Both faces, (p,) int64 each, of the edges that have two, in order."""
        owner, edge = np.repeat(np.arange(len(self.faces)), self.faces.shape[1]), self.number.reshape(-1)
        last = np.empty(len(self.count), np.int64)
        last[edge] = owner
        inner = self.count == 2
        return (np.bincount(edge, owner).astype(np.int64) - last)[inner], last[inner]

    @cached_property
    def alike(self) -> np.ndarray:
        """Whether these are wound alike, (p,) bool."""
        upwards = self.faces < np.roll(self.faces, -1, axis=1)
        return np.bincount(self.number.reshape(-1), upwards.reshape(-1))[self.count == 2] == 1

    def corners_at_ends(self, corner: np.ndarray) -> np.ndarray:
        """The corners at the lower and the higher end of the edges of triangles from corners (m,), numbered three to a
        face, to the next ones, (2,m)."""
        vertex, after = self.faces.reshape(-1), corner_after(corner)
        upwards = vertex[corner] < vertex[after]
        return np.stack([np.where(upwards, corner, after), np.where(upwards, after, corner)])

    def ends_at(self, chosen: np.ndarray) -> np.ndarray:
        """How many edges of those `chosen`, (e,) bool or rows, each vertex has, (n,) int."""
        return np.bincount(np.append(self.low[chosen], self.high[chosen]), minlength=self.n)

    def links(self) -> csr_matrix:
        """Ones where an edge joins two vertices, (n,n) sparse and symmetric."""
        table = self._table
        upper = csr_matrix((np.ones(len(table.data)), table.indices, table.indptr), table.shape)
        return upper + upper.T.tocsr()

    def faces_between(self, tail: np.ndarray, head: np.ndarray) -> np.ndarray:
        """How many faces there are at an edge between vertices `tail` and `head`, of one shape; 0 where is none."""
        return _looked_up(self._table, tail, head)

    @cached_property
    def _table(self):
        """How many faces each edge has, (n,n) sparse, at its lower end and its higher one. Entries are in order;
        counting them so is several times as quick as sorting numbers of edges."""
        tail, head = self.faces.reshape(-1), np.roll(self.faces, -1, axis=1).reshape(-1)
        ends = np.minimum(tail, head), np.maximum(tail, head)
        return coo_matrix((np.ones(len(tail), np.int32), ends), shape=(self.n, self.n)).tocsr()


def corner_after(corner: np.ndarray) -> np.ndarray:
    """The next corner of the same triangle, for corners (m,) numbered three to a face."""
    return np.where(corner % 3 == 2, corner - 2, corner + 1)


def _looked_up(table: csr_matrix, tail, head):
    low, high = np.minimum(tail, head).reshape(-1), np.maximum(tail, head).reshape(-1)
    if not len(low):  # of nothing SciPy gives another sparse array
        return np.zeros(tail.shape, table.dtype)
    return np.asarray(table[low, high]).reshape(tail.shape)
