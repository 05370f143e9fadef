"""How the results of a run are found again: custom properties on its collection and its objects."""

import json

import bpy
from bpy.app.handlers import persistent
from mathutils import Matrix

ROLE, ORIGIN = "vad_role", "vad_origin"  # of an object; the second is the place that its data is relative to
BOX = "vad_box"  # of an object: number of its points and the corners of their box, as they were made
MADE = "vad_made"  # of a mesh object: a digest of its data as it was made
SAMPLES, SURFACE, SHEET, FIELD = ROLES = "samples", "surface", "sheet", "field"
MESHES = SURFACE, SHEET
ESTIMATE = "estimate"  # samples with normals alone, made without a run; the sources are its own properties
REPORT, SUMMARY, WARNINGS = "vad_report", "vad_summary", "vad_warnings"  # of a collection
SOURCE, JOINED = "vad_source", "vad_joined"  # of a collection and of an estimate: first source, the others by number
NAMES = "vad_names"  # of the same: what the sources were called, in JSON
TURN = "vad_turn"  # of the same: rotation and scale of the sources, row by row
MEMBERS = "vad_members"  # of a collection: its results by role, wherever they were moved
_TYPES = {SAMPLES: "POINTCLOUD", SURFACE: "MESH", SHEET: "MESH", FIELD: "VOLUME", ESTIMATE: "POINTCLOUD"}
FIELD_OF = "vad_field_of"  # of a collection: :func:`stored_field.identity` of what its field was made from

SHOWN = (  # what the sidebar shows and hides: role, name, for people
    (SURFACE, "Surface", "the closed mesh"),
    (SHEET, "Layer", "the single layer"),
    (FIELD, "Field", "the fog of the distance field"),
    (SAMPLES, "Points", "the samples with their normals"),
    ("source", "Scan", "what the points came from"),
)


def role(obj: bpy.types.Object) -> str | None:
    """What `obj` is among the results of a run; None where it is none, nor any more: converted to another type."""
    found = obj.get(ROLE)
    return found if _TYPES.get(found, obj.type) == obj.type else None


def member(collection: bpy.types.Collection, wanted: str) -> bpy.types.Object | None:
    """The object that plays this role in the results of a run, whatever collection it is in now."""
    if MEMBERS not in collection:  # of an earlier version
        return next((obj for obj in collection.objects if role(obj) == wanted), None)
    obj = collection[MEMBERS].get(wanted)
    return obj if obj is not None and role(obj) == wanted and _is_somewhere(obj, collection) else None


def _is_somewhere(obj, likely):
    """Whether `obj` is in the collection `likely`, or any other: a look through all takes long where there are many."""
    return obj in likely.objects.values() or bool(obj.users_collection)


