"""Eyes of scanners, found from planes that hold their rays."""

import numpy as np

from ..linalg import row_dots

_TRIPLES = 600  # of planes, in whose common point an eye is looked for
_EYES = 8  # at most
_OFF = 0.03  # sine of the angle between a plane and the way to the eye, at most
_DISTANT = 1e3  # of the extent, from where rays are parallel, as are lines on extruded faces
_STEPS = 100  # of normals, from 0 to 1, within one of which they count as the same
_KINDS, _LARGEST = 12, 0.25  # of normals through an eye, at least, and share of one, at most: faces have fewer
_TANGENT = 0.92  # lower quartile of |n . n_sheet| of planes through an eye, at most; faces of a cone meet, too, at 1


def seen_edge_on(points: np.ndarray, normals: np.ndarray, sheets: np.ndarray) -> np.ndarray:
    """Which planes through points (m,3) with unit normals (m,3) are among many that meet in a point and cross the
    surface, whose unit normals are `sheets` (m,3), there, (m,) bool: those through the eyes of scanners. Tries up to
    eight eyes, those with most planes first."""
    centre, extent = points.mean(axis=0), float(np.ptp(points, axis=0).max())
    tangent = np.abs(row_dots(normals, sheets))
    normals, places = normals.copy(), (points - centre) / extent
    normals[normals[np.arange(len(normals)), np.abs(normals).argmax(axis=1)] < 0] *= -1
    planes = np.column_stack([normals, -row_dots(normals, places)])
    left, rng = np.ones(len(planes), bool), np.random.default_rng(0)
    for _ in range(_EYES):
        row = np.flatnonzero(left)
        if len(row) < _KINDS:
            break
        held = row[_held_by_most(planes[row], places[row], rng)]
        _, kinds = np.unique(np.rint(_STEPS * normals[held]), axis=0, return_counts=True)
        few = len(kinds) < _KINDS or kinds.max() > _LARGEST * kinds.sum()
        if few or np.quantile(tangent[held], 0.25) > _TANGENT:
            break
        left[held] = False
    return ~left


def _held_by_most(planes, places, rng):
    """Which planes (m,4) hold the point that most of them do, of those where three meet, (m,) bool."""
    triples = planes[rng.integers(len(planes), size=(_TRIPLES, 3))]
    eyes = np.linalg.svd(triples)[2][:, -1]
    eyes = eyes[np.abs(eyes[:, 3]) * _DISTANT > np.linalg.norm(eyes[:, :3], axis=1)]
    eyes = eyes[:, :3] / eyes[:, 3:]
    held = [np.abs(planes @ np.append(eye, 1.0)) < _OFF * np.linalg.norm(places - eye, axis=1) for eye in eyes]
    return max(held, key=np.sum, default=np.zeros(len(planes), bool))
