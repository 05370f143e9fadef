"""A small software renderer: orthographic, z-buffered, lit by a dome of shadow-casting lights. Needs no display."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

CANDIDATES_PER_BATCH = 2_000_000
SUPERSAMPLING = 2


@dataclass(frozen=True)
class Camera:
    """An orthographic view.

    axes   : (3,3) float64, rows are the image's right, its up and the direction towards the viewer
    centre : (3,) float64, the point in the middle of the image
    extent : float, height of the image in scene units
    shape  : (rows, columns) of the image
    """

    axes: np.ndarray
    centre: np.ndarray
    extent: float
    shape: tuple[int, int]

    @classmethod
    def facing(cls, points: np.ndarray, towards, up, shape: tuple[int, int], margin: float = 1.08) -> "Camera":
        """The view from direction `towards` (3,), `up` upwards, that just holds `points` (n,3)."""
        forward = np.asarray(towards, float) / np.linalg.norm(towards)
        right = np.cross(up, forward)
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(forward, right), forward])
        seen = points @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        width, height = (high - low)[:2]
        extent = margin * max(height, width * shape[0] / shape[1])
        return cls(axes, 0.5 * (low + high) @ axes, extent, shape)

    def scaled(self, factor: float) -> "Camera":
        """The same view on an image with `factor` times the rows and columns."""
        return replace(self, shape=(round(self.shape[0] * factor), round(self.shape[1] * factor)))

    @property
    def pixel(self) -> float:
        """Size of a pixel in scene units."""
        return self.extent / self.shape[0]

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n,3) scene -> (n,3) column, row and nearness to the viewer, all in pixels."""
        rows, columns = self.shape
        return (points - self.centre) @ self.axes.T / self.pixel * [1, -1, 1] + [columns / 2, rows / 2, 0]


def rasterise(corners: np.ndarray, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """The nearest triangle at every pixel.

    corners : (t,3,3) float64 projected corners; triangles wound clockwise on the screen (seen from behind) are skipped
    Returns the triangle's index, (rows,columns) int64, -1 where there is none, and its nearness, float64, -inf there.
    """
    nearness, triangle = np.full(shape[0] * shape[1], -np.inf), np.full(shape[0] * shape[1], -1)
    for owner, column, row in _candidates(corners, shape):
        weights = _barycentric(corners[owner], column + 0.5, row + 0.5)
        inside = (weights >= 0).all(axis=1)
        owner, weights, pixel = owner[inside], weights[inside], (row * shape[1] + column)[inside]
        near = np.einsum("ij,ij->i", weights, corners[owner, :, 2])
        np.maximum.at(nearness, pixel, near)
        first = nearness[pixel] == near
        triangle[pixel[first]] = owner[first]
    return triangle.reshape(shape), nearness.reshape(shape)


def render(
    vertices: np.ndarray, faces: np.ndarray, colours: np.ndarray, camera: Camera, cull: bool = True
) -> np.ndarray:
    """Draw a mesh with one colour per vertex.

    vertices (v,3), faces (f,3), colours (v,3) in [0,1]; `cull` hides faces seen from behind, else both sides show.
    Returns (rows,columns,4) float64 RGBA in [0,1], transparent where nothing is.
    """
    fine = camera.scaled(SUPERSAMPLING)
    corners = fine.project(vertices)[faces]
    if not cull:
        behind = _doubled_area(corners) > 0
        faces = np.where(behind[:, None], faces[:, ::-1], faces)
        corners = np.where(behind[:, None, None], corners[:, ::-1], corners)
    triangle, _ = rasterise(corners, fine.shape)
    row, column = np.nonzero(triangle >= 0)
    hit = triangle[row, column]
    weights = _barycentric(corners[hit], column + 0.5, row + 0.5)
    image = np.zeros((*fine.shape, 4))
    image[row, column, :3] = np.einsum("ij,ijk->ik", weights, colours[faces[hit]])
    image[row, column, 3] = 1
    image = image.reshape(camera.shape[0], SUPERSAMPLING, camera.shape[1], SUPERSAMPLING, 4).mean(axis=(1, 3))
    image[..., :3] /= np.maximum(image[..., 3:], 1e-9)
    return image.clip(0, 1)


def dome_light(vertices: np.ndarray, faces: np.ndarray, key, up, lights: int = 96) -> np.ndarray:
    """Light that reaches each vertex from a dome brightest around the direction `key`, (v,) float64, about 0 to 1.

    Every light casts shadows, through a depth image seen from it, so that folds and undersides darken as they should.
    """
    normals = vertex_normals(vertices, faces)
    key, up = (np.asarray(d, float) / np.linalg.norm(d) for d in (key, up))
    total = np.zeros(len(vertices))
    brightness = 0.0
    for light in evenly_spread_directions(lights):
        strength = 0.3 + 0.3 * (light @ up) + 2.5 * max(0.0, light @ key) ** 3
        camera = Camera.facing(vertices, light, _across(light), (400, 400))
        seen = camera.project(vertices)
        _, nearest = rasterise(seen[faces], camera.shape)
        column, row = seen[:, :2].astype(int).T
        lit = seen[:, 2] > nearest[row, column] - 3.0
        total += strength * lit * np.maximum(0.0, normals @ light)
        brightness += strength * max(0.0, light @ key)
    return total / brightness


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area-weighted unit normals, (v,3); zero at a vertex without faces."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], np.cross(b - a, c - a))
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)


