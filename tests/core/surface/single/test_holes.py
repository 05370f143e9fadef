import dataclasses

import numpy as np
import pytest
from scipy.spatial import KDTree

from core import Mesh, Settings, reconstruct
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.meshing.fillings import fillings
from core.surface.single.holes import _covered, _without_long_loops, fill_pinholes
from tests import shapes

CELL = 0.05


@pytest.fixture(scope="module")
def plane():
    """The local surface of a square in z = 0 with gaps bridged up to two spacings."""
    points = shapes.square(1000)
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 2.0)


def lattice(holes, height=0.0, n=30):
    """A square sheet of n x n cells around the origin without the quads `holes`, at a height."""
    side = np.arange(n + 1)
    x, y = np.meshgrid((side - n / 2) * CELL, (side - n / 2) * CELL, indexing="ij")
    i, j = np.array([(i, j) for i in range(n) for j in range(n) if (i, j) not in holes]).T
    a, b, c, d = (i * (n + 1) + j for i, j in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(np.stack([x.ravel(), y.ravel(), np.full(x.size, height)], axis=1), faces.astype(np.int32))


def block(width, at=10):
    return {(i, j) for i in range(at, at + width) for j in range(at, at + width)}


def faults(mesh):
    return int((mesh.edge_counts()[1] > 2).sum())


@pytest.mark.parametrize(
    "holes",
    [
        block(1),
        block(2),
        block(4),
        block(1) | block(1, 20),  # two apart
        {(10, 10), (11, 11)},  # two that touch at a corner
        {(10, 10), (11, 11), (10, 12), (9, 11)},  # four around a corner of each
    ],
)
def test_pinholes_on_the_surface_close_and_the_rim_stays(plane, holes):
    mesh = fill_pinholes(lattice(holes), plane, CELL)
    assert (mesh.border_loops(), faults(mesh)) == (1, 0)
    assert mesh.face_areas().sum() == pytest.approx((30 * CELL) ** 2)
    np.testing.assert_allclose(mesh.vertices[:, 2], 0, atol=1e-9)


@pytest.mark.parametrize("turn", [1, -1])
def test_fillings_are_wound_as_the_faces_around(plane, turn):
    mesh = lattice(block(1) | block(3, 20))
    mesh = fill_pinholes(Mesh(mesh.vertices, mesh.faces[:, ::turn]), plane, CELL)
    assert mesh.border_loops() == 1
    assert mesh.edges.alike.all()


@pytest.mark.parametrize(("below", "loops"), [(0.1, 3), (0.4, 2)])
def test_a_hole_over_another_sheet_close_by_is_none(plane, below, loops):
    """It would be there twice."""
    mesh = lattice(block(4)).joined(lattice(set(), -below * CELL))
    assert fill_pinholes(mesh, plane, CELL).border_loops() == loops


def test_a_loop_longer_than_64_edges_stays(plane):
    mesh = lattice(block(17, 5))
    assert fill_pinholes(mesh, plane, CELL).border_loops() == 2


def ring(count, first=0):
    return np.stack([np.arange(count), np.roll(np.arange(count), -1)], axis=1) + first


def test_of_borders_only_long_loops_that_touch_nothing_are_set_aside():
    branch = np.array([[300, 500], [500, 501]])
    path = np.stack([np.arange(600, 700), np.arange(601, 701)], axis=1)
    kept = [ring(64, 100), ring(100, 300), branch, path]
    edges = np.concatenate([ring(65), *kept])
    np.testing.assert_array_equal(_without_long_loops(edges), np.concatenate(kept))


def test_an_opening_where_no_surface_is_stays(plane):
    """Three cells above the surface and wider than the bridging length."""
    assert 2.0 * np.median(plane.spacing) < 4 * CELL
    assert fill_pinholes(lattice(block(4), 3 * CELL), plane, CELL).border_loops() == 2


@pytest.mark.parametrize(("bridge", "loops"), [(2.0, 2), (4.0, 1)])
def test_an_opening_narrower_than_the_bridging_length_closes_anywhere(plane, bridge, loops):
    """A hole of three cells, off the surface."""
    assert 2.0 * np.median(plane.spacing) < 3 * CELL < 4.0 * np.median(plane.spacing)
    surface = dataclasses.replace(plane, bridge=bridge)
    assert fill_pinholes(lattice(block(3), 3 * CELL), surface, CELL).border_loops() == loops


def test_a_long_slit_is_as_wide_as_it_is_narrow(plane):
    """Two cells by ten, off the surface."""
    mesh = lattice({(i, j) for i in range(5, 15) for j in (5, 6)}, 3 * CELL)
    closed = fill_pinholes(mesh, plane, CELL)
    assert (closed.border_loops(), faults(closed)) == (1, 0)
    assert closed.face_areas().sum() == pytest.approx((30 * CELL) ** 2)


@pytest.mark.parametrize("n", [3, 5])
@pytest.mark.parametrize("bridge", [2.0, 20.0])
def test_the_rim_of_a_small_sheet_is_no_hole(plane, bridge, n):
    """On the surface and narrower than the bridging length; so small too that its filling is not looked at."""
    mesh = lattice(set(), n=n)
    assert fill_pinholes(mesh, dataclasses.replace(plane, bridge=bridge), CELL).border_loops() == 1


def test_a_place_of_close_samples_is_no_reason_to_leave_a_hole(plane):
    """The bridging length is that of the surroundings, not of the sample that happens to be nearest."""
    spacing = plane.spacing.copy()
    spacing[plane.tree.query([-0.175, -0.175, 0])[1]] *= 0.2
    surface = dataclasses.replace(plane, spacing=spacing, bridge=4.0)
    assert fill_pinholes(lattice(block(3), 3 * CELL), surface, CELL).border_loops() == 1


def test_an_opening_below_the_cells_closes_anywhere(plane):
    surface = dataclasses.replace(plane, bridge=0.1)
    assert fill_pinholes(lattice(block(1), 3 * CELL), surface, CELL).border_loops() == 1


def test_what_is_closed_stays_as_it_is(plane):
    mesh = Mesh(np.eye(4, 3), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32))
    assert fill_pinholes(mesh, plane, CELL) is mesh


