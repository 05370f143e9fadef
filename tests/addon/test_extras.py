"""Shells, slices and normals follow a result; axes fixed by hand hold in the next run."""

import numpy as np
import pytest
from numpy.testing import assert_allclose


@pytest.fixture
def scan(blender, add_mesh, sphere):
    return add_mesh("Scan", sphere)


@pytest.fixture
def result(blender, scan, tmp_path):
    """The results of a run on the sphere, by role."""
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    blender.ops.vad.reconstruct(resolution=32)
    blender.context.view_layer.update()
    return {obj["vad_role"]: obj for obj in blender.context.scene.vad.result.objects}


def evaluated(bpy, obj):
    """(n,3) world coordinates and the mesh that modifiers make of `obj`."""
    final = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = final.to_mesh()
    points = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    matrix = np.array(final.matrix_world)
    return points @ matrix[:3, :3].T + matrix[:3, 3], mesh


@pytest.mark.parametrize("operator", ["shell", "slice", "normals_to_geometry"])
def test_without_results_there_is_nothing_to_look_at(blender, operator):
    with pytest.raises(RuntimeError, match="There are no results yet: reconstruct first"):
        getattr(blender.ops.vad, operator)()


@pytest.mark.parametrize("operator", ["shell", "slice"])
def test_without_a_volume_they_say_so(blender, result, operator):
    blender.data.objects.remove(result["field"])
    with pytest.raises(RuntimeError, match="Scan VAD has no volume: reconstruct again"):
        getattr(blender.ops.vad, operator)()


@pytest.mark.parametrize("operator", ["shell", "slice"])
def test_without_the_file_of_the_volume_they_say_so_and_leave_nothing(blender, result, tmp_path, operator):
    blender.ops.wm.save_mainfile()
    (tmp_path / "vad" / "Scan.vdb").unlink()
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    before = set(blender.data.objects), len(blender.data.node_groups)
    with pytest.raises(RuntimeError, match=r"Scan field cannot be read from .*Scan\.vdb: reconstruct again"):
        getattr(blender.ops.vad, operator)()
    assert (set(blender.data.objects), len(blender.data.node_groups)) == before


@pytest.mark.parametrize("operator", ["shell", "slice"])
def test_of_a_volume_that_is_packed_alone_they_say_what_to_do(blender, result, tmp_path, operator):
    blender.ops.file.pack_all()
    blender.ops.wm.save_mainfile()
    (tmp_path / "vad" / "Scan.vdb").unlink()
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    with pytest.raises(RuntimeError, match="Scan field is packed: press File > External Data > Unpack Resources"):
        getattr(blender.ops.vad, operator)()
    blender.ops.file.unpack_all(method="WRITE_ORIGINAL")
    assert getattr(blender.ops.vad, operator)() == {"FINISHED"}


@pytest.mark.parametrize("how", ["excluded", "unlinked", "linked"])
@pytest.mark.parametrize("operator", ["shell", "slice", "normals_to_geometry"])
def test_results_that_take_no_more_objects_say_so(blender, result, linked, operator, how):
    collection, layer = blender.context.scene.vad.result, blender.context.view_layer
    if how == "excluded":
        layer.layer_collection.children[collection.name].exclude = True
    elif how == "unlinked":
        blender.context.scene.collection.children.unlink(collection)
    else:
        blender.context.view_layer.objects.active = linked().objects["Scan surface"]
    before = set(blender.data.objects)
    with pytest.raises(RuntimeError, match="make it local" if how == "linked" else "include it in the outliner"):
        getattr(blender.ops.vad, operator)()
    assert set(blender.data.objects) == before


def test_what_is_extracted_again_of_linked_results_lies_beside_them(blender, result, linked):
    collection = linked()
    blender.context.view_layer.objects.active = collection.objects["Scan surface"]
    before = {obj.name: obj.data for obj in collection.objects}
    assert blender.ops.vad.reextract(resolution=24) == {"FINISHED"}
    assert {obj.name: obj.data for obj in collection.objects} == before
    made = blender.context.scene.vad.result
    assert made.library is None
    assert {obj["vad_role"] for obj in made.objects} == {"samples", "surface", "field"}


