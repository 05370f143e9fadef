"""Where patches end: at rims of open sheets, at creases, and not at gaps that are to be bridged.

The printed method has no borders: on a flat patch the diffused axes are constant and the zero set is the whole plane.
Here a sample whose neighbours leave a wide gap around it, seen in its tangent plane, is at a rim. Across the gap the
sheet ends a little past the two neighbours that bound it, unless the gap is narrower than the bridging length and no
wall stands beside it.

Neighbours beyond a crease are unfolded about the line where the two tangent planes meet, so they fill gaps like any
other, and that line is where the patch ends, unless the sheet goes on straight (two sheets that cross).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...linalg import row_dots
from ...neighbourhoods.cloud import Cloud
from ...parallel import in_order
from ...parts import connected_parts
from ...progress import Progress
from ...records import joined
from ..curvature import sag
from .walls_beside_gaps import walled

DISC = 1.0  # radius the patch of a sample covers where it has neighbours, local spacings
RIM = 0.25  # how far the sheet goes on past the last samples, local spacings
_GAP = np.radians(130)  # without neighbours, in the tangent plane, that a gap has at least
OPPOSITE = float(np.cos(_GAP / 2))  # least cosine, to the direction opposite to a gap, of what lies there
_BRIDGED = 0.6  # share of a bridged gap that the patch on either side covers

_FLAT = 0.7  # least |n_i . n_j| of neighbours that lie on without a fold
_STEP = 0.35  # they may be off each other's plane by this share of their distance
_FOLD = 0.87  # largest |n_i . n_j| of neighbours with a fold between them
_FOLD_REACH = 1.5  # both are this close to the crease, local spacings
_CHUNK = 1024  # samples
_PAIRS = 500_000
_AT = 0.1  # local spacings, samples so close to a crease lie on it
_STRAIGHT_ON = 0.3  # a sheet with samples further than this past a crease ignores it, local spacings
_OWN = 0.77  # if their |n_i . n_j| is more than this: at 45 degrees those beyond the crease lie flat, too


@dataclass(frozen=True)
class Rims:
    """The widest gap around each sample and the creases beside it, in its tangent plane.

    gap       : (n,) bool, whether there is one
    bridged   : (n,) bool, whether the surface goes on across it
    outward   : (n,3) float64, unit direction of the gap's middle
    opening   : (n,) float64, cosine of half its angle
    beside    : (n,2) int64, the two neighbours that bound it     ends : (n,2,3) float64, steps to them
    margin    : (n,3) float64, how far the sheet goes on past the sample and past those two neighbours, at rims
    reach     : (n,) float64, how far the patch covers a bridged gap, or up to a rim across a gap in the sampling
    behind    : (n,) float64, how far it covers a gap opposite to that one, at lines of samples; 0 elsewhere
    crease    : (n,2,3) float64, unit directions towards the two nearest creases that differ; any where there is none
    limit     : (n,2) float64, distance to them, inf where there is none
    """

    gap: np.ndarray
    bridged: np.ndarray
    outward: np.ndarray
    opening: np.ndarray
    beside: np.ndarray
    ends: np.ndarray
    margin: np.ndarray
    reach: np.ndarray
    behind: np.ndarray
    crease: np.ndarray
    limit: np.ndarray

    @property
    def open(self) -> np.ndarray:
        """(n,) bool, whether the surface ends there: at gaps that are not bridged."""
        return self.gap & ~self.bridged

    @cached_property
    def farthest(self) -> np.ndarray:
        """(n,) how far the patch covers gaps to either side."""
        return np.maximum(self.reach, self.behind)


def find_rims(cloud: Cloud, bend, bridge: float, progress=None) -> Rims:
    """Gaps wider than 130 degrees between neighbours of one sheet, sorted by angle in the tangent plane.

    bend   : (n,3,3) float64 of the patches, which may bend towards each other over a gap
    bridge : gaps up to this many local spacings are crossed
    """
    chunks = Progress.of(progress).chunks(len(cloud), rows_at_a_time(bridge, len(cloud)))
    found = [rims for _, rims in in_order(lambda part: _find_rims(part, cloud, bend, bridge), chunks)]
    return joined(found)


def _find_rims(part, cloud, bend, bridge):
    points, normals, frames = cloud.points, cloud.normals, cloud.frames[part]
    spacing, neighbours = cloud.spacing[part], cloud.neighbours[part]
    own, theirs = normals[part], normals[neighbours]
    step = points[neighbours] - points[part, None]
    flat = one_sheet(step, own[:, None], theirs)
    larger = np.maximum(spacing[:, None], cloud.spacing[neighbours])
    same, laid, crease, limit = _laid_flat(step, own, theirs, spacing, larger, flat)
    same &= ~_of_other_lines(part, step, larger, cloud.lines)
    place = np.einsum("nki,nai->nka", laid, frames)
    width, middle, bounding = _widest_angles(place, same)
    outward = np.einsum("na,nai->ni", np.stack([np.cos(middle), np.sin(middle)], axis=1), frames)
    ends = np.einsum("nea,nai->nei", np.take_along_axis(place, bounding[..., None], axis=1), frames)
    beside = np.take_along_axis(neighbours, bounding, axis=1)

    gap = (width > _GAP) & same.any(axis=1)
    distance = np.full(len(gap), np.inf)
    rows = np.flatnonzero(gap)
    distance[rows], other = across_gaps(part.start + rows, outward[rows], cloud, bridge, bend=bend)
    bridged = np.isfinite(distance)
    rows, other = rows[bridged[rows]], other[bridged[rows]]
    bridged[rows] = ~walled(part.start + rows, other, cloud)
    reach = np.zeros(len(gap))
    reach[bridged] = bridged_reach(distance[bridged], spacing[bridged])
    margin = np.repeat(RIM * spacing[:, None], 3, axis=1)
    return Rims(
        gap, bridged, outward, np.cos(width / 2), beside, ends, margin, reach, np.zeros(len(gap)), crease, limit
    )


def _of_other_lines(part, step, larger, lines):
    """Which neighbours, by steps (n,k,3) from the samples of a `part` on lines, are to the side of the line and farther
    than patches of the `larger` spacing (n,k) meet, (n,k) bool. They leave a gap between the lines."""
    other, own = np.zeros(larger.shape, bool), np.flatnonzero(lines.number[part] >= 0)
    far = row_dots(step[own], step[own]) > (2 * DISC * larger[own]) ** 2
    other[own] = far & lines.aside(part.start + own, step[own])
    return other


def _widest_angles(place, same):
    """The widest angle between those neighbours, at places (n,k,2) around each sample, that are of the `same` sheet,
    (n,k) bool: how wide, the angle of its middle, (n,) each, and the columns of the two that bound it, (n,2)."""
    every, count = np.arange(len(place)), same.sum(axis=1)
    angle = np.where(same, np.arctan2(place[..., 1], place[..., 0]), np.inf)
    order = np.argsort(angle, axis=1)
    angle = np.take_along_axis(angle, order, axis=1)
    last = np.maximum(count - 1, 0)
    following = np.concatenate([angle[:, 1:], angle[:, :1]], axis=1)
    following[every, last] = angle[:, 0] + 2 * np.pi
    with np.errstate(invalid="ignore"):
        width = np.where(np.isfinite(angle), following - angle, 0.0)
    widest = width.argmax(axis=1)
    width = width[every, widest]
    start = np.where(count > 0, angle[every, widest], 0.0)
    after = np.where(widest == last, 0, widest + 1) % place.shape[1]
    return width, start + width / 2, np.stack([order[every, widest], order[every, after]], axis=1)


def one_sheet(step, normals, other_normals) -> np.ndarray:
    """Whether samples with steps (...,3) between them lie on one sheet that is nearly flat there, (...) bool."""
    return _level(step, normals, other_normals) & _aligned(normals, other_normals, _FLAT)


def _level(step, normals, other_normals, step_up=_STEP, above=0.0, above_back=0.0):
    """Whether both ends of steps (...,3) are off each other's tangent plane, or what lies so far above it there (...),
    by less than this share of their length."""
    height = np.abs(row_dots(step, normals) - above)
    height_back = np.abs(row_dots(step, other_normals) + above_back)
    return np.maximum(height, height_back) < step_up * np.linalg.norm(step, axis=-1)


def _aligned(normals, other_normals, least):
    return np.abs(row_dots(normals, other_normals)) > least


def _laid_flat(step, own, theirs, spacing, larger, flat):
    """Which neighbours are of one sheet, those beyond folds as well, (n,k); steps to them in the sample's tangent plane
    or, of those that are not beyond a fold, in space, (n,k,3); and the creases, see :func:`_creases`. `larger` (n,k) is
    the larger spacing of the two."""
    n = len(step)
    same, laid, crease, limit = flat.copy(), step.copy(), np.zeros((n, 2, 3)), np.full((n, 2), np.inf)
    bent = np.flatnonzero((~flat & ~_aligned(own[:, None], theirs, _FOLD)).any(axis=1))
    if len(bent):
        step, own, theirs, spacing, larger, flat = (each[bent] for each in (step, own, theirs, spacing, larger, flat))
        folded, lateral, toward, line = _unfolded(step, own, theirs, spacing, larger, flat)
        level = flat & _aligned(own[:, None], theirs, _OWN)
        crease[bent], limit[bent] = _creases(step, level, folded, toward, line, spacing)
        laid[bent] = np.where(folded[..., None], lateral, step)
        same[bent] |= folded
    return same, laid, crease, limit


def _unfolded(step, normals, other_normals, spacing, larger, flat):
    """Neighbours beyond a fold, laid out in the sample's tangent plane. Of a sample on the crease they lie opposite to
    its `flat` neighbours, (n,k) bool, and may be as far off as the `larger` spacing of the two, (n,k), allows.

    Returns whether each is one (n,k), its unfolded step (n,k,3), the unit tangent towards the crease (n,k,3) and the
    distance to the crease (n,k).
    """
    cosine = np.einsum("nki,ni->nk", other_normals, normals)
    across = other_normals - cosine[..., None] * normals[:, None]
    sine = np.linalg.norm(across, axis=2)
    folded = ~flat & (np.abs(cosine) < _FOLD)
    sine = np.where(folded, sine, 1.0)
    across = across / sine[..., None]
    line = row_dots(step, other_normals) / sine
    other_line = np.abs(np.einsum("nki,ni->nk", step, normals)) / sine
    inwards = np.einsum("nki,nk->ni", step, flat)
    at = np.abs(line) < _AT * spacing[:, None]
    side = np.where(at, -np.einsum("nki,ni->nk", across, inwards), line)
    across = across * np.where(side < 0, -1.0, 1.0)[..., None]
    line = np.abs(line)
    reach = _FOLD_REACH * np.where(at, larger, spacing[:, None])
    folded &= (line < reach) & (other_line < reach)
    along = np.cross(normals[:, None], across)
    slide = row_dots(step, along)
    return folded, (line + other_line)[..., None] * across + slide[..., None] * along, across, line


def _creases(step, own, folded, toward, line, spacing):
    """The nearest crease that no neighbour of the `own` sheet, (n,k) bool, lies beyond, and the nearest one in another
    direction, (n,2,3), with their distances, (n,2)."""
    margin = line + _STRAIGHT_ON * spacing[:, None]
    runs = np.einsum("nji,nki->njk", step, toward)
    crossed = ((runs > margin[:, None]) & own[:, :, None]).any(axis=1)
    distance = np.where(folded & ~crossed, line, np.inf)
    every = np.arange(len(step))
    first = distance.argmin(axis=1)
    other = np.einsum("nki,ni->nk", toward, toward[every, first]) < np.cos(np.pi / 4)
    second = np.where(other, distance, np.inf).argmin(axis=1)
    chosen = np.stack([first, second], axis=1)
    limit = np.stack([distance[every, first], np.where(other, distance, np.inf)[every, second]], axis=1)
    return np.take_along_axis(toward, chosen[..., None], axis=1), limit


def _within(bridge, n):
    """How many samples, of n, there may be in a disc of the bridging length, with a margin."""
    return min(n, int(4 * bridge**2) + 8)


def across_gaps(rows, outward, cloud: Cloud, bridge: float, spacing=None, step_up=_STEP, most=None, bend=None):
    """The nearest sample of the same sheet across the gap of each sample in `rows` (m,): its distance (m,), inf where
    there is none, and its number (m,).

    outward : (m,3) unit, the ways across     bridge : how far away it may be, in units of `spacing`
    spacing : (m,), or None for the local spacing of the samples
    step_up : share of the distance, by which either may be off the tangent plane of the other
    most    : how many of the nearest samples are looked at, or None for all that may be in reach
    bend    : (n,3,3) of the patches, or None: either may lie on the patch of the other, too
    """
    points, normals = cloud.points, cloud.normals
    spacing = cloud.spacing[rows] if spacing is None else spacing
    distance, other = cloud.tree.query(points[rows], k=min(_within(bridge, len(cloud)), most or len(cloud)))
    step = points[other] - points[rows, None]
    ahead = np.einsum("nki,ni->nk", step, outward) > 0.8 * distance
    near = (distance > 0) & (distance < bridge * spacing[:, None])
    sheet = _aligned(normals[rows, None], normals[other], 0.5)
    ends = step, normals[rows, None], normals[other], step_up
    level = _level(*ends)
    if bend is not None:
        level |= _level(*ends, sag(step, bend[rows, None]), sag(step, bend[other]))
    sheet &= level
    distance = np.where(ahead & near & sheet, distance, np.inf)
    nearest = np.arange(len(rows)), distance.argmin(axis=1)
    return distance[nearest], other[nearest]


def rows_at_a_time(bridge: float, n: int) -> int:
    """Samples, of n, whose gaps can be looked across at a time, see :func:`across_gaps`."""
    return min(_CHUNK, max(1, _PAIRS // _within(bridge, n)))


def bridged_reach(distance, spacing) -> np.ndarray:
    """How far patches cover gaps of width `distance` (m,) that are bridged, (m,)."""
    return np.maximum(DISC * spacing, _BRIDGED * distance)


def chains(rims: Rims, marked) -> np.ndarray:
    """Of the samples marked, (n,) bool, the number of the row that each is in, (n,), where one bounds the next one's
    gap; one of its own for each that is not marked."""
    n = len(marked)
    tail, head = np.repeat(np.flatnonzero(marked), 2), rims.beside[marked].reshape(-1)
    tail, head = tail[marked[head]], head[marked[head]]
    return connected_parts(tail, head, n)


def chain_lengths(rims: Rims, marked) -> np.ndarray:
    """How many samples there are in the row of each, (n,), see :func:`chains`."""
    chain = chains(rims, marked)
    return np.bincount(chain)[chain]
