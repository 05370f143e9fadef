"""Surfaces that have one side only."""

import numpy as np

from .surface import Patch, Surface, from_patches, with_crossings

TURN = 2 * np.pi


def moebius() -> Surface:
    """A band of half a twist."""

    def position(uv):
        turn, across = TURN * uv[:, 0], 0.6 * (uv[:, 1] - 0.5)
        ring = 1 + across * np.cos(turn / 2)
        return np.stack([ring * np.cos(turn), ring * np.sin(turn), across * np.sin(turn / 2)], axis=1)

    return from_patches([Patch(position, (800, 80))])


def klein() -> Surface:
    """A figure eight carried round a circle with half a twist; it crosses itself along that circle."""

    def position(uv):
        turn, v = TURN * uv.T
        eight, wave = np.sin(v), np.sin(2 * v)
        ring = 2 + np.cos(turn / 2) * eight - np.sin(turn / 2) * wave
        height = np.sin(turn / 2) * eight + np.cos(turn / 2) * wave
        return np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)

    # Half a cell aside, so that no vertices lie on the circle of crossing, where two would be taken for one.
    aside, turn = np.array([0, 0.5 / 300]), np.linspace(0, TURN, 1000)
    return from_patches(
        [Patch(lambda uv: position(uv + aside), (800, 300))],
        np.stack([2 * np.cos(turn), 2 * np.sin(turn), np.zeros(1000)], axis=1),
    )


def boy() -> Surface:
    """Boy's surface, a projective plane with a triple point (the immersion of R. Bryant and R. Kusner)."""

    def position(uv):
        w = uv[:, 0] * np.exp(1j * TURN * uv[:, 1])
        below = w**6 + np.sqrt(5) * w**3 - 1
        g = np.stack(
            [
                -1.5 * (w * (1 - w**4) / below).imag,
                -1.5 * (w * (1 + w**4) / below).real,
                ((1 + w**6) / below).imag - 0.5,
            ],
            axis=1,
        )
        return g / (g**2).sum(axis=1, keepdims=True)

    return with_crossings(from_patches([Patch(position, (301, 1000))]))
