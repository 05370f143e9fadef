"""How far the run is: in words, in the status bar and in the sidebar."""

import bpy

from .job import Job


def line(running: Job) -> str:
    """Stage and time left, e.g. "distance field, 12 s left"."""
    seconds = running.seconds_left()
    return running.stage if seconds is None else f"{running.stage}, {duration(seconds)} left"


def duration(seconds: float) -> str:
    """The two coarsest units that matter: 8 s, 1 min 20 s, 2 h 5 min."""
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60} min"


def show(context: bpy.types.Context, running: Job) -> None:
    """Bring the status bar and the sidebars up to date."""
    context.workspace.status_text_set(f"VAD: {running.fraction:.0%}, {line(running)}   |   Esc: cancel")
    _redraw_sidebars(context)


def clear() -> None:
    """Give the status bar back to Blender, also in workspaces that the user left meanwhile."""
    for workspace in bpy.data.workspaces:
        workspace.status_text_set(None)
    _redraw_sidebars(bpy.context)


def _redraw_sidebars(context):
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
