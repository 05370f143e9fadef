"""How far a surface and its normals are from the truth, and whether the mesh is sound."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from core import Mesh

from .geometry import closest_faces, face_normals, surface_samples

SAMPLES = 200_000
NEAR_CURVE = 0.05


def surface_errors(mesh: Mesh, truth: Mesh, seed: int = 0, count: int = SAMPLES) -> dict:
    """Distances between two surfaces, x1e3, from `count` area-uniform points on each to the triangles of the other.

    to_truth_mean, to_truth_max : from the mesh to the truth (what is too much)
    to_mesh_mean, to_mesh_max   : from the truth to the mesh (what is missing)
    cd : mean of the two means     hd : the larger maximum
    f005, f010 : harmonic mean of the two shares of points closer than .005 and .010 (not x1e3)
    nc : mean |n.n*| of the triangles at the points and at their closest points, mean of both ways (not x1e3)
    """
    rng = np.random.default_rng(seed)
    to_truth, agreement_there = _one_way(mesh, truth, count, rng)
    to_mesh, agreement_back = _one_way(truth, mesh, count, rng)
    return {
        "cd": 1e3 * (to_truth.mean() + to_mesh.mean()) / 2,
        "hd": 1e3 * max(to_truth.max(), to_mesh.max()),
        "to_truth_mean": 1e3 * to_truth.mean(),
        "to_truth_max": 1e3 * to_truth.max(),
        "to_mesh_mean": 1e3 * to_mesh.mean(),
        "to_mesh_max": 1e3 * to_mesh.max(),
        "f005": _harmonic_mean((to_truth < 0.005).mean(), (to_mesh < 0.005).mean()),
        "f010": _harmonic_mean((to_truth < 0.010).mean(), (to_mesh < 0.010).mean()),
        "nc": (agreement_there + agreement_back) / 2,
    }


def _one_way(source, target, count, rng):
    """Distances from points of one surface to the other, and how well the normals agree there on average."""
    points, face = surface_samples(source, count, rng)
    distance, closest = closest_faces(points, target)
    agreement = np.einsum("mi,mi->m", face_normals(source)[face], face_normals(target)[closest])
    return distance, np.abs(agreement).mean()


def _harmonic_mean(a, b):
    return 2 * a * b / (a + b) if a + b else 0.0


def topology(mesh: Mesh) -> dict:
    """Counts that tell whether a mesh is closed and in how many pieces.

    components and euler (vertices - edges + faces) count vertices in use only; border_edges have one face,
    nonmanifold_edges three or more.
    """
    edges, faces_at = mesh.edge_counts()
    n = len(mesh.vertices)
    used = len(np.unique(mesh.faces))
    graph = coo_matrix((np.ones(len(edges)), edges.T), shape=(n, n))
    return {
        "components": connected_components(graph, directed=False)[0] - (n - used),
        "euler": used - len(edges) + len(mesh.faces),
        "border_edges": int((faces_at == 1).sum()),
        "nonmanifold_edges": int((faces_at > 2).sum()),
    }


def cover_euler(truth: Mesh, nm_curve: np.ndarray) -> int | None:
    """Euler characteristic of a perfect double cover: twice that of the true surface, whatever its borders and
    junctions. None where sheets cross without an edge there, so that the true mesh does not show how they connect."""
    found = topology(truth)
    crosses_unmarked = len(nm_curve) > 0 and not found["nonmanifold_edges"]
    return None if crosses_unmarked else 2 * found["euler"]


def normal_agreement(axes: np.ndarray, true_normals: np.ndarray, points: np.ndarray, nm_curve: np.ndarray) -> dict:
    """|n . n*| at the samples, all arrays (n,3) unit except `nm_curve` (m,3).

    nc : mean     nc_p05 : 5th percentile     nc_curve : mean within NEAR_CURVE of `nm_curve`, None where nobody is
    """
    agreement = np.abs(np.einsum("ni,ni->n", axes, true_normals))
    near = np.zeros(len(points), bool)
    if len(nm_curve):
        near = KDTree(nm_curve).query(points)[0] < NEAR_CURVE
    return {
        "nc": agreement.mean(),
        "nc_p05": np.percentile(agreement, 5),
        "nc_curve": agreement[near].mean() if near.any() else None,
    }
