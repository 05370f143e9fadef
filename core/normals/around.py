"""The neighbours that may lie on the sheet of a sample, wherever its Voronoi neighbours are."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..neighbourhoods.stretch import Stretch
from ..points import SPACING_NEIGHBOURS

_NEIGHBOURS, _ON_LINES = 20, 64
_WIDTH = 1.7  # of the Gaussian of their distance, local spacings
_CHUNK = 256  # samples
_ASIDE = 0.7  # sine between a line and the way to its side, at least
_LEAST = 1e-9  # weight of what lies in a plane
_SEVERAL = 0.2  # deviation of what lies in one plane from one line in it, distances to the next line


@dataclass
class Around:
    """points  : (n,3) float64, distinct samples     spacing : (n,) float64, local spacing, same units
    stretch : how they lie closer along lines, None where there are none"""

    points: np.ndarray
    spacing: np.ndarray
    stretch: Stretch | None = None

    def __post_init__(self):
        self.tree = KDTree(self.points)

    def parts(self, row):
        """A list of parts of samples `row` (r,), of at most 256 that are all on lines, or all on none."""
        lines = np.zeros(len(row), bool) if self.stretch is None else self.stretch.ratio[row] > 1
        alike = (row[~lines], row[lines])
        return [some[first : first + _CHUNK] for some in alike for first in range(0, len(some), _CHUNK)]

    def neighbours(self, row):
        """The neighbours of samples `row` (r,) of a part, nearest first: their numbers (r,k), the unit directions to
        them (r,k,3), and how near they are, (r,k) in [0,1]. On lines these are as many to the side as along them, and
        more: a plane that two lines lie in tells nothing."""
        if self.are_on_lines(row):
            distance, other = self.stretch.nearest(row, self.points, self.tree, _ON_LINES)
            spacing = distance[:, :SPACING_NEIGHBOURS].mean(axis=1)
        else:
            distance, other = self.tree.query(self.points[row], k=min(_NEIGHBOURS + 1, len(self.points)))
            distance, other, spacing = distance[:, 1:], other[:, 1:], self.spacing[row]
        step = self.points[other] - self.points[row, None]
        near = np.exp(-((distance / (_WIDTH * spacing[:, None])) ** 2))
        return other, step / np.linalg.norm(step, axis=2)[..., None], near

    def tell(self, row, other, direction, axes, weight):
        """Whether what lies in planes with unit axes (r,t,3) through samples `row` (r,) of a part tells that these are
        planes of the surface, (r,t) bool: any two lines lie in one, so that on lines there have to be more. In a plane
        lie the neighbours `other` (r,k), in unit directions (r,k,3), by weights (r,t,k)."""
        if not self.are_on_lines(row):
            return np.ones(axes.shape[:2], bool)
        along = self.stretch.along[row, None]
        step = self.points[other] - self.points[row, None]
        weight = weight * self.stretch.squared_sine(row[:, None], direction)[:, None]
        total = np.maximum(weight.sum(axis=2), _LEAST)
        offset = np.cross(along, axes) @ step.transpose(0, 2, 1)
        mean = (weight * offset).sum(axis=2) / total
        variance = (weight * (offset - mean[..., None]) ** 2).sum(axis=2) / total
        return variance > (_SEVERAL * self.stretch.across[row, None]) ** 2

    def aside(self, row, direction):
        """Whether unit directions (r,k,3) from samples `row` (r,) of a part lead to the side of their lines, (r,k)
        bool; true where these are on none."""
        if not self.are_on_lines(row):
            return np.ones(direction.shape[:2], bool)
        return self.stretch.squared_sine(row[:, None], direction) > _ASIDE**2

    def are_on_lines(self, row):
        """Whether the samples `row` of a part are."""
        return self.stretch is not None and self.stretch.ratio[row[0]] > 1
