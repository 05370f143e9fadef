"""Operators that do one stage of a run alone: cleaned points, normals, or everything after the normals anew."""

from dataclasses import asdict

import bpy
import numpy as np

from ..core.settings import options
from . import attributes, datablocks, extras, overlay, points_in, results, run, stored_field, volume_files
from .attributes import Attribute
from .delivery import OWN, deliver, moved_within, of_samples, radius
from .operators import report_run
from .outcome import CLEANING, NORMALS, Task
from .points_in import AXIS, Source
from .properties import setting_property, settings_from, taken_over

_OWN = {"moved", "radius"}  # attributes that cleaned points set themselves


class VAD_OT_denoise(run.Run, bpy.types.Operator):
    """Make a copy of the points without strays, moved onto the smooth surface that neighbours share. What they come
    from is hidden and stays as it is"""

    bl_idname = "vad.denoise"
    bl_label = "Clean Points"
    bl_options = {"REGISTER", "UNDO"}

    strength: bpy.props.FloatProperty(
        name="Strength",
        description="How far points are moved: not at all (0) to all the way (1). Starts from Denoise in the tab where "
        "that is a number above 0, else from 1",
        default=1.0,
        min=0.0,
        max=1.0,
        options={"SKIP_SAVE"},
    )
    outliers: setting_property(options()["outliers"], options={"SKIP_SAVE"})

    def instant(self, task):
        return len(task.points) <= 3000

    def prepare(self, context):
        self._source = points_in.selected(context, context.scene.vad.selected_only)
        stored = context.scene.vad
        if not self.properties.is_property_set("strength") and settings_from(stored).denoise not in {"auto", 0.0}:
            self.strength = settings_from(stored).denoise
        outliers = taken_over(stored, self.properties, ["outliers"])
        settings = settings_from(stored, denoise=self.strength, **outliers)
        return Task(self._source.points, settings, until=CLEANING)

    def deliver(self, context, scene, found):
        source, rows = self._source, found.source_index
        moved = np.linalg.norm(found.points - source.points[rows], axis=1)
        carried = {name: attribute[rows] for name, attribute in attributes.renamed(source.attributes, _OWN).items()}
        carried |= dict(moved=Attribute.of(moved), radius=radius(found))
        if source.constraints:
            axes = np.zeros_like(source.points)
            axes[source.constraints[0]] = source.constraints[1]
            carried[AXIS] = Attribute.of(axes[rows])
        cloud = datablocks.pointcloud_data(f"{source.name} cleaned", found.points, found.origin, carried)
        obj = _placed(context, scene, source, cloud, found.origin)
        if points_in.active_object(context) in points_in.objects_of(source):
            results.leave_modes(context)  # else the copy could not become the active object
        results.take_the_stage(context, obj, source.uids)
        for warning in (*source.warnings, *found.warnings):
            self.report({"WARNING"}, warning)
        dropped = len(source.points) - len(rows)
        facts = f"{len(rows):,} points, {dropped:,} dropped, moved by {moved.mean():.3g} on average"
        self.report({"INFO"}, f"{obj.name}: {facts}")


