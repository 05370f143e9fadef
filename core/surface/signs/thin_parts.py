"""Parts of a surface that the signs of nodes do not show: too thin for one to lie inside, slits as narrow, and lines
along which sheets pass through one another.

Of the four wedges around such a line two are inside. Whether they hang together there is told by single nodes, now so
and now so; lifted, the mesh has none of the handles that this would make, and each wedge its own edge.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ...field.blocks import Blocks, at_nodes, each, marked_nodes, put
from ...field.grid import Grid, node_strides
from ...field.local_surface import LocalSurface
from ...linalg import outer_sum
from ...parallel import in_order
from ...progress import Progress

_REACH = 1.25  # cells; where either side is thick, one of its nodes is as close to any sample
_LEVEL = 0.8  # cells off the surface that the iso-surface is taken there
_PARTED = 0.6  # cells, the same along lines
_FULL, _END = 1.5, 4.0  # cells from such a sample, where it is taken as far off, and where no further
_BETWEEN = 1.0  # cells, over which it comes back from the samples of slits to those with nodes on both sides
_NEAR = 2.0  # cells from the surface, farther values do not matter for the mesh
_CHUNK = 1 << 12  # samples


@dataclass(frozen=True)
class ThinParts:
    """Samples (t,3) with no node inside near them and ends of wedges, `thin`, samples with none outside, `slits`, those
    close to `lines` along which sheets pass through one another, and `clear` ones, which are none of these."""

    thin: np.ndarray
    slits: np.ndarray
    lines: np.ndarray
    clear: np.ndarray
    cell: float

    def lift(self, x: np.ndarray) -> np.ndarray:
        """How far outside of the surface the iso-surface is taken at x (m,3), (m,), units of the samples: 0.8 cells at
        thin parts, as far inside of it at slits, and 0.6 along lines. Slits and lines give way to clear samples: close
        to an outer wall that were lifted as well, slits would merge with the outside, and the wall be lost."""
        thin, slit, line = (self._away(samples, x) for samples in (self.thin, self.slits, self.lines))
        lift, near = _LEVEL * _falling(thin), np.flatnonzero(np.minimum(slit, line) < _END)
        slit, line = slit[near], line[near]
        nearer = self._away(self.clear, x[near]) - np.minimum(slit, line)
        inside = np.maximum(_LEVEL * _falling(slit), _PARTED * _falling(line))
        lift[near] -= inside * np.clip(0.5 + nearer / _BETWEEN, 0.0, 1.0)
        return self.cell * lift

    def _away(self, samples, x):
        """Cells from x (m,3) to the nearest of the samples, (m,); at most as far as lifts reach."""
        if not len(samples) or not len(x):
            return np.full(len(x), _END)
        away = KDTree(samples).query(x, distance_upper_bound=_END * self.cell, workers=-1)[0]
        return np.minimum(away / self.cell, _END)

    def away_from(self, places: np.ndarray) -> "ThinParts | None":
        """Those whose lift ends before it reaches any of the places (m,3); None where there are none."""
        if not len(places):
            return self
        tree, end = KDTree(places), _END * self.cell
        lifted = self.thin, self.slits, self.lines
        left = [x[tree.query(x, distance_upper_bound=end)[0] > end] for x in lifted]
        return ThinParts(*left, self.clear, self.cell) if sum(map(len, left)) else None

    def lower(self, values: np.ndarray | Blocks, grid: Grid) -> None:
        """Take the lift off signed distances (nx,ny,nz) float32 or Blocks, in place, where the surface is near."""
        limit = np.float32(_NEAR * self.cell)
        node = marked_nodes(each(lambda u: np.abs(u) <= limit, values))
        put(values, node, at_nodes(values, node) - self.lift(grid.positions(node)).astype(np.float32))


def _falling(away):
    """From 1 close to samples to 0 where lifts end, (m,), by cells to the samples (m,)."""
    return np.clip((_END - away) / (_END - _FULL), 0.0, 1.0)


def find_thin_parts(
    values: np.ndarray | Blocks,
    passing: np.ndarray,
    surface: LocalSurface,
    grid: Grid,
    progress=None,
    wedges: np.ndarray = np.empty((0, 3)),
) -> ThinParts | None:
    """Where samples have nodes within 1.25 cells on one side alone, by signed distances `values`, (nx,ny,nz) float32 or
    Blocks, and those close to lines, `passing` (n,) bool; and places (v,3) that are known to be thin, `wedges`. None
    where all samples have both, none is close to lines, and no place is given."""

    def one_sided(part):
        node, squared = _nodes_around(surface.points[part], grid, int(np.ceil(_REACH - 0.5)))
        near, inside = squared <= _REACH**2, at_nodes(values, node) < 0
        return np.stack([~(near & side).any(axis=(0, 1, 2)) for side in (inside, ~inside)])

    chunks = Progress.of(progress).chunks(len(surface.points), _CHUNK)
    thin, slit = np.concatenate([found for _, found in in_order(one_sided, chunks)], axis=1)
    clear = ~(thin | slit | passing)
    if clear.all() and not len(wedges):
        return None
    kinds = thin & ~passing, slit & ~passing, passing, clear
    thin, *others = (surface.points[chosen] for chosen in kinds)
    return ThinParts(np.concatenate([thin, wedges]), *others, grid.spacing)


def _nodes_around(points, grid, half):
    """Flat indices of the nodes up to `half` along each axis from that nearest to each point, (w,w,w,n), nodes at the
    side of the box in place of those past it, and squared distances from the point to them in cells."""
    at, last = ((points - grid.origin) / grid.spacing).T[:, None], np.array(grid.shape)[:, None, None] - 1
    node = np.clip(np.rint(at).astype(np.int64) + np.arange(-half, half + 1)[:, None], 0, last)
    return outer_sum(node * node_strides(grid.shape)[:, None, None]), outer_sum((node - at) ** 2)
