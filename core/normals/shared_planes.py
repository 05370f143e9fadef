"""Samples beside creases that lie in the planes of neighbours.

Where a sheet is flat, each axis on it tells the plane that all of it lies in. A sample in one plane with two neighbours
whose axes are alike, to within rounding, lies on their sheet, however few of its neighbours do: on the edges of solids
and at their corners those of each sheet are few. Chance, and curved sheets, hardly ever put samples so.
"""

from functools import partial

import numpy as np

from ..linalg import dots, row_dots, unit
from ..lookup import mask_of
from ..parallel import in_order
from ..progress import Progress
from .around import Around
from .mirrors import Mirrors

_INSIDE = 0.004  # sine by which a sample may rise out of the plane of a neighbour
_ALIKE = np.cos(0.02)  # cosine between axes of one plane
_UNLIKE = np.cos(0.1)  # cosine between axes that are worth a change
_MORE = 2  # neighbours that must share a plane with a sample beyond those that share that of its present axis
_WEDGE = 0.2  # least sine of the angle between two of them: all of a straight line share any plane along it
_ROUNDS = 4  # for those that share the planes of others once these are right


def onto_shared_planes(around: Around, mirrors: Mirrors, normals, free, progress=None):
    """The axes (n,3) after those of samples are taken to the plane that most of their neighbours share with them, and
    which these are, (n,) bool.

    around, mirrors : of all samples     free : (n,) bool, samples whose axes may change
    """
    progress, moved = Progress.of(progress), np.zeros(len(normals), bool)
    for _ in range(_ROUNDS):
        turned, changed = normals.copy(), np.zeros(len(normals), bool)
        look = partial(_most_shared, around=around, normals=normals)
        parts = around.parts(np.flatnonzero(free & _offered(mirrors, normals)))
        for _, (row, axes) in in_order(look, progress.each(parts)):
            turned[row], changed[row] = axes, True
        if not changed.any():
            break
        normals, moved = turned, moved | changed
    return normals, moved


def _offered(mirrors, normals):
    """Which samples, (n,) bool, lie in the plane of a neighbour whose axis is unlike theirs."""
    columns = np.ascontiguousarray(normals.T)
    theirs = columns.take(mirrors.other, axis=1)
    pair = np.flatnonzero(np.abs(dots(theirs, mirrors.direction)) < _INSIDE)
    unlike = np.abs(dots(theirs[:, pair], columns[:, mirrors.site[pair]])) < _UNLIKE
    return mask_of(mirrors.site[pair[unlike]], len(normals))


def _most_shared(row, around, normals):
    """Those of the samples `row` (r,) that share another plane with enough of their neighbours, and its axis for each,
    (m,) and (m,3)."""
    other, direction, _ = around.neighbours(row)
    theirs, own = normals[other], normals[row]
    inside = np.abs(row_dots(theirs, direction)) < _INSIDE
    alike = (np.abs(theirs @ theirs.transpose(0, 2, 1)) > _ALIKE) & inside[:, None] & inside[:, :, None]
    every, best = np.arange(len(row)), alike.sum(axis=2).argmax(axis=1)
    shared, first = alike[every, best], theirs[every, best]
    axes = unit(np.einsum("rk,rki->ri", shared * np.sign(row_dots(theirs, first[:, None])), theirs))

    present = (np.abs(row_dots(theirs, own[:, None])) > _ALIKE) & inside
    more = shared.sum(axis=1) >= present.sum(axis=1) + _MORE
    along = row_dots(direction, direction[every, best][:, None])
    wide = np.where(shared, 1 - along**2, 0.0).max(axis=1) > _WEDGE**2
    wide &= (shared & around.aside(row, direction)).any(axis=1)
    founded = more & wide & (np.abs(row_dots(axes, own)) < _UNLIKE)
    return row[founded], axes[founded]