def turned_discs(centres: np.ndarray, normals: np.ndarray, radius: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """One small octagon per point, across its normal: vertices (8n,3), eight in a row for each point, and faces."""
    right = np.cross(normals, np.where(np.abs(normals[:, :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    up = np.cross(normals, right)
    angle = np.arange(8) * np.pi / 4
    rim = np.cos(angle)[:, None] * right[:, None] + np.sin(angle)[:, None] * up[:, None]
    vertices = centres[:, None] + np.reshape(radius, (-1, 1, 1)) * rim
    fan = np.array([[0, k, k + 1] for k in range(1, 7)])
    faces = fan + 8 * np.arange(len(centres))[:, None, None]
    return vertices.reshape(-1, 3), faces.reshape(-1, 3)


def _candidates(corners: np.ndarray, shape: tuple[int, int]) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Batches of (triangle, column, row): every pixel centre in the bounding box of every front-facing triangle."""
    low = np.ceil(corners[..., :2].min(axis=1) - 0.5).astype(int).clip(0)
    high = np.floor(corners[..., :2].max(axis=1) - 0.5).astype(int).clip(max=[shape[1] - 1, shape[0] - 1])
    size = (high - low + 1).clip(0)
    count = size.prod(axis=1)
    front = np.flatnonzero((count > 0) & (_doubled_area(corners) < 0))
    ends = np.cumsum(count[front])
    for batch in np.split(front, np.flatnonzero(np.diff(ends // CANDIDATES_PER_BATCH)) + 1):
        owner = np.repeat(batch, count[batch])
        place = np.arange(len(owner)) - np.repeat(np.cumsum(count[batch]) - count[batch], count[batch])
        row, column = np.divmod(place, size[owner, 0])
        yield owner, column + low[owner, 0], row + low[owner, 1]


def _doubled_area(corners: np.ndarray) -> np.ndarray:
    """(t,) twice the signed screen area; negative when seen from the front, as rows grow downwards."""
    (ax, ay), (bx, by), (cx, cy) = (corners[:, k, :2].T for k in range(3))
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


def _barycentric(corners: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """(t,3) weights of each triangle's corners at its pixel position."""
    (ax, ay), (bx, by), (cx, cy) = (corners[:, k, :2].T for k in range(3))
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    first = ((bx - column) * (cy - row) - (by - row) * (cx - column)) / area
    second = ((cx - column) * (ay - row) - (cy - row) * (ax - column)) / area
    return np.stack([first, second, 1 - first - second], axis=1)


def evenly_spread_directions(count: int) -> np.ndarray:
    """(count,3) directions spread evenly over the sphere, on a Fibonacci spiral."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    return np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)


def _across(direction: np.ndarray) -> np.ndarray:
    """The coordinate axis most across `direction`."""
    return np.eye(3)[np.argmin(np.abs(direction))]
