"""The single layer by topology, closed form and repetition. Resolutions are those of the shared runs."""

import re

import igl
import numpy as np
import pytest
from scipy.spatial import KDTree

from core import Settings, reconstruct
from core.points import local_spacing
from core.surface.meshing import misfit
from core.surface.single import routes, thin_walls
from tests import shapes


def single(points, **settings):
    return reconstruct(points, Settings(**{"resolution": 48, "surface": "single", **settings}))


@pytest.fixture(scope="module")
def runs():
    return {
        "sphere": single(shapes.sphere(1500)),
        "torus": single(shapes.torus(2000)),
        "cube": single(shapes.cube(2400)),
        "disc": single(shapes.disc(800)),
        "hemisphere": single(shapes.hemisphere(1500)),
        "cylinder": single(shapes.cylinder(1500)),
        "moebius": single(shapes.moebius(1500), resolution=64),
        "sheets": single(shapes.sheets(2000, gap=0.2)),
    }


# Euler characteristic of each piece, largest first, and border loops
TOPOLOGY = {
    "sphere": ([2], 0),
    "torus": ([0], 0),
    "cube": ([2], 0),
    "disc": ([1], 1),
    "hemisphere": ([1], 1),
    "cylinder": ([0], 2),
    "moebius": ([0], 1),
    "sheets": ([1, 1], 2),
}


@pytest.mark.parametrize("name", TOPOLOGY)
def test_topology(runs, name):
    sheet = runs[name].sheet
    assert ([shapes.euler(piece) for piece in shapes.components(sheet)], sheet.border_loops()) == TOPOLOGY[name]
    assert sheet.edge_counts()[1].max() == 2


@pytest.mark.parametrize("name", TOPOLOGY)
def test_is_the_sheet_and_no_cover(runs, name):
    assert runs[name].surface is None
    assert not runs[name].field.sdf
    assert runs[name].field.values.min() >= 0


@pytest.mark.parametrize("name", TOPOLOGY)
def test_faces_are_distinct_and_use_every_vertex(runs, name):
    sheet = runs[name].sheet
    corners = np.sort(sheet.faces, axis=1)
    assert (np.diff(corners, axis=1) > 0).all()
    assert len(np.unique(corners, axis=0)) == len(corners)
    np.testing.assert_array_equal(np.unique(sheet.faces), np.arange(len(sheet.vertices)))


@pytest.mark.parametrize("name", [name for name in TOPOLOGY if name != "moebius"])
def test_is_wound_alike(runs, name):
    assert backward_edges(runs[name].sheet) == 0
    assert runs[name].report["warnings"] == []


def test_a_moebius_band_is_told_to_be_one_sided(runs):
    cut = backward_edges(runs["moebius"].sheet)
    assert 0 < cut < 60  # once across the band
    assert any(f"across {cut} of its edges" in warning for warning in runs["moebius"].report["warnings"])


@pytest.mark.parametrize(
    ("name", "volume"), [("sphere", 4 / 3 * np.pi), ("torus", 2 * np.pi**2 * 0.4**2), ("cube", 8.0)]
)
def test_closed_shapes_face_outwards(runs, name, volume):
    assert shapes.signed_volume(runs[name].sheet) == pytest.approx(volume, rel=0.01)


@pytest.mark.parametrize(
    ("name", "area"),
    [("sphere", 4 * np.pi), ("torus", 4 * np.pi**2 * 0.4), ("cube", 24), ("disc", np.pi), ("hemisphere", 2 * np.pi),
     ("cylinder", 4 * np.pi), ("sheets", 8)],
)  # fmt: skip
def test_covers_the_surface_once(runs, name, area):
    assert runs[name].sheet.face_areas().sum() == pytest.approx(area, rel=0.06)


@pytest.mark.parametrize("name", TOPOLOGY)
def test_every_sample_is_covered(runs, name):
    run = runs[name]
    distance, _ = KDTree(run.sheet.vertices).query(run.points)
    assert distance.max() < 1.5 * run.field.spacing


