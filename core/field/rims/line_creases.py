"""Sheets of lines that end at a crease: rings of a cylinder below its cap, rows of a box.

The samples on the crease itself are of one of its two sheets, and those of the other end a whole gap between lines away
from it. Nothing would cover the half of that gap beside the crease, for the samples nearest to it all have the first
sheet's normal. So a row of samples is added there, close to the crease, on the sheet that has none.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...linalg import row_dots, unit
from ...neighbourhoods.cloud import Cloud
from ...parallel import in_order
from ...progress import Progress
from .borders import DISC, OPPOSITE, Rims, bridged_reach, one_sheet

_EVEN = 1.5  # times the distance of the next line behind, at most, that the crease is away
_AHEAD = 0.8  # least cosine between the way across the line and that to the next one
_IN_PLANE = 0.2  # of its distance, that a sample on the crease may be off the plane of the lines
_FOLDED = 0.7  # largest |n_i . n_j| of the two sheets
_ALONG = 0.8  # least cosine between the line and the crease
_EDGE = 0.3  # local spacings, at most, that the other sheet goes on past it
_SHARE, _FEWEST = 0.3, 6  # of the samples of a line, at least, that find a crease; of a relief's contours some do
_MOST = 256  # samples among which lines and the crease are looked for
_CHUNK = 512  # samples


@dataclass(frozen=True)
class Added:
    """points : (k,3) float64, one local spacing from creases     normals : (k,3) float64, unit
    beside  : (k,) int64, the sample on the crease               across  : (k,) int64, that on the line next to it
    """

    points: np.ndarray
    normals: np.ndarray
    beside: np.ndarray
    across: np.ndarray

    def joined(self, rims: Rims, cloud: Cloud) -> Rims:
        """The rims of a `cloud` that ends in these samples, with the gaps between them and the lines covered."""
        n = len(cloud)
        added = np.arange(n - len(self.beside), n)
        own, other = np.concatenate([added, self.across]), np.concatenate([self.across, added])
        step = cloud.points[other] - cloud.points[own]
        distance = np.linalg.norm(step, axis=1)
        towards = row_dots(step, rims.outward[own]) / distance
        reach = bridged_reach(distance, cloud.spacing[own])
        ahead, back = rims.gap[own] & (towards > OPPOSITE), towards < -OPPOSITE
        bridged, farthest, behind = rims.bridged.copy(), rims.reach.copy(), rims.behind.copy()
        bridged[own[ahead]] = True
        np.maximum.at(farthest, own[ahead], reach[ahead])
        np.maximum.at(behind, own[back], reach[back])
        return replace(rims, bridged=bridged, reach=farthest, behind=behind)


def samples_beside_creases(rims: Rims, cloud: Cloud, progress=None) -> Added:
    """Samples to be added where sheets of lines end at creases: where a line has another one behind it and none ahead,
    but, in its plane and about as far as that, a sample at the edge of a sheet that meets this plane along the line."""
    on_lines = np.flatnonzero(cloud.lines.number >= 0)

    def look(part):
        row, way = _free_sides(on_lines[part], rims, cloud)
        found = _across(row, way, cloud)
        return row[found >= 0], found[found >= 0]

    parts = Progress.of(progress).chunks(len(on_lines), _CHUNK)
    pairs = [(np.empty(0, np.int64),) * 2, *(pair for _, pair in in_order(look, parts))]
    row, found = (np.concatenate(each) for each in zip(*pairs, strict=True))
    line = cloud.lines.number
    finding, all_ = (np.bincount(line[some], minlength=len(cloud)) for some in (row, on_lines))
    many = (finding >= np.maximum(_FEWEST, _SHARE * all_))[line[row]]
    row, found = row[many], found[many]
    step = cloud.points[row] - cloud.points[found]
    nearest = np.lexsort([row_dots(step, step), found])
    nearest = nearest[np.unique(found[nearest], return_index=True)[1]]
    row, found, way = row[nearest], found[nearest], unit(step[nearest])
    own = cloud.normals[row]
    places = cloud.points[found] + cloud.spacing[found, None] * way
    return Added(places, unit(own - row_dots(own, way)[:, None] * way), found, row)


def _free_sides(row, rims, cloud):
    """Of samples `row` on lines, those (r,) and unit ways (r,3) across these in the tangent plane in which no sample
    around lies on their sheet, and no patch covers a gap."""
    row = np.repeat(row, 2)
    way = unit(np.cross(cloud.normals[row], cloud.lines.along[row]))
    way[1::2] *= -1
    towards = row_dots(way, rims.outward[row])
    covered = np.where(towards > OPPOSITE, rims.reach[row], np.where(towards < -OPPOSITE, rims.behind[row], 0.0))
    other = cloud.neighbours[row]
    step, distance = _steps(row, other, cloud)
    ahead = np.einsum("rki,ri->rk", step, way) > _AHEAD * distance
    ahead &= one_sheet(step, cloud.normals[row, None], cloud.normals[other])
    free = ~ahead.any(axis=1) & (covered <= DISC * cloud.spacing[row])
    return row[free], way[free]


def _across(row, way, cloud):
    """The sample on the crease that each of some samples `row` (r,) looks at in ways (r,3), -1 where there is none."""
    normals, every = cloud.normals, np.arange(len(row))
    other = cloud.tree.query(cloud.points[row], k=min(_MOST, len(cloud)))[1]
    step, distance = _steps(row, other, cloud)
    own, theirs, line = normals[row, None], normals[other], cloud.lines.along[row, None]
    along = np.einsum("rki,ri->rk", step, way)
    sheet = one_sheet(step, own, theirs)
    behind = np.where(sheet & (along < -_AHEAD * distance), distance, np.inf).min(axis=1)
    ahead = along > _AHEAD * distance
    next_one = np.where(sheet & ahead, distance, np.inf).min(axis=1)
    farthest = np.minimum(next_one, np.where(np.isfinite(behind), _EVEN * behind, 0.0))
    fold = np.cross(own, theirs)
    crease = ahead & (distance > DISC * cloud.spacing[row, None]) & (distance < farthest[:, None])
    crease &= np.abs(row_dots(step, own)) < _IN_PLANE * distance
    crease &= np.abs(row_dots(own, theirs)) < _FOLDED
    crease &= np.abs(row_dots(fold, line)) > _ALONG * np.linalg.norm(fold, axis=2)
    chosen = other[every, crease.argmax(axis=1)]
    return np.where(crease.any(axis=1) & _at_edge(chosen, normals[row], cloud), chosen, -1)


def _at_edge(row, way, cloud):
    """Whether the sheets of samples `row` (r,) end there: go on to one side alone of planes with normals (r,3)."""
    other = cloud.neighbours[row]
    step, _ = _steps(row, other, cloud)
    sheet = one_sheet(step, cloud.normals[row, None], cloud.normals[other])
    off = np.where(sheet, np.einsum("rki,ri->rk", step, way), 0.0)
    return np.minimum(off.max(axis=1), -off.min(axis=1)) < _EDGE * cloud.spacing[row]


def _steps(row, other, cloud):
    """Steps (r,k,3) from samples `row` (r,) to `other` (r,k), and their lengths (r,k)."""
    step = cloud.points[other] - cloud.points[row, None]
    return step, np.linalg.norm(step, axis=2)
