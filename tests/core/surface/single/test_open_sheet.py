"""Single layers of open, creased surfaces: the zero set of their signed distances, as far as their rims."""

import re

import numpy as np
import pytest
from scipy.spatial import KDTree

from core import Settings, reconstruct
from core.errors import MissingDependency
from core.io.points import read_points
from core.surface.single.open_sheet import _apart
from tests import shapes


def single(points, **settings):
    return reconstruct(points, Settings(**{"resolution": 64, "surface": "single", "denoise": 0, **settings}))


def box(n, seed):
    """Random samples of a box without a lid, side 2, and its rotation."""
    random, turn = np.random.default_rng(seed), shapes.random_rotation(seed)
    points, face = random.uniform(-1, 1, (n, 3)), random.integers(0, 5, n)
    points[np.arange(n), face // 2] = np.where(face % 2, 1, -1)
    return points @ turn.T, turn


@pytest.mark.parametrize(("n", "seed"), [(1500, 1), (3000, 4), (8000, 3)])
def test_an_open_box_is_one_sheet_with_sharp_edges(n, seed):
    """Its creases looked as if sheets met: they had edges of three faces, and could not be wound alike."""
    points, turn = box(n, seed)
    run = single(points)
    assert run.report["warnings"] == []
    assert (shapes.euler(run.sheet), run.sheet.border_loops()) == (1, 1)
    assert run.sheet.edge_counts()[1].max() == 2
    off = np.abs(np.abs(run.sheet.vertices @ turn).max(axis=1) - 1)
    assert np.percentile(off, 99) < 0.15 * run.field.spacing
    low = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
    height = np.linspace(-0.9, 0.9, 50)
    edges = np.concatenate([np.column_stack([np.tile(corner, (50, 1)), height]) for corner in low])
    to_edge = KDTree(run.sheet.vertices).query(edges @ turn.T)[0] / run.field.spacing
    assert np.median(to_edge) < 0.5


@pytest.mark.parametrize(("n", "seed"), [(6000, 4), (8000, 2), (8000, 6), (8000, 9)])
def test_an_open_box_has_no_holes_along_its_edges(n, seed):
    """Corners that no node lies in were taken for thin parts, also beside rims, and what is off such parts for the end
    of the sheet."""
    sheet = single(box(n, seed)[0]).sheet
    assert (shapes.euler(sheet), sheet.border_loops()) == (1, 1)


def test_its_rim_is_where_the_samples_end():
    points, turn = box(8000, 3)
    sheet = single(points).sheet
    edges, counts = sheet.edge_counts()
    rim = sheet.vertices[np.unique(edges[counts == 1])] @ turn
    spacing = np.sqrt(20 / 8000)
    assert np.abs(rim[:, 2] - 1).max() < 1.5 * spacing


def test_a_creased_scan_is_wound_alike():
    """A bust, open below: of its dual contour 246 edges have three faces or more, and 293 cannot be wound alike. What
    lies between its sides was in ten pieces, and went to and fro between the two walls of its foot. Of its points with
    one in fourteen left out, the side of the double cover has one to three borders: slits may show neither wall."""
    run = single(read_points("tests/data/bust.ply"), resolution=128, denoise="auto")
    assert run.sheet.edge_counts()[1].max() == 2
    assert len(shapes.components(run.sheet)) == 1
    assert run.sheet.border_loops() <= 2
    edges, count = run.sheet.edge_counts()
    ends = run.sheet.vertices[edges[count == 1]].mean(axis=1)
    assert (ends[:, 2] > -4.5).sum() < 0.1 * len(ends)  # the foot is at -4.65
    (warning,) = run.report["warnings"]
    assert re.match("[34]% of the points lie more than 0.5 cells off the single layer", warning)
    away = KDTree(run.sheet.vertices).query(run.points)[0] / run.field.spacing
    assert np.percentile(away, 99) < 1.2
    assert away.max() < 3  # behind the ears, in slits narrower than two cells


@pytest.mark.parametrize(("degrees", "seed"), [(70, 3), (56, 1), (56, 10), (45, 1), (45, 2), (40, 1)])
def test_sheets_that_pass_through_each_other_askew_meet_in_a_line(degrees, seed):
    """Two squares. At 40 degrees walls of up to two cells stood between them beside the line, with 20 tunnels and more;
    at 56 they turned off there."""
    random, turn = np.random.default_rng(seed), shapes.random_rotation(seed)
    flat, other = random.uniform(-1, 1, (2, 1500, 3))
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    flat[:, 2], other = 0, other[:, :1] * [c, 0, s] + other[:, 1:2] * [0, 1, 0]
    points = np.concatenate([flat, other]) @ turn.T
    run = single(points, resolution=128)
    assert run.report["warnings"] == []
    assert KDTree(run.sheet.vertices).query(points)[0].max() < 1.5 * run.field.spacing
    edges, count = run.sheet.edge_counts()
    line = run.sheet.vertices[np.unique(edges[count > 2])] @ turn / run.field.spacing
    assert np.hypot(line[:, 0], line[:, 2]).max() < 1
    assert np.histogram(line[:, 1], np.linspace(-40, 40, 21))[0].all()
    assert -4 <= shapes.euler(run.sheet) <= 1
    middle = run.sheet.vertices[run.sheet.faces].mean(axis=1) @ turn / run.field.spacing
    off = np.minimum(np.abs(middle[:, 2]), np.abs(middle @ [s, 0, -c]))
    assert np.percentile(off, 99.9) < 0.3


def test_a_pinched_sheet_has_its_line():
    """Whitney's umbrella: a sheet that turned off on either side of the line was torn where that ends."""
    random = np.random.default_rng(1)
    u, v = random.uniform(-1, 1, (2, 6000))
    run = single(np.column_stack([u * v, u, v**2]))
    edges, count = run.sheet.edge_counts()
    line = run.sheet.vertices[np.unique(edges[count > 2])] / run.field.spacing
    assert np.hypot(line[:, 0], line[:, 1]).max() < 1
    top = 1 / run.field.spacing
    assert np.histogram(line[:, 2], np.linspace(2, top - 2, 11))[0].all()


@pytest.mark.parametrize("n", [1500, 8000])
def test_a_band_gives_the_same(n):
    points, _ = box(n, 1)
    whole, band = single(points).sheet, single(points, band=4.0).sheet
    np.testing.assert_array_equal(band.vertices, whole.vertices)
    np.testing.assert_array_equal(band.faces, whole.faces)


def test_without_openvdb(monkeypatch):
    """From marching cubes' triangles: the same surface."""
    points, _ = box(3000, 4)
    dual = single(points)

    def absent():
        raise MissingDependency("no OpenVDB")

    monkeypatch.setattr("core.surface.meshing.isosurface.load_openvdb", absent)
    run = single(points)
    assert run.report["warnings"] == []
    assert (shapes.euler(run.sheet), run.sheet.border_loops()) == (1, 1)
    assert KDTree(dual.sheet.vertices).query(run.sheet.vertices)[0].max() < 1.5 * run.field.spacing


def test_sheets_with_one_vertex_in_common_are_parted():
    vertices = np.random.default_rng(0).normal(size=(10, 3))
    faces = np.array([[0, 1, 2, 3], [3, 2, 4, 5], [5, 6, 7, 8], [0, 6, 9, 1]])
    parted, moved = _apart(vertices, faces)
    np.testing.assert_array_equal(parted[moved], vertices[faces])
    assert len(parted) == 10 + 2  # 5 and 6 are shared by sheets: the third face's own
    assert not np.isin(moved[2], moved[[0, 1, 3]]).any()
    assert np.isin(moved[0][[0, 1]], moved[3]).all()


def test_sheets_are_parted_however_many_there_are():
    count = 40_000  # times their vertices is more than 32 bits hold
    vertices = np.random.default_rng(0).normal(size=(4 * count, 3))
    faces = np.arange(4 * count, dtype=np.int32).reshape(-1, 4)
    parted, moved = _apart(vertices, faces)
    np.testing.assert_array_equal(parted[moved], vertices[faces])
