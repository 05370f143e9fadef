"""How the results of a run are found again: custom properties on its collection and its objects."""

import bpy

ROLE, ORIGIN = "vad_role", "vad_origin"  # of an object; the second is the place that its data is relative to
BOX = "vad_box"  # of an object: number of its points and the corners of their box, as they were made
SAMPLES, SURFACE, SHEET, FIELD = ROLES = "samples", "surface", "sheet", "field"
MESHES = SURFACE, SHEET
ESTIMATE = "estimate"  # samples with normals alone, made without a run; its SOURCE is its own property
SOURCE, REPORT, SUMMARY, WARNINGS = "vad_source", "vad_report", "vad_summary", "vad_warnings"  # of a collection
FIELD_OF = "vad_field_of"  # of a collection: :func:`stored_field.identity` of what its field was made from

SHOWN = (  # what the sidebar shows and hides: role, name, for people
    (SURFACE, "Surface", "the closed mesh"),
    (SHEET, "Layer", "the single layer"),
    (FIELD, "Field", "the fog of the distance field"),
    (SAMPLES, "Points", "the samples with their normals"),
    ("source", "Scan", "what the points came from"),
)


def role(obj: bpy.types.Object) -> str | None:
    """What `obj` is among the results of a run; None where it is none."""
    return obj.get(ROLE)


def member(collection: bpy.types.Collection, wanted: str) -> bpy.types.Object | None:
    """The object that plays this role in the results of a run."""
    return next((obj for obj in collection.objects if role(obj) == wanted), None)


def shown_as(collection: bpy.types.Collection, name: str) -> bpy.types.Object | None:
    """The object that one of SHOWN stands for."""
    return member(collection, name) if name in ROLES else collection.get(SOURCE)


def mesh(collection: bpy.types.Collection) -> bpy.types.Object | None:
    """The mesh that a run made, the closed one where there are two."""
    return next((obj for obj in (member(collection, role) for role in MESHES) if obj), None)


def origin(obj: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """What the result `obj` was made from, as long as that is in the scene."""
    if role(obj) is None:
        return None
    made_from = (holder.get(SOURCE) for holder in (obj, *obj.users_collection))
    return next((source for source in made_from if source and source.name in scene.objects), None)


def estimate(scene: bpy.types.Scene, source: bpy.types.Object | None) -> bpy.types.Object | None:
    """The normals alone that were found of `source`, unless they are being edited."""
    return next(
        (
            obj
            for obj in scene.objects
            if role(obj) == ESTIMATE and source is not None and obj.get(SOURCE) == source and obj.mode == "OBJECT"
        ),
        None,
    )


def previous(scene: bpy.types.Scene, source: bpy.types.Object | None) -> bpy.types.Collection | None:
    """The results that an earlier run made of `source` in this scene; the latest where several were kept."""
    made = [
        collection
        for collection in scene.collection.children_recursive
        if source is not None and collection.get(SOURCE) == source and is_editable(collection)
    ]
    return scene.vad.result if scene.vad.result in made else (made or [None])[-1]


def is_editable(block: bpy.types.ID) -> bool:
    """Whether `block` is of this .blend: what is linked, or overridden, takes no other objects and no other data."""
    return block.library is None and block.override_library is None


def summary(collection: bpy.types.Collection) -> list[str]:
    """A few lines on the run that made `collection`, for people."""
    return collection.get(SUMMARY, "").splitlines()


def warnings(collection: bpy.types.Collection) -> list[str]:
    """What went less than well in the run that made `collection`, one line each."""
    return collection.get(WARNINGS, "").splitlines()


def show(scene: bpy.types.Scene, obj: bpy.types.Object, shown: bool) -> None:
    """Show `obj` in every view layer of `scene` and in renders, or hide it there."""
    obj.hide_render = not shown
    for layer in scene.view_layers:
        layer.update()
        if obj.name in layer.objects:
            obj.hide_set(not shown, view_layer=layer)


def take_the_stage(context: bpy.types.Context, obj: bpy.types.Object, uids: list[int]) -> None:
    """Make `obj` the active object and hide what it was made from (`uids`: the objects' `session_uid`), as those points
    would cover it, with the normals found for them before.

    Nothing happens where the user went on to something else meanwhile.
    """
    layer = context.view_layer
    layer.update()
    sources = [source for source in layer.objects if source.session_uid in uids]
    if obj.name not in layer.objects or context.mode != "OBJECT" or origin_of_active(layer) not in sources:
        return
    for other in layer.objects:
        other.select_set(False)
        if other in sources or (role(other) == ESTIMATE and other.get(SOURCE) in sources):
            show(context.scene, other, False)
    layer.objects.active = obj
    obj.select_set(True)


def origin_of_active(layer: bpy.types.ViewLayer) -> bpy.types.Object | None:
    """The active object, or what that was made from."""
    active = layer.objects.active
    return active and (active.get(SOURCE) or active)
