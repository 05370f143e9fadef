"""Normals fixed by hand: picked in edit mode by clicks on the buttons of the tab, seen in their own colour, undone."""

import bmesh
import bpy
import numpy as np

LINES, FIXED = (0.0, 1.0, 0.0), (1.0, 0.0, 1.0)  # colours that nothing else in the viewport has


def case(gui):
    yield from gui.install()
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.wm.ply_import(filepath=str(gui.folder / "bust.ply"))
    bust = bpy.context.active_object
    gui.thin_out(bust.data, 7)
    overlay = bpy.context.scene.vad.overlay
    overlay.colour, overlay.fixed_colour, overlay.width = (*LINES, 1.0), (*FIXED, 1.0), 2.0
    with gui.override():
        bpy.ops.view3d.view_selected()
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="DESELECT")
    mesh = bmesh.from_edit_mesh(bust.data)
    for vertex in mesh.verts:
        vertex.select = vertex.index % 10 == 0
    mesh.select_flush_mode()
    bmesh.update_edit_mesh(bust.data)
    bpy.ops.ed.undo_push(message="selected")
    yield 0.5

    def pixels(name, colour):
        gap = np.abs(gui.view_pixels(gui.shot(name)) - colour).max(axis=-1)
        return int((gap < 0.06).sum())

    assert pixels("1_none", FIXED) == 0
    with gui.override():
        assert bpy.ops.vad.fix_axes("INVOKE_DEFAULT", True, origin="TYPED", axis=(0, 0, 1)) == {"FINISHED"}
    yield 0.3
    assert overlay.show
    assert pixels("2_fixed", FIXED) > 200
    with gui.override():
        assert bpy.ops.vad.free_axes("INVOKE_DEFAULT", True) == {"FINISHED"}
    yield 0.3
    assert pixels("3_freed", FIXED) == 0
    yield from gui.key("Z", ctrl=True)
    yield 0.5
    assert pixels("4_undone", FIXED) > 200
    with gui.override():
        assert bpy.ops.vad.fix_axes("INVOKE_DEFAULT", True, origin="VIEW") == {"FINISHED"}
    yield 0.3
    gui.shot("5_from_the_view")

    # They hold in the run, and both colours are seen, also in the file when it is loaded again.
    with gui.override():
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.scene.vad.resolution = 48
    assert bpy.ops.vad.reconstruct() == {"FINISHED"}
    bust.hide_set(False)
    for obj in bpy.context.scene.vad.result.objects:
        obj.hide_set(obj["vad_role"] != "samples")
    yield 0.3
    assert pixels("6_both", FIXED) > 100
    shown = pixels("6_both", LINES)
    assert shown > 1000
    bpy.ops.wm.save_as_mainfile(filepath=str(gui.folder / "axes.blend"))
    bpy.ops.wm.read_homefile()
    yield 0.5
    assert pixels("7_other_file", LINES) == 0
    bpy.ops.wm.open_mainfile(filepath=str(gui.folder / "axes.blend"))
    yield 1.0
    assert pixels("8_loaded_again", LINES) > 0.8 * shown
    assert pixels("8_loaded_again", FIXED) > 100
