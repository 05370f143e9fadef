"""A run on 100,000 points: the window stays usable, and Esc stops it within a second at any stage."""

import math
import statistics
import time

import bpy

COUNT = 100_000


def wavy_sphere(count):
    for i in range(count):
        z = 1 - (2 * i + 1) / count
        angle, ring = math.pi * (1 + 5**0.5) * i, math.sqrt(1 - z * z)
        r = 1 + 0.1 * math.sin(5 * z)
        yield r * ring * math.cos(angle), r * ring * math.sin(angle), r * z


def case(gui):
    yield from gui.install()
    job = gui.module("vad_addon.job")
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    gui.add_points("Large", list(wavy_sphere(COUNT)))
    bpy.context.scene.vad.resolution = 128
    with gui.override():
        bpy.ops.view3d.view_selected()
    yield 0.5

    def start():
        with gui.override():
            assert bpy.ops.vad.reconstruct("INVOKE_DEFAULT") == {"RUNNING_MODAL"}

    def ticks(end):
        """Seconds between turns of the window's loop; a generator."""
        seconds, last = [], time.monotonic()
        while not end():
            yield 0.02
            seconds.append(time.monotonic() - last)
            last = time.monotonic()
        return seconds

    idle_until = time.monotonic() + 5
    idle = yield from ticks(lambda: time.monotonic() > idle_until)
    usual = statistics.median(idle)  # on a busy machine, long by itself

    # Esc at several stages.
    for stage in ("cleaning", "normals"):
        start()
        yield from gui.until(lambda stage=stage: job.running().stage == stage, 200)
        process, pressed = job.running()._process, time.monotonic()
        yield from gui.key("ESC")
        yield from gui.until(lambda: not job.running(), 5)
        seconds = time.monotonic() - pressed
        yield from gui.until(lambda process=process: process.returncode is not None)
        dead = time.monotonic() - pressed
        print(f"Esc in '{stage}': free after {seconds:.2f} s, the worker gone after {dead:.2f} s", flush=True)
        assert seconds < max(1.0, 20 * usual), seconds

    start()
    running = yield from ticks(lambda: not job.running())
    for name, seconds in (("idle", idle), ("running", running)):
        middle, most = statistics.median(seconds), max(seconds)
        print(f"ticks, {name}: median {middle:.3f} s, longest {most:.3f} s, {len(seconds)} of them", flush=True)
    assert bpy.context.scene.vad.result is not None
    assert statistics.median(running) < max(0.3, 3 * usual)
    gui.shot("done")
