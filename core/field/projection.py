"""The projection distance of queries close to the surface (section 3.1 of the paper), blended over the nearest samples.

This is where a run spends most of its time. Offsets are taken in double precision and worked on in single precision,
whose error is then relative to their length; vectors are stored component by component, (3,m,k).
"""

from dataclasses import dataclass, fields

import numpy as np

from ..linalg import dots, quadratic_form, row_dots
from ..parallel import even_chunks, work_through
from ..progress import Progress
from ..records import picked
from .diffusion import fused_axes, kernel_weights

NEAREST = 12  # of a query, that it is projected with
FROM_NODES = 8  # of a node: with fewer the field errs less, though meshes more
CHUNK = 8192  # queries at a time

_UNCOVERED = 1.5  # local spacings, or the bridged reach: the surface is never further from its nearest sample
_PARALLEL = 0.7  # least |n . axis| of samples whose patch may cover a query
_BESIDE = 0.3  # local spacings, at most, that a foot point lies off such a patch
_BLEND = 0.35  # sqrt(t) of the kernels, local spacings; with the paper's, about .5, farther patches count for too much
_MEMBERSHIP = 7.0  # how fast samples off each other's sheet stop counting as one sheet
_ROOM = 0.55  # the same beside a close sheet; half way to it, membership is that of the least member
_OTHER_SHEETS = 2  # at most, beside that of the nearest sample
TRUSTED = 0.95  # least confidence of a sample that stands for another sheet
_STRAIGHT = 0.98  # least |n . axis| of such a sample; samples of more sheets are mixed where it is less
MEMBER = 0.3  # least membership of samples whose patch may cover a query
_SAG = 0.25  # local spacings, by which a sheet may lie closer than its tangent plane

_TINY = np.finfo(np.float32).tiny


@dataclass(frozen=True)
class Projection:
    """Where queries fall on the surface.

    distance : (m,) float64, to the surface
    step     : (m,3) float64, from the foot point to the query
    past_rim : (m,) bool, whether the foot point lies on a rim of the sheet, where `step` is no normal
    spread   : (m,) float32, how far the patches it was found with are off it, root mean square; inf past rims, and
               where samples of other sheets are near
    sample   : (m,) int32, the sample nearest to the query
    """

    distance: np.ndarray
    step: np.ndarray
    past_rim: np.ndarray
    spread: np.ndarray
    sample: np.ndarray

    @property
    def direction(self) -> np.ndarray:
        """(m,3) float64, the steps made unit; zero for queries on the surface."""
        return self.step / np.maximum(self.distance, np.finfo(float).tiny)[:, None]

    def __getitem__(self, chosen) -> "Projection":
        return picked(self, chosen)

    def __setitem__(self, chosen, found: "Projection"):
        for field in fields(self):
            getattr(self, field.name)[chosen] = getattr(found, field.name)


@dataclass(frozen=True)
class SheetFoot:
    """Where queries fall on one sheet each, continued past its rims.

    tau    : (m,) float32, offset of the query along `axis`     axis    : (m,3) float64, unit normal of the sheet
    beyond : (m,) float32, how far past the sheet's rim         outward : (m,3) float32, the step past it
    member : (m,k) float32 in [0,1], how surely each sample near the query belongs to the sheet
    spread : (m,) how far the patches are off the foot, root mean square
    """

    tau: np.ndarray
    axis: np.ndarray
    beyond: np.ndarray
    outward: np.ndarray
    member: np.ndarray
    spread: np.ndarray


def project(surface, x: np.ndarray, progress: Progress, nearest: int = NEAREST) -> Projection:
    """Distances and foot points of queries (m,3) on a :class:`LocalSurface`, by the `nearest` samples of each.

    tau minimises, over the samples of one sheet near the query, the diffusion-weighted sum of squared offsets from
    their patches when the query is moved by tau along the fused axis. Past a rim the lateral distance to the nearest
    patch is added at a right angle. Of the sheets that the nearest samples belong to, the closest counts. Accurate
    within a few local spacings of the surface; never more than the distance to the nearest sample.
    """
    m = len(x)
    found = Projection(np.empty(m), np.empty((m, 3)), np.empty(m, bool), np.empty(m, np.float32), np.empty(m, np.int32))

    def place(part):
        found[part] = _project(surface, x[part], nearest)

    work_through(place, even_chunks(m, CHUNK, progress))
    return found


