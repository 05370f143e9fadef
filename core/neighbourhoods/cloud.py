"""The samples with their normals, and those around each."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from ..linalg import tangent_frames
from ..progress import Progress
from ..trees import nearest_others
from .lines import Lines, find_lines

_NEIGHBOURS = 16  # of a sample, that its patch is fitted to


@dataclass(frozen=True)
class Cloud:
    """points, normals : (n,3) float64     spacing : (n,) float64, local spacing, units of the points

    frames     : (n,2,3) float64, two unit tangents at each sample
    neighbours : (n,k) int, the samples that each one's patch is fitted to, nearest first
    tree       : of the points
    lines      : those that samples are on
    """

    points: np.ndarray
    normals: np.ndarray
    spacing: np.ndarray
    frames: np.ndarray
    neighbours: np.ndarray
    tree: KDTree
    lines: Lines

    @classmethod
    def of(cls, points, normals, spacing, progress=None) -> "Cloud":
        """With 16 neighbours, or all others where there are fewer."""
        tree = KDTree(points)
        neighbours = nearest_others(tree, _NEIGHBOURS, Progress.of(progress))[1]
        lines = find_lines(points, spacing, neighbours)
        return cls(points, normals, spacing, tangent_frames(normals), neighbours, tree, lines)

    def turned(self, normals: np.ndarray) -> "Cloud":
        """The same with other normals (n,3)."""
        return replace(self, normals=normals, frames=tangent_frames(normals))

    def __len__(self) -> int:
        return len(self.points)
