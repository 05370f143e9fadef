"""Noisy samples where sheets meet, moved onto one of these.

A quadric through the neighbours on both faces of an edge lies between them, and the sharper the edge the farther from
either. But quadrics of some of the neighbours are of one face alone. So such a sample takes, of the planes of its
neighbours, the one that most of the others around lie on, as far as the noise lets them, and then the quadric through
those (as votes for planes keep edges; S. Fleishman, D. Cohen-Or and C. Silva, ACM TOG 24(3), 2005). It keeps its own
where the one found holds hardly more of the neighbours.
"""

import numpy as np
from scipy.spatial import KDTree

from ..linalg import dots, row_dots
from ..neighbourhoods.quadrics import in_frames, off_fit, onto_quadrics, over_planes, weighted_fit
from ..parallel import even_chunks, work_through
from ..progress import Progress

_SPREAD = 1.1  # levels of noise, that neighbours are off a quadric through all of them where it may not be of one sheet
_NEIGHBOURS = 128  # at most
_PLANES = 16  # of theirs that are tried, from near ones to far ones
_WITHIN = 1.5  # levels of noise, beyond which a neighbour is off a sheet
_MORE = 0.03  # of the neighbours, see :func:`_held`, that one sheet holds more than the quadric of all
_LIKELY = 0.1  # of them, by which a plane may hold less than that, as the sheet through it may bend
_ROUNDS = 3
_STIFF = np.array([1e-6, 1e-6, 1e-6, 0.03, 0.03, 0.03])  # of 1, x, y, xx, xy, yy: a sheet seen on one side hardly bends
_EXACT = 1e-6  # radii, less is rounding
_CHUNK = 2048  # samples


def onto_one_sheet(points, rows, neighbours: int, fitted, level, progress=None) -> np.ndarray:
    """Steps of samples `rows` (m,) of points (n,3) onto the quadrics of the sheets that they lie on, (m,3) float64.

    neighbours : that are looked at around each, 128 at most
    fitted     : steps and normals, (n,3) each, of quadrics through all neighbours, and the spread off these, (n,)
    level      : (n,) float64, standard deviation of the noise, same units as the points

    Those of samples on one sheet alone, by that spread or by the neighbours, are the fitted ones.
    """
    step, normal, spread = fitted
    found, tree, k = step[rows], KDTree(points), min(neighbours, _NEIGHBOURS, len(points))
    chosen = np.flatnonzero(spread[rows] > _SPREAD * level[rows])

    def move(part):
        own = rows[chosen[part]]
        distance, near = tree.query(points[own], k=k)
        radius = np.maximum(distance[:, -1], np.finfo(float).tiny)
        held, there = _of_one_sheet(points, step, normal, own, near, distance, radius, _WITHIN * level[own] / radius)
        found[chosen[part][held]] = there[held]

    work_through(move, even_chunks(len(chosen), _CHUNK, Progress.of(progress)))
    return found


def _of_one_sheet(points, step, normal, own, near, distance, radius, within):
    """Which of samples `own` (m,) one sheet holds more neighbours of, `near` (m,k), than a quadric through all, (m,)
    bool, and the steps onto that sheet, (m,3); within a distance (m,), in radii."""
    offset = [((x[near] - x[own, None]) / radius[:, None]).astype(np.float32) for x in points.T]
    _, _, basis, weight, height = in_frames(offset, (distance / radius[:, None]).astype(np.float32))
    weight /= np.einsum("mk->m", weight)[:, None]
    within = np.maximum(within, _EXACT)[:, None].astype(np.float32)
    of_all = _held(off_fit(weighted_fit(basis, weight, height)[0], basis, height), weight, within)

    best, plane, above = np.zeros(len(own)), np.zeros((len(own), 3)), np.zeros(len(own))
    for other in near[:, np.linspace(1, near.shape[1] - 1, _PLANES).astype(int)].T:
        axis = normal[other]
        over = row_dots(points[other] + step[other] - points[own], axis) / radius
        held = _held(_heights(offset, axis) - over[:, None].astype(np.float32), weight, within)
        better = axis.any(axis=1) & (held > best) & (np.abs(over) < within[:, 0])
        best[better], plane[better], above[better] = held[better], axis[better], over[better]

    row = np.flatnonzero(best > np.maximum(of_all - _LIKELY, 0))
    steps, more = np.zeros((len(own), 3)), np.zeros(len(own), bool)
    offset, weight, within, radius = [x[row] for x in offset], weight[row], within[row], radius[row]
    frame, basis, height = over_planes(offset, plane[row])
    residual = height - above[row, None].astype(np.float32)
    for _ in range(_ROUNDS):
        on = np.maximum(1 - (residual / within) ** 2, 0) ** 2  # Tukey's biweight
        coefficients = weighted_fit(basis, weight * on + np.finfo(np.float32).tiny, height, _STIFF)[0]
        residual = off_fit(coefficients, basis, height)
    steps[row], length, _ = onto_quadrics(coefficients, plane[row], frame, radius)
    more[row] = (_held(residual, weight, within) > of_all[row] + _MORE) & (length < 2 * within[:, 0] * radius)
    return more, steps


def _held(residual, weight, within):
    """The share of neighbours with weights (m,k) that lie within (m,1) of a sheet that they are off by (m,k), the
    closer the more, (m,)."""
    return np.einsum("mk,mk->m", weight, np.maximum(1 - (residual / within) ** 2, 0))


def _heights(offset, axis):
    return dots(offset, axis.T[:, :, None].astype(np.float32))
