"""Axes fixed by hand: an attribute on the source's points, so that they live in the .blend and hold in the next run."""

import bmesh
import bpy
import numpy as np

from ..core.errors import InputError
from . import attributes
from .points_in import AXIS


def held_by(obj: bpy.types.Object) -> bool:
    """Whether some points of `obj` may have a fixed axis."""
    if obj.type == "MESH" and obj.data.is_editmode:
        return bmesh.from_edit_mesh(obj.data).verts.layers.float_vector.get(AXIS) is not None
    return obj.type in {"MESH", "POINTCLOUD"} and AXIS in obj.data.attributes


def read(obj: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """The points of `obj` that have a fixed axis, (k,3), and these, (k,3) unit, both in the object's space."""
    if obj.type == "MESH" and obj.data.is_editmode:
        mesh = bmesh.from_edit_mesh(obj.data)
        layer = mesh.verts.layers.float_vector[AXIS]
        held = [(vertex.co, vertex[layer]) for vertex in mesh.verts if any(vertex[layer])]
        both = np.array(held, np.float64).reshape(-1, 2, 3)
        points, axes = both[:, 0], both[:, 1]
    else:
        points, axes = (attributes.values(obj.data.attributes[name]) for name in ("position", AXIS))
        held = axes.any(axis=1)
        points, axes = points[held], axes[held]
    return points, axes / np.linalg.norm(axes, axis=1, keepdims=True)


def selected(obj: bpy.types.Object) -> np.ndarray:
    """Coordinates (k,3) of the selected vertices of the mesh `obj`, in edit mode, in the object's space."""
    chosen = [vertex.co for vertex in bmesh.from_edit_mesh(obj.data).verts if vertex.select]
    return np.array(chosen, np.float64).reshape(-1, 3)


def fix(obj: bpy.types.Object, axes: np.ndarray) -> None:
    """Give the selected vertices of the mesh `obj`, in edit mode, these axes (k,3), or all of them one axis (3,), in
    the object's space. Zeros free them."""
    mesh = bmesh.from_edit_mesh(obj.data)
    layers = mesh.verts.layers.float_vector
    layer = layers.get(AXIS) or layers.new(AXIS)
    chosen = [vertex for vertex in mesh.verts if vertex.select]
    for vertex, axis in zip(chosen, np.broadcast_to(axes, (len(chosen), 3)), strict=True):
        vertex[layer] = axis
    bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)


def of_active(obj: bpy.types.Object) -> np.ndarray:
    """Axis (3,), in world space, that the active element of the mesh `obj`, in edit mode, stands for: the normal of a
    face, the direction of an edge, the fixed axis of a vertex. Raises :class:`InputError` where there is none."""
    mesh, matrix = bmesh.from_edit_mesh(obj.data), np.array(obj.matrix_world, np.float64)[:3, :3]
    active, layer = mesh.select_history.active, mesh.verts.layers.float_vector.get(AXIS)
    axis = np.zeros(3)
    if isinstance(active, bmesh.types.BMFace):
        axis = np.array(active.normal) @ np.linalg.pinv(matrix)
    elif isinstance(active, bmesh.types.BMEdge):
        axis = matrix @ np.array(active.verts[1].co - active.verts[0].co)
    elif active is not None and layer is not None:
        axis = np.array(active[layer]) @ np.linalg.pinv(matrix)
    if not axis.any():
        raise InputError("The active element has no axis: make a face, an edge or a point with a fixed axis active")
    return axis
