"""Every stage alone, as the README shows it, gives what a whole run gives."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

import core
from core import (
    InputError,
    Settings,
    SettingsError,
    both_sides,
    denoise,
    distance_field,
    double_cover,
    estimate_normals,
    find_crossings,
    find_sides,
    fit_grid,
    fit_local_surface,
    local_spacing,
    reconstruct,
    remove_outliers,
    single_layer,
)
from core.io.points import read_points
from tests import shapes

ROOT = Path(__file__).resolve().parents[2]


def shown(first):
    """The README's Python example that starts with this line."""
    (script,) = re.findall(
        rf"```python\n({re.escape(first)}.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL
    )
    return script


def test_stages_in_a_row_are_the_whole_run(monkeypatch):
    monkeypatch.chdir(ROOT)
    found = {}
    exec(shown("from core import denoise"), found)
    points = read_points("tests/data/bust.ply")
    whole = reconstruct(points, Settings(resolution=64, surface="both"))
    assert len(found["points"]) == len(whole.points)
    agreement = np.abs(np.einsum("ni,ni->n", found["normals"], whole.normals))
    assert np.median(agreement) > 0.9999
    assert found["values"].shape == whole.field.values.shape
    assert np.abs(found["values"] - whole.field.values).mean() < 0.02 * whole.field.spacing
    for mesh, expected in ((found["cover"], whole.surface), (found["sheet"], whole.sheet)):
        assert abs(len(mesh.faces) - len(expected.faces)) < 0.02 * len(expected.faces)
    assert len(found["both"].faces) >= 2 * len(found["sheet"].faces)


def test_all_public_names_are_there_and_no_others():
    for name in core.__all__:
        assert getattr(core, name).__name__ == name
    assert not hasattr(core, "no_such_name")


def test_settings_and_errors_alone_need_no_scipy():
    code = "import sys, core; core.Settings, core.VADError; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT).returncode == 0


def test_stages_alone_refuse_what_a_run_refuses():
    points = shapes.sphere(300)
    spacing, grid = local_spacing(points), fit_grid(points, 16)
    for resolution in (0, float("nan"), float("inf"), 1e300, "24"):
        with pytest.raises(
            SettingsError, match=f"resolution is {re.escape(repr(resolution))}; a grid needs a number of cells"
        ):
            fit_grid(points, resolution)
    for nothing in ([], "abc", points[:, :2], [[0, 0, 0], [1, 1]], points + 1j):
        with pytest.raises(InputError, match=r"give an \(n,3\) array"):
            fit_grid(nothing, 16)
    with pytest.raises(InputError, match="0 points given; at least 1"):
        fit_grid(np.empty((0, 3)), 16)
    with pytest.raises(SettingsError, match="denoise is 5"):
        denoise(points, spacing, 5)
    with pytest.raises(SettingsError, match="seed is -1"):
        denoise(points, spacing, 0.5, -1)
    for row in (300, -1):
        with pytest.raises(InputError, match=f"row {row} the first"):
            estimate_normals(points, spacing, constraints=([row], [[0, 0, 1.0]]))
    for wrong, message in ((0.1, r"shape \(\)"), (spacing[:5], r"shape \(5,\)"), (0 * spacing, "not above 0")):
        for stage in (denoise, estimate_normals):
            with pytest.raises(InputError, match=message):
                stage(points, wrong)
    with pytest.raises(InputError, match="3 points given; at least 4"):
        estimate_normals(points[:3], spacing[:3])
    for normals, confidence, message in (
        (points[:5], np.ones(300), r"shapes \(5, 3\) and \(300,\) for 300 points"),
        (points, np.ones(5), r"shapes \(300, 3\) and \(5,\) for 300 points"),
        (0 * points, np.ones(300), "300 known normals have no direction"),
    ):
        with pytest.raises(InputError, match=message):
            fit_local_surface(points, normals, confidence, spacing, 3.0)
    for size in (1e-20, 1e20):
        with pytest.raises(InputError, match=r"the points span .* from 1e-07 to 1e\+10"):
            fit_local_surface(size * points, points, np.ones(300), size * spacing, 3.0)
    for size in (1e-120, 1e-61, 1e61, 1e300):
        for stage in (remove_outliers, lambda x: denoise(x, spacing), lambda x: estimate_normals(x, spacing)):
            with pytest.raises(InputError, match=r"the points span .* from 1e-60 to 1e\+60"):
                stage(size * points)
    twice = np.vstack([points[:299], points[:1]])
    for stage in (
        denoise,
        estimate_normals,
        lambda x, s: estimate_normals(x, s, Settings(solver="energy", backend="numpy")),
        lambda x, s: fit_local_surface(x, points, np.ones(300), s, 3.0),
    ):
        for copies in (twice, 0 * points):
            with pytest.raises(InputError, match=r"occur twice.*numpy\.unique\(points, axis=0\)|the points span 0"):
                stage(copies, spacing)
    for bridge in (0, -1, 100, float("nan"), float("inf"), "3"):
        with pytest.raises(SettingsError, match=f"bridge is {bridge!r}; it must be a number from 1.5 to 20.0"):
            fit_local_surface(points, points, np.ones(300), spacing, bridge)
    surface = fit_local_surface(points.tolist(), points.tolist(), [1] * 300, spacing, 3.0)
    for words in ({"integration": "foo"}, {"integration": "poisson", "diffusion": "foo"}):
        with pytest.raises(SettingsError, match="is 'foo'; choose one of"):
            distance_field(surface, grid, **words)
    values, near = distance_field(surface, grid)
    for offset in (30, 0, float("nan"), "1"):
        with pytest.raises(SettingsError, match=f"offset is {offset!r}; it must be above 0 and at most 1.6 cells"):
            double_cover(values, near, surface, grid, offset)
    for other in (fit_grid(points + 100, 16), fit_grid(points / 2, 16)):
        with pytest.raises(InputError, match="give a grid that holds it"):
            distance_field(surface, other)
        with pytest.raises(InputError, match="give a grid that holds it"):
            double_cover(values, near, surface, other, 1)
    crossings, finer = find_crossings(near, surface, grid), fit_grid(points, 24)
    sides = find_sides(values, crossings, surface, grid)
    for stage in (
        lambda: double_cover(values, near, surface, finer, 1),
        lambda: find_crossings(near, surface, finer),
        lambda: find_sides(values, crossings, surface, finer),
        lambda: single_layer(values, near, crossings, sides, surface, finer),
    ):
        with pytest.raises(InputError, match=r"distances have shape \(17, 17, 17\) and the grid"):
            stage()
    with pytest.raises(InputError, match=r"distances have shape \(\) and the grid"):
        double_cover(None, near, surface, grid, 1)
    sheet, _ = single_layer(values, near, crossings, sides, surface, grid)
    for cell in (0, -1.0, float("nan"), float("inf"), None, points):
        with pytest.raises(SettingsError, match=f"cell is {re.escape(repr(cell))}; it must be a length above 0"):
            both_sides(sheet, cell)


