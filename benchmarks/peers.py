"""Named references, timed on the same points in the same process."""

import time
from importlib.util import find_spec

import numpy as np
from scipy.spatial import Delaunay

from core import Mesh, MissingDependency


class Clock:
    """Wall-clock `seconds` and `cpu` seconds of all threads of this process, spent in a `with` block."""

    def __enter__(self):
        self._start = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *_):
        self.seconds, self.cpu = time.perf_counter() - self._start[0], time.process_time() - self._start[1]


def delaunay_seconds(points: np.ndarray) -> float:
    """Best of three runs of scipy.spatial.Delaunay on the points (n,3)."""

    def once():
        with Clock() as clock:
            Delaunay(points)
        return clock.seconds

    return min(once() for _ in range(3))


def poisson(points: np.ndarray) -> tuple[Mesh, np.ndarray, "Clock"]:
    """Open3D: PCA normals over 30 neighbours, oriented along tangent planes over 15, Poisson at depth 8.

    Returns the mesh, the normals (n,3) and the time of the three steps. Raises :class:`MissingDependency`.
    """
    check_open3d()
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    with Clock() as clock:
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(30))
        cloud.orient_normals_consistent_tangent_plane(15)
        mesh, _ = open3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=8)
    return Mesh(np.asarray(mesh.vertices), np.asarray(mesh.triangles)), np.asarray(cloud.normals), clock


def check_open3d() -> None:
    """Raises :class:`MissingDependency` where Open3D is missing. Does not load it: a process passes its peak memory
    on to those it starts."""
    if find_spec("open3d") is None:
        raise MissingDependency("the peer needs Open3D, which is not installed; install open3d or leave --peer out")
