"""What vertices do not show of the mesh that they are of."""

import numpy as np
import pytest

from core.modelled import MANY, Faces, missed_by_vertices
from tests import shapes


def faces_of(points, faces):
    sizes = np.array([len(face) for face in faces], np.int64)
    return Faces.of(np.asarray(points, float), np.concatenate([np.empty(0, np.int64), *faces]).astype(np.int64), sizes)


def cylinder(sides):
    """Of one row of quads, with a polygon at either end."""
    turn, at = 2 * np.pi * np.arange(sides) / sides, np.arange(sides)
    ring, after = np.stack([np.cos(turn), np.sin(turn), -np.ones(sides)], axis=1), np.roll(at, -1)
    around = np.stack([at, after, sides + after, sides + at], axis=1)
    return faces_of(np.concatenate([ring, ring + np.array([0, 0, 2])]), [*around, at[::-1], at + sides])


def patch(side, bend=0.0, turned=()):
    """A square of quads, folded by `bend` radians between rows; those `turned` are wound the other way."""
    x, y = np.divmod(np.arange((side + 1) ** 2), side + 1)
    up = np.where(x % 2, np.tan(bend / 2), 0.0)
    low = (x * (side + 1) + y)[(x < side) & (y < side)]
    faces = np.stack([low, low + side + 1, low + side + 2, low + 1], axis=1)
    faces[list(turned)] = faces[list(turned), ::-1]
    return np.stack([x, y, up], axis=1).astype(float), list(faces)


def told(faces):
    return missed_by_vertices(faces, "sample it", "refine it")


def test_areas_and_normals_of_polygons_are_those_of_their_planes():
    faces = cylinder(6)
    np.testing.assert_allclose(faces.areas, [2.0] * 6 + [1.5 * np.sqrt(3)] * 2)
    np.testing.assert_allclose(faces.normals[-2:], [[0, 0, -1], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(faces.normals[0], [np.cos(np.pi / 6), np.sin(np.pi / 6), 0], atol=1e-15)


@pytest.mark.parametrize("turned", [(), range(0, 100, 3)])
@pytest.mark.parametrize("degrees", [0, 20, 50])
def test_faces_turn_as_they_are_folded_whichever_way_they_are_wound(degrees, turned):
    """At a little more than half the edges of this one."""
    points, faces = patch(10, np.radians(degrees), turned=turned)
    points[:, 1] *= 10
    across = faces_of(points, [face for face in faces if points[face, 1].max() <= 10])
    np.testing.assert_allclose(across.turn(), degrees, atol=1e-5)


def test_large_caps_are_told_and_how_it_helps():
    assert told(cylinder(128)) == "much of its area lies on faces far larger than these are apart: sample it"


def test_few_vertices_are_told_and_how_it_helps():
    assert told(cylinder(4)).endswith("from face to face it turns by 90 degrees; refine it")
    assert not told(faces_of(*patch(10)))


def test_faces_too_large_for_powers_of_distances_are_no_trouble():
    assert not told(faces_of(1e300 * np.eye(3), [[0, 1, 2]] * 3))


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_the_unit_is_of_no_matter(scale):
    points, faces = patch(3, np.radians(50))
    assert bool(told(faces_of(scale * points, faces))) == bool(told(faces_of(points, faces)))


def test_of_many_vertices_none_are_few():
    side = int(np.sqrt(MANY))
    points, faces = patch(side, np.radians(90))
    points[:, 1] *= 5  # most of the length of edges counts for nothing: folds are half of all
    assert not told(faces_of(points, faces))


def test_of_scans_with_a_modelled_part_nothing_is_told():
    box = cylinder(4)
    loose = Faces(box.count + 1000, box.corners, box.sizes, box.areas, box.normals)
    assert not told(loose)
    assert not told(faces_of(shapes.sphere(100), []))


def test_faces_without_area_are_no_trouble():
    assert not told(faces_of(np.zeros((4, 3)), [[0, 1, 2], [0, 1, 3], [2, 2, 3]]))
    assert not told(faces_of(np.eye(3), [[0], [1, 2]]))
