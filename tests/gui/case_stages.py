"""One stage alone, by real clicks, with the redo panel; and through the worker where there are many points."""

import time

import bpy

CLEAN, NORMALS = (52, 179), (155, 179)  # buttons in the sidebar


def case(gui):
    yield from gui.install()
    job = gui.module("vad_addon.job")
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.wm.ply_import(filepath=str(gui.folder / "bust.ply"))
    bust = bpy.context.active_object
    gui.thin_out(bust.data, 7)
    with gui.override():
        bpy.ops.view3d.view_selected()
        bpy.ops.ed.undo_push(message="bust")
    yield 0.5

    def last(name):
        operator = bpy.context.window_manager.operators[-1]
        assert operator.bl_idname == name, operator.bl_idname
        return operator

    def adjust(operator, **values):
        """What a touch in the redo panel does; nested in another operator, it is no undo step by itself."""
        for name, value in values.items():
            setattr(operator.properties, name, value)
        with gui.override():
            bpy.ops.ed.undo_redo()
            bpy.ops.ed.undo_push(message=operator.name)

    # Cleaned at once, adjusted, undone.
    if bpy.app.version >= (5, 2, 0):
        gui.module("vad_addon.datablocks")._cloud_by_nodes = None  # not needed
    yield from gui.click(*CLEAN)
    yield from gui.until(lambda: "bust cleaned" in bpy.data.objects)
    yield 0.5
    gui.shot("1_cleaned")
    operator = last("VAD_OT_denoise")
    yield from gui.key("F9")
    yield 0.5
    gui.shot("1_redo_panel")
    yield from gui.key("ESC")

    def moved():
        attribute = bpy.data.objects["bust cleaned"].data.attributes["moved"]
        return sum(item.value for item in attribute.data) / len(attribute.data)

    whole = moved()
    adjust(operator, strength=0.5)
    yield 0.3
    assert 0.4 < moved() / whole < 0.6, moved() / whole
    assert "bust cleaned.001" not in bpy.data.objects
    assert bpy.data.objects["bust"].hide_get()
    yield from gui.key("Z", ctrl=True)
    yield 0.3
    assert "bust cleaned" not in bpy.data.objects
    assert not bpy.data.objects["bust"].hide_get()

    # Normals at once, shown; the source stays at hand.
    yield from gui.click(*NORMALS)
    yield from gui.until(lambda: "bust normals" in bpy.data.objects)
    yield 0.5
    gui.shot("2_normals")
    assert bpy.context.scene.vad.overlay.show
    assert bpy.context.view_layer.objects.active == bpy.data.objects["bust"]
    adjust(last("VAD_OT_normals"), solver="pca")
    yield 0.3
    gui.shot("3_normals_by_planes")
    assert "bust normals.001" not in bpy.data.objects
    bpy.context.scene.vad.overlay.show = False

    # Extracted again from a run's normals.
    bpy.context.scene.vad.resolution = 48
    with gui.override():
        bpy.ops.vad.reconstruct("INVOKE_DEFAULT")
    yield from gui.until(lambda: not job.running())
    assert bpy.data.objects["bust normals"].hide_get()
    with gui.override():
        assert bpy.ops.vad.reextract("INVOKE_DEFAULT", True, surface="both") == {"FINISHED"}
    yield 0.3
    made = {obj["vad_role"]: obj for obj in bpy.context.scene.vad.result.objects}
    assert [role for role, obj in made.items() if not obj.hide_get()] == ["surface"]
    gui.shot("4_both")
    bpy.ops.vad.show(role="surface")
    bpy.ops.vad.show(role="sheet")
    yield 0.3
    assert [role for role, obj in made.items() if not obj.hide_get()] == ["sheet"]
    gui.shot("5_single_layer")
    with gui.override():
        assert bpy.ops.vad.reconstruct.poll()  # from the active object, though that is hidden

    # From the field as it is: at once, with a live redo panel, which refuses what would take long.
    bpy.context.scene.vad.resolution = 128
    bpy.context.view_layer.objects.active = bpy.data.objects["bust"]
    with gui.override():
        bpy.ops.vad.reconstruct("INVOKE_DEFAULT")
    yield from gui.until(lambda: not job.running())
    triangles = len(made["surface"].data.polygons)
    with gui.override():
        started = time.monotonic()
        assert bpy.ops.vad.reextract("INVOKE_DEFAULT", True, faces="quads") == {"FINISHED"}
        print(f"from the field as it is: {time.monotonic() - started:.2f} s")
    assert 0.4 < len(made["surface"].data.polygons) / triangles < 0.7
    yield 0.3
    operator = last("VAD_OT_reextract")
    adjust(operator, faces="triangles")
    yield 0.3
    made = {obj["vad_role"]: obj for obj in bpy.context.scene.vad.result.objects}
    adjusted = len(made["surface"].data.polygons)
    assert 0.95 < adjusted / triangles < 1.05
    adjust(operator, surface="single")
    yield 0.3
    made = {obj["vad_role"]: obj for obj in bpy.context.scene.vad.result.objects}
    assert len(made["surface"].data.polygons) == adjusted
    gui.shot("6_adjusted")

    # Many points go through the worker, which Esc stops; the redo panel would freeze the window.
    many = [vertex.co.copy() for vertex in bpy.data.objects["bust"].data.vertices] * 4
    many = [point + point.orthogonal() * 1e-3 * number for number, point in enumerate(many)]
    gui.add_points("Many", [tuple(point) for point in many])
    for operator in (bpy.ops.vad.denoise, bpy.ops.vad.normals):
        with gui.override():
            assert operator("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
        yield from gui.until(lambda: job.running().stage != "starting")
        yield from gui.key("ESC")
        yield from gui.until(lambda: not job.running(), 2)
        assert not {"Many cleaned", "Many normals"} & set(bpy.data.objects.keys())
    with gui.override():
        assert bpy.ops.vad.normals("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield from gui.until(lambda: not job.running(), 200)
    assert len(bpy.data.objects["Many normals"].data.attributes["normal"].data) > 0.9 * len(many)
