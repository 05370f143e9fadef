"""The single layer of a surface without two sides: from its crossings of the grid's edges."""

from dataclasses import replace

import numpy as np

from ...field.grid import Grid
from ...field.local_surface import LocalSurface
from ...linalg import shortened
from ...lookup import mask_of, numbered, sums_of_each
from ...parts import connected_parts
from ...progress import Progress
from ..edges.crossings import Crossings
from ..mesh import Mesh
from ..meshing.evening import evened
from ..meshing.pieces import pieces_with_samples
from ..meshing.planes import to_planes
from ..meshing.settling import settled
from ..meshing.triangles import mesh_of
from .sharing import shared_vertices

_TOUCH = 0.35  # cells
_STIFFNESS = 0.05  # of vertices where sheets meet


def dual_contour(crossings: Crossings, surface: LocalSurface, grid: Grid, progress=None) -> Mesh:
    """Dual contouring of the zero set (Ju et al., ACM TOG 21(3), 2002), by the grid edges that it crosses.

    Every cell that the surface passes has one vertex, the mean of its crossings, evened and taken to its foot point,
    but one for each sheet where sheets run close (see :mod:`.sharing`); every crossing has one quad, split in two.
    Where sheets meet, vertices are put where the planes of their crossings meet, a cell away at most.
    """
    progress = Progress.of(progress)
    quads, near, meeting = shared_vertices(crossings, grid)
    corner, place = quads.reshape(-1), np.repeat(crossings.place, 4, axis=0)
    vertices = sums_of_each(corner, place, len(near)) / np.bincount(corner, minlength=len(near))[:, None]
    step = to_planes(vertices, corner, place, np.repeat(crossings.normal, 4, axis=0), _STIFFNESS)[near]
    vertices[near] += shortened(step, grid.spacing)
    quads = _once_each(quads, near)
    vertices, free = evened(vertices, quads, near), ~meeting
    step = surface.project(vertices[free], progress.part(0.0, 0.7)).step
    vertices[free] = settled(vertices[free], step, surface, grid.spacing, progress.part(0.7, 1.0))
    mesh = _without_touches(_without_repeats(mesh_of(vertices, quads)), grid.spacing)
    return pieces_with_samples(mesh, surface.tree, grid.spacing)


def _once_each(quads, near):
    """The quads (q,4) but for those with the vertices of another, all `near` a meeting of sheets, (v,) bool: of an edge
    that two sheets cross which share them all, as they do where one ends on the other at a small angle."""
    row = np.flatnonzero(near[quads].all(axis=1))
    _, first = np.unique(quads[row], axis=0, return_index=True)
    return np.delete(quads, np.delete(row, first), axis=0)


def _without_touches(mesh, cell):
    """The mesh with the ends of short edges of more than two faces made one vertex each.

    A sheet that is nearly level with a face of the grid may cross all four of its edges; four quads then touch along
    an edge between two cells whose vertices almost coincide.
    """
    edges, counts = mesh.edge_counts()
    edges = edges[counts > 2]
    length = np.linalg.norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]], axis=1)
    edges = edges[length <= _TOUCH * cell]
    if not len(edges):
        return mesh
    vertex = connected_parts(*edges.T, len(mesh.vertices))
    vertices = sums_of_each(vertex, mesh.vertices) / np.bincount(vertex)[:, None]
    return _without_repeats(replace(mesh, vertices=vertices, faces=vertex[mesh.faces].astype(np.int32)))


def _without_repeats(mesh):
    """The mesh without faces that pass a vertex twice or that it has already."""
    low, middle, high = np.sort(mesh.faces.astype(np.int64), axis=1).T
    proper = np.flatnonzero((low < middle) & (middle < high))
    edge = numbered(low[proper] * len(mesh.vertices) + middle[proper])[1]
    _, first = np.unique(edge * len(mesh.vertices) + high[proper], return_index=True)
    return mesh.of_faces(mask_of(proper[first], len(low)))
