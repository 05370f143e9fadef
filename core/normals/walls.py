"""Normals of sheets side by side, closer than the samples on each, as the two of a thin wall.

Many Voronoi neighbours of a sample lie on the other sheet, not straight across but some way along, and the mirror
images of their axes are turned by about the angle between the way there and the sheet. But as sheets are parallel, the
quadric through all neighbours, on both, runs in the middle of the wall and is turned as its sheets are. By its axes it
can be told how close the sheets are (see :func:`sheet_room`), then which neighbours lie across, and the sweeps go on
without these. That gives better axes than the quadric's, by which more of the sheets are told apart, and so on. They
are kept where two sheets were found, unless the neighbours on the sheet of a sample are farther off it by them than by
the old axes, as near corners; and beside such places where these are less far off.

The paper has no such step. Where no sheets run close it changes nothing.
"""

import numpy as np

from ..linalg import dots
from ..neighbourhoods.close_sheets import PARALLEL, off_neighbours, off_sheets, sheet_room
from ..neighbourhoods.cloud import Cloud
from ..neighbourhoods.quadrics import fit_quadrics
from ..progress import Progress
from .creases import agreed_share
from .mirrors import Mirrors
from .reflection import sweeps_over

_NEIGHBOURS = 48  # on both sheets
_ROUNDS, _SWEEPS = 3, 8
_OWN = 6  # neighbours on the sheet of a sample, how far off that they are says how well axes suit
_WORSE, _BETTER = 1.3, 0.8  # times as far as by the old axes, at most, where sheets were told apart, and beside that


def normals_of_walls(points, spacing, mirrors: Mirrors, normals, fixed=(), progress=None):
    """Axes like those that the sweeps end with, but for samples of sheets that run close beside others.

    points  : (n,3) float64     spacing : (n,) float64, local spacing, same units     mirrors : of the points
    normals : (n,3) unit axes   fixed   : rows that stay as they are
    Returns axes (n,3), and the mirrors without the neighbours across.
    """
    progress = Progress.of(progress)
    fixed = np.isin(np.arange(len(points)), fixed)
    rows = mirrors.and_around(agreed_share(mirrors, normals, fixed)[1])
    here = mirrors.and_around(mirrors.and_around(rows))
    rows &= ~fixed
    if not rows.any():
        return normals, mirrors
    fitted = fit_quadrics(points, np.flatnonzero(rows), min(_NEIGHBOURS, len(points)), progress.part(0.0, 0.5))
    found, near = normals.copy(), mirrors.at(here)
    found[rows] = fitted.normal
    cloud = Cloud.of(points[here], normals[here], spacing[here], progress.part(0.5, 0.6))

    def room_by(axes):
        room = np.full(len(points), np.inf)
        room[here] = sheet_room(cloud.turned(axes[here]))
        return room

    room = room_by(found)
    for _ in progress.part(0.6, 1.0).each(range(_ROUNDS)):
        if np.isinf(room).all():
            return normals, mirrors
        parted = near.without(_across(near, points, found, room))
        found = sweeps_over(parted, found, np.isfinite(room) & ~fixed, _SWEEPS)
        room = room_by(found)

    known = np.isfinite(room[here])
    beside = known | (known[cloud.neighbours].any(axis=1) & rows[here])
    found_off, old_off = (_off_own_sheet(cloud, axes[here], beside) for axes in (found, normals))
    kept = np.zeros(len(points), bool)
    kept[np.flatnonzero(here)[beside]] = found_off < np.where(known[beside], _WORSE, _BETTER) * old_off
    normals = np.where(kept[:, None], found, normals)
    return normals, mirrors.without(_across(mirrors, points, normals, np.where(kept, room, np.inf)))


def _across(mirrors, points, normals, room):
    """Which neighbours, (p,) bool, lie on the sheet beside that of the sample, by the room (n,) of either."""
    least = np.minimum(room.take(mirrors.site), room.take(mirrors.other))
    asked = np.flatnonzero(np.isfinite(least))
    site, other = mirrors.site[asked], mirrors.other[asked]
    step, own, theirs = (points[other] - points[site]).T, normals[site].T, normals[other].T
    agreement = dots(own, theirs)
    off = off_sheets(step, agreement, dots(step, own), theirs)
    across = np.zeros(len(least), bool)
    across[asked] = (np.abs(agreement) > PARALLEL) & (off > least[asked])
    return across


def _off_own_sheet(cloud, normals, rows):
    """How far those neighbours of some samples, `rows` (n,) bool, that are least off the sheet of each by axes (n,3)
    are off it, (r,)."""
    _, _, off = off_neighbours(cloud.points.T, normals.T, rows, cloud.neighbours[rows])
    return np.sort(off, axis=1)[:, :_OWN].mean(axis=1)
