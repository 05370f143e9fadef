"""The cases that `python -m benchmarks.make_cases` makes, each from a surface in closed form or a bundled mesh."""

import json
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core import Mesh
from core.io.atomic import atomic_path

from .sampling import blue_noise, contours, graded, pierced, uniform, wires
from .shapes import bordered, closed, junctions, one_sided, rooms
from .shapes.surface import Surface, from_mesh

_MASK = Path(__file__).resolve().parent.parent / "tests" / "data" / "mask_truth.ply"


@dataclass(frozen=True)
class Recipe:
    """A case to make.

    category : what it stands for     surface : makes it     count : number of points
    take     : how points are taken; where it is `uniform` the case has a blue-noise sampling too
    noise    : standard deviation of Gaussian noise, in per cent of the longest side
    strays   : points thrown into the box of the object, a tenth larger, for each sample
    quick    : whether it belongs to the small set of `make bench`
    """

    category: str
    surface: Callable[[], Surface]
    count: int
    take: Callable = uniform
    noise: float = 0.0
    strays: float = 0.0
    quick: bool = False


def bundled_mask() -> Surface:
    """The front of Blender's monkey, an open sheet with eye holes, and its two eyes."""
    from plyfile import PlyData

    ply = PlyData.read(_MASK)
    vertices = np.stack([ply["vertex"][axis] for axis in "xyz"], axis=1).astype(float)
    return from_mesh(Mesh(vertices, np.stack(ply["face"]["vertex_indices"]).astype(np.int32)))


CASES = {
    "knot_1k": Recipe("watertight", closed.knot, 1_000, quick=True),
    "torus_5k": Recipe("watertight", closed.torus, 5_000),
    "cube_5k": Recipe("watertight", closed.cube, 5_000, quick=True),
    "box_10k": Recipe("watertight", closed.rounded_box, 10_000),
    "bumps_10k": Recipe("watertight", closed.bumps, 10_000, quick=True),
    "knot_10k": Recipe("watertight", closed.knot, 10_000),
    "horned_10k": Recipe("watertight", closed.horned, 10_000),
    "bumps_100k": Recipe("watertight", closed.bumps, 100_000),
    "hemisphere_2k": Recipe("open", bordered.hemisphere, 2_000),
    "mask_5k": Recipe("open", bundled_mask, 5_000),
    "cloth_10k": Recipe("open", bordered.cloth, 10_000, quick=True),
    "petals_10k": Recipe("open", bordered.petals, 10_000),
    "spiral_5k": Recipe("open", bordered.spiral, 5_000),
    "relief_20k": Recipe("open", bordered.relief, 20_000),
    "curtain_20k": Recipe("open", bordered.curtain, 20_000),
    "paperplane_1k": Recipe("non-manifold", junctions.paper_plane, 1_000),
    "strawberry_1k": Recipe("non-manifold", junctions.strawberry, 1_000),
    "fish_3k": Recipe("non-manifold", junctions.fish, 3_000),
    "tjunction_5k": Recipe("non-manifold", junctions.t_junction, 5_000, quick=True),
    "candy_10k": Recipe("non-manifold", junctions.candy, 10_000),
    "toiletpaper_10k": Recipe("non-manifold", junctions.toilet_paper, 10_000, quick=True),
    "box_axis_10k": Recipe("medial axis", junctions.box_axis, 10_000),
    "moebius_5k": Recipe("non-orientable", one_sided.moebius, 5_000, quick=True),
    "klein_10k": Recipe("non-orientable", one_sided.klein, 10_000),
    "boy_10k": Recipe("non-orientable", one_sided.boy, 10_000),
    "tangle_10k": Recipe("high genus", closed.tangle, 10_000, quick=True),
    "gyroid_20k": Recipe("high genus", closed.gyroid, 20_000),
    "gyroid_200k": Recipe("high genus", closed.gyroid, 200_000),
    "room_150k": Recipe("indoor scene", rooms.room, 150_000),
    "torus_100": Recipe("sparse", closed.torus, 100),
    "bumps_300": Recipe("sparse", closed.bumps, 300, quick=True),
    "petals_1000": Recipe("sparse", bordered.petals, 1_000),
    "knot_graded_10k": Recipe("varying density", closed.knot, 10_000, graded),
    "cloth_graded_10k": Recipe("varying density", bordered.cloth, 10_000, graded),
    "torus_wires_3k": Recipe("wireframe", closed.torus, 3_000, wires),
    "bumps_contours_4k": Recipe("wireframe", closed.bumps, 4_000, contours),
    "relief_contours_8k": Recipe("wireframe", bordered.relief, 8_000, contours),
    "bumps_holes_10k": Recipe("holes", closed.bumps, 10_000, pierced),
    "bumps_noise0.5_10k": Recipe("noisy", closed.bumps, 10_000, noise=0.5, quick=True),
    "cloth_noise0.5_10k": Recipe("noisy", bordered.cloth, 10_000, noise=0.5),
    "knot_noise1_10k": Recipe("noisy", closed.knot, 10_000, noise=1.0),
    "torus_strays_5k": Recipe("outliers", closed.torus, 5_000, strays=0.05),
    "cloth_strays_10k": Recipe("outliers", bordered.cloth, 10_000, strays=0.05),
}


def sampled(name: str) -> tuple[Surface, np.ndarray, np.ndarray, np.random.Generator]:
    """Surface, points and normals (n,3) of the case `name` before noise and strays, and what its chance goes on from;
    the same name gives the same."""
    recipe, rng = CASES[name], np.random.default_rng(zlib.crc32(name.encode()))
    surface = recipe.surface()
    return surface, *recipe.take(surface, recipe.count, rng), rng


def make_case(folder: Path, name: str) -> Path:
    """Write the case `name` into the folder; the same name gives the same arrays."""
    recipe = CASES[name]
    surface, points, normals, rng = sampled(name)
    arrays = {"points": points + 0.008 * recipe.noise * rng.normal(size=points.shape), "normals": normals}
    if recipe.strays:
        arrays = _strewn(arrays, recipe.strays, rng)
    if recipe.take is uniform and not recipe.noise and not recipe.strays:
        arrays["points_pd"], arrays["normals_pd"] = blue_noise(surface, recipe.count, rng)
    meta = {
        "name": name,
        "category": recipe.category,
        "license": "GPL-2.0-or-later" if recipe.surface is bundled_mask else "none needed",
        "origin": "tests/data/mask_truth.ply" if recipe.surface is bundled_mask else "closed form",
    }
    path = folder / f"{name}.npz"
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(
            file,
            **{key: array.astype(np.float32) for key, array in arrays.items()},
            gt_v=surface.mesh.vertices.astype(np.float32),
            gt_f=surface.mesh.faces,
            nm_curve=surface.curve.astype(np.float32),
            meta=json.dumps(meta),
        )
    return path


def _strewn(arrays, share, rng):
    """The arrays with stray points in random places among them; a stray's normal is a random direction."""
    points, normals = arrays["points"], arrays["normals"]
    low, high = points.min(axis=0), points.max(axis=0)
    middle, reach = (low + high) / 2, 0.55 * (high - low)
    count = int(share * len(points))
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    order = rng.permutation(len(points) + count)
    strays = middle + reach * rng.uniform(-1, 1, (count, 3))
    return {"points": np.concatenate([points, strays])[order], "normals": np.concatenate([normals, directions])[order]}
