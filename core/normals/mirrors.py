"""Voronoi neighbours as mirrors: what the axis at one sample says about the axis at the other."""

import numpy as np
from scipy import sparse

from ..linalg import outer, principal_axes
from ..progress import Progress
from ..voronoi.facets import Facets

_CLOSEST = 0.25  # local spacings


class Mirrors:
    """The neighbours of every sample, each weighted by facet area / distance, with weights that sum to 1.

    points  : (n,3) float64
    spacing : (n,) float64, local spacing of each sample, units of `points`
    facets  : Facets between them

    Distances below a quarter of a local spacing count as that much. Two samples almost on top of each other would
    otherwise hear little but one another, and any two axes across their direction that mirror each other would stay as
    they are: on 500 points in random places, mean |n.n_true| from random axes was .0026 below that from a plane fit,
    now .0005.
    """

    def __init__(self, points: np.ndarray, spacing: np.ndarray, facets: Facets, progress=None):
        progress = Progress.of(progress)
        progress(0.0)
        self.site, self.other = np.concatenate([facets.pairs, facets.pairs[:, ::-1]]).T
        step = points[self.other] - points[self.site]
        length = np.linalg.norm(step, axis=1)
        nearest = _CLOSEST * 0.5 * (spacing[self.site] + spacing[self.other])
        weight = np.tile(facets.area, 2) / np.maximum(length, nearest)
        total = np.bincount(self.site, weights=weight, minlength=len(points))
        weight /= np.where(total > 0, total, 1.0)[self.site]
        self.direction = step / length[:, None]
        progress(0.5)
        self.gather = sparse.csr_matrix((weight, (self.site, np.arange(len(weight)))), shape=(len(points), len(weight)))
        self.alignment = self.gather @ outer(self.direction)

    def plane_fit(self) -> np.ndarray:
        """(n,3) axes most perpendicular to the directions of the neighbours: a start that needs no axes."""
        return principal_axes(-self.alignment)[0]

    def images(self, normals: np.ndarray) -> np.ndarray:
        """(p,3) mirror images of each neighbour's axis in the bisector plane."""
        axes = normals[self.other]
        return axes - 2 * np.einsum("pi,pi->p", axes, self.direction)[:, None] * self.direction

    def confidence(self, normals: np.ndarray) -> np.ndarray:
        """(n,) in [0,1], mean squared cosine between an axis and the mirror images of its neighbours."""
        cosine = np.einsum("pi,pi->p", normals[self.site], self.images(normals))
        return np.clip(self.gather @ cosine**2, 0.0, 1.0)