@dataclass(frozen=True)
class Nearby:
    """The patches of each query's nearest samples, as the query sees them; float32 but for `sample` and `distance`.

    sample   : (m,k)                                     distance : (m,k) float64, ascending
    spacing  : (m,k) local spacing of the sample         room     : (m,k) on its sheet, beside others
    offset   : (3,m,k) from the sample to the query
    normals  : (3,m,k)                                   bend     : (6,m,k) second fundamental form
    height   : (m,k) along the normal                    above    : (m,k) over the bent patch
    kernel   : (m,k) diffusion kernel                    pull     : (m,k) its slope along the normal
    beyond   : (m,k) lateral distance to the patch       outward  : (3,m,k) the step out of it
    """

    sample: np.ndarray
    distance: np.ndarray
    spacing: np.ndarray
    room: np.ndarray
    offset: np.ndarray
    normals: np.ndarray
    bend: np.ndarray
    height: np.ndarray
    above: np.ndarray
    kernel: np.ndarray
    pull: np.ndarray
    beyond: np.ndarray
    outward: np.ndarray

    def rows(self, chosen) -> "Nearby":
        return Nearby(*(np.take(getattr(self, field.name), chosen, axis=-2) for field in fields(self)))


def _project(surface, x, nearest):
    near = _nearby(surface, x, nearest)
    found, member, _ = _onto_sheet(surface, near, np.zeros(len(x), np.int64))
    apart = np.abs(near.height) - _SAG * near.spacing
    rest = (member <= MEMBER) & (surface.confidence[near.sample] >= TRUSTED)
    for _ in range(_OTHER_SHEETS):
        rest &= apart < found.distance[:, None]
        row, anchor = _first_of_rows(rest)
        other, member, straight = _onto_sheet(surface, near.rows(row), anchor)
        closer = (other.distance < found.distance[row]) & straight
        found[row[closer]] = other[closer]
        rest[row] &= member <= MEMBER
    return found


def membership(between, height, height_back, room) -> np.ndarray:
    """(m,k) in [0,1]: how surely samples lie on one sheet with another, from how far they are off each other's sheet
    relative to their distance and to the room that it has beside other sheets; keeps close sheets apart.

    between : (3,m,k) from the one to the others     height, height_back : (m,k) off its sheet and off theirs
    room    : (m,1) half the distance from its sheet to another, or infinite
    """
    squared = height**2 + height_back**2
    off = np.maximum(_MEMBERSHIP * squared / np.maximum(dots(between, between), _TINY), _ROOM * squared / room**2)
    with np.errstate(over="ignore"):  # no member by far
        return np.exp(-(off**2))


def _off_patches(near, anchor, between):
    """How far samples with steps (3,m,k) from the one number `anchor` (m,) are off its patch, and it off theirs, (m,k).
    Off tangent planes, sparse samples of a curved sheet would not count as one, and feet would jump from one nearest
    sample to the next."""
    every = np.arange(len(anchor))
    own, own_bend = near.normals[:, every, anchor], near.bend[:, every, anchor]
    height = dots(between, own[:, :, None]) - 0.5 * quadratic_form(own_bend[:, :, None], between)
    return height, dots(between, near.normals) + 0.5 * quadratic_form(near.bend, between)


def _nearby(surface, x, nearest):
    distance, sample = surface.tree.query(x, k=min(nearest, len(surface.points)))
    return seen_from(surface, x, sample, distance)


def seen_from(surface, x: np.ndarray, sample, distance) -> Nearby:
    """Samples (m,k) of a :class:`LocalSurface`, nearest first, and their distances, as queries (m,3) see them."""
    columns = surface.columns
    spacing, room = columns.spacing.take(sample), columns.room.take(sample)
    distance = np.maximum(distance, 1e-9 * spacing)
    offset = np.stack([(x[:, a, None] - columns.points[a].take(sample)).astype(np.float32) for a in range(3)])
    normals = np.stack([axis.take(sample) for axis in columns.normals])
    height = dots(offset, normals)
    lateral = offset - height * normals
    bend = np.stack([component.take(sample) for component in columns.bend])
    bent = _bent(bend, lateral)
    above = (height - 0.5 * dots(lateral, bent)) / np.sqrt(1 + dots(bent, bent))
    kernel, pull = kernel_weights(distance, spacing, height, _BLEND)
    patch = surface.patches.excess(sample, lateral, spacing)
    return Nearby(sample, distance, spacing, room, offset, normals, bend, height, above, kernel, pull, *patch)


