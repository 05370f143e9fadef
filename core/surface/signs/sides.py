"""Which nodes of the grid lie inside a closed shape.

The paper's appendix orients the samples, by spreading an outside label from the box through the Voronoi vertices. Here
the label spreads over the grid, where each node decides with all its neighbours: Voronoi vertices close to the surface
(slivers, creases, noise) take either side, and one that errs misleads every sample after it.

Nodes far from the surface fall into regions, of which the one at the box is outside. Between them, the side s of each
node minimises the sum of (s_a - s_b)^2 over grid edges that do not cross the surface and of (s_a + s_b)^2 over those
that do (the least frustrated state of a signed graph; Kunegis et al., SDM 2010). Farther than 1.5 cells from the
surface, where it crosses no edge, the nodes of a group of 2^3 share their side. Nested shells so get alternating sides:
a hollow ball is inside between its walls, and outside within. Where the outside lies on both sides of most samples, as
around an open sheet, no side need be asked: nothing is inside.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.sparse import csr_matrix

from ...field.blocks import Blocks, at_nodes, counts, each, inner_nodes, marked_nodes, put, regions
from ...field.grid import ADJACENT, Grid, node_strides
from ...field.local_surface import LocalSurface
from ...linalg import conjugate_gradients, symmetric
from ...lookup import numbered
from ...parallel import side_by_side
from ...parts import near_parts
from ...progress import Progress
from ..edges.crossings import Crossings
from .wedges import at_wedges

_NEAREST, _FARTHEST = 1.0, 6.0  # cells; regions start at half the bridging length within these limits
_BESIDE = 1.5  # cells, that distances differ by from node to node at most, with a margin
_OFF = 0.7  # cells beyond the distance where regions start, at which samples look for them
_ALONE = 1.5  # cells from the surface, where no edge is crossed any more: nodes farther off share their sides
_OUTSIDE = 0.5  # share of the samples with the outside on both sides, above which nothing is inside
_SPECK = 27  # nodes
_HELD = 0.1  # of the nodes on one side, those of specks between sheets side by side, at most; more make no side
_TOLERANCE, _STEPS = 1e-2, 1000
_OPEN = 0.05  # share of crossings, or of samples, with one side at both ends that a closed shape may have
_PATCH = 0.02  # relative to all crossings, the largest flap or spanned opening that does not count


@dataclass(frozen=True)
class Sides:
    """The inside, and the crossings that contradict it.

    inside    : (nx,ny,nz) bool, or Blocks of it
    alike     : (w,3) float64, middles of crossed edges with both ends on one side: of flaps, of inner walls, of all of
                an open surface
    within    : (w,) bool, whether that side is the inside
    wedges    : (v,3) float64, middles of others, where two walls run so close that no node lies between them
    gaps      : (g,3) float64, middles of edges where the sides differ and no crossing is: openings
    crossings : int, number of crossed edges     grid : Grid of the nodes
    """

    inside: np.ndarray | Blocks
    alike: np.ndarray
    within: np.ndarray
    wedges: np.ndarray
    gaps: np.ndarray
    crossings: int
    grid: Grid

    @property
    def share(self) -> float:
        """Share of the crossings that have one side at both ends, those of wedges aside."""
        return len(self.alike) / max(self.crossings, 1)

    @property
    def spanned(self) -> float:
        """Number of edges that span openings, relative to all crossings."""
        return len(self.gaps) / max(self.crossings, 1)

    @cached_property
    def largest(self) -> float:
        """The largest connected patch of either, relative to all crossings."""
        reach = ADJACENT * self.grid.spacing
        most = max(np.bincount(near_parts(middle, reach)).max(initial=0) for middle in (self.alike, self.gaps))
        return most / max(self.crossings, 1)

    @property
    def closed(self) -> bool:
        """Whether the surface bounds the inside, but for small parts."""
        return self.share <= _OPEN

    @property
    def complete(self) -> bool:
        """Whether what bounds the inside is the surface and nothing else, but for specks."""
        return self.closed and self.largest <= _PATCH

    def sign(self, values: np.ndarray | Blocks) -> np.ndarray | Blocks:
        """Distances (nx,ny,nz) with their signs: negative inside."""
        return each(lambda inside, u: np.where(inside, -u, u), self.inside, values)


def find_sides(values, crossings: Crossings, surface: LocalSurface, grid: Grid, progress=None, far=None) -> Sides:
    """Sides of all nodes, from their unsigned distances `values` (nx,ny,nz) float32, or Blocks of a band wider than
    :func:`needed_band`, the crossed grid edges, and what :func:`far_regions` finds where that is known already.

    Openings narrower than the bridging length (but 12 cells) are spanned, by the fewest edges. Of a surface with the
    outside on both sides of most samples every crossing has one side at both ends. Raises :class:`InputError` for
    distances of another grid or one that does not hold the surface.
    """
    grid.check(surface.points, np.shape(values))
    progress = Progress.of(progress)
    near, labels, count = far or far_regions(values, surface, grid)
    outside = _outside(labels)
    if _is_open(labels, surface, grid):
        low, axis = np.divmod(crossings.changing_sides, 3)
        edges = [_Edges(low[axis == a], a, np.ones((axis == a).sum(), bool), grid) for a in range(3)]
        return _judged(each(np.zeros_like, near), edges, crossings.meetings.passing, surface)
    node = marked_nodes(near)
    number, n = _numbered(node, at_nodes(values, node) <= _ALONE * grid.spacing, grid)
    cluster = each(lambda label: label.astype(np.int32) - 1, labels)
    put(cluster, node, count + number)
    progress(0.1)
    edges = [_edges_along(axis, node, near, crossings, grid) for axis in range(3)]
    progress(0.2)
    joined = ((at_nodes(cluster, along.low), at_nodes(cluster, along.high), along.crossed) for along in edges)
    side = _sides(joined, count + n, outside - 1, progress) < 0
    progress(0.7)
    inside = _without_specks(each(lambda c: side[c] & (c >= 0), cluster), crossings.meetings.beside, surface, grid)
    progress(0.9)
    return _judged(inside, edges, crossings.meetings.passing, surface)


def may_be_closed(values, surface: LocalSurface, grid: Grid) -> bool:
    """Whether the sides of :func:`find_sides`, from the same distances, may be closed: not where many of the samples
    that have regions on both sides have one region there. On shapes that are closed it is less than 1 % of them."""
    one, other = _seen(far_regions(values, surface, grid)[1], surface, grid).T
    both = (one > 0) & (other > 0)
    return (both & (one == other)).sum() <= _OPEN * both.sum()


def far_regions(values, surface: LocalSurface, grid: Grid) -> tuple:
    """Which nodes are near the surface and off the sides of the box, the regions of the others, and their number."""
    limit = np.float32(_far(surface, grid) * grid.spacing)
    near = each(lambda u, inner: inner & (u <= limit), values, inner_nodes(values))
    return near, *regions(each(np.logical_not, near))


def _outside(labels):
    """The region at the box."""
    return int(at_nodes(labels, np.array([0]))[0])


def _is_open(labels, surface, grid):
    return (_seen(labels, surface, grid) == _outside(labels)).all(axis=1).mean() > _OUTSIDE


def _seen(labels, surface, grid):
    """The regions of :func:`far_regions` on either side of each sample, (n,2); 0 where there is none."""
    return regions_beside(labels, surface, _far(surface, grid) * grid.spacing, grid)


def regions_beside(labels, surface: LocalSurface, level: float, grid: Grid) -> np.ndarray:
    """The regions on either side of each sample, (n,2) int64, from the `labels` (nx,ny,nz) or Blocks of the nodes that
    are farther than a `level` from the surface; 0 where there is none."""
    points, normals = surface.points, surface.normals
    beside = np.zeros((len(points), 2), np.int64)
    for side, sign in enumerate((-1, 1)):
        cells = (points + sign * (level + _OFF * grid.spacing) * normals - grid.origin) / grid.spacing
        cells = np.rint(cells).astype(np.int64)
        inside = np.flatnonzero(((cells >= 0) & (cells < grid.shape)).all(axis=1))
        beside[inside, side] = at_nodes(labels, np.ravel_multi_index(cells[inside].T, grid.shape))
    return beside


def needed_band(surface: LocalSurface, grid: Grid) -> float:
    """Cells from the surface up to which :func:`find_sides` needs distances."""
    return _far(surface, grid) + _BESIDE


def _far(surface, grid):
    """Cells from the surface where regions start."""
    far = 0.5 * surface.bridge * surface.spacing_in_cells(grid)
    return float(np.clip(far, _NEAREST, _FARTHEST))


@dataclass(frozen=True)
class _Edges:
    """Grid edges along one axis.

    low : (e,) int64, flat indices of their lower ends     crossed : (e,) bool, whether the surface crosses them
    """

    low: np.ndarray
    axis: int
    crossed: np.ndarray
    grid: Grid

    @property
    def high(self) -> np.ndarray:
        """(e,) int64, flat indices of the upper ends."""
        return self.low + node_strides(self.grid.shape)[self.axis]

    def middles(self, chosen: np.ndarray) -> np.ndarray:
        """Positions of the middles of those marked in `chosen` (e,), (m,3)."""
        return self.grid.positions(self.low[chosen]) + 0.5 * self.grid.spacing * np.eye(3)[self.axis]


def _edges_along(axis, node, near, crossings, grid):
    """The edges along an axis with an end among the nodes, those marked in `near`, none of which lies on the side of
    the box."""
    below = node - node_strides(grid.shape)[axis]
    low = np.concatenate([node, below[~at_nodes(near, below)]])
    changing, along = np.divmod(crossings.changing_sides, 3)
    crossed = each(np.zeros_like, near)
    put(crossed, changing[along == axis], True)
    return _Edges(low, axis, at_nodes(crossed, low), grid)


def _judged(inside, edges, passing, surface):
    """The sides, with the edges that contradict them, from those along each axis; see :func:`at_wedges`."""
    same, within, parting, gaps = [], [], [], []
    for along in edges:
        low = at_nodes(inside, along.low)
        differ = low != at_nodes(inside, along.high)
        alike = along.crossed & ~differ
        same.append(along.middles(alike))
        within.append(low[alike])
        parting.append(along.middles(along.crossed & differ))
        gaps.append(along.middles(~along.crossed & differ))
    same, within, parting, gaps = (np.concatenate(parts) for parts in (same, within, parting, gaps))
    grid, crossed, wedge = edges[0].grid, len(same) + len(parting), ~within
    wedge[wedge] = at_wedges(same[wedge], parting, passing, surface, grid.spacing)
    return Sides(inside, same[~wedge], within[~wedge], same[wedge], gaps, crossed, grid)


def _numbered(node, alone, grid):
    """Which unknown each node is, (b,) int64, and how many there are: one for each of the nodes marked in `alone` and
    for each group of 2^3 of the others."""
    at = np.stack(np.unravel_index(node[~alone], grid.shape)) // 2
    group, row = numbered(np.ravel_multi_index(tuple(at), grid.shape))
    number, n = np.empty(len(node), np.int64), int(alone.sum())
    number[alone] = np.arange(n)
    number[~alone] = n + row
    return number, n + len(group)


def _sides(edges: Iterable, n, outside, progress):
    """The side of each of n clusters in [-1,1], float32, from edges between them, parts of (a, b, crossed), (e,) each;
    cluster `outside` is 1."""
    links, push, degree = csr_matrix((n, n), dtype=np.float32), np.zeros(n, np.float32), np.zeros(n, np.float32)
    for a, b, crossed in edges:
        kept = a != b
        a, b, weight = a[kept], b[kept], np.where(crossed[kept], np.float32(-1.0), np.float32(1.0))
        degree += np.bincount(a, minlength=n) + np.bincount(b, minlength=n)
        free = (a != outside) & (b != outside)
        links += symmetric(weight[free], a[free], b[free], n)
        push += np.bincount((a + b - outside)[~free], weight[~free], n)
    progress(0.3)
    steps = progress.part(0.4, 0.7).each(range(_STEPS))
    scale = np.maximum(degree, np.float32(1.0))
    start = np.zeros_like(push)
    side = conjugate_gradients(
        lambda x: degree * x - links @ x, push, start, lambda residual: residual / scale, _TOLERANCE, steps
    )
    side[outside] = 1
    return side


def _without_specks(inside, beside, surface, grid):
    """The inside with specks turned over: connected sets of less than _SPECK nodes on one side. Those with a node whose
    nearest sample is marked in `beside` (n,) stay, if they are few of the nodes on their side: thin walls and slits
    hold no more."""
    within, without = side_by_side(partial(_parts, inside), partial(_parts, each(np.logical_not, inside)))
    filled = _turned(inside, within, beside, surface, grid)
    if filled is not inside:
        without = _parts(each(np.logical_not, filled))
    return _turned(filled, without, beside, surface, grid)


def _parts(here):
    """The labels of the connected sets of nodes that are marked."""
    return regions(here)[0]


def _turned(inside, part, beside, surface, grid):
    """The inside with the specks among the labelled sets `part` turned over; itself where there are none."""
    size = counts(part)
    small = size < _SPECK
    small[0] = False
    if not small.any():
        return inside
    node = marked_nodes(each(lambda name: small[name], part))
    between = beside[surface.tree.query(grid.positions(node), workers=-1)[1]]
    held = np.unique(at_nodes(part, node[between]))
    small[held] = size[held].sum() > _HELD * size[1:].sum()
    return each(lambda here, name: here ^ small[name], inside, part)
