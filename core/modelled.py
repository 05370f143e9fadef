"""What the vertices of a modelled mesh, which alone are read of it, do not show."""

from dataclasses import dataclass

import numpy as np

from .linalg import lengths, row_dots

_FACED = 0.9  # share of the vertices of modelled meshes that have faces, at least
_LARGE, _SHARE = 10, 0.25  # times the area for each vertex, of large faces; share of all area that these have at least
_SHARP = 25.0  # degrees by which faces turn at half the edges or more: vertices are too few for the shape
MANY = 20_000  # vertices, of meshes that are not looked at for that


@dataclass(frozen=True)
class Faces:
    """The faces of a mesh.

    count   : number of its vertices
    corners : (c,) int, the vertices around each face, one face after another
    sizes   : (f,) int, above 0, how many each has
    areas   : (f,), in any unit
    normals : (f,3), unit, or zero where it has no area
    """

    count: int
    corners: np.ndarray
    sizes: np.ndarray
    areas: np.ndarray
    normals: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> "Faces":
        """Those between points (n,3) float64, whose areas and normals are found by Newell's sums."""
        first = np.cumsum(sizes) - sizes
        with np.errstate(over="ignore", invalid="ignore"):  # of points as far apart no run is made
            away = points[corners] - np.repeat(points[corners[first]], sizes, axis=0)
            swept = 0.5 * np.add.reduceat(np.cross(away, away[_following(sizes)]), first) if len(sizes) else away
            areas = lengths(swept.T)
            return cls(len(points), corners, sizes, areas, swept / np.where(areas > 0, areas, 1.0)[:, None])

    def turn(self) -> float:
        """By how much two faces turn at an edge that they share, degrees, median, whichever way they are wound."""
        owner, other_end = np.repeat(np.arange(len(self.sizes)), self.sizes), self.corners[_following(self.sizes)]
        edge = np.minimum(self.corners, other_end) * np.int64(self.count) + np.maximum(self.corners, other_end)
        order = np.argsort(edge, kind="stable")
        edge, normal = edge[order], self.normals[owner[order]]
        sound = normal.any(axis=1)
        shared = np.flatnonzero((edge[1:] == edge[:-1]) & sound[1:] & sound[:-1])
        cosine = np.abs(row_dots(normal[shared], normal[shared + 1]))
        return float(np.degrees(np.arccos(min(np.median(cosine), 1.0)))) if len(shared) else 0.0


def _following(sizes):
    """The next corner around the same face, for each corner, (c,) int64."""
    last = np.cumsum(sizes) - 1
    following = np.arange(1, sizes.sum() + 1)
    following[last] = last - sizes + 1
    return following


def missed_by_vertices(faces: Faces, sampled: str, refined: str) -> str:
    """What vertices do not show of the mesh that they are of, and what helps, to go on from "its vertices alone are
    read, and"; empty where they may show all.

    Faces may be far larger than vertices are close together, as the caps of a cylinder of 128 sides, which are a third
    of it: then it helps to have it `sampled`. Or vertices are few for the shape: then it helps to have it `refined`. Of
    scans, where a tenth of the vertices or more have no face, nothing is said.
    """
    faced = len(np.unique(faces.corners))
    if faced <= _FACED * faces.count:
        return ""
    areas = np.asarray(faces.areas, np.float64)
    large = areas * faced > _LARGE * areas.sum()
    if areas[large].sum() > _SHARE * areas.sum():
        return f"much of its area lies on faces far larger than these are apart: {sampled}"
    turn = faces.turn() if faces.count <= MANY else 0.0
    if turn > _SHARP:
        return f"they are few for its shape: from face to face it turns by {turn:.0f} degrees; {refined}"
    return ""
