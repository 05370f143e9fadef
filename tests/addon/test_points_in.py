"""Objects become points where NumPy says they are in the world."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

TRANSFORMS = {
    "scale": dict(scale=(2, 0.5, 3)),
    "mirror": dict(scale=(-1, 2, 1), rotation_euler=(0.3, 0.2, 0.9)),
    "far": dict(location=(3.5e5, 5.5e6, 120), rotation_euler=(0, 0, 1)),
}


def world(transform):
    """The 4x4 matrix of location, XYZ Euler angles and scale, by hand."""
    cos, sin = np.cos, np.sin
    x, y, z = transform.get("rotation_euler", (0, 0, 0))
    turn_x = np.array([[1, 0, 0], [0, cos(x), -sin(x)], [0, sin(x), cos(x)]])
    turn_y = np.array([[cos(y), 0, sin(y)], [0, 1, 0], [-sin(y), 0, cos(y)]])
    turn_z = np.array([[cos(z), -sin(z), 0], [sin(z), cos(z), 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3] = turn_z @ turn_y @ turn_x @ np.diag(transform.get("scale", (1, 1, 1)))
    matrix[:3, 3] = transform.get("location", (0, 0, 0))
    return matrix


def moved(points, matrix):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


@pytest.fixture
def read(blender, extension):
    points_in = extension("vad_addon.points_in")

    def read(obj):
        points = points_in.gather([obj], blender.context).points
        assert points.dtype == np.float64
        assert points_in.point_count([obj], blender.context) == len(points)
        return points

    return read


@pytest.fixture
def cloud(extension):
    """Function: point cloud data at (n,3) points."""
    return lambda points: extension("vad_addon.datablocks").pointcloud_data("cloud", points, np.zeros(3), {})


@pytest.mark.parametrize("kind", ["mesh", "cloud"])
@pytest.mark.parametrize("name", TRANSFORMS)
def test_world_coordinates(read, add, add_mesh, cloud, sphere, kind, name):
    obj = add_mesh("Scan", sphere) if kind == "mesh" else add("Scan", cloud(sphere))
    for key, value in TRANSFORMS[name].items():
        setattr(obj, key, value)
    scale = np.abs(moved(sphere, world(TRANSFORMS[name]))).max()
    assert_allclose(read(obj), moved(sphere, world(TRANSFORMS[name])), atol=4e-7 * scale)


def test_large_offsets_keep_the_detail_of_the_local_coordinates(read, add_mesh, sphere):
    obj = add_mesh("Scan", sphere)
    obj.location = (2**20, 2**22, 0)
    assert_allclose(read(obj) - obj.location, sphere, atol=1e-7)


def test_parents_count(read, blender, add, add_mesh, sphere):
    parent, child = add("Parent", None), add_mesh("Scan", sphere)
    child.parent = parent
    for obj, name in ((parent, "mirror"), (child, "scale")):
        for key, value in TRANSFORMS[name].items():
            setattr(obj, key, value)
    assert_allclose(read(child), moved(sphere, world(TRANSFORMS["mirror"]) @ world(TRANSFORMS["scale"])), atol=2e-6)


def test_modifiers_count(read, add_mesh, sphere):
    obj = add_mesh("Scan", sphere)
    obj.modifiers.new("Array", "ARRAY")
    assert len(read(obj)) == 2 * len(sphere)


def test_vertices_made_in_edit_mode_count(read, blender, add_mesh, sphere):
    import bmesh

    obj = add_mesh("Scan", sphere)
    blender.ops.object.mode_set(mode="EDIT")
    bmesh.from_edit_mesh(obj.data).verts.new((7, 8, 9))
    points = read(obj)
    assert len(points) == 501
    assert_allclose(points[-1], (7, 8, 9))


def test_modifiers_count_in_edit_mode(blender, extension, add_mesh, sphere):
    import bmesh

    obj = add_mesh("Scan", sphere)
    obj.modifiers.new("Array", "ARRAY")
    blender.ops.object.mode_set(mode="EDIT")
    blender.context.evaluated_depsgraph_get()
    bmesh.from_edit_mesh(obj.data).verts.new((7, 8, 9))
    assert len(extension("vad_addon.points_in").gather([obj], blender.context).points) == 2 * 501


def test_hair_curves(read, blender, add):
    data = blender.data.hair_curves.new("hair")
    data.add_curves([3, 2])
    positions = np.arange(15, dtype=np.float32)
    data.attributes["position"].data.foreach_set("vector", positions)
    assert_allclose(read(add("Hair", data)), positions.reshape(5, 3))


def made_by_nodes(blender, obj, instances):
    """Let geometry nodes make points of the vertices of `obj`, or instances there."""
    nodes = blender.data.node_groups.new("nodes", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        nodes.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    start, end = nodes.nodes.new("NodeGroupInput"), nodes.nodes.new("NodeGroupOutput")
    middle = nodes.nodes.new("GeometryNodeInstanceOnPoints" if instances else "GeometryNodeMeshToPoints")
    nodes.links.new(start.outputs[0], middle.inputs[0])
    if instances:
        cube = nodes.nodes.new("GeometryNodeMeshCube")
        nodes.links.new(cube.outputs[0], middle.inputs["Instance"])
    nodes.links.new(middle.outputs[0], end.inputs[0])
    obj.modifiers.new("nodes", "NODES").node_group = nodes
    return obj


@pytest.mark.parametrize("instances", [False, True])
def test_points_made_by_geometry_nodes(read, blender, add_mesh, sphere, instances):
    assert_allclose(read(made_by_nodes(blender, add_mesh("Scan", sphere), instances)), sphere, atol=1e-7)


def test_few_instances_are_told_from_few_points(blender, read, add_mesh, extension):
    read(made_by_nodes(blender, add_mesh("Few", np.eye(3)), instances=False))
    scan = made_by_nodes(blender, add_mesh("Scan", np.zeros((1, 3))), instances=True)
    with pytest.raises(extension("core.errors").InputError, match="Scan has 1 points, the origins of instances: add R"):
        read(scan)


def test_instances_of_scans_are_told_from_points(blender, add_mesh, sphere, extension):
    points_in = extension("vad_addon.points_in")

    def told(obj):
        return points_in.gather([obj], blender.context).warnings

    assert told(add_mesh("Plain", sphere)) == ()
    many = made_by_nodes(blender, add_mesh("Many", sphere), instances=True)
    (warning,) = told(many)
    assert warning.startswith("Many: 500 instances count as a point each; for the points within them add Realize")
    nodes = many.modifiers["nodes"].node_group
    (at,) = (node for node in nodes.nodes if node.bl_idname == "GeometryNodeInstanceOnPoints")
    single = nodes.nodes.new("GeometryNodeMeshLine")
    single.inputs["Count"].default_value = 1
    nodes.links.new(single.outputs[0], at.inputs["Instance"])
    assert told(many) == ()
    scan = nodes.nodes.new("GeometryNodeObjectInfo")
    scan.inputs["Object"].default_value, scan.inputs["As Instance"].default_value = blender.data.objects["Plain"], True
    nodes.links.new(scan.outputs["Geometry"], at.inputs["Instance"])
    assert len(told(many)) == 1


def test_of_an_empty_that_shows_a_collection_it_is_said_what_helps(blender, add, add_mesh, sphere):
    scans = blender.data.collections.new("Scans")
    scans.objects.link(add_mesh("Scan", sphere))
    shows = add("Shows", None)
    blender.data.objects["Scan"].select_set(False)
    shows.instance_type, shows.instance_collection = "COLLECTION", scans
    with pytest.raises(RuntimeError, match="Shows shows a collection: press Object > Apply > Make Instances Real and"):
        blender.ops.vad.reconstruct(resolution=16)


def test_an_object_without_points_is_refused(read, add_mesh, extension):
    with pytest.raises(extension("core.errors").InputError, match="Scan has 0 points"):
        read(add_mesh("Scan", np.empty((0, 3))))


@pytest.fixture
def gather(blender, extension):
    """Function: gather from what is selected."""
    points_in = extension("vad_addon.points_in")

    def gather(**options):
        return points_in.gather(points_in.sources(blender.context), blender.context, **options)

    return gather


def test_selected_objects_are_joined_the_active_one_first(blender, gather, add_mesh, sphere):
    other, active = add_mesh("Other", sphere[:100]), add_mesh("Scan", sphere)
    other.location = 5, 0, 0
    found = gather()
    assert (found.name, found.uids) == ("Scan", (active.session_uid, other.session_uid))
    assert_allclose(found.points, np.concatenate([sphere, sphere[:100] + np.array([5, 0, 0])]), atol=1e-6)
    other.select_set(False)
    assert len(gather().points) == 500


def test_an_active_object_that_is_not_selected_stands_alone(gather, add_mesh, sphere):
    add_mesh("Cube", sphere[:8])
    scan = add_mesh("Scan", sphere)
    scan.select_set(False)
    found = gather()
    assert (found.uids, len(found.points)) == ((scan.session_uid,), 500)


def test_what_is_selected_counts_where_the_active_object_is_not(
    blender, gather, extension, monkeypatch, add, add_mesh, sphere
):
    scan = add_mesh("Scan", sphere)
    add("Eye", blender.data.cameras.new("Eye")).select_set(False)
    assert gather().uids == (scan.session_uid,)
    other = add_mesh("Other", sphere)
    other.select_set(False)
    assert gather().uids == (other.session_uid,)
    window = SimpleNamespace(app=SimpleNamespace(background=False))
    monkeypatch.setattr(extension("vad_addon.points_in"), "bpy", window)
    assert gather().uids == (scan.session_uid,)
    scan.select_set(False)
    assert gather().uids == (other.session_uid,)


def test_an_overridden_context_names_the_object(blender, gather, add_mesh, sphere):
    other = add_mesh("Other", sphere[:7])
    add_mesh("Active", sphere)
    with blender.context.temp_override(active_object=other, selected_objects=[other]):
        assert gather().name == "Other"


def test_a_selected_camera_does_not_matter(blender, gather, add, add_mesh, sphere):
    scan = add_mesh("Scan", sphere)
    add("Eye", blender.data.cameras.new("Eye"))
    assert gather().uids == (scan.session_uid,)


def test_a_result_stands_for_what_it_was_made_from(blender, gather, extension, add_mesh, sphere):
    points_in = extension("vad_addon.points_in")
    scan, result = add_mesh("Scan", sphere), add_mesh("Result", sphere)
    result["vad_role"] = "surface"
    assert gather().uids == (scan.session_uid,)
    scan.select_set(False)
    assert not points_in.sources(blender.context)
    problem = points_in.selection_problem(blender.context)
    assert problem == "The scan of Result is gone, or unknown: select another scan"

    made = blender.data.collections.new("Scan VAD")
    made.objects.link(result)
    made["vad_source"], made["vad_report"] = scan, "{}"
    assert gather().uids == (scan.session_uid,)
    blender.data.objects.remove(scan)
    assert not points_in.sources(blender.context)
    problem = points_in.selection_problem(blender.context)
    assert problem.endswith(": press Extract Again for other meshes, or select another scan")


@pytest.mark.parametrize("modifier", [False, True])
def test_only_what_is_selected_in_edit_mode(blender, gather, add_mesh, sphere, modifier):
    import bmesh

    obj = add_mesh("Scan", sphere)
    if modifier:
        obj.modifiers.new("Move", "DISPLACE").strength = 0
    blender.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(obj.data)
    for vertex in edited.verts:
        vertex.select = vertex.index % 5 == 0
    assert_allclose(gather(selected_only=True).points, sphere[::5], atol=1e-7)
    assert len(gather().points) == 500
    blender.ops.object.mode_set(mode="OBJECT")
    assert len(gather(selected_only=True).points) == 500


@pytest.mark.parametrize("how", ["object", "collection"])
def test_what_is_disabled_is_told_and_not_read(blender, gather, extension, add_mesh, sphere, how):
    points_in, scans = extension("vad_addon.points_in"), blender.data.collections.new("Scans")
    blender.context.scene.collection.children.link(scans)
    scan = add_mesh("Scan", sphere)
    for home in scan.users_collection:
        home.objects.unlink(scan)
    scans.objects.link(scan)
    blender.context.view_layer.objects.active = scan
    blender.ops.vad.reconstruct(resolution=16)
    scan.select_set(False)
    blender.context.view_layer.objects.active = blender.data.objects["Scan surface"]
    blender.data.objects["Scan surface"].select_set(True)
    if how == "object":
        scan.hide_viewport = True
    else:
        blender.context.view_layer.layer_collection.children["Scans"].exclude = True
    blender.context.view_layer.update()
    assert points_in.sources(blender.context) == [scan]
    assert points_in.selection_problem(blender.context).startswith("Scan is disabled in viewports")
    assert points_in.point_count([scan], blender.context) == 0
    with pytest.raises(extension("core.errors").InputError, match="Scan is disabled in viewports"):
        gather()
    with pytest.raises(RuntimeError, match="Scan is disabled in viewports"):
        blender.ops.vad.reconstruct(resolution=16)


def test_of_two_objects_with_an_edited_mesh_both_are_edited(blender, extension, add, add_mesh, sphere):
    points_in, axes = extension("vad_addon.points_in"), extension("vad_addon.axes")
    scan = add_mesh("Scan", sphere)
    twin = add("Twin", scan.data)
    blender.context.view_layer.objects.active = scan
    blender.ops.object.mode_set(mode="EDIT")
    blender.ops.mesh.select_all(action="SELECT")
    blender.ops.vad.fix_axes(origin="TYPED", axis=(0, 0, 1))
    assert points_in.point_count([twin], blender.context) == 500
    assert len(points_in.gather([twin], blender.context, selected_only=True).points) == 500
    for obj in (scan, twin):
        assert axes.held_by(obj)
        assert_allclose(axes.read(obj)[1], np.tile([0, 0, 1], (500, 1)), atol=1e-6)


def test_of_curves_only_what_is_selected_in_edit_mode(blender, gather, add):
    hair = blender.data.hair_curves.new("hair")
    hair.add_curves([3, 2])
    hair.attributes["position"].data.foreach_set("vector", np.arange(15, dtype=np.float32))
    hair.attributes.new(".selection", "BOOLEAN", "CURVE").data.foreach_set("value", [False, True])
    add("Hair", hair)
    blender.ops.object.mode_set(mode="EDIT")
    assert gather(selected_only=True).points.tolist() == [[9, 10, 11], [12, 13, 14]]
    blender.ops.object.mode_set(mode="OBJECT")
    blender.ops.object.select_all(action="DESELECT")

    curve = blender.data.curves.new("curve", "CURVE")
    spline = curve.splines.new("POLY")
    spline.points.add(3)
    for i, point in enumerate(spline.points):
        point.co = i, 0, 0, 1
    add("Curve", curve)
    blender.ops.object.mode_set(mode="EDIT")
    for i, point in enumerate(curve.splines[0].points):
        point.select = i in {1, 2}
    assert gather(selected_only=True).points.tolist() == [[1, 0, 0], [2, 0, 0]]
    assert len(gather().points) == 4


def test_an_empty_selection_is_refused(blender, gather, add_mesh, sphere, extension):
    add_mesh("Scan", sphere)
    blender.ops.object.mode_set(mode="EDIT")
    blender.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(extension("core.errors").InputError, match="Scan has 0 selected points: select some in"):
        gather(selected_only=True)


def test_a_selection_that_does_not_reach_the_points_is_no_selection(blender, gather, add):
    line = blender.data.curves.new("Line", "CURVE")
    line.splines.new("POLY").points.add(9)
    for k, point in enumerate(line.splines[0].points):
        point.co, point.select = (k, 0, 0, 1), k < 3
    curve = add("Line", line)
    blender.ops.object.mode_set(mode="EDIT")
    assert len(gather(selected_only=True).points) == 3
    line.bevel_depth = 0.1
    with pytest.raises(Exception, match="Line: its bevel, modifiers or geometry nodes make other points"):
        gather(selected_only=True)
    line.bevel_depth = 0
    nodes = blender.data.node_groups.new("Fewer", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        nodes.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    start, fewer, end = (
        nodes.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeResampleCurve", "NodeGroupOutput")
    )
    fewer.inputs["Count"].default_value = 5
    nodes.links.new(start.outputs[0], fewer.inputs[0])
    nodes.links.new(fewer.outputs[0], end.inputs[0])
    curve.modifiers.new("Fewer", "NODES").node_group = nodes
    with pytest.raises(Exception, match="make other points"):
        gather(selected_only=True)


def test_joined_colours_and_numbers_of_other_types_line_up(gather, add_mesh, sphere):
    first, second, none = (add_mesh(name, points) for name, points in (("A", sphere), ("B", sphere + 3), ("C", [])))
    for obj, kind, value in ((first, "FLOAT_COLOR", 0.25), (second, "BYTE_COLOR", 1.0), (none, "FLOAT", 0.0)):
        attribute = obj.data.attributes.new("Col", kind, "POINT")
        if obj != none:
            attribute.data.foreach_set("color", np.full(2000, value, np.float32))
    for name, kinds in {"label": ("INT", "FLOAT"), "mixed": ("FLOAT", "FLOAT_VECTOR")}.items():
        for obj, kind, value in zip((first, second), kinds, (7, 0.5), strict=True):
            attribute = obj.data.attributes.new(name, kind, "POINT")
            if kind != "FLOAT_VECTOR":
                attribute.data.foreach_set("value", np.full(500, value, np.int32 if kind == "INT" else np.float32))
    found = gather()
    kind, values = found.attributes["Col"].kind, found.attributes["Col"].values
    assert (kind, set(values[:500].ravel()), set(values[500:].ravel())) in [
        ("FLOAT_COLOR", {0.25}, {1.0}),
        ("FLOAT_COLOR", {1.0}, {0.25}),
    ]
    assert sorted(set(found.attributes["label"].values)) == [0.5, 7.0]
    assert "mixed" not in found.attributes
    assert any(line.startswith("Not carried over: mixed;") for line in found.warnings)


def test_what_the_components_of_one_object_hold_with_other_types_is_told(blender, gather, add_mesh, sphere):
    """A mesh that geometry nodes put points of a cloud beside, which carry a vector of the same name."""
    scan = add_mesh("Scan", sphere)
    scan.data.attributes.new("mixed", "FLOAT", "POINT")
    nodes = blender.data.node_groups.new("Beside", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        nodes.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    kinds = "NodeGroupInput", "GeometryNodePoints", "GeometryNodeStoreNamedAttribute", "GeometryNodeJoinGeometry"
    start, points, store, both, end = (nodes.nodes.new(kind) for kind in (*kinds, "NodeGroupOutput"))
    points.inputs["Count"].default_value = 3
    store.data_type = "FLOAT_VECTOR"
    store.inputs["Name"].default_value = "mixed"
    for one, other in ((start, both), (points, store), (store, both), (both, end)):
        nodes.links.new(one.outputs[0], other.inputs[0])
    scan.modifiers.new("Beside", "NODES").node_group = nodes
    found = gather()
    assert len(found.points) == len(sphere) + 3
    assert "mixed" not in found.attributes
    assert found.warnings[0].startswith("Not carried over: mixed;")


def test_colours_of_corners_without_faces_are_told(blender, gather, add_mesh, sphere):
    scan = add_mesh("Scan", sphere)
    scan.data.attributes.new("Col", "BYTE_COLOR", "CORNER")
    found = gather()
    assert "Col" not in found.attributes
    assert found.warnings[0].startswith("Not carried over: Col;")


def test_attributes_of_joined_objects_line_up(gather, add_mesh, sphere):
    for name, count in (("Plain", 3), ("Scan", 4)):
        obj = add_mesh(name, sphere[:count])
        if name == "Scan":
            obj.data.attributes.new("Col", "FLOAT_COLOR", "POINT").data.foreach_set("color", np.arange(16.0) / 16)
            obj.data.attributes.new("label", "INT", "POINT").data.foreach_set("value", [4, 3, 2, 1])
    carried = gather().attributes
    assert set(carried) == {"Col", "label"}
    assert_allclose(carried["Col"].values, np.vstack([np.arange(16.0).reshape(4, 4) / 16, np.zeros((3, 4))]))
    assert carried["label"].values.tolist() == [4, 3, 2, 1, 0, 0, 0]


def test_fixed_axes_follow_the_object_as_normals_do(gather, add_mesh, sphere):
    obj = add_mesh("Scan", sphere)
    axes = np.zeros((500, 3))
    axes[7], axes[20] = (1, 1, 0), (0, 0, 2)
    obj.data.attributes.new("vad_axis", "FLOAT_VECTOR", "POINT").data.foreach_set("vector", axes.ravel())
    obj.scale = 1, 4, 1
    found = gather()
    indices, world_axes = found.constraints
    assert "vad_axis" not in found.attributes
    assert indices.tolist() == [7, 20]
    unit = world_axes / np.linalg.norm(world_axes, axis=1, keepdims=True)
    assert_allclose(unit, [np.array([4, 1, 0]) / 17**0.5, (0, 0, 1)], atol=1e-6)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (dict(kind="cylinder", vertices=128), "much of its area lies on faces far larger"),
        (dict(kind="monkey"), "from face to face it turns by 35 degrees"),
        (dict(kind="cube"), "from face to face it turns by 90 degrees"),
        (dict(kind="torus"), None),
        (dict(kind="uv_sphere"), None),
        (dict(kind="grid"), None),
        (dict(kind="circle"), None),
    ],
    ids=lambda make: make["kind"] if isinstance(make, dict) else "",
)
def test_of_parts_with_few_vertices_it_is_told_that_these_alone_are_read(blender, extension, make, told):
    options = dict(make)
    getattr(blender.ops.mesh, f"primitive_{options.pop('kind')}_add")(**options)
    obj = blender.context.object
    found = extension("vad_addon.points_in").gather([obj], blender.context)
    said = [line for line in found.warnings if "its vertices alone are read" in line]
    assert [told in line for line in said] == [True] if told else not said
    assert len(found.points) == len(obj.data.vertices)


def test_subdivided_they_are_enough(blender, extension):
    blender.ops.mesh.primitive_monkey_add()
    obj = blender.context.object
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 2
    assert not extension("vad_addon.points_in").gather([obj], blender.context).warnings


def test_a_scan_with_a_box_beside_it_is_one(add_mesh, blender, extension):
    obj = add_mesh("Scan", np.random.default_rng(0).random((1000, 3)) + 2)
    blender.ops.mesh.primitive_cube_add()
    blender.context.view_layer.objects.active = obj
    obj.select_set(True)
    blender.ops.object.join()
    assert len(obj.data.polygons) == 6
    assert extension("vad_addon.points_in").gather([obj], blender.context).warnings == ()


@pytest.mark.parametrize("loose", [False, True], ids=["a base", "loose points"])
def test_a_scan_with_a_large_face_is_one(add_mesh, blender, extension, loose):
    x, y = np.divmod(np.arange(2500), 50)
    corner = (x * 50 + y)[(x < 49) & (y < 49)]
    faces = [] if loose else np.stack([corner, corner + 50, corner + 51, corner + 1], axis=1).tolist()
    obj = add_mesh("Scan", np.zeros((1, 3)))
    mesh = blender.data.meshes.new("Scan")
    points = [*np.stack([x, y, 0 * x], axis=1).tolist(), (0, 0, -9), (20, 0, -9), (20, 20, -9), (0, 20, -9)]
    mesh.from_pydata(points, [], [*faces, (2500, 2501, 2502, 2503)])
    obj.data = mesh
    assert extension("vad_addon.points_in").gather([obj], blender.context).warnings == ()
