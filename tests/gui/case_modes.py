"""Results that arrive while the user edits, sculpts or paints another object: they disturb nothing, and undo and redo
give all of them or none."""

import math

import bpy

ROLES = {"samples", "surface", "field"}


def sphere(count):
    """Points of the unit sphere on a Fibonacci spiral."""
    for i in range(count):
        z = 1 - (2 * i + 1) / count
        angle, ring = math.pi * (1 + 5**0.5) * i, math.sqrt(1 - z * z)
        yield ring * math.cos(angle), ring * math.sin(angle), z


def delivered():
    """Whether the results are there, whole: all of them or none."""
    result = bpy.context.scene.vad.result
    if result is None:
        assert not bpy.data.volumes
        return False
    assert {obj["vad_role"] for obj in result.objects} == ROLES
    assert all(obj.data.grids.load() for obj in result.objects if obj.type == "VOLUME")
    return True


def case(gui):
    yield from gui.install()
    job = gui.module("vad_addon.job")
    bpy.context.scene.vad.resolution = 24
    for mode in ("EDIT", "SCULPT", "VERTEX_PAINT"):
        bpy.ops.wm.read_homefile()
        yield 0.5
        bpy.context.scene.vad.resolution = 24
        gui.area.spaces.active.show_region_ui = True
        cube = bpy.context.active_object
        gui.add_points("Scan", list(sphere(1000)))
        with gui.override():
            bpy.ops.ed.undo_push(message="scan")
            assert bpy.ops.vad.reconstruct("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
            bpy.context.view_layer.objects.active = cube
            bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode=mode)
        yield from gui.until(lambda: not job.running(), 100)
        yield 0.3
        assert delivered()
        assert (cube.mode, bpy.context.view_layer.objects.active) == (mode, cube)
        assert not bpy.data.objects["Scan"].hide_get()
        gui.shot(f"{mode.lower()}_1_delivered")
        if mode == "EDIT":  # has an undo of its own, in which results are no part
            with gui.override():
                bpy.ops.mesh.subdivide("EXEC_DEFAULT", True)
            yield from gui.key("Z", ctrl=True)
            yield 0.3
            assert delivered()
        with gui.override():
            bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode="OBJECT")
        yield 0.3
        assert delivered()
        seen = []
        for _ in range(4):
            yield from gui.key("Z", ctrl=True)
            yield 0.3
            seen.append(delivered())
        print(f"{mode}: after each undo {seen}")
        assert seen[-1] is False
        for _ in range(5):
            with gui.override():
                if bpy.ops.ed.redo.poll():
                    bpy.ops.ed.redo()
            yield 0.3
            seen.append(delivered())
        print(f"{mode}: after each redo {seen[4:]}")
        assert seen[-1] is True
        gui.shot(f"{mode.lower()}_2_redone")
