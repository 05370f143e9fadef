"""Noise and stray points on clean cases: what each way to a surface makes of them."""

from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec

import numpy as np

from core import Mesh, Reconstruction, Settings, reconstruct
from core.cleaning.noise import noisy_samples
from core.normals.pca import pca_normals
from core.points import local_spacing, prepare_samples
from scripts.render import vertex_normals

from .alternation import alternate
from .cases import Case
from .geometry import closest_points, face_normals, surface_samples
from .metrics import surface_errors, topology
from .peers import PEERS, Clock, poisson
from .processes import Failed, run_fresh
from .starts import smoothed

CASES = ["spot_10k", "cloth_10k", "moebius_5k"]
SHAPE = CASES[0]
NOISE = (0.1, 0.5, 1.0, 1.5)  # per cent of the longest side
MORE, NOISE_OF_MORE = (10_000, 30_000, 100_000), (0.5, 1.0, 2.0)  # points; per cent of the longest side
HALF_NOISE = 0.5
FAINT = [("slab", 0.5, level) for level in (0.05, 0.1, 0.15, 0.2)]  # part, its share of the points, local spacings
FAINT += [("cap", share, 0.4) for share in (0.04, 0.08)]
SLIGHT = (0.01, 0.02, 0.03, 0.05, 0.08)  # local spacings
SHIFTS = (0.05, 0.1, 0.2, 0.3, 0.5)  # local spacings
WALLS = (0.1, 0.2, 0.3, 0.5, 1.0)  # local spacings
STRAYS = (0.0, 0.02, 0.05, 0.2)  # per sample
PCA_NEIGHBOURS = (6, 8, 12, 16, 24, 36, 48, 80)
MARGIN = 1.1  # strays fill the box of the object, this much enlarged

_SHIFTED_BY = np.array([0.33, 0.44, 0.835])  # direction, which no case has for an axis


def noisy(case: Case, percent: float, seed: int = 0) -> np.ndarray:
    """Points (n,3) of the case with Gaussian noise in every coordinate; its deviation is in per cent of their longest
    side."""
    return case.points + np.random.default_rng(seed).normal(size=case.points.shape) * _deviation(case, percent)


def _deviation(case, percent):
    return 0.01 * percent * np.ptp(case.points, axis=0).max()


def strewn(case: Case, share: float, seed: int = 0) -> np.ndarray:
    """Points (m,3), m >= n, of the case followed by `share` times as many uniform in its box."""
    low, high = case.points.min(axis=0), case.points.max(axis=0)
    count = int(share * len(case.points))
    spread = np.random.default_rng(seed).uniform(-0.5, 0.5, (count, 3)) * MARGIN * (high - low)
    return np.vstack([case.points, (low + high) / 2 + spread])


def measure_noise(case: Case, percent: float) -> dict:
    """Distances of the points to the true surface, x1e3, agreement of normals, errors of the surfaces and CPU seconds,
    by way to get there; see `docs/noise.md`. Peers that crash are left out."""
    points = noisy(case, percent)
    peers = {"poisson": _poisson} | ({"jet": _jet} if find_spec("CGAL") else {})
    found = {"ours": _ours(case, points), "alternating": _alternating(case, points)}
    found |= {name: row for name, way in peers.items() if (row := by_peer(way, case, points))}
    agreement = {k: _agreement(pca_normals(points, k)[0], case.normals) for k in PCA_NEIGHBOURS}
    best = max(agreement, key=agreement.get)
    return {
        "case": case.name,
        "points": len(points),
        "percent": percent,
        "deviation": 1e3 * _deviation(case, percent),
        "before": _distance(points, case.truth),
        "pca": {"nc": agreement[best], "k": best},
        **found,
    }


def measure_more(case: Case, count: int, percent: float) -> dict:
    """What becomes of so many points of the true surface with noise: errors and pieces of the surface, distances of the
    points to the true one, x1e3, and what Poisson makes of them."""
    points, face = surface_samples(case.truth, count, np.random.default_rng(count))
    case = replace(case, points=points, normals=face_normals(case.truth)[face])
    points = noisy(case, percent)
    result = reconstruct(points)
    cleaning, peer = result.report["cleaning"], by_peer(_poisson, case, points)
    return {
        "case": case.name,
        "points": count,
        "percent": percent,
        "deviation": 1e3 * _deviation(case, percent),
        "noise": 1e3 * cleaning["noise"],
        "neighbours": cleaning["neighbours"],
        "before": _distance(points, case.truth),
        "after": _distance(result.points, case.truth),
        "pieces": topology(result.surface)["components"],
        "ours": cd_and_hd(result.surface, case.truth),
        **({"poisson": peer} if peer else {}),
    }


