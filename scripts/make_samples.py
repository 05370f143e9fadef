"""Make the bundled samples in tests/data from their sources; the same sources give the same bytes.

    python -m scripts.make_samples

Needs npm (fetches the scan by package name) and the `bpy` wheel (holds the other model). See tests/data/README.md.
"""

import base64
import re
import subprocess
import tarfile
import tempfile
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyElement
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from scripts.render import Camera, evenly_spread_directions, rasterise

DATA = Path(__file__).resolve().parent.parent / "tests" / "data"
SCAN_PACKAGE = "snowden@1.0.1"
BUST_POINTS = 18_000
MASK_POINTS = 5_000
VIEWS, LOWEST_VIEW = 60, -0.1
MASK_BACK = 0.35


def main() -> None:
    vertices, faces, licence = scanned_bust()
    write_ply(DATA / "bust.ply", evenly(outer_skin(vertices, faces), BUST_POINTS))
    (DATA / "bust.LICENSE").write_text(licence)

    vertices, faces = mask()
    write_ply(DATA / "mask_truth.ply", vertices, faces)
    write_ply(DATA / "mask.ply", evenly(on_surface(vertices, faces, 12 * MASK_POINTS), MASK_POINTS))


def scanned_bust() -> tuple[np.ndarray, np.ndarray, str]:
    """Vertices (v,3) and faces (f,3) of the scan at its finer level, Z up and facing -Y, and the package's licence."""
    with tempfile.TemporaryDirectory() as folder:
        archive = subprocess.run(["npm", "pack", SCAN_PACKAGE], cwd=folder, check=True, capture_output=True, text=True)
        with tarfile.open(Path(folder) / archive.stdout.split()[-1]) as package:
            source = package.extractfile("package/hi.js").read().decode()
            licence = package.extractfile("package/LICENSE.md").read().decode()
    positions, cells = (base64.b64decode(text) for text in re.findall(r'Array, "([^"]+)"', source))
    x, y, z = np.frombuffer(positions, "<f4").reshape(-1, 3).T
    return np.stack([x, -z, y], axis=1), np.frombuffer(cells, "<u4").reshape(-1, 3).astype(np.int64), licence


def outer_skin(vertices: np.ndarray, faces: np.ndarray, least: int = 100) -> np.ndarray:
    """The vertices that a scanner walking round the bust could see, in connected parts of at least `least`.

    The file is hollowed for printing: an inner wall runs closer to the outer one than the vertices to each other.
    """
    points = vertices.astype(float)
    seen = np.zeros(len(faces), bool)
    for view in evenly_spread_directions(VIEWS):
        if view[2] > LOWEST_VIEW:
            camera = Camera.facing(points, view, (0, 0, 1), (1200, 1200))
            triangle, _ = rasterise(camera.project(points)[faces], camera.shape)
            seen[triangle[triangle >= 0]] = True
    start, end = faces[seen][:, [0, 1]].ravel(), faces[seen][:, [1, 2]].ravel()
    graph = coo_matrix((np.ones(len(start)), (start, end)), shape=(len(vertices),) * 2)
    _, part = connected_components(graph, directed=False)
    return vertices[np.bincount(part)[part] >= least]


def mask() -> tuple[np.ndarray, np.ndarray]:
    """Blender's monkey, subdivided twice, without the back of its head: an open sheet and two separate eyes."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    monkey = bpy.context.object
    monkey.modifiers.new("smooth", "SUBSURF").levels = 2
    mesh = monkey.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    mesh.calc_loop_triangles()
    vertices = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", vertices.ravel())
    faces = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("vertices", faces.ravel())

    front = faces[vertices[faces, 1].max(axis=1) < MASK_BACK]
    used, compact = np.unique(front, return_inverse=True)
    return vertices[used], compact.reshape(front.shape)


def on_surface(vertices: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """`count` random points of the surface, each part of it as likely as its area, (count,3) float32."""
    rng = np.random.default_rng(0)
    a, b, c = (vertices[faces[:, k]].astype(float) for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = rng.choice(len(faces), count, p=area / area.sum())
    along, across = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    points = (1 - along) * a[chosen] + along * (1 - across) * b[chosen] + along * across * c[chosen]
    return points.astype(np.float32)


def evenly(points: np.ndarray, count: int) -> np.ndarray:
    """`count` of the points, each the farthest from all chosen before it, in random order."""
    chosen = np.zeros(count, np.int64)
    distance = np.full(len(points), np.inf)
    for k in range(1, count):
        distance = np.minimum(distance, ((points - points[chosen[k - 1]]) ** 2).sum(axis=1))
        chosen[k] = distance.argmax()
    return points[np.random.default_rng(0).permutation(chosen)]


def write_ply(path: Path, vertices: np.ndarray, faces: np.ndarray | None = None) -> None:
    table = np.array([tuple(v) for v in vertices], [("x", "<f4"), ("y", "<f4"), ("z", "<f4")])
    elements = [PlyElement.describe(table, "vertex")]
    if faces is not None:
        corners = np.array([(f,) for f in faces.astype(np.int32)], [("vertex_indices", "<i4", (3,))])
        elements.append(PlyElement.describe(corners, "face"))
    PlyData(elements, byte_order="<").write(path)


if __name__ == "__main__":
    main()
