"""The worker process: the same results, stopped at once, and never a trace left."""

import os
import signal
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals")


@pytest.fixture
def task(extension):
    """Function: a task on these points."""

    def task(points, **settings):
        return extension("vad_addon.outcome").Task(
            points, extension("core.settings").Settings(**{"resolution": 32, **settings})
        )

    return task


@pytest.fixture
def start(extension, tmp_path):
    """Function: start a job whose exchange folder lies in tmp_path; stopped at the end, whatever happens."""
    module = extension("vad_addon.job")
    jobs = []

    def start(task):
        jobs.append(module.Job(task, tmp_path))
        return jobs[-1]

    yield start
    for job in jobs:
        job.stop()
        job.cleared(wait=True)


@pytest.fixture
def large(task):
    """A task of many seconds."""
    return task(np.random.default_rng(0).normal(size=(200_000, 3)), resolution=256)


def wait(job, condition, seconds=60):
    deadline = time.monotonic() + seconds
    while not condition(job):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def ended(job):
    return job.poll()


def under_way(job):
    assert not job.poll()
    return job.stage != "starting"


def test_a_job_finds_what_the_core_finds(extension, start, task, sphere, tmp_path):
    axes = (np.array([3, 70]), np.array([[0.0, 0, 1], [1, 0, 0]]))
    given = extension("vad_addon.outcome").Task(sphere, task(sphere, surface="both").settings, axes)
    job = start(given)
    heard = []
    wait(job, lambda job: (job.poll(), heard.append((job.fraction, job.stage)))[0])
    found = job.outcome()
    (tmp_path / "here").mkdir()
    expected = extension("vad_addon.outcome").compute(given, tmp_path / "here")

    for name in ("points", "source_index", "normals", "confidence", "origin"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    for mesh in ("surface", "sheet"):
        for name, array in vars(getattr(expected, mesh)).items():
            np.testing.assert_array_equal(getattr(getattr(found, mesh), name), array)
    assert (found.cell, found.shape, found.warnings) == (expected.cell, expected.shape, ())
    assert found.volume.stat().st_size == expected.volume.stat().st_size
    np.testing.assert_allclose(np.abs(found.normals[[3, 70]]), axes[1], atol=1e-12)
    assert [fraction for fraction, _ in heard] == sorted(fraction for fraction, _ in heard)
    assert heard[-1] == (1.0, "volume")


def test_the_skin_knows_its_distance_and_its_nearest_sample(extension, task, sphere, tmp_path):
    skin = extension("vad_addon.outcome").compute(task(sphere), tmp_path).surface
    by_hand = np.linalg.norm(skin.vertices[:, None] - sphere[None], axis=2).argmin(axis=1)
    np.testing.assert_array_equal(skin.nearest, by_hand)
    cell = 2 / 32
    assert np.abs(skin.distance - np.abs(np.linalg.norm(skin.vertices, axis=1) - 1)).max() < cell  # interpolated
    assert skin.distance.max() > 0


def test_a_refusal_arrives_as_the_sentence_of_the_core(extension, start, task, sphere):
    job = start(task(sphere[:3]))
    wait(job, ended)
    with pytest.raises(extension("core.errors").VADError, match="3 distinct finite points of 3 given") as caught:
        job.outcome()
    assert "\n" not in str(caught.value)


def test_a_surprise_arrives_as_one_line(extension, start, task, sphere, monkeypatch):
    save = extension("vad_addon.outcome").Task.save
    monkeypatch.setattr(extension("vad_addon.outcome").Task, "save", lambda task, path: path.write_bytes(b"no task"))
    job = start(task(sphere))
    monkeypatch.setattr(extension("vad_addon.outcome").Task, "save", save)
    wait(job, ended)
    with pytest.raises(extension("core.errors").VADError, match="The reconstruction failed: ") as caught:
        job.outcome()
    assert "\n" not in str(caught.value)
    assert "Traceback" not in str(caught.value)


def test_what_libraries_print_is_passed_over(start, task, sphere):
    job = start(task(sphere))
    wait(job, under_way)
    with open(job._folder / "progress", "ab") as output:
        output.write(b"a library's remark\n")
    wait(job, ended)
    assert job.fraction == 1.0
    job.outcome()


def test_stopping_is_immediate_and_leaves_nothing(start, large, tmp_path):
    job = start(large)
    wait(job, under_way)
    assert any(tmp_path.iterdir())
    begin = time.monotonic()
    job.stop()
    assert time.monotonic() - begin < 0.5
    wait(job, lambda job: job.cleared())
    assert not any(tmp_path.iterdir())
    assert job._process.returncode is not None
    job.stop()
    assert job.cleared()


@posix
def test_nobody_waits_for_a_process_that_is_slow_to_die(extension, start, large, tmp_path, monkeypatch):
    module = extension("vad_addon.job")
    job = start(large)
    wait(job, under_way)
    monkeypatch.setattr(module, "_running", job)
    monkeypatch.setattr(job._process, "kill", lambda: None)  # the system takes its time
    os.kill(job._process.pid, signal.SIGSTOP)
    os.waitpid(job._process.pid, os.WUNTRACED)  # stopped, not only about to be
    begin = time.monotonic()
    module.stop()
    assert not module.clear()
    assert time.monotonic() - begin < 0.5
    assert module.running() is None
    assert any(tmp_path.iterdir()), "what it may still write to went before it"
    os.kill(job._process.pid, signal.SIGKILL)
    assert module.clear(wait=True)
    assert not any(tmp_path.iterdir())


@posix
def test_a_worker_that_the_system_kills_is_reported(extension, start, large):
    job = start(large)
    wait(job, under_way)
    os.kill(job._process.pid, signal.SIGKILL)
    wait(job, ended)
    with pytest.raises(extension("core.errors").VADError, match="The system ended the run, probably for want"):
        job.outcome()


def test_the_worker_ends_with_blender_and_cleans_up(start, large, tmp_path):
    job = start(large)
    wait(job, under_way)
    job._process.stdin.close()  # what the system does when Blender is gone
    wait(job, ended, seconds=5)
    assert not any(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_one_sentence(extension, task, sphere, tmp_path):
    with pytest.raises(extension("core.errors").VADError, match="The run cannot go on: No such file or directory"):
        extension("vad_addon.job").Job(task(sphere), tmp_path / "missing")


def test_a_full_disk_is_one_sentence(extension, start, task, sphere, monkeypatch):
    job = start(task(sphere[:3]))
    wait(job, ended)
    usage = extension("vad_addon.job").shutil.disk_usage
    monkeypatch.setattr("shutil.disk_usage", lambda path: usage(path)._replace(free=1000))
    with pytest.raises(extension("core.errors").VADError, match=r"No space left on device .*; free space"):
        job.outcome()


def test_time_left_follows_from_the_progress(extension, start, task, sphere):
    job = start(task(sphere))
    assert job.seconds_left() is None
    job._started -= 30
    job.fraction = 0.25
    assert job.seconds_left() == pytest.approx(90, abs=1)


@pytest.mark.parametrize(("seconds", "text"), [(0.2, "0 s"), (59.4, "59 s"), (80, "1 min 20 s"), (7500, "2 h 5 min")])
def test_durations_are_said_in_the_units_that_matter(extension, seconds, text):
    assert extension("vad_addon.status").duration(seconds) == text


def test_the_worker_needs_no_blender(extension, start, task, sphere, monkeypatch, tmp_path):
    (tmp_path / "path").mkdir()
    (tmp_path / "path" / "bpy.py").write_text("raise SystemExit('the worker imported bpy')")
    monkeypatch.syspath_prepend(str(tmp_path / "path"))
    job = start(task(sphere))
    wait(job, ended)
    assert len(job.outcome().points) == 500


@pytest.mark.parametrize("playing", [False, True])
def test_escape_ends_playback_first(extension, monkeypatch, playing):
    class Running(extension("vad_addon.run").Run):
        _job = object()
        _cancelled = staticmethod(lambda context: {"CANCELLED"})

    monkeypatch.setattr(extension("vad_addon.job"), "_running", Running._job)
    context = SimpleNamespace(screen=SimpleNamespace(is_animation_playing=playing))
    found = Running().modal(context, SimpleNamespace(type="ESC", value="PRESS"))
    assert found == ({"PASS_THROUGH"} if playing else {"CANCELLED"})
