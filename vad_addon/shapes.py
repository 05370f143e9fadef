"""Objects that follow the results of a run without a new one: a shell at any distance, a slice, normals that render."""

import bpy
import numpy as np

from ..core.errors import InputError
from . import materials, overlay, results

SHELL, SLICE, NORMALS = "shell", "slice", "normals"  # roles
_SLICE_STEPS = 256  # faces along each side of a slice


def shell(collection: bpy.types.Collection, offset: float) -> bpy.types.Object:
    """A mesh at distance `offset`, in grid cells, from the surface, by a Volume to Mesh modifier: turning its threshold
    needs no new run. Raises :class:`InputError` without a volume."""
    field = _field(collection)
    obj = _object(f"{field.name} shell", bpy.data.meshes.new(f"{field.name} shell"), SHELL, collection, field)
    modifier = obj.modifiers.new("Volume to Mesh", "VOLUME_TO_MESH")
    modifier.object = field
    modifier.grid_name = _distances(field)
    modifier.resolution_mode = "GRID"
    modifier.threshold = offset * field.data[materials.CELL]
    modifier.use_smooth_shade = True
    return obj


def cut(collection: bpy.types.Collection, axis: int) -> bpy.types.Object:
    """A plane through the middle of the volume, across `axis` (0, 1 or 2), that shows the distances where it lies, with
    colours and iso-lines, wherever it is moved. Raises :class:`InputError` without a volume."""
    field = _field(collection)
    size = np.array(field.data[materials.SIZE])
    obj = _object(f"{field.name} slice", _plane(size, axis), SLICE, collection, field)
    modifier = obj.modifiers.new("Slice", "NODES")
    modifier.node_group = _slice_nodes(field)
    obj.data.materials.append(materials.iso_lines(obj.name, field.data[materials.CELL], 0.25 * size.max()))
    return obj


def normals(collection: bpy.types.Collection, length: float, thickness: float, every: int) -> bpy.types.Object:
    """The normals as curves, which render: `length` and `thickness` in units of a sample's size, every n-th sample.

    Raises :class:`InputError` without samples.
    """
    samples = results.member(collection, results.SAMPLES)
    if samples is None:
        raise InputError(f"{collection.name} has no samples any more: reconstruct again")
    points, axes, _, radius = overlay.samples_of(samples.data)
    ends, rows = overlay.segments(points, axes, 0.5 * length * radius, every, len(points))
    curves = bpy.data.hair_curves.new(f"{samples.name} normals")
    curves.add_curves([2] * len(rows))
    curves.attributes["position"].data.foreach_set("vector", ends.ravel())
    widths = curves.attributes.get("radius") or curves.attributes.new("radius", "FLOAT", "POINT")
    widths.data.foreach_set("value", np.repeat(0.5 * thickness * radius[rows], 2).astype(np.float32))
    return _object(curves.name, curves, NORMALS, collection, samples)


def _field(collection):
    field = results.member(collection, results.FIELD)
    if field is None:
        raise InputError(f"{collection.name} has no volume: reconstruct again")
    return field


def _distances(field):
    """Name of the grid of distances, which says whether they are signed."""
    field.data.grids.load()
    return next(grid.name for grid in field.data.grids if grid.name in {"udf", "sdf"})


def _object(name, data, role, collection, parent):
    """A new object in the place of `parent`, and following it."""
    obj = bpy.data.objects.new(name, data)
    obj[results.ROLE] = role
    obj.parent = parent
    collection.objects.link(obj)
    return obj


def _plane(size, axis):
    """A grid of faces across `axis`, as large as the box of `size` (3,)."""
    u, v = (k for k in range(3) if k != axis)
    steps = np.linspace(-0.5, 0.5, _SLICE_STEPS + 1)
    points = np.zeros((len(steps), len(steps), 3), np.float32)
    points[..., u], points[..., v] = steps[:, None] * size[u], steps[None, :] * size[v]
    corner = (np.arange(_SLICE_STEPS)[:, None] * len(steps) + np.arange(_SLICE_STEPS)).ravel()
    faces = np.stack([corner, corner + len(steps), corner + len(steps) + 1, corner + 1], axis=1).astype(np.int32)
    mesh = bpy.data.meshes.new("slice")
    mesh.vertices.add(points.size // 3)
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", faces.ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 4, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh


def _slice_nodes(field):
    """Geometry nodes that store the distance at each vertex: the grid, taken into the plane's space, sampled there."""
    group = bpy.data.node_groups.new("VAD slice", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    kinds = "NodeGroupInput", "GeometryNodeObjectInfo", "GeometryNodeGetNamedGrid", "GeometryNodeSampleGrid"
    start, volume, grid, sample = (group.nodes.new(kind) for kind in kinds)
    store, end = group.nodes.new("GeometryNodeStoreNamedAttribute"), group.nodes.new("NodeGroupOutput")
    for place, node in enumerate((start, volume, grid, sample, store, end)):
        node.location.x = 200 * place
    volume.transform_space = "RELATIVE"
    volume.inputs["Object"].default_value = field
    grid.inputs["Name"].default_value = _distances(field)
    store.inputs["Name"].default_value = "distance"
    link = group.links.new
    link(volume.outputs["Geometry"], grid.inputs["Volume"])
    link(grid.outputs["Grid"], sample.inputs["Grid"])
    link(start.outputs["Geometry"], store.inputs["Geometry"])
    link(sample.outputs["Value"], store.inputs["Value"])
    link(store.outputs["Geometry"], end.inputs["Geometry"])
    return group
