"""Text files of points, by File > Import or dropped onto the window. (.ply files Blender reads itself.)"""

from pathlib import Path

import bpy
import numpy as np
from bpy_extras.io_utils import ImportHelper

from ..core.errors import VADError
from ..core.io.points import read_points
from . import datablocks
from .outcome import centre

EXTENSIONS = ".xyz", ".pts", ".txt", ".csv"


class VAD_OT_import_points(bpy.types.Operator, ImportHelper):
    """Load points from text files, one a line, as meshes of loose vertices"""

    bl_idname = "vad.import_points"
    bl_label = "Import Points"
    bl_options = {"UNDO"}

    filename_ext = ""
    filter_glob: bpy.props.StringProperty(default=";".join(f"*{ext}" for ext in EXTENSIONS), options={"HIDDEN"})
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    files: bpy.props.CollectionProperty(type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"})

    def invoke(self, context, event):
        if self.files:  # dropped
            return self.execute(context)
        return ImportHelper.invoke(self, context, event)

    def execute(self, context):
        paths = [Path(self.directory, file.name) for file in self.files if file.name] or [Path(self.filepath)]
        try:
            clouds = {path: read_points(path) for path in paths}
        except VADError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for other in context.selected_objects:
            other.select_set(False)
        for path, points in clouds.items():
            self._add(path.stem, points, context)
        return {"FINISHED"}

    def _add(self, name, points, context):
        """A mesh object of loose vertices, placed at their centre: large coordinates keep their detail."""
        finite = points[np.isfinite(points).all(axis=1)]
        if len(finite) < len(points):
            self.report({"WARNING"}, f"{name}: {len(points) - len(finite)} points left out: not finite")
        origin = centre(finite) if len(finite) else np.zeros(3)
        obj = bpy.data.objects.new(name, datablocks.vertices_data(name, finite, origin))
        obj.location = origin
        context.collection.objects.link(obj)
        obj.select_set(True)
        context.view_layer.objects.active = obj
        self.report({"INFO"}, f"{obj.name}: {len(finite):,} points")


class VAD_FH_points(bpy.types.FileHandler):
    bl_idname = "VAD_FH_points"
    bl_label = "Points"
    bl_import_operator = VAD_OT_import_points.bl_idname
    bl_file_extensions = ";".join(EXTENSIONS)

    @classmethod
    def poll_drop(cls, context):
        return context.area is not None and context.area.type in {"VIEW_3D", "OUTLINER"}


def draw_menu(self, context):
    names = "/".join(EXTENSIONS)
    self.layout.operator(VAD_OT_import_points.bl_idname, text=f"Points ({names})")
