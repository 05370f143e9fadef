"""The add-on inside pip's bpy: imported under a parent package of its own, as Blender does it, without installing."""

import importlib
import sys
import types
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def bpy():
    return pytest.importorskip("bpy")


@pytest.fixture(scope="session")
def extension(bpy):
    """Function: import a module of the extension by its dotted path from the repository's root."""
    parent = types.ModuleType("vad_extension")
    parent.__path__ = [str(ROOT)]
    sys.modules["vad_extension"] = parent
    return lambda name: importlib.import_module(f"vad_extension.{name}")


@pytest.fixture
def empty(bpy):
    """Blender with an empty scene and no extension registered."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy


@pytest.fixture
def blender(empty, extension):
    """Blender with an empty scene and the extension registered."""
    vad_addon = extension("vad_addon")
    vad_addon.register()
    yield empty
    vad_addon.unregister()


@pytest.fixture
def add(bpy):
    """Function: link an object with this data to the scene and make it the active one."""

    def add(name, data):
        obj = bpy.data.objects.new(name, data)
        bpy.context.scene.collection.objects.link(obj)
        bpy.context.view_layer.objects.active = obj
        obj.select_set(True)
        return obj

    return add


@pytest.fixture
def add_mesh(bpy, add):
    """Function: an active mesh object of loose vertices at (n,3) points."""

    def add_mesh(name, points):
        data = bpy.data.meshes.new(name)
        data.from_pydata(np.asarray(points).tolist(), [], [])
        return add(name, data)

    return add_mesh


@pytest.fixture
def linked(blender):
    """Function: save the open file, and link the results of the run in it, "Scan VAD", into a new one."""

    def linked():
        path = blender.data.filepath
        blender.ops.wm.save_mainfile()
        blender.ops.wm.read_homefile(use_empty=True)
        with blender.data.libraries.load(path, link=True) as (_, wanted):
            wanted.collections = ["Scan VAD"]
        collection = blender.data.collections["Scan VAD"]
        blender.context.scene.collection.children.link(collection)
        return collection

    return linked


@pytest.fixture
def linked_scene(blender, add_mesh, sphere, tmp_path):
    """The scene that is open: linked from another file, with the active object "Scan" in it, a sphere."""
    add_mesh("Scan", sphere)
    blender.data.libraries.write(str(tmp_path / "other.blend"), {blender.context.scene})
    blender.ops.wm.read_homefile(use_empty=True)
    with blender.data.libraries.load(str(tmp_path / "other.blend"), link=True) as (there, wanted):
        wanted.scenes = list(there.scenes)
    (scene,) = wanted.scenes
    blender.context.window.scene = scene
    return scene


@pytest.fixture
def sphere():
    """(500,3) points of the unit sphere, on a Fibonacci spiral."""
    z = 1 - (2 * np.arange(500) + 1) / 500
    angle = np.pi * (1 + 5**0.5) * np.arange(500)
    ring = np.sqrt(1 - z**2)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
