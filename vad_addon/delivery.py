"""From the outcome of a run to objects in the scene."""

import hashlib
import json
from contextlib import ExitStack
from dataclasses import replace

import bpy
import numpy as np

from ..core.errors import VADError
from . import attributes, datablocks, materials, overlay, results, shapes, stored_field, volume_files
from .attributes import Attribute
from .outcome import Outcome
from .points_in import Source, objects_of

_SCULPTED = {".sculpt_face_set", ".sculpt_mask"}  # attributes of Blender's own that the user makes
OWN = {"normal", "confidence", "distance", "radius"}  # attributes that results set themselves


def deliver(
    scene: bpy.types.Scene,
    source: Source,
    outcome: Outcome,
    keep_both: bool = False,
    collection: bpy.types.Collection | None = None,
) -> bpy.types.Collection:
    """Put the outcome into a collection "`name` VAD" of `scene`: meshes, samples and volume, all or nothing.

    Where just these objects have results from an earlier run, these are updated (those in `collection` where it is
    given), and keep the materials and the modifiers that the user gave them; `keep_both` makes a second collection
    instead. Meshes that the user changed are kept as objects of their own, hidden, with a warning, or where an object
    of the user's shows them.
    The field stays as it is where the outcome is made from its file.
    Objects are placed at the centre of the samples and their data is relative to it, so that single precision is enough
    for large coordinates. Of new results only the mesh is shown. A volume that cannot be written becomes a warning: the
    other results are delivered, and an earlier volume stays for what follows it.
    The collection carries the run's report as JSON in its custom property ``vad_report``; see also :mod:`results`.
    """
    warnings = [*source.warnings, *outcome.warnings]
    if collection is None and not keep_both:
        collection = results.previous(scene, objects_of(source))
    if collection is not None and results.are_edited(results.all_of(collection)):
        warnings.append(f"{collection.name} is being edited and stays as it is: the new results are beside it")
        collection = None
    if collection is not None:
        results.drop_deleted(collection)
    known = results.member(collection, results.FIELD) if collection is not None else None
    stands = known is not None and outcome.volume == volume_files.file_of(known.data)
    if stands:
        report = json.dumps(json.loads(collection[results.REPORT]) | json.loads(outcome.report))
        outcome = replace(outcome, volume=None, report=report)
    with ExitStack() as rollback:
        made = _data(source, outcome, warnings, rollback)
        if collection is None:
            collection = bpy.data.collections.new(f"{source.name} VAD")
            scene.collection.children.link(collection)
            results.note_sources(collection, objects_of(source))
        rollback.pop_all()
    before, mesh = set(results.members(collection)), results.mesh(collection)
    for changed in (obj for obj in before if results.MADE in obj and _is_changed(obj)):
        if results.is_shown_by_others(changed, copies=False):
            changed.data = changed.data.copy()  # the other stays as it is
        else:
            warnings.append(_set_aside(scene, changed))
    _recast(collection, made)
    turned = results.note_turn(collection)
    looked_at = [layer for layer in scene.view_layers if layer.objects.active in before]
    for role in (role for role in results.ROLES if role != results.FIELD or role in made):
        _place(collection, role, made.get(role), outcome.origin, turned)
    stays = before if results.mesh(collection) == mesh else set()
    _show_mesh_first(scene, collection, stays)
    _stay_active(looked_at, results.mesh(collection))
    _colour(set(results.members(collection)) - before, source)
    if results.FIELD in made:
        shapes.follow(collection)
        materials.fit_fog(results.member(collection, results.FIELD).data, outcome.cell, outcome.shape)
    collection.pop(results.FIELD_OF, None)
    if stands or results.FIELD in made:
        made_from = overlay.samples_of(made[results.SAMPLES])[:3]
        path = volume_files.file_of(results.member(collection, results.FIELD).data)
        collection[results.FIELD_OF] = stored_field.identity(path, *made_from, json.loads(outcome.report)["settings"])
    elif known is not None:
        warnings.append(f"{known.name} is out of date: it stays as an earlier run left it")
    collection[results.REPORT] = outcome.report
    collection[results.SUMMARY] = "\n".join(_summary(outcome))
    collection[results.WARNINGS] = "\n".join(warnings)
    scene.vad.result = collection
    return collection