def by_peer(way: Callable[..., dict], *arguments) -> dict:
    """What a peer's way finds, in a process of its own; {} where its library crashes there."""
    try:
        return run_fresh(way, *arguments)
    except Failed as error:
        print(f"{way.__name__}: {error}", flush=True)
        return {}


def cd_and_hd(mesh: Mesh, truth: Mesh) -> dict:
    """CD and HD of a mesh, x1e3."""
    errors = surface_errors(mesh, truth)
    return {"cd": errors["cd"], "hd": errors["hd"]}


def half_noisy(case: Case, percent: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,3) of the case with the noise of `noisy` in the half with larger x, and which those are, (n,) bool."""
    half = case.points[:, 0] > np.median(case.points[:, 0])
    return np.where(half[:, None], noisy(case, percent, seed), case.points), half


def measure_half(case: Case, percent: float) -> dict:
    """What is found and made of noise in one half: shares of either half that move, distances of the noisy half to the
    surface, x1e3, and CD, also with no point moved and with all."""
    points, half = half_noisy(case, percent)
    result, none, every = _by_strength(points)
    moved, there = _moved(result, points), half[result.source_index]
    return {
        "case": case.name,
        "percent": percent,
        "found": moved[there].mean(),
        "falsely": moved[~there].mean(),
        "before": _distance(points[half], case.truth),
        "after": _distance(result.points[there], case.truth),
        "cd": cd_and_hd(result.surface, case.truth)["cd"],
        "cd_none": cd_and_hd(none.surface, case.truth)["cd"],
        "cd_every": cd_and_hd(every.surface, case.truth)["cd"],
    }


def share_noisy(case: Case) -> float:
    """Share of the points of a case, as they are, that are taken for noisy."""
    points = prepare_samples(case.points).points
    return float(noisy_samples(points, local_spacing(points)).mean())


def measure_strays(case: Case, share: float) -> dict:
    """Errors of the surface with strays looked for and, for the CD, not; shares of the strays found and of the case's
    own points lost with them; pieces of the surface, and the share of its faces in the largest."""
    points = strewn(case, share)
    result = reconstruct(points, Settings())
    kept = kept_points(result, len(points))
    own = np.arange(len(points)) < len(case.points)
    untreated = reconstruct(points, Settings(outliers=False)) if share else result
    return {
        "case": case.name,
        "share": share,
        "found": 1.0 - kept[~own].mean() if share else None,
        "lost": 1.0 - kept[own].mean(),
        **cd_and_hd(result.surface, case.truth),
        "untreated_cd": cd_and_hd(untreated.surface, case.truth)["cd"],
        "pieces": topology(result.surface)["components"],
    }


def kept_points(result: Reconstruction, count: int) -> np.ndarray:
    """Which of the `count` points given are samples of a run, (count,) bool."""
    kept = np.zeros(count, bool)
    kept[result.source_index] = True
    return kept


def measure_faint(case: Case, part: str, share: float, level: float) -> dict:
    """What it costs to miss faint noise in a part, or noise in a small one. `share` of the points, those with the
    largest x (a "slab") or nearest to the topmost one (a "cap"), get noise of `level` median local spacings. CD as it
    comes out, and with these points alone cleaned; share of them moved."""
    points = case.points
    from_top = np.linalg.norm(points - points[points[:, 2].argmax()], axis=1)
    rank = -points[:, 0] if part == "slab" else from_top
    noisy_there = rank <= np.quantile(rank, share)
    points = np.where(noisy_there[:, None], points + _shift(points, level), points)
    result, every = reconstruct(points), reconstruct(points, Settings(denoise=1, surface="none"))
    best, own = points.copy(), noisy_there[every.source_index]
    best[every.source_index[own]] = every.points[own]
    moved = _moved(result, points)
    return {
        "case": case.name,
        "part": part,
        "share": share,
        "level": level,
        "moved": moved[noisy_there[result.source_index]].mean(),
        "cd": cd_and_hd(result.surface, case.truth)["cd"],
        "cd_best": cd_and_hd(reconstruct(best, Settings(denoise=0)).surface, case.truth)["cd"],
    }


def measure_slight(case: Case, level: float) -> dict:
    """What is made of noise of `level` median local spacings in every point, see :func:`_by_level`."""
    return _by_level(case.name, level, case.points + _shift(case.points, level), case.truth)


def measure_shifted(case: Case, level: float) -> dict:
    """What is made of two scans, each a random half of the points, that are `level` median local spacings apart, see
    :func:`_by_level`; the true surface is halfway."""
    step = level * np.median(local_spacing(case.points)) * _SHIFTED_BY / np.linalg.norm(_SHIFTED_BY)
    second = np.random.default_rng(0).random(len(case.points)) < 0.5
    halfway = replace(case.truth, vertices=case.truth.vertices + 0.5 * step)
    return _by_level(case.name, level, case.points + second[:, None] * step, halfway)


def measure_walls(case: Case, level: float) -> dict:
    """What is made of thin walls, samples of two sheets `level` median local spacings apart along the normals, see
    :func:`_by_level`; both are the true surface."""
    half = 0.5 * level * np.median(local_spacing(case.points))
    sign = np.random.default_rng(0).choice((-1.0, 1.0), len(case.points))
    along, count = vertex_normals(case.truth.vertices, case.truth.faces), len(case.truth.vertices)
    sheets = np.concatenate([case.truth.vertices + step * along for step in (-half, half)])
    truth = Mesh(sheets, np.concatenate([case.truth.faces, case.truth.faces + count]))
    return _by_level(case.name, level, case.points + (half * sign)[:, None] * case.normals, truth)


def _by_level(name, level, points, truth):
    """Share of the points moved, CD and HD, also with no point moved and with all."""
    result, none, every = _by_strength(points)
    return {
        "case": name,
        "level": level,
        "moved": _moved(result, points).mean(),
        "ours": cd_and_hd(result.surface, truth),
        "none": cd_and_hd(none.surface, truth),
        "every": cd_and_hd(every.surface, truth),
    }


def measure_between(case: Case, percent: float) -> dict:
    """CD of the surface with noise of a level that others have published figures for."""
    surface = reconstruct(noisy(case, percent)).surface
    return {"case": case.name, "percent": percent, "cd": cd_and_hd(surface, case.truth)["cd"]}


def _shift(points, level):
    """Noise (n,3) of `level` median local spacings."""
    return np.random.default_rng(0).normal(size=points.shape) * level * np.median(local_spacing(points))


def _by_strength(points):
    """Runs with noisy points moved as by default, none and all."""
    return [reconstruct(points, Settings(denoise=strength)) for strength in ("auto", 0, 1)]


def _moved(result, points):
    """Which of a run's points are not where they were given, (m,) bool."""
    return (result.points != points[result.source_index]).any(axis=1)


