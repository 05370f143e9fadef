"""Whatever happens to the source, the file or the extension while a run is under way: it ends well."""

import math

import bpy


def sphere(count):
    """Points of the unit sphere on a Fibonacci spiral."""
    for i in range(count):
        z = 1 - (2 * i + 1) / count
        angle, ring = math.pi * (1 + 5**0.5) * i, math.sqrt(1 - z * z)
        yield ring * math.cos(angle), ring * math.sin(angle), z


def case(gui):
    yield from gui.install()
    job = gui.module("vad_addon.job")
    small, large = list(sphere(1000)), list(sphere(100_000))

    def start(points, resolution):
        gui.add_points("Scan", points)
        bpy.context.scene.vad.resolution = resolution
        with gui.override():
            bpy.ops.ed.undo_push(message="scan")
            assert bpy.ops.vad.reconstruct("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
        process = job.running()._process
        yield from gui.until(lambda: job.running() is None or job.running().stage != "starting")
        return process

    # The source deleted.
    yield from start(small, 64)
    with gui.override():
        bpy.ops.object.delete()
    assert "Scan" not in bpy.context.scene.objects
    yield from gui.until(lambda: not job.running())
    assert len(bpy.context.scene.vad.result.objects) == 3
    gui.shot("1_source_deleted")

    # The source's making undone.
    yield from start(small, 64)
    yield from gui.key("Z", ctrl=True)
    yield from gui.until(lambda: not job.running())
    assert len(bpy.context.scene.vad.result.objects) == 3
    gui.shot("2_source_undone")

    # The Cancel button.
    process = yield from start(large, 256)
    assert not bpy.ops.vad.reconstruct.poll(), "a second run would start"
    bpy.ops.vad.cancel()
    assert not job.running()
    yield from gui.until(lambda: process.returncode is not None)
    gui.shot("3_cancelled")

    # Another file loaded.
    process = yield from start(large, 256)
    bpy.ops.wm.read_homefile()
    assert job.running() is None
    yield from gui.until(lambda: process.returncode is not None)
    gui.shot("4_file_loaded")

    # The extension disabled, and enabled again.
    process = yield from start(large, 256)
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.vad")
    assert process.returncode is not None, "the worker outlived the extension"
    yield 0.5
    yield from gui.key("ESC")
    gui.shot("5_disabled")
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.vad")
    job = gui.module("vad_addon.job")
    yield 0.3

    # Blender quits; the worker's folder is looked for afterwards.
    yield from start(large, 256)
    gui.quit()
    yield 60
    raise AssertionError("Blender did not quit")
