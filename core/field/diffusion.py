"""Heat diffusion of bi-directional normals, summed directly.

The paper solves two screened Poisson equations on the grid (section 4.4). In free space their solutions are sums of
Yukawa kernels exp(-r / sqrt(t)) / r over the samples, which a grid coarser than sqrt(t) cannot resolve but a sum over
the nearest samples gives to a fraction of a degree. The smallest distance is taken out of the exponent, so nothing
underflows far from the surface.
"""

import numpy as np

from ..linalg import COMPONENTS, principal_axes, row_dots

DIFFUSION_LENGTH = 0.5  # sqrt(t) in local spacings, about the paper's t = h^2


def kernel_weights(distance, spacing, height, length=DIFFUSION_LENGTH) -> tuple[np.ndarray, np.ndarray]:
    """Area-weighted Yukawa kernels of each query's samples, up to a factor per query, and their slopes.

    distance : (m,k) float64, to the samples, nearest first     spacing : (m,k) local spacing there
    height   : (m,k) signed offset of the query from each sample along its normal
    length   : sqrt(t) in local spacings of the nearest sample, about the paper's where not given
    Returns the kernel (m,k) and, relative to it, its derivative along the normal (m,k), both float32. The area weight
    spacing^2 is ours: without it a dense region outvotes a sparse one.
    """
    length = length * spacing[:, :1]
    decay = ((distance[:, :1] - distance) / length).astype(np.float32)
    inverse = (1 / distance).astype(np.float32)
    kernel = spacing.astype(np.float32) ** 2 * np.exp(decay) * inverse
    return kernel, (inverse + (1 / length).astype(np.float32)) * height * inverse


def fused_axes(weight, pull, normals) -> np.ndarray:
    """Y_f: the principal axis of the diffused tensor field Y_t, signed by the diffused vector field Y_v, (m,3) float64.

    weight, pull : (m,k) kernels and their slopes along the normals, relative to them     normals : (3,m,k)

    The pair of opposite sources at +-eps along a normal is taken to its limit, the kernel's derivative along the
    normal. Neither field depends on the sign of a normal.
    """
    weighted = weight * normals
    tensor = [row_dots(weighted[a], normals[b]) for a, b in COMPONENTS]
    return signed_axes(np.stack(tensor, axis=1).astype(np.float64), np.einsum("imk,mk->mi", weighted, pull))


def signed_axes(tensors: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """The principal axes of tensors (m,6), signed by vectors (m,3), (m,3)."""
    axes = principal_axes(tensors)
    return axes * np.where(row_dots(axes, vectors) < 0, -1.0, 1.0)[:, None]
