"""From a reconstruction to objects in the scene."""

from contextlib import ExitStack
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ..core.errors import VADError
from ..core.io.report import report_json
from ..core.reconstruction import Reconstruction
from . import datablocks, volume_files


@dataclass
class Delivery:
    """What a run left in the scene; `surface` and `volume` are None where there is no such result."""

    collection: bpy.types.Collection
    samples: bpy.types.Object
    warnings: list[str]
    surface: bpy.types.Object | None = None
    volume: bpy.types.Object | None = None


def deliver(scene: bpy.types.Scene, name: str, result: Reconstruction) -> Delivery:
    """Link a collection "`name` VAD" with the surface, the samples and the volume to `scene`, all or nothing.

    Objects are placed at the centre of the samples and their data is relative to it, so that single precision is enough
    for large coordinates. A volume that cannot be written becomes a warning: the other results are delivered.
    The collection carries the run's report as JSON in its custom property ``vad_report``, see also :func:`summary`
    and :func:`warnings`.
    """
    origin = _origin(result.points)
    with ExitStack() as rollback:

        def keep(block):
            rollback.callback(bpy.data.batch_remove, [block])
            return block

        def add(suffix, make, *arguments):
            data = keep(make(f"{name} {suffix}", *arguments))
            obj = keep(bpy.data.objects.new(data.name, data))
            obj.location = origin
            collection.objects.link(obj)
            return obj

        collection = keep(bpy.data.collections.new(f"{name} VAD"))
        attributes = dict(
            normal=result.normals,
            confidence=result.confidence,
            radius=np.full(len(result.points), 0.25 * result.field.spacing),
        )
        samples = add("samples", datablocks.pointcloud_data, result.points, origin, attributes)
        delivery = Delivery(collection, samples, list(result.report["warnings"]))
        if result.surface is not None:
            delivery.surface = add("surface", datablocks.mesh_data, result.surface, origin)
        try:
            path = volume_files.write(name, replace(result.field, origin=result.field.origin - origin))
        except VADError as error:
            delivery.warnings.append(f"No volume: {error}")
        else:
            rollback.callback(path.unlink)
            delivery.volume = add("field", datablocks.volume_data, path, "density")
            delivery.volume.data.display.density = 0.5 / result.field.spacing
        collection["vad_report"] = report_json(result.report)
        collection["vad_summary"] = "\n".join(_summary(result))
        collection["vad_warnings"] = "\n".join(delivery.warnings)
        scene.collection.children.link(collection)
        scene.vad.result = collection
        rollback.pop_all()
    return delivery


def summary(collection: bpy.types.Collection) -> list[str]:
    """A few lines on the run that made `collection`, for people."""
    return collection.get("vad_summary", "").splitlines()


def warnings(collection: bpy.types.Collection) -> list[str]:
    """What went less than well in the run that made `collection`, one line each."""
    return collection.get("vad_warnings", "").splitlines()


def _summary(result):
    yield f"{len(result.points):,} samples"
    yield " × ".join(map(str, result.field.values.shape)) + " grid"
    if result.surface is not None:
        yield f"{len(result.surface.faces):,} triangles"
    yield f"{sum(result.report['seconds'].values()):.1f} s"


def _origin(points):
    """Centre of the bounding box, (3,), rounded to what an object's location can hold exactly."""
    return (0.5 * (points.min(axis=0) + points.max(axis=0))).astype(np.float32).astype(np.float64)
