"""Samples that fill a volume, as particles of a fluid do: told from those around a surface, and what bounds them."""

import numpy as np
from scipy.spatial import KDTree

from ..linalg import row_dots
from ..trees import k_nearest
from ..voronoi.facets import by_blocks
from .anchors import some_samples
from .surroundings import thickness

_FEWEST, _ASKED = 256, 500  # samples
_LEAST = 64  # neighbours: among fewer any noise fills a volume
_FILLED = 2.5  # pointwise dimension; 2.55 to 2.9 in solids, 1.9 to 2.4 in noise of up to two spacings on surfaces
_THICK, _NEXT = 0.32, 12  # thickness over size of a sample and those next to it; .37 to .47 in solids, .04 to .26 in
# stacks of sheets 2.4 spacings apart with noise of up to .3
_AMONG = 32  # neighbours, of which noise has some far away, in its tails
_EVEN = 0.125  # deviation of the logarithm of the radius that holds these; .08 to .113 in solids, .13 to .18 in noise
# that drowns what is between surfaces
_HOLLOW = 2.2  # median spacings, radius of an empty ball outside; to one of 1.5 solids have pores


def fills_volume(points, neighbours: int, seed: int) -> tuple[bool, bool]:
    """Whether samples (n,3) fill a volume, rather than lie around a surface with noise that is averaged over so many
    `neighbours`; and whether they do so evenly, as what is solid does and noise of several sheets does not.

    Told by their pointwise dimension (J. D. Farmer, E. Ott and J. A. Yorke, Physica D 7, 1983): a radius that is twice
    as large has 2^d times as many of them around a sample. Noise fills what is as thin as it is, and no more. In many
    sheets side by side the nearest ones lie on one, so those are flat.
    """
    if len(points) < _FEWEST:
        return False, False
    most = min(max(neighbours, _LEAST), len(points) - 1)
    least, asked = most // 4, points[some_samples(points, min(_ASKED, len(points)), seed)]
    tree = KDTree(points)
    near, some, far = np.log(tree.query(asked, k=[least + 1, _AMONG + 1, most + 1], workers=-1)[0].T)
    widens = np.median(far - near) < np.log(most / least) / _FILLED
    filled = widens and np.median(thickness(points[k_nearest(tree, asked, _NEXT)[1]])) > _THICK
    return bool(filled), bool(some.std() < _EVEN)


def bounds_volume(points, spacing, seed: int, progress=None) -> np.ndarray:
    """Which of the samples (n,3), of local spacing (n,), that fill a volume bound it, (n,) bool: those that an empty
    ball of some spacings touches, the vertices of their alpha-shape (H. Edelsbrunner and E. P. Muecke, ACM Transactions
    on Graphics 13(1), 1994)."""
    bounds, radius = np.zeros(len(points), bool), _HOLLOW * np.median(spacing)
    for touched in by_blocks(lambda sides: _touched(sides, points, radius), points, spacing, seed, progress):
        bounds[touched] = True
    return bounds


def _touched(sides, points, radius):
    """The pairs of which a facet has a corner, the centre of an empty ball, farther from them than a radius."""
    half = 0.5 * (points[sides.j] - points[sides.i])
    far = row_dots(sides.head, sides.head) + row_dots(half, half) > radius**2
    return np.concatenate([sides.i[far], sides.j[far]])
