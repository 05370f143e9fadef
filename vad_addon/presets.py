"""Settings by name, in Blender's own preset menu: those shipped in presets/ and those the user adds."""

from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..core.settings import options

SUBFOLDER = "vad/reconstruct"
SHIPPED = Path(__file__).parent  # holds the folder "presets", as Blender wants it


class VAD_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Add or remove a preset of the reconstruction's settings"""

    bl_idname = "vad.add_preset"
    bl_label = "Add Preset"
    preset_menu = "VAD_PT_presets"
    preset_subdir = SUBFOLDER
    preset_defines = ["settings = bpy.context.scene.vad"]
    preset_values = [f"settings.{name}" for name in options()]


class VAD_PT_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Presets"
    preset_subdir = SUBFOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = VAD_OT_add_preset.bl_idname


def register():
    bpy.utils.register_preset_path(str(SHIPPED))


def unregister():
    bpy.utils.unregister_preset_path(str(SHIPPED))
