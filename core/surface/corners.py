"""Concave corners: between sheets that meet, faces lead from one sheet straight to the other."""

import numpy as np

from ..field.local_surface import LocalSurface
from .mesh import edges_of
from .planes import to_planes

_TURN = 0.7  # largest cosine between the sides of sheets that form a corner
_FACING = -0.97  # below this cosine they run close side by side
_ABOVE = 0.02  # cells, least height of a vertex over the other sheet's plane
_FAR = 9.0  # cells, how far a vertex may go
_OFF, _FARTHEST = 0.25, 1.0  # cells, how far from the surface it may end, and how far from it planes may meet
_STIFFNESS = 0.01
_ROUNDS = 4


def into_corners(vertices, faces, side, surface: LocalSurface, cell: float, progress=None) -> np.ndarray:
    """Vertices (v,3) of triangles or quads (f,k), each on a foot point, with one end of every edge that cuts a concave
    corner taken to where the planes of the sheets meet.

    side : (v,3) float64, unit normals of the surface at the foot points, towards the side that the faces are on; zero
           where there is none, past a rim

    The iso-surface is an offset away from all sheets, so next to a corner no vertex falls into it. Ends that are closer
    to the corner go first. They stay where that would take them far or off the surface, between sheets that run close
    for instance.
    """
    (low, high), _ = edges_of(faces, len(vertices))
    turn = np.einsum("ei,ei->e", side[low], side[high])
    bent = (turn > _FACING) & (turn < _TURN)
    low, high = low[bent], high[bent]
    way = vertices[high] - vertices[low]
    concave = np.einsum("ei,ei->e", way, side[low]) > _ABOVE * cell
    concave &= np.einsum("ei,ei->e", way, side[high]) < -_ABOVE * cell
    row, ends = np.unique(np.stack([low[concave], high[concave]]), return_inverse=True)
    low, high = ends.reshape(2, -1)
    place, side = vertices[row], side[row]
    corner, other = np.append(low, high), np.append(high, low)
    planes = np.append(corner, other)
    step = to_planes(place, np.append(corner, corner), place[planes], side[planes], _STIFFNESS)
    found = surface.project(place + step, progress)
    step = np.where((found.distance > _OFF * cell)[:, None], step - found.step, step)
    length = np.linalg.norm(step, axis=1)
    length[(length > _FAR * cell) | (found.distance > _FARTHEST * cell)] = np.inf
    chosen = _closest_ends(low, high, length)
    moved = vertices.copy()
    moved[row[chosen]] += step[chosen]
    return moved


def _closest_ends(low, high, length):
    """Of edges between vertices `low` and `high`, (e,) each, one end at least: those of least `length` (v,) among the
    ends of their edges, then of the edges that are left. Vertices of infinite length are none."""
    rank = np.argsort(np.argsort(length, kind="stable"))
    can, chosen = np.isfinite(length), np.zeros(len(length), bool)
    for _ in range(_ROUNDS):
        left = ~(chosen[low] | chosen[high])
        low, high = low[left], high[left]
        best = np.full(len(length), len(length))
        np.minimum.at(best, low, rank[high])
        np.minimum.at(best, high, rank[low])
        ending = np.isin(np.arange(len(length)), np.append(low, high))
        chosen |= ending & can & (rank < best)
    return chosen
