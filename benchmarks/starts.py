"""How points are readied for the peers, each of which takes the best way: cleaned or not, and with which normals."""

from dataclasses import dataclass
from itertools import product

import numpy as np

FINE_FROM = 100_000  # points of a case from which a grid twice as fine is measured, too
DEPTHS = 8, 9  # of Poisson's octree; the second from so many points on alone
JET_NEIGHBOURS = 24
FILTER = 20, 2.0  # neighbours and standard deviations of Open3D's statistical filter

_NEIGHBOURS = 30, 12, 8  # of a normal; up to so many points all, of more the first alone
_UP_TO = 20_000
_ORIENTATION = 15  # neighbours, but no more than a normal has
_DROPPED, _SMOOTHED = "strays dropped", "smoothed"
_CLEANINGS = {"outliers": (None, _DROPPED), "noisy": (None, _SMOOTHED)}  # by category


@dataclass(frozen=True)
class Start:
    """cleaning : what is done to the points first, None for nothing    neighbours : of a normal, None for no normals
    depth : of Poisson's octree, None for none"""

    cleaning: str | None = None
    neighbours: int | None = None
    depth: int | None = None

    def __str__(self):
        said = [
            self.cleaning,
            self.neighbours and f"{self.neighbours} neighbours",
            self.depth and self.depth != DEPTHS[0] and f"depth {self.depth}",
        ]
        return ", ".join(filter(None, said))


USUAL = Start(neighbours=_NEIGHBOURS[0], depth=DEPTHS[0])


def starts(category: str, count: int, normals: bool, octree: bool) -> list[Start]:
    """The ways to begin with so many points of a case of the category, for peers that need normals or an octree; the
    usual one first."""
    neighbours = (None,) if not normals else _NEIGHBOURS if count <= _UP_TO else _NEIGHBOURS[:1]
    depths = (None,) if not octree else DEPTHS if count >= FINE_FROM else DEPTHS[:1]
    return [Start(*each) for each in product(_CLEANINGS.get(category, (None,)), neighbours, depths)]


def ways_to_start() -> str:
    """What these are, in a sentence."""
    few, most = "; ".join(map(str, _NEIGHBOURS)), _NEIGHBOURS[0]
    return (
        f"normals over the best number of neighbours, {few} ({most} on more than {_UP_TO:,} points), oriented along "
        f"tangent planes over {_ORIENTATION} or as many; Poisson's depth {DEPTHS[0]}, from {FINE_FROM:,} points on the "
        f"better of that and {DEPTHS[1]}; on points with strays also without those whose mean distance to "
        f"{FILTER[0]} neighbours is {FILTER[1]:g} standard deviations above the mean (Open3D), on noisy ones also "
        f"smoothed by jets over {JET_NEIGHBOURS} (CGAL), if that is better"
    )


def readied(points: np.ndarray, start: Start) -> np.ndarray:
    """The points (n,3), cleaned as `start` says."""
    if start.cleaning == _SMOOTHED:
        return smoothed(points)
    if start.cleaning == _DROPPED:
        return without_strays(points)
    return points


def without_strays(points: np.ndarray) -> np.ndarray:
    """The points (n,3) that Open3D's statistical filter leaves."""
    return np.asarray(_cloud(points).remove_statistical_outlier(*FILTER)[0].points)


def oriented(points: np.ndarray, neighbours: int):
    """Open3D's cloud of the points with PCA normals over their neighbours, oriented along tangent planes."""
    import open3d

    cloud = _cloud(points)
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(neighbours))
    cloud.orient_normals_consistent_tangent_plane(min(_ORIENTATION, neighbours))
    return cloud


def smoothed(points: np.ndarray) -> np.ndarray:
    """The points (n,3), moved by CGAL's jet smoothing."""
    from CGAL.CGAL_Point_set_processing_3 import jet_smooth_point_set

    cloud = point_set(points)
    jet_smooth_point_set(cloud, JET_NEIGHBOURS)
    return np.array([[point.x(), point.y(), point.z()] for point in cloud.points()])


def point_set(points: np.ndarray):
    """CGAL's set of the points (n,3)."""
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Point_set_3 import Point_set_3

    cloud = Point_set_3()
    cloud.reserve(len(points))
    for x, y, z in points.tolist():
        cloud.insert(Point_3(x, y, z))
    return cloud


def _cloud(points):
    import open3d

    return open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