def test_a_shell_lies_at_its_distance_on_both_sides(blender, result):
    assert blender.ops.vad.shell(offset=3) == {"FINISHED"}
    shell = blender.context.active_object
    cell = result["field"].data["vad_cell"]
    near = 0.6 * cell if blender.app.version >= (5, 0, 0) else cell  # before, Blender lays the mesh half a cell off
    for distance in (3 * cell, 2 * cell):
        shell.modifiers[0].threshold = distance
        points, mesh = evaluated(blender, shell)
        radius = np.linalg.norm(points, axis=1)
        assert_allclose(np.abs(radius - 1), distance, atol=near)
        assert (radius > 1).any()
        assert (radius < 1).any()
        assert len(mesh.polygons) > 100


@pytest.mark.parametrize("hidden", [None, "collection", "eye"])
@pytest.mark.parametrize(("offset", "warned"), [(3, False), (40, True)])
def test_a_shell_farther_off_than_any_distance_in_the_volume_is_said_to_be_empty(
    blender, result, offset, warned, hidden, capfd
):
    collection = blender.context.scene.vad.result
    if hidden == "collection":
        collection.hide_viewport = True
    elif hidden:
        blender.context.view_layer.layer_collection.children[collection.name].hide_viewport = True
    assert blender.ops.vad.shell(offset=offset) == {"FINISHED"}
    told = "Warning: Scan field shell is empty: no distance in the volume is 40 cells" in capfd.readouterr().out
    assert told == warned


def test_shells_and_slices_follow_from_unsigned_distances_to_signed_ones_and_back(blender, scan, result):
    blender.ops.vad.shell(offset=3)
    shell = blender.context.active_object
    blender.ops.vad.slice(axis="Z")
    cut = blender.context.active_object
    scan.select_set(True)
    blender.context.view_layer.objects.active = scan
    for surface, least in (("signed", -0.5), ("double", 0.0)):
        blender.ops.vad.reconstruct(resolution=32, surface=surface)
        blender.context.view_layer.update()
        assert len(evaluated(blender, shell)[1].polygons) > 100
        distance = evaluated(blender, cut)[1].attributes["distance"].data
        found = [item.value for item in distance]
        assert max(found) > 0.2
        assert (min(found) < least) == (surface == "signed")


def test_in_a_band_shells_and_slices_show_as_far_as_it_goes(blender, scan, tmp_path):
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    blender.ops.vad.reconstruct(resolution=48, band="4")
    (field,) = (obj for obj in blender.context.scene.vad.result.objects if obj["vad_role"] == "field")
    cell = field.data["vad_cell"]
    blender.ops.vad.shell(offset=2)
    points, mesh = evaluated(blender, blender.context.active_object)
    assert_allclose(np.abs(np.linalg.norm(points, axis=1) - 1), 2 * cell, atol=cell)
    assert len(mesh.polygons) > 100
    blender.ops.vad.slice(axis="Z")
    points, mesh = evaluated(blender, blender.context.active_object)
    distance = np.empty(len(points), np.float32)
    mesh.attributes["distance"].data.foreach_get("value", distance)
    expected = np.minimum(np.abs(np.linalg.norm(points, axis=1) - 1), 4 * cell)
    inside = (np.abs(points) < 1).all(axis=1)
    assert_allclose(distance[inside], expected[inside], atol=cell)
    assert distance[inside].max() == pytest.approx(4 * cell, rel=1e-5)


def test_a_slice_shows_the_distance_where_it_lies(blender, result):
    blender.ops.vad.slice(axis="Z")
    plane = blender.context.active_object
    cell = result["field"].data["vad_cell"]
    for height, turn in ((0.0, 0.0), (0.4, 0.3)):
        plane.location.z, plane.rotation_euler.x = height, turn
        blender.context.view_layer.update()
        points, mesh = evaluated(blender, plane)
        distance = np.empty(len(points), np.float32)
        mesh.attributes["distance"].data.foreach_get("value", distance)
        inside = (np.abs(points) < 1).all(axis=1)
        assert inside.sum() > 1000
        radius = np.linalg.norm(points, axis=1)
        assert_allclose(distance[inside], np.abs(radius[inside] - 1), atol=cell)
        slope = np.empty(len(points), np.float32)
        mesh.attributes["slope"].data.foreach_get("value", slope)
        normal = np.array(plane.matrix_world)[:3, 2]
        within = np.sqrt(np.maximum(0, 1 - (points @ normal / np.maximum(radius, 0.1)) ** 2))  # of the plane
        smooth = inside & (np.abs(radius - 1) > 2 * cell) & (radius > 4 * cell)
        assert np.abs(slope - within)[smooth].mean() < 0.05


