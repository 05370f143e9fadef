"""The paper's integration: a Poisson equation for the distance, given its gradient (section 4.5)."""

import numpy as np
from scipy.fft import dctn, idctn
from scipy.ndimage import map_coordinates

from ..linalg import conjugate_gradients, laplacian_symbol
from ..progress import Progress
from .grid import Grid
from .grid_diffusion import check_held, grid_axes
from .local_surface import LocalSurface

_STRIDE = 2  # the far field is solved on every second node
_ANCHOR = 50.0  # weight of a known distance, per squared cell
_TOLERANCE = 1e-4  # of the residual, relative
_MAX_ITERATIONS = 200


def poisson(
    surface: LocalSurface, grid: Grid, known: np.ndarray, diffusion: str = "kernel", progress=None
) -> np.ndarray:
    """Distance at every node, float32 of the grid's shape, from the distances `known` near the surface (NaN elsewhere).

    Minimises the squared difference between the slope of u along every edge of the grid of every second node and the
    fused directions Y_f there, with u held softly at the known distances, by conjugate gradients preconditioned with
    the cosine transform of the Laplacian. Departs from the paper in the anchor: u = 0 at points off the grid alone is
    slow to solve and no more accurate. At none of those nodes is the distance more than that to the nearest sample.

    diffusion : where the directions come from. "kernel": projections onto the surface, which ends at rims; "grid": the
    paper's diffusion on the grid of all nodes, which knows no rims

    Raises :class:`SettingsError` where that grid or float64 cannot hold the diffusion.
    """
    progress = Progress.of(progress)
    shape = grid.shape
    known = np.pad(known, [(0, (1 - nodes) % _STRIDE) for nodes in shape], constant_values=np.nan)
    grid = Grid(grid.origin, grid.spacing, known.shape)  # up to a coarse node on every side
    known = known[::_STRIDE, ::_STRIDE, ::_STRIDE]
    coarse = Grid(grid.origin, _STRIDE * grid.spacing, known.shape)
    nodes = coarse.positions(np.arange(known.size))
    farthest, _ = surface.tree.query(nodes, workers=-1)
    if diffusion == "grid":
        start = farthest
        check_held(surface.spacing, grid, start.max())
        samples = surface.points, surface.normals, surface.spacing
        direction = grid_axes(*samples, grid, _STRIDE, progress.part(0.0, 0.5))
    else:
        found = surface.project(nodes, progress.part(0.0, 0.5))
        start, direction = found.distance, found.direction
    direction = direction.reshape(*known.shape, 3) * coarse.spacing

    anchor = np.where(np.isnan(known), 0.0, _ANCHOR)
    right = anchor * np.nan_to_num(known) - _divergence(direction)
    solution = _solve(anchor, right, start.reshape(known.shape), progress.part(0.5, 1.0))
    solution = np.clip(solution, 0, farthest.reshape(known.shape))
    at = np.indices(shape, np.float32) / _STRIDE
    return map_coordinates(solution, at, order=1, mode="nearest", output=np.float32)


def _divergence(field):
    """Sum over the edges at each node of the field's mean along the edge, outwards positive, (nx,ny,nz)."""
    total = np.zeros(field.shape[:3])
    for axis in range(3):
        along = np.moveaxis(field[..., axis], axis, 0)
        flow = 0.5 * (along[1:] + along[:-1])
        out = np.moveaxis(total, axis, 0)
        out[:-1] += flow
        out[1:] -= flow
    return total


def _laplacian(u):
    """Negative Laplacian of the grid's graph (no flow through the box), (nx,ny,nz)."""
    total = np.zeros_like(u)
    for axis in range(3):
        drop = np.diff(u, axis=axis)
        out, drop = np.moveaxis(total, axis, 0), np.moveaxis(drop, axis, 0)
        out[:-1] -= drop
        out[1:] += drop
    return total


def _solve(anchor, right, start, progress):
    """Conjugate gradients on (Laplacian + anchor) u = right."""
    symbol, free = laplacian_symbol(right.shape) + anchor.mean(), anchor == 0

    def precondition(residual):
        smooth = idctn(dctn(free * residual, norm="ortho", workers=-1) / symbol, norm="ortho", workers=-1)
        return np.where(free, smooth, residual / (6 + anchor))

    steps = progress.each(range(_MAX_ITERATIONS))
    return conjugate_gradients(lambda u: _laplacian(u) + anchor * u, right, start, precondition, _TOLERANCE, steps)