class VAD_OT_normals(run.Run, bpy.types.Operator):
    """Find the normals alone and show them, without a field or a mesh. Pressed again, it updates them"""

    bl_idname = "vad.normals"
    bl_label = "Find Normals"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        name: setting_property(options()[name], options={"SKIP_SAVE"}) for name in ("solver", "outliers", "denoise")
    }

    def instant(self, task):
        return len(task.points) <= 10_000 and self.solver != "energy"

    def prepare(self, context):
        self._source = points_in.selected(context, context.scene.vad.selected_only)
        stored = context.scene.vad
        settings = settings_from(stored, **taken_over(stored, self.properties, self.__annotations__))
        return Task(self._source.points, settings, self._source.constraints, until=NORMALS)

    def deliver(self, context, scene, found):
        source = self._source
        carried, own = of_samples(source, found)
        cloud = datablocks.pointcloud_data(f"{source.name} normals", found.points, found.origin, carried | own)
        made_from = points_in.objects_of(source)
        obj = results.estimate(scene, made_from)
        if obj is None:
            obj = _placed(context, scene, source, cloud, found.origin)
            obj[results.ROLE] = results.ESTIMATE
            results.note_sources(obj, made_from)
            results.note_turn(obj)
        else:
            datablocks.replace_data(obj.data, cloud)
            results.place(obj, found.origin, results.note_turn(obj))
        if not bpy.app.background:
            scene.vad.overlay.show = True
        for warning in (*source.warnings, *found.warnings):
            self.report({"WARNING"}, warning)
        unsure = int((found.confidence < 0.5).sum())
        self.report({"INFO"}, f"{obj.name}: {len(found.points):,} normals, {unsure:,} of them unsure")


class VAD_OT_reextract(run.Run, bpy.types.Operator):
    """Make field and meshes of the last run anew with other settings, from the normals it found. The closed mesh alone
    is made from the field as it is, in less time, where that fills the whole box and resolution and bridge stay"""

    bl_idname = "vad.reextract"
    bl_label = "Extract Again"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        name: setting_property(options()[name], options={"SKIP_SAVE"})
        for name in ("surface", "faces", "pieces", "bridge", "offset", "resolution", "band")
    }

    @classmethod
    def problem(cls, context):
        collection = extras.chosen_result(context)
        if collection is None:
            return extras.no_results(context)
        samples = results.member(collection, results.SAMPLES)
        if samples is None or not samples.data.attributes.domain_size("POINT"):
            return f"{collection.name} has no samples any more: reconstruct again"
        return ""

    def instant(self, task):
        if task.volume is not None:
            return len(task.points) <= 20_000 and task.settings.resolution <= 128
        return len(task.points) <= 20_000 and task.settings.resolution <= 64

    def prepare(self, context):
        stored = context.scene.vad
        settings = settings_from(stored, **taken_over(stored, self.properties, self.__annotations__))
        collection = extras.chosen_result(context)
        samples = results.member(collection, results.SAMPLES)
        near, axes, confidence, _ = overlay.samples_of(samples.data)
        centre = np.array(samples[results.ORIGIN])
        points = points_in.in_world(near, samples) if moved_within(samples) else near.astype(np.float64) + centre
        made_from = [source for source in results.sources(collection) if source is not None]
        name = made_from[0].name if made_from else samples.name.removesuffix(" samples")
        uids = tuple(source.session_uid for source in made_from)
        carried = {name: found for name, found in attributes.read(samples.data).items() if name not in OWN}
        self._source = Source(name, uids, points, carried, None)
        self._collection = collection.session_uid if results.can_be_updated(collection) else None
        field, volume = results.member(collection, results.FIELD), None
        if field is not None and stored_field.suffices(settings):
            path = volume_files.file_of(field.data)
            now = stored_field.identity(path, near, axes, confidence, asdict(settings))
            volume = path if now is not None and now == collection.get(results.FIELD_OF) else None
        return Task(points, settings, known=(axes, confidence), origin=centre, volume=volume)

    def deliver(self, context, scene, found):
        collection = results.again(scene, self._collection)
        report_run(self, context, deliver(scene, self._source, found, collection=collection))


def _placed(context, scene, source, data, origin):
    """A new object, beside the first that its points come from where that is shown."""
    obj = bpy.data.objects.new(data.name, data)
    obj.location = origin
    layer = context.view_layer if context.scene == scene else scene.view_layers[0]
    beside = [home for made_from in points_in.objects_of(source)[:1] for home in made_from.users_collection]
    homes = [home for home in beside if results.is_in(home, layer)]
    results.home(homes, scene).objects.link(obj)
    return obj


CLASSES = VAD_OT_denoise, VAD_OT_normals, VAD_OT_reextract
