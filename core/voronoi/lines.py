"""How far samples on lines look for Voronoi neighbours: as far as the next line, where facets would end before. Nothing
would tell then how axes are turned about the line that they are on."""

import numpy as np
from scipy.spatial import KDTree

from ..neighbourhoods.lines import OTHERS, find_lines
from ..points import SPACING_NEIGHBOURS
from ..progress import Progress
from ..trees import nearest_others
from .facets import REACH

_BEYOND = 1.3  # times its distance, up to where facets reach
_CHUNK = 16384  # samples


def spacing_across_lines(points: np.ndarray, spacing: np.ndarray, progress=None) -> np.ndarray:
    """Local spacing (n,) of samples (n,3) from that given, (n,) in the same units: on lines so much more that facets
    reach the nearest sample of another line, or where there is none around, of their own to the side, if that is up to
    some 15 spacings away. The paper has all facets of the diagram, however far samples are apart.

    On a wavy sheet of parallel lines five local spacings apart, mean |n.n_true| was .25, now 1.0.
    """
    if len(points) <= OTHERS:
        return spacing
    tree = KDTree(points)
    nearest = nearest_others(tree, SPACING_NEIGHBOURS, Progress.of(progress))[1]
    lines, found = find_lines(points, spacing, nearest), spacing.copy()
    own = np.flatnonzero(lines.number >= 0)
    for first in range(0, len(own), _CHUNK):
        part = own[first : first + _CHUNK]
        found[part] = np.maximum(spacing[part], _BEYOND / REACH * lines.to_others(points, part, tree))
    return found
