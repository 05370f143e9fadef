"""The bundled samples are what tests/data/README.md says."""

from pathlib import Path

import igl
import numpy as np
import pytest
from plyfile import PlyData
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from core import Mesh

DATA = Path(__file__).resolve().parent.parent / "data"


def points(name: str) -> np.ndarray:
    vertex = PlyData.read(DATA / name)["vertex"]
    assert [p.name for p in vertex.properties] == ["x", "y", "z"]
    return np.stack([vertex[k] for k in "xyz"], axis=1).astype(float)


@pytest.fixture(scope="module")
def mask_truth() -> Mesh:
    faces = np.stack(PlyData.read(DATA / "mask_truth.ply")["face"]["vertex_indices"])
    return Mesh(points("mask_truth.ply"), faces)


def test_files_are_small():
    assert all(file.stat().st_size < 300_000 for file in DATA.iterdir())


@pytest.mark.parametrize(("name", "count"), [("bust.ply", 18_000), ("mask.ply", 5_000)])
def test_points_are_evenly_spread(name, count):
    cloud = points(name)
    assert cloud.shape == (count, 3)
    gap = KDTree(cloud).query(cloud, 2)[0][:, 1]
    assert gap.min() > 0.75 * np.median(gap)
    assert gap.max() < 3.5 * np.median(gap)


def test_the_bust_stands_upright():
    assert np.ptp(points("bust.ply"), axis=0).argmax() == 2


def test_the_mask_is_sampled_on_its_truth(mask_truth):
    squared, *_ = igl.point_mesh_squared_distance(points("mask.ply"), mask_truth.vertices, mask_truth.faces)
    assert squared.max() < 1e-12


def test_the_mask_is_open_and_has_separate_eyes(mask_truth):
    edges, counts = mask_truth.edge_counts()
    assert set(counts) == {1, 2}
    n = len(mask_truth.vertices)
    linked = np.zeros((n, n), bool)
    linked[tuple(edges.T)] = True
    assert connected_components(linked, directed=False)[0] == 3
