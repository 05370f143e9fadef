"""From Blender's objects to plain points."""

from dataclasses import dataclass, replace

import bmesh
import bpy
import numpy as np

from ..core.errors import InputError
from ..core.modelled import Faces, missed_by_vertices
from ..core.points import MINIMUM_SAMPLES
from . import attributes, results
from .attributes import Attribute

READABLE = {"MESH", "POINTCLOUD", "CURVES", "CURVE"}
_SAMPLED = "for points all over it use Distribute Points on Faces in geometry nodes"
_REFINED = "add Subdivision Surface, or points all over it by Distribute Points on Faces in geometry nodes"
AXIS = "vad_axis"  # attribute that holds the normal's axis where the user fixed it, in the object's space, else zeros


@dataclass(frozen=True)
class Source:
    """Points copied out of Blender, which may do with the objects what it likes from then on.

    name        : of the first object
    uids        : `session_uid` of each object
    points      : (n,3) float64, world space
    attributes  : what the points carry, colours for instance
    constraints : (indices (k,), axes (k,3) in world space), or None
    warnings    : what is missing, one line each
    """

    name: str
    uids: tuple[int, ...]
    points: np.ndarray
    attributes: dict[str, Attribute]
    constraints: tuple[np.ndarray, np.ndarray] | None
    warnings: tuple[str, ...] = ()


def objects_of(source: Source) -> list[bpy.types.Object]:
    """The objects that the points came from, as far as they exist."""
    found = {obj.session_uid: obj for obj in bpy.data.objects}
    return [found[uid] for uid in source.uids if uid in found]


def active_object(context: bpy.types.Context) -> bpy.types.Object | None:
    """The active object, hidden as it may be: Blender's own `active_object` is None then, in a window, and the window's
    where a script gives another view layer."""
    active, layer = context.active_object, context.view_layer.objects
    return active if active is not None and results.is_among(active, layer) else layer.active


