"""One stage alone, and everything after the normals anew."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal


@pytest.fixture
def folder(blender, tmp_path):
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return tmp_path


@pytest.fixture
def noisy(sphere):
    """The sphere with noise of a hundredth of its radius, and a stray."""
    points = sphere * (1 + 0.01 * np.random.default_rng(0).normal(size=(500, 1)))
    points[7] = 3, 3, 3
    return points


@pytest.fixture
def scan(blender, folder, add_mesh, noisy):
    """Points that carry their number, off the origin and scaled; two axes are fixed by hand."""
    obj = add_mesh("Scan", noisy)
    obj.location, obj.scale = (10, 0, 0), (2, 2, 2)
    obj.data.attributes.new("number", "INT", "POINT").data.foreach_set("value", np.arange(500))
    axes = np.zeros((500, 3), np.float32)
    axes[[3, 400]] = 0, 0, 1
    obj.data.attributes.new("vad_axis", "FLOAT_VECTOR", "POINT").data.foreach_set("vector", axes.ravel())
    blender.context.view_layer.update()
    return obj


def values(cloud, name, slot="value", width=1):
    flat = np.empty(width * len(cloud.attributes[name].data), np.float32)
    cloud.attributes[name].data.foreach_get(slot, flat)
    return flat.reshape(-1, width) if width > 1 else flat


def positions(obj):
    return values(obj.data, "position", "vector", 3) + np.array(obj.location)


def radii(obj):
    return np.linalg.norm(positions(obj) - [10, 0, 0], axis=1) / 2


def by_role(bpy):
    return {obj["vad_role"]: obj for obj in bpy.context.scene.vad.result.objects}


def test_cleaned_points_are_a_copy_with_all_that_they_carry(blender, scan, noisy):
    before = values(scan.data, "position", "vector", 3)
    assert blender.ops.vad.denoise() == {"FINISHED"}
    made = blender.context.view_layer.objects.active
    assert (made.name, made.type) == ("Scan cleaned", "POINTCLOUD")
    assert_array_equal(values(scan.data, "position", "vector", 3), before)
    assert scan.hide_get()
    number = values(made.data, "number").astype(int)
    assert_array_equal(number, np.delete(np.arange(500), 7))
    assert np.abs(radii(made) - 1).mean() < 0.7 * np.abs(np.linalg.norm(noisy[number], axis=1) - 1).mean()
    assert_allclose(
        values(made.data, "moved"), np.linalg.norm(positions(made) - 2 * noisy[number] - [10, 0, 0], axis=1), atol=1e-5
    )
    held = values(made.data, "vad_axis", "vector", 3)
    assert_array_equal(number[held.any(axis=1)], [3, 400])


def test_all_that_cleaning_drops_is_told(blender, add_mesh, capfd):
    place = np.indices((11, 11, 11)).reshape(3, -1).T - 5.0
    add_mesh("Ball of voxels", place[np.linalg.norm(place, axis=1) < 5.2])
    count = len(blender.context.active_object.data.vertices)
    blender.ops.vad.denoise()
    kept, told = len(blender.context.view_layer.objects.active.data.points), capfd.readouterr().out
    assert kept < count
    assert f"Warning: {count - kept} of {count} points lie inside a solid of voxels" in told
    assert f"{kept} points, {count - kept} dropped" in told


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT"])
def test_cleaned_points_are_the_active_object_whatever_mode_it_was_in(blender, scan, mode):
    blender.ops.object.mode_set(mode=mode)
    if mode == "EDIT":
        blender.ops.mesh.select_all(action="DESELECT")
        blender.context.scene.vad.selected_only = True
        with pytest.raises(RuntimeError, match="Scan has 0 selected points"):
            blender.ops.vad.denoise()
        assert scan.mode == mode
        blender.ops.mesh.select_all(action="SELECT")
    blender.ops.vad.denoise()
    assert blender.context.view_layer.objects.active.name == "Scan cleaned"
    assert blender.context.mode == scan.mode == "OBJECT"
    assert scan.hide_get()


def test_strength_and_outliers_are_obeyed(blender, scan, noisy):
    blender.ops.vad.denoise(strength=0.0, outliers=False)
    made = blender.context.view_layer.objects.active
    assert_allclose(positions(made), 2 * noisy + [10, 0, 0], atol=1e-5)
    blender.context.view_layer.objects.active = scan
    blender.context.scene.vad.outliers = False
    blender.ops.vad.denoise(strength=0.0)
    assert len(positions(blender.context.view_layer.objects.active)) == len(noisy)


@pytest.mark.parametrize(("denoise", "share"), [("auto", 1), ("0", 1), ("0.5", 0.5)])
def test_the_strength_starts_from_the_setting_of_the_scene(blender, scan, denoise, share):
    blender.ops.vad.denoise(strength=1.0)
    whole = values(blender.context.view_layer.objects.active.data, "moved")
    blender.context.view_layer.objects.active = scan
    blender.context.scene.vad.denoise = denoise
    blender.ops.vad.denoise()
    moved = values(blender.context.view_layer.objects.active.data, "moved")
    assert np.median(moved / whole) == pytest.approx(share, abs=0.01)


def test_beside_a_scan_that_is_linked_or_of_another_scene_they_go_into_this_scene(blender, add_mesh, sphere):
    first, scan = blender.context.scene, add_mesh("Scan", sphere)
    home = blender.data.collections.new("Of the first scene")
    first.collection.children.link(home)
    first.collection.objects.unlink(scan)
    home.objects.link(scan)
    second = blender.data.scenes.new("Second")
    second.collection.objects.link(scan)
    blender.context.window.scene = second
    blender.context.view_layer.objects.active = scan
    scan.select_set(True)
    blender.ops.vad.denoise()
    made = blender.data.objects["Scan cleaned"]
    assert [home.name for home in made.users_collection] == [second.collection.name]


def test_beside_a_scan_in_a_linked_collection_they_go_into_the_scene(blender, add_mesh, sphere, tmp_path):
    scan = add_mesh("Scan", sphere)
    scans = blender.data.collections.new("Scans")
    scans.objects.link(scan)
    blender.data.libraries.write(str(tmp_path / "scans.blend"), {scans})
    blender.ops.wm.read_homefile(use_empty=True)
    with blender.data.libraries.load(str(tmp_path / "scans.blend"), link=True) as (_, wanted):
        wanted.collections = ["Scans"]
    blender.context.scene.collection.children.link(blender.data.collections["Scans"])
    blender.context.view_layer.objects.active = blender.data.objects["Scan"]
    for operator in (blender.ops.vad.denoise, blender.ops.vad.normals):
        assert operator() == {"FINISHED"}
    assert {"Scan cleaned", "Scan cleaned normals"} <= set(blender.context.scene.collection.objects.keys())


@pytest.mark.parametrize("operator", ["reconstruct", "denoise", "normals", "reextract", "import_points"])
def test_into_a_linked_scene_nothing_is_put(blender, linked_scene, extension, operator):
    assert blender.context.active_object.name == "Scan"
    before = set(blender.data.objects)
    with pytest.raises(RuntimeError, match="Scene is a scene of another file: make it local, or use another scene"):
        getattr(blender.ops.vad, operator)()
    assert set(blender.data.objects) == before


def test_points_are_made_whatever_scene_is_open(blender, linked_scene, extension, sphere):
    scenes, made = set(blender.data.scenes), extension("vad_addon.datablocks")
    cloud = made.pointcloud_data("cloud", sphere, np.zeros(3), {})
    assert_allclose(values(cloud, "position", "vector", 3), sphere, atol=1e-6)
    assert {attribute.name for attribute in cloud.attributes} <= {"position", "radius"}
    assert set(blender.data.scenes) == scenes


def test_points_are_sized_at_once_where_blender_can(blender, extension, monkeypatch):
    made = extension("vad_addon.datablocks")
    can = "resize" in dir(blender.data.pointclouds.new("cloud"))  # which its class does not tell
    monkeypatch.setattr(made, "_cloud_by_nodes", lambda count: None)
    assert (made._empty_cloud(3) is not None) == can


def test_of_the_scans_collections_they_go_into_one_that_is_shown(blender, scan):
    scene = blender.context.scene
    for name in ("Hidden", "Shown"):
        home = blender.data.collections.new(name)
        scene.collection.children.link(home)
        home.objects.link(scan)
    scene.collection.objects.unlink(scan)
    blender.context.view_layer.layer_collection.children["Hidden"].exclude = True
    blender.ops.vad.denoise()
    made = blender.context.view_layer.objects.active
    assert (made.name, made.users_collection[0].name) == ("Scan cleaned", "Shown")


def test_the_script_of_the_readme_goes_on_where_the_mesh_is_active(blender, scan):
    """As after a run with a window: the copy is made of the scan, and becomes the active object."""
    layer = blender.context.view_layer
    blender.ops.vad.reconstruct(resolution=24, surface="both")
    scan.select_set(False)
    layer.objects.active = by_role(blender)["surface"]
    layer.objects.active.select_set(True)
    blender.ops.vad.reextract(resolution=24, surface="single")
    assert layer.objects.active == by_role(blender)["sheet"]
    blender.ops.vad.denoise()
    assert layer.objects.active.name == "Scan cleaned"
    assert scan.hide_get()


def test_normals_that_were_converted_or_are_linked_stay_as_they_are(blender, scan, folder):
    blender.ops.vad.normals()
    alone = blender.data.objects["Scan normals"]
    alone.select_set(True)
    blender.context.view_layer.objects.active = alone
    scan.select_set(False)
    blender.ops.object.convert(target="MESH")
    mesh = alone.data
    blender.context.view_layer.objects.active = scan
    scan.select_set(True)
    alone.select_set(False)
    assert blender.ops.vad.normals() == {"FINISHED"}
    assert alone.data == mesh
    blender.ops.wm.save_mainfile()
    blender.ops.wm.read_homefile(use_empty=True)
    with blender.data.libraries.load(str(folder / "scene.blend"), link=True) as (there, wanted):
        wanted.objects = list(there.objects)
    for obj in blender.data.objects:
        blender.context.scene.collection.objects.link(obj)
    before = set(blender.data.objects)
    blender.context.view_layer.objects.active = blender.data.objects["Scan"]
    assert blender.ops.vad.normals() == {"FINISHED"}
    assert before < set(blender.data.objects)


def test_a_run_goes_on_from_the_cleaned_points(blender, scan):
    blender.ops.vad.denoise()
    blender.ops.vad.reconstruct(resolution=24, denoise="0")
    assert blender.context.scene.vad.result.name == "Scan cleaned VAD"


def test_normals_alone_are_those_of_a_run(blender, scan, extension):
    assert blender.ops.vad.normals() == {"FINISHED"}
    alone = blender.data.objects["Scan normals"]
    assert blender.context.view_layer.objects.active == scan
    assert not scan.hide_get()
    blender.ops.vad.reconstruct(resolution=24)
    samples = by_role(blender)["samples"]
    for name, slot, width in (("normal", "vector", 3), ("confidence", "value", 1), ("number", "value", 1)):
        assert_array_equal(values(alone.data, name, slot, width), values(samples.data, name, slot, width))
    assert_allclose(positions(alone), positions(samples), atol=1e-6)


def test_normals_found_again_are_updated_and_lead_back_to_the_scan(blender, scan, extension):
    blender.ops.vad.normals()
    alone = blender.data.objects["Scan normals"]
    first = values(alone.data, "normal", "vector", 3)
    scan.select_set(False)
    blender.context.view_layer.objects.active = alone
    blender.ops.vad.normals(solver="pca")
    assert [obj for obj in blender.data.objects if obj.type == "POINTCLOUD"] == [alone]
    assert np.abs(first - values(alone.data, "normal", "vector", 3)).max() > 1e-3
    assert extension("vad_addon.points_in").sources(blender.context) == [scan]


def test_the_stages_take_the_settings_of_the_scene(blender, scan):
    blender.context.scene.vad.outliers = False
    blender.context.scene.vad.denoise = "0"
    blender.ops.vad.normals()
    assert len(blender.data.objects["Scan normals"].data.attributes["normal"].data) == 500
    blender.ops.vad.normals(outliers=True)
    assert len(blender.data.objects["Scan normals"].data.attributes["normal"].data) == 499


def test_extracting_again_gives_what_a_whole_run_gives(blender, scan):
    blender.ops.vad.reconstruct(resolution=24, surface="both", bridge=4.0)
    whole = {role: obj.data for role, obj in by_role(blender).items()}
    whole = {role: values(whole[role], "position", "vector", 3) for role in ("surface", "sheet")}
    blender.ops.vad.reconstruct(resolution=32)
    samples = positions(by_role(blender)["samples"])
    assert blender.ops.vad.reextract(resolution=24, surface="both", bridge=4.0) == {"FINISHED"}
    again = by_role(blender)
    assert_array_equal(positions(again["samples"]), samples)
    for role, vertices in whole.items():
        found = values(again[role].data, "position", "vector", 3)
        assert found.shape == vertices.shape
        assert_allclose(found, vertices, atol=1e-3)
        assert {"distance", "confidence", "number"} <= set(again[role].data.attributes.keys())


@pytest.fixture
def whole_runs(extension, monkeypatch):
    """List that grows with every run of the whole method."""
    pipeline, runs = extension("core.pipeline"), []
    reconstruct = pipeline.reconstruct
    monkeypatch.setattr(pipeline, "reconstruct", lambda *given, **named: runs.append(1) or reconstruct(*given, **named))
    return runs


def test_the_closed_mesh_comes_from_the_field_as_it_is(blender, folder, scan, whole_runs):
    blender.ops.vad.reconstruct(resolution=24, offset=0.7)
    expected = values(by_role(blender)["surface"].data, "position", "vector", 3)
    distance = values(by_role(blender)["surface"].data, "distance")
    blender.ops.vad.reconstruct(resolution=24, surface="both")
    del whole_runs[:]
    volume, files = blender.data.volumes[0].filepath, set((folder / "vad").iterdir())
    for _ in range(2):
        assert blender.ops.vad.reextract(resolution=24, offset=0.7, surface="double") == {"FINISHED"}
    assert not whole_runs
    found = values(by_role(blender)["surface"].data, "position", "vector", 3)
    cell = np.ptp(expected, axis=0).max() / 24  # the volume lacks the steps that a run takes first
    off = np.linalg.norm(found - expected, axis=1) / cell
    assert np.median(off) < 0.01
    assert np.percentile(off, 99) < 0.05
    assert 0 < values(by_role(blender)["surface"].data, "distance").mean() < distance.mean()  # nothing interpolated
    assert set(by_role(blender)) == {"samples", "surface", "field"}
    assert (blender.data.volumes[0].filepath, set((folder / "vad").iterdir())) == (volume, files)
    report = json.loads(blender.context.scene.vad.result["vad_report"])
    assert (report["settings"]["offset"], report["counts"]["samples"]) == (0.7, 499)
    assert set(report["meshes"]) == {"double"}


def test_the_closed_mesh_comes_from_signed_distances_as_well(blender, folder, scan, whole_runs):
    blender.ops.vad.reconstruct(resolution=24)
    expected = values(by_role(blender)["surface"].data, "position", "vector", 3)
    blender.ops.vad.reconstruct(resolution=24, surface="signed")
    del whole_runs[:]
    assert blender.ops.vad.reextract(resolution=24, surface="double") == {"FINISHED"}
    assert not whole_runs
    found = values(by_role(blender)["surface"].data, "position", "vector", 3)
    assert found.shape == expected.shape
    assert np.percentile(np.linalg.norm(found - expected, axis=1), 99) < 0.05 * np.ptp(expected, axis=0).max() / 24


@pytest.mark.parametrize("other", [dict(bridge=5.0), dict(resolution=20), dict(surface="single"), dict(band="4")])
def test_another_field_is_made_where_that_one_does_not_do(blender, scan, whole_runs, other):
    blender.ops.vad.reconstruct(resolution=24)
    blender.ops.vad.reextract(**{"resolution": 24} | other)
    assert len(whole_runs) == 2
    assert by_role(blender)["field"].data.grids.load()


def test_another_field_is_made_where_the_samples_or_the_file_changed(blender, folder, scan, whole_runs):
    blender.ops.vad.reconstruct(resolution=24)
    samples = by_role(blender)["samples"].data
    turned = np.roll(values(samples, "normal", "vector", 3), 1, axis=1)
    samples.attributes["normal"].data.foreach_set("vector", turned.ravel())
    blender.ops.vad.reextract(resolution=24)
    assert len(whole_runs) == 2
    for path in (folder / "vad").iterdir():
        path.unlink()
    blender.ops.vad.reextract(resolution=24)
    assert len(whole_runs) == 3
    for path in (folder / "vad").iterdir():
        path.unlink()
    del blender.context.scene.vad.result["vad_field_of"]
    blender.ops.vad.reextract(resolution=24)
    assert len(whole_runs) == 4
    for path in (folder / "vad").iterdir():
        path.write_text("another volume")
    blender.ops.vad.reextract(resolution=24)
    assert len(whole_runs) == 5
    for path in (folder / "vad").iterdir():
        path.write_bytes(bytes(path.stat().st_size))
    with pytest.raises(RuntimeError, match=r"cannot be read \(.*\): reconstruct again"):
        blender.ops.vad.reextract(resolution=24)


def test_extracting_again_searches_no_normals_and_holds_to_edited_ones(blender, scan, extension, monkeypatch):
    blender.ops.vad.reconstruct(resolution=24)
    samples = by_role(blender)["samples"].data
    turned = np.roll(values(samples, "normal", "vector", 3), 1, axis=1)
    samples.attributes["normal"].data.foreach_set("vector", turned.ravel())
    monkeypatch.setattr(extension("core.pipeline"), "estimate_normals", None)
    monkeypatch.setattr(extension("core.pipeline"), "clean", None)
    blender.ops.vad.reextract(resolution=24)
    assert_allclose(values(by_role(blender)["samples"].data, "normal", "vector", 3), turned, atol=1e-6)


def test_extracting_again_keeps_places_materials_and_the_source(blender, scan):
    blender.ops.vad.reconstruct(resolution=24)
    made = by_role(blender)
    made["surface"].location.x += 5
    place = made["surface"].location.copy()
    made["surface"].data.materials.append(blender.data.materials.new("Mine"))
    made["field"].hide_set(False)
    edited = values(made["samples"].data, "position", "vector", 3)
    edited[0] *= 1.2  # moves the centre
    made["samples"].data.attributes["position"].data.foreach_set("vector", edited.ravel())
    blender.ops.vad.reextract(resolution=24, offset=2.0)
    assert by_role(blender) == made
    assert made["surface"].location == place
    assert made["surface"].data.materials[0].name == "Mine"
    assert not made["field"].hide_get()
    assert blender.context.scene.vad.result["vad_source"] == scan
    assert json.loads(blender.context.scene.vad.result["vad_report"])["settings"]["offset"] == 2.0


def test_extracting_again_after_transforms_were_applied_stays_in_place(blender, scan):
    blender.ops.vad.reconstruct(resolution=24)
    made = by_role(blender)
    blender.ops.object.select_all(action="DESELECT")
    made["samples"].hide_set(False)
    for obj in (made["samples"], made["surface"]):
        obj.select_set(True)
    blender.context.view_layer.objects.active = made["samples"]
    blender.ops.object.transform_apply(location=True, rotation=True, scale=True)
    assert made["samples"].location.x == 0
    blender.ops.vad.reextract(resolution=32)
    for role in ("samples", "surface"):
        assert np.median(radii(by_role(blender)[role])) == pytest.approx(1, abs=0.05)


def test_extracting_again_leaves_linked_results_alone(blender, scan, linked):
    """Making a linked collection local leaves what is in it linked."""
    blender.ops.vad.reconstruct(resolution=24)
    local = linked().make_local()
    before = {obj.name: obj.data for obj in local.objects}
    blender.context.view_layer.objects.active = local.objects["Scan surface"]
    assert blender.ops.vad.reextract(resolution=24) == {"FINISHED"}
    assert {obj.name: obj.data for obj in local.objects} == before
    assert blender.context.scene.vad.result != local


def test_what_is_missing_is_said(blender, scan, add):
    with pytest.raises(RuntimeError, match="There are no results yet: reconstruct first"):
        blender.ops.vad.reextract()
    blender.ops.vad.reconstruct(resolution=16)
    blender.data.objects.remove(by_role(blender)["samples"])
    with pytest.raises(RuntimeError, match="Scan VAD has no samples any more: reconstruct again"):
        blender.ops.vad.reextract()
    scan.select_set(False)
    add("Eye", blender.data.cameras.new("Eye"))
    for operator in (blender.ops.vad.denoise, blender.ops.vad.normals):
        with pytest.raises(RuntimeError, match=r"Eye \(camera\) holds no points"):
            operator()


@pytest.mark.parametrize("operator", ["denoise", "normals"])
def test_a_source_deleted_meanwhile_is_survived(blender, scan, extension, monkeypatch, operator):
    monkeypatch.setattr(extension("vad_addon.points_in"), "objects_of", lambda source: [])
    assert getattr(blender.ops.vad, operator)() == {"FINISHED"}
    assert len([obj for obj in blender.context.scene.objects if obj.type == "POINTCLOUD"]) == 1


@pytest.mark.parametrize("operator", ["denoise", "normals"])
def test_too_few_points_are_refused_and_leave_nothing(blender, add_mesh, sphere, operator):
    add_mesh("Few", sphere[:3])
    with pytest.raises(RuntimeError, match="3 distinct finite points") as caught:
        getattr(blender.ops.vad, operator)()
    assert "Traceback" not in str(caught.value)
    assert len(blender.data.objects) == 1


@pytest.mark.parametrize(
    ("operator", "more"), [("denoise", {}), ("normals", {}), ("reextract", dict(surface="both", resolution=16))]
)
def test_each_is_one_undo_step(blender, scan, operator, more):
    blender.ops.vad.reconstruct(resolution=16)
    blender.ops.ed.undo_push(message="before")

    def state():
        return {(obj.name, obj.hide_get(), obj.data.name) for obj in blender.data.objects}

    before = state()
    assert getattr(blender.ops.vad, operator)("EXEC_DEFAULT", True, **more) == {"FINISHED"}
    assert state() != before
    blender.ops.ed.undo()
    assert state() == before


@pytest.mark.parametrize("until", ["cleaning", "normals", "cost"])
def test_the_worker_finds_the_same(extension, sphere, tmp_path, until):
    outcome, job = extension("vad_addon.outcome"), extension("vad_addon.job")
    axes = np.array([3, 70]), np.array([[0.0, 0, 1], [1, 0, 0]])
    task = outcome.Task(sphere, extension("core.settings").Settings(denoise=1.0), axes, until=until)
    running = job.Job(task, tmp_path)
    try:
        running._process.wait(60)
        assert running.poll()
        found = running.outcome()
    finally:
        running.stop()
        running.cleared(wait=True)
    expected = outcome.compute(task, tmp_path)
    for name in ("points", "source_index", "normals", "confidence", "origin", "cell", "shape"):
        assert_array_equal(getattr(found, name), getattr(expected, name))
    assert (found.normals is None) == (until != "normals")
    assert_array_equal(found.spacing, expected.spacing)
    assert (found.noisy, found.spacing is None) == (expected.noisy, until != "cost")
    assert found.surface is found.sheet is found.volume is None


@pytest.mark.parametrize("seed", range(3))
def test_a_stored_field_says_what_its_grid_is(extension, tmp_path, seed):
    """Of boxes twice as long as wide the last node across is there or not as positions are rounded."""
    outcome = extension("vad_addon.outcome")
    points = np.random.default_rng(seed).uniform(-1, 1, (400, 3)) * [2, 1, 1]
    points[:6] = [[-2, 0, 0], [2, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]]
    settings = extension("core.settings").Settings(resolution=20, surface="none", outliers=False, denoise=0.0)
    made = outcome.compute(outcome.Task(points / 3 + [5, 3, 7], settings), tmp_path)
    stored = extension("vad_addon.stored_field")
    for moved in (0, 1e-7, -1e-7):
        samples = extension("core.points").prepare_samples(made.points + moved * (made.points > [5, 3, 7]))
        grid = stored.grid_of(made.volume, made.origin, samples)
        assert grid.shape == made.shape
        assert grid.spacing * samples.scale == pytest.approx(made.cell, rel=1e-6)


def test_a_task_reaches_the_worker_whole(extension, sphere, tmp_path):
    outcome = extension("vad_addon.outcome")
    settings = extension("core.settings").Settings(resolution=20)
    task = outcome.Task(sphere, settings, known=(sphere, np.ones(500)), origin=np.array([1.0, 2, 3]), volume=tmp_path)
    task.save(tmp_path / "task.npz")
    loaded = outcome.Task.load(tmp_path / "task.npz")
    assert (loaded.settings, loaded.until, loaded.constraints) == (settings, "all", None)
    assert_array_equal(loaded.known[0], sphere)
    assert_array_equal(loaded.origin, [1, 2, 3])
    assert loaded.volume == tmp_path
