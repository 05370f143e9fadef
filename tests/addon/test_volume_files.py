"""Volumes that nothing can read any more do not pile up; every other one stays."""

import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def files(blender, extension):
    module = extension("vad_addon.volume_files")
    module._made.clear()
    return module


@pytest.fixture
def folder(blender, tmp_path):
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return tmp_path


@pytest.fixture
def run(blender, files, folder, add_mesh, sphere):
    """Function: run once more."""
    add_mesh("Scan", sphere)
    return lambda: blender.ops.vad.reconstruct(resolution=16)


def names(folder):
    return sorted(path.name for path in (folder / "vad").glob("*.vdb"))


def test_all_stay_while_undo_may_bring_them_back(blender, run, folder):
    for _ in range(3):
        run()
    blender.ops.wm.save_mainfile()
    assert names(folder) == ["Scan.vdb", "Scan_001.vdb", "Scan_002.vdb"]


def test_with_another_file_go_those_that_no_saved_file_reads(blender, run, folder):
    run()
    run()
    blender.ops.wm.save_mainfile()
    run()
    run()
    blender.ops.wm.read_homefile(use_empty=True)
    assert names(folder) == ["Scan_001.vdb"]
    blender.ops.wm.open_mainfile(filepath=str(folder / "scene.blend"))
    assert blender.data.volumes["Scan field"].grids.load()


def test_what_an_earlier_save_reads_stays(blender, run, folder):
    run()
    blender.ops.wm.save_as_mainfile(filepath=str(folder / "first.blend"), copy=True)
    run()
    blender.ops.wm.save_as_mainfile(filepath=str(folder / "second.blend"))
    run()
    blender.ops.wm.read_homefile(use_empty=True)
    assert names(folder) == ["Scan.vdb", "Scan_001.vdb"]


def test_what_the_file_that_is_loaded_reads_stays(blender, run, folder, files):
    run()
    made = set(files._made)
    blender.ops.wm.save_mainfile()
    files._made.update(made)  # as if the save had gone unnoticed: recovered from a crash, say
    blender.ops.wm.open_mainfile(filepath=str(folder / "scene.blend"))
    assert names(folder) == ["Scan.vdb"]


def test_files_of_other_sessions_are_never_touched(blender, run, folder, files):
    (folder / "vad").mkdir()
    (folder / "vad" / "Scan.vdb").write_bytes(b"of somebody else")
    run()
    blender.ops.wm.read_homefile(use_empty=True)
    assert names(folder) == ["Scan.vdb"]


@pytest.fixture
def unsaved(blender, files, add_mesh, sphere):
    """The volume of a run in a file that was never saved."""
    add_mesh("Scan", sphere)
    blender.ops.vad.reconstruct(resolution=16)
    volume = blender.data.volumes["Scan field"]
    assert Path(volume.filepath).parent.parent == files.cache_folder()
    return volume


def test_a_save_brings_the_volumes_of_an_unsaved_file_along(blender, unsaved, tmp_path):
    cached = Path(unsaved.filepath)
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert unsaved.filepath == "//vad/Scan.vdb"
    assert (tmp_path / "vad" / "Scan.vdb").read_bytes() == cached.read_bytes()  # undo leads back to it
    assert unsaved.grids.load()
    blender.ops.wm.save_mainfile()
    assert names(tmp_path) == ["Scan.vdb"]
    (tmp_path / "elsewhere").mkdir()
    for name in ("scene.blend", "vad"):
        (tmp_path / name).rename(tmp_path / "elsewhere" / name)
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "elsewhere" / "scene.blend"))
    assert not cached.exists()
    assert blender.data.volumes["Scan field"].grids.load()


def test_what_lies_in_the_cache_folder_of_before_comes_along(blender, unsaved, tmp_path):
    before = tmp_path / "before" / "vad_cache" / "Scan.vdb"
    before.parent.mkdir(parents=True)
    shutil.copyfile(unsaved.filepath, before)
    unsaved.filepath = str(before)
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert unsaved.filepath == "//vad/Scan.vdb"
    assert unsaved.grids.load()