def of_samples(source: Source, outcome: Outcome) -> tuple[dict[str, Attribute], dict[str, Attribute]]:
    """What the samples carry: of their points, and what a run found of them."""
    carried = {name: attribute[outcome.source_index] for name, attribute in _carried(source).items()}
    found = dict(normal=Attribute.of(outcome.normals), confidence=Attribute.of(outcome.confidence))
    return carried, found | dict(radius=radius(outcome))


def _carried(source):
    """What the points carry, under names that results do not set themselves."""
    return attributes.renamed(source.attributes, OWN)


def radius(outcome: Outcome) -> Attribute:
    """How large points are drawn."""
    return Attribute.of(np.full(len(outcome.points), 0.25 * outcome.cell))


def _data(source, outcome, warnings, rollback):
    """New data-blocks by role; `rollback` removes them and the volume's file."""

    def keep(data):
        rollback.callback(bpy.data.batch_remove, [data])
        return data

    carried, own = of_samples(source, outcome)
    name, origin = source.name, outcome.origin
    made = {
        results.SAMPLES: keep(
            datablocks.pointcloud_data(f"{name} samples", outcome.points, origin, carried | own),
        )
    }
    for role, skin in ((results.SURFACE, outcome.surface), (results.SHEET, outcome.sheet)):
        if skin is not None:
            on_skin = {key: attribute[skin.nearest] for key, attribute in carried.items()}
            on_skin |= dict(distance=Attribute.of(skin.distance), confidence=own["confidence"][skin.nearest])
            kinds = skin.quads, skin.triangles
            made[role] = keep(datablocks.mesh_data(f"{name} {role}", skin.vertices, kinds, origin, on_skin))
    if outcome.volume is not None:
        try:
            path = volume_files.adopt(name, outcome.volume)
        except VADError as error:
            warnings.append(f"No volume: {error}")
        else:
            rollback.callback(path.unlink)
            made[results.FIELD] = keep(datablocks.volume_data(f"{name} field", path, "density"))
    return made


def _recast(collection, made):
    """Let the one mesh that there is play the role of the one that takes its place, with all that the user gave it."""
    there = [obj for obj in results.members(collection) if results.role(obj) in results.MESHES]
    asked = [role for role in results.MESHES if role in made]
    if len(there) == len(asked) == 1 and results.member(collection, asked[0]) is None:
        (obj,), (new,), old = there, asked, results.role(there[0])
        obj[results.ROLE] = new
        results.hold(collection, obj)
        made[new].name = obj.data.name  # which leaves its own to that
        for block in (obj, obj.data):
            head, found, tail = block.name.rpartition(f" {old}")
            block.name = f"{head} {new}{tail}" if found else block.name


def _place(collection, role, data, origin, turned):
    """Give the collection's object of this role new data, make it where it is missing, or remove it for lack of data.

    An object that the user moved stays so unless the samples have another centre now, or its points were moved within
    it, by Apply Transforms or Set Origin: its place is theirs then, and not that of new ones.
    """
    obj = results.member(collection, role)
    if data is None:
        if obj is not None:
            bpy.data.batch_remove([obj])
        return
    was_moved = False
    if obj is None:
        obj = bpy.data.objects.new(data.name, data)
        obj[results.ROLE] = role
        collection.objects.link(obj)
    elif role == results.FIELD:
        if materials.CELL not in obj.data or results.is_shown_by_others(obj):
            obj.data = obj.data.copy()  # a volume of the user's, or kept by a copy, stays as it is
        datablocks.replace_volume(obj.data, data)
    else:
        was_moved = moved_within(obj)
        datablocks.replace_data(obj.data, data)
    results.hold(collection, obj)
    if was_moved or tuple(obj.get(results.ORIGIN, ())) != tuple(origin):
        obj[results.ORIGIN] = origin
        results.place(obj, origin, turned)
    if role != results.FIELD:
        obj[results.BOX] = _box(data)
    if role in results.MESHES:
        obj[results.MADE] = _digest(obj)


def _is_changed(obj):
    """Whether the user changed a mesh since it was made, or gave the object another: by hand, or by sculpting what its
    modifiers make of it."""
    sculpted = any(modifier.total_levels for modifier in _multires(obj))
    return sculpted or len(obj.data.skin_vertices) > 0 or obj[results.MADE] != _digest(obj)


