"""How two layers lie to each other, on spheres in each other."""

import json

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from benchmarks.layers import PERCENTILES, gaps, laid_apart, main, write_page
from core import Mesh
from tests import shapes

pytest.importorskip("open3d")

CELL = 0.2


def layers(outer, inner):
    """Two spheres of other triangles, the first facing outwards, the second inwards."""
    vertices, faces = [], []
    for number, (radius, sign) in enumerate(((outer, 1), (inner, -1))):
        points = shapes.sphere(900 + 50 * number)
        triangles = ConvexHull(points).simplices
        a, b, c = (points[triangles[:, k]] for k in range(3))
        inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), a) * sign < 0
        triangles[inward] = triangles[inward, ::-1]
        faces.append(triangles + sum(map(len, vertices)))
        vertices.append(radius * points)
    return Mesh(np.concatenate(vertices), np.concatenate(faces).astype(np.int32))


@pytest.mark.parametrize(("outer", "inner"), [(1.0, 0.95), (0.95, 1.0)])
def test_gaps_have_the_sign_of_the_order(outer, inner):
    found = gaps(layers(outer, inner), CELL)
    assert len(found) == 60_000
    np.testing.assert_allclose(found, (outer - inner) / CELL, atol=0.04)


def test_layers_on_one_sphere_cross_and_are_laid_apart():
    mesh = layers(1.0, 1.0)
    assert (gaps(mesh, CELL) < 0).mean() > 0.2
    apart = laid_apart(mesh, CELL)
    assert (gaps(apart, CELL) < 0).mean() < 0.01
    assert np.abs(np.linalg.norm(apart.vertices, axis=1) - 1).max() < 0.02


def test_layers_apart_stay():
    mesh = layers(1.0, 0.95)
    np.testing.assert_array_equal(laid_apart(mesh, CELL).vertices, mesh.vertices)


def test_the_page_shows_every_row(tmp_path):
    row = {"case": "ball", "sampling": "uniform", "crossed": 0.5, "gap": [0.0] * len(PERCENTILES)}
    row |= {"crossed_apart": 0.01, "cd": 0.1, "cd_apart": 0.2}
    assert "| ball | uniform | 50.0% |" in write_page([row], tmp_path).read_text()
    assert json.loads((tmp_path / "layers" / "numbers.json").read_text())["rows"] == [row]


def test_a_folder_without_cases_is_said(tmp_path):
    assert main([str(tmp_path)]) == 2