def test_beside_a_file_in_a_folder_called_like_the_cache_nothing_is_copied_again(blender, unsaved, tmp_path):
    (tmp_path / "vad_cache").mkdir()
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "vad_cache" / "scene.blend"))
    blender.ops.wm.save_mainfile()
    assert unsaved.filepath == "//vad/Scan.vdb"
    assert names(tmp_path / "vad_cache") == ["Scan.vdb"]


def test_what_undo_brings_back_from_the_cache_comes_along_again(blender, unsaved, tmp_path):
    cached = unsaved.filepath
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    unsaved.filepath = cached
    blender.ops.wm.save_mainfile()
    assert unsaved.filepath == "//vad/Scan.vdb"
    assert names(tmp_path) == ["Scan.vdb"]


def test_beside_a_file_saved_by_way_of_a_link_the_volume_stays(blender, unsaved, tmp_path):
    (tmp_path / "far" / "off" / "place").mkdir(parents=True)
    link = tmp_path / "link"
    try:
        link.symlink_to(tmp_path / "far" / "off" / "place")
    except OSError:
        pytest.skip("no symbolic links here")
    blender.ops.wm.save_as_mainfile(filepath=str(link / "scene.blend"))
    assert unsaved.filepath == "//vad/Scan.vdb"
    blender.ops.wm.read_homefile(use_empty=True)
    assert names(link) == ["Scan.vdb"]
    blender.ops.wm.open_mainfile(filepath=str(link / "scene.blend"))
    assert blender.data.volumes["Scan field"].grids.load()


def test_a_second_file_saved_beside_the_first_has_its_own_volume(blender, unsaved, add_mesh, sphere, tmp_path):
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "first.blend"))
    blender.ops.wm.read_homefile(use_empty=True)
    add_mesh("Scan", 2 * sphere)
    blender.ops.vad.reconstruct(resolution=16)
    made = Path(blender.data.volumes["Scan field"].filepath).read_bytes()
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "second.blend"))
    assert names(tmp_path) == ["Scan.vdb", "Scan_001.vdb"]
    assert blender.data.volumes["Scan field"].filepath == "//vad/Scan_001.vdb"
    assert (tmp_path / "vad" / "Scan_001.vdb").read_bytes() == made


@pytest.mark.parametrize("letter", ["a", "ä"])
def test_a_name_too_long_for_a_file_is_shortened(files, tmp_path, letter):
    (tmp_path / "field.vdb").write_bytes(b"a volume")
    for _ in range(2):
        path = files.adopt(255 * letter, tmp_path / "field.vdb", tmp_path / "vad")
        assert path.read_bytes() == b"a volume"
    assert len(names(tmp_path)) == 2


def test_a_saved_copy_has_volumes_of_its_own(blender, unsaved, tmp_path):
    cached = unsaved.filepath
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copy.blend"), copy=True)
    assert unsaved.filepath == cached
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "copy.blend"))
    assert blender.data.volumes["Scan field"].filepath == "//vad/Scan.vdb"
    assert names(tmp_path) == ["Scan.vdb"]


def test_a_volume_that_cannot_be_copied_stays_and_that_is_said(blender, unsaved, tmp_path):
    cached = unsaved.filepath
    (tmp_path / "vad").write_text("in the way")
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert Path(blender.path.abspath(unsaved.filepath)).resolve() == Path(cached).resolve()
    assert unsaved.grids.load()
    (warning,) = blender.context.scene.vad.result["vad_warnings"].splitlines()
    assert warning.startswith("The volume stays in the cache folder: ")
    assert warning.endswith("; save the .blend in another folder")
    (tmp_path / "vad").unlink()
    blender.ops.wm.save_mainfile()
    assert unsaved.filepath == "//vad/Scan.vdb"
    assert not blender.context.scene.vad.result["vad_warnings"]


