"""The routes to a single layer: the boundary of the inside, what lies between two sides, one side of the double cover,
and the dual contour of all crossings, which alone has lines where sheets meet."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import KDTree

from ...field.blocks import Blocks
from ...field.grid import ADJACENT, Grid
from ...field.local_surface import LocalSurface
from ...field.steps import NearBand
from ...parallel import beside
from ...parts import extents, near_parts
from ...progress import Progress
from ..edges.crossings import Crossings
from ..edges.meetings import Meetings
from ..mesh import Mesh
from ..meshing.finishing import finished
from ..meshing.misfit import BETTER, ROUGH, chamfer, misfit
from ..meshing.untangling import untangled
from ..signed import signed_mesh
from ..signs.sides import Sides
from ..signs.two_sides import LONG
from .dual_contour import dual_contour
from .holes import fill_pinholes
from .junctions import onto_junctions
from .one_side import one_side
from .open_sheet import open_sheet
from .orientation import orient
from .rims import at_rims, smooth_rims
from .scraps import without_scraps

_PARTED = 0.01  # of the samples, missed by what parts sheets side by side, at most
_MENDED = 2  # times, since holes may show where scraps are gone
_BESIDE = 1.5  # cells from a line of more than two faces; borders there show that sheets were parted
_BORDERED = 0.5  # edges of such borders for each of the line, at most; where there are more the sheets meet


def sheet_between_sides(
    two_sides: Callable[[], np.ndarray | Blocks | None],
    band: NearBand,
    crossings: Crossings,
    sides: Sides,
    surface: LocalSurface,
    grid: Grid,
    progress=None,
) -> Mesh | None:
    """What lies between the two sides of a surface that bounds no inside, see :func:`open_sheet`, with one face or two
    at every edge and all wound alike. None where it has no such sides, and where sheets meet but do not run side by
    side, which it may part.

    two_sides : function that gives the signed distances of :func:`two_sided`     band : the nodes near the surface
    """
    progress, meetings = Progress.of(progress), crossings.meetings
    if sides.complete or (crossings.normal.any() and not meetings.side_by_side):
        return None
    signed = two_sides()
    if signed is None:
        return None
    found = open_sheet(signed, band, meetings.passing, surface, grid, progress.part(0.0, 0.8))
    sheet, unoriented = _finished(found, meetings.passing, surface, grid, progress.part(0.8, 1.0))
    return None if unoriented or len(_lines(sheet)) else sheet


def sheet_of_sides(
    values,
    crossings: Crossings,
    sides: Sides,
    surface: LocalSurface,
    grid: Grid,
    between: Mesh | None,
    cover: Callable[[], Mesh],
    progress=None,
) -> Mesh | None:
    """The surface as one sheet, where it has two sides: the boundary of the inside, where that is the whole surface
    (see :func:`boundary_of_inside`); else what lies `between` its sides (see :func:`sheet_between_sides`), if it is not
    torn where sheets run side by side. None where there is none, as on one-sided surfaces and mostly where sheets meet.

    values : (nx,ny,nz) float32 or Blocks, unsigned distances     cover : function that gives the double cover
    """
    if sides.complete:
        return boundary_of_inside(sides.sign(values), sides, crossings.meetings, surface, grid, cover, progress)
    if between is None or not crossings.normal.any():
        return between
    worst, missed = misfit(between, surface, grid.spacing)
    return between if worst <= 1 and missed <= _PARTED else None


def boundary_of_inside(
    signed,
    sides: Sides,
    meetings: Meetings,
    surface: LocalSurface,
    grid: Grid,
    cover: Callable[[], Mesh],
    progress=None,
) -> Mesh:
    """The boundary of the inside of a closed surface, see :func:`signed_mesh`: closed and wound outwards.

    It has holes in walls so thin that hardly a node lies inside. A double cover extracted at an offset does not: around
    a thin wall it has one layer in place of two. So where many meetings are of sheets side by side its outer side is
    taken if that is closed, too, and closer to the surface, as it is where all walls are thin; thick ones beside thin
    slits it misses.

    signed : (nx,ny,nz) float32 or Blocks, distances, negative inside     cover : function that gives the double cover
    """
    mesh = signed_mesh(signed, sides.wedges, meetings.passing, surface, grid, progress)
    if not meetings.much_side_by_side or misfit(mesh, surface, grid.spacing).worst <= ROUGH:
        return mesh
    outer = untangled(mended(one_side(cover(), signed, surface, grid), surface, grid.spacing), surface)
    closed = (outer.edge_counts()[1] == 2).all()
    closer = closed and chamfer(outer, surface, grid.spacing) < chamfer(mesh, surface, grid.spacing)
    return outer if closer else mesh


def sheet_of_crossings(
    two_sides: Callable[[], np.ndarray | Blocks | None],
    band: NearBand,
    crossings: Crossings,
    surface: LocalSurface,
    grid: Grid,
    between: Mesh | None,
    cover: Callable[[], Mesh],
    progress=None,
) -> tuple[Mesh, int]:
    """Any surface as one sheet by :func:`dual_contour`, with edges of several faces where sheets meet.

    In two cases what lies between two sides may take its place, see :func:`open_sheet`, if there are such:

    - The dual contour is wound alike, and all its lines of more than two faces are short: creases may look like sheets
      that meet for some cells. The other is taken if it is wound alike, too, and has no lines nor borders there.
    - The dual contour cannot be wound alike wherever it has two faces, and samples do not show its lines. The other is
      taken if it has few borders along them, as it has where it parts sheets that meet. Where samples show the lines it
      is not, as at a crossing it turns off just before that on either side, may have handles where samples are sparse,
      and tears where the line ends. Where sheets run side by side all may be torn; then see :func:`_of_torn`.

    two_sides, cover : functions that give the signed distances of :func:`two_sided`, and the double cover
    between          : what lies between the two sides there, which may be torn
    Returns the mesh, wound alike wherever it can be, and the number of edges where it cannot (see :func:`orient`).
    """
    progress, meetings = Progress.of(progress), crossings.meetings
    passing = meetings.passing
    shown = passing.any() and not meetings.side_by_side
    found = dual_contour(crossings, surface, grid, progress.part(0.0, 0.3))
    sheet, unoriented = orient(mended(found, surface, grid.spacing))
    if unoriented and crossings.normal.any() and not shown:
        with beside(lambda: _sharp(sheet, passing, surface, grid, Progress())) as sharp:
            two_sides()  # which are asked for below, whatever the sheet is like
        sheet = sharp()
    else:
        sheet = _sharp(sheet, passing, surface, grid, progress.part(0.3, 0.5))
    if not crossings.normal.any():
        return sheet, unoriented
    lines = _lines(sheet)
    chance = not (unoriented or meetings.side_by_side) and _are_short(lines, grid)
    if not chance and (shown or not unoriented):
        return sheet, unoriented
    signed = two_sides()
    if signed is None:
        return sheet, unoriented
    if meetings.side_by_side:
        one = _finished(one_side(cover(), signed, surface, grid), passing, surface, grid, Progress())
        return _of_torn([one, (between, 0), (sheet, unoriented)], surface, grid)
    found = open_sheet(signed, band, passing, surface, grid, progress.part(0.5, 0.9))
    found, left = _finished(found, passing, surface, grid, progress.part(0.9, 1.0))
    parted = _borders_beside(lines, found, grid.spacing)
    replaces = not (left or parted or len(_lines(found))) if chance else parted <= _BORDERED * len(lines)
    return (found, left) if replaces else (sheet, unoriented)


def _of_torn(sheets, surface, grid):
    """The first of some sheets, each with the number of its edges that are not wound alike, unless another that there
    is fits the samples far better: one side of a double cover shows one wall of thin parts, but is nowhere ragged."""
    best, least = sheets[0], misfit(sheets[0][0], surface, grid.spacing).worst
    for sheet in sheets[1:]:
        if sheet[0] is not None and (worst := misfit(sheet[0], surface, grid.spacing).worst) < BETTER * least:
            best, least = sheet, worst
    return best


def _lines(sheet):
    """Both ends of the edges of more than two faces, (e,2,3)."""
    edges, count = sheet.edge_counts()
    return sheet.vertices[edges[count > 2]]


def _are_short(lines, grid):
    """Whether there are lines of edges (e,2,3), and all of them are short."""
    if not len(lines):
        return False
    part = near_parts(lines.mean(axis=1), ADJACENT * grid.spacing)
    length = extents(np.repeat(part, 2), lines.reshape(-1, 3))
    return length.max() <= LONG * max(grid.shape) * grid.spacing


def _borders_beside(lines, sheet, cell):
    """How many edges of one face a sheet has beside the lines of edges (e,2,3) of another."""
    edges, count = sheet.edge_counts()
    border = sheet.vertices[edges[count == 1]].mean(axis=1)
    return int((KDTree(lines.mean(axis=1)).query(border)[0] < _BESIDE * cell).sum())


def _finished(mesh, passing, surface, grid, progress):
    """A sheet mended, wound alike, and sharp where sheets meet or fold, and the number of edges across which it is not
    wound alike."""
    sheet, unoriented = orient(mended(mesh, surface, grid.spacing))
    return _sharp(sheet, passing, surface, grid, progress), unoriented


def _sharp(sheet, passing, surface, grid, progress):
    """A sheet with its junctions and creases made sharp."""
    sheet = onto_junctions(sheet, surface, grid.spacing, progress.part(0.0, 0.5))
    return finished(sheet, passing, surface, grid.spacing, progress.part(0.5, 1.0))


def mended(mesh: Mesh, surface: LocalSurface, cell: float) -> Mesh:
    """A sheet with its pinholes closed, scraps taken off, and its borders smoothed."""
    for _ in range(_MENDED):
        filled = fill_pinholes(mesh, surface, cell)
        mesh = without_scraps(filled, surface, cell)
        if mesh is filled:
            break
    return smooth_rims(mesh, surface, cell, at_rims(mesh, surface, cell))
