"""Signs handed on from neighbour to neighbour."""

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from ...linalg import symmetric


def spread_signs(links: csr_matrix) -> tuple[np.ndarray, np.ndarray]:
    """Signs (n,) of -1 and 1 that symmetric links (n,n), 1 between two of one sign and -1 between two that differ, hand
    on breadth-first from the first of each connected part, which has 1; and the number of that part, (n,)."""
    n = links.shape[0]
    parts, part = connected_components(links, directed=False)
    tail, head = links.nonzero()
    start, before_all = np.unique(part, return_index=True)[1], np.full(parts, n)
    ends = np.concatenate([tail, start, before_all]), np.concatenate([head, before_all, start])
    graph = coo_matrix((np.ones(len(ends[0]), bool), ends), shape=(n + 1, n + 1)).tocsr()
    visited, parent = breadth_first_order(graph, n, directed=False)
    visited, parent = visited[1:], parent[visited[1:]]
    sign, above = np.ones(n + 1), np.full(n + 1, n)
    inner = parent < n
    sign[visited[inner]] = np.asarray(links[visited[inner], parent[inner]]).reshape(-1)
    above[visited] = parent
    while (above < n).any():  # each looks twice as far up as before
        sign, above = sign * sign[above], above[above]
    return sign[:n], part


def spread_strongest(links: csr_matrix) -> tuple[np.ndarray, np.ndarray]:
    """The same of links (n,n) that differ in strength, along the strongest that connect all: positive between two of
    one sign, negative between two that differ."""
    order = abs(links)
    order.data = 2 * order.data.max(initial=0.0) - order.data
    tail, head = minimum_spanning_tree(order).nonzero()
    relation = np.sign(np.asarray(links[tail, head]).reshape(-1)) if len(tail) else np.empty(0)
    return spread_signs(symmetric(relation, tail, head, links.shape[0]))
