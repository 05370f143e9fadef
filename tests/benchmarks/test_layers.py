"""How two layers lie to each other, on spheres in each other."""

import json

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from benchmarks.layers import PERCENTILES, gaps, layers_of, main, write_page
from core import Mesh
from tests import shapes

pytest.importorskip("open3d", exc_type=ImportError)

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


def test_layers_on_one_sphere_cross():
    assert (gaps(layers(1.0, 1.0), CELL) < 0).mean() > 0.2


def test_a_double_cover_is_compared_with_faces_astride(tmp_path):
    ball, path = layers(1.0, 1.0), tmp_path / "ball_900.npz"
    arrays = {"points": ball.vertices[:900], "normals": ball.vertices[:900], "nm_curve": np.empty((0, 3))}
    arrays |= {"gt_v": ball.vertices, "gt_f": ball.faces, "meta": json.dumps({"category": "ball", "license": "none"})}
    np.savez(path, **arrays)
    row = layers_of(path, "uniform")
    assert row["crossed"] < 0.02 < 0.2 < row["crossed_astride"]
    assert row["cd"] != row["cd_astride"]


def test_the_page_shows_every_row(tmp_path):
    row = {"case": "ball", "sampling": "uniform", "paired": 0.9, "crossed": 0.05, "gap": [0.0] * len(PERCENTILES)}
    row |= {"crossed_astride": 0.5, "cd": 0.2, "cd_astride": 0.1}
    sides = row | {"case": "sheet", "crossed_astride": None, "cd_astride": None}
    page = write_page([row, sides], tmp_path).read_text()
    assert "| ball | uniform | 90.0% | 5.00% |" in page
    assert "| 50.0% | 0.200 | 0.100 | 2.00 |" in page
    assert "| – | 0.200 | – | – |" in page
    assert json.loads((tmp_path / "layers" / "numbers.json").read_text())["rows"] == [row, sides]


def test_a_folder_without_cases_is_said(tmp_path):
    assert main([str(tmp_path)]) == 2
