"""Bi-directional normals by reflection across the Voronoi bisectors.

On the bisector plane of samples i and j both projection distances of the paper's energy E_d (section 3.3) are linear,
and they agree on the whole plane exactly when each axis is, up to sign, the mirror image of the other:

    n_i = +- H_ij n_j,    H_ij = I - 2 d d^T,    d = (p_j - p_i) / |p_j - p_i|.

This holds on every plane, sphere and circular cylinder section, and it needs no signs. Each sweep sets every axis to
the principal eigenvector of

    A_i = sum_j w_ij [ (H_ij n_j)(H_ij n_j)^T - d d^T ],    w_ij = facet area / |p_j - p_i|,

all sites at once. The term -d d^T is the alignment regulariser with (v.d)^2; the printed (1 - v.d)^2 has a linear part
that pulls axes into the surface wherever neighbours are one-sided. Without a start the first sweep has that term
alone, which is a Voronoi-weighted plane fit.

How that relates to the energy: H_ij takes x - p_j to x - p_i for every x on the bisector, so with m = H_ij n_j

    |F_i - F_j| = | |n_i.(x - p_i)| - |m.(x - p_i)| | <= |x - p_i| sqrt(2 (1 - (n_i.m)^2)).

A fixed point is, axis by axis, a least sum_j w_ij [1 - (n_i.m)^2 + (n_i.d)^2], and E_d on a facet is at most its area
times its reach times the root of twice the first part: the sweeps lower a smooth bound of E_d, and where either can
reach zero (planes, spheres) so does the other. Where none can, the minima differ: E_d forgives a few large misfits
and gets a little lower from a good start, the squares spread them, and measured normals are better for it. The bound
has no kinks, which is why a random start serves the sweeps as well as any and leaves E_d itself far above.
"""

import numpy as np

from ..linalg import outer, principal_axes, row_dots
from ..progress import Progress
from .mirrors import Mirrors

MAX_SWEEPS = 100
TOLERANCE = 5e-4  # mean turn of an axis in a sweep, radians

_FREE_SWEEPS = 20
_INERTIA = 0.25  # after the free sweeps each axis holds on to itself by this share, which ends two-cycles at creases


def reflection_sweeps(mirrors: Mirrors, constraints=None, start=None, progress=None, most: int = MAX_SWEEPS):
    """Axes of samples from their Voronoi neighbours.

    constraints : (indices (k,), axes (k,3) unit) or None; these axes are never updated
    start       : (n,3) unit axes to begin with, or None
    most        : sweeps after which axes that still turn are left at that
    Returns normals (n,3) float64 unit axes of arbitrary sign, and the number of sweeps.
    """
    progress = Progress.of(progress)
    normals = mirrors.plane_fit() if start is None else start.copy()
    fixed, axes = ([], np.empty((0, 3))) if constraints is None else constraints
    normals[fixed] = axes
    for sweep in range(1, most + 1):
        progress(sweep / most)
        turned = sweep_once(mirrors, normals, sweep)
        turned[fixed] = axes
        cosine = np.abs(row_dots(turned, normals))
        normals = turned
        if np.arccos(np.minimum(cosine, 1.0)).mean() < TOLERANCE:
            break
    return normals, sweep


def sweep_once(mirrors: Mirrors, normals: np.ndarray, sweep: int, rows=slice(None)) -> np.ndarray:
    """The axes (n,3) after a sweep, counted from 1; of some `rows` (n,) bool alone where given."""
    inertia = _INERTIA if sweep > _FREE_SWEEPS else 0.0
    tensors = mirrors.agreement(normals) - mirrors.alignment + inertia * outer(normals)
    return principal_axes(tensors[rows])


def sweeps_over(mirrors: Mirrors, normals: np.ndarray, rows: np.ndarray, count: int) -> np.ndarray:
    """The axes (n,3) after so many sweeps over samples `rows` (n,) bool alone."""
    normals, here = normals.copy(), mirrors.at(rows)
    for _ in range(count):
        normals[rows] = sweep_once(here, normals, 1, rows)
    return normals
