"""Stray samples: scattered through space, hovering beside a surface, in detached clouds, or far from all others.

A sample is never judged by its density alone, which would eat wires, rims and sparsely scanned parts: it must also
stand off the plane of its neighbours, or lie among samples that form no surface, or off all wires.
"""

import numpy as np
from scipy.spatial import KDTree

from ..given_arrays import workable_points
from ..linalg import unit
from ..progress import Progress
from ..trees import k_nearest
from .detached import detached_clouds
from .far_parts import far_parts
from .off_wires import off_wires
from .standing_out import hovering, proud
from .surroundings import FEWEST, NEIGHBOURS, SHEET, Surroundings, thickness

_ROUNDS = 6  # strays hide strays
_LONELY = 2.0  # spacing over that of the neighbours
_ALONE = 5.0  # so lonely that the plane no longer matters
_OFF = 2.0  # distance from the neighbours' plane over their spacing
_ASTRAY, _FEW = 0.01, 5  # share and number of samples off all wires above which they are strays: ends of wires are, too
_TIP = 65, 1.25, 0.75  # samples asked; times as far as the nearest, in a ring; least over largest way from its midst
_BEHIND = 1.1, 0.7  # spacing and distance off the neighbours' plane of samples that may be a sheet behind another's
_LAYER, _FLAT = 7, 0.1  # of these, looked at together; thickness of such a sheet, of strays at all heights mostly .2
_MANY_PROUD = 0.00125  # share of such samples above which they are strays: corners have some
_COMPANY = 40  # sparse samples that vote whether they are strays
_MAJORITY = 0.6
_TURNS, _FLAT_PARTS, _LEAST = 3, 0.15, 0.2  # two sheets: times parted; thickness of the parts; least share in either
_CHUNK = 8192  # samples

_DIRTY, _LONE = 0.0005, 1  # share and number of strays above which those close to the surface are looked for, too
_STRICT = 0.7  # share of the limits above that then holds for those beside a surface


def find_outliers(points, progress=None) -> np.ndarray:
    """(n,) bool: which samples (n,3), float64 and finite, are strays.

    - far: few, and further from all the others than these are from each other;
    - beside a surface: lonelier than its neighbours and off their plane, or far lonelier;
    - proud, where there are more than a few such: a little lonely and off the neighbours' plane where none of them is;
    - scattered: sparse against the whole cloud, where most sparse samples around form no surface, nor all of them one;
    - among wires, where there are more than a few such: lonely, on no line of a wire nearby nor in line with samples
      as sparse, which may be a wire sampled less;
    - detached: in a small part of its own that is a cloud rather than a sheet, be it a noisy one, or the shell of a
      convex body, or that is sparse and of too few samples to tell; with no others hardly further away than its own;
    - hovering, in a cloud with some strays of the other kinds: far off its neighbours' quadric where they are not.

    Some only look like that, and stay:

    - samples with others around at their own height, in a sheet close beside another: neither proud nor hovering;
    - samples where sheets cross: not hovering;
    - samples of a sparse sheet behind a dense one, if most that seem to be beside a surface or proud are of such: none
      of the three;
    - tips of cones and poles of spheres whose vertices lie on rings: none of the three.
    """
    progress = Progress.of(progress)
    stray = np.zeros(len(points), bool)
    if len(points) < FEWEST:
        return stray
    for turn, part in progress.turns(range(_ROUNDS)):
        kept = np.flatnonzero(~stray)
        around = Surroundings(points[kept], part.part(0.0, 0.6))
        dirty = stray.sum() > max(_DIRTY * len(points), _LONE)
        beside, above = _beside(around, _STRICT if dirty else 1.0), proud(around)
        behind, suspect = _behind_others(around), beside | above
        if turn == 0:  # a few strays among many lie in a plane by chance
            are_behind = behind[suspect].sum() > _MAJORITY * suspect.sum()
        others = ~(behind & are_behind)
        others[suspect] &= ~_at_tips(around, np.flatnonzero(suspect))
        found = far_parts(around.points) | (beside & others)
        found |= _scattered(around, part.part(0.6, 0.7))
        part(0.7)
        found |= detached_clouds(around, part.part(0.7, 0.8))
        among_wires = off_wires(around, _LONELY)
        if dirty or _many(among_wires, _ASTRAY):
            found |= among_wires
        above &= others
        if _many(above, _MANY_PROUD):
            found |= above
        if dirty:
            found |= hovering(around, part.part(0.8, 1.0)) & others
        stray[kept[found]] = True
        if not found.any() or (~stray).sum() < FEWEST:
            break
    return stray


