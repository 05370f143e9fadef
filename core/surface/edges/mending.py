"""Crossed grid edges, turned over until grid faces have even numbers of them, as under a surface without border."""

import numpy as np

from ...field.steps import NearBand
from ...lookup import grouped, numbered
from ...parts import connected_parts

_ROUNDS = 3
_MAJORITY = 3  # odd faces, of the four around an edge, that turn it over
_LONGEST = 32  # odd faces of a loop that is closed
_STEPS = 2  # per odd face, after which a loop is left as it was


def mend(band: NearBand, edge, crossed, certainty) -> None:
    """Turn over, in place, crossings that leave faces odd.

    edge    : (e,) int64, the edges that lie near the surface, 3 * row of their lower node in the band + direction; all
              corners of the cells around them are in the band, too
    crossed : (e,) bool     certainty : (e,) float64, the least certain edges turn first

    First edges most of whose faces are odd are turned over; edges that share a face never at once. This takes single
    notches and spurs off rims, too. The odd faces left form loops, because every cell has an even number of them: long
    ones are rims; short ones, pinholes and fringes, are shrunk edge by edge, and stay where they do not vanish.
    """
    faces = _faces(band, edge)
    crossings = np.bincount(faces[:, crossed].reshape(-1), minlength=3 * len(band.node)).astype(np.int8)
    groups = [(group, faces[:, group]) for group in _apart(band, edge)]
    for group, theirs in groups * _ROUNDS:
        turned = group[(crossings.take(theirs) & 1).sum(axis=0, dtype=np.int8) >= _MAJORITY]
        _turn(turned, faces, crossed, crossings)
    number = np.full(crossings.size, -1)
    number[edge] = np.arange(len(edge))
    loops = _short_loops(band, np.flatnonzero(crossings & 1))
    _shrink_loops(lambda face: number[_around(band, face)], faces, crossed, crossings, certainty, loops)


def odd_faces(band: NearBand, edge) -> np.ndarray:
    """Grid faces, 3 * row of their lowest node in the band + direction across, with an odd number of the edges (e,)."""
    return np.flatnonzero(np.bincount(_faces(band, edge).reshape(-1)) & 1)


def _faces(band, edge):
    """The four grid faces at each edge, 3 * row of their lowest node in the band + direction across, (4,e)."""
    row, axis = np.divmod(edge, 3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    below, beside = band.behind[first, row], band.behind[second, row]
    return np.stack([3 * row + second, 3 * below + second, 3 * row + first, 3 * beside + first])


def _around(band, face):
    """The four edges around each face (f,), (4,f)."""
    row, across = np.divmod(face, 3)
    first, second = (across + 1) % 3, (across + 2) % 3
    above, beside = band.ahead[second, row], band.ahead[first, row]
    return np.stack([3 * row + first, 3 * above + first, 3 * row + second, 3 * beside + second])


def _apart(band, edge):
    """The edges, (e,) in twelve groups, no two of which share a face."""
    row, axis = np.divmod(edge, 3)
    at = np.stack(np.unravel_index(band.node, band.shape)) % 2
    colour = (4 * axis + 2 * at[(axis + 1) % 3, row] + at[(axis + 2) % 3, row]).astype(np.int8)
    return [np.flatnonzero(colour == c) for c in range(12)]


def _shrink_loops(around, faces, crossed, crossings, certainty, loops):
    """Turn over edges of two odd faces or more until the loop is gone, none twice for one loop. Edges at a face with
    three crossings or more may be turned off, others on only, so that no small sheet shrinks.

    around : function that gives the edges around faces (f,), (4,f), -1 for those that are not near the surface
    """
    fresh = np.ones(len(crossed), bool)
    for loop in loops:
        odd = {face for face in loop.tolist() if crossings[face] & 1}
        turned = []
        while odd and len(turned) < _STEPS * len(loop):
            edge = np.unique(around(np.array(list(odd))))
            edge = edge[(edge >= 0) & fresh[edge]]
            crowd = crossings[faces[:, edge]]
            gain = (crowd & 1).sum(axis=0) * (~crossed[edge] | (crowd.max(axis=0) >= 3))
            if gain.max(initial=0) < 2:
                break
            best = edge[np.lexsort([certainty[edge], -gain])[:1]]
            turned.append(best)
            fresh[best] = False
            _turn(best, faces, crossed, crossings)
            for face in faces[:, best[0]].tolist():
                (odd.add if crossings[face] & 1 else odd.discard)(face)
        for edge in turned:
            fresh[edge] = True
            if odd:
                _turn(edge, faces, crossed, crossings)


def _turn(edge, faces, crossed, crossings):
    """Turn over edges that share no face."""
    crossed[edge] ^= True
    crossings[faces[:, edge]] += np.where(crossed[edge], 1, -1).astype(np.int8)


def _short_loops(band, odd):
    """Loops of the odd faces (o,) that go from cell to cell: arrays of at most 32 of them."""
    row, across = np.divmod(odd, 3)
    cell, at = numbered(np.stack([row, band.behind[across, row]]))
    part = connected_parts(*at, len(cell))[at[0]]
    order, first = grouped(part)
    loops = np.split(odd[order], first[1:])
    return [loop for loop in loops if 0 < len(loop) <= _LONGEST]
