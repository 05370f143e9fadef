"""Normals beside creases, where sheets meet at an angle.

Around a sample next to a crease the mirror images of the neighbours' axes form clusters, one for each sheet, and the
sweeps settle between them, on the normal of none. The sample lies on one of the planes, though: its axis is taken to
the plane that most of its neighbours lie in, if any does to within rounding (see :mod:`.planes`), or else to the
densest cluster (as tangent planes are taken to the largest cluster of votes by A. Boulch and R. Marlet, Computer
Graphics Forum 31(5), 2012), provided that the neighbours behind it lie in the plane across it, and that those of the
sample rise out of its present one. Then facets between the sheets are cut, and the sweeps go on with those that are
left, and at last samples are taken to planes that they share with neighbours (see :mod:`.shared_planes`). Axes further
off a crease that only lean, as all do where the rows of a lattice lie closer on its other side, are righted by planes
alone, which must be more exact; next to axes that are given they lean as they should.

The paper has no such step. Where there is no crease it changes nothing at all.
"""

from functools import partial

import numpy as np

from ..linalg import row_dots, unit
from ..lookup import mask_of
from ..parallel import in_order
from ..progress import Progress
from .around import Around
from .mirrors import Mirrors
from .planes import onto_planes
from .reflection import sweeps_over
from .shared_planes import onto_shared_planes

_ALIKE = 0.06  # of the Gaussian of the sine between axes of one sheet
_AGREED = 0.6  # share of its neighbours that speak for the axis of a sample on a smooth sheet
_GAIN = 0.1  # by which that share must rise
_TRIED = 32  # nearest whose images may be the axis
_FEWEST = 4.0  # neighbours that must speak for the new axis
_STEEP, _FLAT = 0.12, 0.05  # mean sines at which neighbours rise out of the plane of the old axis, and of the new one
_UPRIGHT = 0.97  # confidence, below which axes may lean on those of another sheet
_LEAST_TURN = 0.2  # radians
_ROUNDS, _SWEEPS = 4, 6
_ACROSS = 0.2  # sine between axis and image, from which neighbours beside a crease are on different sheets
_RISEN = 0.4  # sine by which they rise out of the plane, from which they are, too: the inside of a wedge lies between


def normals_of_sheets(points, spacing, mirrors: Mirrors, normals, fixed=(), progress=None):
    """Axes like those that the sweeps end with, but for samples beside creases, which have the normal of one sheet.

    points  : (n,3) float64     spacing : (n,) float64, local spacing, same units     mirrors : of the points
    normals : (n,3) unit axes   fixed   : rows that stay as they are
    Returns axes (n,3); confidence (n,) in [0,1], the weighted mean of the squared cosine between an axis and the mirror
    images of its neighbours, without those across creases; and which samples were taken to one sheet, (n,) bool.
    """
    progress = Progress.of(progress)
    progress(0.0)
    fixed = np.isin(np.arange(len(points)), fixed)
    moved, held = np.zeros(len(points), bool), fixed
    agreed, suspect = agreed_share(mirrors, normals, held)
    if suspect.any():
        here, around = mirrors.at(mirrors.and_around(suspect)), Around(points, spacing, mirrors.stretch)
        apart = ~mirrors.and_around(fixed)
        for part in (progress.part(0.0, 0.5), progress.part(0.5, 1.0)):
            leaning = (mirrors.confidence(normals) < _UPRIGHT) & apart
            suspect = agreed_share(here, normals, fixed)[1]
            normals, flat = onto_planes(around, normals, suspect, leaning, part.part(0.0, 0.3))
            normals, bent = _onto_sheets(around, here, normals, held, agreed, part.part(0.3, 0.7))
            if not (flat | bent).any():
                break
            moved = moved | flat | bent
            beside = mirrors.and_around(moved)
            swept = mirrors.and_around(beside) & ~held
            normals = sweeps_over(_parted(mirrors.at(swept), normals, beside), normals, swept, _SWEEPS)
            normals, shared = onto_shared_planes(around, mirrors, normals, ~fixed, part.part(0.7, 1.0))
            held, moved = held | shared, moved | shared
    parted = _parted(mirrors, normals, mirrors.and_around(moved)) if moved.any() else mirrors
    return normals, parted.confidence(normals), moved


