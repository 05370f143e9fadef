"""Bi-directional normals by reflection across the Voronoi bisectors.

On the bisector plane of samples i and j both projection distances of the paper's energy E_d (section 3.2) are linear,
and they agree on the whole plane exactly when each axis is, up to sign, the mirror image of the other:

    n_i = +- H_ij n_j,    H_ij = I - 2 d d^T,    d = (p_j - p_i) / |p_j - p_i|.

This holds on every plane, sphere and circular cylinder section, and it needs no signs. Each sweep sets every axis to
the principal eigenvector of

    A_i = sum_j w_ij [ (H_ij n_j)(H_ij n_j)^T - d d^T ],    w_ij = facet area / |p_j - p_i|,

all sites at once. The term -d d^T is the alignment regulariser with (v.d)^2; the printed (1 - v.d)^2 has a linear part
that pulls axes into the surface wherever neighbours are one-sided. Without a start the first sweep has that term
alone, which is a Voronoi-weighted plane fit.
"""

import numpy as np
from scipy import sparse

from ..linalg import outer, principal_axes
from ..progress import Progress
from ..voronoi.facets import Facets

MAX_SWEEPS = 100
TOLERANCE = 5e-4  # mean turn of an axis in a sweep, radians

_FREE_SWEEPS = 20
_INERTIA = 0.25  # after the free sweeps each axis holds on to itself by this share, which ends two-cycles at creases


def reflection_sweeps(points, facets: Facets, constraints=None, start=None, progress=None):
    """Axes and confidence of samples from their Voronoi facets.

    points      : (n,3) float64
    constraints : (indices (k,), axes (k,3) unit) or None; these axes are never updated
    start       : (n,3) unit axes to begin with, or None
    Returns normals (n,3) float64 unit axes of arbitrary sign; confidence (n,) float64 in [0,1], the weighted mean of
    the squared cosine between an axis and the mirror images of its neighbours; and the number of sweeps.
    """
    progress = Progress.of(progress)
    site, other = np.concatenate([facets.pairs, facets.pairs[:, ::-1]]).T
    step = points[other] - points[site]
    length = np.linalg.norm(step, axis=1, keepdims=True)
    d = step / length
    weight = np.tile(facets.area, 2) / length[:, 0]
    total = np.bincount(site, weights=weight, minlength=len(points))
    weight /= np.where(total > 0, total, 1.0)[site]
    gather = sparse.csr_matrix((weight, (site, np.arange(len(site)))), shape=(len(points), len(site)))
    alignment = gather @ outer(d)

    normals = principal_axes(-alignment)[0] if start is None else start.copy()
    fixed, axes = ([], np.empty((0, 3))) if constraints is None else constraints
    normals[fixed] = axes
    for sweep in range(1, MAX_SWEEPS + 1):
        progress(sweep / MAX_SWEEPS)
        agreement = gather @ outer(_mirrored(normals[other], d))
        inertia = _INERTIA if sweep > _FREE_SWEEPS else 0.0
        turned, _ = principal_axes(agreement - alignment + inertia * outer(normals))
        turned[fixed] = axes
        cosine = np.abs(np.einsum("ni,ni->n", turned, normals))
        normals = turned
        if np.arccos(np.minimum(cosine, 1.0)).mean() < TOLERANCE:
            break
    cosines = np.einsum("pi,pi->p", normals[site], _mirrored(normals[other], d))
    confidence = np.clip(gather @ cosines**2, 0.0, 1.0)
    return normals, confidence, sweep


def _mirrored(normals, d):
    return normals - 2 * np.einsum("pi,pi->p", normals, d)[:, None] * d
