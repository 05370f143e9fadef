"""Operators: gather, run, deliver, report."""

from contextlib import contextmanager

import bpy

from ..core import pipeline
from ..core.errors import VADError
from .delivery import deliver, summary
from .points_in import selection_problem, world_points
from .properties import settings_from, settings_properties


class VAD_OT_reconstruct(bpy.types.Operator):
    """Find the surface through the points of the active object: as a volume of distances, a mesh, and points with
    normals, in a new collection"""

    bl_idname = "vad.reconstruct"
    bl_label = "Reconstruct"
    bl_options = {"UNDO"}  # without REGISTER: its redo panel would recompute everything at each touch

    __annotations__ = settings_properties(options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context):
        problem = selection_problem(context.active_object)
        cls.poll_message_set(problem)
        return not problem

    def execute(self, context):
        source = context.active_object
        try:
            settings = settings_from(context.scene.vad, override=self.properties)
            points = world_points(source, context)
            with _progress_cursor(context.window_manager) as progress:
                result = pipeline.reconstruct(points, settings, progress=progress)
            delivery = deliver(context.scene, source.name, result)
        except VADError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for warning in delivery.warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"{delivery.collection.name}: {', '.join(summary(delivery.collection))}")
        return {"FINISHED"}


@contextmanager
def _progress_cursor(window_manager):
    """A progress callback for :func:`core.reconstruct` that turns the mouse cursor into a percentage."""
    window_manager.progress_begin(0, 100)
    try:
        yield lambda fraction, text: window_manager.progress_update(100 * fraction)
    finally:
        window_manager.progress_end()
