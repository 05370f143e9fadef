"""The script that the README shows runs as it stands."""

import re
from pathlib import Path

README = Path(__file__).resolve().parents[2] / "README.md"


def test_the_script_of_the_readme_runs(blender, add_mesh, sphere, capfd):
    (script,) = re.findall(r"```python\n(import bpy\n.*?)```", README.read_text("utf-8"), re.DOTALL)
    assert script.count("resolution=256") == 2
    add_mesh("Scan", sphere)
    exec(script.replace("resolution=256", "resolution=16"), {})
    assert '"resolution": 16' in capfd.readouterr().out
    assert {obj["vad_role"] for obj in blender.context.scene.vad.result.objects} == {"samples", "sheet", "field"}
    assert blender.context.view_layer.objects.active.name == "Scan cleaned"


def test_the_command_of_the_readme_saves_the_results(blender, add_mesh, sphere, tmp_path):
    (command,) = re.findall(r'^blender -b scene\.blend --python-expr "(.*)"$', README.read_text("utf-8"), re.MULTILINE)
    add_mesh("Scan", sphere)
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    exec(command.replace("resolution=256", "resolution=16"), {})
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert {obj["vad_role"] for obj in blender.context.scene.vad.result.objects} == {"samples", "surface", "field"}