def members(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """The results of a run, those that follow them left out."""
    return [obj for wanted in ROLES if (obj := member(collection, wanted)) is not None]


def all_of(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """The results of a run and what else of such kind is in its collection: those that follow them, and copies."""
    return [*members(collection), *(obj for obj in collection.objects if role(obj) is not None)]


def held() -> dict[bpy.types.Object, bpy.types.Collection]:
    """The results of all runs, each with its run's collection: for many objects quicker than :func:`run_of`."""
    return {obj: run for run in bpy.data.collections if REPORT in run for obj in members(run)}


def hold(collection: bpy.types.Collection, obj: bpy.types.Object) -> None:
    """Make `obj` the one that plays its role in the results of a run."""
    collection[MEMBERS] = {role(one): one for one in (*members(collection), obj)}


def drop_deleted(collection: bpy.types.Collection) -> None:
    """Remove the results of a run that were deleted and are kept for it alone: new ones are to have their names."""
    for wanted, obj in [*(collection.get(MEMBERS) or {}).items()]:
        deleted = obj is not None and not obj.users_collection
        if deleted and bpy.data.user_map(subset=[obj])[obj] <= {collection}:
            del collection[MEMBERS][wanted]
            unused = [obj.data] if obj.data is not None and obj.data.users == 1 else []
            bpy.data.batch_remove([obj, *unused])


def run_of(obj: bpy.types.Object) -> bpy.types.Collection | None:
    """The collection of the run that `obj` is a result of, or that the result is of which it follows, wherever it was
    moved; else the one that it is in."""
    follows = role(obj) not in {None, *ROLES} and obj.parent is not None
    if follows and (run := run_of(obj.parent)) is not None:
        return run
    runs = [collection for collection in bpy.data.collections if REPORT in collection]
    homes = [run for run in runs if obj in run.objects.values()]
    known = [run for run in (*homes, *runs) if MEMBERS in run] if role(obj) in ROLES else []
    return next((run for run in known if obj in members(run)), homes[0] if homes else None)


def is_copy(obj: bpy.types.Object) -> bool:
    """Whether `obj` is a copy, or a part, that the user made of a result: another object plays its role in its run."""
    run = run_of(obj) if role(obj) in ROLES else None
    return run is not None and member(run, role(obj)) not in {None, obj}


def shown_as(collection: bpy.types.Collection, name: str) -> list[bpy.types.Object]:
    """The objects that one of SHOWN stands for."""
    return [obj for obj in ([member(collection, name)] if name in ROLES else sources(collection)) if obj is not None]


def mesh(collection: bpy.types.Collection) -> bpy.types.Object | None:
    """The mesh that a run made, the closed one where there are two."""
    return next((obj for obj in (member(collection, role) for role in MESHES) if obj), None)


def note_sources(holder: bpy.types.ID, objects: list[bpy.types.Object]) -> None:
    """Let `holder`, the collection of a run or an estimate, know what it was made from."""
    if objects:
        holder[SOURCE], holder[JOINED] = objects[0], {str(k): obj for k, obj in enumerate(objects[1:], start=1)}
        holder[NAMES] = json.dumps([obj.name for obj in objects])


def sources(holder: bpy.types.ID) -> list[bpy.types.Object | None]:
    """What `holder` was made from, several objects where these were joined; None in place of what is gone."""
    return [holder.get(SOURCE), *(holder[JOINED].get(str(k)) for k in range(1, len(_names(holder))))]


def _names(holder):
    return json.loads(holder.get(NAMES, "[]"))


def _holder(obj):
    """What knows what the result `obj` was made from: itself or its collection."""
    return obj if NAMES in obj or SOURCE in obj else run_of(obj) or obj


def origins(obj: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """What the result `obj` was made from, as far as that is in the scene."""
    made_from = sources(_holder(obj)) if role(obj) is not None else []
    return [source for source in made_from if source is not None and is_among(source, scene.objects)]


def gone(obj: bpy.types.Object, scene: bpy.types.Scene) -> list[str]:
    """Names of what the result `obj` was made from and what is not in the scene any more."""
    holder, there = _holder(obj), origins(obj, scene)
    return [name for name, source in zip(_names(holder), sources(holder), strict=False) if source not in there]


def estimate(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> bpy.types.Object | None:
    """The normals alone that were found of just these objects, unless they are being edited or not of this .blend."""
    found = (obj for obj in scene.objects if role(obj) == ESTIMATE and set(sources(obj)) == set(objects))
    return next((obj for obj in found if _is_own(obj) and not are_edited([obj])), None)


def _runs_of(scene, wanted):
    """The runs in `scene` whose sources are `wanted`, a function, in the order of its collections."""
    found = {one for one in bpy.data.collections if (NAMES in one or SOURCE in one) and wanted(sources(one))}
    return [one for one in scene.collection.children_recursive if one in found] if found else []


def previous(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> bpy.types.Collection | None:
    """The results that an earlier run made of just these objects in this scene; the latest where several were kept."""
    if not objects:
        return None
    made = list(filter(can_be_updated, _runs_of(scene, lambda made_from: set(made_from) == set(objects))))
    return scene.vad.result if scene.vad.result in made else (made or [None])[-1]


def again(scene: bpy.types.Scene, uid: int | None) -> bpy.types.Collection | None:
    """The collection in `scene` with this `session_uid`, if it is still there."""
    return next((one for one in scene.collection.children_recursive if one.session_uid == uid), None)


def joined(scene: bpy.types.Scene, obj: bpy.types.Object) -> bpy.types.Collection | None:
    """The latest results that a run made of `obj`, or of several objects that it is one of; the last run's may be out
    of the scene."""
    made = _runs_of(scene, lambda made_from: obj in made_from)
    last = scene.vad.result
    return made[-1] if made else last if last is not None and obj in sources(last) else None


def is_editable(block: bpy.types.ID) -> bool:
    """Whether `block` is of this .blend: what is linked, or overridden, takes no other objects and no other data."""
    return block.library is None and block.override_library is None


def scene_problem(scene: bpy.types.Scene) -> str:
    """Why nothing can be put into `scene`, one line; empty where something can."""
    return "" if is_editable(scene) else f"{scene.name} is a scene of another file: make it local, or use another scene"


def home(collections, scene: bpy.types.Scene) -> bpy.types.Collection:
    """The first of some collections that takes new objects, else the scene's own."""
    return next(filter(is_editable, collections), scene.collection)


def can_be_updated(collection: bpy.types.Collection) -> bool:
    """Whether `collection` and all results in it are of this .blend."""
    return is_editable(collection) and all(map(_is_own, all_of(collection)))


def _is_own(obj):
    return is_editable(obj) and (obj.data is None or is_editable(obj.data))


def is_shown_by_others(obj: bpy.types.Object, copies: bool = True) -> bool:
    """Whether other objects show the same data as the result `obj`, `copies` of results among them or not."""
    others = (other for other in bpy.data.objects if other.data == obj.data and other != obj)
    return any(copies or ROLE not in other for other in others)


def are_edited(objects: list[bpy.types.Object]) -> bool:
    """Whether the data of any of these is in another mode than Object Mode, be it by way of another object."""
    data = {obj.data for obj in objects} - {None}
    return any(obj.mode != "OBJECT" for obj in bpy.data.objects if obj.data in data)


def place(obj: bpy.types.Object, origin, turned: bool) -> None:
    """Put `obj`, whose data is relative to `origin` in world space, there, whatever parents and deltas it has. How it
    is turned and scaled stays the user's, unless its source was `turned` or scaled, too: so is its data then."""
    matrix = Matrix() if turned else obj.matrix_world.copy()
    matrix.translation = origin
    obj.matrix_world = matrix


def note_turn(holder: bpy.types.ID) -> bool:
    """Whether a source of the results that `holder` is, or holds, was turned or scaled since this was called last."""
    before, there = list(holder.get(TURN, ())), [source for source in sources(holder) if source is not None]
    now = [x for source in there for row in source.matrix_world.to_3x3() for x in row]
    holder[TURN] = now
    return len(before) == len(now) and before != now


def summary(collection: bpy.types.Collection) -> list[str]:
    """A few lines on the run that made `collection`, for people."""
    return collection.get(SUMMARY, "").splitlines()


def warnings(collection: bpy.types.Collection) -> list[str]:
    """What went less than well in the run that made `collection`, one line each."""
    return collection.get(WARNINGS, "").splitlines()


def is_in(collection: bpy.types.Collection, layer: bpy.types.ViewLayer) -> bool:
    """Whether `collection` is in a view layer, and not excluded from it."""
    pending = [layer.layer_collection]
    while pending:
        found = pending.pop()
        if found.collection == collection and not found.exclude:
            return True
        pending += found.children
    return False


def show(scene: bpy.types.Scene, obj: bpy.types.Object, shown: bool) -> None:
    """Show `obj` in every view layer of `scene` and in renders, or hide it there; what is linked in the former alone,
    as its file says whether it renders."""
    if obj.library is None:
        obj.hide_render = not shown
    for layer in scene.view_layers:
        layer.update()
        if is_among(obj, layer.objects):
            obj.hide_set(not shown, view_layer=layer)


def is_among(obj: bpy.types.Object, objects: bpy.types.bpy_prop_collection) -> bool:
    """Whether `obj` is among those of a scene or of a view layer, where linked ones may be called the same."""
    called_so = objects.get(obj.name)
    return called_so == obj or (called_so is not None and obj in objects.values())


def unseen(obj: bpy.types.Object) -> str:
    """What to say of an object that is not seen though it is shown; empty where its own eye hides it, or it is seen."""
    if obj.visible_get() or obj.hide_get():
        return ""
    return f"{obj.name} is off, or its collection is hidden: show it in the outliner"


def leave_modes(context: bpy.types.Context) -> None:
    """Back to Object Mode: what is edited would stay so, out of reach, when another object becomes the active one."""
    active = context.view_layer.objects.active
    if active is not None and active.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


@persistent
def forget_deleted(*_) -> None:
    """Before a save: what was deleted is not kept, and saved, for the results that were made of it, or for their
    run."""
    for holder in filter(is_editable, (*bpy.data.collections, *bpy.data.objects)):
        for pointers in (holder, holder.get(JOINED) or {}, holder.get(MEMBERS) or {}):
            for name in [SOURCE] if pointers is holder else list(pointers.keys()):
                obj = pointers.get(name)
                if obj is not None and not obj.users_collection:
                    del pointers[name]


def take_the_stage(context: bpy.types.Context, obj: bpy.types.Object, uids: tuple[int, ...]) -> None:
    """Make `obj` the active object and hide what it was made from (`uids`: the objects' `session_uid`), as those points
    would cover it, with the normals found for them before.

    Nothing happens where the user went on to something else meanwhile.
    """
    layer = context.view_layer
    layer.update()
    made_from = {source for source in layer.objects if source.session_uid in uids}
    active = layer.objects.active
    looked_at = {active, *(origins(active, context.scene) if active else ())}
    if not is_among(obj, layer.objects) or context.mode != "OBJECT" or not looked_at & made_from:
        return
    for other in layer.objects:
        other.select_set(False)
        if other in made_from or (role(other) == ESTIMATE and set(sources(other)) <= made_from):
            show(context.scene, other, False)
    layer.objects.active = obj
    obj.select_set(True)
