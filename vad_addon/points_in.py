"""From Blender's objects to plain points."""

import bmesh
import bpy
import numpy as np

from ..core.errors import InputError

READABLE = {"MESH", "POINTCLOUD", "CURVES", "CURVE"}


def selection_problem(obj: bpy.types.Object | None) -> str:
    """Why `obj` cannot be reconstructed, one line; empty where it can."""
    if obj is None:
        return "No active object: select a point cloud or a mesh"
    if obj.type not in READABLE:
        kind = obj.type.replace("_", " ").lower()
        return f"{obj.name} ({kind}) holds no points: select a point cloud or a mesh"
    return ""


def world_points(obj: bpy.types.Object, context: bpy.types.Context) -> np.ndarray:
    """Every point of the object as the viewport shows it, (n,3) float64, world space.

    These are the vertices of its mesh, the points of its point cloud, the control points of its curves and the origins
    of its instances, after modifiers and geometry nodes. Raises :class:`InputError` where there are none.
    """
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    evaluated = obj.evaluated_get(context.evaluated_depsgraph_get())
    local = np.concatenate([np.empty((0, 3)), *_local_points(evaluated)])
    if not len(local):
        raise InputError(f"{obj.name} has 0 points: select an object with vertices or points")
    matrix = np.array(evaluated.matrix_world, np.float64)
    return local @ matrix[:3, :3].T + matrix[:3, 3]


def point_count(obj: bpy.types.Object, context: bpy.types.Context) -> int:
    """Length of :func:`world_points` without copying any, cheap enough for every redraw. In mesh edit mode it leaves
    out what modifiers add."""
    if obj.mode == "EDIT" and obj.type == "MESH":
        return len(bmesh.from_edit_mesh(obj.data).verts)
    geometry = obj.evaluated_get(context.evaluated_depsgraph_get()).evaluated_geometry()
    clouds = geometry.pointcloud, geometry.curves, geometry.instances_pointcloud()
    mesh = len(geometry.mesh.vertices) if geometry.mesh else 0
    return mesh + sum(cloud.attributes.domain_size("POINT") for cloud in clouds if cloud)


def _local_points(evaluated):
    """(n,3) float32 coordinates of each component of the evaluated object, in its own space."""
    geometry = evaluated.evaluated_geometry()  # owns the components below: must outlive them
    if evaluated.type == "MESH":  # in edit mode the geometry set holds an empty wrapper, to_mesh() the real vertices
        yield _vectors(evaluated.to_mesh().vertices, "co", 3)
        evaluated.to_mesh_clear()
    elif geometry.mesh:
        yield _vectors(geometry.mesh.vertices, "co", 3)
    for cloud in filter(_has_points, (geometry.pointcloud, geometry.curves)):
        yield _vectors(cloud.attributes["position"].data, "vector", 3)
    instances = geometry.instances_pointcloud()
    if _has_points(instances):  # their "position" is uninitialised memory in Blender 4.5 and 5.0
        yield _vectors(instances.attributes["instance_transform"].data, "value", 16)[:, 12:15]


def _has_points(cloud):
    return cloud is not None and cloud.attributes.domain_size("POINT") > 0


def _vectors(items, name, width):
    vectors = np.empty((len(items), width), np.float32)
    items.foreach_get(name, vectors.ravel())
    return vectors