def sources(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The objects to reconstruct: those selected, the active one first. Where these are results of earlier runs only,
    what the first was made from, so that a run can be repeated with its results at hand. Copies of results count as
    any object does."""
    chosen = _chosen(context)
    readable = [obj for obj in chosen if obj.type in READABLE]
    made = {obj for obj in readable if results.role(obj) is not None}
    held = results.held() if len(made) > 1 else {}
    if scans := [obj for obj in readable if obj not in made or (obj not in held and results.is_copy(obj))]:
        return scans
    origins = [source for obj in chosen[:1] for source in results.origins(obj, context.scene)]
    return [obj for obj in origins if obj.type in READABLE]


def _chosen(context):
    """The objects that are meant: those selected, the active one first. Where that is not selected, it stands alone if
    nothing that is can be read, or without a window, as scripts set the active object only."""
    active = active_object(context)
    chosen = [obj for obj in context.selected_objects if results.is_among(obj, context.view_layer.objects)]
    if active is None or active in chosen:
        return sorted(chosen, key=lambda obj: obj != active)
    readable = [obj for obj in chosen if obj.type in READABLE]
    return readable if readable and (active.type not in READABLE or not bpy.app.background) else [active]


def missing(context: bpy.types.Context) -> str:
    """What is gone of the objects that :func:`sources` were joined with before, one line; empty where none is."""
    there = sources(context)
    first = next((obj for obj in _chosen(context) if there and there == results.origins(obj, context.scene)), None)
    names = results.gone(first, context.scene) if first is not None else []
    if not names:
        return ""
    left = ", ".join(obj.name for obj in there)
    return f"{', '.join(names)} {'is' if len(names) == 1 else 'are'} gone: the run is on {left} alone"


def selected(context: bpy.types.Context, selected_only: bool = False) -> Source:
    """The points of :func:`sources`, by :func:`gather`."""
    found, lost = gather(sources(context), context, selected_only), missing(context)
    return replace(found, warnings=(*found.warnings, lost)) if lost else found


def selection_problem(context: bpy.types.Context) -> str:
    """Why nothing can be reconstructed, one line; empty where something can."""
    if objects := sources(context):
        return next((_is_off(obj) for obj in objects if _geometry(obj, context) is None), "")
    obj = next(iter(_chosen(context)), None)
    if obj is None:
        return "No active object: select a point cloud or a mesh"
    if obj.instance_type == "COLLECTION":
        return f"{obj.name} shows a collection: press Object > Apply > Make Instances Real and select what that makes"
    if results.role(obj) is not None:
        again = "" if results.run_of(obj) is None else "press Extract Again for other meshes, or "
        return f"The scan of {obj.name} is gone, or unknown: {again}select another scan"
    kind = obj.type.replace("_", " ").lower()
    return f"{obj.name} ({kind}) holds no points: select a point cloud or a mesh"


def in_edit_mode(obj: bpy.types.Object) -> bool:
    """Whether `obj` is edited, itself or by way of another object with the same mesh."""
    return obj.mode == "EDIT" or (obj.type == "MESH" and obj.data.is_editmode)


def _geometry(obj, context):
    """The geometry set of the object as the view layer shows it, or hides it by its eye; None where it is switched off
    there. It owns its components: must outlive them."""
    try:
        return obj.evaluated_get(context.evaluated_depsgraph_get()).evaluated_geometry()
    except TypeError:  # "Object geometry is not yet evaluated", which nothing else tells
        return None


def _is_off(obj):
    return f"{obj.name} is disabled in viewports, or its collection is excluded: enable it in the outliner"


def gather(objects: list[bpy.types.Object], context: bpy.types.Context, selected_only: bool = False) -> Source:
    """Every point of the objects as the viewport shows them.

    These are the vertices of meshes, the points of point clouds, the control points of curves and the origins of
    instances, after modifiers and geometry nodes. With `selected_only`, of objects in edit mode only what is selected
    there. Raises :class:`InputError` where there are none, and for objects that are disabled in viewports.
    """
    parts = [part for obj in objects for part in _in_world_space(obj, context, selected_only)]
    points = np.concatenate([np.empty((0, 3)), *(points for points, _ in parts)])
    name = objects[0].name if len(objects) == 1 else f"{objects[0].name} and {len(objects) - 1} more"
    if not len(points):
        if selected_only and in_edit_mode(objects[0]):
            raise InputError(f"{name} has 0 selected points: select some in edit mode, or use all")
        raise InputError(f"{name} has 0 points: select an object with vertices or points")
    if len(points) < MINIMUM_SAMPLES and any(_has_instances(obj, context) for obj in objects):
        raise InputError(
            f"{name} has {len(points)} points, the origins of instances: add Realize Instances at the end of its "
            "geometry nodes"
        )
    joined = attributes.join([(len(points), carried) for points, carried in parts])
    axes = joined.pop(AXIS).values if AXIS in joined else np.zeros((len(points), 3))
    fixed = np.flatnonzero(axes.any(axis=1))
    uids, constraints = tuple(obj.session_uid for obj in objects), (fixed, axes[fixed]) if len(fixed) else None
    found = {name for _, carried in parts for name in carried} - {AXIS}
    return Source(objects[0].name, uids, points, joined, constraints, tuple(_left_out(objects, found, joined, context)))


def _left_out(objects, found, carried, context):
    """What is there and not among the points, or what they carry, of names that are `found` on some of them; a line on
    each kind."""
    for obj in objects:
        geometry = _geometry(obj, context)
        if count := _instances_with_points(geometry):
            yield (
                f"{obj.name}: {count:,} instances count as a point each; for the points within them add Realize "
                "Instances at the end of its geometry nodes"
            )
        if missing := _missed_by_vertices(geometry.mesh):
            yield f"{obj.name}: its vertices alone are read, and {missing}"
    names = [name for obj in objects if obj.type != "CURVE" for name in attributes.left_out(obj.data)]
    names += [*found, *(group.name for obj in objects for group in obj.vertex_groups)]
    if lost := sorted(set(names) - set(carried)):
        kinds = "only numbers and colors of points are, of one type wherever they are, no vertex groups"
        yield f"Not carried over: {', '.join(lost)}; {kinds}"


def _missed_by_vertices(mesh):
    """What the vertices of a mesh, None where there is none, do not show of it; empty where they may show all."""
    if mesh is None:
        return ""
    corners, sizes = _values(mesh.loops, "vertex_index", np.int32), _values(mesh.polygons, "loop_total", np.int32)
    areas, normals = _values(mesh.polygons, "area", np.float32), _values(mesh.polygons, "normal", np.float32, 3)
    return missed_by_vertices(Faces(len(mesh.vertices), corners, sizes, areas, normals), _SAMPLED, _REFINED)


def _instances_with_points(geometry):
    """Number of instances, where any of them holds several points."""
    cloud = geometry.instances_pointcloud()
    if not _has_points(cloud) or not any(map(_holds_points, geometry.instance_references())):
        return 0
    return cloud.attributes.domain_size("POINT")


def _holds_points(reference):
    if isinstance(reference, bpy.types.Object):
        return reference.type in READABLE or reference.instance_type == "COLLECTION"
    if isinstance(reference, bpy.types.Collection):
        return any(map(_holds_points, reference.all_objects))
    parts = filter(_has_points, (reference.mesh, reference.pointcloud, reference.curves))
    own = sum(part.attributes.domain_size("POINT") for part in parts)
    return own > 1 or any(map(_holds_points, reference.instance_references()))


def point_count(objects: list[bpy.types.Object], context: bpy.types.Context) -> int:
    """Length of :func:`gather`'s points without copying any, cheap enough for every redraw. In mesh edit mode it leaves
    out what modifiers add. Objects that are disabled in viewports count none."""
    return sum(_point_count(obj, context) for obj in objects)


def _point_count(obj, context):
    if obj.type == "MESH" and obj.data.is_editmode:
        return len(bmesh.from_edit_mesh(obj.data).verts)
    geometry = _geometry(obj, context)
    if geometry is None:
        return 0
    clouds = geometry.pointcloud, geometry.curves, geometry.instances_pointcloud()
    mesh = len(geometry.mesh.vertices) if geometry.mesh else 0
    return mesh + sum(cloud.attributes.domain_size("POINT") for cloud in clouds if cloud)


def _in_world_space(obj, context, selected_only):
    """(n,3) float64 points of each component of the object in world space, and what they carry."""
    if in_edit_mode(obj):
        obj.update_from_editmode()
    geometry, evaluated = _geometry(obj, context), obj.evaluated_get(context.evaluated_depsgraph_get())
    if geometry is None:
        raise InputError(_is_off(obj))
    turn = np.array(evaluated.matrix_world, np.float64)[:3, :3]
    for points, carried in _components(evaluated, geometry, selected_only and in_edit_mode(obj)):
        if AXIS in carried:
            carried[AXIS] = Attribute("FLOAT_VECTOR", carried[AXIS].values @ np.linalg.pinv(turn))
        yield in_world(points, evaluated), carried


def in_world(points: np.ndarray, obj: bpy.types.Object) -> np.ndarray:
    """Points (n,3) in the space of an object, in world space, (n,3) float64."""
    matrix = np.array(obj.matrix_world, np.float64)
    with np.errstate(invalid="ignore"):  # points that are not finite stay so
        return points @ matrix[:3, :3].T + matrix[:3, 3]


def _components(evaluated, geometry, selected_only):
    """(n,3) float32 points of each component of the evaluated object, in its own space, and what they carry."""
    if evaluated.type == "MESH":  # in edit mode the geometry set holds an empty wrapper, to_mesh() the real vertices
        mesh = evaluated.to_mesh()
        flags = _values(mesh.vertices, "select", bool) if selected_only else None
        yield _picked(_values(mesh.vertices, "co", np.float32, 3), mesh, flags)
        evaluated.to_mesh_clear()
    elif geometry.mesh:
        if selected_only:
            raise _not_told(evaluated)
        yield _values(geometry.mesh.vertices, "co", np.float32, 3), attributes.read(geometry.mesh)
    for cloud in filter(_has_points, (geometry.pointcloud, geometry.curves)):
        flags = None
        if selected_only:
            flags = _spline_selection(evaluated) if evaluated.type == "CURVE" else _cloud_selection(cloud)
        if flags is not None and len(flags) != cloud.attributes.domain_size("POINT"):
            raise _not_told(evaluated)
        yield _picked(attributes.values(cloud.attributes["position"]), cloud, flags)
    instances = geometry.instances_pointcloud()
    if _has_points(instances):  # their "position" is uninitialised memory in Blender 4.5 and 5.0
        yield _values(instances.attributes["instance_transform"].data, "value", np.float32, 16)[:, 12:15], {}


def _not_told(obj):
    return InputError(
        f"{obj.name}: its bevel, modifiers or geometry nodes make other points, of which none is selected: turn off "
        "Selected Points Only, or those"
    )


def _picked(points, data, flags):
    """The points, all or those flagged, and what they carry."""
    carried = attributes.read(data)
    if flags is None:
        return points, carried
    rows = np.flatnonzero(flags)
    return points[rows], {name: attribute[rows] for name, attribute in carried.items()}


def _cloud_selection(cloud):
    """(n,) flags of a point cloud or curves; None where the attribute is missing, which means all. In Curve select mode
    curves have one for each curve."""
    selection = cloud.attributes.get(".selection")
    if selection is None:
        return None
    flags = _values(selection.data, "value", bool if selection.data_type == "BOOLEAN" else np.float32)
    if selection.domain == "POINT":
        return flags
    return flags.repeat([curve.points_length for curve in cloud.curves])


def _spline_selection(obj):
    """The same of the control points of a curve object of splines."""
    points = [
        (spline.bezier_points, "select_control_point") if spline.type == "BEZIER" else (spline.points, "select")
        for spline in obj.original.data.splines
    ]
    return np.concatenate([_values(some, name, bool) for some, name in points])


def _has_instances(obj, context):
    geometry = _geometry(obj, context)
    return _has_points(geometry.instances_pointcloud())


def _has_points(cloud):
    return cloud is not None and cloud.attributes.domain_size("POINT") > 0


def _values(items, name, dtype, *width):
    values = np.empty((len(items), *width), dtype)
    items.foreach_get(name, values.ravel())
    return values
