"""How good the axes of each way to find them are, on points with true normals."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import igl
import numpy as np
from scipy import sparse

from core import Mesh
from core.cleaning.clean import clean
from core.linalg import outer, principal_axes
from core.normals.adam import MAX_STEPS, minimise
from core.normals.energy import EnergyWeights, NormalEnergy
from core.normals.estimate import estimate_normals, swept_normals
from core.normals.mirrors import Mirrors
from core.normals.pca import pca_normals
from core.normals.reflection import reflection_sweeps, sweep_once
from core.points import local_spacing, prepare_samples
from core.voronoi.bisectors import bisector_samples
from core.voronoi.polygons import facet_polygons

from .cases import Case, load_case
from .geometry import closest_faces, face_normals, surface_points
from .metrics import normal_agreement
from .peers import check_open3d

PCA_NEIGHBOURS = range(6, 25)
CLOSER_NEIGHBOURS = range(3, 6)
PEER_NEIGHBOURS = 30
DENSITIES = 3_000, 10_000
ABLATION_STEPS = 100
CURVE_STEPS = 150
CURVE_SWEEPS = 40

PRINTED = EnergyWeights(distance=1, gradient=1e-3, alignment=1e2)
_FACTORS = [(1, 1, 1), (1, 1, 10), (1, 1, 0.1), (1, 10, 1), (1, 0.1, 1), (10, 1, 1), (0.1, 1, 1)]

_DENSE, _FEW, _SOME = 20_000, 500, 10_000
_NOISE = 0.005  # of the longest side
_CONTRAST = 30  # between the densest and the thinnest end of the non-uniform input


@dataclass(frozen=True)
class Problem:
    """Points of a case, what the solvers need of them, and their true normals.

    points : (n,3) float64, unit frame     normals : (n,3) float64, true     given : (n,3) float64, the case's frame
    """

    points: np.ndarray
    normals: np.ndarray
    given: np.ndarray
    nm_curve: np.ndarray

    @classmethod
    def of(cls, points, normals, nm_curve=np.empty((0, 3))):
        samples = prepare_samples(points)
        return cls(samples.points, normals[samples.source_index], samples.given, nm_curve)

    @cached_property
    def spacing(self):
        return local_spacing(self.points)

    @cached_property
    def samples(self):
        return bisector_samples(facet_polygons(self.points, self.spacing), self.spacing)

    @cached_property
    def mirrors(self):
        return Mirrors(self.points, self.spacing, self.samples.facets)

    def energy(self, weights=EnergyWeights(), printed_alignment=False) -> NormalEnergy:
        return NormalEnergy(self.points, self.spacing, self.samples, weights, printed_alignment)

    def sweeps(self, start=None) -> np.ndarray:
        return swept_normals(self.points, self.spacing, self.mirrors, start=start)[0]

    def adam(self, energy: NormalEnergy, start=None, max_steps=MAX_STEPS) -> np.ndarray:
        """Axes of least energy from the plane fit, or from `start`."""
        start = self.mirrors.plane_fit() if start is None else start
        return minimise(energy.value_and_gradient, start, max_steps=max_steps)[0]

    def random_start(self) -> np.ndarray:
        """Uniform unit axes, the paper's start."""
        axes = np.random.default_rng(0).normal(size=self.points.shape)
        return axes / np.linalg.norm(axes, axis=1, keepdims=True)

    def agreement(self, axes: np.ndarray) -> dict:
        return normal_agreement(axes, self.normals, self.given, self.nm_curve)


def case_quality(path: Path, sampling: str) -> dict:
    """Agreement of every method on one case, and what the page derives from it.

    closer_pca  : the best PCA over fewer neighbours than `pca` may take
    error_ratio : 1 - NC of the sweeps over that of the best PCA
    faceting    : 1 - NC of the true surface's `rounded_normals` over that of the best PCA
    start_gap   : |NC of the sweeps from random axes - NC of the sweeps from the plane fit|
    distance_ratio : E_d of the sweeps over E_d of Adam
    cleaned     : agreement of the sweeps after the pipeline's cleaning, for noisy cases only
    """
    case = load_case(path, sampling)
    problem = Problem.of(case.points, case.normals, case.nm_curve)
    energy = problem.energy()
    swept, descended = problem.sweeps(), problem.adam(energy)
    found = {
        "sweeps": problem.agreement(swept),
        "pca": best_pca(problem),
        "open3d": problem.agreement(open3d_normals(problem.points)),
        "adam": problem.agreement(descended),
        "printed": problem.agreement(problem.adam(problem.energy(PRINTED, True), problem.random_start())),
    }
    random = problem.agreement(problem.sweeps(problem.random_start()))
    rounded = problem.agreement(rounded_normals(case.truth, problem.given))
    return {
        "case": case.name,
        "category": case.meta["category"],
        "points": len(problem.points),
        **found,
        "closer_pca": best_pca(problem, CLOSER_NEIGHBOURS),
        "error_ratio": (1 - found["sweeps"]["nc"]) / (1 - found["pca"]["nc"]),
        "faceting": (1 - rounded["nc"]) / (1 - found["pca"]["nc"]),
        "start_gap": abs(random["nc"] - found["sweeps"]["nc"]),
        "distance_ratio": energy.terms(swept)[0] / energy.terms(descended)[0],
        "cleaned": _cleaned(case) if case.meta["category"] == "noisy" else None,
    }


