"""From arrays to Blender's data-blocks. Each function makes exactly one and leaves nothing else behind."""

from contextlib import ExitStack, suppress
from pathlib import Path

import bpy
import numpy as np

from . import volume_files
from .attributes import Attribute, write

_OF_TOOLS = "remesh_", "use_remesh_", "use_mirror_", "radial_symmetry"  # settings of meshes


def mesh_data(name: str, vertices, kinds, origin, attributes: dict[str, Attribute]) -> bpy.types.Mesh:
    """A mesh, shaded smooth as all new ones are: (v,3) `vertices` relative to `origin`, and its faces, an array (f,k)
    for each number of corners."""
    data = bpy.data.meshes.new(name)
    corners = np.concatenate([faces.ravel() for faces in kinds]).astype(np.int32)
    sizes = np.concatenate([np.full(len(faces), faces.shape[1], np.int32) for faces in kinds])
    data.vertices.add(len(vertices))
    data.vertices.foreach_set("co", _float32(vertices - origin))
    data.loops.add(len(corners))
    data.loops.foreach_set("vertex_index", corners)
    data.polygons.add(len(sizes))
    data.polygons.foreach_set("loop_start", (np.cumsum(sizes) - sizes).astype(np.int32))
    data.update(calc_edges=True)
    write(data, attributes)
    return data


def vertices_data(name: str, points, origin) -> bpy.types.Mesh:
    """A mesh of loose vertices at `points` (n,3) relative to `origin`."""
    data = bpy.data.meshes.new(name)
    data.vertices.add(len(points))
    data.vertices.foreach_set("co", _float32(points - origin))
    return data


def pointcloud_data(name: str, points, origin, attributes: dict[str, Attribute]) -> bpy.types.PointCloud:
    """A point cloud at `points` (n,3) relative to `origin`."""
    cloud = _empty_cloud(len(points))
    cloud.name = name
    cloud.attributes["position"].data.foreach_set("vector", _float32(points - origin))
    write(cloud, attributes)
    return cloud


def volume_data(name: str, path: Path, active: str) -> bpy.types.Volume:
    """A volume that reads the .vdb at `path` and shows its grid `active`."""
    volume = bpy.data.volumes.new(name)
    volume.filepath = volume_files.blender_path(path)
    volume.grids.load()
    volume.grids.active_index = volume.grids.find(active)
    return volume


def replace_data(old: bpy.types.ID, new: bpy.types.ID) -> None:
    """Put `new` wherever `old` is used, under its name and with its materials, custom properties and animation, flat
    where it was, to be remeshed and mirrored alike, and remove `old`."""
    for material in old.materials:
        new.materials.append(material)
    for name in filter(lambda name: name.startswith(_OF_TOOLS), old.bl_rna.properties.keys()):
        setattr(new, name, getattr(old, name))
    for name, value in old.items():
        new[name] = value.to_dict() if hasattr(value, "to_dict") else value
        with suppress(TypeError):  # not all can have limits and a tooltip
            new.id_properties_ui(name).update_from(old.id_properties_ui(name))
    if old.animation_data is not None:
        _animate_alike(old.animation_data, new.animation_data_create())
    new.use_fake_user = old.use_fake_user
    if isinstance(old, bpy.types.Mesh) and len(old.polygons) and not any(face.use_smooth for face in old.polygons):
        new.shade_flat()
    old.user_remap(new)
    name = old.name
    bpy.data.batch_remove([old])
    new.name = name


def _animate_alike(before, now):
    """Actions and drivers of one block's animation for that of another."""
    now.action = before.action
    if before.action is not None:
        now.action_slot = before.action_slot
    for curve in before.drivers:
        now.drivers.from_existing(src_driver=curve)


def replace_volume(old: bpy.types.Volume, new: bpy.types.Volume) -> None:
    """Let `old` read the file of `new`, keep all else as the user left it, and remove `new`. A file packed into the
    .blend goes: unpacked later, it would be written over the one that is read now."""
    grid = old.grids[old.grids.active_index].name if len(old.grids) else ""
    old.filepath = new.filepath
    if old.packed_file is not None:
        packs = bpy.data.use_autopack
        bpy.ops.file.unpack_item(method="USE_ORIGINAL", id_name=old.name, id_type=int.from_bytes(b"VO", "little"))
        bpy.data.use_autopack = packs  # unpacking ends it
    old.grids.load()
    old.grids.active_index = max(old.grids.find(grid), 0)
    bpy.data.batch_remove([new])


def _float32(values):
    return np.ascontiguousarray(values, np.float32).ravel()


def _empty_cloud(count):
    """A point cloud of `count` points anywhere."""
    if "resize" in bpy.types.PointCloud.bl_rna.functions:
        cloud = bpy.data.pointclouds.new("points")
        cloud.resize(count)
        return cloud
    return _cloud_by_nodes(count)


def _cloud_by_nodes(count):
    """Before Blender 5.1 Python cannot size a point cloud, but geometry nodes can turn loose vertices into one. In a
    scene of its own: any other may be linked."""
    with ExitStack() as temporary:

        def keep(block):
            temporary.callback(bpy.data.batch_remove, [block])
            return block

        nodes = keep(bpy.data.node_groups.new("points", "GeometryNodeTree"))
        for direction in ("INPUT", "OUTPUT"):
            nodes.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
        start, convert, end = (
            nodes.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeMeshToPoints", "NodeGroupOutput")
        )
        nodes.links.new(start.outputs[0], convert.inputs[0])
        nodes.links.new(convert.outputs[0], end.inputs[0])
        mesh = keep(bpy.data.meshes.new("points"))
        mesh.vertices.add(count)
        mesh.attributes.remove(mesh.attributes[".select_vert"])
        carrier = keep(bpy.data.objects.new("points", mesh))
        carrier.modifiers.new("points", "NODES").node_group = nodes
        scene = keep(bpy.data.scenes.new("points"))
        scene.collection.objects.link(carrier)
        layer = scene.view_layers[0]
        layer.update()
        geometry = carrier.evaluated_get(layer.depsgraph).evaluated_geometry()  # owns the points
        return geometry.pointcloud.copy()
