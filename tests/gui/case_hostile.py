"""What goes wrong in daily work ends in a sentence, leaves nothing behind and never prints a traceback."""

import contextlib
import subprocess

import bpy

BUTTON, AGAIN = (105, 146), (105, 168)  # "Reconstruct" in the sidebar, before and after there are results


def case(gui):
    yield from gui.install()
    job, problem = gui.module("vad_addon.job"), gui.module("vad_addon.points_in").selection_problem
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.context.scene.vad.resolution = 48

    log = next(area for area in gui.window.screen.areas if area.type == "DOPESHEET_EDITOR")
    log.type = "INFO"

    def said():
        """What operators in the window said, which the info editor keeps."""
        region = next(region for region in log.regions if region.type == "WINDOW")
        with bpy.context.temp_override(window=gui.window, area=log, region=region):
            bpy.ops.info.select_all(action="SELECT")
            bpy.ops.info.report_copy()
            bpy.ops.info.select_all(action="DESELECT")
        return bpy.context.window_manager.clipboard

    def fails(name, text, button=BUTTON):
        """A click that must end without results, with these words; a generator."""
        before = set(bpy.data.objects)
        yield from gui.click(*button)
        yield from gui.until(lambda: not job.running())
        yield 0.3
        gui.shot(name)
        assert set(bpy.data.objects) == before
        assert text in said(), said()
        yield from gui.key("ESC")

    # Nothing selected, then something without points: the button is off.
    assert problem(bpy.context) == "No active object: select a point cloud or a mesh"
    yield from gui.click(*BUTTON)
    assert not job.running()
    gui.add(bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye")))
    yield 0.3
    gui.shot("1_wrong_type")
    assert problem(bpy.context).startswith("Eye (camera) holds no points")
    yield from gui.click(*BUTTON)
    assert not job.running()

    # No points, and too few.
    gui.add_points("Empty", [])
    yield from fails("2_empty", "Empty has 0 points")
    gui.add_points("Three", [(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    yield from fails("3_three", "3 distinct finite points")
    gui.add_points("Nowhere", [(float("nan"), 0, 0)] * 50)
    yield from fails("3_nowhere", "distinct finite points of 50 given")

    # An unsaved file, saved afterwards: its volume comes along.
    bpy.ops.wm.ply_import(filepath=str(gui.folder / "bust.ply"))
    gui.thin_out(bpy.context.active_object.data, 7)

    def run():
        with gui.override():
            assert bpy.ops.vad.reconstruct("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
        yield from gui.until(lambda: not job.running())
        yield 0.3
        return bpy.context.scene.vad.result

    yield from run()
    bpy.ops.wm.save_as_mainfile(filepath=str(gui.folder / "scene.blend"))
    (volume,) = bpy.data.volumes
    assert volume.filepath.startswith("//vad/"), volume.filepath
    assert volume.grids.load()
    gui.shot("4_saved")

    # A disk that is full, and a folder that is read-only: all is delivered but the volume, and the earlier one stays.
    small = gui.folder / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(small)]
    if subprocess.run(mount, stderr=subprocess.DEVNULL).returncode:
        print("no full disk and no read-only folder could be made here")
        return
    bpy.ops.wm.save_as_mainfile(filepath=str(small / "scene.blend"))
    (small / "filler").write_bytes(bytes(1 << 20))
    bpy.context.scene.vad.resolution = 128
    for options, name in (([], "5_disk_full"), (["-o", "remount,ro"], "6_read_only")):
        if options:
            subprocess.run(["mount", *options, str(small)], check=True)
        result = yield from run()
        assert {obj["vad_role"] for obj in result.objects} == {"samples", "surface", "field"}
        assert "\nNo volume: " in result["vad_warnings"], result["vad_warnings"]
        assert "is out of date" in result["vad_warnings"], result["vad_warnings"]
        assert list(bpy.data.volumes) == [volume]
        assert volume.grids.load()
        gui.shot(name)

    # No room for what is exchanged with the worker.
    subprocess.run(["mount", "-o", "remount,rw", str(small)], check=True)
    (small / "filler").unlink()
    bpy.context.preferences.filepaths.temporary_directory = str(small)
    assert bpy.app.tempdir.startswith(str(small))
    _fill(small)
    yield from fails("7_no_room", "free space there, or choose another folder for temporary files", AGAIN)
    bpy.context.preferences.filepaths.temporary_directory = ""
    subprocess.run(["umount", "-l", str(small)], check=True)


def _fill(folder):
    """Leave no byte free on a disk."""
    with contextlib.suppress(OSError), open(folder / "rest", "wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))