@pytest.mark.parametrize("solver", ["reflection", "pca", "energy"])
def test_axes_given_to_the_stage_of_normals_may_have_any_length(solver):
    points = shapes.sphere(100).tolist()
    settings = Settings(solver=solver, backend="numpy")
    normals, _, _ = estimate_normals(points, local_spacing(points), settings, ([7], [[0, 3.0, 4.0]]))
    np.testing.assert_allclose(normals[7], [0, 0.6, 0.8])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)


@pytest.mark.parametrize(
    ("scale", "centre"),
    [(1e9, (0, 0, 0)), (1e-6, (0, 0, 0)), (1, (4e5, 5e6, 100)), (1e3, (-1e9, 0, 1e8))],
    ids=["nanometres", "tiny", "map coordinates", "far off"],
)
def test_stages_follow_scale_and_place(scale, centre):
    """A sphere's normals, distances and meshes, each as close as on the unit sphere at the origin."""
    true = shapes.sphere(400)
    points = true * scale + centre
    spacing = local_spacing(points)
    normals, confidence, _ = estimate_normals(points, spacing)
    assert np.abs((normals * true).sum(axis=1)).min() > 0.998

    surface, grid = fit_local_surface(points, normals, confidence, spacing, bridge=3), fit_grid(points, 24)
    values, near = distance_field(surface, grid)
    x = (grid.positions(np.arange(values.size)) - centre) / scale
    off = np.abs(values.ravel() / scale - shapes.sphere_distance(x)) * scale / grid.spacing
    assert off.mean() < 0.02

    crossings = find_crossings(near, surface, grid)
    sheet, unoriented = single_layer(
        values, near, crossings, find_sides(values, crossings, surface, grid), surface, grid
    )
    assert not unoriented
    for mesh in (double_cover(values, near, surface, grid, 0.5), sheet):
        assert (mesh.edge_counts()[1] == 2).all()
        assert shapes.sphere_distance((mesh.vertices - centre) / scale).max() < 0.02


@pytest.mark.parametrize("shape", [shapes.disc(300), shapes.junction(400)], ids=["disc", "junction"])
@pytest.mark.parametrize("scale", [1e-6, 1e3, 1e9])
def test_meshes_of_open_shapes_follow_the_scale(shape, scale):
    """None of what is divided by lengths that may be zero passes what numbers can hold."""

    def meshes(points):
        normals, confidence, _ = estimate_normals(points, local_spacing(points))
        surface = fit_local_surface(points, normals, confidence, local_spacing(points), bridge=3)
        grid = fit_grid(points, 24)
        values, near = distance_field(surface, grid)
        crossings = find_crossings(near, surface, grid)
        sides = find_sides(values, crossings, surface, grid)
        sheet, _ = single_layer(values, near, crossings, sides, surface, grid)
        return sheet, both_sides(sheet, grid.spacing), double_cover(values, near, surface, grid, 1.0)

    for found, expected in zip(meshes(scale * shape), meshes(shape), strict=True):
        assert abs(len(found.faces) - len(expected.faces)) < 0.02 * len(expected.faces)
        assert KDTree(expected.vertices).query(found.vertices / scale)[0].max() < 0.05
