"""Which mesh is the double cover, and which the single layer."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..field.blocks import Blocks
from ..field.grid import Grid
from ..field.local_surface import LocalSurface
from ..field.steps import NearBand
from ..parallel import side_by_side
from ..progress import Progress
from .double.both_sides import both_sides
from .double.double_cover import DENSE, double_cover
from .double.ridges import ridge_share
from .edges.meetings import Meetings
from .mesh import Mesh
from .meshing.misfit import BETTER, ROUGH, SHOWN, Misfit, chamfer, misfit
from .meshing.pieces import pieces_touch, pieces_with_samples
from .signs.sides import may_be_closed
from .single.single_layer import SingleLayer

_MERGED = 0.4  # misfit of a double cover beyond which the single layer is looked at
SPARSEST = 5.0  # cells, median local spacing up to which single layers have the handles of the surface alone
_CLOSE = 1e-3  # grid edges across ridges, for each node of the band: with fewer sheets run nowhere close
_SEEN = 0.7  # of the vertices on lines where a single layer has more than two faces, at least, at meetings
_CLEAN = 0.9975  # mean confidence of samples whose sheets pass through others, at least; noise of .05 cells leaves less
_MISSED = 0.1  # of the samples, that the single layer misses and a double cover in its place does not
_SPLIT = 0.3  # of the vertices on borders of one without such lines, at most: it has parted sheets that meet


@dataclass(frozen=True)
class Choice:
    """The double cover and the single layer, and what they are chosen from, each found when it is first asked for."""

    values: np.ndarray | Blocks
    band: NearBand
    local: LocalSurface
    grid: Grid
    offset: float
    progress: Progress

    @cached_property
    def single(self) -> SingleLayer:
        return SingleLayer(self.values, self.band, self.local, self.grid, lambda: self.extracted, self.progress)

    @property
    def meetings(self) -> Meetings:
        return self.single.meetings

    @cached_property
    def best_single(self) -> tuple[Mesh, int, Misfit]:
        """The single layer for users, the number of its edges that cannot be wound alike, and :func:`misfit` of it."""
        found = self.single.told_apart()
        sheet, unoriented = found.with_thin_walls()
        fit = found.misfit if sheet is found.sheet[0] else misfit(sheet, self.local, self.grid.spacing)
        return sheet, unoriented, fit

    @property
    def is_cover_better(self) -> bool:
        """Whether the single layer is torn or misses many samples, and the double cover does not, nor is made of its
        sides."""
        worst, missed = self.best_single[2]
        if (worst <= 1 and missed <= _MISSED) or self.is_of_sheet:
            return False
        cover = self.extracted_fit
        return (worst > 1 and cover.worst < BETTER * worst) or missed - cover.missed > _MISSED

    @cached_property
    def cover(self) -> Mesh:
        """The double cover."""
        return self.both_sides if self.is_of_sheet else self.extracted

    @cached_property
    def cover_fit(self) -> Misfit:
        """:func:`misfit` of the double cover."""
        if not self.is_of_sheet:
            return self.extracted_fit
        return misfit(self.cover, self.local, self.grid.spacing) if self.meetings.side_by_side else self.single.misfit

    @cached_property
    def is_of_sheet(self) -> bool:
        """Whether the double cover is both sides of the single layer: where these are the whole surface and not torn,
        nor even rough where sheets run side by side, and in doubt where they are closer to it than the cover extracted.
        """
        looked = self._may_be_sheet()
        if looked and self._is_whole():
            fit, _ = side_by_side(lambda: self.single.misfit, lambda: self.both_sides)
            if fit.worst <= 1 and not self.single.is_rough:
                return True
        return (looked or self._is_rough()) and self._is_closer()

    def _is_rough(self):
        """Whether the extracted double cover is torn, or where sheets run side by side and the surface has two sides,
        whether it is rough, so that it may merge what the single layer parts."""
        if self.local.spacing_in_cells(self.grid) > SPARSEST:
            return False
        worst = self.extracted_fit.worst
        return worst > _MERGED or (worst > ROUGH and self.meetings.side_by_side and self.single.of_sides is not None)

    def _is_closer(self):
        """Whether both sides of the single layer are closer to the surface than the extracted double cover, and do not
        miss ends of it that this shows. They may take long to find, so the single layer itself is asked first."""
        if self.single.misfit.missed - self.extracted_fit.missed > SHOWN:
            return False
        cover = self._off(self.extracted)
        return self._off(self.single.sheet[0]) < cover and self._off(self.both_sides) < cover

    def _off(self, mesh):
        return chamfer(mesh, self.local, self.grid.spacing)

    @cached_property
    def both_sides(self) -> Mesh:
        """Those of the single layer, without the pockets of a few faces that may be left along the lines where sheets
        meet."""
        cover = both_sides(self.single.sheet[0], self.grid.spacing)
        if self.single.of_sides is not None:
            return cover
        return pieces_with_samples(cover, self.local.tree, self.grid.spacing)

    @cached_property
    def extracted(self) -> Mesh:
        """The double cover extracted at an offset."""
        part = self.progress.part(0.7, 1.0, "double cover")
        return double_cover(self.values, self.band, self.local, self.grid, self.offset, part)

    @cached_property
    def extracted_fit(self) -> Misfit:
        """:func:`misfit` of that."""
        return misfit(self.extracted, self.local, self.grid.spacing)

    def _may_be_sheet(self):
        """Whether to look for a single layer. Sheets that pass through each other have one with handles, unless their
        lines are known where it is closed, and samples are free of noise where it is not; sheets side by side have a
        torn one, but a closed shape does not whose walls run close, or whose corners look like that."""
        cells = self.local.spacing_in_cells(self.grid)
        if cells > SPARSEST or (cells < DENSE and ridge_share(self.band) < _CLOSE):
            return False
        if self.meetings.few:
            return True
        if self.meetings.pass_through:
            if self.single.sides.complete:
                return bool(self.meetings.passing.any())
            if self.local.confidence[self.meetings.through].mean() < _CLEAN:
                return False
        return not self.meetings.side_by_side or may_be_closed(self.values, self.local, self.grid)

    def _is_whole(self):
        """Whether the single layer shows all of the surface. It does where there are two sides, and may on a one-sided
        surface unless it falls apart, and where sheets meet if its lines are where samples show that, none of them side
        by side, or if it has none and its borders are elsewhere. Where sheets pass through each other it has lines."""
        if self.single.of_sides is not None:
            return self.single.sides.complete or not self.meetings.pass_through
        sheet = self.single.sheet[0]
        edges, count = sheet.edges, sheet.edges.count
        border, line = (np.flatnonzero(edges.ends_at(some)) for some in (count == 1, count > 2))
        if len(line):
            shown = self.meetings.passing.any() or self._at_meetings(sheet.vertices[line]) >= _SEEN
            return shown and not self.meetings.side_by_side
        if self.meetings.pass_through or pieces_touch(sheet, self.grid.spacing):
            return False
        if not (self.single.crossings.normal.any() and len(border)):
            return True
        return self._at_meetings(sheet.vertices[border]) <= _SPLIT

    def _at_meetings(self, places):
        """The share of places (m,3), at least one, whose nearest samples are where sheets meet."""
        return self.meetings.at[self.local.tree.query(places)[1]].mean()
