"""What a run would cost, asked before it starts: shown in the sidebar for as long as the same points are selected."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..core.budget import advised_band, estimate_cost, suited_resolution
from ..core.cleaning.clean import clean
from ..core.cleaning.noise import looks_noisy
from ..core.errors import VADError
from ..core.field.grid import fit_grid
from ..core.points import local_spacing, prepare_samples
from ..core.progress import Progress
from ..core.settings import WHOLE_BOX, Settings
from . import points_in, status
from .properties import chosen, settings_from
from .run import percentage


@dataclass(frozen=True)
class Points:
    """What the cost depends on: corners (2,3) of the box and local spacing (n,) of the samples, the factor that takes
    these lengths to scene units, and whether the samples look noisy."""

    corners: np.ndarray
    spacing: np.ndarray
    scale: float
    noisy: bool

    @classmethod
    def of(cls, points: np.ndarray, outliers: bool = True, progress=None) -> "Points":
        """Those of (n,3) points, where `outliers` without strays. Raises :class:`InputError` for points that cannot be
        used."""
        progress = Progress.of(progress)
        samples = prepare_samples(points, progress.part(0.0, 0.3)).in_spatial_order()
        samples, _ = clean(samples, Settings(outliers=outliers, denoise=0.0), progress.part(0.3, 0.5))
        corners = np.stack([samples.points.min(axis=0), samples.points.max(axis=0)])
        spacing = local_spacing(samples.points, progress.part(0.5, 0.9))
        return cls(corners, spacing, samples.scale, looks_noisy(samples.points, spacing))

    def suits(self) -> int:
        """The resolution at which the points are a cell and a half apart."""
        return suited_resolution(self.corners, self.spacing)

    def cost(self, settings: Settings) -> list[str]:
        """Lines on these points and on the time and memory that `settings` would take."""
        noisy = self.noisy if settings.denoise == "auto" else settings.denoise > 0
        estimate = estimate_cost(self.spacing, fit_grid(self.corners, settings.resolution), settings, noisy)
        return [
            f"{len(self.spacing):,} points, {np.median(self.spacing) * self.scale:.3g} apart",
            f"Suits: resolution {self.suits()}",
            f"At {settings.resolution}: {status.duration(estimate.seconds)}, {estimate.memory_mb:,.0f} MiB",
        ]


_asked = None  # (what was selected, its Points)
_told = {}  # settings: the lines on them


def lines(context: bpy.types.Context) -> list[str]:
    """What is known of the cost for what is selected and set now; empty where nobody asked yet."""
    global _asked
    if _asked is not None and _asked[0] != _selected(context):
        _asked = None
        _told.clear()
    if _asked is None:
        return []
    try:
        settings = settings_from(context.scene.vad)
        if settings not in _told:
            _told.clear()
            _told[settings] = _asked[1].cost(settings)
    except VADError as error:
        return [str(error)]
    return _told[settings]


def suits() -> int:
    """The resolution that suits the points asked about, 0 where nobody asked."""
    return _asked[1].suits() if _asked else 0


def _selected(context):
    objects = points_in.sources(context)
    names = [(obj.session_uid, obj.mode) for obj in objects]
    stored = context.scene.vad
    return names, points_in.point_count(objects, context), chosen(stored)["selected_only"], stored.outliers


class VAD_OT_estimate(bpy.types.Operator):
    """Show how long the run would take, how much memory it would need, and which resolution suits the points"""

    bl_idname = "vad.estimate"
    bl_label = "Estimate Cost"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        problem = points_in.selection_problem(context)
        cls.poll_message_set(problem)
        return not problem

    def execute(self, context):
        global _asked
        try:
            stored = context.scene.vad
            source = points_in.selected(context, stored.selected_only)
            with percentage(context.window_manager) as progress:
                _asked = _selected(context), Points.of(source.points, stored.outliers, progress)
            _told.clear()
            settings_from(stored)
        except VADError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, "; ".join(lines(context)))
        return {"FINISHED"}


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
        stored.resolution = suits()
        if suits() > WHOLE_BOX and stored.band == "none" and stored.integration == "transport":
            stored.band = f"{advised_band(stored.offset):g}"
        return {"FINISHED"}


CLASSES = VAD_OT_estimate, VAD_OT_use_resolution
