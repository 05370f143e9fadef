"""What a run would cost, asked before it starts."""

import bpy
import numpy as np

from ..core.budget import estimate_cost
from ..core.errors import VADError
from ..core.field.grid import fit_grid
from ..core.points import local_spacing, prepare_samples
from ..core.settings import Settings, options
from . import points_in, status
from .properties import settings_from


def cost_in_words(points: np.ndarray, settings: Settings) -> list[str]:
    """Lines on the points (n,3), the resolution that suits them, and the time and memory that `settings` would take.

    Raises :class:`InputError` for points that cannot be used.
    """
    samples = prepare_samples(points)
    spacing = local_spacing(samples.points)
    grid = fit_grid(samples.points, settings.resolution)
    estimate = estimate_cost(spacing, grid, settings)
    low, high = options()["resolution"].metadata["limits"]
    one_cell_each = grid.spacing * settings.resolution / np.median(spacing)
    return [
        f"{len(samples.points):,} points",
        f"{np.median(spacing) * samples.scale:.3g} apart",
        f"Suits: resolution {round(float(np.clip(one_cell_each, low, high)))}",
        f"At {settings.resolution}: {status.duration(estimate.seconds)}, {estimate.memory_mb:,.0f} MiB",
    ]


class VAD_OT_estimate(bpy.types.Operator):
    """Say how long the run would take, how much memory it would need, and which resolution suits the points"""

    bl_idname = "vad.estimate"
    bl_label = "Estimate Cost"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        problem = points_in.selection_problem(context)
        cls.poll_message_set(problem)
        return not problem

    def execute(self, context):
        stored = context.scene.vad
        try:
            source = points_in.gather(points_in.sources(context), context, stored.selected_only)
            lines = cost_in_words(source.points, settings_from(stored))
        except VADError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, "; ".join(lines))
        if not bpy.app.background:
            context.window_manager.popup_menu(lambda menu, _: _draw(menu.layout, lines), title=source.name, icon="INFO")
        return {"FINISHED"}


def _draw(layout, lines):
    for line in lines:
        layout.label(text=line)
