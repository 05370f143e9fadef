import numpy as np
import pytest

from core import Settings, reconstruct
from core.normals.around import Around
from core.normals.planes import onto_planes
from core.points import local_spacing
from tests import shapes
from tests.core.normals.test_creases import off_all_faces, parted, roof, scattered_cube


def box_lattice(*cells: int) -> np.ndarray:
    """The surface of a lattice of so many cells along each axis, the corners and the samples on the edges included."""
    place = np.stack(np.meshgrid(*(np.arange(n + 1) for n in cells), indexing="ij"), axis=-1).reshape(-1, 3)
    return place[((place == 0) | (place == cells)).any(axis=1)].astype(float)


def moved_from(axes, points):
    every = np.ones(len(points), bool)
    return onto_planes(Around(points, local_spacing(points)), axes, every, ~every)


@pytest.mark.parametrize("n", [6, 10, 16])
def test_on_the_edges_of_a_lattice_axes_are_those_of_a_face(n):
    points = box_lattice(n, n, n)
    before, axes, _, _ = parted(points)
    edge = ((points == 0) | (points == n)).sum(axis=1) == 2
    assert (off_all_faces(before)[edge] > 20).mean() > 0.7
    assert (off_all_faces(axes)[edge] < 1).mean() > 0.95


@pytest.mark.parametrize("cells", [(4, 4, 4), (10, 10, 10), (30, 10, 3)])
def test_lattices_of_boxes_are_closed_in_single_layers_and_signed(cells):
    points = box_lattice(*cells)
    for surface in ("single", "signed"):
        result = reconstruct(points, Settings(surface=surface, resolution=64))
        mesh = result.sheet if surface == "single" else result.surface
        assert result.report["warnings"] == []
        assert (mesh.edge_counts()[1] == 2).all()
        assert shapes.euler(mesh) == 2
        assert shapes.signed_volume(mesh) == pytest.approx(np.prod(cells), rel=0.02)


@pytest.mark.parametrize(
    ("cells", "stretch", "resolution"),
    [(16, (1, 1, 2), 128), (16, (1, 0.5, 0.5), 100), (16, (1, 0.7, 0.4), 128), (32, (1, 1, 2), 100)],
)
def test_stretched_lattices_of_boxes_are_closed(cells, stretch, resolution):
    """Next to their edges axes leaned by a few degrees, the closer rows on the other face having more of a say; sides
    ended short of them, and ends of boxes came off."""
    points = box_lattice(cells, cells, cells) * stretch
    before, axes, _, _ = parted(points)
    assert (off_all_faces(before) > 2).mean() > 0.1
    inside = (points == 0).sum(axis=1) + (points == np.multiply(cells, stretch)).sum(axis=1) < 3  # no corner
    assert off_all_faces(axes)[inside].max() < 1
    result = reconstruct(points, Settings(resolution=resolution, surface="both"))
    assert (result.sheet.edge_counts()[1] == 2).all()
    assert shapes.euler(result.sheet) == 2
    assert shapes.euler(result.surface) == 4


def test_random_samples_next_to_creases_have_the_normals_of_faces():
    points, _ = scattered_cube(3000)
    assert (off_all_faces(parted(points)[1]) > 1).mean() < 0.034


@pytest.mark.parametrize("angle", [50, 120])
def test_an_axis_goes_to_the_fuller_plane(angle):
    points, truth, away = roof(np.radians(angle))
    axes, moved = moved_from(np.tile(truth[0] + truth[-1] + [0.5, 0, 0], (len(points), 1)), points)
    beside = away < 2 * local_spacing(points)
    np.testing.assert_allclose(np.linalg.norm(axes[moved], axis=1), 1)
    right = np.abs(np.einsum("ni,ni->n", axes, truth)) > 1 - 1e-6
    assert moved[~beside].mean() > 0.99
    assert right[moved & ~beside].mean() > 0.99
    assert right[moved & beside].mean() > 0.85


@pytest.mark.parametrize("points", [shapes.scattered_sphere(2000), shapes.torus(1500), shapes.sphere(300)])
def test_nothing_moves_on_curved_surfaces(points, random):
    axes = random.normal(size=points.shape)
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    found, moved = moved_from(axes, points)
    assert moved.mean() < 0.03
    np.testing.assert_array_equal(found[~moved], axes[~moved])


@pytest.mark.parametrize(("rough", "moves"), [(0, True), (0.003, False)])
def test_leaning_axes_go_to_exact_planes_alone(rough, moves, random):
    flat = random.uniform(-1, 1, (800, 2))
    points = np.column_stack([flat, rough * random.uniform(-1, 1, 800)])
    every, tilted = np.ones(800, bool), np.tile([0.06, 0.0, 1.0], (800, 1))
    axes, moved = onto_planes(Around(points, local_spacing(points)), tilted, ~every, every)
    assert moved.mean() == moves
    np.testing.assert_allclose(np.abs(axes), [0, 0, 1.0] * every[:, None] if moves else tilted, atol=1e-9)


def test_samples_that_are_not_suspect_and_lines_stay(random):
    points = np.pad(random.uniform(-1, 1, (500, 2)), ((0, 0), (0, 1)))
    tilted = np.tile([0.6, 0.0, 0.8], (500, 1))
    suspect = points[:, 0] > 0
    axes, moved = onto_planes(Around(points, local_spacing(points)), tilted, suspect, np.zeros_like(suspect))
    np.testing.assert_array_equal(moved, suspect)
    np.testing.assert_array_equal(axes[~suspect], tilted[~suspect])
    np.testing.assert_allclose(np.abs(axes[suspect]), np.tile([0, 0, 1.0], (suspect.sum(), 1)), atol=1e-9)
    line = np.linspace([0.0, 0, 0], [1, 2, 3], 50)
    assert not moved_from(np.tile([0.6, 0.0, 0.8], (50, 1)), line)[1].any()
