"""Gaps between lines of samples: wires, contours, the lines of a scanner.

Most samples on lines look across a gap at samples that do so, too; beside an opening in a sheet only a row on either
side does. And of strips, which may be as close, lines differ in that many of their samples have nothing behind them.
Lines are far apart in the spacing along them, and there is no sheet but the one between them, so gaps there are bridged
much further, on both sides of a line.
"""

from dataclasses import replace

import numpy as np

from ...linalg import medians
from ...neighbourhoods.cloud import Cloud
from ...parallel import in_order
from ...progress import Progress
from .borders import Rims, across_gaps, bridged_reach

_FURTHER = 5.0  # times the bridging length, that gaps between lines are bridged, in the median spacing around
_AROUND = 64  # samples
_GAPS = 0.3  # least share of samples around that are beside a gap
_LOOKING = 0.36  # least share, around those, of samples that look across one
_THIN = 0.15  # least share of these that have nothing behind them; of strips three spacings wide .08 have not
_BEHIND = 2.0  # local spacings, within which nothing is
_EVEN = 1.5  # times the median width of gaps around, at most
_STEP = 0.5  # of the gap's width, that either side may be off the other's tangent plane
_MOST = 128  # samples among which the one across is looked for
_CHUNK = 512  # samples


def with_line_gaps_bridged(rims: Rims, cloud: Cloud, bridge: float, progress=None) -> Rims:
    """The rims with gaps between lines of samples bridged to either side, up to five times `bridge` local spacings
    wide and half as wide again as those around."""
    row, spacing = np.flatnonzero(rims.gap), cloud.spacing
    around = _around(row, cloud)
    many = rims.gap[around].mean(axis=1) >= _GAPS
    row, around = row[many], around[many]
    width, other = _gaps_to_both_sides(row, around, rims, cloud, bridge, progress)

    thin = ~(width[:, 1] < _BEHIND * spacing)
    width[~thin, 1] = np.nan
    looking = np.isfinite(width).any(axis=1)
    row, around = row[looking[row]], around[looking[row]]
    shares = np.full((2, len(cloud)), np.nan)
    shares[:, row] = looking[around].mean(axis=1), np.nanmean(np.where(looking, thin, np.nan)[around], axis=1)

    at, side = np.nonzero(np.isfinite(width[row]))
    own = row[at]
    around = np.concatenate([around[at], _around(other[own, side], cloud)], axis=1)
    of_looking, of_thin = np.nanmean(shares[:, around], axis=2)
    lines = (of_looking >= _LOOKING) & (of_thin >= _THIN)
    own, side, around = own[lines], side[lines], around[lines]
    even = width[own, side] <= _EVEN * medians(width[around].reshape(len(own), 2 * around.shape[1]))
    own, side = own[even], side[even]

    bridged, reach = rims.bridged.copy(), np.stack([rims.reach, rims.behind], axis=1)
    first = (side == 1) | ~bridged[own]
    own, side = own[first], side[first]
    reach[own, side] = bridged_reach(width[own, side], spacing[own])
    bridged[own[side == 0]] = True
    return replace(rims, bridged=bridged, reach=reach[:, 0], behind=reach[:, 1])


def _around(rows, cloud):
    """The samples around those in `rows` (m,), themselves first, (m,k)."""
    return cloud.tree.query(cloud.points[rows], k=min(_AROUND, len(cloud)), workers=-1)[1]


def _gaps_to_both_sides(row, around, rims, cloud, bridge, progress):
    """Distances (n,2) to the nearest sample ahead of samples `row`, outwards, and behind them, nan where there is none;
    and the numbers of these, (n,2)."""
    distance, other = np.full((len(cloud), 2), np.nan), np.zeros((len(cloud), 2), np.int64)

    def look(part):
        at, usual = row[part], np.median(cloud.spacing[around[part]], axis=1)
        ways = rims.outward[at], -rims.outward[at]
        return [across_gaps(at, way, cloud, _FURTHER * bridge, usual, _STEP, _MOST) for way in ways]

    for part, found in in_order(look, Progress.of(progress).chunks(len(row), _CHUNK)):
        for side, (away, across) in enumerate(found):
            distance[row[part], side] = np.where(np.isfinite(away), away, np.nan)
            other[row[part], side] = across
    return distance, other
