"""Connected parts of graphs."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def connected_parts(one: np.ndarray, other: np.ndarray, n: int) -> np.ndarray:
    """The number of the part that each of n items is in, (n,) int32, counted from 0 on as they come: the parts that
    pairs (e,) of items connect."""
    return connected_components(coo_matrix((np.ones(len(one), bool), (one, other)), shape=(n, n)), directed=False)[1]
