"""The method's steps in the plane, for a picture of them, on a curve with a junction and an open end.

Every step is the planar form of the one in `core` that it names, written for some dozen points. Units are those of the
points; h is the mean distance between neighbours.
"""

import numpy as np
from scipy.sparse import coo_matrix, diags, eye, kron, vstack
from scipy.sparse.linalg import spsolve
from scipy.spatial import KDTree, Voronoi
from scipy.special import k0e, k1e

_REACH = 2.5  # h, from its two samples, at which a bisector ends
_SWEEPS = 60
_RIM = 0.35  # h by which the patch of an end sample goes on
_LONE = 1.6  # h to the nearest sample on one side, beyond which a sample is an end
_TIED = 1e3  # weight of u = 0 at the samples beside that of the slopes


def curve(count: int = 46, seed: int = 4) -> np.ndarray:
    """Points (n,2) at uneven steps on a ring and on a stem that leaves it and ends."""
    turn = 2 * np.pi * np.linspace(0, 1, 801)
    ring = np.stack([0.26 * np.cos(turn), 0.2 * np.sin(turn) - 0.16], axis=1)
    rise = np.linspace(0, 1, 801)[:, None]
    stem = (1 - rise) ** 2 * [-0.26, -0.16] + 2 * rise * (1 - rise) * [-0.3, 0.5] + rise**2 * [0.26, 0.3]
    lengths = [np.linalg.norm(np.diff(part, axis=0), axis=1).cumsum() for part in (ring, stem)]
    rng, points = np.random.default_rng(seed), []
    for part, length in zip((ring, stem), lengths, strict=True):
        n = round(count * length[-1] / sum(one[-1] for one in lengths))
        places = (np.arange(n) + 0.6 + rng.uniform(-0.25, 0.25, n)) * length[-1] / n
        points.append(np.stack([np.interp(places, length, part[1:, k]) for k in range(2)], axis=1))
    return np.concatenate(points)


def spacing_of(points: np.ndarray) -> float:
    """h: mean distance to the two nearest others."""
    return KDTree(points).query(points, 3)[0][:, 1:].mean()


def bisectors(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (f,2) of samples whose Voronoi cells touch within reach, and the edges (f,2,2) where they do, cut off there
    (`core.voronoi`)."""
    reach = _REACH * spacing_of(points)
    low, high = points.min(axis=0) - 1, points.max(axis=0) + 1
    frame = [(low[0], low[1]), (low[0], high[1]), (high[0], low[1]), (high[0], high[1])]
    diagram = Voronoi(np.concatenate([points, frame]))
    inner = (diagram.ridge_points < len(points)).all(axis=1) & (np.array(diagram.ridge_vertices) >= 0).all(axis=1)
    pairs, ends = diagram.ridge_points[inner], diagram.vertices[np.array(diagram.ridge_vertices)[inner]]
    middle, across = points[pairs].mean(axis=1), np.diff(points[pairs], axis=1)[:, 0]
    half = np.linalg.norm(across, axis=1) / 2
    along = np.stack([-across[:, 1], across[:, 0]], axis=1) / (2 * half)[:, None]
    room = np.sqrt(np.maximum(reach**2 - half**2, 0))[:, None]
    places = np.sort(np.einsum("fed,fd->fe", ends - middle[:, None], along).clip(-room, room), axis=1)
    kept = places[:, 1] > places[:, 0]
    return pairs[kept], (middle[:, None] + places[..., None] * along[:, None])[kept]


def normals(points: np.ndarray, pairs: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Axes (n,2): each the principal one of its neighbours' mirror images in the bisectors, less the directions to them
    (`core.normals.reflection`)."""
    first, second = np.concatenate([pairs, pairs[:, ::-1]]).T
    towards = points[second] - points[first]
    distance = np.linalg.norm(towards, axis=1)
    towards /= distance[:, None]
    weight = np.tile(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1), 2) / distance
    found = np.zeros_like(points)
    for _ in range(_SWEEPS):
        image = found[second] - 2 * np.einsum("fi,fi->f", found[second], towards)[:, None] * towards
        agreement = np.zeros((len(points), 2, 2))
        np.add.at(agreement, first, weight[:, None, None] * (_outer(image) - _outer(towards)))
        found = np.linalg.eigh(agreement)[1][:, :, 1]
    return found


