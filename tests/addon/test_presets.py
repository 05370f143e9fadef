"""Presets and preferences are settings by another name."""

from pathlib import Path

import pytest

SHIPPED = Path(__file__).resolve().parents[2] / "vad_addon" / "presets" / "vad" / "reconstruct"
NAMES = "Clean scan", "Noisy scan", "Sparse", "Thin sheets and cloth", "Huge"


@pytest.fixture
def stored(blender):
    return blender.context.scene.vad


def apply(bpy, name):
    path = next(Path(folder, f"{name}.py") for folder in bpy.utils.preset_paths("vad/reconstruct"))
    bpy.ops.script.execute_preset(filepath=str(path), menu_idname="VAD_PT_presets")


def settings(extension, stored):
    class Nothing:
        def is_property_set(self, name):
            return False

    return extension("vad_addon.properties").settings_from(stored, Nothing())


def test_these_are_shipped(blender):
    assert {path.stem for path in SHIPPED.glob("*.py")} == set(NAMES)
    assert str(SHIPPED) in blender.utils.preset_paths("vad/reconstruct")


@pytest.mark.parametrize("name", NAMES)
def test_each_is_valid_and_undoes_the_others(blender, extension, stored, name):
    apply(blender, name)
    alone = settings(extension, stored)
    assert alone != extension("core.settings").Settings()
    for other in NAMES:
        apply(blender, other)
    apply(blender, name)
    assert settings(extension, stored) == alone


def test_a_preset_of_ones_own_keeps_every_setting(blender, extension, stored, tmp_path, monkeypatch):
    (tmp_path / "presets/vad/reconstruct").mkdir(parents=True)
    monkeypatch.setattr(blender.utils, "user_resource", lambda *_, path="", **__: str(tmp_path / path))
    stored.resolution, stored.bridge, stored.denoise = 77, 2.5, "0.5"
    wanted = settings(extension, stored)
    assert blender.ops.vad.add_preset(name="Mine") == {"FINISHED"}
    (made,) = tmp_path.rglob("Mine.py")
    stored.resolution, stored.bridge, stored.denoise = 33, 9.0, "auto"
    blender.ops.script.execute_preset(filepath=str(made), menu_idname="VAD_PT_presets")
    assert settings(extension, stored) == wanted


class Preferences:
    resolution, backend, device, memory_limit = 200, "numpy", "cpu", "auto"


def test_scenes_start_with_what_the_user_prefers(blender, extension, stored, monkeypatch):
    preferences = extension("vad_addon.preferences")
    other = blender.data.scenes.new("Chosen already")
    other.vad.resolution = 50

    class Installed:
        preferences = Preferences

    class Context:
        class preferences:
            addons = {extension("vad_addon.volume_files").PACKAGE: Installed}

    monkeypatch.setattr(preferences.bpy, "context", Context, raising=False)
    monkeypatch.setattr(preferences, "_given", {})
    preferences.prepare_scenes()
    assert (stored.resolution, stored.backend, stored.device) == (200, "numpy", "cpu")
    assert other.vad.resolution == 50
    assert not stored.is_property_set("memory_limit")
    for Preferences.resolution in (201, 220, 256):  # as while a field is dragged
        preferences.prepare_scenes()
    assert stored.resolution == 256
    stored.resolution = 99
    Preferences.resolution = 300
    preferences.prepare_scenes()
    assert stored.resolution == 99


def test_scenes_are_looked_at_when_they_are_made_and_loaded(blender, extension):
    look, handlers = extension("vad_addon.preferences").prepare_scenes, blender.app.handlers
    assert look in handlers.depsgraph_update_post
    assert look in handlers.load_post


def test_the_cache_folder_may_be_another(blender, extension, add_mesh, sphere, tmp_path, monkeypatch):
    files = extension("vad_addon.volume_files")

    class Installed:
        class preferences:
            cache = str(tmp_path)

    class Context:
        class preferences:
            addons = {files.PACKAGE: Installed}

    with monkeypatch.context() as patched:
        patched.setattr(files.bpy, "context", Context, raising=False)
        folder = files.cache_folder()
    assert folder == tmp_path / "vad_cache"
    monkeypatch.setattr(files, "cache_folder", lambda: folder)
    (tmp_path / "mine.vdb").write_text("of somebody else")
    assert files.cache_contents() == (0, 0)
    add_mesh("Scan", sphere)
    for _ in range(2):
        blender.ops.vad.reconstruct(resolution=16)
    assert blender.data.volumes["Scan field"].filepath == str(files.folder_in_use() / "Scan_001.vdb")
    files._made.clear()
    blender.ops.vad.clear_cache()
    assert [path.name for path in tmp_path.rglob("*.vdb")] == ["mine.vdb", "Scan_001.vdb"]


def test_clearing_the_cache_spares_what_is_shown_and_what_undo_brings_back(blender, extension, add_mesh, sphere):
    files = extension("vad_addon.volume_files")
    cache, folder = files.cache_folder(), files.folder_in_use()
    (cache / "other").mkdir(parents=True, exist_ok=True)
    (cache / "other" / "Other.vdb").write_text("of another session")
    add_mesh("Scan", sphere)
    blender.ops.ed.undo_push(message="before")
    for _ in range(2):
        blender.ops.vad.reconstruct("EXEC_DEFAULT", True, resolution=16)
    assert blender.ops.vad.clear_cache() == {"FINISHED"}
    before, _ = sorted(folder.glob("*.vdb"))
    assert list(cache.iterdir()) == [folder]
    blender.ops.ed.undo()
    assert blender.data.volumes["Scan field"].filepath == str(before)
    assert blender.data.volumes["Scan field"].grids.load()
