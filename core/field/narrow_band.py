"""The distance field of a narrow band: evaluated near the surface alone, so that its cost grows with the surface, not
with the box.

Blocks, then groups of 4^3 and of 2^3 nodes are left out where their nearest sample is too far for the surface to come
near; of what remains the distance next to the surface is the projection's, and further out that to the feet of the
nodes there, both as in the whole box (see :mod:`.integration`).
"""

from dataclasses import fields

import numpy as np

from ..progress import Progress
from .blocks import SIDE, Blocks, blocks_of, table_shape
from .feet import Feet, no_farther_than_feet, settled_feet
from .grid import CORNERS, Grid
from .integration import BAND
from .local_surface import LocalSurface, Projection
from .near_nodes import sample_reach
from .projection import FROM_NODES
from .steps import NearBand

_HALF = 0.5 * np.sqrt(3)  # cells, from the middle of a group of 2^3 nodes to each of them
_MARGIN = 1.0  # cells, by which a projection may err in leaving a group out
_ERROR = 0.05  # the same around sparse samples, relative to how far their patches reach
_SPARSE = 4.0  # sides of a group; patches that reach further are sparse
_PIECE = 1 << 17  # nodes or groups at a time


def banded_field(surface: LocalSurface, grid: Grid, width: float, progress=None) -> tuple[Blocks, NearBand, Feet]:
    """Unsigned distance at the nodes within `width` cells of the surface, float32, in the units of the samples; the
    others have the value of that width. Also the nodes in which it is known with its direction, and the feet of those
    close to the surface.

    No array of the grid's size is made but a table of its blocks.
    """
    progress = Progress.of(progress)
    corner, sample = _groups(surface, grid, width, progress.part(0.0, 0.1))
    node, near = _projected(surface, grid, corner, sample, progress.part(0.1, 0.6))
    feet = _feet(surface, grid, node, near, progress.part(0.6, 0.75))
    values = _around(surface, grid, width, corner, sample, feet, progress.part(0.75, 1.0))
    values.put(node, no_farther_than_feet(near.distance, values.at(node), grid))
    return values.merged(), NearBand(grid.shape, node, near.step, near.past_rim, near.sample), feet


def trimmed(values: Blocks, band: float) -> Blocks:
    """Distances, signed or not, cut off at a narrower band."""
    limit = np.float32(band)
    return values.map(lambda u: np.clip(u, -limit, limit)).merged()


