"""Crossed grid edges, turned over until grid faces have even numbers of them, as under a surface without border."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..lookup import numbered

_ROUNDS = 3
_MAJORITY = 3  # odd faces, of the four around an edge, that turn it over
_LONGEST = 32  # odd faces of a loop that is closed
_STEPS = 2  # per odd face, after which a loop is left as it was


def mend(node, axis, crossed, certainty, strides) -> None:
    """Turn over, in place, crossings that leave faces odd.

    node, axis : (e,) int64, the edges that lie near the surface, by their lower node and direction
    crossed    : (e,) bool     certainty : (e,) float64, the least certain edges turn first
    strides    : (3,) steps of the flat node index

    First edges most of whose faces are odd are turned over; edges that share a face never at once. This takes single
    notches and spurs off rims, too. The odd faces left form loops, because every cell has an even number of them: long
    ones are rims; short ones, pinholes and fringes, are shrunk edge by edge, and stay where they do not vanish.
    """
    size = int(node.max(initial=0)) + 1
    key, faces = _faces(node, axis, size, strides)
    crossings = np.bincount(faces[crossed].reshape(-1), minlength=len(key))
    for group in _apart(node, axis, strides) * _ROUNDS:
        turned = group[(crossings[faces[group]] % 2).sum(axis=1) >= _MAJORITY]
        change = np.where(crossed[turned], -1, 1)[:, None]
        np.add.at(crossings, faces[turned], change)
        crossed[turned] ^= True
    odd = np.flatnonzero(crossings % 2)
    loops = [odd[loop] for loop in _short_loops(key[odd], size, strides)]
    _shrink_loops(faces, crossed, crossings, certainty, loops)


def _faces(node, axis, size, strides):
    """Distinct keys of grid faces, direction across * size + lowest node, and which four are at each edge, (e,4)."""
    sides = [(axis + 1) % 3, (axis + 2) % 3]
    faces = [across * size + node - back * strides[along] for along, across in (sides, sides[::-1]) for back in (0, 1)]
    return numbered(np.stack(faces, axis=1))


def _apart(node, axis, strides):
    """The edges, (e,) in twelve groups, no two of which share a face."""
    at = np.stack([node // strides[0], node % strides[0] // strides[1], node % strides[1]], axis=1) % 2
    every = np.arange(len(node))
    colour = 4 * axis + 2 * at[every, (axis + 1) % 3] + at[every, (axis + 2) % 3]
    return [np.flatnonzero(colour == c) for c in range(12)]


def _shrink_loops(faces, crossed, crossings, certainty, loops):
    """Turn over edges of two odd faces or more until the loop is gone. Edges at a face with three crossings or more may
    be turned off, others on only, so that no small sheet shrinks."""
    by_face = np.argsort(faces.reshape(-1), kind="stable") // 4
    first = np.concatenate([[0], np.cumsum(np.bincount(faces.reshape(-1), minlength=len(crossings)))])
    for loop in loops:
        odd = {face for face in loop.tolist() if crossings[face] % 2}
        turned = []
        while odd and len(turned) < _STEPS * len(loop):
            edge = np.unique(np.concatenate([by_face[first[face] : first[face + 1]] for face in odd]))
            edge = edge[~np.isin(edge, turned)]
            edge = edge[~crossed[edge] | (crossings[faces[edge]] >= 3).any(axis=1)]
            gain = (crossings[faces[edge]] % 2).sum(axis=1)
            if gain.max(initial=0) < 2:
                break
            best = edge[np.lexsort([certainty[edge], -gain])[0]]
            turned.append(best)
            _turn(best, faces, crossed, crossings)
            for face in faces[best].tolist():
                (odd.add if crossings[face] % 2 else odd.discard)(face)
        if odd:
            for edge in turned:
                _turn(edge, faces, crossed, crossings)


def _turn(edge, faces, crossed, crossings):
    crossed[edge] ^= True
    crossings[faces[edge]] += 1 if crossed[edge] else -1


def _short_loops(key, size, strides):
    """Loops of the odd faces with keys (o,) that go from cell to cell: arrays of at most 32 indices into `key`."""
    across, node = np.divmod(key, size)
    cell, at = numbered(np.concatenate([node, node - strides[across]]))
    graph = coo_matrix((np.ones(len(key), bool), tuple(at.reshape(2, -1))), shape=(len(cell),) * 2)
    _, part = connected_components(graph, directed=False)
    part = part[at[: len(key)]]
    order = np.argsort(part, kind="stable")
    loops = np.split(order, np.flatnonzero(np.diff(part[order])) + 1)
    return [loop for loop in loops if 0 < len(loop) <= _LONGEST]
