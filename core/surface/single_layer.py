"""The single layer: one sheet, open where the surface is open, non-manifold where sheets meet."""

from ..field.grid import Grid
from ..field.local_surface import LocalSurface
from ..field.steps import NearBand
from ..progress import Progress
from .centring import centred
from .crossings import Crossings
from .dual_contour import dual_contour
from .holes import fill_pinholes
from .mesh import Mesh
from .open_sheet import open_sheet
from .orientation import orient
from .rims import at_rims, smooth_rims
from .scraps import without_scraps
from .sides import Sides
from .signed import signed_mesh
from .two_sides import two_sided

_MENDED = 2  # times, since holes may show where scraps are gone


def single_layer(
    values, band: NearBand, crossings: Crossings, sides: Sides, surface: LocalSurface, grid: Grid, progress=None
) -> tuple[Mesh, int]:
    """The surface as one sheet: the boundary of the inside, where that is the whole surface; where it has two sides,
    what lies between them (see :func:`open_sheet`); else :func:`dual_contour`.

    Where a surface with two sides passes through itself, what lies between them turns off just before the crossing on
    either side, and may have handles there. A closed one is left so; of an open one the dual contour shows the line,
    and is taken if it can be wound alike wherever it has two faces.

    values : (nx,ny,nz) float32 or Blocks, unsigned distances     band : the nodes near the surface
    Returns the mesh, wound alike wherever it can be, and the number of edges where it cannot (see :func:`orient`).
    """
    progress = Progress.of(progress)
    if sides.complete:
        return signed_mesh(sides.sign(values), surface, grid, progress), 0
    signed = two_sided(values, band, crossings, surface, grid, progress.part(0.0, 0.1))
    by_crossings = signed is None or crossings.normal.any()
    if by_crossings:
        contour = dual_contour(crossings, surface, grid, progress.part(0.1, 0.5))
        sheet, unoriented = orient(mended(contour, surface, grid.spacing))
    if not by_crossings or (signed is not None and unoriented):
        contour = open_sheet(signed, band, surface, grid, progress.part(0.5, 0.9))
        sheet, unoriented = orient(mended(contour, surface, grid.spacing))
    return centred(sheet), unoriented


def mended(mesh: Mesh, surface: LocalSurface, cell: float) -> Mesh:
    """A sheet with its pinholes closed, scraps taken off, and its borders smoothed."""
    for _ in range(_MENDED):
        filled = fill_pinholes(mesh, surface, cell)
        mesh = without_scraps(filled, surface, cell)
        if mesh is filled:
            break
    return smooth_rims(mesh, surface, cell, at_rims(mesh, surface, cell))