@pytest.mark.parametrize(
    ("name", "true", "hair"),
    [
        ("sphere", shapes.sphere_distance, 0.02),
        ("torus", shapes.torus_distance, 0.02),
        ("hemisphere", shapes.hemisphere_distance, 0.6),
        ("disc", shapes.disc_distance, 0.5),
        ("cylinder", shapes.cylinder_distance, 0.5),
    ],
)
def test_vertices_lie_on_the_surface(runs, name, true, hair):
    """In local spacings: a fiftieth of one, but at rims half of one, because there the sheet's end is a guess."""
    off = true(runs[name].sheet.vertices) / runs[name].report["spacing"]
    assert np.percentile(off, 85) < 0.02
    assert off.max() < hair


def test_two_sheets_keep_their_heights(runs):
    pieces = shapes.components(runs["sheets"].sheet)
    assert sorted(round(float(np.median(piece.vertices[:, 2])), 3) for piece in pieces) == [-0.1, 0.1]


def test_sheets_of_a_junction_are_joined_along_their_line_only():
    """Not all along it: where a wall's last crossings are nearer to the floor it ends within a cell of it."""
    run = single(shapes.junction(2000))
    edges, counts = run.sheet.edge_counts()
    middle = run.sheet.vertices[edges[counts > 2]].mean(axis=1)
    assert len(middle) > 0
    assert np.hypot(middle[:, 0], middle[:, 2]).max() < 2 * run.field.spacing
    assert len(shapes.components(run.sheet)[0].faces) == len(run.sheet.faces)
    wall = run.sheet.vertices[run.sheet.vertices[:, 2] > 0.1 * run.field.spacing]
    seam = np.column_stack([np.zeros(50), np.linspace(-0.9, 0.9, 50), np.zeros(50)])
    assert KDTree(wall).query(seam)[0].max() < 2 * run.field.spacing


@pytest.mark.parametrize("seed", [4, 5])
@pytest.mark.parametrize(("name", "most"), [("junction", 1), ("crossing", 2)])
def test_sheets_meet_along_one_line_without_slits(name, most, seed):
    """Askew to the grid. One border loop would be right for both; two sheets that end at each other's rims may miss."""
    turn = shapes.random_rotation(seed)
    flat = shapes.square(1000)
    crossing = np.concatenate([flat, flat[:, [2, 1, 0]] + np.array([0, 1e-3, 1e-3])])
    run = single({"junction": shapes.junction(2000), "crossing": crossing}[name] @ turn.T)
    edges, counts = run.sheet.edge_counts()
    middle = run.sheet.vertices[edges[counts > 2]].mean(axis=1) @ turn
    assert np.hypot(middle[:, 0], middle[:, 2]).max() < run.field.spacing
    assert np.ptp(middle[:, 1]) > 2 - 2.1 * run.field.spacing
    assert run.sheet.border_loops() <= most
    assert len(shapes.components(run.sheet)) == 1


@pytest.mark.parametrize(("name", "seed"), [("junction", 3), ("crossing", 7)])
def test_sheets_that_meet_at_random_samples_are_one_surface_without_pockets(name, seed):
    """Two squares that cross, or one that stands on another: both shrink to a point, so their Euler characteristic is
    1. Each pocket between faces along their line would add 1, each pinhole or tunnel take 1 away."""
    rng, turn = np.random.default_rng(seed), shapes.random_rotation(seed)
    flat, upright = rng.uniform(-1, 1, (2, 1500, 3))
    flat[:, 2], upright[:, 0] = 0, 0
    if name == "junction":
        upright = upright[upright[:, 2] > 0]
    sheet = single(np.concatenate([flat, upright]) @ turn.T, denoise=0).sheet
    assert shapes.euler(sheet) == 1
    assert len(shapes.components(sheet)) == 1


def test_a_sheet_that_rises_off_another_leaves_few_pockets_along_it():
    """Tangentially: both cross many edges of the grid twice, whose two quads enclosed 12 pockets."""
    random = np.random.default_rng(0)
    floor, risen = random.uniform(-1, 1, (1500, 3)), random.uniform([0, -1, 0], 1, (750, 3))
    floor[:, 2], risen[:, 2] = 0, 0.05 * risen[:, 0] ** 2
    sheet = single(np.concatenate([floor, risen]), resolution=48, denoise=0).sheet
    assert (sheet.edge_counts()[1] > 2).any()
    assert shapes.euler(sheet) <= 3


