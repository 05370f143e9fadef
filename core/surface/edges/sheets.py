"""All sheets near grid nodes, one by one, where several meet or run close to each other.

The near band knows the nearest sheet of each node only. Where sheets meet, each needs its own side of each node, so
that crossings of one are not taken for crossings of the other.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...field.local_surface import LocalSurface
from ...field.projection import CHUNK, MEMBER, TRUSTED, seen_from, sheet_foot
from ...linalg import row_dots
from ...lookup import grouped
from ...parallel import even_chunks, in_order
from ...progress import Progress
from ...records import joined, picked

_NEAREST = 16  # samples of a node
_SHEETS = 6  # of a node, at first
REACH = 1.6  # cells, from a node to a sheet that counts
SIDE_BY_SIDE = 0.9  # least |n . n'| of sheets that run side by side
_LIKELY = 0.6  # least confidence of samples of such sheets beside the first
_SAME_ANGLE, _SAME_FOOT = 0.9, (0.25, 0.1)  # cosine; cells or local spacings, whichever is more
STEEP = 0.92  # largest |n . n'| of sheets that meet; others run side by side
_LEVEL = 0.83  # least cosine between the normals of a sheet near a node and of samples on it
_ALIKE = 0.6  # least cosine between the axes of one sheet at neighbouring nodes
_BENT, _OFF = 0.35, 0.1  # its feet are off each other's plane by this share of their distance and this many cells


@dataclass(frozen=True)
class Sheets:
    """Pairs of a node and a sheet near it, by ascending node.

    node   : (p,) int64, row of the node           tau, axis, beyond, outward : as in SheetFoot, (p,...)
    member : (p,k) bool, whether each sample near the node belongs to the sheet
    foot   : (p,3) float64, where the node falls on the sheet, continued past its rims
    sample : (p,k) int32, samples near the node    anchor : (p,) int64, number of the sample that stands for the sheet
    """

    node: np.ndarray
    tau: np.ndarray
    axis: np.ndarray
    beyond: np.ndarray
    outward: np.ndarray
    member: np.ndarray
    foot: np.ndarray
    sample: np.ndarray
    anchor: np.ndarray

    def __len__(self):
        return len(self.node)

    def __getitem__(self, chosen) -> "Sheets":
        return picked(self, chosen)

    def joined(self, *others: "Sheets") -> "Sheets":
        """These and others after them."""
        return joined([self, *others])

    def span(self, nodes: int) -> tuple[np.ndarray, np.ndarray]:
        """First pair of each node and their number, (nodes,) each."""
        count = np.bincount(self.node, minlength=nodes)
        return np.cumsum(count) - count, count


def sheets_near(
    surface: LocalSurface, x: np.ndarray, neighbours: list[np.ndarray], cell: float, progress=None
) -> Sheets:
    """The sheets within 1.6 cells of nodes x (m,3); `neighbours` are six arrays (m,) with the row of each node's
    neighbour along the grid's axes and back, -1 where there is none.

    A sheet that a node's neighbour knows and the node itself does not is told to the node.
    """
    progress = Progress.of(progress)
    chunks = even_chunks(len(x), CHUNK, progress)
    found = [sheets for _, sheets in in_order(lambda part: _sheets_of(surface, x, part, cell), chunks)]
    sheets = found[0].joined(*found[1:])
    told = [found for _, found in in_order(partial(_told, sheets, surface, x, cell), neighbours)]
    return _distinct(sheets.joined(*told), surface, cell)


def one_sheet(sheets: Sheets, a, b, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Whether the pairs of rows a and b, (p,) each, lie on one sheet, (p,) bool, and how far off they are, (p,)."""
    axes, gap = (sheets.axis[a], sheets.axis[b]), sheets.foot[a] - sheets.foot[b]
    cosine = np.abs(row_dots(*axes))
    off = np.maximum(*(np.abs(row_dots(gap, axis)) for axis in axes))
    limit = _BENT * np.linalg.norm(gap, axis=1) + _OFF * cell
    return (cosine > _ALIKE) & (off <= limit), off / cell + 1 - cosine


