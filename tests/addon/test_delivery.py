"""What a second run does to the results of the first, and what the results carry."""

import numpy as np
import pytest
from numpy.testing import assert_allclose


@pytest.fixture
def scan(blender, add_mesh, sphere):
    """A sphere whose points carry their own coordinates as a colour, and a number."""
    obj = add_mesh("Scan", sphere)
    colours = np.column_stack([0.5 + 0.5 * sphere, np.ones(500)])
    obj.data.attributes.new("Col", "FLOAT_COLOR", "POINT").data.foreach_set("color", colours.ravel())
    obj.data.attributes.new("label", "INT", "POINT").data.foreach_set("value", np.arange(500))
    return obj


@pytest.fixture
def folder(blender, tmp_path):
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return tmp_path


@pytest.fixture
def run(blender, folder, extension):
    """Function: run, return the objects of the result by role."""

    def run(**settings):
        assert blender.ops.vad.reconstruct(**{"resolution": 24, **settings}) == {"FINISHED"}
        return {obj["vad_role"]: obj for obj in blender.context.scene.vad.result.objects}

    return run


def values(data, name, slot="value", width=1):
    attribute = data.attributes[name]
    flat = np.empty(width * len(attribute.data), np.float32)
    attribute.data.foreach_get(slot, flat)
    return flat.reshape(-1, width) if width > 1 else flat


def positions(mesh):
    return values(mesh, "position", "vector", 3)


def test_samples_and_surface_carry_what_the_source_carried(run, scan, sphere):
    made = run()
    assert_allclose(values(made["samples"].data, "Col", "color", 4)[:, :3], 0.5 + 0.5 * sphere, atol=1e-6)
    assert values(made["samples"].data, "label").tolist() == list(range(500))
    surface = made["surface"].data
    label = values(surface, "label").astype(int)
    world = positions(surface) + np.array(made["surface"].location)
    away = np.linalg.norm(world[:, None] - sphere[None], axis=2)
    assert_allclose(away[np.arange(len(label)), label], away.min(axis=1), atol=1e-5)
    assert_allclose(values(surface, "Col", "color", 4)[:, :3], 0.5 + 0.5 * sphere[label], atol=1e-6)


def test_names_that_results_or_blender_go_by_get_another(blender, run, scan, sphere):
    ours = {"normal": "FLOAT_VECTOR", "confidence": "FLOAT", "distance": "FLOAT", "scan_distance": "INT8"}
    for name, kind in (ours | {"custom_normal": "FLOAT_VECTOR", "crease_vert": "FLOAT"}).items():
        attribute = scan.data.attributes.new(name, kind, "POINT")
        if kind == "FLOAT_VECTOR":
            attribute.data.foreach_set("vector", np.tile(np.float32([0, 0, 7]), 500))
        else:
            attribute.data.foreach_set("value", np.full(500, 7, np.float32 if kind == "FLOAT" else np.int32))
    made = run()
    for again in (False, True):
        for role in ("samples", "surface"):
            data = made[role].data
            assert_allclose(values(data, "scan_normal", "vector", 3)[:, 2], 7)
            assert_allclose(values(data, "scan_custom_normal", "vector", 3)[:, 2], 7)
            for name in ("confidence", "distance", "scan_distance", "crease_vert"):
                assert set(values(data, f"scan_{name}")) == {7.0}
            assert {"custom_normal", "crease_vert", "scan_radius"}.isdisjoint(data.attributes.keys())
            assert values(data, "confidence").max() <= 1
        normals = np.array([corner.vector for corner in made["surface"].data.corner_normals])
        assert np.abs(normals.mean(axis=0)).max() < 0.1
        if not again:
            blender.ops.vad.reextract(resolution=20)


def test_colours_of_corners_reach_the_surface_and_what_does_not_is_told(blender, folder, run, add, extension):
    blender.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    ball = blender.context.active_object
    painted = ball.data.attributes.new("Painted", "BYTE_COLOR", "CORNER")
    colours = np.array([(*ball.data.vertices[loop.vertex_index].co, 1) for loop in ball.data.loops]) / 2 + 0.5
    painted.data.foreach_set("color", colours.astype(np.float32).ravel())
    ball.data.attributes.new("note", "STRING", "POINT")
    ball.data.attributes.new("part", "INT", "FACE")
    ball.vertex_groups.new(name="Weights")
    surface = run()["surface"]
    shown = values(surface.data, "Painted", "color", 4)[:, :3]
    assert np.abs(shown - (0.5 + 0.5 * (positions(surface.data) + np.array(surface.location)))).max() < 0.15
    (told,) = extension("vad_addon.results").warnings(blender.context.scene.vad.result)
    assert told.startswith("Not carried over: Weights, note, part; only numbers and colors of points")


def test_colours_and_intensity_of_a_scanners_file_reach_the_surface(blender, folder, sphere):
    colours = np.rint(255 * (0.5 + 0.5 * sphere)).astype(int)
    np.savetxt(folder / "scan.pts", np.column_stack([sphere, sphere[:, 2], colours]), header="500", comments="")
    blender.ops.vad.import_points(filepath=str(folder / "scan.pts"))
    blender.ops.vad.reconstruct(resolution=24)
    made = {obj["vad_role"]: obj for obj in blender.context.scene.vad.result.objects}
    surface = made["surface"].data
    assert surface.color_attributes.active_color_name == "Col"
    world = positions(surface) + np.array(made["surface"].location)
    shown = values(surface, "Col", "color_srgb", 4)[:, :3]
    assert np.abs(shown - (0.5 + 0.5 * world)).max() < 0.2  # 1.5 spacings
    assert np.abs(values(surface, "intensity") - world[:, 2]).max() < 0.4


