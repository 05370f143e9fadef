"""Points as scanners take them: depth images with flying points at silhouettes, a scene seen from one spot, and a frame
of a depth camera."""

from dataclasses import replace

import numpy as np

from core import Mesh

from .geometry import first_hits

IMAGES = 8
JUMP, SHARE = 3.0, 0.5  # pixels between a silhouette and what is behind it; share of its pixels that see both
EYE = np.array([-0.04, 0.0, 0.0])  # of the scanner in a room: above the table

_AWAY, _WIDER = 3.0, 1.05  # distance of a camera and half the width that it sees, radii of the object
_UP = np.array([0.3, 0.2, 0.93])  # along no camera's axis
_LOWEST, _HIGHEST = -np.pi / 3, np.pi / 2  # elevations that the scanner in a room sees
_FIRST_WIDTH, _FIRST_AROUND = 64, 200  # pixels, steps of a turn
_VIEW, _AHEAD = np.pi / 3, np.array([0.8, 0.55, -0.25])  # across a frame of a depth camera; where it looks
_ROUNDS = 5  # from those towards as many points as asked


def depth_images(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """About `count` points (n,3) of `IMAGES` depth images taken all around, and which of them fly, (n,) bool: of pixels
    at silhouettes before another part of the object a `SHARE` is somewhere between the two."""
    width = _FIRST_WIDTH
    for _ in range(_ROUNDS):
        taken = [_depth_image(mesh, direction, width, rng) for direction in _all_around(IMAGES)]
        points, flying = (np.concatenate(found) for found in zip(*taken, strict=True))
        width = round(width * np.sqrt(count / len(points)))
    return points, flying


def _depth_image(mesh, direction, width, rng):
    centre = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    radius = np.linalg.norm(mesh.vertices - centre, axis=1).max()
    right, aside = _across(direction, _UP)
    steps = radius * _WIDER * (2 * (np.arange(width) + 0.5) / width - 1)
    x, y = (grid.reshape(-1, 1) for grid in np.meshgrid(steps, steps))
    eye = centre + _AWAY * radius * direction
    rays = centre + x * right + y * aside - eye
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    depth = first_hits(eye, rays, mesh).reshape(width, width)
    seen, mixed, flying = np.isfinite(depth), depth.copy(), np.zeros(depth.shape, bool)
    for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
        behind = np.roll(depth, step, axis)
        jump = np.where(np.isfinite(behind), behind, 0.0) - depth
        both = (jump > JUMP * 2 * radius / width) & (rng.random(depth.shape) < SHARE)
        mixed[both] = depth[both] + rng.random(both.sum()) * jump[both]
        flying |= both
    return eye + mixed[seen][:, None] * rays[seen.reshape(-1)], flying[seen]


def _all_around(count):
    """(count,3) unit vectors spread evenly."""
    height, turn = 1 - (2 * np.arange(count) + 1) / count, np.pi * (1 + np.sqrt(5)) * (np.arange(count) + 0.5)
    flat = np.sqrt(1 - height**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)


def seen_from_one_spot(mesh: Mesh, count: int, percent: float, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """About `count` points (n,3) that a scanner at `EYE` sees at equal angles, with Gaussian noise along its rays, its
    deviation in per cent of the longest side, and the same points without noise, (n,3)."""
    around = _FIRST_AROUND
    for _ in range(_ROUNDS):
        up = np.linspace(_LOWEST, _HIGHEST, round(around * (_HIGHEST - _LOWEST) / (2 * np.pi)))
        turn, up = np.meshgrid(2 * np.pi * np.arange(around) / around, up)
        rays = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], axis=-1).reshape(-1, 3)
        depth = first_hits(EYE, rays, mesh)
        rays, depth = rays[np.isfinite(depth)], depth[np.isfinite(depth), None]
        around = round(around * np.sqrt(count / len(rays)))
    deviation = 0.01 * percent * np.ptp(mesh.vertices, axis=0).max()
    return EYE + (depth + deviation * rng.normal(size=depth.shape)) * rays, EYE + depth * rays


def before_camera(mesh: Mesh) -> Mesh:
    """The mesh as a depth camera at `EYE` has it: itself at the origin, what it looks at along the third axis."""
    return replace(mesh, vertices=(mesh.vertices - EYE) @ _camera().T)


def in_room(points: np.ndarray) -> np.ndarray:
    """Points (n,3) of a frame of that camera in the mesh's own place."""
    return points @ _camera() + EYE


def _camera():
    """Unit vectors to the right of the camera, down and ahead, (3,3)."""
    ahead = _AHEAD / np.linalg.norm(_AHEAD)
    return np.stack([*_across(ahead, (0.0, 0.0, 1.0)), ahead])


def _across(direction, up):
    """Two unit vectors at right angles to a unit `direction` and to each other, the first to `up` as well."""
    first = np.cross(direction, up)
    first /= np.linalg.norm(first)
    return first, np.cross(direction, first)


def depth_frame(mesh: Mesh, width: int, step: float, noise: float, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Points (n,3) of a frame, `width` pixels wide, that a depth camera at the origin takes along the third axis, and
    the same points without what it adds to disparity: Gaussian `noise`, in steps, and rounding to whole steps. At the
    middle depth a step is `step` times as far as a pixel is wide."""
    pixel = 2 * np.tan(_VIEW / 2) / width
    x, y = (pixel * (np.arange(count) - (count - 1) / 2) for count in (width, 3 * width // 4))
    x, y = (grid.reshape(-1) for grid in np.meshgrid(x, y))
    rays = np.stack([x, y, np.ones(len(x))], axis=1)
    length = np.linalg.norm(rays, axis=1)
    depth = first_hits(np.zeros(3), rays / length[:, None], mesh) / length
    rays, depth = rays[np.isfinite(depth)], depth[np.isfinite(depth)]
    unit = step * pixel / np.median(depth)
    steps = np.rint(1 / (unit * depth) + noise * rng.normal(size=len(depth)))
    return rays / (unit * steps[:, None]), rays * depth[:, None]
