"""Heat diffusion of bi-directional normals as the paper prints it: two screened Poisson equations on the grid (section
4.4), the reference for the kernels of :mod:`diffusion`.

Their solutions fall off as exp(-r / sqrt(t)), which sets two limits, measured against the kernels on spheres, tori and
sheets. From half a cell of sqrt(t) on the axes agree within 2 degrees (median over the box); below, the grid's own
directions show. And beyond 33 sqrt(t) the solution drowns in the rounding of its largest value.
"""

import numpy as np
from scipy.fft import dctn, idctn

from ..errors import SettingsError
from ..linalg import laplacian_symbol, outer
from ..progress import Progress
from .diffusion import DIFFUSION_LENGTH, signed_axes
from .grid import CORNERS, Grid

LEAST_LENGTH = 0.5  # cells of sqrt(t)
FARTHEST = 33.0  # sqrt(t); exp(-33) is about 20 times the rounding of float64
_CHUNK = 1 << 16  # nodes


def check_held(spacing: np.ndarray, grid: Grid, farthest: float) -> None:
    """Raise :class:`SettingsError` where the grid or float64 cannot hold the solution, for local spacings (n,) and a
    node `farthest` from the samples."""
    length = _diffusion_length(spacing)
    if farthest > FARTHEST * length:
        raise SettingsError(
            f"the box reaches {farthest / length:.0f} sqrt(t) from the points, and diffusion 'grid' keeps directions "
            f"up to {FARTHEST:g}; set diffusion to kernel, or give fewer points"
        )
    cells = length / grid.spacing
    if cells < LEAST_LENGTH:
        needed = int(np.ceil((max(grid.shape) - 1) * LEAST_LENGTH / cells))
        raise SettingsError(
            f"sqrt(t) is {cells:.2f} cells of the grid, and diffusion 'grid' needs {LEAST_LENGTH:g}; "
            f"use resolution {needed} or more, or set diffusion to kernel"
        )


def grid_axes(points, normals, spacing, grid: Grid, stride: int = 1, progress=None) -> np.ndarray:
    """Y_f at every `stride`-th node, (nx,ny,nz,3) float64 unit vectors; meaningful where :func:`check_held` passes.

    points, normals : (n,3) float64     spacing : (n,) local spacing, whose median gives t

    Solves (1 - t Laplacian) Y = source for the six components of n n^T and the three of the pair of opposite normals,
    taken to its limit, with no flow through the box, by the cosine transform of the seven-point Laplacian. Sources are
    spread over the eight nodes around a sample and weighted by area as the kernels are, which the paper does not do.
    """
    progress = Progress.of(progress)
    node, share, slope = _corners(points, grid)
    area = spacing**2
    tensors = outer(normals) * area[:, None]
    vectors = normals * area[:, None]
    leaning = np.einsum("nca,na->nc", slope, normals)
    sources = [(share, tensors[:, c]) for c in range(6)] + [(leaning, vectors[:, c]) for c in range(3)]
    found = []
    for part, strength in progress.part(0.0, 0.8).each(sources):
        source = np.bincount(node.ravel(), (part * strength[:, None]).ravel(), np.prod(grid.shape))
        solution = _screened_poisson(source.reshape(grid.shape), _diffusion_length(spacing) / grid.spacing)
        found.append(solution[::stride, ::stride, ::stride].copy())
    fused = np.stack(found, axis=-1)
    axes = np.empty((*fused.shape[:3], 3))
    for slab in progress.part(0.8, 1.0).chunks(len(fused), max(1, _CHUNK // fused[0, ..., 0].size)):
        found = signed_axes(*np.split(fused[slab].reshape(-1, 9), [6], axis=1))
        axes[slab] = found.reshape(axes[slab].shape)
    return axes


def _diffusion_length(spacing):
    return DIFFUSION_LENGTH * float(np.median(spacing))


def _corners(points, grid):
    """The eight nodes around each sample (n,8), their trilinear shares (n,8), and the slopes of these by the sample's
    place (n,8,3), per cell."""
    cells = (points - grid.origin) / grid.spacing
    base = np.floor(cells).astype(np.int64)
    inside = (cells - base)[:, None]
    along = np.where(CORNERS == 1, inside, 1 - inside)
    sign = np.where(CORNERS == 1, 1.0, -1.0)
    slopes = [sign[:, a] * along[..., (a + 1) % 3] * along[..., (a + 2) % 3] for a in range(3)]
    node = np.ravel_multi_index(np.moveaxis(base[:, None] + CORNERS, -1, 0), grid.shape)
    return node, along.prod(axis=-1), np.stack(slopes, axis=-1)


def _screened_poisson(source, length):
    """Solution of (1 - length^2 Laplacian) Y = source, (nx,ny,nz), `length` in cells."""
    symbol = 1 + length**2 * laplacian_symbol(source.shape)
    spectrum = dctn(source, workers=-1, overwrite_x=True)
    spectrum /= symbol
    return idctn(spectrum, workers=-1, overwrite_x=True)
