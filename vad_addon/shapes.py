"""Objects that follow the results of a run without a new one: a shell at any distance, a slice, normals that render."""

import bpy
import numpy as np

from ..core.errors import InputError
from . import datablocks, materials, overlay, results, volume_files

SHELL, SLICE, NORMALS = "shell", "slice", "normals"  # roles
_GRID_BY_NAME = "GeometryNodeGetNamedGrid"
_SLICE_STEPS = 256  # faces along each side of a slice


def shell(collection: bpy.types.Collection, offset: float) -> bpy.types.Object:
    """A mesh at distance `offset`, in grid cells, from the surface, by a Volume to Mesh modifier: turning its threshold
    needs no new run. Raises :class:`InputError` without a volume that can be read."""
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
    colours and iso-lines, wherever it is moved. Raises :class:`InputError` without a volume that can be read."""
    field = _field(collection)
    size = np.array(field.data[materials.SIZE])
    obj = _object(f"{field.name} slice", _plane(size, axis), SLICE, collection, field)
    modifier = obj.modifiers.new("Slice", "NODES")
    modifier.node_group = _slice_nodes(field, axis)
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
    if not len(points):
        raise InputError(f"{samples.name} has no points any more: reconstruct again")
    ends, rows = overlay.segments(points, axes, 0.5 * length * radius, every, len(points))
    curves = bpy.data.hair_curves.new(f"{samples.name} normals")
    curves.add_curves([2] * len(rows))
    curves.attributes["position"].data.foreach_set("vector", ends.ravel())
    widths = curves.attributes.get("radius") or curves.attributes.new("radius", "FLOAT", "POINT")
    widths.data.foreach_set("value", np.repeat(0.5 * thickness * radius[rows], 2).astype(np.float32))
    return _object(curves.name, curves, NORMALS, collection, samples)


def follow(collection: bpy.types.Collection) -> None:
    """Let shells and slices read the distances of the collection's volume, which signed ones have another name for."""
    field = results.member(collection, results.FIELD)
    for obj in {*collection.objects, *field.children}:
        for modifier in obj.modifiers:
            if results.role(obj) == SHELL and modifier.type == "VOLUME_TO_MESH":
                modifier.grid_name = _distances(field)
            elif results.role(obj) == SLICE and modifier.type == "NODES" and modifier.node_group is not None:
                for node in modifier.node_group.nodes:
                    if node.bl_idname == _GRID_BY_NAME:
                        node.inputs["Name"].default_value = _distances(field)


def _field(collection):
    field = results.member(collection, results.FIELD)
    if field is None:
        raise InputError(f"{collection.name} has no volume: reconstruct again")
    if _distances(field) is None:
        if field.data.packed_file is not None:
            raise InputError(f"{field.name} is packed: press File > External Data > Unpack Resources, then try again")
        raise InputError(unreadable(field))
    if materials.CELL not in field.data:
        raise InputError(f"{field.name} shows another volume than its own: reconstruct again")
    return field


def unreadable(field: bpy.types.Object) -> str:
    """What to say of a field whose file cannot be read."""
    return f"{field.name} cannot be read from {volume_files.file_of(field.data)}: reconstruct again"


def _distances(field):
    """Name of the grid of distances, which says whether they are signed; None where the file is gone."""
    field.data.grids.load()
    return next((grid.name for grid in field.data.grids if grid.name in {"udf", "sdf"}), None)


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
    faces = np.stack([corner, corner + len(steps), corner + len(steps) + 1, corner + 1], axis=1)
    return datablocks.mesh_data("slice", points.reshape(-1, 3), [faces], 0, {})


def _slice_nodes(field, axis):
    """Geometry nodes that store at each vertex of a plane across `axis` the distance, and its slope within the plane,
    which keeps iso-lines equally wide: the grid, taken into the plane's space, sampled there and half a cell beside."""
    group = bpy.data.node_groups.new("VAD slice", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")

    def node(kind, column, row=0):
        made = group.nodes.new(kind)
        made.location = 200 * column, -200 * row
        return made

    def vector_math(operation, column, row, *inputs):
        made = node("ShaderNodeVectorMath", column, row)
        made.operation = operation
        for socket, given in zip(made.inputs, inputs, strict=False):
            if isinstance(given, bpy.types.NodeSocket):
                group.links.new(given, socket)
            else:
                socket.default_value = given
        return made.outputs

    volume, grid = node("GeometryNodeObjectInfo", 0), node(_GRID_BY_NAME, 1)
    volume.transform_space = "RELATIVE"
    volume.inputs["Object"].default_value = field
    grid.inputs["Name"].default_value = _distances(field)
    group.links.new(volume.outputs["Geometry"], grid.inputs["Volume"])
    place, step = node("GeometryNodeInputPosition", 1, 2).outputs["Position"], 0.5 * field.data[materials.CELL]

    def distance(row, beside=None):
        sample = node("GeometryNodeSampleGrid", 3, row)
        group.links.new(grid.outputs["Grid"], sample.inputs["Grid"])
        if beside is not None:
            group.links.new(vector_math("ADD", 2, row, place, beside)["Vector"], sample.inputs["Position"])
        return sample.outputs["Value"]

    here = distance(0)
    ends = [node("ShaderNodeCombineXYZ", 4, 1), node("ShaderNodeCombineXYZ", 4, 2)]
    row = 1
    for name in (name for k, name in enumerate("XYZ") if k != axis):
        for end, sign in zip(ends, (step, -step), strict=True):
            group.links.new(distance(row, [sign * (name == other) for other in "XYZ"]), end.inputs[name])
            row += 1
    rise = vector_math("SUBTRACT", 5, 1, *(end.outputs["Vector"] for end in ends))["Vector"]
    rise = vector_math("DIVIDE", 6, 1, rise, [2 * step] * 3)["Vector"]
    slope = vector_math("LENGTH", 7, 1, rise)["Value"]

    geometry = node("NodeGroupInput", 7).outputs["Geometry"]
    for column, (name, value) in enumerate({"distance": here, "slope": slope}.items(), start=8):
        store = node("GeometryNodeStoreNamedAttribute", column)
        store.inputs["Name"].default_value = name
        group.links.new(geometry, store.inputs["Geometry"])
        group.links.new(value, store.inputs["Value"])
        geometry = store.outputs["Geometry"]
    group.links.new(geometry, node("NodeGroupOutput", 10).inputs["Geometry"])
    return group
