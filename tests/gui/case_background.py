"""The preferences; and the command of the README, in a Blender of its own without a window, on a file saved in this
one."""

import re
import subprocess

import bpy


def case(gui):
    yield from gui.install()
    with gui.override():
        bpy.ops.preferences.addon_show(module="bl_ext.user_default.vad")
    yield 2.0
    gui.shot("0_preferences")
    bpy.ops.wm.save_userpref()  # where the extension is enabled
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.wm.ply_import(filepath=str(gui.folder / "bust.ply"))
    gui.thin_out(bpy.context.active_object.data, 7)
    bpy.ops.wm.save_as_mainfile(filepath=str(gui.folder / "scene.blend"))
    readme = (gui.folder / "README.md").read_text("utf-8")
    (script,) = re.findall(r'^blender -b scene\.blend --python-expr "(.*)"$', readme, re.MULTILINE)
    command = [bpy.app.binary_path, "-b", str(gui.folder / "scene.blend"), "--python-exit-code", "5"]
    ran = subprocess.run(
        [*command, "--python-expr", script.replace("256", "48")], capture_output=True, text=True, timeout=200
    )
    print(ran.stdout + ran.stderr)
    assert ran.returncode == 0
    bpy.ops.wm.open_mainfile(filepath=str(gui.folder / "scene.blend"))
    result = bpy.context.scene.vad.result
    assert {obj["vad_role"] for obj in result.objects} == {"samples", "surface", "field"}
    assert bpy.data.volumes[0].filepath.startswith("//vad/")
    yield 0.5
    gui.shot("1_result")
