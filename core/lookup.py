"""Whole numbers found in others and numbered: quick where they come in runs, as nodes and edges of a grid do."""

import numpy as np


def rows_of(wanted: np.ndarray, ascending: np.ndarray) -> np.ndarray:
    """Where numbers stand among others (n,), which ascend, of the shape of `wanted`; -1 for those that do not."""
    if not len(ascending):
        return np.full(wanted.shape, -1)
    row = np.minimum(np.searchsorted(ascending, wanted), len(ascending) - 1)
    return np.where(ascending[row] == wanted, row, -1)


def is_among(wanted: np.ndarray, ascending: np.ndarray) -> np.ndarray:
    """Which numbers are among others (n,), which ascend; of the shape of `wanted`, bool."""
    return rows_of(wanted, ascending) >= 0


def mask_of(rows: np.ndarray, n: int) -> np.ndarray:
    """Which of n items are among some rows, of any shape, (n,) bool."""
    found = np.zeros(n, bool)
    found[rows] = True
    return found


def numbered(keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The distinct ones of some numbers, ascending, and which of them each is, of the shape of `keys`. Asked for the
    first of each as well, NumPy sorts by merging, which is quick on runs."""
    distinct, _, number = np.unique(keys, return_index=True, return_inverse=True)
    return distinct, number.reshape(keys.shape)


def grouped(number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rows of some numbers (n,) from 0 on, those of equal ones together and in order, and where among them each
    group begins."""
    order = np.argsort(number, kind="stable")
    return order, np.flatnonzero(np.diff(number[order], prepend=-1))


def least_of_each(keys: np.ndarray, *costs: np.ndarray) -> np.ndarray:
    """Of each distinct one of some keys (n,) from 0 on, ascending, the row where the costs (n,) are least, the first
    cost before the next ones; the first row of equals."""
    order = np.lexsort((*costs[::-1], keys))
    return order[np.diff(keys[order], prepend=-1) > 0]


def sums_of_each(number: np.ndarray, rows: np.ndarray, count: int = 0) -> np.ndarray:
    """The sums of the rows (m,k) that have each number from 0 on, (m,), `count` of them at least, (count,k) float64."""
    return np.stack([np.bincount(number, x, count) for x in rows.T], axis=1)


def edge_keys(edges: np.ndarray, n: int) -> np.ndarray:
    """One number for each undirected edge between n vertices, (e,2) -> (e,) int64."""
    a, b = edges.astype(np.int64).T
    return np.minimum(a, b) * n + np.maximum(a, b)
