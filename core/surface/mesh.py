"""Triangle meshes as plain arrays."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh.

    vertices : (v,3) float64, input units
    faces    : (f,3) int32, indices into `vertices`
    """

    vertices: np.ndarray
    faces: np.ndarray

    def edge_counts(self) -> tuple[np.ndarray, np.ndarray]:
        """Undirected edges, (e,2) int, and how many faces each has, (e,) int: 1 at a border, 2 inside a manifold."""
        ends = np.sort(self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        return np.unique(ends, axis=0, return_counts=True)

    def border_loops(self) -> int:
        """Number of connected curves that the border edges (those of one face) form."""
        edges, counts = self.edge_counts()
        corners, ends = np.unique(edges[counts == 1], return_inverse=True)
        ends = ends.reshape(-1, 2)
        graph = coo_matrix((np.ones(len(ends), bool), tuple(ends.T)), shape=(len(corners),) * 2)
        return connected_components(graph, directed=False)[0] if len(corners) else 0

    def face_areas(self) -> np.ndarray:
        """(f,) float64, square input units."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