def _outer(vectors):
    return vectors[:, :, None] * vectors[:, None, :]


def nodes(points: np.ndarray, count: int) -> tuple[np.ndarray, float]:
    """A grid (count,count,2) around the points, x first, and its step."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    half = 0.68 * np.ptp(points, axis=0).max()
    line = np.linspace(-half, half, count)
    return middle + np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1), line[1] - line[0]


def diffused(points: np.ndarray, axes: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Unit directions (...,2) away from the curve at `x` (...,2): the axis of the diffused tensor, signed by the
    diffused vector, from the equation's kernels K0 and K1 at t = h^2 (`core.field.diffusion`)."""
    length = spacing_of(points)
    away = x[..., None, :] - points
    r = np.maximum(np.linalg.norm(away, axis=-1), 1e-9)
    decay = np.exp(-(r - r.min(axis=-1, keepdims=True)) / length)
    side = np.einsum("...ni,ni->...n", away, axes) / r
    tensor = np.einsum("...n,nij->...ij", decay * k0e(r / length), _outer(axes))
    vector = np.einsum("...n,ni->...i", decay * k1e(r / length) * side, axes)
    direction = np.linalg.eigh(tensor)[1][..., 1]
    return direction * np.where(np.einsum("...i,...i->...", direction, vector) < 0, -1, 1)[..., None]


def integrated(points: np.ndarray, directions: np.ndarray, x: np.ndarray, step: float) -> np.ndarray:
    """u (count,count) whose slopes are closest to the directions, with u = 0 at the samples: the paper's Poisson
    equation (`core.field.poisson`)."""
    count = len(x)
    slope, same = diags([-1.0, 1.0], [0, 1], (count - 1, count)) / step, eye(count)
    lines = [kron(slope, same), kron(same, slope)]
    wanted = [(directions[1:, :, 0] + directions[:-1, :, 0]) / 2, (directions[:, 1:, 1] + directions[:, :-1, 1]) / 2]
    place = (points - x[0, 0]) / step
    cell, part = place.astype(int), place % 1
    columns = [(cell[:, 0] + a) * count + cell[:, 1] + b for a in (0, 1) for b in (0, 1)]
    shares = [np.abs(1 - a - part[:, 0]) * np.abs(1 - b - part[:, 1]) for a in (0, 1) for b in (0, 1)]
    rows = np.tile(np.arange(len(points)), 4)
    tied = coo_matrix((np.concatenate(shares), (rows, np.concatenate(columns))), (len(points), count**2))
    system = vstack([*lines, _TIED * tied]).tocsr()
    right = np.concatenate([*(one.ravel() for one in wanted), np.zeros(len(points))])
    return spsolve((system.T @ system).tocsc(), system.T @ right).reshape(count, count)


def to_patches(points: np.ndarray, axes: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Distance (...) from `x` (...,2) to the samples' patches, which end where the curve does (`core.field`)."""
    h, tree = spacing_of(points), KDTree(points)
    along = np.stack([-axes[:, 1], axes[:, 0]], axis=1)
    near = tree.query(points, 6)[1][:, 1:]
    place = np.einsum("nki,ni->nk", points[near] - points[:, None], along)
    flat = np.abs(np.einsum("nki,ni->nk", points[near] - points[:, None], axes)) < 0.7 * np.abs(place)
    limits = []
    for sign in (-1, 1):
        ahead = np.where(flat & (sign * place > 0), sign * place, np.inf).min(axis=1)
        limits.append(sign * np.where(ahead > _LONE * h, _RIM * h, 0.6 * np.minimum(ahead, _LONE * h)))
    away = x[..., None, :] - points
    lateral = np.einsum("...ni,ni->...n", away, along)
    off = lateral - lateral.clip(limits[0], limits[1])
    return np.hypot(off, np.einsum("...ni,ni->...n", away, axes)).min(axis=-1)