def _bent(bend, lateral):
    """How far normals turn along steps (3,m,k), by the second fundamental form (6,m,k) there, (3,m,k)."""
    xx, yy, zz, xy, xz, yz = bend
    return np.stack([dots(row, lateral) for row in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))])


def _onto_sheet(surface, near, anchor):
    """Where queries fall on the sheet of their sample number `anchor` (m,); how surely each sample belongs to that
    sheet, (m,k); and whether the sheet runs there as at that sample, (m,) bool."""
    every = np.arange(len(near.sample))
    foot = sheet_foot(near, anchor)
    step = foot.tau[:, None] * foot.axis + foot.outward
    found = np.linalg.norm(step, axis=1)

    own, away = near.sample[every, anchor], near.distance[every, anchor]
    slack = np.maximum(_UNCOVERED * surface.spacing[own], 1.1 * surface.rims.farthest[own])
    bounded = np.clip(found, away - slack, away)
    lifted = bounded > found
    step[lifted] = near.offset[:, every, anchor].T[lifted]
    found[lifted] = away[lifted]
    step *= (bounded / np.maximum(found, _TINY))[:, None]
    past_rim = foot.beyond > 0
    clear = ~past_rim & (bounded == found) & (foot.member.min(axis=1) > MEMBER)
    cosine = np.einsum("im,mi->m", near.normals[:, every, anchor], foot.axis)
    spread = np.where(clear, foot.spread, np.float32(np.inf))
    projection = Projection(bounded, step, past_rim, spread, near.sample[:, 0].astype(np.int32))
    return projection, foot.member, np.abs(cosine) > _STRAIGHT


def sheet_foot(near: Nearby, anchor, level: float = 0.0) -> SheetFoot:
    """Where queries fall on the sheet of their sample number `anchor` (m,). Samples do not belong to it whose normals
    are turned against those of its bent patch, to a cosine below `level`."""
    every = np.arange(len(near.sample))
    between = near.offset[:, every, anchor][:, :, None] - near.offset
    member = membership(between, *_off_patches(near, anchor, between), near.room[every, anchor, None])
    if level > 0:
        own = near.normals[:, every, anchor, None] - _bent(near.bend[:, every, anchor, None], between)
        member *= np.abs(dots(near.normals, own)) >= level * np.sqrt(dots(own, own))
    weight = near.kernel * member
    total = np.einsum("mk->m", weight)
    alone = np.flatnonzero(total == 0)  # so far off, in spacings, that no kernel of the sheet is above zero
    weight[alone, anchor[alone]] = total[alone] = 1
    weight /= total[:, None]
    axis = fused_axes(weight, near.pull, near.normals)
    cosine = dots(near.normals, axis.T.astype(np.float32)[:, :, None])
    towards = weight * cosine
    tau = row_dots(towards, near.above) / row_dots(towards, cosine)

    missed = np.abs(near.above - tau[:, None].astype(np.float32) * cosine)
    spread = np.sqrt(np.einsum("mk,mk,mk->m", weight, missed, missed))
    covers = (np.abs(cosine) > _PARALLEL) & (member > MEMBER) & (missed < _BESIDE * near.spacing)
    covers[every, anchor] |= ~covers.any(axis=1)
    best = np.where(covers, near.beyond, np.inf).argmin(axis=1)
    return SheetFoot(tau, axis, near.beyond[every, best], near.outward[:, every, best].T, member, spread)


def _first_of_rows(marked):
    """The rows of `marked` (m,k) bool with any mark, and the column of the first in each."""
    row, column = np.divmod(np.flatnonzero(marked), marked.shape[1])
    first = np.flatnonzero(np.diff(row, prepend=-1))
    return row[first], column[first]
