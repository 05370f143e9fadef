"""Sheets that meet along lines, which no manifold can."""

import itertools
from collections.abc import Callable

import numpy as np

from core import Mesh

from .panels import line, quad
from .surface import Patch, Surface, from_mesh, from_patches

TURN = 2 * np.pi


def t_junction() -> Surface:
    """A floor and an upright wall on its middle line."""
    left, right = (quad([(x, -1, 0), (x + 1, -1, 0), (x + 1, 1, 0), (x, 1, 0)]) for x in (-1, 0))
    wall = quad([(0, -1, 0), (0, 1, 0), (0, 1, 1), (0, -1, 1)])
    return from_patches([left, right, wall], line((0, -1, 0), (0, 1, 0)))


def toilet_paper() -> Surface:
    """A strip wound three and a quarter times outwards from the tube that it is glued to; its end hangs down."""
    height, core, gap, turns = 1.0, 0.35, 0.16, 3.25

    def tube(uv):
        turn = TURN * uv[:, 0]
        return np.stack([core * np.cos(turn), core * np.sin(turn), height * (uv[:, 1] - 0.5)], axis=1)

    def wound(uv):
        turn = turns * uv[:, 0]
        radius = core + gap * turn
        return np.stack([radius * np.cos(TURN * turn), radius * np.sin(TURN * turn), height * (uv[:, 1] - 0.5)], axis=1)

    end = wound(np.array([[1.0, 0.0], [1.0, 1.0]]))
    along = wound(np.array([[1.0, 0.0]])) - wound(np.array([[1.0 - 1e-6, 0.0]]))
    hang = 0.6 * along / np.linalg.norm(along)
    tail = quad([end[0], end[0] + hang[0], end[1] + hang[0], end[1]], (1, 100))
    glued = line((core, 0, -height / 2), (core, 0, height / 2))
    return from_patches([Patch(tube, (240, 100)), Patch(wound, (1300, 100)), tail], glued)


def paper_plane() -> Surface:
    """Two wings with upturned tips and a keel, all flat; wings and keel meet in one line."""
    nose, tail, keel = [1.2, 0, 0], [-1.2, 0, 0], [-1.05, 0, -0.45]
    sides = [[np.array(p) * [1, side, 1] for p in ([-1.2, 0.7, 0.12], [-1.15, 0.72, 0.4])] for side in (-1, 1)]
    triangles = [[tail, keel, nose]]
    for corner, tip in sides:
        fold = 0.6 * np.array(nose) + 0.4 * corner
        triangles += [[tail, nose, fold], [tail, fold, corner], [fold, corner, tip]]
    return _of_triangles(triangles, line(tail, nose))


