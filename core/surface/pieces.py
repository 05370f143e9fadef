"""Connected pieces of a mesh."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from .mesh import Mesh

_SAMPLE_AT = 1.5  # cells


def pieces_with_samples(mesh: Mesh, samples: KDTree, cell: float) -> Mesh:
    """The mesh without the crumbs that a field may leave between sheets: pieces with no sample within 1.5 cells."""
    touched = samples.query(mesh.vertices, distance_upper_bound=_SAMPLE_AT * cell, workers=-1)[0] < np.inf
    ends = mesh.faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    graph = coo_matrix((np.ones(len(ends), bool), tuple(ends.T)), shape=(len(mesh.vertices),) * 2)
    count, piece = connected_components(graph, directed=False)
    kept = np.bincount(piece, weights=touched, minlength=count)[piece] > 0
    row = np.cumsum(kept) - 1
    return Mesh(mesh.vertices[kept], row[mesh.faces[kept[mesh.faces[:, 0]]]].astype(np.int32))
