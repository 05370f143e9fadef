"""Connected parts of graphs, and of places that lie next to each other."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from .lookup import grouped


def connected_parts(one: np.ndarray, other: np.ndarray, n: int) -> np.ndarray:
    """The number of the part that each of n items is in, (n,) int32, counted from 0 on as they come: the parts that
    pairs (e,) of items connect."""
    return connected_components(coo_matrix((np.ones(len(one), bool), (one, other)), shape=(n, n)), directed=False)[1]


def near_parts(places: np.ndarray, reach: float) -> np.ndarray:
    """The number of the part that each of some places (m,3) is in, (m,), as :func:`connected_parts`: the parts that
    those within `reach` of each other make up."""
    if not len(places):
        return np.empty(0, np.int32)
    return connected_parts(*KDTree(places).query_pairs(reach, output_type="ndarray").T, len(places))


def extents(part: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Diagonals of the boxes around the places (m,3) of each part, which have its number, (m,); one for each part."""
    order, first = grouped(part)
    extent = np.maximum.reduceat(places[order], first) - np.minimum.reduceat(places[order], first)
    return np.linalg.norm(extent, axis=1)
