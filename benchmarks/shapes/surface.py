"""Surfaces that are known exactly: a fine triangle mesh, and the way from its triangles to the surface itself."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree
from skimage.measure import marching_cubes

from core import Mesh

_WELD = 1e-6  # corners that share a cell of a grid this fine are one
_STEP = 1e-6  # of a parameter's range, or of an implicit shape's size: step of the central differences
_NEWTON_STEPS = 6
_CROSSING_SAMPLES, _CROSSING_REACH, _CROSSING_AGREEMENT = 200_000, 0.003, 0.9

Lift = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Surface:
    """A surface whose longest side is 0.8, centred at the origin.

    mesh  : fine triangles of it, welded, so that sheets that meet share edges
    lift  : (face (m,), weights (m,3) of its corners) -> points on the exact surface and unit normals there, (m,3) each
    curve : (k,3) samples of the curves where sheets meet or cross; empty where none do
    """

    mesh: Mesh
    lift: Lift
    curve: np.ndarray


@dataclass(frozen=True)
class Patch:
    """A piece of surface over the unit square.

    position : (m,2) parameters -> (m,3), smooth also a little beyond the square
    steps    : number of grid cells along either parameter; patches that meet must divide their common line alike
    """

    position: Callable[[np.ndarray], np.ndarray]
    steps: tuple[int, int]


def from_patches(patches: Sequence[Patch], curve: np.ndarray = np.empty((0, 3))) -> Surface:
    """The union of the patches. Normals are central differences of the positions, exact to about 1e-9."""
    grids = [_grid(patch.steps) for patch in patches]
    corners = [patch.position(uv) for patch, (uv, _) in zip(patches, grids, strict=True)]
    firsts = np.cumsum([0, *(len(c) for c in corners)])
    parameters = np.concatenate([uv[faces] for uv, faces in grids])
    owner = np.repeat(np.arange(len(patches)), [len(faces) for _, faces in grids])
    centre, scale = _fit(np.concatenate(corners))
    faces = np.concatenate([first + faces for first, (_, faces) in zip(firsts, grids, strict=False)])
    mesh, kept = _welded((np.concatenate(corners) - centre) * scale, faces)
    parameters, owner = parameters[kept], owner[kept]

    def lift(face, weights):
        uv, points, normals = np.einsum("mk,mki->mi", weights, parameters[face]), *np.empty((2, len(face), 3))
        for k, patch in enumerate(patches):
            rows = owner[face] == k
            points[rows] = (patch.position(uv[rows]) - centre) * scale
            normals[rows] = np.cross(*(_difference(patch.position, uv[rows], e) for e in _STEP * np.eye(2)))
        return points, _unit(normals)

    return Surface(mesh, lift, (curve - centre) * scale)


def from_implicit(value: Callable[[np.ndarray], np.ndarray], size: float, steps: int) -> Surface:
    """Where value((m,3)) is 0 inside the cube of half side `size`, cut open by its walls; `steps` cells along a side.

    Vertices and samples are moved onto the surface by Newton's steps along the gradient.
    """
    axis = np.linspace(-size, size, steps + 1)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    volume = value(nodes.reshape(-1, 3)).reshape(nodes.shape[:3])
    vertices, faces, *_ = marching_cubes(volume, 0.0, spacing=(axis[1] - axis[0],) * 3)
    vertices = _onto(value, vertices - size, size)
    centre, scale = _fit(vertices)
    mesh, _ = _welded((vertices - centre) * scale, faces)

    def lift(face, weights):
        flat = np.einsum("mk,mki->mi", weights, mesh.vertices[mesh.faces[face]])
        points = _onto(value, flat / scale + centre, size)
        return (points - centre) * scale, _unit(_gradient(value, points, size))

    return Surface(mesh, lift, np.empty((0, 3)))


def from_mesh(mesh: Mesh, curve: np.ndarray = np.empty((0, 3))) -> Surface:
    """The triangles themselves."""
    centre, scale = _fit(mesh.vertices[mesh.faces].reshape(-1, 3))
    scaled, _ = _welded((mesh.vertices - centre) * scale, mesh.faces)

    def lift(face, weights):
        corners = scaled.vertices[scaled.faces[face]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return np.einsum("mk,mki->mi", weights, corners), _unit(normals)

    return Surface(scaled, lift, (curve - centre) * scale)


def with_crossings(surface: Surface) -> Surface:
    """The same surface with `curve` where it crosses itself: dense samples that lie close together while their normals
    disagree, thinned to one in ten."""
    points, normals = sample(surface, _CROSSING_SAMPLES, np.random.default_rng(0))
    a, b = KDTree(points).query_pairs(_CROSSING_REACH, output_type="ndarray").T
    agreement = np.abs(np.einsum("mi,mi->m", normals[a], normals[b]))
    crossing = np.unique(a[agreement < _CROSSING_AGREEMENT])
    return Surface(surface.mesh, surface.lift, points[crossing[::10]])


def sample(surface: Surface, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points of the exact surface, uniform by area, and unit normals, (count,3) each."""
    areas = surface.mesh.face_areas()
    face = rng.choice(len(areas), count, p=areas / areas.sum())
    root, along = np.sqrt(rng.random(count)), rng.random(count)
    return surface.lift(face, np.stack([1 - root, root * (1 - along), root * along], axis=1))


def _grid(steps):
    """Parameters ((m+1)(n+1),2) of a grid over the unit square, and its triangles."""
    m, n = steps
    u, v = np.meshgrid(np.arange(m + 1) / m, np.arange(n + 1) / n, indexing="ij")
    a = (np.arange(m)[:, None] * (n + 1) + np.arange(n)).ravel()
    b, c, d = a + n + 1, a + n + 2, a + 1
    return np.stack([u.ravel(), v.ravel()], axis=1), np.concatenate([np.stack(t, 1) for t in ((a, b, c), (a, c, d))])


def _welded(vertices, faces):
    """Mesh with equal vertices joined and unused ones dropped, and which triangles kept three different corners."""
    cells = np.floor((vertices + 0.5) / _WELD + 0.3).astype(np.int64)  # .3: no cell ends at a round number
    keys = (cells[:, 0] << 40) + (cells[:, 1] << 20) + cells[:, 2]
    _, first, index = np.unique(keys, return_index=True, return_inverse=True)
    faces = index[faces]
    kept = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    used, compact = np.unique(faces[kept], return_inverse=True)
    return Mesh(vertices[first[used]], compact.reshape(-1, 3).astype(np.int32)), kept


def _fit(points):
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2, 0.8 / (high - low).max()


def _difference(function, at, step):
    return function(at + step) - function(at - step)


def _gradient(value, points, size):
    step = _STEP * size
    return np.stack([_difference(value, points, e) for e in step * np.eye(3)], axis=1) / (2 * step)


def _onto(value, points, size):
    for _ in range(_NEWTON_STEPS):
        gradient = _gradient(value, points, size)
        points = points - (value(points) / np.einsum("mi,mi->m", gradient, gradient))[:, None] * gradient
    return points


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