def remove_outliers(points, progress=None) -> tuple[np.ndarray, np.ndarray]:
    """The samples (n',3) of (n,3) that are no strays, and their rows (n',) int64, see :func:`find_outliers`.

    Raises :class:`InputError` for points that are not finite, or that powers of distances between cannot be
    worked with.
    """
    points = workable_points(points)
    kept = np.flatnonzero(~find_outliers(points, progress))
    return points[kept], kept


def _many(found, share):
    return found.sum() > max(share * len(found), _FEW)


def _beside(around, share):
    off_plane = (around.lonely > share * _LONELY) & (around.off > share * _OFF)
    return (off_plane | (around.lonely > share * _ALONE)) & ~around.wire


def _behind_others(around):
    """Which samples are in a sheet of their own, so much sparser than one close by that their neighbours are all of
    that: of those off the plane of their neighbours, they and the nearest lie in one plane, and so do these."""
    lonely, off = _BEHIND
    found, points = np.zeros(len(around.points), bool), around.points
    row = np.flatnonzero((around.lonely > lonely) & (around.off > off) & ~around.wire)
    if len(row) >= _LAYER:
        nearest = KDTree(points[row]).query(points[row], k=_LAYER)[1]
        found[row] = np.median(thickness(points[row[nearest]])[nearest], axis=1) < _FLAT
    return found


def _at_tips(around, row):
    """Which of samples `row` (m,) are tips of cones and poles of rings: the nearest lie around, none in the midst."""
    asked, near, hollow = _TIP
    distance, other = k_nearest(around.tree, around.points[row], asked)
    ring = (distance < near * distance[:, 1:2]) & (distance > 0.0)
    towards, count = unit(around.points[other] - around.points[row, None]), ring.sum(axis=1)
    midst = np.einsum("mk,mki->mi", ring.astype(float), towards) / np.maximum(count, 1)[:, None]
    away = 1.0 - np.einsum("mki,mi->mk", towards, midst)
    least, largest = away.min(axis=1, where=ring, initial=np.inf), away.max(axis=1, where=ring, initial=-np.inf)
    return (count >= NEIGHBOURS) & (least > hollow * largest)


def _scattered(around, progress):
    found, sparse = np.zeros(len(around.points), bool), np.flatnonzero(around.sparse)
    if not len(sparse):
        return found
    astray = around.thick | ((around.off > _OFF) & ~around.wire)
    k, points = min(_COMPANY, len(sparse)), around.points[sparse]
    tree = KDTree(points)
    for part in progress.chunks(len(sparse), _CHUNK):
        company = tree.query(points[part], k=k, workers=-1)[1].reshape(-1, k)
        mostly = astray[sparse[company]].mean(axis=1) > _MAJORITY
        groups = points[company]
        found[sparse[part]] = mostly & (thickness(groups) > SHEET) & ~_are_two_sheets(groups)
    return found


def _are_two_sheets(groups):
    """Whether the points of groups (m,k,3) lie in two sheets, as those of a thin wall do: parted midway across where
    they extend least, each part is flat. Parted anew by the direction in which the parts extend least, a few times, as
    walls hardly wider than their samples are apart extend as much one way as another."""
    parts = groups - groups.mean(axis=1, keepdims=True)
    for _ in range(_TURNS):
        axes = np.linalg.eigh(np.einsum("mki,mkj->mij", parts, parts))[1]
        height = np.einsum("mki,mi->mk", groups, axes[:, :, 0])
        upper = height > 0.5 * (height.min(axis=1) + height.max(axis=1))[:, None]
        share = upper.mean(axis=1)
        for half in (upper, ~upper):
            weight = half / np.maximum(half.sum(axis=1), 1)[:, None]
            parts = np.where(half[:, :, None], groups - np.einsum("mk,mki->mi", weight, groups)[:, None], parts)
    return (thickness(parts) < _FLAT_PARTS) & (np.minimum(share, 1 - share) > _LEAST)
