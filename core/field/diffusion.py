"""Heat diffusion of bi-directional normals, summed directly.

The paper solves two screened Poisson equations on the grid (section 4.4). In free space their solutions are sums of
Yukawa kernels exp(-r / sqrt(t)) / r over the samples, which a grid coarser than sqrt(t) cannot resolve but a sum over
the nearest samples gives to a fraction of a degree. The smallest distance is taken out of the exponent, so nothing
underflows far from the surface.
"""

import numpy as np

from ..linalg import outer, principal_axes

DIFFUSION_LENGTH = 0.5  # sqrt(t) in local spacings, about the paper's t = h^2


def kernel_weights(distance, spacing) -> tuple[np.ndarray, np.ndarray]:
    """Area-weighted Yukawa kernels of each query's samples, up to a factor per query.

    distance, spacing : (m,k) float64, to the samples (nearest first) and local spacing there
    Returns the weights (m,k) and sqrt(t) of each query, (m,1). The area weight spacing^2 is ours: without it a dense
    region outvotes a sparse one.
    """
    length = DIFFUSION_LENGTH * spacing[:, :1]
    return spacing**2 * np.exp((distance[:, :1] - distance) / length) / distance, length


def fused_axes(weight, length, distance, height, normals) -> np.ndarray:
    """Y_f: the principal axis of the diffused tensor field Y_t, signed by the diffused vector field Y_v, (m,3) float64.

    weight, distance : (m,k)     length : (m,1) sqrt(t)     height : (m,k) signed offset of the query from each sample
    along its normal             normals : (m,k,3)

    The pair of opposite sources at +-eps along a normal is taken to its limit, the kernel's derivative along the
    normal. Neither field depends on the sign of a normal.
    """
    axes, _ = principal_axes(np.einsum("mk,mka->ma", weight, outer(normals)))
    slope = weight * (1 / distance + 1 / length) * height / distance
    direction = np.einsum("mk,mki->mi", slope, normals)
    return axes * np.where(np.einsum("mi,mi->m", axes, direction) < 0, -1.0, 1.0)[:, None]
