"""Pinholes of open sheets: openings between samples that chance has put far apart, where an iso-surface passes from one
side of the sheet to the other.

It does so at every rim. The faces that turn from one side to the other form loops there: around the whole sheet, and
one in each pinhole, which has more of the iso-surface on either side than it could go around on a flat sheet. Other
short loops go around specks, where creases are seen from either side, for instance.
"""

import numpy as np

from ...field.grid import Grid
from ...field.local_surface import LocalSurface
from ...linalg import dots, row_dots
from ...lookup import edge_keys, numbered
from ...parallel import over_rows
from ...parts import connected_parts
from ..mesh import AT_ONCE, at_corners

_LONGEST = 64  # faces of a loop; longer ones go around sheets and wide holes
_LEVEL = 0.5  # least mean cosine between their normals and that of an opening in their sheet
_APART = 0.5  # cells between the places that fill an opening


def find_pinholes(vertices, faces, step, past_rim, surface: LocalSurface, grid: Grid) -> np.ndarray:
    """Places in the pinholes of an iso-surface that are no wider than the bridging length, (m,3) float64, half a cell
    apart.

    vertices, faces : (v,3) and triangles or quads (f,k)     step : (v,3), from the foot points to the vertices
    past_rim        : (v,) bool, whether these lie on rims
    """
    nowhere = np.empty((0, 3))
    if not past_rim.any():
        return nowhere
    turning = _turning(faces, _facing(vertices, step, past_rim, surface))
    loops = _loops(faces, turning)
    openings = [_across(vertices[faces[loop]].mean(axis=1), grid.spacing) for loop in loops]
    row = np.flatnonzero(_are_bridged(openings, surface))
    if not len(row):
        return nowhere
    part = connected_parts(*_ends(faces, ~turning), len(vertices))
    size = np.bincount(part)[part]

    def beside(loop):
        return size[np.stack(_ends(faces[loop], turning[loop]))].min()

    kept = [openings[i] for i in row if beside(loops[i]) > len(loops[i]) ** 2]
    return np.concatenate([nowhere, *kept])


def _facing(vertices, step, past_rim, surface):
    """Directions (v,3) to the side of the sheet that vertices are on; past rims, by the normals of samples."""
    facing, past = step.copy(), np.flatnonzero(past_rim)
    normal = surface.normals[surface.tree.query(vertices[past], workers=-1)[1]]
    facing[past] = np.where(row_dots(step[past], normal) < 0, -1.0, 1.0)[:, None] * normal
    return facing


def _turning(faces, facing):
    """Which sides of faces (f,k), from each corner to the next, turn to the other side of the sheet, (f,k) bool."""
    columns, turning = np.asfortranarray(facing), np.empty(faces.shape, bool)

    def look(part):
        corners = at_corners(columns, faces[part])
        for side, pair in enumerate(zip(corners, [*corners[1:], corners[0]], strict=True)):
            turning[part, side] = dots(*pair) < 0

    over_rows(look, len(faces), AT_ONCE)
    return turning


def _ends(faces, chosen):
    """The vertices at the ends of the sides of faces (f,k) that are chosen, (f,k) bool: two arrays (s,)."""
    return faces[chosen], np.roll(faces, -1, axis=1)[chosen]


def _loops(faces, turning):
    """Short closed loops of faces that turn from side to side, each across the next: arrays of their rows."""
    row = np.flatnonzero(turning.any(axis=1))
    sides = np.stack(_ends(faces[row], turning[row]), axis=1)
    edge, number = numbered(edge_keys(sides, 1 + sides.max(initial=0)))
    times = turning[row].sum(axis=1)
    owner = np.repeat(np.arange(len(row)), times)
    part = connected_parts(owner, len(row) + number, len(row) + len(edge))[: len(row)]
    closed = (np.bincount(part, times % 2) == 0) & (np.bincount(part) <= _LONGEST)
    return [row[part == number] for number in np.flatnonzero(closed)]


def _across(loop, cell):
    """Places (m,3) on the lines from the middle of a loop of places (l,3) to these."""
    middle = loop.mean(axis=0)
    count = 1 + int(np.ceil(np.linalg.norm(loop - middle, axis=1).max() / (_APART * cell)))
    share = np.linspace(0, 1, count)[:, None, None]
    return (middle + share * (loop - middle)).reshape(-1, 3)


def _are_bridged(openings, surface):
    """Whether openings, each filled with places (m,3), are no wider than the bridging length and go on with the sheet
    around them, as the mouths of tubes do not; (k,) bool."""
    if not openings:
        return np.zeros(0, bool)
    middle, count = np.stack([places[0] for places in openings]), [len(places) for places in openings]
    around = surface.around(middle)
    width, owner = np.zeros(len(openings)), np.repeat(np.arange(len(openings)), count)
    np.maximum.at(width, owner, surface.project(np.concatenate(openings)).distance)
    axis = [np.linalg.svd(places - places[0], full_matrices=False)[2][2] for places in openings]
    level = np.abs(np.einsum("kni,ki->kn", surface.normals[around], np.stack(axis))).mean(axis=1)
    return (width <= 0.5 * surface.bridge * np.median(surface.spacing[around], axis=1)) & (level >= _LEVEL)