def _ours(case, points):
    with Clock() as clock:
        result = reconstruct(points)
    cleaning = result.report["cleaning"]
    return {
        "after": _distance(result.points, case.truth),
        "nc": _agreement(result.normals, case.normals[result.source_index]),
        "noise": 1e3 * cleaning.get("noise", 0.0),
        "neighbours": cleaning.get("neighbours"),
        "cpu": clock.cpu,
        **cd_and_hd(result.surface, case.truth),
    }


def _alternating(case, points):
    """The paper's positions and normals by turns, then the rest of the method with both as they are."""
    with Clock() as clock:
        moved, axes, changes = alternate(points)
        result = reconstruct(moved, Settings(denoise=0, outliers=False), (np.arange(len(moved)), axes))
    return {
        "after": _distance(moved, case.truth),
        "nc": _agreement(axes, case.normals),
        "changes": changes,
        "cpu": clock.cpu,
        **cd_and_hd(result.surface, case.truth),
    }


def _poisson(case, points):
    mesh, axes, clock = poisson(points)
    return {"nc": _agreement(axes, case.normals), "cpu": clock.cpu, **cd_and_hd(mesh, case.truth)}


def _jet(case, points):
    """CGAL's jet smoothing, then its advancing front."""
    with Clock() as clock:
        moved = smoothed(points)
        mesh = PEERS["front"].finish(moved, None)
    return {"after": _distance(moved, case.truth), "cpu": clock.cpu, **cd_and_hd(mesh, case.truth)}


def _distance(points, truth):
    return 1e3 * closest_points(points, truth)[0].mean()


def _agreement(axes, true_normals):
    return np.abs(np.einsum("ni,ni->n", axes, true_normals)).mean()
