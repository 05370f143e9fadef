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
from .borders import BRIDGED, DISC, OPPOSITE, Rims, bridged_reach

_EVEN = 1.5  # times the gap to the next line behind, at most, that the crease is away
_AHEAD = 0.8  # least cosine between the way across the gap and that to the crease
_IN_PLANE = 0.2  # of its distance, that a sample on the crease may be off the plane of the lines
_FOLDED = 0.7  # largest |n_i . n_j| of the two sheets
_ALONG = 0.8  # least cosine between the line and the crease
_FACING = 0.7  # least sine between the line and the gap at the crease
_MOST = 256  # samples among which the crease is looked for
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
    """Samples to be added where sheets of lines, which are joined to others behind them, end at creases: where a sample
    ahead of a line, in its plane and about as far as the next one, is at the rim of a sheet that meets this plane along
    the line."""
    spacing, covered = cloud.spacing, np.stack([rims.reach, rims.behind], axis=1)
    row = np.flatnonzero((cloud.lines.number >= 0) & rims.gap & (covered > DISC * spacing[:, None]).any(axis=1))
    row = row[(covered[row] <= DISC * spacing[row, None]).any(axis=1)]
    found = np.empty(len(row), np.int64)

    def look(part):
        return _across(row[part], rims, cloud, covered[row[part]])

    for part, other in in_order(look, Progress.of(progress).chunks(len(row), _CHUNK)):
        found[part] = other
    row, found = row[found >= 0], found[found >= 0]
    step = cloud.points[row] - cloud.points[found]
    nearest = np.lexsort([row_dots(step, step), found])
    nearest = nearest[np.unique(found[nearest], return_index=True)[1]]
    row, found, way = row[nearest], found[nearest], unit(step[nearest])
    own = cloud.normals[row]
    places = cloud.points[found] + spacing[found, None] * way
    return Added(places, unit(own - row_dots(own, way)[:, None] * way), found, row)


def _across(row, rims, cloud, covered):
    """The sample on the crease that each of some samples `row` (r,) looks at across a gap that is not covered, -1 where
    there is none."""
    points, normals, spacing = cloud.points, cloud.normals, cloud.spacing
    distance, other = cloud.tree.query(points[row], k=min(_MOST, len(cloud)))
    step, own, theirs = points[other] - points[row, None], normals[row, None], normals[other]
    ahead = np.where(covered[:, 0] > DISC * spacing[row], -1.0, 1.0)[:, None] * rims.outward[row]
    near = (distance > 0) & (distance <= _EVEN / BRIDGED * covered.max(axis=1)[:, None])
    near &= np.einsum("rki,ri->rk", step, ahead) > _AHEAD * distance
    near &= np.abs(row_dots(step, own)) < _IN_PLANE * distance
    line = cloud.lines.along[row, None]
    fold = np.cross(own, theirs)
    sine = np.linalg.norm(fold, axis=2)
    near &= rims.open[other] & (np.abs(row_dots(own, theirs)) < _FOLDED)
    near &= np.abs(row_dots(fold, line)) > _ALONG * sine
    near &= row_dots(rims.outward[other], line) ** 2 < 1 - _FACING**2
    chosen = near.argmax(axis=1)
    every = np.arange(len(row))
    return np.where(near[every, chosen], other[every, chosen], -1)