def _multires(obj):
    return [modifier for modifier in obj.modifiers if modifier.type == "MULTIRES"]


def _digest(obj):
    """A text that tells meshes apart by their points and faces, what these carry and their shapes; not by materials,
    nor by whether they are smooth."""
    mesh, corners = obj.data, np.empty(len(obj.data.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    carried = {name: found.values for name, found in sorted(attributes.read(mesh).items())}
    there = ((one.name, one.domain, one.data_type) for one in mesh.attributes if one.name != "sharp_face")
    names = sorted(one for one in there if one[0] in _SCULPTED or not one[0].startswith("."))
    shapes_of = mesh.shape_keys.key_blocks.keys() if mesh.shape_keys else []
    digest = hashlib.blake2b(repr((names, obj.vertex_groups.keys(), shapes_of)).encode(), digest_size=16)
    for values in (attributes.values(mesh.attributes["position"]), corners, *carried.values()):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _set_aside(scene, obj):
    """Keep a result that the user changed, hidden, as an object that no run replaces; a line that says so. What was
    sculpted at several resolutions goes with it, as it suits no other faces."""
    kept = obj.copy()
    kept.data = obj.data.copy()
    kept.name = kept.data.name = f"{obj.name} changed"
    for name in (results.ROLE, results.ORIGIN, results.BOX, results.MADE):
        kept.pop(name, None)
    for modifier in _multires(obj):
        obj.modifiers.remove(modifier)
    scene.collection.objects.link(kept)
    results.show(scene, kept, False)
    return f"{obj.name} was changed since it was made: {kept.name}, hidden, keeps what it was"


def moved_within(obj: bpy.types.Object) -> bool:
    """Whether the points of a mesh or of samples among the results were moved within it since it was made, by Apply
    Transforms or Set Origin. With fewer points or more, it was edited: then whether the middle of the box around them
    is closer to where applying its place puts it than to where it was."""
    before, now = list(obj.get(results.BOX, ())), _box(obj.data)
    if before[:1] == now[:1]:
        return before != now
    if not len(before) == len(now) == 7:
        return False
    shift = np.subtract(now[1:], before[1:]).reshape(2, 3).mean(axis=0)
    return bool(np.linalg.norm(shift - np.array(obj[results.ORIGIN])) < np.linalg.norm(shift))


def _box(data):
    place = data.attributes.get("position")  # which an empty point cloud may lack
    points = attributes.values(place) if place else ()
    ends = (points.min(axis=0), points.max(axis=0)) if len(points) else ()
    return [float(len(points)), *(float(x) for end in ends for x in end)]


def _show_mesh_first(scene, collection, stays):
    """Show the mesh alone: samples, fog and a second mesh in the same place would cover it. What `stays` is as the user
    left it; that is all there was, unless the mesh came or went."""
    mesh = results.mesh(collection)
    for role in results.ROLES:
        obj = results.member(collection, role)
        if obj is not None and obj not in stays:
            results.show(scene, obj, mesh is None or obj == mesh)


def _stay_active(layers, mesh):
    """Where a result that went was the active object, the mesh is it now."""
    for layer in layers:
        if layer.objects.active is None and mesh is not None and results.is_among(mesh, layer.objects):
            layer.objects.active = mesh
            mesh.select_set(True, view_layer=layer)


def _colour(objects, source):
    """Give new meshes and samples a material that shows the colours their points carry, if they do."""
    names = [name for name, attribute in _carried(source).items() if attribute.is_colour]
    painted = [obj for obj in objects if results.role(obj) in {*results.MESHES, results.SAMPLES}]
    if names and painted:
        material = materials.carried_colours(f"{source.name} colours", names[0])
        for obj in painted:
            obj.data.materials.append(material)


def _summary(outcome):
    yield f"{len(outcome.points):,} samples"
    yield " × ".join(map(str, outcome.shape)) + " grid"
    if outcome.surface is not None:
        yield _faces(outcome.surface)
    if outcome.sheet is not None:
        yield f"{_faces(outcome.sheet)} in the single layer"
    yield f"{outcome.seconds:.1f} s"


def _faces(skin):
    kinds = {"quads": skin.quads, "triangles": skin.triangles}
    return " and ".join(f"{len(faces):,} {kind}" for kind, faces in kinds.items() if len(faces)) or "no faces"
