"""Noisy samples where sheets meet, moved onto one of these.

A quadric through the neighbours on both faces of an edge lies between them, and the sharper the edge the farther from
either. But quadrics of some of the neighbours are of one face alone. So such a sample takes, of the planes of its
neighbours, the one that most of the others around lie on, as far as the noise lets them, and then the quadric through
those (as votes for planes keep edges; S. Fleishman, D. Cohen-Or and C. Silva, ACM TOG 24(3), 2005). It keeps its own
where the one found holds hardly more of the neighbours.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..linalg import dots, row_dots
from ..neighbourhoods.quadrics import EXACT, STIFFNESS, in_frames, off_fit, onto_quadrics, over_planes, weighted_fit
from ..parallel import even_chunks, work_through
from ..progress import Progress
from ..records import picked

_SPREAD = 1.2  # levels of noise, that neighbours are off a quadric through all of them where it may not be of one sheet
_NEIGHBOURS = 128  # at most
_PLANES = 16  # of theirs that are tried, from near ones to far ones
_WITHIN = 1.5  # levels of noise, beyond which a neighbour is off a sheet
_MORE = 0.03  # of the neighbours, see :func:`_held`, that one sheet holds more than the quadric of all
_LIKELY = 0.1  # of them, by which a plane may hold less than that, as the sheet through it may bend
_ROUNDS = 3
_STIFF = np.repeat([STIFFNESS, 0.03], 3)  # of 1, x, y and xx, xy, yy: a sheet seen on one side hardly bends
_CHUNK = 2048  # samples


def onto_one_sheet(tree: KDTree, rows, neighbours: int, fitted, level, progress=None) -> np.ndarray:
    """Steps of samples `rows` (m,) of the points (n,3) of a tree onto quadrics of the sheets that they lie on, (m,3)
    float64.

    neighbours : that are looked at around each, 128 at most
    fitted     : steps and normals, (n,3) each, of quadrics through all neighbours, and the spread off these, (n,)
    level      : (n,) float64, standard deviation of the noise, same units as the points

    Those of samples on one sheet alone, by that spread or by the neighbours, are the fitted ones.
    """
    step, normal, spread = fitted
    found, points, k = step[rows], tree.data, min(neighbours, _NEIGHBOURS, tree.n)
    chosen = np.flatnonzero(spread[rows] > _SPREAD * level[rows])

    def move(part):
        own = rows[chosen[part]]
        distance, near = tree.query(points[own], k=k)
        around = _Around.of(points, own, near, distance, level[own])
        held, there = _better_sheets(around, *_best_planes(around, points, step, normal))
        found[chosen[part][held]] = there

    work_through(move, even_chunks(len(chosen), _CHUNK, Progress.of(progress)))
    return found


@dataclass(frozen=True)
class _Around:
    """What is around some samples; all lengths but those in units of the points are in radii, to the farthest.

    own    : (m,) of the samples     near : (m,k), their neighbours     radius : (m,) float64, units of the points
    offset : (m,3,k) float32, to the neighbours     weight : (m,k) float32, theirs, sum 1
    within : (m,1) float32, how far off a sheet they may be
    of_all : (m,) share of them that the quadric through all holds
    """

    own: np.ndarray
    near: np.ndarray
    radius: np.ndarray
    offset: np.ndarray
    weight: np.ndarray
    within: np.ndarray
    of_all: np.ndarray

    @classmethod
    def of(cls, points, own, near, distance, level) -> "_Around":
        radius = np.maximum(distance[:, -1], np.finfo(float).tiny)
        offset = np.stack([(x[near] - x[own, None]) / radius[:, None] for x in points.T], axis=1).astype(np.float32)
        within = np.maximum(_WITHIN * level / radius, EXACT)[:, None].astype(np.float32)
        _, _, basis, weight, height = in_frames(offset.swapaxes(0, 1), (distance / radius[:, None]).astype(np.float32))
        weight /= np.einsum("mk->m", weight)[:, None]
        of_all = _held(off_fit(weighted_fit(basis, weight, height)[0], basis, height), weight, within)
        return cls(own, near, radius, offset, weight, within, of_all)

    @property
    def columns(self) -> np.ndarray:
        """The offsets component by component, (3,m,k)."""
        return self.offset.swapaxes(0, 1)


def _best_planes(around, points, step, normal):
    """Of the planes of some neighbours, of their quadrics, those that hold most of all: normals (m,3), how far they are
    above the samples, and the share of neighbours that they hold, (m,) each; this is 0 where no sample lies on one."""
    best, plane, above = np.zeros(len(around.own)), np.zeros((len(around.own), 3)), np.zeros(len(around.own))
    for other in around.near[:, np.linspace(1, around.near.shape[1] - 1, _PLANES).astype(int)].T:
        axis = normal[other]
        over = row_dots(points[other] + step[other] - points[around.own], axis) / around.radius
        held = _held(_heights(around, axis) - over[:, None].astype(np.float32), around.weight, around.within)
        better = axis.any(axis=1) & (held > best) & (np.abs(over) < around.within[:, 0])
        best[better], plane[better], above[better] = held[better], axis[better], over[better]
    return plane, above, best


def _better_sheets(around, plane, above, best):
    """Rows (r,) of samples on one sheet that holds more of the neighbours than the quadric through all, and the steps
    onto it, (r,3); from planes as :func:`_best_planes` finds them."""
    likely = np.flatnonzero(best > np.maximum(around.of_all - _LIKELY, 0))
    around, plane, above = picked(around, likely), plane[likely], above[likely]
    frame, basis, height = over_planes(around.columns, plane)
    residual = height - above[:, None].astype(np.float32)
    for _ in range(_ROUNDS):
        on = np.maximum(1 - (residual / around.within) ** 2, 0) ** 2  # Tukey's biweight
        weight = around.weight * on + np.finfo(np.float32).tiny
        coefficients = weighted_fit(basis, weight, height, _STIFF)[0]
        residual = off_fit(coefficients, basis, height)
    step, length, _ = onto_quadrics(coefficients, plane, frame, around.radius)
    more = _held(residual, around.weight, around.within) > around.of_all + _MORE
    more &= length < 2 * around.within[:, 0] * around.radius
    return likely[more], step[more]


def _held(residual, weight, within):
    """The share of neighbours with weights (m,k) that lie within (m,1) of a sheet that they are off by (m,k), the
    closer the more, (m,)."""
    return np.einsum("mk,mk->m", weight, np.maximum(1 - (residual / within) ** 2, 0))


def _heights(around, axis):
    return dots(around.columns, axis.T[:, :, None].astype(np.float32))
