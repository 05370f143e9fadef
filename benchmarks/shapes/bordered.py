"""Surfaces with borders."""

import numpy as np

from .surface import Patch, Surface, from_patches

TURN = 2 * np.pi


def hemisphere() -> Surface:
    def position(uv):
        polar, turn = 0.5 * np.pi * uv[:, 0], TURN * uv[:, 1]
        return np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=1)

    return from_patches([Patch(position, (150, 600))])


def cloth() -> Surface:
    """A square cloth hung over a round table: flat in the middle, ever deeper folds towards the hem."""

    def position(uv):
        x, y = 2 * uv.T - 1
        out = np.hypot(x, y)
        past = np.log1p(np.exp(14 * (out - 0.45))) / 14  # how far past the table's edge, with a round bend
        turn = np.arctan2(y, x)
        reach = (out - 0.75 * past) * (1 + 0.25 * past * np.cos(9 * turn))
        shrink = reach / np.maximum(out, 1e-12)
        return np.stack([x * shrink, y * shrink, -0.85 * past + 0.06 * past * np.sin(5 * turn)], axis=1)

    return from_patches([Patch(position, (420, 420))])


def relief() -> Surface:
    """Hills on hills: waves of seeded directions, five octaves, each half as long and .42 as high as the one before."""
    rng = np.random.default_rng(7)
    turns, shifts = TURN * rng.random((2, 5, 4))
    octaves = np.arange(5)[:, None]
    fx, fy = (1.3 * 2.0**octaves * np.pi * trig(turns) for trig in (np.cos, np.sin))
    heights = np.broadcast_to(0.11 * 0.42**octaves, turns.shape)

    def position(uv):
        x, y = 2 * uv.T - 1
        z = (heights.ravel() * np.cos(np.outer(x, fx) + np.outer(y, fy) + shifts.ravel())).sum(axis=1)
        return np.stack([x, y, z], axis=1)

    return from_patches([Patch(position, (560, 560))])


def petals() -> Surface:
    """Five separate cupped petals round a middle."""

    def petal(turn):
        def position(uv):
            across, out = 2 * uv[:, 0] - 1, uv[:, 1]
            width = 0.12 + 0.5 * np.sin(np.pi * out**0.8 * 0.93) * np.sqrt(0.05 + out)
            y, x = across * width * 0.75, 0.18 + out
            z = 0.5 * out**1.5 + 0.25 * across**2 * width + 0.02 * np.sin(3 * np.pi * across) * out
            return np.stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), z], axis=1)

        return Patch(position, (150, 200))

    return from_patches([petal(TURN * k / 5) for k in range(5)])


def spiral() -> Surface:
    """A helicoid of two turns round an empty core."""

    def position(uv):
        out, turn = 0.25 + 0.75 * uv[:, 0], 2 * TURN * uv[:, 1]
        return np.stack([out * np.cos(turn), out * np.sin(turn), 0.1 * turn], axis=1)

    return from_patches([Patch(position, (120, 700))])


def curtain() -> Surface:
    """A curtain drawn aside: twelve layers folded to and fro, 1/57 of its height apart, the folds half circles."""
    layers, depth, apart = 12, 0.0625, 0.0175
    fold = 0.5 * np.pi * apart

    def position(uv):
        way = uv[:, 0] * (layers * (depth + fold) - fold)
        layer = np.clip(way // (depth + fold), 0, layers - 1)
        at = way - layer * (depth + fold)
        turn = np.maximum(at - depth, 0) / (0.5 * apart)
        out = np.minimum(at, depth) + 0.5 * apart * np.sin(turn)
        along = layer * apart + 0.5 * apart * (1 - np.cos(turn))
        return np.stack([np.where(layer % 2 == 0, out, depth - out), along, uv[:, 1]], axis=1)

    return from_patches([Patch(position, (1000, 120))])
