import numpy as np
import pytest

from core import Mesh
from core.surface.meshing.quality import quad_quality, triangle_quality
from core.surface.meshing.triangles import mesh_of


def triangles(*corners):
    """A mesh of triangles that share no vertex, each given by its three corners in the plane."""
    flat = np.array(corners, float).reshape(-1, 2)
    return Mesh(np.column_stack([flat, 0 * flat[:, 0]]), np.arange(len(flat), dtype=np.int32).reshape(-1, 3))


EVEN = [[0, 0], [1, 0], [0.5, 3**0.5 / 2]]
RIGHT = [[0, 0], [3, 0], [0, 3]]
NEEDLE = [[0, 0], [1, 0], [1, np.tan(np.radians(2))]]
BLUNT = [[0, 0], [2, 0], [1, np.tan(np.radians(4.9))]]
BLUNTER = [[0, 0], [2, 0], [1, np.tan(np.radians(5.1))]]
FLAT = [[0, 0], [1, 0], [3, 0]]


def test_even_triangles():
    found = triangle_quality(triangles(EVEN, np.array(EVEN) * 1e-9))
    best = {"min_angle": 60, "least_angle": 60, "small_angles": 0, "aspect_p95": 1}
    assert {name: found[name] for name in best} == pytest.approx(best)


@pytest.mark.parametrize(
    ("corners", "angle", "aspect"),
    [
        (RIGHT, 45, np.sqrt(3)),
        (NEEDLE, 2, np.sqrt(3) / np.sin(np.radians(4))),
        (BLUNT, 4.9, np.sqrt(3) / 0.0857301),
        (BLUNTER, 5.1, np.sqrt(3) / 0.0892473),
    ],
)
def test_closed_forms_whichever_corner_comes_first(corners, angle, aspect):
    """The longest side over the height on it, times sqrt(3) / 2: a needle's is cos(2) sin(2) of its side."""
    for turn in range(3):
        found = triangle_quality(triangles(np.roll(corners, turn, axis=0)))
        assert (found["min_angle"], found["least_angle"]) == pytest.approx((angle, angle))
        assert found["small_angles"] == (angle < 5)
        assert found["aspect_p95"] == pytest.approx(aspect, rel=1e-5)


def test_shares_and_the_mean():
    found = triangle_quality(triangles(*[RIGHT] * 7, NEEDLE, BLUNT, FLAT))
    assert found["min_angle"] == pytest.approx((7 * 45 + 2 + 4.9) / 10)
    assert (found["least_angle"], found["small_angles"], found["zero_area"]) == (0, 0.3, 0.1)
    assert found["aspect_p95"] is None


def test_the_aspect_ratio_leaves_the_worst_twentieth_out():
    assert triangle_quality(triangles(*[EVEN] * 96, *[NEEDLE] * 4))["aspect_p95"] == pytest.approx(1)
    assert triangle_quality(triangles(*[EVEN] * 94, *[NEEDLE] * 6))["aspect_p95"] > 20


def test_no_faces():
    found = triangle_quality(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)))
    assert set(found.values()) == {None}


def quads(*corners):
    """A mesh of quads that share no vertex, each given by its four corners in space."""
    vertices = np.array(corners, float).reshape(-1, 3)
    return mesh_of(vertices, np.arange(len(vertices)).reshape(-1, 4))


SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
BOX = [[0, 0, 0], [3, 0, 0], [3, 1, 0], [0, 1, 0]]
RHOMB = [[0, 0, 0], [2, 1, 0], [4, 0, 0], [2, -1, 0]]
FOLDED = [[0, -1, 0], [2, 0, 0], [0, 1, 0], [-2, 0, 1]]  # about the y axis, the shorter way across
DART = [[0, 0, 0], [2, -1, 0], [0.5, 0, 0], [2, 1, 0]]


@pytest.mark.parametrize(
    ("corners", "angle", "aspect", "fold", "concave"),
    [
        (SQUARE, 90, 1, 0, 0),
        (BOX, 90, 3, 0, 0),
        (RHOMB, np.degrees(2 * np.arctan(0.5)), 1, 0, 0),
        (FOLDED, None, None, np.degrees(np.arctan(0.5)), 0),
        (DART, None, np.sqrt(5 / 3.25), 0, 1),
    ],
)
def test_quads_in_closed_form(corners, angle, aspect, fold, concave):
    for turn in range(4):
        found = quad_quality(quads(np.roll(corners, turn, axis=0)))
        assert (found["quads"], found["triangles"], found["quad_concave"]) == (1, 0, concave)
        assert found["quad_fold_p95"] == pytest.approx(fold, abs=1e-5)
        assert angle is None or found["quad_angle"] == pytest.approx(angle)
        assert aspect is None or found["quad_aspect_p95"] == pytest.approx(aspect)


def test_a_quad_without_a_side():
    found = quad_quality(quads([[0, 0, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]]))
    assert (found["quad_angle"], found["quad_aspect_p95"]) == (0, None)


def test_no_quads():
    found = quad_quality(triangles(EVEN))
    assert (found.pop("quads"), found.pop("triangles")) == (0, 1)
    assert set(found.values()) == {None}