def _groups(surface, grid, width, progress):
    """Groups of 2^3 nodes that may lie within the width: indices (i,j,k) of their lowest nodes, (g,3) int32, and the
    sample nearest to their middle, (g,) int32. Around sparse samples, which would claim all nodes as far as their
    patches reach, larger groups are projected onto the surface first."""
    block, reach = _blocks(surface, grid, width)
    corner = SIDE * np.stack(np.unravel_index(block, table_shape(grid.shape)), axis=1).astype(np.int32)
    found = []
    for rows in progress.chunks(len(block), _PIECE // 64):
        part, far = corner[rows], reach[rows]
        for side in (SIDE, 4, 2):
            if side < SIDE:
                part = (part[:, None] + side * CORNERS.astype(np.int32)).reshape(-1, 3)
                far = np.repeat(far, 8)
            middle = _middles(grid, part, side)
            distance, sample = surface.tree.query(middle, workers=-1)
            kept = distance <= grid.spacing * (width + far + _HALF * (side - 1))
            wide = np.flatnonzero(kept & (far > _SPARSE * side)) if side > 2 else []
            room = width + _HALF * (side - 1) + _MARGIN + _ERROR * far[wide]
            kept[wide] = surface.project(middle[wide]).distance <= grid.spacing * room
            part, far, sample = part[kept], far[kept], sample[kept]
        inside = (part < grid.shape).all(axis=1)
        found.append((part[inside], sample[inside].astype(np.int32)))
    return tuple(np.concatenate(parts) for parts in zip(*found, strict=True))


def _blocks(surface, grid, width):
    """Flat indices, ascending, of the blocks with nodes that may lie within the width of the patch of their nearest
    sample, and how far the patches of the samples reach that may be nearest there, cells."""
    table = np.array(table_shape(grid.shape))
    reach = sample_reach(surface) / grid.spacing
    home = np.floor((surface.points - grid.origin) / (SIDE * grid.spacing)).astype(np.int64)
    home, row = np.unique(np.ravel_multi_index(tuple(home.T), tuple(table)), return_inverse=True)
    farthest = np.zeros(len(home))
    np.maximum.at(farthest, row.reshape(-1), reach)
    home = np.stack(np.unravel_index(home, tuple(table)), axis=1)
    found = np.zeros(tuple(table), np.float32)
    steps = np.ceil((width + farthest) / SIDE).astype(int)
    for step in np.unique(steps):
        span = np.arange(-step - 1, step + 2)
        offset = np.stack(np.meshgrid(span, span, span, indexing="ij"), axis=-1).reshape(-1, 3)
        offset = offset[np.linalg.norm(np.maximum(np.abs(offset) - 1, 0), axis=1) <= step]
        chosen = np.flatnonzero(steps == step)
        for some in np.array_split(chosen, max(1, len(chosen) * len(offset) // _PIECE)):
            there = home[some, None] + offset
            fits = ((there >= 0) & (there < table)).all(axis=2)
            at = np.ravel_multi_index(tuple(there[fits].T), tuple(table))
            np.maximum.at(found.reshape(-1), at, np.repeat(farthest[some].astype(np.float32), fits.sum(axis=1)))
    block = np.flatnonzero(found)
    return block, found.flat[block]


def _projected(surface, grid, corner, sample, progress):
    """The nodes within BAND of the surface, ascending, and where they fall on it. Groups whose middle is farther than
    the rest of its nodes could make up for are left out first."""
    reach = sample_reach(surface)
    found = []
    for rows, turn in _pieces(progress, len(corner)):
        part, own = corner[rows], sample[rows]
        middle = _middles(grid, part, 2)
        away = np.linalg.norm(middle - surface.points[own], axis=1)
        near = away <= reach[own] + grid.spacing * (BAND + 2 * _HALF)
        part, middle = part[near], middle[near]
        part = part[surface.project(middle, turn.part(0, 0.2)).distance <= grid.spacing * (BAND + _HALF + _MARGIN)]
        node = _members(grid, part)[0]
        projection = surface.project(grid.positions(node), turn.part(0.2, 1), FROM_NODES)
        inside = projection.distance <= BAND * grid.spacing
        found.append((node[inside], projection[inside]))
    node = np.concatenate([node for node, _ in found])
    order = np.argsort(node)
    parts = ([getattr(near, field.name) for _, near in found] for field in fields(Projection))
    return node[order], Projection(*(np.concatenate(each)[order] for each in parts))


def _feet(surface, grid, node, near, progress):
    found = [
        settled_feet(surface, grid, node[rows], near[rows], turn)[1] for rows, turn in _pieces(progress, len(node))
    ]
    return Feet(
        *(np.concatenate([getattr(feet, name) for feet in found], axis=-1) for name in ("centres", "normals", "radius"))
    )


def _around(surface, grid, width, corner, sample, feet, progress):
    """Distances to the feet at the members of the groups, never beyond that to the sample at their middle."""
    table = table_shape(grid.shape)
    background = np.float32(width * grid.spacing)
    block = np.unique(np.ravel_multi_index(tuple((corner // SIDE).T), table))
    values = blocks_of(grid.shape, block, background)
    for rows in progress.chunks(len(corner), _PIECE // 4):
        part, own = corner[rows], sample[rows]
        away = np.linalg.norm(_middles(grid, part, 2) - surface.points[own], axis=1)
        foot, _ = feet.tree.query(_middles(grid, part, 2), workers=-1)
        found = np.minimum(away, foot) <= (width + 2 * _HALF) * grid.spacing
        node, group = _members(grid, part[found])
        x = grid.positions(node)
        to_sample = np.linalg.norm(x - surface.points[own[found][group]], axis=1)
        values.put(node, np.minimum(np.minimum(to_sample, feet.distances(x)), background))
    return values


def _pieces(progress, count):
    """Slices that cover `count` rows in order, and the part of the progress that each takes."""
    for first in range(0, count, _PIECE):
        yield slice(first, first + _PIECE), progress.part(first / count, min(first + _PIECE, count) / count)


def _middles(grid, corner, side):
    """Positions of the middles of groups of `side`^3 nodes with lowest nodes (g,3)."""
    return grid.origin + grid.spacing * (corner + 0.5 * (side - 1))


def _members(grid, corner):
    """Nodes of the grid in groups of 2^3 with lowest nodes (g,3): flat indices, and which group each is in."""
    at = corner[:, None].astype(np.int64) + CORNERS
    fits = (at < np.array(grid.shape)).all(axis=2)
    return np.ravel_multi_index(tuple(at[fits].T), grid.shape), np.repeat(np.arange(len(corner)), fits.sum(axis=1))
