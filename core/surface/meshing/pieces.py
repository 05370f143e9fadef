"""Connected pieces of a mesh."""

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from ...parts import connected_parts
from ..mesh import Mesh

_SAMPLE_AT = 1.5  # cells
_FEW, _MANY = 8, 80  # samples
_TINY = 24  # faces
_BESIDE = 24  # vertices around one on a border, about as many as there are within a cell
_LARGE, _EVERY = 10_000, 4  # vertices of a piece from which on every fourth is asked for its sample


def pieces_with_samples(mesh: Mesh, samples: KDTree, cell: float) -> Mesh:
    """The mesh without the crumbs that a field may leave between sheets and in narrow places.

    A piece has the samples nearest to its vertices (of a large one, to every fourth) within 1.5 cells. A crumb has
    none, or fewer than 8 samples or 24 faces, if its samples all lie within 1.5 cells of a piece of 80 or more: what
    else is small stays, since no other piece shows it.
    """
    reach = _SAMPLE_AT * cell
    count, piece = pieces_of(mesh)
    asked = np.flatnonzero((np.bincount(piece)[piece] < _LARGE) | (np.arange(len(piece)) % _EVERY == 0))
    distance, nearest = samples.query(mesh.vertices[asked], distance_upper_bound=reach, workers=-1)
    touched = distance < np.inf
    key = piece[asked[touched]].astype(np.int64) * samples.n + nearest[touched]
    of, sample = np.divmod(np.unique(key), samples.n)
    number = np.bincount(of, minlength=count)
    few = (number < _FEW) | (np.bincount(piece[mesh.faces[:, 0]], minlength=count) < _TINY)
    small = np.flatnonzero(few[of])
    alone = ~_within(samples.data[sample[small]], mesh.vertices[number[piece] >= _MANY], reach)
    kept = ~few | (np.bincount(of[small], alone, count) > 0)
    return _only(mesh, kept[piece])


def without_small_pieces(mesh: Mesh, share: float) -> tuple[Mesh, int]:
    """The mesh without the pieces of less than `share` of its largest piece's area, and how many these were."""
    if share == 0 or not len(mesh.faces):
        return mesh, 0
    count, piece = pieces_of(mesh)
    area = np.bincount(piece[mesh.faces[:, 0]], mesh.face_areas(), count)
    kept = area >= share * area.max()
    return _only(mesh, kept[piece]), int((~kept).sum())


def piece_count(mesh: Mesh) -> int:
    """Number of connected pieces, of a mesh all of whose vertices are in use."""
    return pieces_of(mesh)[0]


def pieces_touch(mesh: Mesh, reach: float) -> bool:
    """Whether a piece ends within `reach` of another one."""
    count, piece = pieces_of(mesh)
    if count == 1:
        return False
    border = np.flatnonzero(mesh.edges.ends_at(mesh.edges.count == 1))
    tree = KDTree(mesh.vertices)
    near = tree.query(mesh.vertices[border], k=_BESIDE, distance_upper_bound=reach, workers=-1)[1]
    piece = np.append(piece, -1)
    return bool(((near < tree.n) & (piece[near] != piece[border, None])).any())


def pieces_of(mesh):
    """How many connected pieces a mesh has, all of whose vertices are in use, and the number of each vertex's, (v,)."""
    piece = connected_parts(*mesh.faces[:, [0, 1, 1, 2]].reshape(-1, 2).T, len(mesh.vertices))
    return int(piece.max(initial=-1)) + 1, piece


def _only(mesh, kept):
    """The pieces of the vertices marked in `kept`, (v,) bool."""
    row = np.cumsum(kept) - 1
    mesh = mesh.of_faces(kept[mesh.faces[:, 0]])
    return replace(mesh, vertices=mesh.vertices[kept], faces=row[mesh.faces].astype(np.int32))


def _within(points, others, reach):
    """Which of a few points (m,3) have one of many others (v,3) within reach, (m,) bool."""
    if not len(points) or not len(others):
        return np.zeros(len(points), bool)
    beside = KDTree(points).query(others, distance_upper_bound=reach, workers=-1)[0] < np.inf
    return KDTree(others[beside]).query(points, distance_upper_bound=reach)[0] < np.inf
