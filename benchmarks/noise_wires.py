"""Wireframes with stray points among them: how many of either are dropped."""

import numpy as np

from core.cleaning.outliers import find_outliers
from core.points import prepare_samples

from .noise_measure import MARGIN

SHARES = (0.0, 0.02, 0.05, 0.2)
CLUSTERED = 0.05  # share of strays that come in clouds
RUNS = 3

_CLOUD, _SPREAD = 10, 0.01  # strays in a cloud, its standard deviation over the longest side


def _along(ends: np.ndarray, counts, rng) -> np.ndarray:
    """Random points on segments with ends (s,2,3), `counts` on each."""
    ends = np.repeat(ends, counts, axis=0)
    return ends[:, 0] + rng.random((len(ends), 1)) * (ends[:, 1] - ends[:, 0])


def _edges(corners: np.ndarray) -> np.ndarray:
    """(e,2,3) shortest segments between corners (v,3) of a regular body."""
    length = np.linalg.norm(corners[:, None] - corners, axis=2)
    a, b = np.nonzero(np.triu(length < 1.01 * length[length > 0].min(), 1))
    return np.stack([corners[a], corners[b]], axis=1)


_BOX = _edges(np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), -1).reshape(-1, 3))


def _box(rng, count=1000):
    return _along(_BOX, [count // 12] * 12, rng)


def _graded_box(rng):
    return _along(_BOX, [225, 25] * 6, rng)


def _crossed_box(rng):
    return np.vstack([_box(rng), np.linspace([0.05, 0.05, 0.05], [0.95, 0.95, 0.95], 20)])


def _icosahedron(rng):
    golden = (1 + 5**0.5) / 2
    thirds = [(0.0, a, b * golden) for a in (-1, 1) for b in (-1, 1)]
    edges = _edges(np.array([np.roll(corner, turn) for corner in thirds for turn in range(3)]))
    return _along(edges, [50] * len(edges), rng)


def _circles(rng):
    angle, turns = 2 * np.pi * rng.random((6, 170, 1)), np.linalg.qr(rng.normal(size=(6, 3, 3)))[0]
    return (np.cos(angle) * turns[:, None, 0] + np.sin(angle) * turns[:, None, 1]).reshape(-1, 3)


def _knot(rng):
    t = 2 * np.pi * rng.random(500)
    return np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1)


def _helix(rng):
    t = 6 * np.pi * rng.random(600)
    return np.stack([np.cos(t), np.sin(t), t / 8], axis=1)


def _noisy_box(rng):
    return _box(rng) + rng.normal(size=(996, 3)) * 0.003


def _mace(rng):
    ball, way = rng.normal(size=(4000, 3)), rng.normal(size=(8, 3))
    ball, way = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (ball, way))
    return np.vstack([ball, _along(np.stack([way, 2 * way], axis=1), [40] * 8, rng)])


WIRES = {
    "edges of a box, 1,000 points": _box,
    "the same, 300 points": lambda rng: _box(rng, 300),
    "the same, 9 times denser on half of them": _graded_box,
    "the same, noise of 0.3 %": _noisy_box,
    "the same, with a sparse wire across": _crossed_box,
    "edges of an icosahedron, 1,500": _icosahedron,
    "six great circles, 1,020": _circles,
    "a helix, 600": _helix,
    "a trefoil knot, 500": _knot,
    "a ball of 4,000 with eight spikes of 40": _mace,
}


def measure(name: str) -> dict:
    """For each share of strays (those in clouds last) the shares of the strays found and of the wires' points lost."""
    given = [(share, False) for share in SHARES] + [(CLUSTERED, True)]
    return {"wires": name, "runs": [_tried(WIRES[name], share, clouds) for share, clouds in given]}


def _tried(make, share, clouds):
    found, lost = [], []
    for seed in range(RUNS):
        rng = np.random.default_rng(seed)
        points = make(rng)
        dropped = find_outliers(prepare_samples(np.vstack([points, _strays(points, share, clouds, rng)])).points)
        lost.append(dropped[: len(points)])
        found.append(dropped[len(points) :])
    found, lost = np.concatenate(found), np.concatenate(lost)
    return {
        "share": share,
        "clouds": clouds,
        "found": float(found.mean()) if len(found) else None,
        "lost": float(lost.mean()),
    }


def _strays(points, share, clouds, rng):
    low, high = points.min(axis=0), points.max(axis=0)
    count, side = int(share * len(points)), (high - low).max()
    places = (low + high) / 2 + rng.uniform(-0.5, 0.5, (count // _CLOUD if clouds else count, 3)) * MARGIN * (
        high - low
    )
    if not clouds:
        return places
    return np.repeat(places, _CLOUD, axis=0) + rng.normal(size=(_CLOUD * len(places), 3)) * _SPREAD * side