def agreed_share(mirrors, normals, held):
    """The share of the neighbours that each axis agrees with, on lines of those to the side, (n,), and which are to be
    looked at, (n,) bool."""
    agreed, rise = mirrors.means_aside(_alike(mirrors.cosines(normals)), np.abs(mirrors.rises(normals)))
    return agreed, (agreed < _AGREED) & (rise > _STEEP) & ~held


def _onto_sheets(around, mirrors, normals, held, agreed, progress):
    """The axes after those of samples beside creases are taken to one sheet's normal, and which these are; all have
    their neighbours in `mirrors`. `agreed` (n,) holds for the others, and takes in place what these find."""
    normals, moved, here = normals.copy(), np.zeros(len(normals), bool), np.unique(mirrors.site)
    changed = ~moved
    for _ in range(_ROUNDS):
        found, suspect = agreed_share(mirrors, normals, held)
        agreed[here] = found[here]
        parts = around.parts(np.flatnonzero(suspect & mirrors.and_around(mirrors.and_around(changed))))
        look = partial(_densest, around=around, normals=normals, agreed=agreed)
        axes = np.concatenate([np.empty((0, 3)), *(axes for _, axes in in_order(look, progress.each(parts)))])
        row = np.concatenate([np.empty(0, np.int64), *parts])
        turned = np.abs(row_dots(axes, normals[row])) < np.cos(_LEAST_TURN)
        if not turned.any():
            break
        changed = mask_of(row[turned], len(normals))
        normals[row[turned]] = axes[turned]
        moved |= changed
    return normals, moved


def _parted(mirrors, normals, beside):
    """The mirrors without those across creases of samples `beside` these, (n,) bool."""
    return mirrors.without(_across(mirrors, normals) & (beside[mirrors.site] | beside[mirrors.other]))


def _across(mirrors, normals):
    """Which neighbours, (p,) bool, have axes unlike those that the samples expect, or rise far out of their plane."""
    return (1 - mirrors.cosines(normals) ** 2 > _ACROSS**2) | (np.abs(mirrors.rises(normals)) > _RISEN)


def _densest(row, around, normals, agreed):
    """The axes (r,3) that most of the images around samples `row` (r,) agree with; the present ones where they are no
    better founded."""
    other, direction, near = around.neighbours(row)
    images = normals[other]
    images -= 2 * row_dots(images, direction)[..., None] * direction
    weight = near * np.maximum(agreed[other], np.finfo(float).tiny)

    tried = np.concatenate([normals[row, None], images[:, :_TRIED]], axis=1)
    cosine = np.einsum("rti,rki->rtk", tried, images)
    alike = _alike(cosine)
    share = np.einsum("rtk,rk->rt", alike, weight) / weight.sum(axis=1)[:, None]
    every, best = np.arange(len(row)), share.argmax(axis=1)
    alike, sign = alike[every, best], np.sign(cosine[every, best])
    axes = unit(np.einsum("rk,rki->ri", alike * weight * sign, images))

    near *= alike
    rise = row_dots(near, np.abs(row_dots(axes[:, None], direction)))
    rise /= np.maximum(near.sum(axis=1), np.finfo(float).tiny)
    founded = (share[every, best] > share[:, 0] + _GAIN) & (alike.sum(axis=1) > _FEWEST) & (rise < _FLAT)
    return np.where(founded[:, None], axes, normals[row])


def _alike(cosine):
    """How surely axes at these cosines are those of one sheet, in [0,1]."""
    return np.exp((np.minimum(cosine**2, 1) - 1) / (2 * _ALIKE**2))