def test_colours_of_a_ply_are_seen_on_the_surface(blender, folder, sphere):
    colours = np.rint(255 * (0.5 + 0.5 * sphere)).astype(int)
    names = ("float x", "float y", "float z", "uchar red", "uchar green", "uchar blue")
    rows = (" ".join(map(str, row)) for row in zip(*sphere.T, *colours.T, strict=True))
    header = ["ply", "format ascii 1.0", "element vertex 500", *(f"property {name}" for name in names), "end_header"]
    (folder / "painted.ply").write_text("\n".join([*header, *rows, ""]))
    blender.ops.wm.ply_import(filepath=str(folder / "painted.ply"), import_colors="LINEAR")
    blender.ops.vad.reconstruct(resolution=24)
    made = {obj["vad_role"]: obj for obj in blender.context.scene.vad.result.objects}
    surface = made["surface"].data
    assert surface.color_attributes.active_color_name == "Col"
    world = positions(surface) + np.array(made["surface"].location)
    assert np.abs(values(surface, "Col", "color", 4)[:, :3] - (0.5 + 0.5 * world)).max() < 0.2  # 1.5 spacings
    (material,) = surface.materials
    assert material == made["samples"].data.materials[0]
    shader = next(node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    assert shader.inputs["Base Color"].links[0].from_node.attribute_name == "Col"
    material.name = "Mine"
    blender.ops.vad.reconstruct(resolution=32)
    assert [found.name for found in made["surface"].data.materials] == ["Mine"]


def test_the_surface_knows_distance_and_confidence(run, scan):
    made = run()
    surface, samples = made["surface"].data, made["samples"].data
    confidence = values(samples, "confidence")[values(surface, "label").astype(int)]
    assert_allclose(values(surface, "confidence"), confidence)
    assert 0 <= values(surface, "distance").min() <= values(surface, "distance").max() < 2 / 24


def test_a_second_run_updates_in_place(blender, run, scan):
    first = run()
    before = set(blender.data.objects), set(blender.data.collections), set(blender.data.meshes)
    coarse = len(first["surface"].data.vertices)
    second = run(resolution=32)
    assert second == first
    assert (set(blender.data.objects), set(blender.data.collections)) == before[:2]
    assert {mesh.name for mesh in blender.data.meshes} == {"Scan", "Scan surface"}
    assert len(second["surface"].data.vertices) > 1.3 * coarse
    assert second["field"].data.filepath == "//vad/Scan_001.vdb"
    assert {material.name for material in blender.data.materials} == {"Scan field", "Scan colours"}
    assert len(blender.data.volumes) == len(blender.data.pointclouds) == 1


@pytest.mark.parametrize("packs", [False, True])
def test_a_packed_volume_is_not_unpacked_over_the_one_that_took_its_place(blender, folder, run, scan, packs):
    made = run()
    made["field"].data["asset"] = "X42"
    blender.ops.file.pack_all()
    blender.data.use_autopack = packs
    assert run(resolution=32) == made
    volume, file = made["field"].data, folder / "vad" / "Scan_001.vdb"
    assert volume.packed_file is None
    assert (volume["asset"], blender.data.use_autopack) == ("X42", packs)
    assert volume.grids["udf"].matrix_object[0][0] == pytest.approx(volume["vad_cell"])
    written = file.read_bytes()
    blender.ops.wm.save_mainfile()
    assert (volume.packed_file is not None) == packs
    blender.data.use_autopack = False
    if packs:
        blender.ops.file.unpack_all(method="WRITE_ORIGINAL")
    assert file.read_bytes() == written


def test_where_no_volume_can_be_written_the_earlier_one_stays_for_what_follows_it(
    blender, folder, run, scan, extension
):
    made, warnings = run(), extension("vad_addon.results").warnings
    field, file = made["field"], made["field"].data.filepath
    blender.ops.vad.shell()
    shell = blender.context.active_object
    blender.ops.vad.slice()
    cut = blender.context.active_object
    (folder / "vad").rename(folder / "kept")
    (folder / "vad").write_text("in the way")
    make_active(blender, scan)
    assert run(resolution=32)["field"] == field
    assert field.data.filepath == file
    missing, stale = warnings(blender.context.scene.vad.result)
    assert missing.startswith("No volume: nothing can be written into ")
    assert missing.endswith("; save the .blend in another folder")
    assert stale == "Scan field is out of date: it stays as an earlier run left it"
    (folder / "vad").unlink()
    (folder / "kept").rename(folder / "vad")
    assert blender.ops.vad.reextract(resolution=32, surface="double") == {"FINISHED"}  # not from the old one
    assert warnings(blender.context.scene.vad.result) == []
    assert field.data.filepath != file
    assert shell.modifiers[0].object == shell.parent == cut.parent == field
    assert len(evaluated(blender, shell)[1].polygons) > 100


def test_properties_and_animation_of_data_survive(blender, run, scan):
    made = run()
    for obj in (made["surface"], made["samples"]):
        obj.data["asset"], obj.data["wear"], obj.data["more"] = "X42", 0.5, {"tags": [1, 2]}
        obj.data.id_properties_ui("wear").update(min=0.0, max=1.0)
        obj.data.keyframe_insert('["wear"]', frame=3)
        driver = obj.data.driver_add('["more"]["tags"]', 1).driver
        driver.expression = "40 + 2"
        obj.data.use_fake_user = True
    assert run(resolution=32) == made
    for obj in (made["surface"], made["samples"]):
        data = obj.data
        assert (data["asset"], data["more"]["tags"][0], data.use_fake_user) == ("X42", 1, True)
        assert data.id_properties_ui("wear").as_dict()["max"] == 1
        animation = data.animation_data
        assert animation.action_slot in set(animation.action.slots)
        assert [curve.driver.expression for curve in animation.drivers] == ["40 + 2"]


def test_materials_modifiers_and_places_survive(blender, run, scan):
    made = run()
    for obj in made.values():
        obj.data.materials.append(blender.data.materials.new(f"My {obj.name}"))
    made["surface"].modifiers.new("Mine", "SMOOTH")
    made["surface"].location.x += 3
    made["surface"].data.use_mirror_x, made["surface"].data.remesh_voxel_size = True, 0.25
    made["field"].data.display.density *= 2
    duplicate = blender.data.objects.new("Linked duplicate", made["surface"].data)
    display = made["field"].data.display.density
    made = run(resolution=48)
    for obj in made.values():
        assert obj.data.materials[-1].name == f"My {obj.name}"
    assert "Mine" in made["surface"].modifiers
    assert (made["surface"].data.use_mirror_x, made["surface"].data.remesh_voxel_size) == (True, 0.25)
    assert made["surface"].location.x == pytest.approx(3, abs=1e-3)
    assert made["field"].data.display.density == pytest.approx(2 * display, rel=0.05)  # half the cell, twice as dense
    assert duplicate.data == made["surface"].data


@pytest.mark.parametrize(("first", "then"), [("double", "single"), ("single", "signed")])
def test_the_mesh_that_takes_the_place_of_another_keeps_what_the_user_gave_it(blender, run, scan, first, then):
    made = run(surface=first)
    (mesh,) = set(made.values()) - {made["samples"], made["field"]}
    mesh.data.materials.clear()
    mesh.data.materials.append(blender.data.materials.new("Mine"))
    mesh.modifiers.new("Mine", "SMOOTH")
    mesh.data.shade_flat()
    mesh.hide_set(True)
    made = run(surface=then)
    role = "sheet" if then == "single" else "surface"
    assert made[role] == mesh
    assert mesh.name == mesh.data.name == f"Scan {role}"
    assert [material.name for material in mesh.data.materials] == ["Mine"]
    assert "Mine" in mesh.modifiers
    assert mesh.hide_get()
    assert not any(face.use_smooth for face in mesh.data.polygons)


def test_an_object_whose_transforms_were_applied_is_placed_anew(blender, run, scan):
    scan.location = 0, 0, 10
    surface = run()["surface"]
    for obj in blender.context.selected_objects:
        obj.select_set(False)
    surface.select_set(True)
    blender.context.view_layer.objects.active = surface
    blender.ops.object.transform_apply(location=True, rotation=True, scale=True)
    assert surface.location.z == 0
    surface = run()["surface"]
    assert positions(surface.data).mean(axis=0)[2] + surface.location.z == pytest.approx(10, abs=0.05)


@pytest.mark.parametrize("role", ["surface", "samples"])
def test_one_that_was_edited_once_its_transforms_were_applied_is_placed_anew(blender, run, scan, role):
    scan.location = 0, 0, 10
    obj = run()[role]
    make_active(blender, obj)
    blender.ops.object.transform_apply(location=True)
    if role == "surface":
        obj.modifiers.new("Fewer", "DECIMATE").ratio = 0.5
        blender.ops.object.modifier_apply(modifier="Fewer")
    else:
        blender.ops.object.mode_set(mode="EDIT")
        kept = obj.data.attributes.get(".selection") or obj.data.attributes.new(".selection", "BOOLEAN", "POINT")
        kept.data.foreach_set("value", np.arange(500) < 20)
        blender.ops.pointcloud.delete()
        blender.ops.object.mode_set(mode="OBJECT")
        assert blender.ops.vad.reextract(resolution=24) == {"FINISHED"}
    if role == "surface":
        make_active(blender, scan)
        run()
    surface = blender.data.objects["Scan surface"]
    assert positions(surface.data).mean(axis=0)[2] + surface.location.z == pytest.approx(10, abs=0.05)


@pytest.mark.parametrize(
    ("how", "then"),
    [
        *(("sculpted", "double"), ("joined", "double"), ("joined", "single"), ("joined", "none")),
        *(("painted", "double"), ("unwrapped", "single"), ("weighted", "none"), ("keyed", "double")),
        *(("subdivided", "double"), ("masked", "double"), ("skinned", "double")),
    ],
)
def test_a_mesh_that_the_user_changed_is_kept_beside_the_next(
    blender, run, scan, add_mesh, sphere, extension, how, then
):
    surface = run()["surface"]
    make_active(blender, surface)
    if how == "sculpted":
        surface.data.vertices[7].co *= 0.99
    elif how == "joined":
        make_active(blender, surface, add_mesh("Second", sphere + 3))
        blender.ops.object.join()
    elif how == "painted":
        surface.data.attributes["Col"].data[7].color = 1, 0, 0, 1
    elif how == "unwrapped":
        surface.data.uv_layers.new(name="UVMap")
    elif how == "weighted":
        surface.vertex_groups.new(name="Soft").add([7], 1.0, "REPLACE")
    elif how == "subdivided":
        surface.modifiers.new("Multires", "MULTIRES")
        blender.ops.object.multires_subdivide(modifier="Multires")
    elif how == "masked":
        surface.data.attributes.new(".sculpt_mask", "FLOAT", "POINT")
    elif how == "skinned":
        surface.modifiers.new("Skin", "SKIN").show_viewport = False
    else:
        surface.shape_key_add(name="Basis")
    count, objects = len(surface.data.vertices), set(blender.data.objects)
    make_active(blender, scan)
    run(surface=then)
    (kept,) = (obj for obj in set(blender.data.objects) - objects)
    assert (kept.name, kept.get("vad_role"), len(kept.data.vertices)) == ("Scan surface changed", None, count)
    assert (kept.hide_get(), kept.hide_render) == (True, True)
    assert {"unwrapped": "UVMap" in kept.data.uv_layers, "keyed": kept.data.shape_keys is not None}.get(how, True)
    warnings = extension("vad_addon.results").warnings(blender.context.scene.vad.result)
    assert warnings == ["Scan surface was changed since it was made: Scan surface changed, hidden, keeps what it was"]
    run(surface=then)
    assert extension("vad_addon.results").warnings(blender.context.scene.vad.result) == []
    assert kept.name in blender.context.scene.objects
    make_active(blender, kept)
    assert extension("vad_addon.points_in").sources(blender.context) == [kept]


def test_a_mesh_of_the_users_that_a_result_shows_stays(blender, run, scan, extension):
    surface = run()["surface"]
    triangle = blender.data.meshes.new("Retopo")
    triangle.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    theirs = blender.data.objects.new("Retopo", triangle)
    surface.data = triangle
    made = run()
    assert (theirs.data, len(triangle.vertices)) == (triangle, 3)
    assert len(made["surface"].data.vertices) > 100
    assert extension("vad_addon.results").warnings(blender.context.scene.vad.result) == []


def test_of_a_mesh_that_looks_otherwise_alone_nothing_is_kept(blender, run, scan):
    made = run()
    made["surface"].data.shade_flat()
    made["surface"].data.materials.append(blender.data.materials.new("Mine"))
    made["surface"].modifiers.new("Mine", "SMOOTH")
    made["surface"].scale = 2, 2, 2
    blender.ops.wm.save_mainfile()
    blender.ops.wm.open_mainfile(filepath=blender.data.filepath)
    before = set(blender.data.objects)
    make_active(blender, blender.data.objects["Scan"])
    run()
    assert set(blender.data.objects) == before


def test_an_object_that_was_edited_stays_where_the_user_put_it(blender, run, scan):
    surface = run()["surface"]
    surface.location.x += 3
    import bmesh

    edited = bmesh.new()
    edited.from_mesh(surface.data)
    bmesh.ops.delete(edited, geom=[vertex for vertex in edited.verts if vertex.co.z > 0.5], context="VERTS")
    edited.to_mesh(surface.data)
    edited.free()
    assert run()["surface"].location.x == pytest.approx(3, abs=1e-3)


def test_results_follow_a_source_that_moved(run, scan):
    run()
    scan.location = 0, 0, 10
    assert {tuple(np.round(obj.location, 2)) for obj in run().values()} == {(0, 0, 10)}


def test_results_follow_a_source_whatever_moves_them_with_it(blender, run, scan):
    """A rig moves, turns and scales the scan and the results; the data of the next run is in world space."""
    made = run()
    rig = blender.data.objects.new("Rig", None)
    blender.context.scene.collection.objects.link(rig)
    for obj in (scan, *made.values()):
        obj.parent = rig
    made["surface"].delta_location.x = 7
    rig.location, rig.rotation_euler, rig.scale = (3, 0, 10), (0.5, 0.2, 1), (2, 2, 2)
    blender.context.view_layer.update()
    made = run()
    blender.context.view_layer.update()
    for role in ("surface", "samples"):
        place = np.array(made[role].matrix_world)
        found = positions(made[role].data) @ place[:3, :3].T + place[:3, 3]
        assert_allclose(np.linalg.norm(found - [3, 0, 10], axis=1), 2, atol=0.1)
    assert made["surface"].parent == rig


def test_how_the_user_turned_and_scaled_a_result_stays_so(run, scan):
    run()["surface"].scale = 10, 10, 10
    scan.location = 0, 0, 10
    surface = run()["surface"]
    assert tuple(np.round(surface.location, 2)) == (0, 0, 10)
    assert tuple(surface.scale) == pytest.approx((10, 10, 10))


@pytest.mark.parametrize("role", ["samples", "surface"])
def test_a_result_that_was_converted_is_the_users(blender, run, scan, role):
    converted = run()[role]
    converted.hide_set(False)
    for obj in blender.context.selected_objects:
        obj.select_set(False)
    converted.select_set(True)
    blender.context.view_layer.objects.active = converted
    blender.ops.object.convert(target="MESH" if role == "samples" else "POINTCLOUD")
    kind, data = converted.type, converted.data
    blender.context.view_layer.objects.active = scan
    scan.select_set(True)
    converted.select_set(False)
    assert blender.ops.vad.reconstruct(resolution=24) == {"FINISHED"}
    assert (converted.type, converted.data) == (kind, data)
    assert len(blender.context.scene.vad.result.objects) == 4


def test_what_was_deleted_is_not_saved_for_its_results(blender, folder, run, scan):
    result = run()["surface"].users_collection[0].name
    blender.ops.object.select_all(action="DESELECT")
    scan.hide_set(False)
    scan.select_set(True)
    blender.ops.object.delete()
    blender.ops.wm.save_mainfile()
    blender.ops.wm.open_mainfile(filepath=str(folder / "scene.blend"))
    assert "Scan" not in blender.data.objects
    assert "vad_source" not in blender.data.collections[result]


def test_both_are_kept_where_asked(blender, run, scan):
    first = run()
    second = run(keep_both=True)
    assert not set(first.values()) & set(second.values())
    third = run()
    assert third == second


def test_of_several_that_were_kept_the_one_at_hand_is_updated(blender, run, scan):
    first = run()["surface"]
    second = run(keep_both=True, resolution=16)["surface"]
    faces = len(second.data.polygons)
    make_active(blender, first)
    run(resolution=32)
    assert len(first.data.polygons) > faces == len(second.data.polygons)


def test_another_source_of_the_same_name_updates_nothing(blender, run, scan, add_mesh, sphere):
    first = run()
    scan.select_set(False)
    scan.name = "Renamed"
    add_mesh("Scan", sphere)
    assert not set(first.values()) & set(run().values())


def test_a_surface_no_longer_asked_for_goes(run, scan):
    assert "surface" in run()
    assert set(run(surface="none")) == {"samples", "field"}
    assert set(run()) == {"samples", "surface", "field"}


@pytest.mark.parametrize(
    ("asked", "made"),
    [
        ("single", {"samples", "sheet", "field"}),
        ("both", {"samples", "surface", "sheet", "field"}),
        ("signed", {"samples", "surface", "field"}),
    ],
)
def test_the_meshes_are_those_asked_for(blender, run, scan, asked, made):
    found = run(surface=asked)
    assert set(found) == made
    for role in made & {"surface", "sheet"}:
        assert {"distance", "confidence", "Col"} <= set(found[role].data.attributes.keys())
    blender.ops.vad.shell(offset=2)
    _, mesh = evaluated(blender, blender.context.active_object)
    assert len(mesh.polygons) > 100


def evaluated(bpy, obj):
    bpy.context.view_layer.update()
    final = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return final, final.to_mesh()


def test_results_being_edited_stay_as_they_are(blender, run, scan, extension):
    first = run()
    vertices = len(first["surface"].data.vertices)
    points_in, outcome = extension("vad_addon.points_in"), extension("vad_addon.outcome")
    source = points_in.gather([scan], blender.context)
    blender.context.view_layer.objects.active = first["surface"]
    blender.ops.object.mode_set(mode="EDIT")
    found = outcome.compute(
        outcome.Task(source.points, extension("core.settings").Settings(resolution=16)), blender_temp(blender)
    )
    made = extension("vad_addon.delivery").deliver(blender.context.scene, source, found)
    assert len(first["surface"].data.vertices) == vertices
    assert not set(made.objects) & set(first.values())
    (warning,) = extension("vad_addon.results").warnings(made)
    assert "is being edited" in warning


def test_results_beside_which_the_scan_is_edited_are_updated(blender, run, scan):
    run()
    made = blender.context.scene.vad.result
    move(blender, scan)
    made.objects.link(scan)
    make_active(blender, scan)
    blender.ops.object.mode_set(mode="EDIT")
    assert blender.ops.vad.reconstruct(resolution=16) == {"FINISHED"}
    assert blender.context.scene.vad.result == made


def test_results_edited_by_way_of_a_duplicate_stay_as_they_are(blender, run, scan):
    first = run()
    vertices = len(first["surface"].data.vertices)
    duplicate = blender.data.objects.new("Linked duplicate", first["surface"].data)
    blender.context.scene.collection.objects.link(duplicate)
    blender.context.view_layer.objects.active = duplicate
    blender.ops.object.mode_set(mode="SCULPT")
    with blender.context.temp_override(active_object=scan, selected_objects=[scan]):
        made = run(resolution=16)
    assert len(first["surface"].data.vertices) == vertices
    assert not set(made.values()) & set(first.values())


def blender_temp(bpy):
    from pathlib import Path

    return Path(bpy.app.tempdir)


def test_an_update_is_one_undo_step(blender, run, scan):
    blender.ops.ed.undo_push(message="before")
    blender.ops.vad.reconstruct("EXEC_DEFAULT", True, resolution=24)
    count = len(blender.data.meshes["Scan surface"].vertices)
    blender.ops.vad.reconstruct("EXEC_DEFAULT", True, resolution=32)
    assert len(blender.data.meshes["Scan surface"].vertices) > count
    blender.ops.ed.undo()
    assert len(blender.data.meshes["Scan surface"].vertices) == count
    volume = blender.data.volumes["Scan field"]
    assert volume.filepath == "//vad/Scan.vdb"
    assert volume.grids.load()


def shown(made):
    seen = {role for role, obj in made.items() if not obj.hide_get()}
    assert seen == {role for role, obj in made.items() if not obj.hide_render}
    return seen


def test_of_new_results_only_the_mesh_is_shown(run, scan):
    assert shown(run()) == {"surface"}
    assert shown(run(surface="both")) == {"surface"}
    assert shown(run(surface="none")) == {"samples", "field"}
    assert shown(run(surface="single")) == {"sheet"}


def test_what_the_user_shows_and_hides_stays_so(blender, run, scan):
    made = run(surface="both")
    assert blender.ops.vad.show(role="field") == {"FINISHED"}
    blender.ops.vad.show(role="sheet")
    blender.ops.vad.show(role="surface")
    assert shown(made) == {"field", "sheet"}
    assert shown(run(surface="both")) == {"field", "sheet"}


def test_the_scan_is_shown_and_hidden_like_its_results(blender, run, scan):
    run()
    for hidden in (True, False):
        blender.ops.vad.show(role="source")
        assert (scan.hide_get(), scan.hide_render) == (hidden, hidden)
    with pytest.raises(
        RuntimeError, match="Scan VAD has nothing to show for the single layer: it was deleted, or not asked for"
    ):
        blender.ops.vad.show(role="sheet")
    blender.data.objects.remove(scan)
    with pytest.raises(RuntimeError, match=r"nothing to show for what the points came from: it was deleted$"):
        blender.ops.vad.show(role="source")


def put_out_of_sight(how, obj, layer):
    """By the eye of its collection, which is left out with "excluded", or by its monitor icon or its own eye."""
    if how == "eye":
        layer.hide_viewport = True
    elif how == "excluded":
        layer.exclude = True
    elif how == "off":
        obj.hide_viewport = True
    else:
        obj.hide_set(True)


@pytest.mark.parametrize("how", ["eye", "excluded", "off"])
def test_what_cannot_be_shown_is_said(blender, run, scan, capfd, how):
    surface, home = run()["surface"], blender.context.scene.vad.result
    layer = blender.context.view_layer.layer_collection.children[home.name]
    put_out_of_sight(how, surface, layer)
    for _ in range(2):
        blender.ops.vad.show(role="surface")
        assert "Warning: Scan surface is off, or its collection is hidden: show it in" in capfd.readouterr().out
    layer.hide_viewport = layer.exclude = surface.hide_viewport = False
    blender.context.view_layer.update()
    assert surface.visible_get()
    for visible in (False, True):
        blender.ops.vad.show(role="surface")
        assert surface.visible_get() == visible
    assert not capfd.readouterr().out


@pytest.mark.parametrize("how", ["eye", "excluded", "off", "its own eye"])
def test_a_run_says_where_its_mesh_is_not_seen(blender, run, scan, capfd, how):
    surface, home = run()["surface"], blender.context.scene.vad.result
    put_out_of_sight(how, surface, blender.context.view_layer.layer_collection.children[home.name])
    make_active(blender, scan)
    for again in (run, blender.ops.vad.reextract):
        capfd.readouterr()
        again(resolution=20)
        told = "Warning: Scan surface is off, or its collection is hidden: show it in" in capfd.readouterr().out
        assert told == (how != "its own eye")


def test_another_object_of_its_name_is_not_the_scan_of_linked_results(blender, run, scan, linked, add_mesh, sphere):
    run()
    collection = linked()
    add_mesh("Scan", sphere)
    (mesh,) = (obj for obj in collection.objects if obj.type == "MESH")
    make_active(blender, mesh)
    with pytest.raises(RuntimeError, match="The scan of Scan surface is gone, or unknown"):
        blender.ops.vad.reconstruct()


def test_whether_renders_show_a_linked_scan_is_left_to_its_file(blender, scan, folder, capfd):
    blender.data.libraries.write(str(folder / "scan.blend"), {scan})
    blender.ops.wm.read_homefile(use_empty=True)
    with blender.data.libraries.load(str(folder / "scan.blend"), link=True) as (_, wanted):
        wanted.objects = ["Scan"]
    (scan,) = wanted.objects
    blender.context.scene.collection.objects.link(scan)
    blender.context.view_layer.objects.active = scan
    blender.ops.vad.reconstruct(resolution=24)
    for hidden in (True, False):
        blender.ops.vad.show(role="source")
        assert (scan.hide_get(), scan.hide_render) == (hidden, False)
        assert "Warning: Scan is linked: whether renders show it is set in its own file" in capfd.readouterr().out


def test_the_mesh_takes_the_stage_from_all_that_it_was_made_of(blender, run, scan, add_mesh, sphere, extension):
    results = extension("vad_addon.results")
    blender.ops.vad.normals()
    other = add_mesh("Other", sphere + 3)
    made = run()
    results.take_the_stage(blender.context, made["surface"], [scan.session_uid, other.session_uid])
    assert blender.context.view_layer.objects.active == made["surface"]
    assert blender.context.selected_objects == [made["surface"]]
    assert all(obj.hide_get() for obj in (scan, other, blender.data.objects["Scan normals"]))
    assert run(resolution=32) == made


def move(bpy, *objects):
    """Into a new collection, as by M."""
    other = bpy.data.collections.new("Other")
    bpy.context.scene.collection.children.link(other)
    for obj in objects:
        for home in obj.users_collection:
            home.objects.unlink(obj)
        other.objects.link(obj)


@pytest.mark.parametrize("role", ["surface", "samples", "field"])
def test_results_that_were_moved_to_another_collection_are_updated(blender, run, scan, extension, role):
    made, collection = run(), blender.context.scene.vad.result
    move(blender, made[role])
    make_active(blender, made[role])
    assert extension("vad_addon.extras").chosen_result(blender.context) == collection
    assert blender.ops.vad.reconstruct(resolution=32) == {"FINISHED"}
    assert blender.context.scene.vad.result == collection
    assert {obj for obj in blender.data.objects if obj != scan} == set(made.values())
    assert len(extension("vad_addon.results").members(collection)) == 3
    blender.ops.vad.show(role=role)
    assert made[role].hide_get()


@pytest.mark.parametrize("role", ["surface", "samples", "field"])
def test_a_result_is_no_scan_though_its_own_is_gone(blender, run, scan, role):
    made, collection = run(), blender.context.scene.vad.result
    make_active(blender, scan)
    blender.ops.object.delete()
    make_active(blender, made[role])
    before = {obj: obj.data for obj in blender.data.objects}
    for operator in (blender.ops.vad.reconstruct, blender.ops.vad.normals, blender.ops.vad.denoise):
        with pytest.raises(RuntimeError, match=f"The scan of Scan {role} is gone, or unknown: press Extract Again"):
            operator()
    assert {obj: obj.data for obj in blender.data.objects} == before
    assert blender.ops.vad.reextract(resolution=16) == {"FINISHED"}
    assert blender.context.scene.vad.result == collection


@pytest.mark.parametrize("active", ["scan", "surface", "other"])
def test_of_many_collections_only_those_of_runs_are_looked_into(
    blender, run, scan, add_mesh, sphere, extension, monkeypatch, active
):
    results, read, walked = extension("vad_addon.results"), [], []
    objects = {"surface": run()["surface"], "scan": scan, "other": add_mesh("Other", sphere)}
    for _ in range(300):
        blender.context.scene.collection.children.link(blender.data.collections.new("Plain"))
    make_active(blender, objects[active])
    names, of_object = results._names, blender.types.Object.users_collection.fget
    monkeypatch.setattr(results, "_names", lambda holder: read.append(1) or names(holder))
    walk = property(lambda obj: walked.append(1) or of_object(obj))
    monkeypatch.setattr(blender.types.Object, "users_collection", walk)
    found = extension("vad_addon.extras").chosen_result(blender.context)
    assert found == (None if active == "other" else blender.context.scene.vad.result)
    assert len(read) < 10
    assert not walked


@pytest.mark.parametrize("which", ["scan", "shell"])
def test_what_lies_among_the_results_of_another_run_is_none_of_them(
    blender, run, scan, add_mesh, sphere, extension, which
):
    run()
    others = blender.context.scene.vad.result
    second = add_mesh("Second", 2 * sphere)
    make_active(blender, second)
    move(blender, second)
    others.objects.link(second)
    chosen = extension("vad_addon.extras").chosen_result
    assert chosen(blender.context) is None
    assert blender.ops.vad.reconstruct(resolution=16) == {"FINISHED"}
    own = blender.context.scene.vad.result
    if which == "shell":
        blender.ops.vad.shell()
        shell = blender.context.active_object
        move(blender, shell)
        others.objects.link(shell)
    assert chosen(blender.context) == own != others


def test_shells_that_were_moved_to_another_collection_still_follow(blender, run, scan, extension):
    run()
    blender.ops.vad.shell()
    shell, collection = blender.context.active_object, blender.context.scene.vad.result
    move(blender, shell)
    assert extension("vad_addon.extras").chosen_result(blender.context) == collection
    make_active(blender, scan)
    run(surface="signed")
    assert shell.modifiers[0].grid_name == "sdf"


@pytest.mark.parametrize("how", ["duplicated", "separated"])
def test_a_copy_of_a_result_can_be_reconstructed_itself(blender, run, scan, extension, how):
    made, collection = run(), blender.context.scene.vad.result
    make_active(blender, made["surface"])
    if how == "duplicated":
        blender.ops.object.duplicate()
        copy = blender.context.active_object
    else:
        blender.ops.object.mode_set(mode="EDIT")
        blender.ops.mesh.select_all(action="DESELECT")
        blender.ops.object.mode_set(mode="OBJECT")
        for face in made["surface"].data.polygons:
            face.select = face.center.z > 0
        blender.ops.object.mode_set(mode="EDIT")
        blender.ops.mesh.separate(type="SELECTED")
        blender.ops.object.mode_set(mode="OBJECT")
        (copy,) = set(blender.context.selected_objects) - {made["surface"]}
    make_active(blender, copy)
    chosen = extension("vad_addon.extras").chosen_result
    assert extension("vad_addon.points_in").sources(blender.context) == [copy]
    assert chosen(blender.context) is None
    assert blender.ops.vad.reconstruct(resolution=16) == {"FINISHED"}
    of_copy = blender.context.scene.vad.result
    assert of_copy.name == f"{copy.name} VAD"
    assert chosen(blender.context) == of_copy
    make_active(blender, made["surface"])
    assert extension("vad_addon.points_in").sources(blender.context) == [scan]
    assert chosen(blender.context) == collection


@pytest.mark.parametrize("role", ["surface", "samples", "field"])
def test_a_result_that_was_deleted_comes_back_under_its_name(blender, run, scan, role):
    make_active(blender, run()[role])
    blender.ops.object.delete()
    make_active(blender, scan)
    obj = run()[role]
    assert (obj.name, obj.data.name) == (f"Scan {role}",) * 2


def test_a_result_that_was_taken_out_and_is_used_stays_for_its_user(blender, run, scan, add_mesh, sphere):
    surface = run()["surface"]
    wrapped = add_mesh("Wrapped", sphere).modifiers.new("Wrap", "SHRINKWRAP")
    wrapped.target = surface
    surface.users_collection[0].objects.unlink(surface)
    make_active(blender, scan)
    run()
    assert wrapped.target == surface


def test_a_copy_of_the_field_goes_on_showing_what_it_did(blender, run, scan):
    """Blender's copies of objects share their volumes."""
    field = run()["field"]
    copy = field.copy()
    blender.context.scene.collection.objects.link(copy)
    path = copy.data.filepath
    assert run(resolution=16)["field"].data.filepath != path == copy.data.filepath


def test_a_copy_of_a_result_is_the_users_though_the_result_was_deleted(blender, folder, run, scan, extension):
    surface = run()["surface"]
    make_active(blender, surface)
    blender.ops.object.duplicate()
    copy = blender.context.active_object
    copy.name, vertices = "Mine", len(copy.data.vertices)
    make_active(blender, surface)
    blender.ops.object.delete()
    make_active(blender, scan)
    for _ in range(2):
        assert blender.ops.vad.reconstruct(resolution=32) == {"FINISHED"}
        assert len(copy.data.vertices) == vertices
        assert extension("vad_addon.results").mesh(blender.context.scene.vad.result) != copy
        blender.ops.wm.save_mainfile()
        new = extension("vad_addon.results").mesh(blender.context.scene.vad.result)
        make_active(blender, new)
        blender.ops.object.delete()
        blender.ops.wm.save_mainfile()
        make_active(blender, scan)
    blender.ops.wm.open_mainfile(filepath=str(folder / "scene.blend"))
    assert {"Scan", "Mine"} == {obj.name for obj in blender.data.objects if obj.type == "MESH"}


@pytest.fixture
def joined(blender, scan, add_mesh, sphere):
    """The sphere and a smaller one beside it, both selected."""
    return scan, add_mesh("Other", 0.5 * sphere + [2, 0, 0])


def make_active(bpy, *objects):
    """Select these objects alone, and make the first the active one."""
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    for obj in objects:
        obj.hide_set(False)
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]


