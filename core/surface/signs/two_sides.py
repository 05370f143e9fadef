"""The two sides of a surface that bounds no inside: an open sheet's, or those of sheets that pass through each other.

The samples are oriented so that the nodes around them agree, as the paper's appendix does for closed shapes, with
votes of the grid's edges in place of an outside: nodes that no crossing parts are on one side, nodes of a crossed edge
on two. As in :mod:`.sides` the least frustrated state is wanted (Kunegis et al., SDM 2010), here without a node whose
side is known, so it is the first eigenvector of the signed Laplacian, by inverse iteration from the orientations that
the surest votes give along a spanning tree.

In the wedges of sharp folds votes are often wrong. Where there are no sides, nodes there are told by the planes of both
sheets, and the sides are looked for once more.

A one-sided surface has no such state, nor have three sheets that meet in a line. There the votes that are overruled
form a patch as long as the sheet is wide, or one that parts the surface around it.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ...field.blocks import Blocks, each, put
from ...field.grid import ADJACENT, Grid
from ...field.local_surface import LocalSurface
from ...field.steps import NearBand
from ...linalg import conjugate_gradients, row_dots, symmetric
from ...lookup import grouped, is_among, mask_of, numbered
from ...parallel import over_rows
from ...parts import extents, near_parts
from ...progress import Progress
from ...trees import k_nearest
from ..edges.crossings import Crossings
from .spreading import spread_strongest

_NEAR_FOLD = 24  # samples around a place, among which the other sheet of a fold is looked for
_SHARP, _FOLD = -0.1, 0.9  # cosines between normals into the wedge of a sharp fold, and size of those of others
_CHUNK = 1 << 13  # places
_BEYOND = 3.0  # cells, distance that nodes out of the band count as
_ITERATIONS, _STEPS, _TOLERANCE, _SHIFT = 6, 300, 0.03, 1e-3
_SETTLED = 1e-3  # of the samples, that still change sides when no iteration follows; sweeps see to those
_SWEEPS = 12
_LEAST = 0.1  # cells, least distance of nodes past a rim from the sheet continued
_MOST = 0.02  # of the votes, more overruled ones mean that there are no two sides
_SHORT = 2.0  # cells, shorter patches do not count
LONG = 1 / 6  # of the grid's longest side; a longer patch is no chance, but means that there are no two sides
_STRIP = 400  # crossings for each squared cell of length; a patch parts a strip no longer for its width than this
_CUT, _RING = 2, 6  # nodes around a patch that are taken out, and up to which the surface is looked at
_PART = 0.25  # of that ring, what counts as a part of it


def two_sided(
    values: np.ndarray | Blocks,
    band: NearBand,
    crossings: Crossings,
    surface: LocalSurface,
    grid: Grid,
    progress: Progress,
) -> np.ndarray | Blocks | None:
    """Signed distances within two cells of the surface, negative on one side of it, with every sheet continued past its
    rims; None where the surface has no two sides.

    values : (nx,ny,nz) float32 or Blocks, unsigned distances; the result is alike
    """
    sample, height = _heights(band, surface, grid)
    votes, progress = _votes(band, crossings), progress.part(0.1, 1.0)
    side = _agreed_sides(votes, sample, height, band, grid, progress.part(0.0, 0.5))
    if side is None and not crossings.normal.any():
        folds = _Folds.of(surface, sample, grid.positions(band.node))
        if folds.toward.any():
            votes, height = folds.votes(votes), folds.heights(height)
            side = _agreed_sides(votes, sample, height, band, grid, progress.part(0.5, 1.0))
    if side is None:
        return None
    continued = np.maximum(np.abs(height), _LEAST * grid.spacing)
    off = np.where(band.past_rim, continued, np.linalg.norm(band.step, axis=1))
    signed = each(lambda u: np.full_like(u, _BEYOND * grid.spacing), values)
    put(signed, band.node, (side * off).astype(np.float32))
    return signed


@dataclass(frozen=True)
class _Votes:
    """Edges between nodes of the band, by their rows `low` and `high`, (e,), and what they say, (e,): -1 where the
    surface crosses them, 1 where it does not, and half of that past its rims, where the sheet continued may cross."""

    low: np.ndarray
    high: np.ndarray
    sign: np.ndarray

    def sure(self) -> "_Votes":
        """Those that are not past a rim."""
        chosen = np.abs(self.sign) == 1
        return _Votes(self.low[chosen], self.high[chosen], self.sign[chosen])

    def matrix(self, n) -> csr_matrix:
        return symmetric(self.sign, self.low, self.high, n)


@dataclass(frozen=True)
class _Folds:
    """Nodes of the band beside sharp folds. In the wedge of one the steps to nodes turn from one sheet to the other,
    and cells cannot tell which edges are crossed; beyond it sheets do not go on.

    toward : (b,), to which side of the node's sheet the other one turns, -1 or 1; 0 for other nodes
    inside : (b,) bool, nodes in the wedge
    """

    toward: np.ndarray
    inside: np.ndarray

    @classmethod
    def of(cls, surface: LocalSurface, sample: np.ndarray, x: np.ndarray) -> "_Folds":
        """Those among nodes that are at x (b,3) and go with samples (b,)."""
        toward, inside = np.zeros(len(x)), np.zeros(len(x), bool)
        node = np.flatnonzero(_in_wedges(surface, np.arange(surface.tree.n), surface.points)[0][sample])
        toward[node], inside[node] = _in_wedges(surface, sample[node], x[node])
        return cls(toward, inside)

    def votes(self, votes: _Votes) -> _Votes:
        """Others between such nodes: they are on one side if both are in the wedge, or none."""
        alike = np.where(self.inside[votes.low] == self.inside[votes.high], 1.0, -1.0) * np.abs(votes.sign)
        both = (self.toward[votes.low] != 0) & (self.toward[votes.high] != 0)
        return replace(votes, sign=np.where(both, alike, votes.sign))

    def heights(self, height: np.ndarray) -> np.ndarray:
        """Heights (b,) over the nodes' sheets with the signs that they have then."""
        return np.where(self.toward != 0, np.where(self.inside, self.toward, -self.toward) * np.abs(height), height)


