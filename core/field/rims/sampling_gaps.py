"""Gaps in the sampling, told apart from openings of the surface.

Among n random samples, one to a square of the local spacing, some leave a disc of sqrt(4 / pi (ln n + ln ln n)) local
spacings across empty, four of 25,000 (n A exp(-A) is 1 there, A the disc's area). Around an opening the samples at its
rim follow one another; around a gap in the sampling few look across a wide angle without any, and the patches to its
two sides meet over it. In a round one they may all have others to both sides; it is covered from there as well.

Beside either, samples are far from their neighbours. That is no reason to bridge an opening further: on `petals_10k` of
the benchmarks samples at the rims of bays have local spacings of 1.5 to 1.8 times those around them, and bays five of
those wide were shut.

Where the sampling is abruptly sparser, samples look across a gap that is too wide for them, and for those on its other
side an ordinary one, which they bridge; both have to.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from ...linalg import row_dots
from ...neighbourhoods.cloud import Cloud
from ...parallel import in_order
from ...progress import Progress
from ..curvature import sag
from .borders import DISC, Rims, across_gaps, bridged_reach, chain_lengths, rows_at_a_time
from .walls_beside_gaps import walled

_FEW = 4  # samples in a row that a wide gap in the sampling may have at its rim
_MANY = 8  # samples in a row that only an opening has at its rim
_ROUND = np.radians(90)  # least angle without neighbours beside a round gap, which no sample sees 130 degrees of
_NEXT = 2.5  # local spacings from a rim, where openings are not looked across
_WIDER = 1.5  # bridging lengths, at most, that a gap in the sampling is wide
_CHANCE = 1.2  # of the width that chance leaves; the spacing beside a gap scatters, too
_SPARSER = 2.5  # of the local spacings around, that of samples in a sparser part; rims' own reach 1.8
_SOME = 6  # of its neighbours, that one is sparse for beside a denser part
_FURTHER = 4.0  # bridging lengths, up to where a sparser part is looked for
_MOST = 256  # samples among which it is
_APART = 0.06  # of the gap, what the patches to both sides may differ by halfway


def with_openings_kept(rims: Rims, cloud: Cloud, bridge: float, progress=None) -> Rims:
    """The rims with gaps that have a long row of samples at their rim bridged only up to `bridge` times the median
    local spacing among the neighbours."""
    row = np.flatnonzero(rims.bridged)
    row = row[rims.reach[row] > bridged_reach(bridge * _usual(row, cloud), cloud.spacing[row])]
    _, other = _looked_across(row, rims.outward[row], cloud, bridge, progress)
    chain = chain_lengths(rims, rims.gap)
    row = row[np.maximum(chain[row], chain[other]) >= _MANY]
    bridged, reach = rims.bridged.copy(), rims.reach.copy()
    bridged[row], reach[row] = False, 0.0
    return replace(rims, bridged=bridged, reach=reach)


def with_sparser_parts_joined(rims: Rims, cloud: Cloud, bridge: float, progress=None) -> Rims:
    """The rims with gaps bridged beyond which the sheet goes on more sparsely sampled, no wider than `bridge` local
    spacings of the sample across."""
    progress, spacing = Progress.of(progress), cloud.spacing
    row = np.flatnonzero(rims.open)
    row = row[_near_steps(row, cloud, _FURTHER * bridge)]
    distance, other = _looked_across(row, rims.outward[row], cloud, _FURTHER * bridge, progress.part(0.0, 0.9), _MOST)
    ordinary = distance <= bridge * spacing[other]
    row, distance, other = row[ordinary], distance[ordinary], other[ordinary]
    onward, beyond = _looked_across(other, rims.outward[row], cloud, _WIDER * bridge, progress.part(0.9, 1.0))
    sparser = np.isfinite(onward) & (spacing[beyond] >= _SPARSER * _usual(row, cloud))
    row, distance = row[sparser], distance[sparser]
    bridged, reach = rims.bridged.copy(), rims.reach.copy()
    bridged[row], reach[row] = True, bridged_reach(distance, spacing[row])
    return replace(rims, bridged=bridged, reach=reach)


def with_sampling_gaps_bridged(rims: Rims, cloud: Cloud, bend, bridge: float, progress=None) -> Rims:
    """The rims with gaps in the sampling bridged that are as wide as chance leaves them, but no more than half as wide
    again as `bridge` local spacings, and have no walls beside them; `bend` (n,3,3) of the patches."""
    points, spacing = cloud.points, cloud.spacing
    few = chain_lengths(rims, rims.gap) <= _FEW
    rim = rims.open
    round_ = ~rims.gap & (rims.opening < np.cos(_ROUND / 2)) & _far_from(rim & ~few, points, spacing)
    row, widest = np.flatnonzero(rim & few | round_), min(_WIDER * bridge, _left_by_chance(len(cloud)))
    distance, other = _looked_across(row, rims.outward[row], cloud, widest, progress)
    across = np.isfinite(distance) & few[other]
    row, other, distance = row[across], other[across], distance[across]
    met = _apart_halfway(row, other, points, cloud.normals, bend) <= _APART * distance
    met &= ~walled(row, other, cloud)
    row, covered = row[met], bridged_reach(distance[met], spacing[row[met]])
    further = rims.gap[row] | (covered > DISC * spacing[row])
    row, covered = row[further], covered[further]
    gap, bridged, reach = rims.gap.copy(), rims.bridged.copy(), rims.reach.copy()
    gap[row], bridged[row], reach[row] = True, True, covered
    return replace(rims, gap=gap, bridged=bridged, reach=reach)


def _usual(row, cloud):
    """Median local spacing among the neighbours of samples `row` (m,), (m,)."""
    return np.median(cloud.spacing[cloud.neighbours[row]], axis=1)


def _near_steps(row, cloud, within):
    """Which of samples `row` (m,) are within so many of their local spacings from one that is sparse for its
    neighbours, (m,) bool."""
    points, spacing, some = cloud.points, cloud.spacing, min(_SOME, cloud.neighbours.shape[1] - 1)
    sparse = spacing >= _SPARSER * np.partition(spacing[cloud.neighbours], some, axis=1)[:, some]
    if not sparse.any():
        return np.zeros(len(row), bool)
    return KDTree(points[sparse]).query(points[row])[0] <= within * spacing[row]


def _looked_across(row, way, cloud, widest, progress, most=None):
    """Distance and number, (m,) each, of the samples that samples `row` find in directions (m,3), up to `widest` local
    spacings away; see :func:`across_gaps`."""
    distance, other = np.empty(len(row)), np.empty(len(row), np.int64)

    def look(part):
        return across_gaps(row[part], way[part], cloud, widest, most=most)

    chunks = Progress.of(progress).chunks(len(row), rows_at_a_time(widest, len(cloud)))
    for part, found in in_order(look, chunks):
        distance[part], other[part] = found
    return distance, other


def _far_from(rim, points, spacing):
    """Which samples are not next to one of a rim, (n,) bool."""
    if not rim.any():
        return ~rim
    return KDTree(points[rim]).query(points, workers=-1)[0] > _NEXT * spacing


def largest_empty_area(n: int, expected: float = 1.0) -> float:
    """The area A, squared spacings, that chance leaves empty in `expected` places among n: n A exp(-A) is that."""
    logarithm = np.log(max(n, 3) / expected)
    return logarithm + np.log(logarithm)


def _left_by_chance(n):
    """How wide a gap there may be among n random samples, local spacings."""
    return _CHANCE * np.sqrt(4 / np.pi * largest_empty_area(n))


def _apart_halfway(row, other, points, normals, bend):
    """How far apart the patches of two samples each lie halfway between them, along their mean normal, (m,)."""
    own, theirs = normals[row], normals[other]
    same = np.where(row_dots(own, theirs) < 0, -1.0, 1.0)
    middle = 0.5 * (points[row] + points[other])
    apart = _foot(middle, points[row], own, bend[row]) - _foot(middle, points[other], theirs, bend[other])
    mean = own + same[:, None] * theirs
    return np.abs(row_dots(apart, mean)) / np.linalg.norm(mean, axis=1)


def _foot(x, points, normals, bend):
    """Where the patches of points (m,3) lie below or above x (m,3)."""
    offset = x - points
    lateral = offset - row_dots(offset, normals)[:, None] * normals
    return points + lateral + sag(lateral, bend)[:, None] * normals
