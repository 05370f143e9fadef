"""The three clicks of a newcomer, and what happens when things go another way."""

import statistics
import time

import bpy

COST = 105, 205
BUTTON = 105, 146  # "Reconstruct" in the sidebar; in its place is "Cancel" while a run is under way


def contents():
    kinds = ("collections", "objects", "meshes", "pointclouds", "volumes", "materials")
    return {(kind, block.name) for kind in kinds for block in getattr(bpy.data, kind)}


def case(gui):
    yield from gui.install()
    job = gui.module("vad_addon.job")
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    gui.shot("1_nothing_selected")

    bpy.ops.wm.ply_import(filepath=str(gui.folder / "bust.ply"))
    bust = bpy.context.active_object
    with gui.override():
        bpy.ops.view3d.view_selected()
        bpy.ops.ed.undo_push(message="bust")
    yield 0.5
    gui.shot("2_selected")
    before = contents()

    # What it would cost, shown in the tab.
    yield from gui.click(*COST)
    yield 0.5
    gui.shot("2_cost")
    assert gui.module("vad_addon.cost").lines(bpy.context)[0].startswith("18,000 points")

    # Esc stops a run within a second and leaves nothing.
    bpy.context.scene.vad.resolution = 256
    yield from gui.click(*BUTTON)
    assert job.running(), "the click did not start a run"
    yield from gui.until(lambda: job.running().stage != "starting")
    gui.shot("3_running")
    assert not bpy.ops.vad.reconstruct.poll()
    pressed = time.monotonic()
    yield from gui.key("ESC")
    yield from gui.until(lambda: not job.running(), 5)
    assert time.monotonic() - pressed < 1.0, time.monotonic() - pressed
    assert contents() == before
    gui.shot("4_escaped")

    # To the end, with the window in use and the source gone meanwhile.
    bpy.context.scene.vad.resolution = 64
    yield from gui.click(*BUTTON)
    ticks = []
    last = time.monotonic()
    while job.running():
        yield 0.05
        ticks.append(time.monotonic() - last)
        last = time.monotonic()
    print(f"ticks: median {statistics.median(ticks):.3f} s, longest {max(ticks):.3f} s")
    assert statistics.median(ticks) < 0.3
    result = bpy.context.scene.vad.result
    assert result is not None, "the run gave no result"
    assert {obj["vad_role"] for obj in result.objects} == {"samples", "surface", "field"}
    surface = next(obj for obj in result.objects if obj["vad_role"] == "surface")
    assert bust.hide_get()
    assert bust.hide_render
    assert [obj for obj in result.objects if not obj.hide_get()] == [surface] == bpy.context.selected_objects
    gui.shot("5_done")

    # One undo takes everything away and brings the source back.
    yield from gui.key("Z", ctrl=True)
    yield 0.5
    assert contents() == before, contents() ^ before
    assert not bpy.data.objects["bust"].hide_get()
    gui.shot("6_undone")

    # Run again: redone, then updated in place, from the hidden source.
    with gui.override():
        bpy.ops.ed.redo()
    yield 0.5
    assert bpy.data.objects["bust"].hide_get()
    result = bpy.context.scene.vad.result
    surface = next(obj for obj in result.objects if obj["vad_role"] == "surface")
    coarse = len(surface.data.vertices)
    surface.data.materials.append(bpy.data.materials.new("Mine"))
    bpy.context.view_layer.objects.active = surface
    bpy.context.scene.vad.resolution = 80
    yield 0.5
    with gui.override():
        assert bpy.ops.vad.reconstruct("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield from gui.until(lambda: not job.running())
    assert bpy.context.scene.vad.result == result
    surface = next(obj for obj in result.objects if obj["vad_role"] == "surface")
    assert len(surface.data.vertices) > 1.2 * coarse
    assert surface.data.materials[0].name == "Mine"
    yield 0.3
    gui.shot("7_updated")