def test_normals_become_curves_through_the_samples(blender, result, sphere):
    blender.ops.vad.normals_to_geometry(length=4, every=5)
    curves = blender.context.active_object
    assert curves.type == "CURVES"
    ends = np.empty(6 * 100, np.float32)
    curves.data.attributes["position"].data.foreach_get("vector", ends)
    ends = ends.reshape(100, 2, 3) + np.array(result["samples"].location)
    radius = result["samples"].data.attributes["radius"].data[0].value
    assert_allclose(ends.mean(axis=1), sphere[::5], atol=1e-6)
    assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), 4 * radius, rtol=1e-5)


def test_each_takes_one_undo_step_and_follows_the_result(blender, result):
    blender.ops.ed.undo_push(message="before")
    for operator in ("shell", "slice", "normals_to_geometry"):
        before = {obj.name for obj in blender.data.objects}
        getattr(blender.ops.vad, operator)("EXEC_DEFAULT", True)
        made = blender.context.active_object
        assert made.parent is not None
        assert made.users_collection == (blender.context.scene.vad.result,)
        blender.ops.ed.undo()
        assert {obj.name for obj in blender.data.objects} == before


def test_the_lines_are_thinned_out_evenly(extension):
    segments = extension("vad_addon.overlay").segments
    points, normals = np.arange(300.0).reshape(100, 3), np.tile([0.0, 0, 1], (100, 1))
    ends, rows = segments(points, normals, np.full(100, 0.5), every=3, maximum=1000)
    assert rows.tolist() == list(range(0, 100, 3))
    assert_allclose(ends[:2], [[0, 1, 1.5], [0, 1, 2.5]])
    _, rows = segments(points, normals, 0.5, every=1, maximum=12)
    assert len(rows) == 12
    assert (rows[0], rows[-1]) == (0, 99)
    assert np.ptp(np.diff(rows)) <= 1


@pytest.mark.parametrize("by", ["SINGLE", "DIRECTION", "CONFIDENCE"])
def test_the_lines_take_their_colour_from_what_is_asked(blender, extension, by):
    style = blender.context.scene.vad.overlay
    style.colour_by = by
    normals, confidence = np.array([[0, 0, -1.0], [0, 1, 0]]), np.array([0.0, 1.0])
    found = extension("vad_addon.overlay").colours(style, normals, confidence)
    expected = {
        "SINGLE": [[0.1, 0.9, 1.0]] * 2,
        "DIRECTION": [[0, 0, 1], [0, 1, 0]],
        "CONFIDENCE": [[0.9, 0.1, 0.1], [0.1, 0.9, 0.2]],
    }
    assert_allclose(found[:, :3], expected[by], atol=1e-6)


def test_the_overlay_costs_nothing_while_it_is_off(blender, extension):
    overlay = extension("vad_addon.overlay")
    handlers = len(blender.app.handlers.depsgraph_update_post)
    assert overlay._handle is None
    blender.context.scene.vad.overlay.show = True
    assert overlay._handle is not None
    assert len(blender.app.handlers.depsgraph_update_post) == handlers + 1
    blender.ops.wm.read_factory_settings(use_empty=True)  # a file in which it is off
    assert overlay._handle is None
    assert len(blender.app.handlers.depsgraph_update_post) == handlers


def test_the_overlay_is_back_after_the_extension_was_disabled_and_enabled(blender, extension):
    overlay, vad_addon = extension("vad_addon.overlay"), extension("vad_addon")
    blender.context.scene.vad.overlay.show = True
    vad_addon.unregister()
    assert overlay._handle is None
    assert not blender.app.timers.is_registered(overlay.sync)
    vad_addon.register()
    assert blender.context.scene.vad.overlay.show
    assert blender.app.timers.is_registered(overlay.sync)  # Blender calls it when it has a window
    overlay.sync()
    assert overlay._handle is not None


# Axes fixed by hand


