"""Text files of points, by File > Import or dropped onto the window. (.ply files Blender reads itself.)"""

from pathlib import Path

import bpy
import numpy as np
from bpy_extras.io_utils import ImportHelper

from ..core.errors import VADError
from ..core.io.points import read_scan
from . import attributes, datablocks, results
from .outcome import centre

EXTENSIONS = ".xyz", ".pts", ".txt", ".csv"


class VAD_OT_import_points(bpy.types.Operator, ImportHelper):
    """Load points from text files, one a line, with colors and other named columns, as meshes of loose vertices"""

    bl_idname = "vad.import_points"
    bl_label = "Import Points"
    bl_options = {"UNDO"}

    filename_ext = ""
    filter_glob: bpy.props.StringProperty(default=";".join(f"*{ext}" for ext in EXTENSIONS), options={"HIDDEN"})
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    files: bpy.props.CollectionProperty(type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"})

    @classmethod
    def poll(cls, context):
        problem = results.scene_problem(context.scene)
        cls.poll_message_set(problem)
        return not problem

    def invoke(self, context, event):
        if self.files:  # dropped
            return self.execute(context)
        return ImportHelper.invoke(self, context, event)

    def execute(self, context):
        paths = [Path(self.directory, file.name) for file in self.files if file.name] or [Path(self.filepath)]
        try:
            clouds = {path: read_scan(path) for path in paths}
        except VADError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        results.leave_modes(context)
        for other in context.selected_objects:
            other.select_set(False)
        for path, (points, carried) in clouds.items():
            self._add(path.stem, points, carried, context)
        return {"FINISHED"}

    def _add(self, name, points, carried, context):
        """A mesh object of loose vertices, placed at their centre: large coordinates keep their detail."""
        kept = np.isfinite(points).all(axis=1)
        finite = points[kept]
        if len(finite) < len(points):
            self.report({"WARNING"}, f"{name}: {len(points) - len(finite)} points left out: not finite")
        origin = centre(finite) if len(finite) else np.zeros(3)
        obj = bpy.data.objects.new(name, datablocks.vertices_data(name, finite, origin))
        found = attributes.of_file({name: values[kept] for name, values in carried.items()})
        attributes.write(obj.data, {n: values for n, values in found.items() if n not in obj.data.attributes})
        obj.location = origin
        results.home([context.collection], context.scene).objects.link(obj)
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
