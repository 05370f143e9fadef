"""The paper's normal energy on samples of the Voronoi bisectors (sections 3.3 and 4.2).

With F_i(x) = |n_i.(x - p_i)|, grad F_i(x) = sign(n_i.(x - p_i)) n_i, x_k the samples of the facets between i and j, w_k
their weights and d the unit vector from a sample to a neighbour,

    E_d     = sum_k w_k |F_i(x_k) - F_j(x_k)|,
    E_g     = sum_k w_k ||grad F_i(x_k) - grad F_j(x_k)||,
    E_align = sum_i sum_{j in K_i} (n_i.d_ij)^2,
    E       = lambda_d E_d + lambda_g E_g + lambda_a E_align.

Departures from the paper, each measured:

- E_align. Printed is (1 - n.d)^2, which changes with the sign of an axis and whose linear part -2 n.d pulls axes into
  the surface wherever neighbours are one-sided. `printed_alignment` brings it back for comparison.
- Units. Lengths are in local spacings s of the pair instead of the cloud's mean h, so that sparse and dense parts
  count alike and scaling the points changes nothing; and w is the sample's share of the facet's area over s |p_j - p_i|
  instead of h^2, so that a close neighbour counts for more than a far one.
- Weights. The printed (1, 1e-3, 1e2) weigh unclipped areas in other units. Of ten sets, (1, .1, .5) left the least
  1 - |n.n_true| on twelve shapes of 500 to 5000 samples; lambda_g = .3 leaves 5 % more, 1 leaves 30 % more.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..linalg import inner, row_dots
from ..voronoi.bisectors import BisectorSamples
from .near_cluster import near_cluster


@dataclass(frozen=True)
class EnergyWeights:
    """lambda_d, lambda_g and lambda_a."""

    distance: float = 1.0
    gradient: float = 0.1
    alignment: float = 0.5


class NormalEnergy:
    """E of axes at given points, with analytic gradients.

    points  : (n,3) float64
    spacing : (n,) float64, local spacing of each sample, units of `points`
    samples : BisectorSamples of their facets

    The signs of axes do not matter unless `printed_alignment` is asked for.

    Example
    -------
    >>> import numpy as np
    >>> from core.points import local_spacing
    >>> from core.voronoi.bisectors import bisector_samples
    >>> from core.voronoi.polygons import facet_polygons
    >>> plane = np.random.default_rng(0).random((100, 3)) * [1, 1, 0]
    >>> spacing = local_spacing(plane)
    >>> energy = NormalEnergy(plane, spacing, bisector_samples(facet_polygons(plane, spacing), spacing))
    >>> bool(energy.value_and_gradient(np.tile([0.0, 0.0, 1.0], (100, 1)))[0] < 1e-9)
    True
    """

    def __init__(self, points, spacing, samples: BisectorSamples, weights=EnergyWeights(), printed_alignment=False):
        pairs = samples.facets.pairs
        step = points[pairs[:, 1]] - points[pairs[:, 0]]
        length = np.linalg.norm(step, axis=1)
        unit = spacing[pairs].mean(axis=1)[samples.facet]
        self.weights, self.printed_alignment = weights, printed_alignment

        self.site, self.other = pairs[samples.facet].T
        self.from_site = (samples.positions - points[self.site]) / unit[:, None]
        self.from_other = (samples.positions - points[self.other]) / unit[:, None]
        self.weight = samples.weight / (unit * length[samples.facet])

        owner = pairs.T.ravel()
        near = near_cluster(owner, np.tile(length, 2))
        self.owner = owner[near]
        self.direction = (np.concatenate([step, -step]) / np.tile(length, 2)[:, None])[near]

        self._to_site = _scatter(self.site, len(points))
        self._to_other = _scatter(self.other, len(points))
        self._to_owner = _scatter(self.owner, len(points))

    def terms(self, normals) -> np.ndarray:
        """(E_d, E_g, E_align) of unit axes (n,3), before lambda."""
        return self._evaluate(normals)[0]

    def value_and_gradient(self, normals) -> tuple[float, np.ndarray]:
        """E of unit axes (n,3), and its gradient (n,3) with respect to their components."""
        terms, gradients = self._evaluate(normals)
        return inner(self.scales, terms), np.einsum("t,tni->ni", self.scales, gradients)

    @property
    def scales(self) -> np.ndarray:
        return np.array([self.weights.distance, self.weights.gradient, self.weights.alignment], np.float64)

    def _evaluate(self, normals):
        n_i, n_j, w = normals[self.site], normals[self.other], self.weight
        height_i, height_j = row_dots(n_i, self.from_site), row_dots(n_j, self.from_other)
        side_i, side_j = np.sign(height_i), np.sign(height_j)

        gap = np.abs(height_i) - np.abs(height_j)
        pull = w * np.sign(gap)
        distance = self._to_site @ ((pull * side_i)[:, None] * self.from_site)
        distance -= self._to_other @ ((pull * side_j)[:, None] * self.from_other)

        turn = side_i[:, None] * n_i - side_j[:, None] * n_j
        size = np.linalg.norm(turn, axis=1)
        pull = (w / np.where(size > 0, size, 1.0))[:, None] * turn
        gradient = self._to_site @ (side_i[:, None] * pull) - self._to_other @ (side_j[:, None] * pull)

        deviation = row_dots(normals[self.owner], self.direction) - (1.0 if self.printed_alignment else 0.0)
        alignment = self._to_owner @ (2 * deviation[:, None] * self.direction)
        terms = np.array([inner(w, np.abs(gap)), inner(w, size), inner(deviation, deviation)])
        return terms, np.stack([distance, gradient, alignment])


def _scatter(index, n):
    return sparse.csr_matrix((np.ones(len(index)), (index, np.arange(len(index)))), shape=(n, len(index)))