def _in_wedges(surface, sample, x):
    """For places (m,3) that go with some samples (m,): near a sharp fold, to which side of the sample's sheet another
    one turns, (m,) of -1 and 1, 0 elsewhere; and whether they are in its wedge, beside either sheet where the other one
    is, (m,) bool."""
    toward, inside = np.empty(len(x)), np.empty(len(x), bool)

    def look(part):
        toward[part], inside[part] = _in_wedge(surface, sample[part], x[part])

    over_rows(look, len(x), _CHUNK)
    return toward, inside


def _in_wedge(surface, sample, x):
    near = k_nearest(surface.tree, x, _NEAR_FOLD)[1]
    own, theirs = surface.normals[sample, None], surface.normals[near]
    step = surface.points[near] - surface.points[sample, None]
    towards, back = np.sign(row_dots(step, own)), np.sign(-row_dots(step, theirs))
    cosine = row_dots(own, theirs)
    sharp = (towards * back * cosine < _SHARP) & (np.abs(cosine) < _FOLD)
    at = np.arange(len(sample)), sharp.argmax(axis=1)
    height = row_dots(x - surface.points[sample], own[:, 0]) * towards[at]
    other = row_dots(x - surface.points[near[at]], theirs[at]) * back[at]
    return np.where(sharp[at], towards[at], 0.0), (height > 0) & (other > 0)


def _votes(band, crossings):
    edges = [band.edges(axis) for axis in range(3)]
    key = np.concatenate([3 * band.node[low] + axis for axis, (low, _) in enumerate(edges)])
    low, high = np.concatenate(edges, axis=1)
    crossed = is_among(key, crossings.changing_sides)
    past_rim = band.past_rim[low] | band.past_rim[high]
    return _Votes(low, high, np.where(crossed, -1.0, np.where(past_rim, 0.5, 1.0)))


def _heights(band, surface, grid):
    """The sample that each node of the band goes with, (b,), the nearest of those that nodes off the rims go with, and
    how far the node is off the surface to the side that the sample's normal shows, (b,); past rims, off its plane."""
    sample, step, past = band.sample.astype(np.int64), band.step.copy(), np.flatnonzero(band.past_rim)
    seen = np.bincount(sample[~band.past_rim], minlength=surface.tree.n) > 0
    seen = np.flatnonzero(seen if seen.any() else ~seen)
    x = grid.positions(band.node[past])
    sample[past] = seen[KDTree(surface.points[seen]).query(x, workers=-1)[1]]
    step[past] = x - surface.points[sample[past]]
    return sample, row_dots(step, surface.normals[sample])


