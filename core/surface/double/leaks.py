"""Leaks of closed surfaces: openings between samples that chance has put far apart, by which an iso-surface around the
surface joins the inside to the outside.

In a leak the distance is hardly more than the level of the iso-surface. So where samples have a region on either side,
and these are two, as soon as regions start a little further from the surface, this encloses one of them; and leaks are
where they meet when they grow down to the level. On both sides of an open surface lies the same region.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ...field.blocks import SIDE, Blocks, at_nodes, block_corners, each, inner_nodes, marked_nodes, put, regions
from ...field.grid import ADJACENT, Grid, node_strides
from ...field.groups import HALF, middles_of
from ...field.local_surface import LocalSurface
from ...lookup import edge_keys, rows_of
from ...parallel import over_rows
from ...parts import near_parts
from ...progress import Progress
from ...trees import k_nearest
from ..signs.sides import regions_beside

_TIMES = 4  # that leaks are looked for: some show when others are shut
_RAISED = 0.5, 1.0, 2.0, 4.0, 8.0  # cells above the level, where regions are tried
_COARSE = 1.5  # cells from the surface, beyond which every other node parts regions just as well
_OPEN = 0.05  # share of the samples: as few may have one region on both sides, or lie between two
_SAME = 0.9  # times as many samples between two regions as farther off, if nothing leaks
_SHORT = 0.1  # cells from the edge of a band, where regions may start
_ACROSS = 0.1  # share of what is seen of a region that has another across the surface, if they are its two sides
_ROUND = 0.5  # cells of distance that regions grow at a time
_AROUND, _MOST = 32, 0.6  # samples around a leak, and the share of them that must lie between two regions
_WAITING = -1  # label of nodes that no region has reached
_MARGIN = 2  # cells beyond the level where distances are lowered
_BLOCKS = 128  # of nodes at a time


def shut_leaks(near, values, surface: LocalSurface, grid: Grid, level: float, progress=None) -> np.ndarray:
    """Lower distances, in place, where an iso-surface at `level` would leak through an opening of a closed surface that
    is no wider than the bridging length. Returns places in those openings, (m,3) float64, as dense as nodes; none for
    leaks where the distances to be meshed were raised, which get their own again.

    near   : (nx,ny,nz) float32 or Blocks, distances at the nodes to be meshed, cut off somewhere above the level
    values : the same, not cut off; in Blocks those of a band
    level  : float; all in the units of the samples
    """
    progress, shut = Progress.of(progress), np.empty((0, 3))
    field, samples = _Field(values, surface, grid), len(surface.points)
    widest = 0.5 * surface.bridge * float(np.median(surface.spacing))
    widest = min(widest, field.cut_off - _SHORT * grid.spacing)
    if widest <= level:
        return shut
    far = field.halved().regions(max(widest, _COARSE * grid.spacing))
    if far.on_one_side > _OPEN * samples > far.between_two:
        return shut

    def apart(found):
        more = found.on_one_side - far.on_one_side
        return found.between_two >= _SAME * far.between_two and more <= _OPEN * samples

    levels = [level + raised * grid.spacing for raised in _RAISED]
    levels = [*(raised for raised in levels if raised < widest), widest]
    cut = near.max() if isinstance(near, np.ndarray) else near.outer.max()
    for _, part in progress.turns(range(_TIMES)):
        part(0.0)
        if apart(_Field(near, surface, grid).regions(level)):
            break
        field = _Field(each(lambda u, v: np.where(u < cut, u, v), near, values), surface, grid)
        start = field.first(part.each(levels), apart)
        ends = field.meetings(field.grown(start, level), start.level)
        if not ends.size:
            break
        own = at_nodes(values, ends)
        put(near, ends, np.minimum(at_nodes(near, ends), own))
        places = _middle(ends[:, (own > level).all(axis=0)], grid)
        lower_around(places, near, grid, level)
        shut = np.concatenate([shut, places])
    return shut


@dataclass(frozen=True)
class _Regions:
    """Connected sets of nodes that are farther than a level from the surface.

    level  : float
    labels : (nx,ny,nz) int32 or Blocks, from 1; 0 at other nodes
    seen   : (n,2) int64, the regions on either side of each sample; 0 where there is none
    """

    level: float
    labels: np.ndarray | Blocks
    seen: np.ndarray

    @property
    def both(self) -> np.ndarray:
        """(n,) bool, samples with a region on either side."""
        return (self.seen > 0).all(axis=1)

    @property
    def parted(self) -> np.ndarray:
        """(n,) bool, samples between two regions."""
        return self.both & (self.seen[:, 0] != self.seen[:, 1])

    @property
    def between_two(self) -> int:
        return int(self.parted.sum())

    @property
    def on_one_side(self) -> int:
        return int(self.both.sum()) - self.between_two

    def across(self, pairs: np.ndarray) -> np.ndarray:
        """Whether pairs of regions (m,2) are the two sides of some of the surface, (m,) bool."""
        base, sides = 1 + max(int(names.max(initial=0)) for names in (self.seen, pairs)), self.seen[self.parted]
        between = np.bincount(sides.reshape(-1), minlength=base)
        known, times = np.unique(edge_keys(sides, base), return_counts=True)
        times = np.append(times, 0)[rows_of(edge_keys(pairs, base), known)]
        return times > _ACROSS * between[pairs].min(axis=1)

    def of_seen(self) -> "np.ndarray | Blocks":
        """The labels, 0 for regions that no sample sees."""
        times = np.bincount(self.seen.reshape(-1))
        name = np.where(times > 0, np.arange(len(times)), 0).astype(np.int32)
        return each(lambda label: np.where(label < len(name), name.take(label, mode="clip"), 0), self.labels)


@dataclass(frozen=True)
class _Field:
    """Distances at the nodes of a grid from a surface."""

    values: np.ndarray | Blocks
    surface: LocalSurface
    grid: Grid

    @property
    def cut_off(self) -> float:
        """The distance at which all larger ones are: that of the band's edge; inf in a whole box."""
        return np.inf if isinstance(self.values, np.ndarray) else float(self.values.outer.max())

    def halved(self) -> "_Field":
        """Every other node; in Blocks all of them."""
        if isinstance(self.values, Blocks):
            return self
        values = self.values[::2, ::2, ::2]
        return _Field(values, self.surface, Grid(self.grid.origin, 2 * self.grid.spacing, values.shape))

    def regions(self, level: float) -> _Regions:
        labels, _ = regions(each(lambda u: u > np.float32(level), self.values))
        return _Regions(level, labels, regions_beside(labels, self.surface, level, self.grid))

    def first(self, levels, apart) -> _Regions:
        """The regions at the first level at which they are `apart`, or at the last."""
        for level in levels:
            found = self.regions(level)
            if apart(found):
                break
        return found

    def grown(self, apart: _Regions, level: float) -> _Regions:
        """The regions grown down to a lower level, over nodes far from the surface first."""
        labels, ahead = apart.of_seen(), node_strides(self.grid.shape)
        strides = np.concatenate([ahead, -ahead])
        free = self._nodes(level, np.inf, labels, False)
        away, before = at_nodes(self.values, free), np.inf
        for floor in [*np.arange(apart.level, level, -_ROUND * self.grid.spacing)[1:], level]:
            now = free[(away > floor) & (away <= before)]
            found, before = np.zeros(len(now), np.int32), floor
            for stride in strides:
                found = np.where(found > 0, found, at_nodes(labels, now + stride))
            put(labels, now, np.where(found > 0, found, _WAITING))
            fresh = now[found > 0]
            while len(fresh):
                own, reached = at_nodes(labels, fresh), []
                for stride in strides:
                    there = fresh - stride
                    waits = at_nodes(labels, there) == _WAITING
                    put(labels, there[waits], own[waits])
                    reached.append(there[waits])
                fresh = np.concatenate(reached)
        labels = each(lambda label: np.maximum(label, 0), labels)
        return _Regions(level, labels, regions_beside(labels, self.surface, level, self.grid))

    def meetings(self, grown: _Regions, farthest: float) -> np.ndarray:
        """Edges of the grid by which regions that are the two sides of the surface meet, up to `farthest` from it: flat
        indices of their ends, (2,m). In places no wider than the bridging length, with samples around that lie between
        two regions."""
        node = self._nodes(grown.level, farthest + self.grid.spacing, grown.labels, True)
        here, ends = at_nodes(grown.labels, node), []
        for stride in node_strides(self.grid.shape):
            there = at_nodes(grown.labels, node + stride)
            meet = node[(there > 0) & (there != here)]
            ends.append(np.stack([meet, meet + stride]))
        ends = np.concatenate(ends, axis=1)
        ends = ends[:, grown.across(at_nodes(grown.labels, ends).T)]
        if not ends.size:
            return ends
        middle = _middle(ends, self.grid)
        sample = np.flatnonzero(grown.both)
        around = sample[k_nearest(KDTree(self.surface.points[sample]), middle, _AROUND, workers=-1)[1]]
        radius = at_nodes(self.values, ends).max(axis=0) / np.median(self.surface.spacing[around], axis=1)
        place = near_parts(middle, ADJACENT * self.grid.spacing)
        widest = np.zeros(place.max() + 1)
        np.maximum.at(widest, place, radius)
        parted = np.bincount(place, grown.parted[around].mean(axis=1)) / np.bincount(place)
        return ends[:, ((widest <= 0.5 * self.surface.bridge) & (parted >= _MOST))[place]]

    def _nodes(self, low, high, labels, labelled):
        """Flat indices of the nodes off the sides of the box that are farther than `low`, up to `high`, and have a
        label or not."""
        low, high = np.float32(low), np.float32(high)
        chosen = each(lambda u, label: (u > low) & (u <= high) & ((label > 0) == labelled), self.values, labels)
        return marked_nodes(each(np.logical_and, chosen, inner_nodes(chosen)))


