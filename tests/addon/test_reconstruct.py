"""The operator from a selected object to objects in the scene, on a small sphere."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

SETTINGS = dict(resolution=32)
FAR = np.array([3.5e5, 5.5e6, 120.0])


def contents(bpy):
    """Every data-block of the kinds the extension makes."""
    kinds = ("collections", "objects", "meshes", "pointclouds", "volumes", "node_groups")
    return {(kind, block.name) for kind in kinds for block in getattr(bpy.data, kind)}


def coordinates(items, name="co"):
    flat = np.empty(3 * len(items), np.float32)
    items.foreach_get(name, flat)
    return flat.reshape(-1, 3)


def world(obj, items, name="co"):
    matrix = np.array(obj.matrix_world, np.float64)
    return coordinates(items, name) @ matrix[:3, :3].T + matrix[:3, 3]


def grids_of(volume):
    volume.grids.load()
    return {grid.name for grid in volume.grids}


@pytest.fixture
def expected(extension):
    """Function: what the core makes of points, without Blender."""

    def expected(points):
        return extension("core.pipeline").reconstruct(points, extension("core.settings").Settings(**SETTINGS))

    return expected


@pytest.fixture
def folder(blender, tmp_path):
    """A folder with the saved .blend in it."""
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return tmp_path


@pytest.fixture
def scan(blender, add_mesh, sphere):
    return add_mesh("Scan", sphere)


@pytest.fixture
def run(blender):
    """Function: run the operator, return the collection's objects by the last word of their name."""

    def run(**settings):
        assert blender.ops.vad.reconstruct(**SETTINGS | settings) == {"FINISHED"}
        blender.context.view_layer.update()
        return {obj.name.split()[1].partition(".")[0]: obj for obj in blender.context.scene.vad.result.objects}

    return run


@pytest.mark.parametrize("location", [np.zeros(3), FAR], ids=["origin", "far"])
def test_objects_lie_where_the_core_puts_them(folder, run, scan, sphere, expected, location):
    scan.location = location
    scan.scale = 50, 50, 80
    objects = run()
    local = np.array([50, 50, 80]) * sphere.astype(np.float32)
    result = expected(local + np.array(scan.location))

    near = 1e-5 * 80  # single precision of an object this size, wherever it lies
    samples, surface, field = objects["samples"], objects["surface"], objects["field"]
    positions = samples.data.attributes["position"].data
    assert_allclose(world(samples, positions, "vector"), result.points, atol=near, rtol=0)
    assert_allclose(world(surface, surface.data.vertices), result.surface.vertices, atol=near, rtol=0)
    faces = np.array([polygon.vertices for polygon in surface.data.polygons])
    assert np.array_equal(faces, result.surface.faces)
    corner = np.array(field.data.grids["udf"].matrix_object, np.float64)[:3, 3] + np.array(field.location, np.float64)
    assert_allclose(corner, result.field.origin, atol=near, rtol=0)


def test_the_samples_carry_normals_and_confidence(folder, run, scan, sphere, expected):
    samples, result = run()["samples"].data, expected(sphere.astype(np.float32))
    assert samples.attributes["normal"].data_type == "FLOAT_VECTOR"
    assert samples.attributes["confidence"].data_type == "FLOAT"
    confidence = np.empty(len(result.points), np.float32)
    samples.attributes["confidence"].data.foreach_get("value", confidence)
    assert_allclose(confidence, result.confidence, atol=1e-6)
    assert_allclose(coordinates(samples.attributes["normal"].data, "vector"), result.normals, atol=1e-6)


def test_the_surface_is_a_clean_closed_smooth_mesh(folder, run, scan):
    surface = run()["surface"].data
    edges = np.array([polygon.edge_keys for polygon in surface.polygons]).reshape(-1, 2)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert len(surface.edges) == len(np.unique(edges, axis=0))
    assert not surface.validate()
    assert all(polygon.use_smooth for polygon in surface.polygons)


def test_quads_where_asked_for(blender, folder, run, scan, extension):
    surface = run(faces="quads", surface="both")
    for role in ("surface", "sheet"):
        mesh = surface[role].data
        sizes = np.array([len(polygon.vertices) for polygon in mesh.polygons])
        assert len(sizes) > 500
        assert (sizes == 4).all()
        assert not mesh.validate()
    lines = extension("vad_addon.results").summary(blender.context.scene.vad.result)
    assert f"{len(sizes):,} quads in the single layer" in lines


def test_the_volume_lies_beside_the_saved_file(folder, run, scan):
    volume = run()["field"].data
    assert volume.filepath == "//vad/Scan.vdb"
    assert (folder / "vad" / "Scan.vdb").stat().st_size > 1000
    assert grids_of(volume) == {"udf", "density"}


@pytest.mark.parametrize("grid", ["density", "udf"])
def test_the_volume_shows_the_grid_asked_for(folder, run, scan, extension, grid):
    run()
    volume = extension("vad_addon.datablocks").volume_data("again", folder / "vad" / "Scan.vdb", grid)
    assert volume.grids[volume.grids.active_index].name == grid


def test_no_run_overwrites_the_file_of_another(folder, run, scan):
    first = run()["field"].data
    before = (folder / "vad" / "Scan.vdb").read_bytes()
    second = run(resolution=16, keep_both=True)["field"].data
    assert second.filepath == "//vad/Scan_001.vdb"
    assert (folder / "vad" / "Scan.vdb").read_bytes() == before
    assert grids_of(first) == grids_of(second) == {"udf", "density"}


