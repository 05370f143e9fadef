"""An indoor scene as a scanner sees it: no ceiling, no undersides on the floor, walls of no thickness."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from .panels import box, line, quad
from .surface import Patch, Surface, from_patches

TURN = 2 * np.pi
_WIDE, _DEEP, _HIGH = 5.0, 4.0, 2.5


def room() -> Surface:
    """Floor, three walls (one with a doorway), table and four chairs, shelf, sofa, cupboard, lamp; metres."""
    chairs = [(1.2, 1.05, 1), (1.2, 2.4, -1), (2.1, 1.05, 1), (2.1, 2.4, -1)]
    furniture = [
        *_table((0.9, 1.3), (2.6, 2.4), 0.75),
        *(patch for x, y, front in chairs for patch in _chair(x, y, front)),
        *_shelf((3.4, 3.6), (4.8, 3.97), 1.9, 5),
        *box((4.05, 0.6, 0), (4.9, 2.6, 0.42), ["bottom"]),
        *box((4.7, 0.6, 0.42), (4.9, 2.6, 0.85), ["bottom"]),
        *box((4.05, 0.4, 0), (4.9, 0.6, 0.6), ["bottom"]),
        *box((4.05, 2.6, 0), (4.9, 2.8, 0.6), ["bottom"]),
        *box((0.05, 3.3, 0), (0.65, 3.95, 1.2), ["bottom"]),
        *_lamp((3.1, 3.0), 1.6),
    ]
    edges = [
        line((0, _DEEP, 0), (_WIDE, _DEEP, 0)),
        line((0, 0, 0), (0, _DEEP, 0)),
        line((_WIDE, 0, 0), (_WIDE, _DEEP, 0)),
    ]
    return from_patches([*_shell(), *furniture], np.concatenate(edges))


def _shell():
    """Floor, left and right wall, back wall round a doorway from x = 1.2 to 2.1, 2 high."""
    x = [0.0, 1.2, 2.1, _WIDE]
    floor = [quad([(a, 0, 0), (b, 0, 0), (b, _DEEP, 0), (a, _DEEP, 0)]) for a, b in pairwise(x)]
    walls = [quad([(w, 0, 0), (w, _DEEP, 0), (w, _DEEP, 2), (w, 0, 2)]) for w in (0, _WIDE)]
    walls += [quad([(w, 0, 2), (w, _DEEP, 2), (w, _DEEP, _HIGH), (w, 0, _HIGH)]) for w in (0, _WIDE)]
    back = [_upright(x[0], x[1], 0, 2), _upright(x[2], x[3], 0, 2)]
    back += [_upright(a, b, 2, _HIGH) for a, b in pairwise(x)]
    return floor + walls + back


def _upright(left, right, low, high):
    return quad([(left, _DEEP, low), (right, _DEEP, low), (right, _DEEP, high), (left, _DEEP, high)])


def _table(low: Sequence[float], high: Sequence[float], height) -> list[Patch]:
    (x0, y0), (x1, y1), leg = low, high, 0.07
    corners = [(x, y) for x in (x0, x1 - leg) for y in (y0, y1 - leg)]
    legs = [p for x, y in corners for p in box((x, y, 0), (x + leg, y + leg, height - 0.04), ["bottom", "top"])]
    return [*box((x0, y0, height - 0.04), (x1, y1, height)), *legs]


def _chair(x, y, front) -> list[Patch]:
    size, seat, back = 0.42, 0.45, 0.9
    behind = (y - 0.03, y) if front > 0 else (y + size, y + size + 0.03)
    rest = box((x, behind[0], seat), (x + size, behind[1], back))
    return [*_table((x, y), (x + size, y + size), seat), *rest]


def _shelf(low, high, height, boards) -> list[Patch]:
    """Two sides, a back and boards between them, all without thickness."""
    (x0, y0), (x1, y1) = low, high
    levels = np.linspace(0.1, height, boards)
    sides = [quad([(x, y0, 0), (x, y1, 0), (x, y1, height), (x, y0, height)]) for x in (x0, x1)]
    back = quad([(x0, y1, 0), (x1, y1, 0), (x1, y1, height), (x0, y1, height)])
    return [*sides, back, *(quad([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]) for z in levels)]


def _lamp(at, height) -> list[Patch]:
    """A thin stem with a cone of a shade, open above and below."""
    x, y = at

    def ring(radius, z):
        def position(uv):
            turn, t = TURN * uv[:, 0], uv[:, 1]
            r = radius[0] + (radius[1] - radius[0]) * t
            return np.stack([x + r * np.cos(turn), y + r * np.sin(turn), z[0] + (z[1] - z[0]) * t], axis=1)

        return Patch(position, (96, 12))

    return [ring((0.03, 0.03), (0, height)), ring((0.3, 0.16), (height - 0.1, height + 0.3))]