def _middle(ends, grid):
    """Middles (m,3) of edges between nodes (2,m)."""
    return 0.5 * sum(grid.positions(end) for end in ends)


def lower_around(places: np.ndarray, near: np.ndarray | Blocks, grid: Grid, level: float) -> None:
    """Lower distances `near`, (nx,ny,nz) float32 or Blocks, in place, to those to the places (m,3), up to two cells
    beyond a level, float; in Blocks those that are stored."""
    if not len(places):
        return
    tree, reach = KDTree(places), level + _MARGIN * grid.spacing
    corner = block_corners(near)
    room = reach + HALF * (SIDE - 1) * grid.spacing
    away = tree.query(middles_of(grid, corner, SIDE), distance_upper_bound=room, workers=-1)[0]
    corner = corner[np.isfinite(away)]
    within = np.indices((SIDE,) * 3).reshape(3, -1).T

    def lower(part):
        cells = (corner[part, None] + within).reshape(-1, 3)
        cells = cells[(cells < grid.shape).all(axis=1)]
        node = np.ravel_multi_index(cells.T, grid.shape)
        away = tree.query(grid.positions(node), distance_upper_bound=reach)[0]
        put(near, node, np.minimum(at_nodes(near, node), away.astype(np.float32)))

    over_rows(lower, len(corner), _BLOCKS)
