"""Closed surfaces, and surfaces of high genus."""

import numpy as np

from .panels import box
from .surface import Patch, Surface, from_implicit, from_patches

TURN = 2 * np.pi


def torus() -> Surface:
    """Radii 1 and 0.4."""

    def position(uv):
        u, v = TURN * uv.T
        ring = 1 + 0.4 * np.cos(v)
        return np.stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)], axis=1)

    return from_patches([Patch(position, (700, 280))])


def bumps() -> Surface:
    """A ball with five ribs and rings: radius 1 + .2 sin^5(t) cos(5p) + .06 cos(9t) at polar angle t and turn p."""

    def position(uv):
        turn, polar = TURN * uv[:, 1], np.pi * uv[:, 0]
        radius = 1 + 0.2 * np.sin(polar) ** 5 * np.cos(5 * turn) + 0.06 * np.cos(9 * polar)
        return _polar(radius, uv)

    return from_patches([Patch(position, (400, 700))])


def knot() -> Surface:
    """A tube of radius 0.35 along a trefoil, turned about its Frenet frame."""

    def along(t):
        ring = 2 + np.cos(3 * t)
        return np.stack([ring * np.cos(2 * t), ring * np.sin(2 * t), np.sin(3 * t)], axis=1)

    def position(uv):
        t, turn = TURN * uv.T
        step = 1e-3
        before, here, after = along(t - step), along(t), along(t + step)
        tangent, bend = after - before, after - 2 * here + before
        across = np.cross(tangent, bend)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        inward = np.cross(across, tangent)
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        return here + 0.35 * (np.cos(turn)[:, None] * inward + np.sin(turn)[:, None] * across)

    return from_patches([Patch(position, (1400, 100))])


def horned() -> Surface:
    """A ball with a horn at either pole, whose outer half is thinner than a cell of 128 along the longest side: radius
    1 + 1.2 exp(-50 sin t) at polar angle t."""

    def position(uv):
        u = uv[:, 0]
        polar = u - 0.9 * np.sin(TURN * u) / TURN  # close together at the poles
        return _polar(1 + 1.2 * np.exp(-50 * np.abs(np.sin(np.pi * polar))), np.stack([polar, uv[:, 1]], axis=1))

    return from_patches([Patch(position, (1200, 160))])


def cube() -> Surface:
    """Sharp edges and corners."""
    return from_patches(box((-1, -1, -1), (1, 1, 1)))


def rounded_box() -> Surface:
    """x^8 + y^8 + z^8 = 1."""
    return from_implicit(lambda x: (x**8).sum(axis=1) - 1, 1.2, 200)


def tangle() -> Surface:
    """Genus 5: the sum over x, y, z of x^4 - 5 x^2 is -11.8."""
    return from_implicit(lambda x: (x**4 - 5 * x**2).sum(axis=1) + 11.8, 3.0, 220)


def gyroid() -> Surface:
    """One and a half periods of the gyroid, cut open by a cube."""

    def value(x):
        return (np.sin(x) * np.cos(np.roll(x, -1, axis=1))).sum(axis=1)

    return from_implicit(value, 1.5 * np.pi, 220)


def _polar(radius, uv):
    polar, turn = np.pi * uv[:, 0], TURN * uv[:, 1]
    direction = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=1)
    return radius[:, None] * direction