@pytest.fixture
def edited(blender, scan):
    """The sphere in edit mode with its first three points selected; scaled, so that spaces are told apart."""
    scan.scale = 1, 2, 1
    blender.context.view_layer.update()
    blender.ops.object.mode_set(mode="EDIT")
    import bmesh

    mesh = bmesh.from_edit_mesh(scan.data)
    for vertex in mesh.verts:
        vertex.select = vertex.index < 3
    return scan


def constraints(bpy, extension):
    points_in = extension("vad_addon.points_in")
    found = points_in.gather(points_in.sources(bpy.context), bpy.context).constraints
    if found is None:
        return None
    indices, axes = found
    return indices.tolist(), axes / np.linalg.norm(axes, axis=1, keepdims=True)


def test_typed_axes_reach_the_run_in_world_space(blender, extension, edited):
    blender.ops.vad.fix_axes(origin="TYPED", axis=(1, 1, 0))
    indices, axes = constraints(blender, extension)
    assert indices == [0, 1, 2]
    assert_allclose(axes, [np.array([1, 1, 0]) / 2**0.5] * 3, atol=1e-6)


def test_axes_towards_the_cursor(blender, extension, edited, sphere):
    blender.context.scene.cursor.location = 5, 0, 0
    blender.ops.vad.fix_axes(origin="CURSOR")
    _, axes = constraints(blender, extension)
    towards = np.array([5, 0, 0]) - sphere[:3] * [1, 2, 1]
    assert_allclose(axes, towards / np.linalg.norm(towards, axis=1, keepdims=True), atol=1e-5)


def test_axes_of_the_active_element(blender, extension, edited):
    with pytest.raises(RuntimeError, match="The active element has no axis"):
        blender.ops.vad.fix_axes(origin="ACTIVE")
    blender.ops.vad.fix_axes(origin="TYPED", axis=(0, 1, 0))
    import bmesh

    mesh = bmesh.from_edit_mesh(edited.data)
    mesh.verts.ensure_lookup_table()
    mesh.select_history.add(mesh.verts[1])
    mesh.verts[9].select = True
    blender.ops.vad.fix_axes(origin="ACTIVE")
    indices, axes = constraints(blender, extension)
    assert indices == [0, 1, 2, 9]
    assert_allclose(np.abs(axes), [[0, 1, 0]] * 4, atol=1e-6)


def active_edge(obj):
    """The direction (3,), in world space, of an edge that is made between two points and made active."""
    import bmesh

    mesh = bmesh.from_edit_mesh(obj.data)
    mesh.verts.ensure_lookup_table()
    edge = mesh.edges.new(mesh.verts[0:2])
    mesh.select_history.add(edge)
    return np.array((obj.matrix_world.to_3x3() @ (edge.verts[1].co - edge.verts[0].co)).normalized())


def test_an_active_edge_gives_its_direction_though_the_object_is_stretched(blender, extension, edited):
    way = active_edge(edited)
    blender.ops.vad.fix_axes(origin="ACTIVE")
    _, axes = constraints(blender, extension)
    assert_allclose(np.abs(axes @ way), 1, atol=1e-6)


@pytest.fixture
def both_edited(blender, edited, add_mesh):
    """The sphere and another mesh, turned, in edit mode, with three points of each selected."""
    import bmesh

    blender.ops.object.mode_set(mode="OBJECT")
    other = add_mesh("Other", np.random.default_rng(0).random((20, 3)))
    other.rotation_euler = 0, 0.5, 1
    blender.context.view_layer.objects.active = edited
    blender.context.view_layer.update()
    blender.ops.object.mode_set(mode="EDIT")
    for obj in (edited, other):
        for vertex in bmesh.from_edit_mesh(obj.data).verts:
            vertex.select = vertex.index < 3
    return edited, other


def test_a_cursor_on_a_point_is_told_and_nothing_is_fixed(blender, extension, both_edited):
    import bmesh

    for obj in both_edited:
        mesh = bmesh.from_edit_mesh(obj.data)
        mesh.verts.ensure_lookup_table()
        blender.context.scene.cursor.location = obj.matrix_world @ mesh.verts[0].co
        with pytest.raises(RuntimeError, match="The 3D cursor lies on a selected point: move it, or deselect that"):
            blender.ops.vad.fix_axes(origin="CURSOR")
        assert constraints(blender, extension) is None