def wall(n=12):
    """A floor of n x n cells and a wall on the middle line of it, without two of the quads that stand on the floor."""
    floor = lattice(set(), n=n)
    middle = np.arange(n + 1) + n // 2 * (n + 1)
    rows = np.concatenate([middle[None], len(floor.vertices) + np.arange(4 * (n + 1)).reshape(4, -1)])
    up = floor.vertices[middle] + CELL * np.arange(1, 5)[:, None, None] * np.array([0, 0, 1])
    i, j = np.array([(i, j) for i in range(4) for j in range(n) if (i, j) not in {(0, 5), (0, 6)}]).T
    a, b, c, d = rows[i, j], rows[i, j + 1], rows[i + 1, j + 1], rows[i + 1, j]
    faces = np.concatenate([floor.faces, np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(np.concatenate([floor.vertices, up.reshape(-1, 3)]), faces.astype(np.int32))


def test_a_hole_beside_a_junction_closes_along_the_other_sheet(plane):
    """Its border alone is no loop: it ends at the junction, and edges of the floor bound the rest."""
    mesh = wall()
    border = mesh.edge_counts()[0][mesh.edge_counts()[1] == 1]
    closed = fill_pinholes(mesh, plane, CELL)
    _, counts = closed.edge_counts()
    assert (counts == 1).sum() == len(border) - 4
    assert (counts == 3).sum() == 12  # all along the wall's foot
    assert closed.face_areas().sum() == pytest.approx(mesh.face_areas().sum() + 2 * CELL**2)


def test_edges_that_form_no_loop_are_left_alone(plane):
    """Three triangles on one edge: border paths that end at it still close around it, but nothing is doubled."""
    vertices = np.array([[0, 0, 0], [0, 0.5, 0], [0.5, 0, 0], [-0.5, 0, 0], [0, 0, 0.5]])
    mesh = fill_pinholes(Mesh(vertices, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], np.int32)), plane, 0.01)
    corners = np.sort(mesh.faces, axis=1)
    assert len(np.unique(corners, axis=0)) == len(corners)