def fan(angles, both, seed):
    """Half squares that end at the y axis at some angles, or squares that pass through it, turned."""
    flat = shapes.square(1000)
    across, along = flat[:, :1] if both else 0.5 * (flat[:, :1] + 1.02), flat[:, 1:2]
    sheets = [across * [np.cos(a), 0, np.sin(a)] + (along + 1e-3 * a) * [0, 1, 0] for a in np.radians(angles)]
    return np.concatenate(sheets) @ shapes.random_rotation(seed).T


@pytest.mark.parametrize(
    ("angles", "both", "seed"), [((0, 120, 240), False, 1), ((0, 120, 240), False, 3), ((0, 45), True, 1)]
)
def test_sheets_that_meet_askew_have_no_tunnels_along_their_line(angles, both, seed):
    """Three that end at one line, of which none goes on past another, or two that cross at half a right angle. They
    shrink to a point, so their Euler characteristic is 1, that of what is around them 2."""
    run = single(fan(angles, both, seed), resolution=64, surface="both", denoise=0)
    assert shapes.euler(run.sheet) == 1
    assert shapes.euler(run.surface) == 2


@pytest.mark.parametrize(("bridge", "loops"), [(3.0, 2), (8.0, 1)])
def test_a_hole_narrower_than_bridge_closes_and_a_wider_one_stays_open(bridge, loops):
    points = shapes.holed_square(1000, radius=0.16)
    assert 3.0 < 0.32 / np.median(local_spacing(points)) < 8.0
    assert single(points, bridge=bridge).sheet.border_loops() == loops


def test_no_pinholes_at_random_voids():
    sheet = single(shapes.scattered_sphere(1500)).sheet
    assert set(sheet.edge_counts()[1]) == {2}
    assert shapes.euler(sheet) == 2


def test_a_sheet_level_with_the_grid_in_places_does_not_touch_itself():
    """Its saddles cross all four edges of some faces of the grid."""
    points = np.random.default_rng(0).uniform(-1, 1, (2500, 3))
    points[:, 2] = 0.2 * np.sin(5 * points[:, 0]) * np.sin(5 * points[:, 1])
    sheet = single(points, denoise=0).sheet
    assert sheet.edge_counts()[1].max() == 2
    assert (shapes.euler(sheet), sheet.border_loops()) == (1, 1)


@pytest.mark.parametrize("resolution", [40, 50, 60])
def test_a_cube_whose_sides_lie_on_nodes_is_one_piece(resolution):
    """With these resolutions they do, so that each node there may be taken for in or out."""
    run = reconstruct(shapes.scattered_box(2000, [2, 2, 2]), Settings(resolution=resolution, surface="both"))
    assert (run.sheet.edge_counts()[1] == 2).all()
    assert shapes.euler(run.sheet) == 2
    assert len(shapes.components(run.surface)) == 2
    assert shapes.euler(run.surface) == 4
    assert shapes.signed_volume(run.sheet) == pytest.approx(8, rel=0.02)


@pytest.mark.parametrize("seed", [5, 8, 10])
def test_a_step_whose_middle_wall_lies_on_nodes_is_one_sheet(seed):
    points = shapes.scattered_rectangles(
        [((0, 0, 0), (1, 2, 0)), ((1, 0, 0), (1, 2, 1)), ((1, 0, 1), (2, 2, 1))], 2700, seed
    )
    run = reconstruct(points, Settings(resolution=64, surface="both"))
    assert (run.sheet.edge_counts()[1] <= 2).all()
    assert (shapes.euler(run.sheet), run.sheet.border_loops()) == (1, 1)
    assert shapes.euler(run.surface) == 2


@pytest.mark.parametrize("seed", [0, 2, 4])
def test_a_wall_on_a_floor_that_lies_on_nodes_is_joined_to_it(seed):
    floor = shapes.scattered_rectangles([((0, 0, 0), (1, 1, 0))], 450, seed)
    wall = shapes.scattered_rectangles([((0, 0.5, 0), (1, 0.5, 0.5))], 450, seed + 1)
    run = reconstruct(np.concatenate([floor, wall]), Settings(resolution=40, surface="both"))
    assert len(shapes.components(run.sheet)) == len(shapes.components(run.surface)) == 1
    assert 25 < (run.sheet.edges.count == 3).sum() < 45


def hollow_box(wall):
    return np.concatenate([shapes.scattered_box(1800, [2, 2, 2]), shapes.scattered_box(1200, [2 - 2 * wall] * 3)])


