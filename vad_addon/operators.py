"""Operators: gather, run, deliver, report."""

import shutil
from contextlib import contextmanager
from pathlib import Path

import bpy

from ..core.errors import VADError
from . import job, outcome, points_in, results, status
from .delivery import deliver
from .properties import RUN_OPTIONS, chosen, settings_from, settings_properties

_TICK = 0.1  # seconds between looks at the worker


class VAD_OT_reconstruct(bpy.types.Operator):
    """Find the surface through the points of the selected objects: as a volume of distances, a mesh, and points with
    normals, in a collection of their own"""

    bl_idname = "vad.reconstruct"
    bl_label = "Reconstruct"
    bl_options = {"UNDO"}  # without REGISTER: its redo panel would recompute everything at each touch

    __annotations__ = settings_properties(options={"SKIP_SAVE"}) | RUN_OPTIONS

    @classmethod
    def poll(cls, context):
        problem = "A run is under way: wait for it, or cancel it" if job.running() else ""
        problem = problem or points_in.selection_problem(context)
        cls.poll_message_set(problem)
        return not problem

    def execute(self, context):
        """The whole run at once, for scripts."""
        try:
            self._gather(context)
            with _exchange_folder() as folder, _cursor(context.window_manager) as progress:
                return self._deliver(context.scene, outcome.compute(self._task, folder, progress))
        except VADError as error:
            return self._fail(error)

    def invoke(self, context, event):
        """The same in a worker process, with Blender at the user's disposal meanwhile."""
        if bpy.app.background:  # no window, no events
            return self.execute(context)
        try:
            self._gather(context)
            self._job = job.start(self._task, Path(bpy.app.tempdir))
        except VADError as error:
            return self._fail(error)
        self._scene = context.scene.session_uid
        self._timer = context.window_manager.event_timer_add(_TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        running = self._job
        if job.running() is not running:  # stopped from elsewhere: the Cancel button
            return self._cancelled(context)
        if event.type == "ESC" and event.value == "PRESS":
            return self._cancelled(context)
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        ended = running.poll()
        status.show(context, running)
        if not ended:
            return {"PASS_THROUGH"}
        try:
            scene = next((scene for scene in bpy.data.scenes if scene.session_uid == self._scene), context.scene)
            return self._deliver(scene, running.outcome())
        except VADError as error:
            return self._fail(error)
        finally:
            self._end(context)

    def cancel(self, context):
        """Blender ends the operator: the file is closed, another one loads, or the window goes."""
        if job.running() is self._job:
            stop_run()

    def _gather(self, context):
        options = chosen(context.scene.vad, self.properties)
        self._keep_both = options["keep_both"]
        self._source = points_in.gather(points_in.sources(context), context, options["selected_only"])
        settings = settings_from(context.scene.vad, self.properties)
        self._task = outcome.Task(self._source.points, settings, self._source.constraints)

    def _deliver(self, scene, found):
        collection = deliver(scene, self._source, found, self._keep_both)
        for warning in results.warnings(collection):
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"{collection.name}: {', '.join(results.summary(collection))}")
        return {"FINISHED"}

    def _fail(self, error):
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def _cancelled(self, context):
        self._end(context)
        self.report({"INFO"}, "Cancelled: nothing was changed")
        return {"CANCELLED"}

    def _end(self, context):
        if job.running() is self._job:
            job.stop()
        context.window_manager.event_timer_remove(self._timer)
        status.clear()


def stop_run() -> None:
    """Stop the run under way, if any; its operator notices."""
    if job.running():
        job.stop()
        status.clear()


class VAD_OT_cancel(bpy.types.Operator):
    """Stop the reconstruction under way; nothing is changed by it"""

    bl_idname = "vad.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("No reconstruction is under way")
        return job.running() is not None

    def execute(self, context):
        stop_run()
        return {"FINISHED"}


@contextmanager
def _exchange_folder():
    folder = job.exchange_folder(Path(bpy.app.tempdir))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _cursor(window_manager):
    """A progress callback that turns the mouse cursor into a percentage."""
    window_manager.progress_begin(0, 100)
    try:
        yield lambda fraction, text: window_manager.progress_update(100 * fraction)
    finally:
        window_manager.progress_end()
