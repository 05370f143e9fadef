"""Text files become meshes of loose vertices, by name and place."""

import numpy as np
import pytest
from numpy.testing import assert_allclose


def coordinates(obj):
    flat = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3) + np.array(obj.location, np.float64)


@pytest.mark.parametrize("ending", [".xyz", ".pts", ".txt", ".csv"])
def test_a_file_becomes_the_active_object(blender, tmp_path, sphere, ending):
    path = tmp_path / f"Scan{ending}"
    np.savetxt(path, sphere, delimiter="," if ending == ".csv" else " ")
    assert blender.ops.vad.import_points(filepath=str(path)) == {"FINISHED"}
    obj = blender.context.active_object
    assert (obj.name, obj.type) == ("Scan", "MESH")
    assert_allclose(coordinates(obj), sphere, atol=1e-6)
    assert blender.ops.vad.reconstruct.poll()


def test_dropped_files_become_an_object_each(blender, tmp_path, sphere):
    for name in ("a.xyz", "b.xyz"):
        np.savetxt(tmp_path / name, sphere)
    files = [{"name": "a.xyz"}, {"name": "b.xyz"}]
    assert blender.ops.vad.import_points(directory=str(tmp_path), files=files) == {"FINISHED"}
    assert [obj.name for obj in blender.context.selected_objects] == ["a", "b"]


def test_a_linked_collection_and_edit_mode_are_left(blender, tmp_path, sphere, add_mesh):
    np.savetxt(tmp_path / "a.xyz", sphere)
    home = blender.data.collections.new("Home")
    blender.data.libraries.write(str(tmp_path / "home.blend"), {home})
    blender.data.collections.remove(home)
    with blender.data.libraries.load(str(tmp_path / "home.blend"), link=True) as (_, wanted):
        wanted.collections = ["Home"]
    scene, layer = blender.context.scene, blender.context.view_layer
    scene.collection.children.link(blender.data.collections["Home"])
    edited = add_mesh("Edited", sphere)
    blender.ops.object.mode_set(mode="EDIT")
    layer.active_layer_collection = layer.layer_collection.children["Home"]
    assert blender.ops.vad.import_points(filepath=str(tmp_path / "a.xyz")) == {"FINISHED"}
    assert "a" in scene.collection.objects
    assert edited.mode == "OBJECT"


def test_the_file_handler_names_the_importer_and_its_files(blender):
    handler = blender.types.VAD_FH_points
    assert handler.bl_import_operator == "vad.import_points"
    assert handler.bl_file_extensions == ".xyz;.pts;.txt;.csv"


def test_large_coordinates_keep_their_detail(blender, tmp_path, sphere):
    np.savetxt(tmp_path / "far.xyz", sphere + np.array([3.5e5, 5.5e6, 120]), fmt="%.9f")
    blender.ops.vad.import_points(filepath=str(tmp_path / "far.xyz"))
    assert_allclose(coordinates(blender.context.active_object) - [3.5e5, 5.5e6, 120], sphere, atol=1e-6)


def test_points_that_are_nowhere_are_left_out_and_counted(blender, tmp_path, capfd):
    (tmp_path / "holes.xyz").write_text("0 0 0\nnan 0 1\n1 2 3\n")
    blender.ops.vad.import_points(filepath=str(tmp_path / "holes.xyz"))
    assert len(blender.context.active_object.data.vertices) == 2
    assert "Warning: holes: 1 points left out" in capfd.readouterr().out


def test_colours_and_other_columns_come_along(blender, tmp_path):
    rows = "0 0 0 .5 255 128 0\nnan 0 1 .5 1 2 3\n1 2 3 1 0 10 255\n"
    (tmp_path / "scan.pts").write_text(rows)
    blender.ops.vad.import_points(filepath=str(tmp_path / "scan.pts"))
    found = blender.context.active_object.data.attributes
    shown = np.array([value.color_srgb for value in found["Col"].data])
    assert_allclose(shown * 255, [[255, 128, 0, 255], [0, 10, 255, 255]], atol=0.01)
    assert [value.value for value in found["intensity"].data] == [0.5, 1]
    assert not {"red", "green", "blue"} & set(found.keys())


def test_columns_named_as_blenders_own_leave_those_alone(blender, tmp_path):
    (tmp_path / "scan.csv").write_text("x,y,z,position,weight\n1,2,3,7,8\n3,2,1,7,8\n")
    blender.ops.vad.import_points(filepath=str(tmp_path / "scan.csv"))
    obj = blender.context.active_object
    assert_allclose(coordinates(obj), [[1, 2, 3], [3, 2, 1]], atol=1e-6)
    assert obj.data.attributes["weight"].data[1].value == 8


def test_columns_that_points_cannot_have_in_blender_get_another_name(blender, tmp_path):
    names = "material_index", "sharp_face", 40 * "long", "é" * 50, "crease_vert"
    rows = ["x,y,z," + ",".join(names)] + [f"{k},{k * k},1,5,6,7,8,9" for k in range(9)]
    (tmp_path / "scan.csv").write_text("\n".join(rows), encoding="utf-8")
    blender.ops.vad.import_points(filepath=str(tmp_path / "scan.csv"))
    obj = blender.context.active_object
    found = {each.name for each in obj.data.attributes if each.name != "position" and not each.name.startswith(".")}
    assert {"scan_material_index", "scan_sharp_face", "scan_crease_vert", (40 * "long")[:62]} <= found
    assert all(len(obj.data.attributes[name].data) == 9 for name in found)
    assert [value.value for value in obj.data.attributes["scan_material_index"].data] == [5] * 9
    assert blender.ops.vad.reconstruct(resolution=16) == {"FINISHED"}


def test_long_names_of_columns_that_begin_alike_stay_apart(blender, tmp_path):
    names = [70 * "a" + each for each in "bcd"]
    (tmp_path / "scan.csv").write_text(
        "x,y,z," + ",".join(names) + "\n" + "".join(f"{k},0,1,5,6,7\n" for k in range(4))
    )
    blender.ops.vad.import_points(filepath=str(tmp_path / "scan.csv"))
    held = blender.context.active_object.data.attributes
    for name, expected in ((62 * "a", 5), (60 * "a" + "_2", 6), (60 * "a" + "_3", 7)):
        assert [value.value for value in held[name].data] == [expected] * 4


def test_a_file_that_cannot_be_read_is_one_sentence_and_no_object(blender, tmp_path):
    (tmp_path / "bad.xyz").write_text("no numbers here\n")
    with pytest.raises(RuntimeError, match=r"bad\.xyz") as caught:
        blender.ops.vad.import_points(filepath=str(tmp_path / "bad.xyz"))
    assert "Traceback" not in str(caught.value)
    assert not blender.data.objects