@pytest.mark.parametrize("resolution", [32, 64])
def test_of_walls_much_thinner_than_points_are_apart_none_is_lost_unsaid(resolution):
    run = reconstruct(hollow_box(0.06), Settings(resolution=resolution, surface="both"))
    missed = misfit.distances(run.sheet, run.points) > 0.5 * run.field.spacing
    assert missed.mean() < 0.02
    assert misfit.askew(run.sheet, KDTree(run.points), run.normals) < 0.1


def test_a_ribbon_much_narrower_than_a_cell_has_its_area():
    points = np.random.default_rng(1).random((3000, 3)) * [1000, 2, 0]
    run = reconstruct(points, Settings(surface="single"))
    assert run.sheet.face_areas().sum() > 1500


def test_a_flap_on_a_closed_shape_is_not_lost():
    flap = shapes.disc(300, 0.4) + np.array([0, 0, 1.6])
    pieces = shapes.components(single(np.concatenate([shapes.sphere(1500), flap])).sheet)
    assert [shapes.euler(piece) for piece in pieces] == [2, 1]


def test_same_points_same_bytes(runs):
    again = single(shapes.disc(800)).sheet
    assert again.vertices.tobytes() == runs["disc"].sheet.vertices.tobytes()
    assert again.faces.tobytes() == runs["disc"].sheet.faces.tobytes()


def test_is_in_input_units_and_place():
    """A power of two and a shift that doubles hold: the same mesh, moved."""
    points, shift = np.rint(shapes.hemisphere(1500) * 2**16) / 2**16, [4096, -8192, 0]
    sheet, moved = single(points).sheet, single(points * 1024 + shift).sheet
    np.testing.assert_array_equal(moved.faces, sheet.faces)
    np.testing.assert_allclose(moved.vertices, sheet.vertices * 1024 + shift, atol=1e-6)


def test_both_gives_both(runs):
    run = reconstruct(shapes.disc(800), Settings(resolution=48, surface="both"))
    np.testing.assert_array_equal(run.sheet.vertices, runs["disc"].sheet.vertices)
    assert set(run.surface.edge_counts()[1]) == {2}


def backward_edges(mesh):
    """Edges that both their faces run through in the same direction."""
    directed = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    return len(directed) - len(np.unique(directed, axis=0))


@pytest.mark.parametrize("apart", [0.4, 0.6, 0.8])
def test_a_closed_surface_that_crosses_itself_is_closed_and_keeps_the_crossing(apart):
    """Two balls through each other: a mesh without border or branches that comes near the circle where they cross."""
    centre, ball = np.array([apart, 0, 0]), shapes.scattered_sphere(4000)
    points = np.concatenate([ball - centre, ball + centre])
    result = reconstruct(points, Settings(resolution=64, surface="single", denoise=0))
    cell, sheet = result.field.spacing, result.sheet
    assert set(sheet.edge_counts()[1]) == {2}
    assert result.report["warnings"] == []
    off = np.min([np.abs(np.linalg.norm(sheet.vertices + c, axis=1) - 1) for c in (centre, -centre)], axis=0)
    assert np.percentile(off, 99) < 0.06 * cell
    assert off.max() < 0.6 * cell
    turn = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    circle = np.sqrt(1 - apart**2) * np.stack([0 * turn, np.cos(turn), np.sin(turn)], axis=1)
    away = np.sqrt(igl.point_mesh_squared_distance(circle, sheet.vertices, sheet.faces)[0]) / cell
    assert np.median(away) < 0.15
    assert away.max() < 0.8


def test_a_closed_surface_with_an_inward_crease_stays_one_manifold():
    """Two balls grown together: along the crease it looks as if sheets met."""
    centre, radius = np.array([1.4, 0, 0]), 0.6
    ball, other = shapes.scattered_sphere(2500), centre + radius * shapes.scattered_sphere(900, 1)
    ball = ball[np.linalg.norm(ball - centre, axis=1) > radius]
    other = other[np.linalg.norm(other, axis=1) > 1]
    run = single(np.concatenate([ball, other]), resolution=64, denoise=0)
    assert set(run.sheet.edge_counts()[1]) == {2}
    assert shapes.euler(run.sheet) == 2
    assert run.report["warnings"] == []


