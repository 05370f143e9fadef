"""Concave corners: between sheets that meet, faces lead from one sheet straight to the other."""

import numpy as np

from ...field.local_surface import LocalSurface
from ...linalg import row_dots
from ...lookup import mask_of, numbered
from ...parts import connected_parts
from ...progress import Progress
from ..mesh_edges import Edges
from .planes import to_planes

_TURN = 0.7  # largest cosine between the sides of sheets that form a corner
_FACING = -0.97  # below this cosine they run close side by side
_ABOVE = 0.02  # cells, least height of a vertex over the other sheet's plane
_FARTHEST = 9.0  # cells, how far a vertex may go where an offset lies between it and the corner
_OFF, _APART = 0.25, 1.0  # cells, how far from the surface it may end, and how far from it planes may meet
_STIFFNESS = 0.01
_ADVANCES, _ADVANCE = 4, 0.4  # times that planes are laid again, and the share of the way that is gone each time
_MET = 0.05  # cells, off the surface, where the first planes meet well enough
_LIFT = 0.3  # cells, off the sheet, so that the feet tell its side
_SAME = 0.7  # least cosine between normals of one sheet there
_ROUNDS = 4


def into_corners(
    vertices, faces, side, surface: LocalSurface, cell: float, progress=None, farthest=_FARTHEST
) -> np.ndarray:
    """Vertices (v,3) of triangles or quads (f,k), each on a foot point, with one end of every edge that cuts a concave
    corner taken to where the planes of the sheets meet.

    side     : (v,3) float64, unit normals of the surface at the foot points, towards the side that the faces are on;
               zero where there is none, past a rim
    farthest : cells, how far vertices may go, or (v,) how far each

    The iso-surface is an offset away from all sheets, so next to a corner no vertex falls into it. Ends that are closer
    to the corner go first. They stay where that would take them far or off the surface, between sheets that run close
    for instance.
    """
    edges = Edges(faces, len(vertices))
    low, high = edges.low, edges.high
    turn = row_dots(side[low], side[high])
    bent = (turn > _FACING) & (turn < _TURN)
    low, high = low[bent], high[bent]
    way = vertices[high] - vertices[low]
    concave = row_dots(way, side[low]) > _ABOVE * cell
    concave &= row_dots(way, side[high]) < -_ABOVE * cell
    row, (low, high) = numbered(np.stack([low[concave], high[concave]]))
    step, off = _to_meetings(
        vertices[row], side[row], np.append(low, high), np.append(high, low), surface, cell, progress
    )
    length = np.linalg.norm(step, axis=1)
    length[(length > cell * np.broadcast_to(farthest, len(vertices))[row]) | (off > _APART * cell)] = np.inf
    chosen = _closest_ends(low, high, length)
    moved = vertices.copy()
    moved[row[chosen]] += step[chosen]
    return moved


def _to_meetings(place, side, corner, other, surface, cell, progress):
    """Steps (v,3) from places (v,3) of sheets with normals `side` (v,3) to where their planes and those at the other
    ends of their edges meet, and how far off the surface that is, (v,).

    corner, other : (c,) int, the ends of each edge, once either way

    Sheets bend on the way, so where planes meet off the surface they are laid again further on, and their meeting
    counts if it is closer.
    """
    progress = Progress.of(progress)
    step = _onto_planes(place, place, side, corner, other)
    found = surface.project(place + step, progress.part(0.0, 0.2))
    onto, off = found.step, found.distance
    part = connected_parts(corner, other, len(off))
    chosen = np.isin(part, part[off > _MET * cell])[corner]
    row, ends = numbered(np.stack([corner, other])[:, chosen])
    if len(row):
        further = _laid_again(place[row], side[row], step[row], *ends, surface, cell, progress.part(0.2, 0.8))
        there = surface.project(place[row] + further, progress.part(0.8, 1.0))
        better = (off[row] > _MET * cell) & (there.distance < off[row])
        row = row[better]
        step[row], onto[row], off[row] = further[better], there.step[better], there.distance[better]
    return np.where((off > _OFF * cell)[:, None], step - onto, step), off


def _laid_again(place, side, step, corner, other, surface, cell, progress):
    """The same steps (v,3) by planes at the feet of places part of the way there and a little off the sheet, while
    these are on the same sheet."""
    at, normal, further, share = place, side, step, np.full((len(place), 1), _ADVANCE)
    for _, part in progress.turns(range(_ADVANCES)):
        x = at + share * (place + further - at) + _LIFT * cell * normal
        near = surface.project(x, part)
        fresh = near.direction
        same = ((row_dots(fresh, normal) > _SAME) & ~near.past_rim)[:, None]
        at, normal, share = np.where(same, x - near.step, at), np.where(same, fresh, normal), share * (1 - 0.5 * ~same)
        further = _onto_planes(place, at, normal, corner, other)
    return further


def _onto_planes(place, at, normal, corner, other):
    """Steps (v,3) from places (v,3) to where their planes, through places `at` (v,3) with normals (v,3), and those at
    the other ends of their edges meet."""
    planes = np.append(corner, other)
    return to_planes(place, np.append(corner, corner), at[planes], normal[planes], _STIFFNESS)


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
        chosen |= mask_of(np.append(low, high), len(length)) & can & (rank < best)
    return chosen
