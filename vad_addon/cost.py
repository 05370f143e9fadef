"""What a run would cost, asked before it starts: shown in the sidebar for as long as the same points are selected."""

import json
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.budget import advised_band, estimate_cost
from ..core.errors import VADError
from ..core.field.grid import fit_grid
from ..core.settings import WHOLE_BOX, Settings
from . import points_in, run, status
from .outcome import COST, Outcome, Task
from .properties import chosen, settings_from


@dataclass(frozen=True)
class Points:
    """What the cost depends on: corners (2,3) of the box and local spacing (n,) of the samples, in scene units, whether
    the samples look noisy, the share of them where sheets run close; and the resolution that suits them. Where dense
    lines were thinned, `thinned_for` is the resolution that this was for, else None."""

    corners: np.ndarray
    spacing: np.ndarray
    noisy: bool
    crowded: float
    suited: int
    thinned_for: int | None

    @classmethod
    def of(cls, found: Outcome) -> "Points":
        """What was found where :data:`COST` was asked for."""
        corners, report = np.stack([found.points.min(axis=0), found.points.max(axis=0)]), json.loads(found.report)
        thinned_for = report["settings"]["resolution"] if report["cleaning"]["thinned"] else None
        return cls(corners, found.spacing, found.noisy, found.crowded, found.suited, thinned_for)

    def cost(self, settings: Settings) -> list[str]:
        """Lines on these points and on the time and memory that `settings` would take."""
        grid = fit_grid(self.corners, settings.resolution)
        estimate = estimate_cost(self.spacing, grid, settings, self.noisy, self.crowded)
        return [
            f"{len(self.spacing):,} points, {np.median(self.spacing):.3g} apart",
            f"Suits: resolution {self.suited}",
            f"At {settings.resolution}: {status.duration(estimate.seconds)}, {estimate.memory_mb:,.0f} MiB",
        ]


_asked = None  # (what was selected, its Points)
_told = {}  # settings: the lines on them


def lines(context: bpy.types.Context) -> list[str]:
    """What is known of the cost for what is selected and set now; empty where nobody asked yet, and where dense lines
    were thinned for another resolution."""
    global _asked
    if _asked is not None and _asked[0] != _selected(context):
        _asked = None
        _told.clear()
    if _asked is None:
        return []
    try:
        settings = settings_from(context.scene.vad)
        if _asked[1].thinned_for not in (None, settings.resolution):
            return []
        if settings not in _told:
            _told.clear()
            _told[settings] = _asked[1].cost(settings)
    except VADError as error:
        return [str(error)]
    return _told[settings]


def suits() -> int:
    """The resolution that suits the points asked about, 0 where nobody asked."""
    return _asked[1].suited if _asked else 0


def _selected(context):
    objects = points_in.sources(context)
    final = [obj.evaluated_get(context.evaluated_depsgraph_get()) for obj in objects]
    places = [[tuple(row) for row in (*obj.matrix_world, *obj.bound_box)] for obj in final]
    names = [(obj.session_uid, obj.mode) for obj in objects]
    stored = context.scene.vad
    return names, places, points_in.point_count(objects, context), chosen(stored)["selected_only"], stored.outliers


class VAD_OT_estimate(run.Run, bpy.types.Operator):
    """Show how long the run would take with the usual solver, how much memory it would need, and which resolution suits
    the points"""

    bl_idname = "vad.estimate"
    bl_label = "Estimate Cost"
    bl_options = {"INTERNAL"}

    def instant(self, task):
        return len(task.points) <= 30_000

    def prepare(self, context):
        self._of = _selected(context)
        source = points_in.selected(context, context.scene.vad.selected_only)
        return Task(source.points, settings_from(context.scene.vad), until=COST)

    def deliver(self, context, scene, found):
        global _asked
        _asked = self._of, Points.of(found)
        _told.clear()
        self.report({"INFO"}, "; ".join(_asked[1].cost(settings_from(scene.vad))))


class VAD_OT_use_resolution(bpy.types.Operator):
    """Take the resolution at which the points are a cell and a half apart: finer ones show hardly more detail.
    Where the whole box would be too much, take a band, too"""

    bl_idname = "vad.use_resolution"
    bl_label = "Use It"
    bl_options = {"INTERNAL", "UNDO"}

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Estimate the cost first")
        return bool(lines(context))

    def execute(self, context):
        stored = context.scene.vad
        in_box = stored.integration == "poisson"  # which has no band
        stored.resolution = min(suits(), WHOLE_BOX) if in_box else suits()
        if suits() > WHOLE_BOX and stored.band == "none" and not in_box:
            stored.band = f"{advised_band(stored.offset):g}"
        return {"FINISHED"}


CLASSES = VAD_OT_estimate, VAD_OT_use_resolution
