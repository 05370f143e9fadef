"""Other ways from points to a mesh, and the clock that times them and us."""

import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec

import numpy as np
from scipy.spatial import Delaunay, KDTree

from core import Mesh, MissingDependency

from .starts import USUAL, oriented, point_set

SHORT = 5.0  # seconds of CPU time: what takes less is worth repeating to time it


class Clock:
    """Wall-clock `seconds` and `cpu` seconds of all threads of this process, spent in a `with` block."""

    def __enter__(self):
        self._start = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *_):
        self.seconds, self.cpu = time.perf_counter() - self._start[0], time.process_time() - self._start[1]


def timed(function: Callable, *arguments) -> tuple:
    """What function(*arguments) returns, and the :class:`Clock` of it."""
    with Clock() as clock:
        result = function(*arguments)
    return result, clock


def median_clock(first: Clock, function: Callable, repeats: int) -> Clock:
    """Of the first run of the function and `repeats` - 1 more, the one of the median CPU time, the lower of two; just
    the first where that took SHORT seconds of it or more."""
    more = range(repeats - 1) if first.cpu < SHORT else ()
    clocks = [first, *(timed(function)[1] for _ in more)]
    return sorted(clocks, key=lambda clock: clock.cpu)[(len(clocks) - 1) // 2]


def delaunay_seconds(points: np.ndarray) -> float:
    """Best of three runs of scipy.spatial.Delaunay on the points (n,3)."""

    def once():
        with Clock() as clock:
            Delaunay(points)
        return clock.seconds

    return min(once() for _ in range(3))


def poisson(points: np.ndarray) -> tuple[Mesh, np.ndarray, "Clock"]:
    """Open3D: PCA normals over 30 neighbours, oriented along tangent planes over 15, Poisson at depth 8.

    Returns the mesh, the normals (n,3) and the time of the three steps, without that of loading the library. Raises
    :class:`MissingDependency`.
    """
    load_open3d()
    with Clock() as clock:
        cloud = oriented(points, USUAL.neighbours)
        mesh, _ = _screened_poisson(cloud, USUAL.depth)
    return _mesh(mesh), np.asarray(cloud.normals), clock


def load_open3d() -> None:
    """Raises :class:`MissingDependency` where that fails."""
    check_open3d()
    import open3d  # noqa: F401


@cache
def check_open3d() -> None:
    """Raises :class:`MissingDependency` where Open3D is missing or lacks a library of the system. Loads it in a process
    of its own, as a process passes its peak memory on to those it starts."""
    if find_spec("open3d") is None:
        raise MissingDependency("the peers need Open3D, which is not installed; install open3d or leave --peer out")
    done = subprocess.run([sys.executable, "-c", "import open3d"], capture_output=True, text=True)
    if done.returncode:
        said = done.stderr.strip().splitlines()[-1:] or [f"it ends with {done.returncode}"]
        raise MissingDependency(
            f"the peers need Open3D, which does not load: {said[0]}; install what it lacks (Debian: libusb-1.0-0, "
            "libgl1, libgomp1, libx11-6) or leave --peer out"
        )


@dataclass(frozen=True)
class Peer:
    """A way to a mesh.

    title    : for tables     how : what is run, in a sentence
    module   : the library it needs
    prepare  : (points (n,3), Start) -> whatever all variants start from; peers that share it run in one process
    finish   : (that, variant) -> Mesh
    variants : values of its parameter to choose from; (None,) where it has none
    unit     : what the parameter is
    normals, octree : whether it starts from normals, and from Poisson's octree
    first_step : what it spends long on before anything else, where others do so, too
    """

    title: str
    how: str
    module: str
    prepare: Callable
    finish: Callable
    variants: tuple = (None,)
    unit: str = ""
    normals: bool = False
    octree: bool = False
    first_step: str = ""

    @property
    def available(self) -> bool:
        return find_spec(self.module) is not None


def _poisson_from(points, start):
    return _screened_poisson(oriented(points, start.neighbours), start.depth)


def _screened_poisson(cloud, depth):
    import open3d

    return open3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=depth)


def _trim(poisson, share):
    import open3d

    mesh, densities = poisson
    trimmed = open3d.geometry.TriangleMesh(mesh)
    trimmed.remove_vertices_by_mask(np.asarray(densities) < np.quantile(densities, share))
    return _mesh(trimmed)


def _roll_balls(prepared, radii):
    import open3d

    cloud, spacing = prepared
    sizes = open3d.utility.DoubleVector(spacing * np.array(radii))
    return _mesh(open3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, sizes))


def _balls(points, start):
    return oriented(points, start.neighbours), _spacing(points)


def _tetrahedra(points, _):
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    return cloud, open3d.geometry.TetraMesh.create_from_point_cloud(cloud), _spacing(points)


def _alpha_shape(prepared, multiple):
    import open3d

    cloud, (tetrahedra, rows), spacing = prepared
    return _mesh(
        open3d.geometry.TriangleMesh.create_from_point_cloud_alpha_shape(cloud, multiple * spacing, tetrahedra, rows)
    )


def _as_they_are(points, _):
    return points


def _advancing_front(points, _):
    from CGAL.CGAL_Advancing_front_surface_reconstruction import advancing_front_surface_reconstruction

    faces = []
    advancing_front_surface_reconstruction(point_set(points), faces)
    return Mesh(points, np.array(faces, np.int32).reshape(-1, 3))


def _spacing(points):
    """Mean distance to the nearest other point."""
    return KDTree(points).query(points, 2)[0][:, 1].mean()


def _mesh(mesh):
    return Mesh(np.asarray(mesh.vertices), np.asarray(mesh.triangles))


PEERS = {
    "poisson": Peer(
        "Poisson",
        "Open3D: oriented PCA normals, screened Poisson reconstruction",
        "open3d",
        _poisson_from,
        lambda poisson, _: _mesh(poisson[0]),
        normals=True,
        octree=True,
        first_step="orientation",
    ),
    "trimmed": Peer(
        "Poisson, trimmed",
        "the same, without the vertices of least density",
        "open3d",
        _poisson_from,
        _trim,
        (0.01, 0.03, 0.1, 0.2, 0.4),
        "share of vertices dropped",
        normals=True,
        octree=True,
        first_step="orientation",
    ),
    "pivoting": Peer(
        "ball pivoting",
        "Open3D: oriented PCA normals, ball pivoting",
        "open3d",
        _balls,
        _roll_balls,
        ((2, 4), (1.5, 3, 6), (3, 6, 12)),
        "radii in mean distances to the nearest point",
        normals=True,
        first_step="orientation",
    ),
    "alpha": Peer(
        "alpha shape",
        "Open3D: alpha shape",
        "open3d",
        _tetrahedra,
        _alpha_shape,
        (3, 4, 6, 9, 12),
        "alpha in mean distances to the nearest point",
    ),
    "front": Peer(
        "advancing front",
        "CGAL: advancing front surface reconstruction at its defaults",
        "CGAL",
        _as_they_are,
        _advancing_front,
    ),
}


def peer_libraries() -> list[str]:
    """Modules of the peers that are installed."""
    return sorted({peer.module for peer in PEERS.values() if peer.available})
