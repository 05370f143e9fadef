"""The neighbours that may lie on the sheet of a sample, wherever its Voronoi neighbours are."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..linalg import row_dots
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
        """A list of parts of samples `row` (r,), of at most 256 that are all on none, or all on lines, stretched about
        as much."""
        ratio = np.ones(len(row)) if self.stretch is None else self.stretch.ratio[row]
        order = np.argsort(ratio, kind="stable")
        alike = np.split(row[order], [np.count_nonzero(ratio == 1)])
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

    def are_founded(self, row, other, direction, axes, weight):
        """Whether planes through samples `row` (p,) of a part, with unit axes (p,3), are those of the surface for all
        that lies in them, (p,) bool: any two lines lie in one, so that on lines there have to be more. In each plane
        lie the neighbours `other` (p,k), in unit directions (p,k,3), by weights (p,k)."""
        if not self.are_on_lines(row):
            return np.ones(len(row), bool)
        step = self.points[other] - self.points[row, None]
        weight = weight * self.stretch.squared_sine(row[:, None], direction)
        total = np.maximum(weight.sum(axis=1), _LEAST)
        offset = row_dots(step, np.cross(self.stretch.along[row], axes)[:, None])
        mean = row_dots(weight, offset) / total
        variance = row_dots(weight, (offset - mean[:, None]) ** 2) / total
        return variance > (_SEVERAL * self.stretch.across[row]) ** 2

    def aside(self, row, direction):
        """Whether unit directions (r,k,3) from samples `row` (r,) of a part lead to the side of their lines, (r,k)
        bool; true where these are on none."""
        if not self.are_on_lines(row):
            return np.ones(direction.shape[:2], bool)
        return self.stretch.squared_sine(row[:, None], direction) > _ASIDE**2

    def are_on_lines(self, row):
        """Whether the samples `row` of a part are, or of what is left of one, which may be none."""
        return self.stretch is not None and len(row) > 0 and self.stretch.ratio[row[0]] > 1