def count(made):
    return len(made["samples"].data.attributes["position"].data)


def test_what_was_joined_is_joined_again_from_the_results(blender, run, joined):
    made = run()
    make_active(blender, made["surface"])
    assert run() == made
    assert count(made) == 1000
    blender.ops.vad.normals()
    (alone,) = (obj for obj in blender.data.objects if obj.get("vad_role") == "estimate")
    make_active(blender, alone)
    blender.ops.vad.normals()
    assert len(alone.data.attributes["position"].data) == 1000
    for hidden in (True, False):
        blender.ops.vad.show(role="source")
        assert [obj.hide_get() for obj in joined] == [hidden] * 2


def test_a_run_on_some_of_what_was_joined_leaves_the_results_of_all(blender, run, joined):
    made = run()
    for obj in joined:
        make_active(blender, obj)
        assert not set(run().values()) & set(made.values())
    assert count(made) == 1000
    make_active(blender, *joined)
    assert run() == made


@pytest.mark.parametrize("gone", [0, 1])
def test_what_is_gone_of_what_was_joined_is_said(blender, folder, run, joined, extension, gone):
    made, name, left = run(), joined[gone].name, joined[1 - gone]
    make_active(blender, joined[gone])
    blender.ops.object.delete()
    make_active(blender, made["surface"])
    for _ in range(2):
        again = run()
        assert count(again) == 500
        assert count(made) == 1000
        for visible in (False, True):
            blender.ops.vad.show(role="source")
            assert left.visible_get() == visible
        (warning,) = extension("vad_addon.results").warnings(blender.context.scene.vad.result)
        assert warning == f"{name} is gone: the run is on {left.name} alone"
        blender.ops.wm.save_mainfile()
    blender.ops.wm.open_mainfile(filepath=str(folder / "scene.blend"))
    assert name not in blender.data.objects


