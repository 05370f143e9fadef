"""Triangles that span closed polygons in space."""

import numpy as np

from ...lookup import edge_keys, mask_of

_FAIR = 0.1  # weight of the squared sides of a triangle beside its area
_BOUND, _THERE = 1e2, 1e6  # square cells, what an edge and a face count that the mesh has already
_CHUNK = 1 << 20  # triples of corners that are weighed at a time


def fillings(vertices, loops, edges, faces, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (t,3) between the vertices of each loop, an array of indices (l,) into `vertices` (v,3), and the number
    of their loop (t,).

    Those with the least sum of areas and a tenth of their squared sides, found by dynamic programming (Barequet and
    Sharir, CAGD 12(2), 1995). The `edges` (e,2) that there are, are passed by where that can be helped; a loop that
    cannot be spanned without one of the `faces` (f,3) that there are gets no triangles.
    """
    at_loop = mask_of(np.concatenate(loops), len(vertices))
    vertex, number = np.flatnonzero(at_loop), np.cumsum(at_loop) - 1
    edges, faces = (number[some[at_loop[some].all(axis=1)]] for some in (edges, faces))
    triangle, loop = _fillings(vertices[vertex], [number[loop] for loop in loops], edges, faces, cell)
    return vertex[triangle], loop


def _fillings(vertices, loops, edges, faces, cell):
    n = len(vertices)
    taken_edges, taken_faces = edge_keys(edges, n), _face_keys(faces, n)
    triangles, owners = [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)]
    length = np.array([len(loop) for loop in loops])
    for number in _of_one_length(length):
        size = length[number[0]]
        loop = np.stack([loops[i] for i in number])
        at = np.indices((size,) * 3).reshape(3, -1)
        at = at[:, (at[0] < at[1]) & (at[1] < at[2])]
        corners = np.stack([loop[:, i] for i in at], axis=2)
        p, q, r = (vertices[corners[..., k]] / cell for k in range(3))
        area = 0.5 * np.linalg.norm(np.cross(q - p, r - p), axis=2)
        squares = sum(((a - b) ** 2).sum(axis=2) for a, b in ((p, q), (q, r), (r, p)))
        there = np.isin(_face_keys(corners.reshape(-1, 3), n), taken_faces).reshape(area.shape)
        weight = np.full((len(number), size, size, size), np.inf)
        weight[:, at[0], at[1], at[2]] = area + _FAIR * squares + _THERE * there
        chord = np.stack(np.triu_indices(size, 2), axis=1)
        chord = chord[(chord != [0, size - 1]).any(axis=1)]
        bound = np.isin(edge_keys(loop[:, chord].reshape(-1, 2), n), taken_edges).reshape(len(number), -1)
        dear = np.zeros((len(number), size, size))
        dear[:, chord[:, 0], chord[:, 1]] = _BOUND * bound
        found, total = _cheapest(weight, dear)
        kept = total < _THERE
        triangles.append(loop[np.arange(len(number))[:, None, None], found][kept].reshape(-1, 3))
        owners.append(np.repeat(number[kept], size - 2))
    return np.concatenate(triangles), np.concatenate(owners)


def _face_keys(faces, n):
    """One number for each triangle between n vertices, at most 2^21, whichever way it is wound, (f,3) -> (f,) int64."""
    a, b, c = np.sort(faces, axis=1).astype(np.int64).T
    return (a * n + b) * n + c


def _of_one_length(length):
    """Numbers of loops of one length, by the lengths (m,) of all; so many at a time that they fit the memory."""
    for size in np.unique(length):
        number = np.flatnonzero(length == size)
        yield from np.split(number, range(_CHUNK // size**3 + 1, len(number), _CHUNK // size**3 + 1))


def _cheapest(weight, dear):
    """The cheapest triangulations of m polygons with n corners, (m,n-2,3), and what they cost, (m,); by the weights of
    triangles i < j < k, (m,n,n,n), and what their sides i < k count beside that, (m,n,n)."""
    m, n = weight.shape[:2]
    cost, apex = np.zeros((m, n, n)), np.zeros((m, n, n), np.int64)
    for span in range(2, n):
        i = np.arange(n - span)
        j, k = i[:, None] + np.arange(1, span), i + span
        among = cost[:, i[:, None], j] + cost[:, j, k[:, None]] + weight[:, i[:, None], j, k[:, None]]
        best = among.argmin(axis=2)
        apex[:, i, k] = i + 1 + best
        cost[:, i, k] = np.take_along_axis(among, best[..., None], axis=2)[..., 0] + dear[:, i, k]
    triangles = np.empty((m, n - 2, 3), np.int64)
    for row in range(m):
        spans, count = [(0, n - 1)], 0
        while spans:
            i, k = spans.pop()
            if k - i > 1:
                j = apex[row, i, k]
                triangles[row, count] = i, j, k
                count += 1
                spans += [(i, j), (j, k)]
    return triangles, cost[:, 0, n - 1]
