"""The double cover: a closed two-sided mesh that hugs the surface from both sides."""

from numbers import Real
from typing import NamedTuple

import numpy as np

from ...errors import SettingsError
from ...field.blocks import each
from ...field.grid import Grid, padding_cells
from ...field.local_surface import LocalSurface
from ...field.steps import NearBand
from ...linalg import shortened, unit
from ...lookup import rows_of
from ...progress import Progress
from ..edges.first_steps import first_steps
from ..mesh import Mesh
from ..meshing.centring import centred
from ..meshing.corners import into_corners
from ..meshing.evening import evened
from ..meshing.isosurface import isosurface
from ..meshing.pieces import pieces_with_samples
from ..meshing.slivers import without_slivers
from ..meshing.triangles import mesh_of
from ..meshing.unfolding import unfolded
from .layers import laid_apart
from .leaks import lower_around, shut_leaks
from .pinholes import find_pinholes
from .ridges import raise_ridges
from .spanning import spanned, spanning_vertices, stretched_vertices

CLAMP = 2.0  # cells beyond the level; farther nodes do not matter and are made background
SPARSE = 3.0  # cells, median local spacing above which the iso-surface is taken further off
_RAISED = 0.5  # cells further for each cell of it above that
_WITHIN = 0.75  # of the box's padding, at most
_CLOSEST = 0.51  # cells; at half a cell a sheet midway between nodes has none below the level
_LONGEST_STEP = 2.0  # levels
DENSE = 2 / 3  # cells, median local spacing


def level_for(surface: LocalSurface, grid: Grid, offset: float) -> float:
    """Cells from the surface at which its iso-surface is taken: `offset`, and half a cell more for every cell of local
    spacing above three, as far as the box leaves room.

    Patches of samples far apart do not quite meet, and an iso-surface closer than the cracks between them has holes: on
    `spot_sparse500` of the benchmarks its Euler number is -48 at 1 cell and -18 at the 2.5 that this is; 4 is right.
    Raises :class:`SettingsError` for an offset that the box has no room for.
    """
    room = padding_cells(max(grid.shape) - 1)
    if not isinstance(offset, Real) or not 0 < offset <= room:
        raise SettingsError(f"offset is {offset!r}; it must be above 0 and at most {room:g} cells, the room in the box")
    raised = offset + _RAISED * max(0.0, surface.spacing_in_cells(grid) - SPARSE)
    return max(offset, _CLOSEST, min(raised, _WITHIN * room))


