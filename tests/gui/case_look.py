"""The results looked at: normals over the viewport, a shell, a slice, the fog."""

import bpy
import numpy as np

LINES = (1.0, 0.0, 0.0)  # a red that nothing else in the viewport has


def case(gui):
    yield from gui.install()
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.wm.ply_import(filepath=str(gui.folder / "bust.ply"))
    bust = bpy.context.active_object
    gui.thin_out(bust.data, 3)
    bpy.context.scene.vad.resolution = 48
    assert bpy.ops.vad.reconstruct() == {"FINISHED"}  # from a script: at once
    made = {obj["vad_role"]: obj for obj in bpy.context.scene.vad.result.objects}
    assert bust.hide_get()
    assert {role for role, obj in made.items() if not obj.hide_get()} == {"surface"}
    with gui.override():
        bpy.ops.object.select_all(action="DESELECT")
        made["surface"].select_set(True)
        bpy.ops.view3d.view_selected()
        made["surface"].select_set(False)
    gui.area.spaces.active.overlay.show_cursor = False  # it has some red, too
    yield 0.5
    overlay = bpy.context.scene.vad.overlay
    overlay.colour = (*LINES, 1.0)
    overlay.width = 2.0

    def lines(name):
        gap = np.abs(gui.view_pixels(gui.shot(name)) - LINES).max(axis=-1)
        return int((gap < 0.06).sum())

    assert lines("1_off") == 0
    overlay.show = True
    yield 0.3
    shown = lines("2_normals")
    assert shown > 1000, shown
    overlay.every = 20
    few = lines("3_every_20th")
    assert 20 < few < shown / 4, (few, shown)
    overlay.every, overlay.maximum = 1, 900
    assert 20 < lines("3_at_most_900") < shown / 4
    overlay.maximum, overlay.length = 50_000, 12.0
    assert lines("4_longer") > 1.2 * shown
    overlay.length = 6.0

    # Depth-tested: behind the surface there are as many samples again.
    made["samples"].hide_set(False)
    made["surface"].hide_set(True)
    open_view = lines("5_surface_hidden")
    assert open_view > 1.2 * shown, (open_view, shown)
    made["surface"].hide_set(False)

    # It follows the object.
    before = gui.view_pixels(gui.shot("6_here"))
    made["samples"].location.z += 1.5 * made["samples"].dimensions.z
    yield 0.2
    moved = gui.view_pixels(gui.shot("6_moved"))
    assert np.abs(before - moved).max() > 0.5
    made["samples"].location.z -= 1.5 * made["samples"].dimensions.z

    # By direction and by confidence.
    for name in ("DIRECTION", "CONFIDENCE"):
        overlay.colour_by = name
        gui.shot(f"7_{name.lower()}")
    overlay.colour_by = "SINGLE"

    # It survives undo, another workspace, and the deletion of what it shows.
    with gui.override():
        bpy.ops.ed.undo_push(message="a")
        bpy.ops.object.empty_add()
        bpy.ops.ed.undo_push(message="b")
    yield from gui.key("Z", ctrl=True)
    yield 0.3
    assert lines("8_after_undo") > 0.8 * shown
    workspace = gui.window.workspace
    gui.window.workspace = next(other for other in bpy.data.workspaces if other.name == "Modeling")
    yield 0.5
    gui.shot("9_other_workspace")
    gui.window.workspace = workspace
    yield 0.5
    samples = next(obj for obj in bpy.context.scene.vad.result.objects if obj["vad_role"] == "samples")
    copy = samples.copy()
    bpy.data.objects.remove(samples)
    yield 0.2
    assert lines("10_deleted") == 0
    bpy.context.scene.vad.result.objects.link(copy)
    yield 0.2
    assert lines("11_copy") > 0.8 * shown
    gui.module("vad_addon.results").hold(bpy.context.scene.vad.result, copy)  # else it is the user's
    bpy.context.scene.vad.overlay.show = False
    yield 0.2
    assert lines("12_off") == 0

    # A shell, a slice and the normals as geometry.
    made = {obj["vad_role"]: obj for obj in bpy.context.scene.vad.result.objects}
    for obj in made.values():
        obj.hide_set(True)
    with gui.override():
        bpy.ops.vad.shell("INVOKE_DEFAULT", offset=3)
    yield 0.3
    gui.shot("13_shell")
    bpy.context.active_object.hide_set(True)
    with gui.override():
        bpy.ops.vad.normals_to_geometry("INVOKE_DEFAULT", every=3)
        bpy.ops.object.select_all(action="DESELECT")
    yield 0.3
    gui.shot("14_normals_as_geometry")
    bpy.context.active_object.hide_set(True)
    with gui.override():
        bpy.ops.vad.slice("INVOKE_DEFAULT", axis="X")
    with gui.override():
        bpy.ops.view3d.view_axis(type="RIGHT")

    def coloured():
        view = gui.view_pixels(gui.shot("15_slice"))
        return (np.ptp(view, axis=-1) > 0.3).mean() > 0.05

    yield from gui.until(coloured, 45)  # shaders are compiled first
    bpy.context.active_object.hide_set(True)

    # The fog, in EEVEE.
    made["field"].hide_set(False)
    empty = gui.view_pixels(gui.shot("16_fog_eevee"))

    def foggy():
        return (np.abs(gui.view_pixels(gui.shot("16_fog_eevee")) - empty).max(axis=-1) > 0.05).mean() > 0.03

    yield from gui.until(foggy, 30)

    # Disabled, it leaves nothing on the screen.
    gui.area.spaces.active.shading.type = "SOLID"
    made["field"].hide_set(True)
    made["samples"].hide_set(False)
    bpy.context.scene.vad.overlay.show = True
    yield 0.3
    shown = lines("17_on")
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.vad")
    yield 0.3
    assert shown > 500
    assert lines("18_disabled") < shown / 50  # the 3D cursor has some red, too