def test_a_hole_in_a_corner_closes_along_both_other_sheets(plane):
    """Its border is one edge: a triangle of the wall is missing between two that stand on the floor."""
    mesh = wall()
    closed = fill_pinholes(mesh, plane, CELL)
    foot = np.flatnonzero((closed.vertices[closed.faces][..., 2] > 1e-9).sum(axis=1) == 1)
    gone = foot[np.abs(closed.vertices[closed.faces[foot]].mean(axis=1)[:, 1]).argmin()]
    holed = Mesh(closed.vertices, np.delete(closed.faces, gone, axis=0))
    assert (holed.edge_counts()[1] == 1).sum() == (closed.edge_counts()[1] == 1).sum() + 2
    again = fill_pinholes(holed, plane, CELL)
    assert sorted(map(sorted, again.faces.tolist())) == sorted(map(sorted, closed.faces.tolist()))


def test_fillings_on_faces_that_are_there_are_told():
    """Of the outline of a block of cells: on it, up to a quarter of a cell above it, in its place, and half on it; not
    of a small one."""

    def covered(mesh, width=8, height=0.0):
        side = np.arange(width)
        far, near = np.full(width, width), np.zeros(width, int)
        x = np.concatenate([side, far, width - side, near])
        y = np.concatenate([near, side, far, width - side])
        ring = 31 * (10 + x) + 10 + y
        place = mesh.vertices.copy()
        place[ring, 2] += height * CELL
        none = np.empty((0, 3), np.int64)
        triangle, loop = fillings(place, [ring], none[:, :2], none, CELL)
        above = Mesh(np.concatenate([mesh.vertices, place]), mesh.faces)
        return _covered(above, triangle + len(place), loop, 1, CELL)[0]

    assert covered(lattice(set())) == covered(lattice(set()), height=0.2) == 1
    assert covered(lattice(set()), height=0.3) == covered(lattice(block(8))) == covered(lattice(set()), width=3) == 0
    half = {(i, j) for i, j in block(8) if i >= 14}
    assert covered(lattice(half)) == pytest.approx(0.5, abs=0.1)


def honeycomb(n, seed):
    """Samples of three hexagonal tubes that share walls, with sides of 1, and where walls meet or end, (c,2)."""
    turn = np.arange(6) * np.pi / 3
    corners = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    walls = set()
    for middle in ([0, 0], [1.5, np.sqrt(0.75)], [0, np.sqrt(3)]):
        ends = [tuple(end) for end in np.round(corners + middle, 6).tolist()]
        walls |= {(min(pair), max(pair)) for pair in zip(ends, ends[1:] + ends[:1], strict=True)}
    low, high = np.array(sorted(walls)).transpose(1, 0, 2)
    random = np.random.default_rng(seed)
    wall, share = random.integers(0, len(low), n), random.random((n, 1))
    place = low[wall] + share * (high - low)[wall]
    return np.column_stack([place, random.uniform(0, 1.2, n)]), np.unique(np.concatenate([low, high]), axis=0)


@pytest.mark.parametrize("seed", [0, 4])
def test_the_way_that_closes_a_border_does_not_double_its_own_sheet(seed):
    """One of 15 walls was doubled, along a line of three faces across it. 13 corners less 15 walls are their Euler
    characteristic."""
    points, corners = honeycomb(3000, seed)
    mesh = reconstruct(points, Settings(resolution=64, surface="single", denoise=0)).sheet
    edges, count = mesh.edge_counts()
    line = mesh.vertices[edges[count > 2]].mean(axis=1)
    assert shapes.euler(mesh) == -2
    assert len(line) > 30
    assert KDTree(corners).query(line[:, :2])[0].max() < 0.15
    assert mesh.face_areas().sum() < 1.2 * 15
