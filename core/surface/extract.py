"""Stage three: the meshes that were asked for."""

from dataclasses import dataclass, field, replace

import numpy as np

from ..field.blocks import Blocks
from ..field.grid import Grid
from ..field.local_surface import LocalSurface
from ..field.steps import NearBand
from ..progress import Progress
from ..settings import WITH_SIDES, Settings
from .crossings import find_crossings
from .double_cover import CLAMP, double_cover, level_for
from .isosurface import need_quads
from .mesh import Mesh
from .misfit import misfit
from .pieces import without_small_pieces
from .sides import find_sides, needed_band
from .signed import signed_distance, signed_mesh
from .single_layer import single_layer

_TORN = 0.07  # cells, mean distance of the samples to a single layer beyond which the double cover is looked at
_BETTER = 0.5  # times that distance, below which it is taken
_SPARSE = 3.0  # cells, median local spacing from which no finer grid parts what the points do not


@dataclass(frozen=True)
class Surfaces:
    """What was extracted, in the units of the samples.

    values   : (nx,ny,nz) float32 or Blocks, the distances, signed where a signed surface was asked for
    meshes   : by kind: "double", "signed", "single"
    dropped  : by kind, number of pieces left out for the setting `pieces`
    warnings : where a mesh is less than was asked for, one line each
    """

    values: np.ndarray | Blocks
    meshes: dict[str, Mesh] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def placed(self, place) -> "Surfaces":
        """The same with vertices taken to the user's units by the function `place`."""
        placed = {kind: replace(mesh, vertices=place(mesh.vertices)) for kind, mesh in self.meshes.items()}
        return replace(self, meshes=placed)


def band_for(settings: Settings, local: LocalSurface, grid: Grid) -> float:
    """Cells from the surface up to which the meshes asked for need distances; at least the band asked for."""
    needed = settings.band
    if settings.surface in WITH_SIDES:
        needed = max(needed, needed_band(local, grid))
    if settings.surface in ("double", "both", "single"):
        needed = max(needed, level_for(local, grid, settings.offset) + CLAMP)
    return needed


def _said_of_torn(local, grid):
    """Why there is a double cover in place of a single layer, and what helps: no finer grid where points lie many cells
    apart."""
    cells = np.median(local.spacing) / grid.spacing
    if cells > _SPARSE:
        return (
            f"points {cells:.2g} cells apart are too few to tell sheets apart, where a single layer is torn: the "
            "double cover is in its place; more points part them"
        )
    return (
        "sheets run closer than the cells of the grid, where a single layer is torn: the double cover is in its place; "
        "raise the resolution until they part"
    )


def extract_surfaces(
    values, band: NearBand, local: LocalSurface, grid: Grid, settings: Settings, place, progress=None
) -> Surfaces:
    """The meshes that `settings.surface` names, from distances `values`, (nx,ny,nz) float32 or Blocks of the band that
    :func:`band_for` says, and the nodes near the surface.

    place : function that takes positions (m,3) to the user's units, for messages
    Raises :class:`InputError` where a signed surface is asked for and the shape is not closed,
    :class:`MissingDependency` where quads are asked for and OpenVDB is not found.
    """
    progress, kind = Progress.of(progress), settings.surface
    meshes, dropped, warnings = {}, {}, []
    if settings.faces == "quads" and kind != "none":
        need_quads()
    if kind in ("double", "both"):
        part = progress.part(0.0, 0.3, "double cover")
        meshes["double"] = double_cover(values, band, local, grid, settings.offset, part)
    if kind in WITH_SIDES:
        crossings = find_crossings(band, local, grid, progress.part(0.3, 0.5, "crossings"))
        sides = find_sides(values, crossings, local, grid, progress.part(0.5, 0.6, "crossings"))
    if kind in ("single", "both"):
        part = progress.part(0.6, 0.9, "single layer")
        meshes["single"], unoriented = single_layer(values, band, crossings, sides, local, grid, part)
        torn = 0.0 if sides.complete else misfit(meshes["single"], local.points)
        if torn > _TORN * grid.spacing:
            part = progress.part(0.9, 1.0, "single layer")
            cover = meshes.get("double") or double_cover(values, band, local, grid, settings.offset, part)
            if misfit(cover, local.points) < _BETTER * torn:
                meshes["single"], unoriented = cover, 0
                warnings.append(_said_of_torn(local, grid))
        if unoriented:
            warnings.append(
                f"the single layer cannot be wound alike across {unoriented} of its edges: the surface is one-sided "
                "there, or sheets meet; use the double cover where both sides must show"
            )
    if kind == "signed":
        values = signed_distance(values, sides, local, place)
        meshes["signed"] = signed_mesh(values, local, grid, progress.part(0.6, 1.0, "signed surface"))
        if not sides.complete:
            warnings.append(
                f"{sides.share:.1%} of the surface has the same side on both faces (flaps, inner walls), where the "
                f"signed surface has a face on either side; it spans openings of {sides.spanned:.1%} of its area; "
                "compare it with the single layer"
            )
    for kind, mesh in meshes.items():
        mesh = mesh if settings.faces == "quads" else replace(mesh, pairs=0)
        meshes[kind], dropped[kind] = without_small_pieces(mesh, settings.pieces)
    return Surfaces(values, meshes, dropped, tuple(warnings)).placed(place)