def cones(n, seed, slope=4.0, radius=0.4):
    """A terrain: a square of side 2 with three cones on it, sampled evenly at random."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-1, 1, (3 * n, 2))
    high = radius - np.linalg.norm(x[:, None] - [[-0.4, -0.3], [0.4, -0.2], [0, 0.45]], axis=2).min(axis=1)
    kept = rng.random(3 * n) < np.where(high > 0, 1, 1 / np.hypot(1, slope))
    return np.column_stack([x, slope * np.maximum(high, 0)])[kept][:n]


@pytest.mark.parametrize(("n", "seed"), [(4000, 2), (8000, 0)])
def test_a_terrain_with_a_sharp_fold_stays_one_manifold(n, seed):
    """At a few places the fold at the foot of its cones looked like sheets that meet: there were lines of three faces,
    up to 12 cells long."""
    run = single(cones(n, seed), resolution=96, outliers=False)
    assert run.sheet.edge_counts()[1].max() == 2
    assert run.report["meshes"]["single"]["borders"] == 1
    assert run.report["warnings"] == []


def folded(angle, seed):
    """Random points on two squares that meet in a line, so many degrees apart."""
    x, y = np.random.default_rng(seed).random((2, 3000))
    turn = np.radians(angle) * (np.arange(3000) % 2)
    return np.stack([x * np.cos(turn), y, x * np.sin(turn)], axis=1)


def prism(corners, count, seed):
    """Random points on the walls over a polygon with these corners (c,2), open above and below."""
    rng, along = np.random.default_rng(seed), np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(along, axis=1)
    wall = rng.choice(len(corners), count, p=length / length.sum())
    place = corners[wall] + rng.random((count, 1)) * along[wall]
    return np.column_stack([place, rng.uniform(0, 2, count)])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("angle", [60, 75])
def test_an_open_sheet_with_a_sharp_fold_is_whole(angle, seed):
    """Cells in the wedge cannot tell which edges are crossed: there were cracks, and lines of three faces."""
    run = single(folded(angle, seed), resolution=96)
    assert run.sheet.edge_counts()[1].max() == 2
    assert run.report["meshes"]["single"]["borders"] == 1
    assert shapes.euler(run.sheet) == 1
    assert run.report["warnings"] == []


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("corners", "count"), [(3, 4000), (10, 8000)])
def test_an_open_prism_with_sharp_edges_is_whole(corners, count, seed):
    turn = 2 * np.pi * np.arange(corners) / corners
    radius = np.where((corners == 10) & (np.arange(corners) % 2 == 1), 0.5, 1)
    run = single(prism(np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1), count, seed), resolution=96)
    assert run.sheet.edge_counts()[1].max() == 2
    assert run.report["meshes"]["single"]["borders"] == 2
    assert run.report["warnings"] == []


def test_a_small_fin_is_no_chance():
    """The line where it meets a sheet is as short as at such folds, but a surface with two sides is parted there."""
    rng = np.random.default_rng(0)
    sheet, fin = rng.uniform(-1, 1, (8000, 2)), rng.uniform([-0.13, 0], [0.13, 0.26], (140, 2))
    fin = np.column_stack([fin[:, 0], np.zeros(140), fin[:, 1]])
    run = single(np.concatenate([np.column_stack([sheet, np.zeros(8000)]), fin]), resolution=128)
    h = run.field.spacing
    edges, count = run.sheet.edge_counts()
    line = run.sheet.vertices[edges[count > 2]].reshape(-1, 3)
    assert 8 * h < np.ptp(line[:, 0]) < 21 * h
    assert np.abs(line[:, 1:]).max() < 2 * h
    assert misfit.distances(run.sheet, fin).max() < 0.5 * h


@pytest.fixture
def no_walls(monkeypatch):
    """As if no piece of a double cover went around a thin wall."""
    monkeypatch.setattr(thin_walls, "_TWICE", 0)


@pytest.mark.parametrize("band", [None, 4.0])
def test_where_sheets_run_closer_than_cells_the_double_cover_is_kept(band, no_walls):
    """A ball pressed flat, .8 cells thick: as a single layer it had 140 edges of three faces and more, and holes."""
    points = shapes.scattered_sphere(4000) * [1, 1, 0.02] @ shapes.random_rotation(4).T
    run = reconstruct(points, Settings(resolution=48, surface="both", band=band, denoise=0))
    np.testing.assert_array_equal(run.sheet.vertices, run.surface.vertices)
    assert shapes.euler(run.sheet) == 2
    assert any("the double cover is in its place" in warning for warning in run.report["warnings"])
    alone = reconstruct(points, Settings(resolution=48, surface="single", band=band, denoise=0))
    np.testing.assert_array_equal(alone.sheet.vertices, run.sheet.vertices)
    assert alone.surface is None


def cup(gap, count=800):
    """Even samples of a bowl with two walls and its lip."""
    outer, inner = shapes.hemisphere(count), (1 - gap) * shapes.hemisphere(round(count * (1 - gap) ** 2))
    turn = np.linspace(0, 2 * np.pi, round(np.sqrt(2 * np.pi * count)), endpoint=False)
    lip = (1 - gap / 2) * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(len(turn))])
    return np.concatenate([outer, inner, lip]) @ shapes.random_rotation(3).T


def test_a_single_layer_that_samples_are_near_but_that_runs_to_and_fro_is_torn(no_walls):
    """Of walls 1.4 cells apart it was .03 cells off the samples, with half its faces across the walls."""
    points = cup(0.07)
    run = reconstruct(points, Settings(resolution=48, surface="both", denoise=0))
    np.testing.assert_array_equal(run.sheet.vertices, run.surface.vertices)
    assert any("the double cover is in its place" in warning for warning in run.report["warnings"])
    assert misfit.askew(run.sheet, KDTree(run.points), run.normals) < 0.1


def test_a_single_layer_that_misses_many_samples_is_torn():
    """Of a blade, less than a cell thick and with points in rows around it, there was a strip a row."""
    turn, rows = np.linspace(0, 2 * np.pi, 120, endpoint=False), np.linspace(-0.4, 0.4, 67)
    rise = np.sign(np.sin(turn)) * np.sqrt(np.abs(np.sin(turn)))
    around = np.column_stack([0.035 * np.cos(turn), 0.003 * rise])
    points = np.column_stack([np.repeat(rows, 120), np.tile(around, (67, 1))])
    run = reconstruct(points, Settings(surface="both"))
    np.testing.assert_array_equal(run.sheet.vertices, run.surface.vertices)
    assert len(shapes.components(run.sheet)) == 1
    assert any("the double cover is in its place" in warning for warning in run.report["warnings"])


def test_parts_of_a_large_scene_that_are_torn_are_told():
    """Of poles 1.2 cells thick on a floor, with a twentieth of the samples each; whole they are in finer cells."""
    rng = np.random.default_rng(2)
    scene = [np.column_stack([rng.uniform(-5, 5, (8000, 2)), np.zeros(8000)])]
    for x in (-3, -1, 1, 3):
        turn, z = rng.uniform(0, 2 * np.pi, 330), rng.uniform(0, 3, 330)
        scene.append(np.column_stack([x + 0.06 * np.cos(turn), 0.06 * np.sin(turn), z]))
    run = reconstruct(np.concatenate(scene), Settings(surface="single"))
    (said,) = (warning for warning in run.report["warnings"] if "more than a cell off the single layer" in warning)
    place = np.array(re.search(r"near \((.*)\), as", said)[1].split(", "), float)
    off = np.sqrt(igl.point_mesh_squared_distance(run.points, run.sheet.vertices, run.sheet.faces)[0])
    lacking = run.points[off > run.field.spacing]
    assert 0.5 * len(lacking) < int(said.split()[2]) <= len(lacking)
    assert KDTree(lacking).query(place)[0] < 1e-6
    assert place[2] > 0.1
    finer = reconstruct(np.concatenate(scene), Settings(surface="single", resolution=256))
    assert not any("lacks thin parts" in warning for warning in finer.report["warnings"])


def test_where_points_are_too_few_for_a_single_layer_no_finer_grid_is_advised():
    corners = np.indices((2, 2, 2)).reshape(3, 8).T
    (warning,) = reconstruct(corners, Settings(resolution=32, surface="single")).report["warnings"]
    assert "the double cover is in its place" in warning
    assert "more points part them" in warning
    assert "resolution" not in warning


@pytest.mark.parametrize("seed", [0, 1])
def test_edges_of_a_cube_of_random_points_are_sharp(seed):
    """Of faces beside edges hardly any is off the cube. One in ten or fifteen was while only bent vertices were looked
    at, and not those beside them."""
    random, turn = np.random.default_rng(seed), shapes.random_rotation(seed)
    points, side = random.uniform(-1, 1, (3000, 3)), random.integers(0, 6, 3000)
    points[np.arange(3000), side % 3] = np.where(side < 3, 1, -1)
    run = single(points @ turn.T, resolution=64)
    middles = np.abs(run.sheet.vertices[run.sheet.faces].mean(axis=1) @ turn) - 1
    cell = run.field.spacing
    beside = np.sort(middles, axis=1)[:, 1] > -1.5 * cell
    assert beside.sum() > 2000
    assert (np.abs(middles.max(axis=1))[beside] > 0.1 * cell).mean() < 0.01


@pytest.mark.parametrize("seed", [0, 1])
def test_sheets_that_bend_meet_along_their_line(seed):
    """A wall on a cylinder, at random samples askew to the grid. A tenth of the vertices there was .1 to .2 cells off
    while the crossings of grid edges told the line."""
    random, turn = np.random.default_rng(seed), shapes.random_rotation(seed)
    angle, y, rise = random.uniform(-1.2, 1.2, 2600), random.uniform(-1, 1, 3800), random.uniform(1, 2, 1200)
    tube = np.column_stack([np.cos(angle), y[:2600], np.sin(angle)])
    wall = np.column_stack([rise, y[2600:], 0 * rise])
    run = single(np.concatenate([tube, wall]) @ turn.T, resolution=64)
    edges, counts = run.sheet.edge_counts()
    on = run.sheet.vertices[np.unique(edges[counts > 2])] @ turn
    off = np.hypot(on[:, 0] - 1, on[:, 2]) / run.field.spacing
    assert len(on) > 30
    assert np.percentile(off, 90) < 0.05


@pytest.mark.parametrize("seed", [0, 1])
def test_sheets_that_meet_others_are_sharp_where_they_fold(seed):
    """A floor, z = 0, a wall on it, x = 0, and a roof, z = 1, that leads away from the wall's upper edge."""
    random, turn = np.random.default_rng(seed), shapes.random_rotation(seed)
    floor, wall, roof = np.split(random.uniform(-1, 1, (6000, 3)), [3000, 4500])
    floor[:, 2], wall[:, 0], roof[:, 2] = 0, 0, 1
    wall[:, 2], roof[:, 0] = np.abs(wall[:, 2]), np.abs(roof[:, 0])
    run = single(np.concatenate([floor, wall, roof]) @ turn.T, resolution=64)
    middles, cell = run.sheet.vertices[run.sheet.faces].mean(axis=1) @ turn, run.field.spacing
    beside = (np.hypot(middles[:, 0], middles[:, 2] - 1) < 1.5 * cell) & (np.abs(middles[:, 1]) < 0.9)
    off = np.minimum(np.abs(middles[:, 0]), np.abs(middles[:, 2] - 1))[beside]
    assert beside.sum() > 200
    assert (off > 0.1 * cell).mean() < 0.03


@pytest.mark.parametrize("kind", ["single", "signed"])
def test_thin_walls_have_no_holes(kind):
    """Walls .96 cells thick, in which so few nodes lie that the zero set of signed distances had five holes."""
    run = single(shapes.scattered_tube(12_000, 0.04), resolution=40, surface=kind, denoise=0)
    mesh = run.sheet if kind == "single" else run.surface
    assert 0.9 < 0.04 / run.report["grid"]["cell"] < 1
    assert (mesh.edge_counts()[1] == 2).all()
    assert [shapes.euler(part) for part in shapes.components(mesh)] == [0]
    assert shapes.signed_volume(mesh) == pytest.approx(np.pi * (0.5**2 - 0.46**2), rel=0.05)
    assert run.report["warnings"] == []


def test_what_is_around_walls_is_taken_only_if_it_is_closer(monkeypatch):
    """Were it farther off than what has the holes, these would stay."""
    monkeypatch.setattr(routes, "chamfer", lambda *given: -misfit.chamfer(*given))
    run = single(shapes.scattered_tube(12_000, 0.04), resolution=40, denoise=0)
    assert shapes.euler(run.sheet) < 0
