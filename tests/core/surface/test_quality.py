import numpy as np
import pytest

from core import Mesh
from core.surface.quality import triangle_quality


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