def test_joined_scans_one_of_which_was_turned_take_their_results_along(blender, run, joined):
    made = run()
    made["surface"].scale = 2, 2, 2
    make_active(blender, *reversed(joined))
    assert tuple(run()["surface"].scale) == (2, 2, 2)
    joined[1].rotation_euler = 0, 0, 1
    blender.context.view_layer.update()
    assert tuple(run()["surface"].scale) == (1, 1, 1)


@pytest.mark.parametrize("elsewhere", ["editing", "active"])
def test_who_went_on_to_something_else_is_not_disturbed(blender, run, scan, add_mesh, sphere, extension, elsewhere):
    made = run()
    if elsewhere == "editing":
        blender.ops.object.mode_set(mode="EDIT")
    else:
        add_mesh("Other", sphere)
    active = blender.context.view_layer.objects.active
    extension("vad_addon.results").take_the_stage(blender.context, made["surface"], [scan.session_uid])
    assert blender.context.view_layer.objects.active == active
    assert not scan.hide_get()


def test_the_overlay_shows_hidden_samples_while_their_run_is_seen(blender, run, scan, extension):
    drawn = extension("vad_addon.overlay")._shown
    made = run()
    assert made["samples"] in drawn(blender.context.visible_objects)
    made["surface"].hide_set(True)
    assert made["samples"] not in drawn(blender.context.visible_objects)
    made["samples"].hide_set(False)
    assert made["samples"] in drawn(blender.context.visible_objects)


@pytest.mark.slow
def test_cycles_shows_the_volume_at_any_scale(blender, run, scan):
    scene = blender.context.scene
    if "CYCLES" not in {item.identifier for item in scene.render.bl_rna.properties["engine"].enum_items}:
        import addon_utils

        addon_utils.enable("cycles")
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.device = 8, "CPU"
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.render.film_transparent = True
    camera = blender.data.objects.new("Eye", blender.data.cameras.new("Eye"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = blender.data.worlds.new("Sky")  # in the dark Cycles leaves volumes out
    for scale in (0.1, 100.0):
        scan.scale = scale, scale, scale
        made = run()
        for role, obj in made.items():
            obj.hide_render = role != "field"
        scan.hide_render = True
        camera.location = 0, 0, 4 * scale
        camera.data.clip_end = 10 * scale
        path = blender.app.tempdir + "cycles.png"
        scene.render.filepath = path
        blender.ops.render.render(write_still=True)
        image = blender.data.images.load(path, check_existing=False)
        alpha = np.array(image.pixels[:]).reshape(32, 32, 4)[..., 3]
        blender.data.images.remove(image)
        assert alpha[16, 16] > 0.5
        assert alpha[0, 0] < 0.05
