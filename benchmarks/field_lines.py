"""u along a straight line through a hat and a bottle whose distance is known in closed form."""

import numpy as np

from core import DistanceField, reconstruct

from .field_baselines import nearest_sample
from .field_quality import FIELD
from .revolved import Revolved, bottle, hat

POINTS = 5_000
PLACES = 401  # on the line
_ENDS = {"hat": ((-0.48, 0.03, 0.03), (0.48, 0.03, 0.03)), "bottle": ((-0.2, 0.03, -0.46), (0.2, 0.03, 0.46))}


def lines() -> tuple[dict, dict]:
    """Numbers and what the plot needs, by shape.

    Numbers: places along the line (distance from its start), u and the true d there, the distance to the nearest
    sample, and how far u is off (x1e3: mean, largest) on the line and on the plane y = .03, which holds the line.
    """
    found = {name: _line(shape, *np.array(_ENDS[name])) for name, shape in (("hat", hat()), ("bottle", bottle()))}
    return {name: one[0] for name, one in found.items()}, {name: one[1] for name, one in found.items()}


def _line(shape: Revolved, start, end):
    points = shape.points(POINTS, np.random.default_rng(0))
    field = reconstruct(points, FIELD).field
    share = np.linspace(0, 1, PLACES)
    x = start + share[:, None] * (end - start)
    u, true = field.sample(x), shape.distance(x)
    nodes = cut_nodes(field, 1, start[1])
    seen, exact = field.sample(nodes.reshape(-1, 3)), shape.distance(nodes.reshape(-1, 3))
    curves = {"place": share * np.linalg.norm(end - start), "u": u, "d": true, "nearest": nearest_sample(points, x)}
    numbers = {
        **{name: np.round(curve, 6) for name, curve in curves.items()},
        "cell": field.spacing,
        "line": _off(u, true),
        "plane": _off(seen, exact),
    }
    cut = {"u": seen.reshape(nodes.shape[:2]), "d": exact.reshape(nodes.shape[:2])}
    return numbers, {"nodes": nodes, **cut, "ends": np.array([start, end])}


def _off(u, true):
    off = 1e3 * np.abs(u - true)
    return {"mean": off.mean(), "max": off.max()}


def cut_nodes(field: DistanceField, axis: int, place: float) -> np.ndarray:
    """Positions (a,b,3) of two nodes a cell on the plane where coordinate `axis` is `place`; the other two run along
    the first two dimensions, in order."""
    sides = [
        np.array([place]) if k == axis else field.origin[k] + field.spacing * np.arange(0, n - 0.5, 0.5)
        for k, n in enumerate(field.values.shape)
    ]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).squeeze(axis)
