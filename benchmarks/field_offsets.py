"""Level sets of the field, .02 apart, against the true distance (the paper's figure of offset surfaces)."""

import numpy as np

from core import DistanceField, Mesh, Settings, reconstruct
from core.surface.meshing.isosurface import isosurface
from core.surface.meshing.triangles import triangles

from .cases import Case
from .field_lines import cut_nodes
from .geometry import closest_points

LEVELS = 0.02, 0.04, 0.06, 0.08, 0.1
_WALL = 1.0  # cells; a level set that meets the box is closed there


def offsets(case: Case) -> tuple[dict, dict]:
    """Errors of the level sets' vertices, and what the picture needs.

    Errors, one row a level: | d - level | at the vertices (mean, 99th percentile, largest, x1e3) off the walls of the
    box, d the exact distance to the truth. Level 0 is the double cover, which is the zero set of the field.
    """
    result = reconstruct(case.points, Settings())
    meshes = {0.0: result.surface} | {level: level_set(result.field, level) for level in LEVELS}
    rows = [{"level": level, **_errors(mesh, level, result.field, case.truth)} for level, mesh in meshes.items()]
    axis = int(np.ptp(case.truth.vertices, axis=0).argmin())
    place = float(np.median(case.truth.vertices[:, axis]))
    nodes = cut_nodes(result.field, axis, place)
    flat = nodes.reshape(-1, 3)
    picture = {
        "meshes": meshes,
        "axis": axis,
        "place": place,
        "nodes": nodes,
        "u": result.field.sample(flat).reshape(nodes.shape[:2]),
        "d": closest_points(flat, case.truth)[0].reshape(nodes.shape[:2]),
    }
    return {"case": case.name, "cell": result.field.spacing, "levels": rows}, picture


def level_set(field: DistanceField, level: float) -> Mesh:
    """The surface where u is `level`."""
    cells, faces = isosurface(field.values, level)
    return Mesh(field.origin + field.spacing * cells, triangles(cells, faces).astype(np.int32))


def _errors(mesh, level, field, truth):
    low, high = field.origin, field.origin + field.spacing * (np.array(field.values.shape) - 1)
    margin = _WALL * field.spacing
    inside = ((mesh.vertices > low + margin) & (mesh.vertices < high - margin)).all(axis=1)
    off = 1e3 * np.abs(closest_points(mesh.vertices[inside], truth)[0] - level)
    return {"vertices": int(inside.sum()), "mean": off.mean(), "p99": np.percentile(off, 99), "max": off.max()}
