"""The single layer: one sheet, open where the surface is open, non-manifold where sheets meet."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from ...field.blocks import Blocks
from ...field.grid import Grid
from ...field.local_surface import LocalSurface
from ...field.steps import NearBand
from ...parallel import beside
from ...progress import Progress
from ...settings import Settings
from ..double.double_cover import double_cover
from ..edges.close_walls import beside_within_cells
from ..edges.crossings import Crossings, find_crossings
from ..edges.meetings import FEW, Meetings, find_meetings
from ..mesh import Mesh
from ..meshing.misfit import BETTER, ROUGH, SHOWN, Misfit, misfit
from ..signs.sides import Sides, far_regions, find_sides
from ..signs.two_sides import two_sided
from .routes import sheet_between_sides, sheet_of_crossings, sheet_of_sides
from .thin_walls import with_thin_walls


def single_layer(
    values, band: NearBand, crossings: Crossings, sides: Sides, surface: LocalSurface, grid: Grid, progress=None
) -> tuple[Mesh, int]:
    """The surface as one sheet: :func:`sheet_of_sides`, and where there is none :func:`sheet_of_crossings`.

    values    : (nx,ny,nz) float32 or Blocks, unsigned distances at the grid's nodes, units of the samples
    band      : the nodes near the surface
    crossings : where the surface crosses the grid's edges     sides : the inside that these bound, if any

    Returns the mesh, in units of the samples, and the number of its edges across which it cannot be wound alike. A
    whole run goes on from here where sheets run side by side and this is rough, see :meth:`SingleLayer.told_apart`.
    Raises :class:`SettingsError` where a double cover is needed and the box has no room for it, and
    :class:`InputError` for distances of another grid or one that does not hold the surface.
    """
    grid.check(surface.points, np.shape(values), band.shape)
    cover = partial(double_cover, values, band, surface, grid, Settings().offset)
    layer = SingleLayer(values, band, surface, grid, cover, Progress.of(progress))
    vars(layer)["_crossings_and_sides"] = crossings, sides
    return layer.sheet


@dataclass(frozen=True)
class SingleLayer:
    """The single layer, and what it is made of, each found when it is first asked for.

    cover   : function that gives the double cover extracted at an offset
    by_room : whether sheets side by side are told apart by the room that each sample has beside others, too
    """

    values: np.ndarray | Blocks
    band: NearBand
    local: LocalSurface
    grid: Grid
    cover: Callable[[], Mesh]
    progress: Progress
    by_room: bool = False

    @cached_property
    def meetings(self) -> Meetings:
        return find_meetings(self.local, self.progress.part(0.0, 0.05, "crossings"), self.by_room)

    @property
    def crossings(self) -> Crossings:
        return self._crossings_and_sides[0]

    @property
    def sides(self) -> Sides:
        return self._crossings_and_sides[1]

    @cached_property
    def _crossings_and_sides(self):
        """Crossings and sides by the meetings. Where these bound no inside, once more with the samples that
        :func:`beside_within_cells` finds on close walls; kept only if an inside is bounded then, since elsewhere such
        walls bring lines of more than two faces."""
        found = self._found_by(self.meetings, self.progress.part(0.05, 0.2, "crossings"))
        if found[1].complete or found[1].share == 1:
            return found
        more = self.meetings.with_beside(beside_within_cells(self.band, self.local, self.grid))
        if more is self.meetings:
            return found
        other = self._found_by(more, self.progress.part(0.2, 0.3, "crossings"))
        return other if other[1].complete else found

    def _found_by(self, meetings, progress):
        with beside(partial(far_regions, self.values, self.local, self.grid)) as far:
            crossings = find_crossings(self.band, self.local, self.grid, progress.part(0.0, 0.6), meetings)
        return crossings, find_sides(self.values, crossings, self.local, self.grid, progress.part(0.6, 1.0), far())

    @cached_property
    def two_sides(self) -> np.ndarray | Blocks | None:
        """Distances with the signs of the two sides of a surface that bounds no inside, see :func:`two_sided`."""
        part = self.progress.part(0.3, 0.35, "single layer")
        return two_sided(self.values, self.band, self.crossings, self.local, self.grid, part)

    @cached_property
    def between(self) -> Mesh | None:
        """What lies between the two sides of a surface that bounds no inside."""
        part = self.progress.part(0.35, 0.5, "single layer")
        given = self.band, self.crossings, self.sides, self.local, self.grid
        return sheet_between_sides(lambda: self.two_sides, *given, part)

    @cached_property
    def of_sides(self) -> Mesh | None:
        """The single layer of a surface with two sides."""
        part = self.progress.part(0.3, 0.5, "single layer")
        given = self.values, self.crossings, self.sides, self.local, self.grid, self.between
        return sheet_of_sides(*given, self.cover, part)

    @cached_property
    def sheet(self) -> tuple[Mesh, int]:
        """That of any surface, and the number of its edges that cannot be wound alike."""
        found = (self.of_sides, 0) if self.of_sides is not None else self._sheet_of_crossings()
        vars(self).pop("two_sides", None)  # as large as the field, and not asked for again
        return found

    def _sheet_of_crossings(self):
        part = self.progress.part(0.5, 0.7, "single layer")
        given = self.band, self.crossings, self.local, self.grid, self.between
        return sheet_of_crossings(lambda: self.two_sides, *given, self.cover, part)

    @cached_property
    def misfit(self) -> Misfit:
        """:func:`misfit` of that."""
        return misfit(self.sheet[0], self.local, self.grid.spacing)

    @property
    def is_rough(self) -> bool:
        """Whether sheets run side by side, and it goes to and fro between them, or is torn where it bounds an inside
        and few of its meetings are of such sheets."""
        parted = self.sides.complete and not self.meetings.much_side_by_side
        return self.meetings.side_by_side and self.misfit.worst > (1 if parted else ROUGH)

    def told_apart(self) -> "SingleLayer":
        """This, or where it is rough the one with sheets told apart by their room, if that is better:

        - its misfit is less than half of this one's; or
        - it is less at all, it shows more of the samples, and both are torn (of a misfit above 1) or neither is.

        It is not looked for where so few samples have little room that these may be chance, and never takes the place
        of what lies between two sides. That has no lines of more than two faces, and it may have some along creases."""
        if not self.is_rough or self.between is not None or np.isfinite(self.local.room).mean() <= FEW:
            return self
        other = replace(self, by_room=True, progress=self.progress.part(0.7, 0.95))
        if not other.meetings.adds_to(self.meetings):
            return self
        (worst, missed), (others_worst, others_missed) = self.misfit, other.misfit
        shows_more = missed - others_missed > SHOWN and (worst > 1) == (others_worst > 1)
        return other if others_worst < (1 if shows_more else BETTER) * worst else self

    def with_thin_walls(self) -> tuple[Mesh, int]:
        """The single layer, with pieces of the double cover around thin walls where it is rough and has no two sides;
        see :func:`with_thin_walls`."""
        if not self.is_rough or self.of_sides is not None:
            return self.sheet
        return with_thin_walls(*self.sheet, self.cover(), self.local, self.grid.spacing)
