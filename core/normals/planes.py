"""Planes that samples on creases or next to them lie in, told from places alone.

On a crease the axes around a sample say little: those of two sheets are there, those of other samples on the crease,
and those next to it that lean on these. Of the samples on the edges of a cube's lattice the sweeps took most to the
plane that halves the solid along the edge. Where the sheets are flat, the places tell: many of the neighbours lie in
one plane with the sample, to within rounding, which chance does not do.

Lines along which a surface was cut lie in the planes of the cuts, too, and any two neighbouring lines in a common one.
In the first the axes of all neighbours are at right angles to that of the plane; in the second there is no third line.
"""

from functools import partial

import numpy as np

from ..linalg import row_dots
from ..parallel import in_order
from ..progress import Progress
from .around import Around

_NEAREST = 8  # pairs of these and the sample make the planes that are tried
_WEDGE = 0.3  # least sine of the angle between two
_INSIDE, _EXACTLY = 0.007, 0.001  # of the Gaussian of the sine by which neighbours rise out of a plane
_SHARE = 0.35  # least share of the neighbours, by weight, in a plane
_GAIN = 0.1  # by which it must exceed the share in that of the present axis
_FEWEST, _FEWEST_ON_LINES = 6.0, 12.0  # neighbours that must lie in it
_ALIKE = 0.2  # their mean squared cosine with its axis, at least: lines on a wavy sheet lie in planes as well


def onto_planes(around: Around, normals, suspect, leaning, progress=None):
    """The axes (n,3) after those of samples `suspect` (n,) bool are taken to the plane in which most of their
    neighbours lie, where there are enough, and those of others `leaning` (n,) bool where these lie in it more exactly;
    and which these are, (n,) bool.

    around : of all samples     normals : (n,3) unit axes
    """
    progress, turned, moved = Progress.of(progress), normals.copy(), np.zeros(len(normals), bool)
    for chosen, inside in ((suspect, _INSIDE), (leaning & ~suspect, _EXACTLY)):
        look = partial(_fullest, around=around, normals=normals, within=inside)
        for row, (axes, founded) in in_order(look, progress.each(around.parts(np.flatnonzero(chosen)))):
            turned[row[founded]], moved[row[founded]] = axes[founded], True
    return turned, moved


def _fullest(row, around, normals, within):
    """Axes (r,3) of the planes through samples `row` (r,) with most of their neighbours in them, and whether these are
    enough, (r,) bool; `within` such a Gaussian of the sine."""
    other, direction, near = around.neighbours(row)
    near /= near.sum(axis=1)[:, None]

    one, two = np.triu_indices(min(_NEAREST, near.shape[1]), 1)
    axes = np.cross(direction[:, one], direction[:, two])
    sine = np.linalg.norm(axes, axis=2)
    axes = np.concatenate([normals[row, None], axes / np.maximum(sine, _WEDGE)[..., None]], axis=1)
    inside = np.exp(-0.5 * (axes @ direction.transpose(0, 2, 1) / within) ** 2)
    share = (inside @ near[..., None])[..., 0]
    share[:, 1:][sine < _WEDGE] = 0
    full = share > _SHARE
    full[:, 0] = full.any(axis=1)
    of, plane = np.nonzero(full)
    weight = inside[of, plane] * near[of]
    alike = row_dots(weight, row_dots(axes[of, plane][:, None], normals[other[of]]) ** 2)
    founded = around.are_founded(row[of], other[of], direction[of], axes[of, plane], weight)
    founded &= alike >= _ALIKE * share[of, plane]
    share[of[~founded], plane[~founded]] = 0

    every, best = np.arange(len(row)), share.argmax(axis=1)
    most = share[every, best]
    enough = inside[every, best].sum(axis=1) > np.where(around.are_on_lines(row), _FEWEST_ON_LINES, _FEWEST)
    founded = (most > share[:, 0] + _GAIN) & (most > _SHARE) & enough
    return axes[every, best], founded
