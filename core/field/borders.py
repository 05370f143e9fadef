"""Where the surface ends: rims of open sheets, and gaps that are to be bridged.

The printed method has no borders: on a flat patch the diffused axes are constant and the zero set is the whole plane.
Here a sample whose neighbours leave a wide gap around it, seen in its tangent plane, is at a rim. Across the gap the
sheet ends a little past the two neighbours that bound it, unless the gap is narrower than the bridging length.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

NEIGHBOURS = 16
GAP = np.radians(130)
DISC = 1.0  # radius the patch of a sample covers where it has neighbours, local spacings
RIM = 0.25  # how far the sheet goes on past the last samples, local spacings
BRIDGED = 0.6  # share of a bridged gap that the patch on either side covers

_PARALLEL = 0.7  # |n_i . n_j| above which two samples lie on one sheet or on two parallel ones
_STEP = 0.35  # parallel samples further than this off each other's plane (share of their distance) are on two sheets
_FOLD = 0.8  # samples beyond a crease may lie this far off the plane (share of their lateral distance)
_FOLD_REACH = 1.2  # and must be this close, local spacings


@dataclass(frozen=True)
class Rims:
    """The widest gap around each sample, in its tangent plane.

    gap       : (n,) bool, whether there is one
    bridged   : (n,) bool, whether the surface goes on across it
    outward   : (n,3) float64, unit direction of the gap's middle
    opening   : (n,) float64, cosine of half its angle
    ends      : (n,2,3) float64, steps to the two neighbours that bound it
    reach     : (n,) float64, how far the patch covers a bridged gap
    """

    gap: np.ndarray
    bridged: np.ndarray
    outward: np.ndarray
    opening: np.ndarray
    ends: np.ndarray
    reach: np.ndarray


def find_rims(points, normals, frames, spacing, tree: KDTree, bridge: float) -> Rims:
    """Gaps wider than 130 degrees between neighbours of one sheet, sorted by angle in the tangent plane.

    points, normals : (n,3) float64     frames : (n,2,3) tangents     spacing : (n,) local spacing
    bridge          : gaps up to this many local spacings are crossed
    """
    n, k = len(points), min(NEIGHBOURS, len(points) - 1)
    neighbours = tree.query(points, k=k + 1, workers=-1)[1][:, 1:]
    step = points[neighbours] - points[:, None]
    x, y = np.moveaxis(np.einsum("nki,nai->nka", step, frames), 2, 0)
    same = _one_sheet(step, normals, normals[neighbours], spacing)

    angle = np.where(same, np.arctan2(y, x), np.inf)
    order = np.argsort(angle, axis=1)
    angle = np.take_along_axis(angle, order, axis=1)
    count = same.sum(axis=1)
    every = np.arange(n)
    last = np.maximum(count - 1, 0)
    following = np.concatenate([angle[:, 1:], angle[:, :1]], axis=1)
    following[every, last] = angle[:, 0] + 2 * np.pi
    with np.errstate(invalid="ignore"):
        width = np.where(np.isfinite(angle), following - angle, 0.0)
    widest = width.argmax(axis=1)
    width = width[every, widest]
    start = np.where(count > 0, angle[every, widest], 0.0)

    bounding = np.stack([order[every, widest], order[every, np.where(widest == last, 0, widest + 1) % k]], axis=1)
    flat = np.stack([np.take_along_axis(x, bounding, axis=1), np.take_along_axis(y, bounding, axis=1)], axis=2)
    middle = start + width / 2
    outward = np.einsum("na,nai->ni", np.stack([np.cos(middle), np.sin(middle)], axis=1), frames)
    gap = (width > GAP) & (count > 0)
    distance = np.full(n, np.inf)
    rows = np.flatnonzero(gap)
    distance[rows] = _distance_across(rows, points, normals, outward, spacing, tree, bridge)
    bridged = np.isfinite(distance)
    reach = np.where(bridged, np.maximum(DISC * spacing, BRIDGED * np.where(bridged, distance, 0.0)), 0.0)
    return Rims(gap, bridged, outward, np.cos(width / 2), np.einsum("nea,nai->nei", flat, frames), reach)


def excess(rims: Rims, sample, lateral, spacing) -> tuple[np.ndarray, np.ndarray]:
    """How far foot points lie outside the patches of given samples, along the tangent plane.

    sample : (m,k) int     lateral : (m,k,3) tangential offset from the sample     spacing : (m,k) of the sample
    Returns the distance (m,k) to the patch and the step (m,k,3) that leads out of it (its length is the distance).
    """
    length = np.linalg.norm(lateral, axis=2)
    open_side = rims.gap[sample] & (np.einsum("mki,mki->mk", lateral, rims.outward[sample]) > length * rims.opening[sample])
    radius = np.where(open_side & rims.bridged[sample], rims.reach[sample], DISC * spacing)
    beyond = np.maximum(length - radius, 0.0)
    step = lateral * (beyond / np.maximum(length, np.finfo(float).tiny))[..., None]

    at_rim = np.nonzero(open_side & ~rims.bridged[sample])
    to_edge = _to_edges(lateral[at_rim], rims.ends[sample[at_rim]])
    edge_distance = np.linalg.norm(to_edge, axis=1)
    past = np.maximum(edge_distance - RIM * spacing[at_rim], 0.0)
    worse = past > beyond[at_rim]
    rows = tuple(axis[worse] for axis in at_rim)
    beyond[rows] = past[worse]
    step[rows] = to_edge[worse] * (past[worse] / edge_distance[worse])[:, None]
    return beyond, step


def _one_sheet(step, normals, neighbour_normals, spacing):
    """(n,k) bool: neighbours over which the surface goes on, flat or folded, rather than those of another sheet."""
    distance = np.linalg.norm(step, axis=2)
    height = np.abs(np.einsum("nki,ni->nk", step, normals))
    height_back = np.abs(np.einsum("nki,nki->nk", step, neighbour_normals))
    parallel = np.abs(np.einsum("nki,ni->nk", neighbour_normals, normals)) > _PARALLEL
    flat = np.maximum(height, height_back) < _STEP * distance
    lateral = np.sqrt(np.maximum(distance**2 - height**2, 0.0))
    folded = (height < _FOLD * lateral) & (distance < _FOLD_REACH * spacing[:, None])
    return np.where(parallel, flat, folded)


def _distance_across(rows, points, normals, outward, spacing, tree, bridge):
    """(m,) distance to the nearest sample of the sheet across the gap, inf where it is beyond the bridging length."""
    within = min(len(points), int(4 * bridge**2) + 8)  # samples in a disc of that radius, with a margin
    across = np.full(len(rows), np.inf)
    chunk = max(1, 2_000_000 // within)
    for first in range(0, len(rows), chunk):
        part = rows[first : first + chunk]
        distance, other = tree.query(points[part], k=within, workers=-1)
        step = points[other] - points[part, None]
        ahead = np.einsum("nki,ni->nk", step, outward[part]) > 0.8 * distance
        near = (distance > 0) & (distance < bridge * spacing[part, None])
        aligned = np.abs(np.einsum("nki,ni->nk", normals[other], normals[part])) > 0.5
        height = np.abs(np.einsum("nki,ni->nk", step, normals[part]))
        height_back = np.abs(np.einsum("nki,nki->nk", step, normals[other]))
        level = np.maximum(height, height_back) < _STEP * distance
        across[first : first + chunk] = np.where(ahead & near & aligned & level, distance, np.inf).min(axis=1)
    return across


def _to_edges(lateral, ends):
    """Step (m,3) from the nearer of the two segments [0, end] to `lateral`."""
    squared = np.maximum(np.einsum("mei,mei->me", ends, ends), np.finfo(float).tiny)
    along = np.clip(np.einsum("mi,mei->me", lateral, ends) / squared, 0.0, 1.0)
    steps = lateral[:, None] - along[..., None] * ends
    nearer = np.einsum("mei,mei->me", steps, steps).argmin(axis=1)
    return steps[np.arange(len(steps)), nearer]
