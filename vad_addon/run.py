"""What operators that take their time have in common: the work is done at once from scripts, and in a worker process
with Blender at the user's disposal meanwhile where there is a window."""

import shutil
from contextlib import contextmanager
from pathlib import Path

import bpy

from ..core.errors import VADError
from . import job, outcome, points_in, results, status

_TICK = 0.1  # seconds between looks at the worker


class Run:
    """A mixin for operators, which add

    prepare(context) -> Task          what to compute; raises :class:`VADError`
    deliver(context, scene, outcome)  puts it into the scene and reports; raises :class:`VADError`
    instant(task) -> bool             whether a window, too, computes it at once, so that the redo panel is live
    """

    _live = True

    def instant(self, task):
        return False

    @classmethod
    def poll(cls, context):
        under_way = "A run is under way: wait for it, or cancel it" if job.running() else ""
        problem = under_way or results.scene_problem(context.scene) or cls.problem(context)
        cls.poll_message_set(problem)
        return not problem

    @classmethod
    def problem(cls, context):
        """Why this cannot be run, one line; empty where it can."""
        return points_in.selection_problem(context)

    def execute(self, context):
        try:
            task = self.prepare(context)
            repeated = self.options.is_repeat or self.options.is_repeat_last
            if repeated and not self.instant(task):
                self.report({"WARNING"}, f"That takes a while: set it in the tab and press {self.bl_label} there")
                return {"CANCELLED"}  # Blender brings back what was there
            self._compute(context, task)
        except VADError as error:
            return self._fail(error)
        return {"FINISHED"}

    def invoke(self, context, event):
        try:
            task = self.prepare(context)
            self._live = self.instant(task)
            if bpy.app.background or context.window is None or self._live:
                self._compute(context, task)
                return {"FINISHED"}
            self._job = job.start(task, Path(bpy.app.tempdir))
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
        if event.type == "ESC" and event.value == "PRESS" and not context.screen.is_animation_playing:
            return self._cancelled(context)
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        ended = running.poll()
        status.show(context, running)
        if not ended:
            return {"PASS_THROUGH"}
        try:
            scene = next((scene for scene in bpy.data.scenes if scene.session_uid == self._scene), context.scene)
            if problem := results.scene_problem(scene):
                raise VADError(problem)
            self.deliver(context, scene, running.outcome())
        except VADError as error:
            return self._fail(error)
        finally:
            self._end(context)
        return {"FINISHED"}

    def cancel(self, context):
        """Blender ends the operator: the file is closed, another one loads, or the window goes."""
        self._end(context)

    def draw(self, context):
        """The redo panel, which computes anew at each touch: live where that is quick."""
        if not self._live:
            self.layout.label(text="This took a while: run it again for other settings", icon="INFO")
            return
        self.layout.use_property_split = True
        for name in type(self).__annotations__:
            self.layout.prop(self, name)

    def _compute(self, context, task):
        with _exchange_folder() as folder, percentage(context.window_manager) as progress:
            self.deliver(context, context.scene, outcome.compute(task, folder, progress))
        self._source = None

    def _fail(self, error):
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def _cancelled(self, context):
        self._end(context)
        self.report({"INFO"}, "Cancelled: nothing was changed")
        return {"CANCELLED"}

    def _end(self, context):
        if job.running() is self._job:
            stop()
        context.window_manager.event_timer_remove(self._timer)
        status.clear()
        self._source = self._job = None  # Blender keeps operators for their redo panels, and all that these hold


def stop() -> None:
    """Stop the run under way, if any; its operator notices. What it leaves is removed when its process is dead."""
    if job.running():
        job.stop()
        status.clear()
        if not job.clear() and not bpy.app.timers.is_registered(_clear):
            bpy.app.timers.register(_clear, first_interval=_TICK, persistent=True)


def shut_down() -> None:
    """Stop the run under way, if any, and wait until nothing is left of it."""
    stop()
    job.clear(wait=True)
    if bpy.app.timers.is_registered(_clear):
        bpy.app.timers.unregister(_clear)


def _clear():
    return None if job.clear() else _TICK


@contextmanager
def _exchange_folder():
    folder = job.exchange_folder(Path(bpy.app.tempdir))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def percentage(window_manager: bpy.types.WindowManager):
    """A progress callback that turns the mouse cursor into a percentage."""
    window_manager.progress_begin(0, 100)
    try:
        yield lambda fraction, text: window_manager.progress_update(100 * fraction)
    finally:
        window_manager.progress_end()
