import numpy as np
import pytest
from scipy.spatial import KDTree

from core import Mesh, Settings, reconstruct
from core.surface.meshing.pieces import piece_count, pieces_touch, pieces_with_samples, without_small_pieces
from tests import shapes

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def triangles(*places):
    vertices = np.concatenate([TRIANGLE + place for place in places])
    return Mesh(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3))


@pytest.mark.parametrize(("distance", "kept"), [(1.4, True), (1.6, False)])
def test_a_piece_stays_where_a_sample_is_within_one_and_a_half_cells(distance, kept):
    mesh = pieces_with_samples(triangles([0, 0, 0], [0, 0, 50]), KDTree([[0, 0, 0], [0, 0, 50 + distance * 0.5]]), 0.5)
    assert len(mesh.faces) == (2 if kept else 1)


def test_one_sample_holds_a_whole_piece_and_vertices_are_renumbered():
    strip = Mesh(
        np.array([[0, 9, 9], [9, 9, 9], [9, 0, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0], [80, 80, 0]], float),
        np.array([[0, 1, 2], [3, 4, 5], [5, 4, 6]], np.int32),
    )
    mesh = pieces_with_samples(strip, KDTree([[0.0, 0, 0]]), 1.0)
    np.testing.assert_array_equal(mesh.vertices, strip.vertices[3:])
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [2, 1, 3]])
    assert mesh.faces.dtype == np.int32


@pytest.mark.parametrize(("gap", "touch"), [(0.9, True), (1.1, False)])
def test_pieces_touch_where_one_ends_beside_another(gap, touch):
    assert pieces_touch(triangles([0, 0, 0], [0, 0, gap]), 1.0) == touch


def test_one_piece_touches_no_other():
    assert not pieces_touch(triangles([0, 0, 0]), 9.0)


def test_nothing_left():
    mesh = pieces_with_samples(triangles([0, 0, 0]), KDTree([[9.0, 9, 9]]), 1.0)
    assert (mesh.vertices.shape, mesh.faces.shape) == ((0, 3), (0, 3))


def strip(height, count):
    """A strip of `count` triangles along x at this height: vertices and faces."""
    along = np.arange(count + 2)
    vertices = np.column_stack([0.5 * along, along % 2, np.full(count + 2, float(height))])
    return vertices, np.stack([along[:-2], along[1:-1], along[2:]], axis=1)


def joined(*parts):
    first = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    faces = [faces + start for (_, faces), start in zip(parts, first, strict=False)]
    return Mesh(np.concatenate([vertices for vertices, _ in parts]), np.concatenate(faces).astype(np.int32))


@pytest.mark.parametrize(
    ("faces", "every", "kept"), [(6, 1, False), (23, 1, False), (24, 1, True), (24, 4, False), (32, 4, True)]
)
def test_a_piece_of_few_faces_or_samples_along_a_large_one_is_a_crumb(faces, every, kept):
    """A large strip, some of whose vertices are the samples, and, half a cell above it, a small one."""
    large, small = strip(0, 400), strip(0.5, faces)
    found = pieces_with_samples(joined(large, small), KDTree(large[0][::every]), 1.0)
    assert len(found.vertices) == len(large[0]) + (len(small[0]) if kept else 0)


@pytest.mark.parametrize(("faces", "kept"), [(23, False), (24, True)])
def test_so_it_is_along_one_of_very_many_vertices(faces, kept):
    large, small = strip(0, 12_000), strip(0.5, faces)
    found = pieces_with_samples(joined(large, small), KDTree(large[0]), 1.0)
    assert len(found.vertices) == len(large[0]) + (len(small[0]) if kept else 0)


def test_a_small_piece_stays_where_one_of_its_samples_has_no_large_one():
    large, small = strip(0, 100), strip(1, 4)
    mesh = joined(large, small)
    assert len(pieces_with_samples(mesh, KDTree(large[0]), 1.0).vertices) == len(large[0])
    beyond = np.concatenate([large[0], [[0, 0, 1.8]]])  # within 1.5 cells of the small one alone
    assert len(pieces_with_samples(mesh, KDTree(beyond), 1.0).vertices) == len(mesh.vertices)


def test_small_pieces_along_each_other_stay():
    """As the two layers of a tiny part do."""
    mesh = joined(strip(0, 4), strip(0.5, 4), strip(90, 200))
    assert len(pieces_with_samples(mesh, KDTree(mesh.vertices), 1.0).vertices) == len(mesh.vertices)


def test_a_tiny_part_beside_a_large_one_keeps_both_its_layers():
    ball = shapes.sphere(14, 0.2) + np.array([1.5, 0, 0])
    run = reconstruct(np.concatenate([shapes.sphere(1000), ball]), Settings(resolution=64, outliers=False))
    pieces = shapes.components(run.surface)
    assert [shapes.euler(piece) for piece in pieces] == [2, 2, 2, 2]
    assert [np.sign(shapes.signed_volume(piece)) for piece in pieces] == [1, -1, 1, -1]
    assert len(np.unique(KDTree(run.points).query(pieces[3].vertices)[1])) < 15


@pytest.mark.parametrize(("share", "kept"), [(0, 3), (0.24, 3), (0.26, 2), (1, 2)])
def test_pieces_below_a_share_of_the_largest_go(share, kept):
    """Two strips of a hundred triangles and one of a quarter of that."""
    mesh = joined(strip(0, 100), strip(5, 25), strip(9, 100))
    found, dropped = without_small_pieces(mesh, share)
    assert [len(piece.faces) for piece in shapes.components(found)] == [100, 100, 25][:kept]
    assert (piece_count(found), dropped) == (kept, 3 - kept)


def test_area_counts_not_faces():
    vertices, faces = strip(0, 4)
    mesh = joined((vertices * 10, faces), strip(50, 300))
    assert [len(piece.faces) for piece in shapes.components(without_small_pieces(mesh, 0.9)[0])] == [4]


def test_no_pieces_at_all():
    mesh, dropped = without_small_pieces(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)), 0.5)
    assert (len(mesh.faces), dropped) == (0, 0)


@pytest.mark.parametrize("surface", ["double", "single", "signed"])
def test_the_setting_leaves_a_small_ball_out(surface):
    ball = shapes.sphere(100, 0.3) + np.array([1.6, 0, 0])
    points = np.concatenate([shapes.sphere(1000), ball])
    for share, right in ((0.0, 1.9), (0.5, 1.0)):
        run = reconstruct(points, Settings(resolution=48, surface=surface, pieces=share))
        mesh = run.sheet if surface == "single" else run.surface
        assert mesh.vertices[:, 0].max() == pytest.approx(right, abs=0.05)
        found = run.report["meshes"][surface]
        assert found["vertices"] == len(mesh.vertices)
        layers = 2 if surface == "double" else 1
        assert (found["pieces"], found["pieces_dropped"]) == ((2 * layers, 0) if share == 0 else (layers, layers))