def test_a_volume_that_another_session_cleared_is_said_to_be_lost(blender, unsaved, tmp_path):
    Path(unsaved.filepath).unlink()
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    (warning,) = blender.context.scene.vad.result["vad_warnings"].splitlines()
    assert warning.startswith("The volume is lost: ")
    blender.ops.vad.reextract()
    blender.ops.wm.save_mainfile()
    assert blender.data.volumes["Scan field"].grids.load()
    assert not blender.context.scene.vad.result["vad_warnings"]


def test_after_a_save_where_all_failed_the_next_one_brings_the_volume_along(blender, unsaved, tmp_path):
    cached = unsaved.filepath
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "vad").write_text("in the way")
    (tmp_path / "full" / "scene.blend").mkdir()
    with pytest.raises(RuntimeError):
        blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "full" / "scene.blend"))
    assert unsaved.filepath == cached
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert unsaved.filepath == "//vad/Scan.vdb"
    assert unsaved.grids.load()


def box_shown(blender):
    """Longest side of the field as Blender shows it."""
    blender.context.view_layer.update()
    return max(blender.data.objects["Scan field"].evaluated_get(blender.context.evaluated_depsgraph_get()).dimensions)


@pytest.mark.parametrize("saved", [False, True])
def test_each_run_shows_its_own_field_whatever_was_opened_between(blender, files, add_mesh, sphere, tmp_path, saved):
    shown = []
    add_mesh("Scan", sphere)
    if saved:
        blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    for size in (1.0, 3.0):
        if saved:
            blender.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
            scan = blender.data.objects["Scan"]
            blender.context.view_layer.objects.active = scan
        else:
            blender.ops.wm.read_homefile(use_empty=True)
            scan = add_mesh("Scan", sphere)
        scan.scale = 3 * (size,)
        blender.ops.vad.reconstruct(resolution=16)
        blender.data.objects["Scan field"].hide_set(False)
        shown.append(box_shown(blender))
    assert shown[1] == pytest.approx(3 * shown[0], rel=0.1)


def test_a_save_that_fails_changes_nothing(blender, unsaved, tmp_path):
    cached = unsaved.filepath
    (tmp_path / "scene.blend").mkdir()
    with pytest.raises(RuntimeError):
        blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert unsaved.filepath == cached
    blender.ops.wm.read_homefile(use_empty=True)
    assert names(tmp_path) == []


END_OF_A_SESSION = """
    import importlib, sys, types
    import bpy

    package = types.ModuleType("vad_extension")
    package.__path__ = [sys.argv[1]]
    sys.modules["vad_extension"] = package
    vad_addon = importlib.import_module("vad_extension.vad_addon")
    vad_addon.register()
    files = importlib.import_module("vad_extension.vad_addon.volume_files")
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2])
    files._QUITTING = float(sys.argv[3])
    for name in ("saved", "updated", "shown"):
        temporary = bpy.app.tempdir + name
        open(temporary, "w").close()
        path = files.adopt(name, temporary)
        if name == "updated":
            continue
        bpy.data.volumes.new(name).filepath = str(path)
        if name == "saved":
            bpy.ops.wm.save_mainfile()
            bpy.data.volumes.remove(bpy.data.volumes[name])
    vad_addon.unregister()
"""


def test_of_a_script_go_those_that_no_save_read(bpy, tmp_path):
    script = textwrap.dedent(END_OF_A_SESSION).replace("vad_addon.unregister()", "")
    arguments = [str(ROOT), str(tmp_path / "scene.blend"), "20"]
    ran = subprocess.run([sys.executable, "-c", script, *arguments], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert names(tmp_path) == ["saved.vdb", "shown.vdb"]


@pytest.mark.parametrize(("seconds", "left"), [(20, set()), (-1, {"updated.vdb"})], ids=["quits", "disabled"])
def test_at_the_end_go_those_that_neither_a_saved_nor_the_open_file_reads(bpy, tmp_path, seconds, left):
    blend = str(tmp_path / "scene.blend")
    ran = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(END_OF_A_SESSION), str(ROOT), blend, str(seconds)],
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert set(names(tmp_path)) == {"saved.vdb", "shown.vdb"} | left
