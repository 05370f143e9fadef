"""Planes that samples on creases or next to them lie in, told from places alone.

On a crease the axes around a sample say little: those of two sheets are there, those of other samples on the crease,
and those next to it that lean on these. Of the samples on the edges of a cube's lattice the sweeps took most to the
plane that halves the solid along the edge. Where the sheets are flat, the places tell: many of the neighbours lie in
one plane with the sample, to within rounding, which chance does not do.
"""

from functools import partial

import numpy as np
from scipy.spatial import KDTree

from ..parallel import in_order

_NEIGHBOURS = 20  # of a sample, that may lie on its sheet
_WIDTH = 1.7  # of the Gaussian of their distance, local spacings
_NEAREST = 8  # pairs of these and the sample make the planes that are tried
_WEDGE = 0.3  # least sine of the angle between two
_INSIDE, _EXACTLY = 0.007, 0.001  # of the Gaussian of the sine by which neighbours rise out of a plane
_SHARE = 0.35  # least share of the neighbours, by weight, in a plane
_GAIN = 0.1  # by which it must exceed the share in that of the present axis
_FEWEST = 6.0  # neighbours that must lie in it
_CHUNK = 256  # samples


def neighbourhoods(row, points, spacing, tree: KDTree):
    """The neighbours that may lie on the sheets of samples `row` (r,), nearest first: their numbers (r,k), the unit
    directions to them (r,k,3), and how near they are, (r,k) in [0,1]."""
    distance, other = tree.query(points[row], k=min(_NEIGHBOURS + 1, len(points)))
    distance, other = distance[:, 1:], other[:, 1:]
    direction = (points[other] - points[row, None]) / distance[..., None]
    return other, direction, np.exp(-((distance / (_WIDTH * spacing[row, None])) ** 2))


def onto_planes(points, spacing, tree: KDTree, normals, suspect, leaning):
    """The axes (n,3) after those of samples `suspect` (n,) bool are taken to the plane in which most of their
    neighbours lie, where there are enough, and those of others `leaning` (n,) bool where these lie in it more exactly;
    and which these are, (n,) bool.

    points : (n,3) float64     spacing : (n,) local spacing     tree : of the points     normals : (n,3) unit axes
    """
    turned, moved = normals.copy(), np.zeros(len(points), bool)
    for chosen, inside in ((suspect, _INSIDE), (leaning & ~suspect, _EXACTLY)):
        look = partial(_fullest, points=points, spacing=spacing, tree=tree, normals=normals, within=inside)
        for row, (axes, founded) in in_order(look, parts_of(chosen)):
            turned[row[founded]], moved[row[founded]] = axes[founded], True
    return turned, moved


def parts_of(chosen):
    """The numbers of the samples `chosen`, (n,) bool, in parts of at most 256."""
    row = np.flatnonzero(chosen)
    return np.split(row, range(_CHUNK, len(row), _CHUNK))


def _fullest(row, points, spacing, tree, normals, within):
    """Axes (r,3) of the planes through samples `row` (r,) with most of their neighbours in them, and whether these are
    enough, (r,) bool; `within` such a Gaussian of the sine."""
    _, direction, near = neighbourhoods(row, points, spacing, tree)
    near /= near.sum(axis=1)[:, None]

    one, two = np.triu_indices(min(_NEAREST, near.shape[1]), 1)
    axes = np.cross(direction[:, one], direction[:, two])
    sine = np.linalg.norm(axes, axis=2)
    axes = np.concatenate([normals[row, None], axes / np.maximum(sine, _WEDGE)[..., None]], axis=1)
    inside = np.exp(-0.5 * (axes @ direction.transpose(0, 2, 1) / within) ** 2)
    share = np.einsum("rtk,rk->rt", inside, near)
    share[:, 1:][sine < _WEDGE] = 0

    every, best = np.arange(len(row)), share.argmax(axis=1)
    most = share[every, best]
    founded = (most > share[:, 0] + _GAIN) & (most > _SHARE) & (inside[every, best].sum(axis=1) > _FEWEST)
    return axes[every, best], founded
