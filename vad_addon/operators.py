"""The operator that does it all, and the one that stops it."""

import bpy

from . import extras, job, points_in, results, run
from .delivery import deliver
from .outcome import Task
from .properties import RUN_OPTIONS, chosen, settings_from, settings_properties


class VAD_OT_reconstruct(run.Run, bpy.types.Operator):
    """Find the surface through the points of the selected objects: as a volume of distances, a mesh, and points with
    normals, in a collection of their own"""

    bl_idname = "vad.reconstruct"
    bl_label = "Reconstruct"
    bl_options = {"UNDO"}  # without REGISTER: its redo panel would recompute everything at each touch

    __annotations__ = settings_properties(options={"SKIP_SAVE"}) | RUN_OPTIONS

    def prepare(self, context):
        options = chosen(context.scene.vad, self.properties)
        self._keep_both = options["keep_both"]
        self._source = points_in.selected(context, options["selected_only"])
        meant, made_from = extras.chosen_result(context), set(points_in.objects_of(self._source))
        updated = meant is not None and set(results.sources(meant)) == made_from and results.can_be_updated(meant)
        self._updated = meant.session_uid if updated and not options["keep_both"] else None
        settings = settings_from(context.scene.vad, self.properties)
        return Task(self._source.points, settings, self._source.constraints)

    def deliver(self, context, scene, found):
        known = set(scene.collection.children_recursive)
        updated = results.again(scene, self._updated)
        collection = deliver(scene, self._source, found, self._keep_both, updated)
        mesh = results.mesh(collection)
        if mesh is not None and collection not in known and not bpy.app.background:
            results.take_the_stage(context, mesh, self._source.uids)
        report_run(self, context, collection)


def report_run(operator: bpy.types.Operator, context: bpy.types.Context, collection: bpy.types.Collection) -> None:
    """Say in the status bar and the info editor what a run found and what went less than well."""
    told, mesh = results.warnings(collection), results.mesh(collection)
    if mesh is not None and context.scene.vad.result == collection:
        told.append(results.unseen(mesh))
    for warning in filter(None, told):
        operator.report({"WARNING"}, warning)
    operator.report({"INFO"}, f"{collection.name}: {', '.join(results.summary(collection))}")


class VAD_OT_cancel(bpy.types.Operator):
    """Stop the run under way; nothing is changed by it"""

    bl_idname = "vad.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("No run is under way")
        return job.running() is not None

    def execute(self, context):
        run.stop()
        return {"FINISHED"}
