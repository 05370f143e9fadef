"""Runs inside a Blender with a window: plays one case, a generator that yields the seconds to wait, and ends Blender.

blender ... --python driver.py -- CASE FOLDER      FOLDER holds vad.zip, bust.ply and README.md, and takes shots/
"""

import importlib
import os
import shutil
import subprocess
import sys
import time
import traceback
from pathlib import Path

import bmesh
import bpy

CASE, FOLDER = sys.argv[sys.argv.index("--") + 1 :]
MODULE = "bl_ext.user_default.vad"


class Gui:
    """What a case needs of the window: real events in, screenshots and pixels out."""

    folder = Path(FOLDER)

    @property
    def window(self):
        return bpy.context.window_manager.windows[0]

    @property
    def area(self):
        return next(area for area in self.window.screen.areas if area.type == "VIEW_3D")

    def region(self, kind):
        return next(region for region in self.area.regions if region.type == kind)

    def override(self):
        return bpy.context.temp_override(
            window=self.window, screen=self.window.screen, area=self.area, region=self.region("WINDOW")
        )

    def install(self):
        """Install the zip and open the sidebar; a generator."""
        bpy.ops.extensions.package_install_files(
            filepath=str(self.folder / "vad.zip"), repo="user_default", enable_on_install=True
        )
        self.area.spaces.active.show_region_ui = True
        yield 0.5
        self.redraw()
        self.region("UI").active_panel_category = "VAD"
        yield 0.3

    def add_points(self, name, points):
        """An active mesh object of loose vertices, nothing else selected."""
        data = bpy.data.meshes.new(name)
        data.from_pydata(points, [], [])
        return self.add(bpy.data.objects.new(name, data))

    def add(self, obj):
        bpy.context.scene.collection.objects.link(obj)
        for other in bpy.context.selected_objects:
            other.select_set(False)
        bpy.context.view_layer.objects.active = obj
        obj.select_set(True)
        return obj

    def thin_out(self, mesh, keep):
        """Leave every `keep`-th vertex of a mesh of loose vertices."""
        edited = bmesh.new()
        edited.from_mesh(mesh)
        for vertex in [vertex for vertex in edited.verts if vertex.index % keep]:
            edited.verts.remove(vertex)
        edited.to_mesh(mesh)
        edited.free()

    def module(self, name):
        return importlib.import_module(f"{MODULE}.{name}")

    def event(self, kind, value, x, y):
        self.window.event_simulate(type=kind, value=value, x=int(x), y=int(y))

    def click(self, x, y):
        """Press and release the left button, x to the right and y down from the sidebar's upper left corner; a
        generator."""
        sidebar = self.region("UI")
        x, y = sidebar.x + x, sidebar.y + sidebar.height - y
        self.event("MOUSEMOVE", "NOTHING", x, y)
        yield 0.3
        self.event("LEFTMOUSE", "PRESS", x, y)
        yield 0.1
        self.event("LEFTMOUSE", "RELEASE", x, y)
        yield 0.2

    def key(self, kind, ctrl=False):
        """Press and release a key over the 3D view; a generator."""
        view = self.region("WINDOW")
        x, y = view.x + view.width // 3, view.y + view.height // 3
        self.event("MOUSEMOVE", "NOTHING", x, y)
        yield 0.1
        self.window.event_simulate(type=kind, value="PRESS", x=x, y=y, ctrl=ctrl)
        yield 0.05
        self.window.event_simulate(type=kind, value="RELEASE", x=x, y=y, ctrl=ctrl)
        yield 0.2

    def until(self, condition, seconds=150):
        """Wait until the condition holds; a generator."""
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, f"not within {seconds} s"
            yield 0.1

    def quit(self):
        """The last act of a case that ends as users do; it must yield some seconds then."""
        print("case passed")
        bpy.ops.wm.quit_blender()

    def redraw(self):
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)

    def shot(self, name):
        """Keep a screenshot and return its path. ImageMagick's where there is one: Blender's own come out black under
        software rendering."""
        self.redraw()
        path = self.folder / "shots" / f"{name}.png"
        if shutil.which("import"):
            subprocess.run(["import", "-window", "root", str(path)], check=True)
        else:
            with self.override():
                bpy.ops.screen.screenshot(filepath=str(path))
        return path

    def view_pixels(self, path):
        """(h,w,3) float RGB of the 3D view in a screenshot, without the sidebar."""
        import numpy as np

        image = bpy.data.images.load(str(path))
        image.colorspace_settings.name = "Non-Color"
        pixels = np.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)[..., :3]
        bpy.data.images.remove(image)
        view = self.region("WINDOW")
        right = self.region("UI").x
        return pixels[view.y : view.y + view.height, view.x : right]


def _play(steps):
    try:
        return next(steps)
    except StopIteration:
        print("case passed")
        _leave(0)
    except BaseException:  # Blender itself would print it and go on
        traceback.print_exc()
        _leave(1)


def _leave(status):
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


bpy.context.preferences.view.show_splash = False
sys.path.insert(0, str(Path(__file__).parent))
case = importlib.import_module(f"case_{CASE}").case(Gui())
bpy.app.timers.register(lambda: _play(case), first_interval=1.0, persistent=True)
