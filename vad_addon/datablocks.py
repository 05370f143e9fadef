"""From arrays to Blender's data-blocks. Each function makes exactly one and leaves nothing else behind."""

from contextlib import ExitStack
from pathlib import Path

import bpy
import numpy as np

from ..core.surface.mesh import Mesh
from . import volume_files


def mesh_data(name: str, mesh: Mesh, origin) -> bpy.types.Mesh:
    """A triangle mesh, shaded smooth as all new ones are, with vertices relative to `origin`, (3,) float64."""
    data = bpy.data.meshes.new(name)
    count = len(mesh.faces)
    data.vertices.add(len(mesh.vertices))
    data.vertices.foreach_set("co", _float32(mesh.vertices - origin))
    data.loops.add(3 * count)
    data.loops.foreach_set("vertex_index", np.ascontiguousarray(mesh.faces, np.int32).ravel())
    data.polygons.add(count)
    data.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    data.update(calc_edges=True)
    return data


def pointcloud_data(name: str, points, origin, attributes: dict[str, np.ndarray]) -> bpy.types.PointCloud:
    """A point cloud at `points` (n,3) relative to `origin`, with (n,) and (n,3) `attributes` in single precision."""
    cloud = _empty_cloud(len(points))
    cloud.name = name
    cloud.attributes["position"].data.foreach_set("vector", _float32(points - origin))
    for key, values in attributes.items():
        kind, slot = ("FLOAT", "value") if values.ndim == 1 else ("FLOAT_VECTOR", "vector")
        attribute = cloud.attributes.get(key) or cloud.attributes.new(key, kind, "POINT")
        attribute.data.foreach_set(slot, _float32(values))
    return cloud


def volume_data(name: str, path: Path, active: str) -> bpy.types.Volume:
    """A volume that reads the .vdb at `path` and shows its grid `active`."""
    volume = bpy.data.volumes.new(name)
    volume.filepath = volume_files.blender_path(path)
    volume.grids.load()
    volume.grids.active_index = volume.grids.find(active)
    return volume


def _float32(values):
    return np.ascontiguousarray(values, np.float32).ravel()


def _empty_cloud(count):
    """A point cloud of `count` points anywhere."""
    if hasattr(bpy.types.PointCloud, "resize"):
        cloud = bpy.data.pointclouds.new("points")
        cloud.resize(count)
        return cloud
    return _cloud_by_nodes(count)


def _cloud_by_nodes(count):
    """Before Blender 5.1 Python cannot size a point cloud, but geometry nodes can turn loose vertices into one."""
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
        carrier = keep(bpy.data.objects.new("points", mesh))
        carrier.modifiers.new("points", "NODES").node_group = nodes
        bpy.context.scene.collection.objects.link(carrier)
        geometry = carrier.evaluated_get(bpy.context.evaluated_depsgraph_get()).evaluated_geometry()
        return geometry.pointcloud.copy()