def test_an_unsaved_file_gets_its_volume_in_a_folder_of_this_session(blender, run, scan):
    path = Path(run()["field"].data.filepath)
    assert path.is_file()
    assert path.is_relative_to(blender.app.tempdir)


def test_no_surface_where_none_is_asked(folder, run, scan):
    assert set(run(surface="none")) == {"samples", "field"}


def test_the_source_stays_as_it_is_and_active(blender, folder, run, scan, sphere):
    before = contents(blender)
    run()
    assert blender.context.active_object is scan
    assert_allclose(coordinates(scan.data.vertices), sphere, atol=1e-7)
    made = {(kind, name) for kind, name in contents(blender) - before}
    assert made == {
        ("collections", "Scan VAD"),
        *(("objects", f"Scan {name}") for name in ("samples", "surface", "field")),
        ("pointclouds", "Scan samples"),
        ("meshes", "Scan surface"),
        ("volumes", "Scan field"),
    }


def test_the_last_run_is_summarised_and_its_report_kept(blender, folder, run, scan, extension):
    run()
    result = blender.context.scene.vad.result
    lines = extension("vad_addon.results").summary(result)
    assert lines[0] == "500 samples"
    assert f"{len(blender.data.meshes['Scan surface'].polygons):,} triangles" in lines
    assert float(lines[-1].removesuffix(" s")) >= 0
    assert json.loads(result["vad_report"])["settings"]["resolution"] == 32


def test_a_point_cloud_works_as_the_source(blender, folder, run, scan, add):
    cloud = run()["samples"].data.copy()
    scan.select_set(False)
    add("Cloud", cloud)
    assert {"samples", "surface", "field"} == set(run())
    (again,) = (obj for obj in blender.context.scene.vad.result.objects if obj.type == "POINTCLOUD")
    assert again.name == "Cloud samples"
    assert len(again.data.attributes["position"].data) == 500


def test_a_run_is_repeated_from_its_results(blender, folder, run, scan):
    made = run()
    scan.hide_set(True)
    scan.select_set(False)
    blender.context.view_layer.objects.active = made["surface"]
    assert run(resolution=24) == made


def test_one_undo_takes_everything_away(blender, folder, scan):
    blender.ops.ed.undo_push(message="before")
    before = contents(blender)
    blender.ops.vad.reconstruct("EXEC_DEFAULT", True, **SETTINGS)
    assert contents(blender) > before
    blender.ops.ed.undo()
    assert contents(blender) == before
    assert blender.context.scene.vad.result is None
    blender.ops.ed.redo()
    assert grids_of(blender.data.volumes["Scan field"]) == {"udf", "density"}


def refused(bpy, message):
    before = contents(bpy)
    with pytest.raises(RuntimeError, match=message) as caught:
        bpy.ops.vad.reconstruct(**SETTINGS)
    assert "Traceback" not in str(caught.value)
    assert contents(bpy) == before
    assert bpy.context.scene.vad.result is None


def test_nothing_selected_is_refused(blender):
    refused(blender, "No active object: select a point cloud or a mesh")


def test_other_objects_are_refused(blender, add):
    add("Eye", blender.data.cameras.new("Eye"))
    refused(blender, r"Eye \(camera\) holds no points")


@pytest.mark.parametrize("count", [0, 3])
def test_too_few_points_are_refused(blender, add_mesh, sphere, count):
    add_mesh("Scan", sphere[:count])
    refused(blender, f"{count} ")


@pytest.mark.parametrize("stage", ["run", "deliver"])
def test_a_failure_on_the_way_leaves_nothing_behind(blender, folder, scan, extension, monkeypatch, stage):
    error = extension("core.errors").VADError("no luck")

    def fail(*arguments, **keywords):
        raise error

    if stage == "run":
        monkeypatch.setattr(extension("core.pipeline"), "reconstruct", fail)
    else:
        monkeypatch.setattr(extension("vad_addon.datablocks"), "volume_data", fail)
    refused(blender, "no luck")
    assert not list(folder.rglob("*.vdb"))


def test_a_run_beyond_the_memory_limit_says_what_it_needs_and_what_to_do(blender, scan):
    said = r"resolution 512 needs about \d+ MiB; 64 MiB may be used; use resolution \d+ or less, or raise memory_limit"
    with pytest.raises(RuntimeError, match=said):
        blender.ops.vad.reconstruct(resolution=512, memory_limit="64")


def test_without_openvdb_the_other_results_are_delivered(blender, folder, run, scan, extension, monkeypatch, capfd):
    missing = extension("core.errors").MissingDependency("OpenVDB is missing")

    def fail(*arguments, **keywords):
        raise missing

    monkeypatch.setattr(extension("vad_addon.outcome"), "write_vdb", fail)
    assert set(run()) == {"samples", "surface"}
    assert "Warning: No volume: OpenVDB is missing" in capfd.readouterr().out
    assert not list(folder.rglob("*.vdb"))


def test_a_folder_that_cannot_be_written_costs_only_the_volume(blender, folder, run, scan, extension, capfd):
    (folder / "vad").write_text("a file where the folder should be")
    assert set(run()) == {"samples", "surface"}
    (warning,) = extension("vad_addon.results").warnings(blender.context.scene.vad.result)
    assert warning.startswith(f"No volume: nothing can be written into {folder / 'vad'}")
    assert f"Warning: {warning}" in capfd.readouterr().out
