"""The renderer and the cut against what is known of spheres."""

import numpy as np
import pytest
from skimage.measure import marching_cubes

from core import Mesh
from scripts.picture import plane_section
from scripts.render import Camera, dome_light, rasterise, render, turned_discs

RADIUS = 0.8
CENTRE = np.array([3.0, -2.0, 5.0])


@pytest.fixture(scope="module")
def ball() -> Mesh:
    grid = np.stack(np.meshgrid(*3 * [np.linspace(-1, 1, 41)], indexing="ij"))
    vertices, faces, *_ = marching_cubes(np.linalg.norm(grid, axis=0), RADIUS, spacing=(0.05,) * 3)
    return Mesh(vertices.astype(float) - 1 + CENTRE, faces)


def view(direction=(0.3, -1.0, 0.4)) -> Camera:
    box = CENTRE + np.stack(np.meshgrid(*3 * [[-1.0, 1.0]]), axis=-1).reshape(-1, 3)
    return Camera.facing(box, direction, (0, 0, 1), (240, 200))


@pytest.mark.parametrize("direction", [(0, -1, 0), (1, 1, 1), (-0.2, 0.5, -0.9)])
def test_a_ball_covers_a_disc(ball, direction):
    camera = view(direction)
    image = render(ball.vertices, ball.faces, np.full(ball.vertices.shape, 0.5), camera)
    assert image[..., 3].sum() * camera.pixel**2 == pytest.approx(np.pi * RADIUS**2, rel=0.01)
    assert image[120, 100] == pytest.approx([0.5, 0.5, 0.5, 1])


def test_the_nearer_side_is_seen_and_backs_are_not(ball):
    camera = view()
    corners = camera.project(ball.vertices)[ball.faces]
    for wound, nearest in ((corners, RADIUS), (corners[:, ::-1], -RADIUS)):
        _, nearness = rasterise(wound, camera.shape)
        assert nearness[120, 100] * camera.pixel == pytest.approx(nearest, rel=0.01)


@pytest.mark.parametrize("upper_first", [True, False])
def test_the_upper_of_two_discs_hides_the_lower(upper_first):
    shift = np.array([0.0, 0.0, 0.5 if upper_first else -0.5])
    vertices, faces = turned_discs(CENTRE + np.stack([shift, -shift]), np.tile([0.0, 0, 1], (2, 1)), 0.5)
    colours = np.repeat([[1.0, 0, 0], [0, 1.0, 0]], 8, axis=0)
    image = render(vertices, faces, colours, Camera.facing(vertices, (0, 0, 1), (0, 1, 0), (60, 60)))
    assert image[30, 30] == pytest.approx([float(upper_first), float(not upper_first), 0, 1])


def test_without_culling_the_winding_does_not_matter(ball):
    colours = (ball.vertices - CENTRE) / (2 * RADIUS) + 0.5
    outward, inward = (render(ball.vertices, f, colours, view(), cull=False) for f in (ball.faces, ball.faces[:, ::-1]))
    np.testing.assert_allclose(outward, inward)


def test_a_ball_is_brightest_towards_the_key(ball):
    key = np.array([0.6, 0.0, 0.8])
    light = dome_light(ball.vertices, ball.faces, key, (0, 0, 1))
    brightest = ball.vertices[light > np.quantile(light, 0.99)].mean(axis=0) - CENTRE
    assert brightest @ key > 0.95 * np.linalg.norm(brightest)


def test_a_roof_darkens_the_floor_below_it():
    centres = np.array([[0.0, 0, 0], [5.0, 0, 0], [0.0, 0, 0.4]])
    vertices, faces = turned_discs(centres, np.tile([0.0, 0, 1], (3, 1)), np.array([0.4, 0.4, 1.0]))
    vertices, faces = np.tile(vertices, (2, 1)), np.concatenate([faces, faces[:, ::-1] + len(vertices)])
    covered, open_air, roof = dome_light(vertices, faces, (0, 0, 1), (0, 0, 1))[:24].reshape(3, 8).mean(axis=1)
    assert covered < 0.25 * open_air
    assert roof == pytest.approx(open_air, rel=0.05)


def test_discs_lie_across_their_normals():
    rng = np.random.default_rng(0)
    centres, normals, radii = rng.normal(size=(50, 3)), rng.normal(size=(50, 3)), rng.uniform(0.1, 2, 50)
    normals[:3] = np.eye(3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    vertices, faces = turned_discs(centres, normals, radii)
    spokes = vertices.reshape(50, 8, 3) - centres[:, None]
    np.testing.assert_allclose(np.linalg.norm(spokes, axis=2), np.repeat(radii[:, None], 8, axis=1))
    np.testing.assert_allclose(np.einsum("nkj,nj->nk", spokes, normals), 0, atol=1e-12)
    assert Mesh(vertices, faces).face_areas().sum() == pytest.approx(2 * np.sqrt(2) * (radii**2).sum())


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_plane_meets_a_ball_in_a_circle(ball, axis):
    height = 0.37
    segments = plane_section(ball, axis, CENTRE[axis] + height)
    radius = np.sqrt(RADIUS**2 - height**2)
    off_axis = np.delete(segments - CENTRE, axis, axis=2)
    np.testing.assert_allclose(segments[..., axis], CENTRE[axis] + height)
    np.testing.assert_allclose(np.linalg.norm(off_axis, axis=2), radius, atol=2e-3)
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()
    assert length == pytest.approx(2 * np.pi * radius, rel=0.01)