def double_cover(values, band: NearBand, surface: LocalSurface, grid: Grid, offset: float, progress=None) -> Mesh:
    """The iso-surface of the distance field at the level that :func:`level_for` says, pulled onto the zero set.

    values : (nx,ny,nz) float32 or Blocks, distances at the grid's nodes, units of the samples; in Blocks those up to
             CLAMP cells beyond the level
    band   : the nodes near the surface

    The idea of shrinking a double cover is DCUDF's (Hou et al., ACM TOG 42(6), 2023); here every vertex goes straight
    to its foot point on the local surface, twice, with its faces made even in between, then drawn into concave corners,
    instead of descending a mesh energy. The first time, the steps to the nodes around it tell the way, where they can.
    The mesh is closed and each of its edges has two faces, wound so that normals point away from the surface on either
    side; an open sheet gives one piece, a closed one an outer and an inner piece.

    At last each layer is taken to its own side of the surface, see :mod:`layers`, which adds as much error again as
    faces have that are chords of a curved surface. On samples denser than two thirds of a cell that is most of what
    error there is; there faces are put astride the surface instead, and the layers pass through each other by
    thousandths of a cell.

    Gaps between sheets, and wedges, are open down to little more than two levels, see :mod:`ridges`.
    Where a closed surface would leak through an opening between samples, or an open sheet has a pinhole, this is shut
    and spanned smoothly, see :mod:`leaks`, :mod:`pinholes` and :mod:`spanning`; so are faces that are drawn out between
    sheets.

    Where OpenVDB is found most of its triangles are the halves of quads: the iso-surface is a dual one (Nielson, IEEE
    Visualization 2004), with a vertex for each patch of it in a cell and a quad around each grid edge it crosses; it is
    flattened against rims, which leaves slivers that are taken out, see :mod:`..meshing.slivers`, and a few faces that
    lie back to front, see :mod:`..meshing.unfolding`.

    Raises :class:`SettingsError` for an offset that the box has no room for, :class:`InputError` for distances of
    another grid or one that does not hold the surface, and :class:`MissingDependency` where no library that extracts
    iso-surfaces is found.
    """
    grid.check(surface.points, np.shape(values), band.shape)
    progress = Progress.of(progress)
    level = np.float32(level_for(surface, grid, offset) * grid.spacing)
    clamped = each(lambda u: np.minimum(u, np.float32(level + CLAMP * grid.spacing)), values)
    raise_ridges(clamped, band, grid, level)
    shut = shut_leaks(clamped, values, surface, grid, level, progress.part(0.0, 0.02))
    progress(0.02)
    found = _extracted(clamped, level, band, surface, grid, progress.part(0.02, 0.15))
    places = find_pinholes(*found, surface, grid)
    if len(places):
        lower_around(places, clamped, grid, level)
        shut = np.concatenate([shut, places])
        found = _extracted(clamped, level, band, surface, grid, progress.part(0.15, 0.3), found)
    vertices, faces, step, past_rim = found
    loose = spanning_vertices(vertices, step, past_rim, shut, level)
    side = np.where((past_rim | loose)[:, None], 0.0, unit(step))
    vertices = evened(_moved(vertices, step, level), faces, past_rim)
    vertices = _moved(vertices, surface.project(vertices, progress.part(0.3, 0.7)).step, level)
    vertices = into_corners(vertices, faces, side, surface, grid.spacing, progress.part(0.7, 0.8))
    loose |= stretched_vertices(vertices, faces, surface, grid.spacing)
    vertices = spanned(vertices, faces, loose)
    mesh = unfolded(without_slivers(mesh_of(vertices, faces), grid.spacing), surface, grid.spacing)
    progress(0.8)
    dense = surface.spacing_in_cells(grid) < DENSE
    mesh = centred(mesh) if dense else laid_apart(mesh, grid.spacing, progress.part(0.8, 0.9))
    progress(0.9)
    return pieces_with_samples(mesh, surface.tree, grid.spacing)


class _IsoSurface(NamedTuple):
    """vertices : (v,3) float64                                faces    : (f,3) or (f,4) int64
    step     : (v,3) float64, from the foot points to these    past_rim : (v,) bool, whether the foot points are on rims
    """

    vertices: np.ndarray
    faces: np.ndarray
    step: np.ndarray
    past_rim: np.ndarray


def _extracted(values, level, band, surface, grid, progress, before=None):
    """The iso-surface at a level; steps to vertices that it had `before`, as they were found then."""
    cells, faces = isosurface(values, level)
    vertices = grid.origin + grid.spacing * cells
    if before is None:
        return _IsoSurface(vertices, faces, *first_steps(vertices, band, surface, grid, progress))
    step, past_rim, fresh = np.empty_like(vertices), np.empty(len(vertices), bool), np.ones(len(vertices), bool)
    row, old = _shared(vertices, before.vertices)
    step[row], past_rim[row], fresh[row] = before.step[old], before.past_rim[old], False
    step[fresh], past_rim[fresh] = first_steps(vertices[fresh], band, surface, grid, progress)
    return _IsoSurface(vertices, faces, step, past_rim)


def _shared(vertices, others):
    """Which of some vertices (v,3) are among others (w,3) as well: their rows in either."""
    key, their_key = (x[:, 0] + np.sqrt(2) * x[:, 1] + np.sqrt(3) * x[:, 2] for x in (vertices, others))
    order = np.argsort(their_key)
    found = rows_of(key, their_key[order])
    row = np.flatnonzero(found >= 0)
    old = order[found[row]]
    same = (vertices[row] == others[old]).all(axis=1)
    return row[same], old[same]


def _moved(vertices, step, level):
    """The vertices less the steps, shortened where they are very long."""
    return vertices - shortened(step, _LONGEST_STEP * level)