def _agreed_sides(votes, sample, height, band, grid, progress):
    """Sides of the nodes of the band, (b,) of -1 and 1; None where too many votes are overruled."""
    sure = votes.sure()
    side = _sides_of_nodes(votes, sure, sample, height, progress.part(0.0, 0.8))
    return side if _agree(sure, side, band, grid, progress.part(0.8, 1.0)) else None


def _sides_of_nodes(votes, sure, sample, height, progress):
    """Sides of the nodes of the band, (b,) of -1 and 1, from samples oriented alike, then swept over the nodes."""
    of, number = numbered(sample)
    weight = sure.sign * height[sure.low] * height[sure.high]
    low, high = number[sure.low], number[sure.high]
    apart = low != high
    links = symmetric(weight[apart], low[apart], high[apart], len(of))
    links.eliminate_zeros()
    facing = _orientations(links, progress.part(0.0, 0.8))
    side = np.sign(facing)[number] * height
    side /= max(np.abs(side).max(initial=0.0), np.finfo(float).tiny)
    matrix = votes.matrix(len(side))
    degree = np.maximum(np.diff(matrix.indptr), 1)
    for _ in progress.part(0.8, 1.0).each(range(_SWEEPS)):
        side = 0.5 * (side + matrix @ np.sign(side) / degree)
    return np.where(side < 0, -1.0, 1.0)


def _orientations(links, progress):
    """The vector (m,) that differs least along links of positive weight, and least from its negative along links of
    negative weight, (m,m) sparse and symmetric; in each connected part."""
    strength = abs(links)
    degree = np.asarray(strength.sum(axis=1)).reshape(-1)
    facing, part = spread_strongest(links)
    size = np.bincount(part)
    shift = _SHIFT * np.median(degree[degree > 0]) if links.nnz else 1.0
    scale = degree + shift
    for _, turn in progress.turns(range(_ITERATIONS)):
        before, steps = facing > 0, turn.each(range(_STEPS))
        facing = conjugate_gradients(
            lambda x: scale * x - links @ x, shift * facing, facing, lambda x: x / scale, _TOLERANCE, steps
        )
        length = np.sqrt(np.bincount(part, facing**2) / size)
        facing = np.clip(facing / np.maximum(length, np.finfo(float).tiny)[part], -1, 1)
        if ((facing > 0) != before).mean() <= _SETTLED:
            break
    return facing


def _agree(votes, side, band, grid, progress):
    """Whether the votes that `side` overrules are few, of short patches that do not part the surface around them."""
    overruled = votes.sign * side[votes.low] * side[votes.high] < 0
    if not overruled.any():
        return True
    if overruled.mean() > _MOST:
        return False
    low, high = votes.low[overruled], votes.high[overruled]
    middle = 0.5 * (grid.positions(band.node[low]) + grid.positions(band.node[high]))
    patch = near_parts(middle, ADJACENT * grid.spacing)
    length = extents(patch, middle) / grid.spacing
    if length.max() > LONG * max(grid.shape):
        return False

    order, first = grouped(patch)
    graph = abs(votes.matrix(len(side)))
    part = connected_components(graph, directed=False)[1]
    crossed = np.bincount(part[votes.low], votes.sign < 0)[part[low[order[first]]]]
    ends = np.split(np.stack([low, high], axis=1)[order], first[1:])
    narrow = np.flatnonzero((length > _SHORT) & (_STRIP * length**2 > crossed))
    return not any(_parted(graph, ends[number].reshape(-1)) for number in progress.each(narrow))


def _parted(graph, row):
    """Whether the nodes around those of some rows are in several parts, once these and the next are taken out."""
    reached = mask_of(row, graph.shape[0])
    for step in range(_RING):
        if step == _CUT:
            cut = reached
        reached = reached | (graph @ reached > 0)
    ring = np.flatnonzero(reached & ~cut)
    size = np.bincount(connected_components(graph[ring][:, ring], directed=False)[1], minlength=1)
    return (size > _PART * len(ring)).sum() > 1