def _sheets_of(surface, x, part, cell):
    part = np.arange(part.start, part.stop)
    distance, sample = surface.tree.query(x[part], k=min(_NEAREST, len(surface.points)))
    rest = surface.confidence[sample] >= TRUSTED
    rest[:, 0] |= ~rest.any(axis=1)
    normals = surface.normals[sample]
    own = normals[np.arange(len(part)), rest.argmax(axis=1)]
    beside = np.abs(np.einsum("mki,mi->mk", normals, own)) > SIDE_BY_SIDE
    rest |= beside & (surface.confidence[sample] >= _LIKELY)
    near, row, found = seen_from(surface, x[part], sample, distance), np.arange(len(part)), []
    for _ in range(_SHEETS):
        row = row[rest[row].any(axis=1)]
        anchor = rest[row].argmax(axis=1)
        found.append(_on_sheet(part[row], x[part[row]], near.rows(row), anchor))
        rest[row] &= ~found[-1].member
    sheets = found[0].joined(*found[1:])
    return _distinct(sheets[np.abs(sheets.tau) <= REACH * cell], surface, cell)


def _on_sheet(node, x, near, anchor):
    foot = sheet_foot(near, anchor, _LEVEL)
    place = x - foot.tau[:, None] * foot.axis
    member, sample = foot.member > MEMBER, near.sample.astype(np.int32)
    return Sheets(node, foot.tau, foot.axis, foot.beyond, foot.outward, member, place, sample, anchor)


def _distinct(sheets, surface, cell):
    """The pairs by ascending node, those of one node in the order given, but for pairs whose sheet an earlier pair of
    the node has already."""
    order, first = grouped(sheets.node)
    axis, foot = sheets.axis[order], sheets.foot[order]
    spacing = surface.spacing[sheets.sample[order, sheets.anchor[order]]]
    kept = np.ones(len(order), bool)
    rest = np.diff(first, append=len(order))
    while len(first):
        first, rest = first + 1, rest - 1
        first, rest = first[rest > 0], rest[rest > 0]
        at = np.flatnonzero(kept[first - 1])
        one = np.repeat(first[at] - 1, rest[at])
        other = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(rest[at]) - rest[at], rest[at])
        one, other = one[kept[other]], other[kept[other]]
        near = np.linalg.norm(foot[one] - foot[other], axis=1)
        same = near < np.maximum(_SAME_FOOT[0] * cell, _SAME_FOOT[1] * spacing[one])
        kept[other[same & (np.abs(row_dots(axis[one], axis[other])) > _SAME_ANGLE)]] = False
    return sheets[order[kept]]


def _told(sheets, surface, x, cell, towards):
    """The sheets that nodes (m,) know and their neighbours, the rows `towards` (m,), do not: as pairs of these."""
    first, count = sheets.span(len(x))
    pair = np.flatnonzero((towards[sheets.node] >= 0) & (sheets.beyond <= cell))
    node = towards[sheets.node[pair]]
    known = np.zeros(len(pair), bool)
    for i in range(count.max(initial=0)):
        row = np.flatnonzero((count[node] > i) & ~known)
        known[row] = one_sheet(sheets, pair[row], first[node[row]] + i, cell)[0]
    pair, node = pair[~known], node[~known]
    sample, anchor = sheets.sample[pair], sheets.anchor[pair]
    distance = np.linalg.norm(x[node][:, None] - surface.points[sample], axis=2)
    order = np.argsort(distance, axis=1, kind="stable")
    anchor = (order == anchor[:, None]).argmax(axis=1)
    sample, distance = (np.take_along_axis(array, order, axis=1) for array in (sample, distance))
    told = _on_sheet(node, x[node], seen_from(surface, x[node], sample, distance), anchor)
    return told[np.abs(told.tau) <= REACH * cell]