def best_pca(problem: Problem, neighbours=PCA_NEIGHBOURS) -> dict:
    """Agreement of the plane fit whose number of neighbours, `k`, serves these points best by mean agreement."""
    tried = [{**problem.agreement(pca_normals(problem.points, k)[0]), "k": k} for k in neighbours]
    return max(tried, key=lambda found: found["nc"])


def open3d_normals(points: np.ndarray) -> np.ndarray:
    """(n,3) axes of Open3D's plane fit over PEER_NEIGHBOURS. Raises :class:`MissingDependency`."""
    check_open3d()
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(PEER_NEIGHBOURS))
    return np.asarray(cloud.normals)


def _cleaned(case):
    samples, _ = clean(prepare_samples(case.points))
    spacing = local_spacing(samples.points)
    axes, _, _ = estimate_normals(samples.points, spacing)
    rows = samples.source_index
    return normal_agreement(axes, case.normals[rows], case.points[rows], case.nm_curve)


def rounded_normals(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Axes (n,3) at points (n,3) on a mesh as if it stood for a smooth surface: those of its vertices, interpolated.

    A vertex has the axis closest to those of its faces, weighted by area; no consistent winding is needed.
    """
    flat, (_, face) = face_normals(mesh), closest_faces(points, mesh)
    corner = sparse.csr_matrix((mesh.face_areas().repeat(3), (mesh.faces.ravel(), np.arange(len(flat)).repeat(3))))
    at_vertex = principal_axes(corner @ outer(flat))[mesh.faces[face]]
    side = np.einsum("nki,ni->nk", at_vertex, flat[face])
    corners = np.ascontiguousarray(mesh.vertices[mesh.faces[face]].transpose(1, 0, 2))
    share = igl.barycentric_coordinates(points, *corners)
    axes = np.einsum("nk,nki->ni", share * np.sign(side), at_vertex)
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def ablation(case: Case) -> list[dict]:
    """NC for the paper's seven combinations of weights, at DENSITIES points of the case's true surface.

    Each is tried twice: as multiples of the printed weights and as the same multiples of the defaults, with
    ABLATION_STEPS steps of Adam each.
    """
    rows = []
    for count in DENSITIES:
        problem = surface_problem(case, count)
        row = {"points": count, "sweeps": problem.agreement(problem.sweeps())["nc"]}
        for name, base in (("printed", PRINTED), ("default", EnergyWeights())):
            found = [problem.adam(problem.energy(w), max_steps=ABLATION_STEPS) for w in combinations(base)]
            row[name] = [problem.agreement(axes)["nc"] for axes in found]
        rows.append(row)
    return rows


def combinations(base: EnergyWeights) -> list[EnergyWeights]:
    """The paper's seven variations, around `base`."""
    return [EnergyWeights(d * base.distance, g * base.gradient, a * base.alignment) for a, d, g in _FACTORS]


def surface_problem(case: Case, count: int) -> Problem:
    """`count` points of the true surface, uniform by area."""
    return _on_surface(case, surface_points(case.truth, count, np.random.default_rng(0)))


def convergence(case: Case) -> dict:
    """For each kind of input: its number of points, the energy before each of the first steps of Adam relative to the
    first, the mean turn of an axis in each of the first sweeps, degrees, and the number of sweeps until they end. Both
    start from random axes, as the paper does."""
    curves = {}
    for name, problem in _inputs(case).items():
        _, history = minimise(problem.energy().value_and_gradient, problem.random_start(), max_steps=CURVE_STEPS)
        turns = mean_turns(problem.mirrors, problem.random_start(), CURVE_SWEEPS)
        _, sweeps = reflection_sweeps(problem.mirrors, start=problem.random_start())
        energy = np.divide(history, history[0])
        curves[name] = {"points": len(problem.points), "energy": energy, "turns": turns, "sweeps": sweeps}
    return curves


def mean_turns(mirrors: Mirrors, axes: np.ndarray, sweeps: int) -> list[float]:
    """Mean angle between the axes (n,3) before and after each sweep, degrees; at most the first CURVE_SWEEPS."""
    turns = []
    for sweep in range(1, sweeps + 1):
        turned = sweep_once(mirrors, axes, sweep)
        cosine = np.abs(np.einsum("ni,ni->n", turned, axes))
        turns.append(float(np.degrees(np.arccos(np.minimum(cosine, 1.0)).mean())))
        axes = turned
    return turns


def _inputs(case):
    rng = np.random.default_rng(0)
    dense = surface_points(case.truth, 5 * _SOME, rng)
    along = (dense - dense.min(axis=0)) / np.ptp(dense, axis=0).max()
    density = _CONTRAST ** -along[:, np.ptp(along, axis=0).argmax()]
    thinned = dense[rng.choice(len(dense), _SOME, replace=False, p=density / density.sum())]
    sigma = _NOISE * np.ptp(case.truth.vertices, axis=0).max()
    return {
        "dense": _on_surface(case, dense[:_DENSE]),
        "uniform": Problem.of(case.points, case.normals),
        "non-uniform": _on_surface(case, thinned),
        "sparse": _on_surface(case, dense[:_FEW]),
        "noisy": _on_surface(case, dense[:_SOME] + sigma * rng.normal(size=(_SOME, 3))),
    }


def _on_surface(case, points):
    """The points, with the normals of the true faces nearest to them."""
    _, nearest = closest_faces(points, case.truth)
    return Problem.of(points, face_normals(case.truth)[nearest.ravel()])
