"""The extension's preferences: what new scenes start with, and the cache folder."""

import bpy
from bpy.app.handlers import persistent

from ..core.errors import VADError
from ..core.settings import options
from . import volume_files
from .message import draw_message
from .properties import setting_property
from .requirements import torch_hint

PREFERRED = "resolution", "backend", "device", "memory_limit"  # settings with a default of the user's own
_WIDTH = 90  # characters of a line in the preferences
_given = {}  # by name, what was preferred when scenes were last looked at


class VAD_OT_clear_cache(bpy.types.Operator):
    """Delete the volumes in the cache folder, where they are kept until the file is saved. Those that this file shows,
    and those that undo may bring back, stay; another file that was not saved, and is recovered later, loses its own"""

    bl_idname = "vad.clear_cache"
    bl_label = "Clear Cache"
    bl_options = {"INTERNAL"}

    def execute(self, context):
        try:
            freed = volume_files.clear_cache()
        except VADError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"Freed {freed / 2**20:,.1f} MiB")
        return {"FINISHED"}


class VAD_preferences(bpy.types.AddonPreferences):
    bl_idname = volume_files.PACKAGE

    __annotations__ = {
        name: setting_property(options()[name], update=lambda self, context: prepare_scenes()) for name in PREFERRED
    }
    __annotations__["cache"] = bpy.props.StringProperty(
        name="Cache Folder",
        description="Where volumes are kept until the .blend is saved, which brings them along, in a folder vad_cache. "
        "Empty: in Blender's folder for extensions",
        subtype="DIR_PATH",
    )

    def draw(self, context):
        self.layout.label(text="In scenes where nothing else was chosen:")
        column = self.layout.column()
        column.use_property_split = True
        for name in PREFERRED:
            column.prop(self, name)
            if name == "device" and (hint := torch_hint()):
                draw_message(column, hint, "INFO", _WIDTH)
        column.prop(self, "cache")
        files, size = volume_files.cache_contents()
        row = self.layout.row()
        row.label(text=f"Cache: {size / 2**20:,.1f} MiB in {files} files", icon="FILE_CACHE")
        row.operator("wm.path_open", text="Open Folder").filepath = str(volume_files.cache_folder())
        row.operator(VAD_OT_clear_cache.bl_idname, icon="TRASH")


@persistent
def prepare_scenes(*_) -> None:
    """Give every scene in which nothing else was chosen the settings that the user prefers."""
    addon = bpy.context.preferences.addons.get(volume_files.PACKAGE)
    if addon is None or addon.preferences is None:  # run from a checkout
        return
    for name in PREFERRED:
        preferred = getattr(addon.preferences, name)
        for scene in bpy.data.scenes:
            held = getattr(scene.vad, name)
            if held != preferred and (held == _given.get(name) or not scene.vad.is_property_set(name)):
                setattr(scene.vad, name, preferred)
        _given[name] = preferred
