"""How the results of a run are found again: custom properties on its collection and its objects."""

import bpy

ROLE = "vad_role"  # of an object
SAMPLES, SURFACE, SHEET, FIELD = ROLES = "samples", "surface", "sheet", "field"
SOURCE, REPORT, SUMMARY, WARNINGS = "vad_source", "vad_report", "vad_summary", "vad_warnings"  # of a collection


def role(obj: bpy.types.Object) -> str | None:
    """What `obj` is among the results of a run; None where it is none."""
    return obj.get(ROLE)


def member(collection: bpy.types.Collection, wanted: str) -> bpy.types.Object | None:
    """The object that plays this role in the results of a run."""
    return next((obj for obj in collection.objects if role(obj) == wanted), None)


def origin(obj: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """What the result `obj` was made from, as long as that is in the scene."""
    if role(obj) is None:
        return None
    made_from = (collection.get(SOURCE) for collection in obj.users_collection)
    return next((source for source in made_from if source and source.name in scene.objects), None)


def previous(scene: bpy.types.Scene, source: bpy.types.Object | None) -> bpy.types.Collection | None:
    """The results that an earlier run made of `source` in this scene; the latest where several were kept."""
    made = [
        collection
        for collection in scene.collection.children_recursive
        if source is not None and collection.get(SOURCE) == source and collection.library is None
    ]
    return scene.vad.result if scene.vad.result in made else (made or [None])[-1]


def summary(collection: bpy.types.Collection) -> list[str]:
    """A few lines on the run that made `collection`, for people."""
    return collection.get(SUMMARY, "").splitlines()


def warnings(collection: bpy.types.Collection) -> list[str]:
    """What went less than well in the run that made `collection`, one line each."""
    return collection.get(WARNINGS, "").splitlines()
