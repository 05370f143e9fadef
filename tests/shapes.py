"""Closed-form shapes for tests, with exact distances, and what is asked of meshes.

Samplers return (n,3) float64 points and are deterministic. They spread points evenly, as a thinned scan does;
`scattered_sphere` is uniform at random.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from core import Mesh

GOLDEN = (np.sqrt(5) - 1) / 2


def lattice(n: int) -> np.ndarray:
    """(n,2) points spread evenly over the unit square (a Fibonacci lattice)."""
    i = np.arange(n)
    return np.stack([(i + 0.5) / n, (i * GOLDEN) % 1.0], axis=1)


def sphere(n: int, radius: float = 1.0) -> np.ndarray:
    z, turn = lattice(n).T
    return _around(np.sqrt(1 - (1 - 2 * z) ** 2), turn, 1 - 2 * z) * radius


def scattered_sphere(n: int, seed: int = 0) -> np.ndarray:
    points = np.random.default_rng(seed).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def hemisphere(n: int) -> np.ndarray:
    """The upper half of the unit sphere, open below."""
    z, turn = lattice(n).T
    return _around(np.sqrt(1 - z**2), turn, z)


def disc(n: int, radius: float = 1.0) -> np.ndarray:
    """In the plane z = 0."""
    area, turn = lattice(n).T
    return _around(np.sqrt(area), turn, np.zeros(n)) * radius


def square(n: int, side: float = 2.0) -> np.ndarray:
    """Centred in the plane z = 0."""
    return np.column_stack([(lattice(n) - 0.5) * side, np.zeros(n)])


def holed_square(n: int, radius: float, side: float = 2.0) -> np.ndarray:
    """A square of about n points (before the hole is cut) with a round hole in its middle."""
    points = square(n, side)
    return points[np.hypot(points[:, 0], points[:, 1]) > radius]


def cylinder(n: int, height: float = 2.0) -> np.ndarray:
    """Radius 1 round the z axis, open at both ends."""
    z, turn = lattice(n).T
    return _around(np.ones(n), turn, (z - 0.5) * height)


def torus(n: int, major: float = 1.0, minor: float = 0.4) -> np.ndarray:
    """Round the z axis; the tube's angle is drawn so that area is sampled evenly."""
    share, turn = lattice(n).T
    angle = np.linspace(0, 2 * np.pi, 4097)
    tube = np.interp(share, (angle + minor / major * np.sin(angle)) / (2 * np.pi), angle)
    return _around(major + minor * np.cos(tube), turn, minor * np.sin(tube))


def moebius(n: int, width: float = 0.6) -> np.ndarray:
    """A band of half a twist round the unit circle."""
    across, turn = lattice(n).T
    offset, angle = (across - 0.5) * width, 2 * np.pi * turn
    return _around(1 + offset * np.cos(angle / 2), turn, offset * np.sin(angle / 2))


