"""Surfaces of revolution with exact distances: the hat and the bottle of the field's page."""

from dataclasses import dataclass

import numpy as np

_CHUNK = 4_000_000


@dataclass(frozen=True)
class Revolved:
    """A polyline turned round the z axis.

    profile : (p,2) float64, radius and height along it; the surface is open at an end that is off the axis
    """

    profile: np.ndarray

    def points(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Points (count,3) on the surface, uniform by area."""
        start, end = self.profile[:-1], self.profile[1:]
        area = np.linalg.norm(end - start, axis=1) * (start[:, 0] + end[:, 0])
        chosen = rng.choice(len(area), count, p=area / area.sum())
        first, last = start[chosen], end[chosen]
        # the share s of a cone's side up to radius r grows as r^2
        share, radii = rng.random(count), (first[:, 0], last[:, 0])
        radius = np.sqrt(radii[0] ** 2 + share * (radii[1] ** 2 - radii[0] ** 2))
        sloping = np.abs(radii[1] - radii[0]) > 1e-12
        along = np.where(sloping, (radius - radii[0]) / np.where(sloping, radii[1] - radii[0], 1.0), share)
        radius, height = (first + along[:, None] * (last - first)).T
        turn = rng.uniform(0, 2 * np.pi, count)
        return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)

    def distance(self, x: np.ndarray) -> np.ndarray:
        """Exact distance (m,) of positions (m,3): that to the profile in the half-plane through the axis."""
        flat = np.stack([np.hypot(x[:, 0], x[:, 1]), x[:, 2]], axis=1)
        start, step = self.profile[:-1], np.diff(self.profile, axis=0)
        rows = max(1, _CHUNK // len(start))
        return np.concatenate([_to_segments(flat[i : i + rows], start, step) for i in range(0, len(flat), rows)])


def _to_segments(x, start, step):
    offset = x[:, None] - start
    along = np.einsum("msi,si->ms", offset, step) / np.einsum("si,si->s", step, step)
    return np.linalg.norm(offset - along.clip(0, 1)[..., None] * step, axis=2).min(axis=1)


def hat() -> Revolved:
    """A brim that curls up and a rounded crown; open below."""
    out = np.linspace(1, 0, 40)
    brim = np.stack([0.2 + 0.2 * out, 0.06 * out**2], axis=1)
    return Revolved(_scaled(np.concatenate([brim, _arc((0.0, 0.12), (0.18, 0.1), 0, 90)])))


def bottle() -> Revolved:
    """A round body with a flat bottom, shoulders and a neck with a flat top; closed."""
    foot = _arc((0.1, 0.04), (0.04, 0.04), -90, 0)
    shoulder = _arc((0.05, 0.45), (0.09, 0.12), 0, 90)
    neck = np.array([[0.05, 0.8], [0.0, 0.8]])
    return Revolved(_scaled(np.concatenate([[[0.0, 0.0]], foot, shoulder, neck])))


def _arc(centre, radii, first, last):
    angle = np.radians(np.linspace(first, last, 40))
    return np.array(centre) + np.array(radii) * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _scaled(profile):
    """The longest side 0.8, centred in height, as all cases are."""
    height = np.ptp(profile[:, 1])
    profile = profile - [0, profile[:, 1].min() + height / 2]
    return profile * 0.8 / max(height, 2 * profile[:, 0].max())
