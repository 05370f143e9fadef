"""The paper's alternating optimisation of positions and normals (section 4.3), the reference beside the quadrics.

With axes n_i held fixed, each sample p_i moves to q_i = p_i + s_i t_i n_i, s_i its local spacing, so that on samples
x_k of the bisectors the projection distances F_i(x) = |n_i.(x - q_i)| agree:

    E_offset(t) = lambda_d E_d + lambda_a E_align + lambda_p E_reg,
    E_d         = sum_k w_k |F_i(x_k) - F_j(x_k)|,
    E_align     = sum_i sum_{j in K_i} (n_i.d_ij)^2,    d_ij = (q_j - q_i) / |q_j - q_i|,
    E_reg       = sum_i |q_i - p_i^0|^2 / s_i^2 + sum_i t_i^2,

p^0 being the samples as they came. The moves are then applied, the Voronoi diagram is made anew and the axes are found
again, until these hardly change. The bisectors stand still while the moves are sought.

Departures from the paper: those of `core.normals.energy`; E_reg is a sum in local spacings, as the other terms are, and
so has another weight (of .1, .5 and 1, .5 left a sphere and an animal of 2,000 and 3,000 samples closest to the truth);
L-BFGS instead of Adam, as it needs no rate.
"""

import numpy as np
from scipy.optimize import minimize

from core import Settings, local_spacing
from core.linalg import inner, row_dots
from core.normals.energy import EnergyWeights, NormalEnergy
from core.normals.estimate import estimate_normals
from core.normals.near_cluster import near_cluster
from core.progress import Progress
from core.voronoi.bisectors import BisectorSamples, bisector_samples
from core.voronoi.polygons import facet_polygons

REGULARISATION = 0.5  # lambda_p
SETTLED = 0.3  # mean of the largest tenth of the axes' changes at which the alternation ends
MAX_ROUNDS = 10

_LARGEST = 0.1
_MAX_STEPS = 200


class OffsetEnergy:
    """E_offset of moves along fixed axes, with its gradient.

    points, normals : (n,3) float64, unit axes     spacing : (n,) float64, local spacing, units of `points`
    samples         : BisectorSamples of the facets between the points
    given           : (n,3) float64, the samples as they came
    """

    def __init__(
        self,
        points,
        normals,
        spacing,
        samples: BisectorSamples,
        given,
        weights: EnergyWeights = EnergyWeights(),
        regularisation: float = REGULARISATION,
    ):
        field = NormalEnergy(points, spacing, samples)
        self.weights, self.regularisation = weights, regularisation
        self.site, self.other, self.weight = field.site, field.other, field.weight
        self.height_i = row_dots(normals[self.site], field.from_site)
        self.height_j = row_dots(normals[self.other], field.from_other)
        unit = spacing[samples.facets.pairs].mean(axis=1)[samples.facet]
        self.lift_i, self.lift_j = spacing[self.site] / unit, spacing[self.other] / unit

        owner, near = np.concatenate([samples.facets.pairs, samples.facets.pairs[:, ::-1]]).T
        kept = near_cluster(owner, np.linalg.norm(points[near] - points[owner], axis=1))
        self.owner, self.near = owner[kept], near[kept]
        self.points, self.normals, self.spacing = points, normals, spacing
        self.drift = (points - given) / spacing[:, None]

    def terms(self, moves) -> np.ndarray:
        """(E_d, E_align, E_reg) of moves (n,) in local spacings, before lambda."""
        return self._evaluate(moves)[0]

    def value_and_gradient(self, moves) -> tuple[float, np.ndarray]:
        """E_offset of moves (n,) in local spacings, and its gradient (n,)."""
        terms, gradients = self._evaluate(moves)
        scales = np.array([self.weights.distance, self.weights.alignment, self.regularisation])
        return inner(scales, terms), scales @ gradients

    def _evaluate(self, moves):
        n = len(moves)
        height_i = self.height_i - self.lift_i * moves[self.site]
        height_j = self.height_j - self.lift_j * moves[self.other]
        gap = np.abs(height_i) - np.abs(height_j)
        pull = self.weight * np.sign(gap)
        distance = np.bincount(self.other, pull * np.sign(height_j) * self.lift_j, n)
        distance -= np.bincount(self.site, pull * np.sign(height_i) * self.lift_i, n)

        place = self.points + (self.spacing * moves)[:, None] * self.normals
        step = place[self.near] - place[self.owner]
        length = np.linalg.norm(step, axis=1)
        direction, axis = step / length[:, None], self.normals[self.owner]
        lean = row_dots(axis, direction)
        turn = (2 * lean / length)[:, None] * (axis - lean[:, None] * direction)
        alignment = np.bincount(self.near, row_dots(turn, self.normals[self.near]), n)
        alignment -= np.bincount(self.owner, row_dots(turn, axis), n)

        drift = self.drift + moves[:, None] * self.normals
        regular = 2 * row_dots(drift, self.normals) + 2 * moves
        terms = np.array(
            [inner(self.weight, np.abs(gap)), inner(lean, lean), inner(drift, drift) + inner(moves, moves)]
        )
        return terms, np.stack([distance, self.spacing * alignment, regular])


def alternate(points, settings: Settings = Settings(), progress=None):
    """Positions and axes of noisy samples (n,3) by turns, until the largest tenth of the axes' changes average SETTLED.

    settings.solver : how the axes are found; "energy" is the paper's way
    Returns the moved samples (n,3), their axes (n,3) and the change of the axes in each round.
    """
    progress = Progress.of(progress)
    given, changes = points, []
    normals = _axes(points, settings, progress.part(0.0, 0.1))
    for _, part in progress.part(0.1, 1.0).turns(range(MAX_ROUNDS)):
        points = points + best_moves(points, normals, given, settings.seed, part.part(0.0, 0.5))
        before, normals = normals, _axes(points, settings, part.part(0.5, 1.0))
        changes.append(largest_changes(before, normals))
        if changes[-1] < SETTLED:
            break
    return points, normals, changes


def best_moves(points, normals, given, seed: int = 0, progress=None) -> np.ndarray:
    """(n,3) moves of samples (n,3) along fixed axes (n,3) to the least E_offset."""
    progress = Progress.of(progress)
    spacing = local_spacing(points)
    samples = bisector_samples(facet_polygons(points, spacing, seed), spacing, seed=seed)
    energy = OffsetEnergy(points, normals, spacing, samples, given)
    steps = iter(range(_MAX_STEPS + 1))
    found = minimize(
        energy.value_and_gradient,
        np.zeros(len(points)),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": _MAX_STEPS},
        callback=lambda _: progress(next(steps) / _MAX_STEPS),
    )
    return (spacing * found.x)[:, None] * normals


def largest_changes(before, after) -> float:
    """Mean length of the largest tenth of the differences between axes (n,3), whatever their signs."""
    change = np.sqrt(np.maximum(2 - 2 * np.abs(row_dots(before, after)), 0.0))
    return float(np.sort(change)[-max(1, int(_LARGEST * len(change))) :].mean())


def _axes(points, settings, progress):
    return estimate_normals(points, local_spacing(points), settings, progress=progress)[0]