def box_axis() -> Surface:
    """The medial axis of a box with half sides a > b > c: a rectangle in its middle plane, and from each of the box's
    edges a sheet at 45 degrees, up to the depth c; three sheets meet along twelve lines."""
    a, b, c = 1.2, 0.8, 0.45
    sides = (-1, 1)
    sheets = [[(-a + c, -b + c, 0), (a - c, -b + c, 0), (a - c, b - c, 0), (-a + c, b - c, 0)]]
    for s, t in itertools.product(sides, sides):
        sheets += [
            [(s * a, -b, t * c), (s * a, b, t * c), (s * (a - c), b - c, 0), (s * (a - c), -b + c, 0)],
            [(-a, s * b, t * c), (a, s * b, t * c), (a - c, s * (b - c), 0), (-a + c, s * (b - c), 0)],
            [(s * a, t * b, -c), (s * a, t * b, c), (s * (a - c), t * (b - c), 0)],
        ]
    triangles = [(p[0], p[k], p[k + 1]) for p in sheets for k in range(1, len(p) - 1)]
    corners = sheets[0]
    inner = [line(p, q) for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    outer = [line((s * a, t * b, u * c), (s * (a - c), t * (b - c), 0)) for s, t, u in itertools.product(*[sides] * 3)]
    return _of_triangles(triangles, np.concatenate([*inner, *outer]))


def candy() -> Surface:
    """A wrapped sweet: a ball, and two pleated fans round circles on it, where three sheets meet."""
    polar = 0.15 * np.pi
    rim, place = np.sin(polar), np.cos(polar)

    def fan(side):
        def position(uv):
            turn, out = TURN * uv[:, 0], uv[:, 1]
            radius = rim * (1 + 0.9 * out**1.3) * (1 + 0.14 * out * np.cos(11 * turn))
            z = place + 0.75 * out + 0.05 * out * np.sin(11 * turn)
            return np.stack([radius * np.cos(turn), radius * np.sin(turn), side * z], axis=1)

        return Patch(position, (600, 90))

    turn = np.linspace(0, TURN, 300)
    rings = [np.stack([rim * np.cos(turn), rim * np.sin(turn), side * place + 0 * turn], 1) for side in (-1, 1)]
    return from_patches([Patch(_ball, (200, 600)), fan(-1), fan(1)], np.concatenate(rings))


def fish() -> Surface:
    """A flat ellipsoid with a tail, a fin on its back and one below: sheets that stand on a closed body."""
    steps = 240

    def body(uv):
        return _ball(uv)[:, [2, 0, 1]] * [1.0, 0.42, 0.2]

    def back(share):
        return np.stack([share, np.zeros_like(share)], axis=1)

    def belly(share):
        return np.stack([share, np.full_like(share, 0.5)], axis=1)

    def fin(meridian, first, last, offset: Callable):
        def position(uv):
            s, t = uv.T
            root = body(meridian((first + (last - first) * s) / steps))
            return root + t[:, None] * offset(s)

        return Patch(position, (last - first, 40)), body(meridian(np.linspace(first, last, 200) / steps))

    def dorsal(s):
        return np.stack([-0.25 * s, 0.12 + 0.22 * np.sin(np.pi * s), np.zeros_like(s)], axis=1)

    def ventral(s):
        return np.stack([-0.2 * s, -0.1 - 0.12 * np.sin(np.pi * s), np.zeros_like(s)], axis=1)

    def tail(sign):
        return lambda s: np.stack([-0.15 - 0.5 * s, sign * (0.02 + 0.4 * s**2), 0.05 * np.sin(4 * s)], axis=1)

    fins = [
        fin(back, 70, 160, dorsal),
        fin(belly, 110, 170, ventral),
        fin(back, 216, 240, tail(1)),
        fin(belly, 216, 240, tail(-1)),
    ]
    return from_patches(
        [Patch(body, (steps, 320)), *(patch for patch, _ in fins)], np.concatenate([c for _, c in fins])
    )


def strawberry() -> Surface:
    """A dimpled fruit with six leaves that stand on a circle round its top."""
    leaves, cells, ring_step, steps = 6, 60, 24, 240

    def fruit(uv):
        polar, turn = np.pi * uv[:, 0], TURN * uv[:, 1]
        dimples = 0.02 * np.sin(7 * polar) * np.cos(8 * turn) * np.sin(polar) ** 3
        width = np.sin(polar) * (0.75 + 0.2 * np.cos(polar)) + dimples
        return np.stack([width * np.cos(turn), width * np.sin(turn), np.cos(polar)], axis=1)

    def leaf(k):
        def position(uv):
            s, t = uv.T
            middle = (k + 0.5) / leaves
            turn = TURN * (middle + (s - 0.5) / leaves * (1 - 0.9 * t**2))
            root = fruit(np.stack([np.full_like(s, ring_step / steps), middle + (s - 0.5) / leaves], axis=1))
            radius = np.hypot(root[:, 0], root[:, 1]) + 0.62 * t
            z = root[:, 2] + 0.22 * np.sin(2.2 * t) - 0.16 * t**2
            return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)

        return Patch(position, (cells, 50))

    turn = np.linspace(0, 1, 400)
    ring = fruit(np.stack([np.full_like(turn, ring_step / steps), turn], axis=1))
    return from_patches([Patch(fruit, (steps, leaves * cells)), *(leaf(k) for k in range(leaves))], ring)


def _of_triangles(triangles, curve):
    """The surface of flat triangles (t,3,3) whose sheets meet along `curve` (k,3)."""
    faces = np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
    return from_mesh(Mesh(np.array(triangles, float).reshape(-1, 3), faces), curve)


def _ball(uv):
    polar, turn = np.pi * uv[:, 0], TURN * uv[:, 1]
    return np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=1)