def cube(n: int) -> np.ndarray:
    """The six faces of [-1, 1]^3."""
    face = square(n // 6)
    return np.concatenate(
        [np.roll(face + np.array([0, 0, side]), axis, axis=1) for axis in range(3) for side in (-1, 1)]
    )


def junction(n: int) -> np.ndarray:
    """Three unit sheets that meet along the y axis: one horizontal sheet, x in [-1, 1], and a vertical one on top."""
    flat = square(2 * n // 3)
    upright = lattice(n - len(flat))
    return np.concatenate([flat, np.column_stack([np.zeros(len(upright)), 2 * upright[:, 0] - 1, upright[:, 1]])])


def sheets(n: int, gap: float) -> np.ndarray:
    """Two parallel squares of side 2, `gap` apart in z."""
    half = np.array([0, 0, gap / 2])
    return np.concatenate([square(n // 2) - half, square(n // 2)[:, [1, 0, 2]] + half])


def scattered_tube(n: int, wall: float) -> np.ndarray:
    """Random samples of a closed tube of outer radius .5 and height 1 with walls so thick, turned at random."""
    rng = np.random.default_rng(0)
    areas = np.array([1.0, 2 * (0.5 - wall), *[0.5**2 - (0.5 - wall) ** 2] * 2])
    face, turn, across = rng.choice(4, n, p=areas / areas.sum()), *rng.random((2, n))
    out = np.choose(face, [0.5, 0.5 - wall, *[np.sqrt((0.5 - wall) ** 2 + across * areas[2])] * 2])
    return _around(out, turn, np.choose(face, [across, across, 0, 1])) @ random_rotation(1).T


def scattered_rectangles(corners, n: int, seed: int = 0) -> np.ndarray:
    """About n random points, even over rectangles parallel to the axes, each given by its `corners` (low, high)."""
    rng, sides = np.random.default_rng(seed), [np.subtract(high, low) for low, high in corners]
    areas = np.array([side[side > 0].prod() for side in sides])
    count = np.ceil(n * areas / areas.sum()).astype(int)
    return np.concatenate([rng.uniform(*each, (m, 3)) for each, m in zip(corners, count, strict=True)])


def scattered_box(n: int, size) -> np.ndarray:
    """About n random points, even over a box of that size (3,)."""
    ends = np.diag(size)
    lower = [(np.zeros(3), size - end) for end in ends]
    return scattered_rectangles([*lower, *((end, np.array(size)) for end in ends)], n)


def cut_box(direction, step: float, between: float, size=(1.0, 0.8, 0.6)) -> tuple[np.ndarray, np.ndarray]:
    """Where planes at right angles to a direction, `between` apart, cut the faces of the box [0, size], samples `step`
    apart, and the normals there."""
    rng, direction, size = np.random.default_rng(0), np.divide(direction, np.linalg.norm(direction)), np.array(size)
    points, normals = [], []
    for axis, side in np.ndindex(3, 2):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        slope = direction[[u, v]]
        if not slope.any():
            continue
        face, steep = side * size[axis] * direction[axis], np.linalg.norm(slope)
        place = (np.arange(-2, 2, between) + 0.37 * between - face) / steep**2
        along = np.arange(-2, 2, step) + step * rng.random((len(place), 1))
        on = place[:, None, None] * slope + along[..., None] * [-slope[1] / steep, slope[0] / steep]
        on = on[((on > 0) & (on < size[[u, v]])).all(axis=2)]
        points.append(np.full((len(on), 3), side * size[axis]))
        points[-1][:, [u, v]] = on
        normals.append(np.broadcast_to(np.eye(3)[axis], (len(on), 3)))
    return np.concatenate(points), np.concatenate(normals)


def sphere_distance(x: np.ndarray, radius: float = 1.0) -> np.ndarray:
    return np.abs(np.linalg.norm(x, axis=1) - radius)


def hemisphere_distance(x: np.ndarray) -> np.ndarray:
    """To the upper unit half sphere: below its rim the rim's circle is nearest."""
    lateral = np.hypot(x[:, 0], x[:, 1])
    return np.where(x[:, 2] >= 0, sphere_distance(x), np.hypot(lateral - 1, x[:, 2]))


def disc_distance(x: np.ndarray, radius: float = 1.0) -> np.ndarray:
    lateral = np.hypot(x[:, 0], x[:, 1])
    return np.hypot(np.maximum(lateral - radius, 0), x[:, 2])


def cylinder_distance(x: np.ndarray, height: float = 2.0) -> np.ndarray:
    lateral = np.hypot(x[:, 0], x[:, 1])
    return np.hypot(lateral - 1, np.maximum(np.abs(x[:, 2]) - height / 2, 0))


def torus_distance(x: np.ndarray, major: float = 1.0, minor: float = 0.4) -> np.ndarray:
    return np.abs(np.hypot(np.hypot(x[:, 0], x[:, 1]) - major, x[:, 2]) - minor)


def square_distance(x: np.ndarray, side: float = 2.0) -> np.ndarray:
    return np.linalg.norm(np.column_stack([np.maximum(np.abs(x[:, :2]) - side / 2, 0), x[:, 2]]), axis=1)


def node_positions(field) -> np.ndarray:
    """(nodes,3) positions of a DistanceField's values in C order."""
    return field.origin + field.spacing * np.indices(field.values.shape).reshape(3, -1).T


def random_rotation(seed: int) -> np.ndarray:
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


def components(mesh: Mesh) -> list[Mesh]:
    """The connected pieces of a mesh, largest first, vertices renumbered."""
    edges, _ = mesh.edge_counts()
    n = len(mesh.vertices)
    _, label = connected_components(coo_matrix((np.ones(len(edges)), edges.T), shape=(n, n)), directed=False)
    pieces = []
    for piece in np.unique(label[mesh.faces[:, 0]]):
        used, faces = np.unique(mesh.faces[label[mesh.faces[:, 0]] == piece], return_inverse=True)
        pieces.append(Mesh(mesh.vertices[used], faces.reshape(-1, 3).astype(np.int32)))
    return sorted(pieces, key=lambda piece: -len(piece.faces))


def euler(mesh: Mesh) -> int:
    """Vertices minus edges plus faces."""
    return len(mesh.vertices) - len(mesh.edge_counts()[0]) + len(mesh.faces)


def signed_volume(mesh: Mesh) -> float:
    """Enclosed volume, positive where faces are wound outward."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("fi,fi->f", a, np.cross(b, c)).sum() / 6)


def _around(radius, turn, z):
    angle = 2 * np.pi * turn
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
