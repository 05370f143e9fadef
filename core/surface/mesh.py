"""Triangle meshes as plain arrays."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh.

    vertices : (v,3) float64, input units
    faces    : (f,3) int32, indices into `vertices`, wound so that the right-hand normal points away from the surface
    """

    vertices: np.ndarray
    faces: np.ndarray

    def edge_counts(self) -> tuple[np.ndarray, np.ndarray]:
        """Undirected edges, (e,2) int, and the number of faces at each, (e,) int: 1 at a border, 2 inside a manifold."""
        ends = np.sort(self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        return np.unique(ends, axis=0, return_counts=True)

    def face_areas(self) -> np.ndarray:
        """(f,) float64, square input units."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