def test_the_axis_of_the_active_element_holds_for_all_meshes_that_are_edited(blender, extension, both_edited):
    way = active_edge(both_edited[0])
    blender.ops.vad.fix_axes(origin="ACTIVE")
    indices, axes = constraints(blender, extension)
    assert indices == [0, 1, 2, 500, 501, 502]
    assert_allclose(np.abs(axes @ way), 1, atol=1e-6)
    blender.ops.vad.free_axes()
    assert constraints(blender, extension) is None


def test_freed_axes_are_gone(blender, extension, edited):
    blender.ops.vad.fix_axes(origin="TYPED")
    blender.ops.vad.free_axes()
    assert constraints(blender, extension) is None


@pytest.mark.parametrize(
    ("z", "problem"),
    [(0, "length 0 has no direction"), (np.nan, "length nan has"), (1, "are selected")],
)
def test_what_cannot_be_fixed_is_said(blender, extension, edited, z, problem):
    if z == 1:
        blender.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(RuntimeError, match=problem):
        blender.ops.vad.fix_axes(origin="TYPED", axis=(0, 0, z))
    assert constraints(blender, extension) is None


def test_fixed_axes_hold_in_the_run_and_live_in_the_file(blender, tmp_path, edited):
    blender.ops.vad.fix_axes(origin="TYPED", axis=(1, 0, 0))
    blender.ops.object.mode_set(mode="OBJECT")
    path = str(tmp_path / "axes.blend")
    blender.ops.wm.save_as_mainfile(filepath=path)
    blender.ops.wm.open_mainfile(filepath=path)
    blender.ops.vad.reconstruct(resolution=24)
    samples = next(obj for obj in blender.context.scene.vad.result.objects if obj["vad_role"] == "samples")
    normals = np.empty(3 * 500, np.float32)
    samples.data.attributes["normal"].data.foreach_get("vector", normals)
    assert_allclose(np.abs(normals.reshape(-1, 3)[:3]), [[1, 0, 0]] * 3, atol=1e-6)


def test_outside_edit_mode_they_say_what_to_do(blender, scan):
    with pytest.raises(RuntimeError, match="Enter edit mode of a mesh and select the points whose axis you know"):
        blender.ops.vad.fix_axes()


def test_normals_of_no_points_are_refused(blender, result):
    result["samples"].data = blender.data.pointclouds.new("Empty")
    with pytest.raises(RuntimeError, match="has no points any more: reconstruct again"):
        blender.ops.vad.normals_to_geometry()
    with pytest.raises(RuntimeError, match="has no samples any more: reconstruct again"):
        blender.ops.vad.reextract()
    blender.ops.vad.reconstruct(resolution=16)
    assert result["samples"].data.attributes.domain_size("POINT") == 500


def test_a_volume_of_the_users_is_told_and_stays(blender, result):
    theirs = blender.data.volumes.new("Smoke")
    theirs.filepath = result["field"].data.filepath
    result["field"].data = theirs
    before = set(blender.data.objects), theirs.filepath
    for operator in (blender.ops.vad.shell, blender.ops.vad.slice):
        with pytest.raises(RuntimeError, match="shows another volume than its own: reconstruct again"):
            operator()
    assert (set(blender.data.objects), theirs.filepath) == before
    blender.ops.vad.reconstruct(resolution=16)
    assert theirs.filepath == before[1] != result["field"].data.filepath


def test_a_field_whose_file_is_gone_is_told_when_it_is_shown(blender, result, extension, capfd):
    extension("vad_addon.volume_files").file_of(result["field"].data).unlink()
    result["field"].hide_set(True)
    blender.ops.vad.show(role="field")
    assert "cannot be read from" in capfd.readouterr().out


def test_who_is_refused_stays_in_edit_mode(blender, result):
    scan = blender.data.objects["Scan"]
    blender.context.view_layer.objects.active = scan
    blender.ops.object.mode_set(mode="EDIT")
    blender.data.objects.remove(result["field"])
    blender.ops.mesh.select_all(action="DESELECT")
    for operator in (blender.ops.vad.shell, blender.ops.vad.denoise):
        blender.context.scene.vad.selected_only = True
        with pytest.raises(RuntimeError):
            operator()
        assert scan.mode == "EDIT"
