"""Exact distances to meshes and random points on them."""

import igl
import numpy as np

from core import Mesh


def closest_points(x: np.ndarray, mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Distance (m,) from points `x` (m,3) to the nearest triangle, and the nearest point (m,3) on it."""
    squared, _, foot = _closest(x, mesh)
    return np.sqrt(squared), foot


def closest_faces(x: np.ndarray, mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Distance (m,) from points `x` (m,3) to the nearest triangle, and its index (m,)."""
    squared, face, _ = _closest(x, mesh)
    return np.sqrt(squared), face


def first_hits(eye: np.ndarray, directions: np.ndarray, mesh: Mesh) -> np.ndarray:
    """Distance (m,) from `eye` (3,) to the first triangle along unit directions (m,3); inf where there is none."""
    vertices, faces, tree = _with_tree(mesh)
    eyes = np.tile(np.asarray(eye, float), (len(directions), 1))
    face, distance, _ = tree.intersect_ray_first(vertices, faces, eyes, directions)
    return np.where(face < 0, np.inf, distance)


_trees = []  # (mesh, faces, tree) of the last two asked for: building the truth's anew each time would show


def _closest(x, mesh):
    """Squared distance, triangle and nearest point."""
    vertices, faces, tree = _with_tree(mesh)
    return tree.squared_distance(vertices, faces, x)


def _with_tree(mesh):
    """Vertices, faces and libigl's tree of them."""
    known = next((entry for entry in _trees if entry[0] is mesh), None)
    if known is None:
        known = mesh, mesh.faces.astype(np.int64), igl.AABB()
        known[2].init(mesh.vertices, known[1])
    _trees[:] = [known, *(entry for entry in _trees if entry is not known)][:2]
    return mesh.vertices, *known[1:]


def surface_points(mesh: Mesh, count: int, rng: np.random.Generator) -> np.ndarray:
    """Points (count,3) on the mesh, uniform by area."""
    return surface_samples(mesh, count, rng)[0]


def surface_samples(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points (count,3) on the mesh, uniform by area, and the triangle (count,) that each lies on."""
    areas = mesh.face_areas()
    face = rng.choice(len(areas), count, p=areas / areas.sum())
    a, b, c = mesh.vertices[mesh.faces[face]].transpose(1, 0, 2)
    root, along = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    return a + root * ((1 - along) * (b - a) + along * (c - a)), face


def face_normals(mesh: Mesh) -> np.ndarray:
    """(f,3) unit normals; zero for triangles without area."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)


def border_points(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points on the open edges, uniform by length, with the directions that lead off the surface there.

    Returns points, outward (unit, in the plane of the edge's face, square to the edge) and up (unit, square to that
    face), all (count,3); empty arrays where the mesh has no open edge.
    """
    faces = mesh.faces[:, [[0, 1, 2], [1, 2, 0], [2, 0, 1]]].reshape(-1, 3)
    _, edge, uses = np.unique(np.sort(faces[:, :2], axis=1), axis=0, return_inverse=True, return_counts=True)
    start, end, inner = mesh.vertices[faces[uses[edge.reshape(-1)] == 1]].transpose(1, 0, 2)
    if not len(start):
        return (np.empty((0, 3)),) * 3
    length = np.linalg.norm(end - start, axis=1)
    chosen = rng.choice(len(length), count, p=length / length.sum())
    along = ((end - start) / length[:, None])[chosen]
    outward = (start - inner)[chosen]
    outward -= np.einsum("mi,mi->m", outward, along)[:, None] * along
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    return start[chosen] + (rng.random(count) * length[chosen])[:, None] * along, outward, np.cross(outward, along)
