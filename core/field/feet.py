"""Foot points on the surface, from which distances further out are measured."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from ..linalg import dots, row_dots
from ..trees import quick_tree
from .grid import Grid
from .local_surface import LocalSurface, Projection
from .projection import FROM_NODES

_SEED_BAND = 1.5  # cells, nodes whose foot points carry the distance outwards
_AGREED = 0.02  # cells, spread of patches over which a foot point needs no second look
_SETTLED = 0.1  # cells, residual of a foot point that counts
_RADIUS = 0.5  # cells, a foot point stands for a disc of this radius
_TOLD = 0.02  # cells; the step from a foot point to a node shows no normal there if it is shorter
_CLOSE, _CLOSER = 0.5, 0.1  # cells: beyond the first from the surface, feet count that are this much closer
_CHUNK = 1 << 17


@dataclass(frozen=True)
class Feet:
    """Foot points and the discs that they stand for, with positions relative to the origin of the grid, so that single
    precision is as fine wherever the samples lie.

    centres, normals : (3,s) float32, unit normals     radius : (s,) float32, 0 on rims
    """

    centres: np.ndarray
    normals: np.ndarray
    radius: np.ndarray

    @cached_property
    def tree(self) -> KDTree:
        return quick_tree(self.centres.T)

    def offsets(self, x: np.ndarray, row: np.ndarray) -> list[np.ndarray]:
        """To x (3,...) float32 from the feet number `row` (...), three (...)."""
        return [x_a - centre.take(row) for x_a, centre in zip(x, self.centres, strict=True)]

    def distance(self, x: np.ndarray, row: np.ndarray) -> np.ndarray:
        """Distances from x (3,...) float32 to the discs number `row` (...)."""
        offset = self.offsets(x, row)
        height = dots(offset, [normal.take(row) for normal in self.normals]) ** 2
        lateral = np.sqrt(np.maximum(dots(offset, offset) - height, 0)) - self.radius.take(row)
        return np.sqrt(height + np.maximum(lateral, 0) ** 2)

    def steps(self, x: np.ndarray, row: np.ndarray) -> np.ndarray:
        """Steps (m,3) float64 to x (m,3) from the closest points of the discs number `row` (m,)."""
        offset, normal = x - self.centres.T[row], self.normals.T[row].astype(np.float64)
        lateral = offset - row_dots(offset, normal)[:, None] * normal
        away = np.linalg.norm(lateral, axis=1)
        within = np.minimum(self.radius[row] / np.maximum(away, np.finfo(float).tiny), 1.0)
        return offset - within[:, None] * lateral

    def nearest(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances (m,) float64 from x (m,3) to the disc of the nearest foot, and its number (m,); inf and 0 where
        there are no feet."""
        found, row = np.full(len(x), np.inf), np.zeros(len(x), np.int64)
        for first in range(0, len(x) if len(self.radius) else 0, _CHUNK):
            part = slice(first, first + _CHUNK)
            row[part] = self.tree.query(x[part], workers=-1)[1]
            found[part] = self.distance(x[part].T.astype(np.float32), row[part])
        return found, row

    def closest(self, x: np.ndarray, among: np.ndarray) -> np.ndarray:
        """Which of the feet `among` (c,...) is the closest to each x (3,...) float32, the first of several: their
        numbers (...)."""
        row, offset = among[0], self.offsets(x, among[0])
        least = dots(offset, offset)
        for other in among[1:]:
            offset = self.offsets(x, other)
            squared = dots(offset, offset)
            row = np.where(squared < least, other, row)
            least = np.minimum(squared, least)
        return row

    def in_cells(self, grid: Grid) -> "Feet":
        """The same in the grid's index space: node (i,j,k) lies at (i,j,k)."""
        cell = np.float32(grid.spacing)
        return Feet(self.centres / cell, self.normals, self.radius / cell)


def settled_feet(surface: LocalSurface, grid: Grid, node, near: Projection, progress) -> tuple[np.ndarray, Feet]:
    """Nodes close to the surface, but not on it, whose foot points are on it, (s,) of `node` (b,), and those feet:
    after a second projection, but where all patches agreed on the first.

    near : where the nodes fall on the surface
    """
    seed = (near.distance <= _SEED_BAND * grid.spacing) & (near.distance > _TOLD * grid.spacing)
    node, near = node[seed], near[seed]
    feet, kept = grid.positions(node) - near.step, np.ones(len(node), bool)
    doubtful = np.flatnonzero(near.spread > _AGREED * grid.spacing)
    again = surface.project(feet[doubtful], progress, FROM_NODES)
    feet[doubtful] -= again.step
    kept[doubtful] = again.distance <= _SETTLED * grid.spacing
    node, near, feet = node[kept], near[kept], feet[kept]
    radius = np.where(near.past_rim, 0.0, _RADIUS * grid.spacing)
    parts = feet - grid.origin, near.direction, radius
    return node, Feet(*(np.ascontiguousarray(each.T, np.float32) for each in parts))


def no_farther_than_feet(near: Projection, node: np.ndarray, feet: Feet, found: tuple, grid: Grid) -> tuple:
    """Makes distances by projection, in place, those to feet where these are clearly less and the node is not right
    beside the surface. Returns the rows of such nodes (c,) and the steps to them from those feet (c,3).

    Patches that do not quite meet leave cracks, in which projections are too long and iso-surfaces have holes: on
    `tjunction_5k` of the benchmarks that at one cell has the Euler number -42 without this and -4 with it; -6 is right.

    near  : where the nodes (m,) fall on the surface
    found : distances (m,) to the discs of feet close to them, and the numbers of those (m,)
    """
    to_feet, number = found
    least = np.maximum(to_feet + _CLOSER * grid.spacing, _CLOSE * grid.spacing)
    row = np.flatnonzero(near.distance > least)
    near.distance[row] = to_feet[row]
    return row, feet.steps(grid.positions(node[row]) - grid.origin, number[row])
