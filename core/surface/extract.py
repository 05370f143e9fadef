"""Stage three: the meshes that were asked for."""

from dataclasses import dataclass, field, replace

import numpy as np

from ..field.blocks import Blocks
from ..field.grid import Grid, padding_cells
from ..field.local_surface import LocalSurface
from ..field.steps import NearBand
from ..progress import Progress
from ..settings import Settings
from .choice import SPARSEST, Choice
from .double.double_cover import CLAMP, SPARSE, level_for
from .mesh import Mesh
from .meshing.isosurface import need_quads
from .meshing.misfit import BETTER, OFF, left_out, misfit
from .meshing.pieces import without_small_pieces
from .signed import signed_distance, spelt_out
from .signs.sides import needed_band
from .single.routes import boundary_of_inside

_MESHES = {"none": (), "both": ("double", "single")}  # of these settings; of the others the one of that name
_WITH_SIDES = "single", "both", "signed"  # kinds of surface for which the two sides are told apart
_SOME = 0.02  # share of the samples that a mesh misses, above which it is said
_LACKING = 5  # samples off a sheet, from which on it lacks what they show; of whole ones it is one of some 5,000
_SAID_OF_RAGS = (
    "the single layer is torn in places, as where thin parts have few points or cells across; give more points, raise "
    "the resolution, or use the double cover"
)


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
    if settings.surface in _WITH_SIDES or (settings.surface == "double" and local.spacing_in_cells(grid) <= SPARSEST):
        needed = max(needed, needed_band(local, grid))
    if settings.surface != "none":
        needed = max(needed, level_for(local, grid, _offset(settings)) + CLAMP)
    return needed


def extract_surfaces(
    values, band: NearBand, local: LocalSurface, grid: Grid, settings: Settings, place, progress=None
) -> Surfaces:
    """The meshes that `settings.surface` names, from distances `values`, (nx,ny,nz) float32 or Blocks of the band that
    :func:`band_for` says, and the nodes near the surface.

    The double cover is both sides of the single layer, see :mod:`.double.both_sides`, unless sheets pass through each
    other and it does not show where, or sheets run side by side, or meet where samples do not show it, or samples are
    sparse, or so dense that chords are most of the error, of which two layers extracted apart have less, and no sheets
    run close; then it is extracted at an offset, see :mod:`.double.double_cover`, if that is not rough, or is closer to
    the surface.

    place : function that takes positions (m,3) to the user's units, for messages
    Raises :class:`InputError` where a signed surface is asked for and the shape is not closed,
    :class:`MissingDependency` where quads are asked for and OpenVDB is not found.
    """
    progress, kind = Progress.of(progress), settings.surface
    if settings.faces == "quads" and kind != "none":
        need_quads()
    choice = Choice(values, band, local, grid, _offset(settings), progress)
    if kind == "signed":
        values = signed_distance(values, choice.single.sides, local, place)
    ways = {
        "double": lambda: _double_cover(choice),
        "single": lambda: _single_layer(choice, place, beside_cover=kind == "both"),
        "signed": lambda: _signed_surface(choice, place, values, progress.part(0.6, 1.0, "signed surface")),
    }
    meshes, dropped, warnings = {}, {}, []
    for name in _MESHES.get(kind, (kind,)):
        mesh, said = ways[name]()
        mesh = mesh if settings.faces == "quads" else replace(mesh, pairs=0)
        meshes[name], dropped[name] = without_small_pieces(mesh, settings.pieces)
        warnings += said
    return Surfaces(values, meshes, dropped, tuple(warnings)).placed(place)


def _offset(settings):
    """Cells off the surface at which a double cover is extracted; of a signed surface, which hardly needs it, no more
    than the box has room for."""
    return min(settings.offset, padding_cells(settings.resolution))


def _double_cover(choice):
    """The double cover, and what is said of it."""
    missed = choice.cover_fit.missed
    return choice.cover, [_said_of_missed(missed, "double cover", "they are merged")] if missed > _SOME else []


def _single_layer(choice, place, beside_cover):
    """The single layer, or the double cover where that is torn, and what is said of it; `beside_cover` where there is a
    double cover as well."""
    sheet, unoriented, (worst, missed) = choice.best_single
    if choice.is_cover_better:
        return choice.cover, [_said_of_torn(choice.local, choice.grid)]
    said = []
    if missed > _SOME:
        other = "" if beside_cover and choice.cover_fit.missed > _SOME else ", or use the double cover"
        said.append(_said_of_missed(missed, "single layer", "one of them is missing") + other)
    elif worst > 1 and (sheet.edges.count == 1).any():
        said.append(_SAID_OF_RAGS)
    else:
        said += _said_of_left_out(choice, sheet, "single layer", place)
    if unoriented:
        said.append(
            f"the single layer cannot be wound alike across {unoriented} of its edges: the surface is one-sided "
            "there, or sheets meet; use the double cover where both sides must show"
        )
    return sheet, said


def _signed_surface(choice, place, values, progress):
    """The boundary of the inside, from signed distances, and what is said of it."""
    local, grid, sides, said = choice.local, choice.grid, choice.single.sides, []
    meetings = choice.single.crossings.meetings
    mesh = boundary_of_inside(values, sides, meetings, local, grid, lambda: choice.extracted, progress)
    worst, missed = misfit(mesh, local, grid.spacing)
    if missed > _SOME:
        said.append(_said_of_missed(missed, "signed surface", "one of them is missing"))
    elif worst > 1 and choice.extracted_fit.worst < BETTER * worst:
        said.append("the signed surface is torn, as where walls run closer than the grid's cells; raise the resolution")
    else:
        said += _said_of_left_out(choice, mesh, "signed surface", place)
    if not sides.complete:
        said.append(
            f"{sides.share:.1%} of the surface has the same side on both faces (flaps, inner walls), where "
            f"the signed surface has a face on either side; it spans openings of {sides.spanned:.1%} of its "
            "area; compare it with the single layer"
        )
    return mesh, said


def _said_of_torn(local, grid):
    """Why there is a double cover in place of a single layer, and what helps: no finer grid where points lie many cells
    apart."""
    cells = local.spacing_in_cells(grid)
    if cells > SPARSE:
        return (
            f"points {cells:.2g} cells apart are too few to tell sheets apart, where a single layer is torn: the "
            "double cover is in its place; more points part them"
        )
    return (
        "sheets run closer than the cells of the grid, where a single layer is torn: the double cover is in its place; "
        "raise the resolution until they part"
    )


def _said_of_left_out(choice, mesh, name, place):
    """What a mesh lacks of a scene that it shows on the whole."""
    points = choice.local.points
    lacking = left_out(mesh, points, choice.grid.spacing)
    if len(lacking) >= _LACKING:
        yield (
            f"at least {len(lacking)} of {len(points)} points lie more than a cell off the {name}, for instance near "
            f"{spelt_out(place(lacking[:1])[0])}, as where it lacks thin parts; raise the resolution, or compare it "
            "with the double cover"
        )


def _said_of_missed(missed, mesh, how):
    return (
        f"{missed:.0%} of the points lie more than {OFF:g} cells off the {mesh}, as where sheets run closer than the "
        f"grid's cells and {how}; raise the resolution"
    )
