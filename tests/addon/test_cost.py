"""What a run would cost is said before it starts."""

import re

import numpy as np
import pytest


@pytest.fixture
def points_of(extension, tmp_path):
    """Function: what the cost of a run on (n,3) points depends on."""
    outcome, settings = extension("vad_addon.outcome"), extension("core.settings").Settings()
    of = extension("vad_addon.cost").Points.of
    return lambda points: of(outcome.compute(outcome.Task(points, settings, until="cost"), tmp_path))


def test_the_estimate_names_points_resolution_time_and_memory(blender, extension, points_of, sphere):
    settings = extension("core.settings").Settings
    dense = np.concatenate([sphere, sphere @ [[0, 1, 0], [0, 0, 1], [1, 0, 0]]])
    points = points_of(50 * dense)
    lines = points.cost(settings(resolution=100))
    count, apart = re.fullmatch(r"([\d,]+) points, ([\d.]+) apart", lines[0]).groups()
    assert count == "1,000"
    assert float(apart) == pytest.approx(50 * 0.112, rel=0.3)  # sqrt(4 pi / 1000), about, less for uneven points
    assert points.suited == pytest.approx(1.5 * 1.25 * 2 * 50 / float(apart), rel=0.05)
    assert lines[1] == f"Suits: resolution {points.suited}"
    assert re.fullmatch(r"At 100: [\dhmins ]+, \d+ MiB", lines[2])


def test_the_operator_says_it_or_what_is_wrong(blender, add_mesh, sphere, capfd):
    with pytest.raises(RuntimeError, match="No active object"):
        blender.ops.vad.estimate()
    scan = add_mesh("Scan", sphere)
    assert blender.ops.vad.estimate() == {"FINISHED"}
    assert "Info: 500 points, 0.1" in capfd.readouterr().out
    scan.select_set(False)
    add_mesh("Few", sphere[:3])
    with pytest.raises(RuntimeError, match="3 distinct finite points"):
        blender.ops.vad.estimate()


def test_the_answer_follows_the_settings_and_goes_with_the_points(blender, extension, add_mesh, sphere):
    cost, stored = extension("vad_addon.cost"), blender.context.scene.vad
    scan = add_mesh("Scan", sphere)
    with pytest.raises(RuntimeError, match="Estimate the cost first"):
        blender.ops.vad.use_resolution()
    blender.ops.vad.estimate()
    first = cost.lines(blender.context)
    assert first[2].startswith("At 128: ")
    stored.resolution = 64
    assert cost.lines(blender.context)[2].startswith("At 64: ")
    stored.band = "wide"
    assert "band is 'wide'" in cost.lines(blender.context)[0]
    stored.band = "none"
    blender.ops.vad.use_resolution()
    assert f"resolution {stored.resolution}" in first[1]
    assert stored.band == "none"
    scan.data.vertices.add(1)
    scan.data.update()
    blender.context.view_layer.update()
    assert cost.lines(blender.context) == []
    blender.ops.vad.estimate()
    add_mesh("Other", sphere)
    scan.select_set(False)
    assert cost.lines(blender.context) == []


def test_the_answer_goes_where_the_points_were_moved_apart(blender, extension, add_mesh, sphere):
    cost, scan = extension("vad_addon.cost"), add_mesh("Scan", sphere)
    for how in ("nothing", "scaled", "others"):
        blender.ops.vad.estimate()
        if how == "scaled":
            scan.scale = 3, 3, 3
        elif how == "others":
            scan.data.vertices.foreach_set("co", np.float32(sphere * [1, 1, 2]).ravel())
            scan.data.update()
        blender.context.view_layer.update()
        assert bool(cost.lines(blender.context)) == (how == "nothing")


def test_strays_count_where_they_stay(blender, extension, add_mesh, sphere):
    cost, stored = extension("vad_addon.cost"), blender.context.scene.vad
    add_mesh("Scan", np.vstack([sphere, [[1000, 0, 0]]]))
    blender.ops.vad.estimate()
    assert cost.lines(blender.context)[0].startswith("500 points")
    stored.outliers = False
    assert cost.lines(blender.context) == []
    blender.ops.vad.estimate()
    assert cost.lines(blender.context)[0].startswith("501 points")


def test_of_dense_lines_the_answer_is_for_the_resolution_asked(blender, extension, add_mesh):
    cost, stored = extension("vad_addon.cost"), blender.context.scene.vad
    turn, height = np.meshgrid(np.linspace(0, 2 * np.pi, 2000, endpoint=False), np.linspace(0, 1, 9))
    add_mesh("Rings", np.stack([np.cos(turn), np.sin(turn), height], axis=2).reshape(-1, 3))
    said = {}
    for resolution in (32, 512):
        stored.resolution = resolution
        assert cost.lines(blender.context) == []
        blender.ops.vad.estimate()
        said[resolution] = cost.lines(blender.context)
    assert said[32][0] != said[512][0]
    assert said[32][1] == said[512][1]


def test_noisy_points_are_noticed(points_of):
    rng = np.random.default_rng(0)
    points = rng.normal(size=(20_000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    assert not points_of(points).noisy
    assert points_of(points + rng.normal(size=points.shape) * 0.02).noisy


def test_a_fine_resolution_comes_with_a_band(blender, extension, add_mesh, sphere):
    x, y = np.meshgrid(np.linspace(0, 1, 1000), [0, 1e-3])  # 800 along the box
    add_mesh("Rows", np.column_stack([x.ravel(), y.ravel(), np.zeros(2000)]))
    stored = blender.context.scene.vad
    blender.ops.vad.estimate()
    blender.ops.vad.use_resolution()
    assert stored.resolution > 512
    assert stored.band == "4"
    assert extension("vad_addon.properties").settings_from(stored).band == 4.0
    stored.band, stored.offset = "none", 3.0
    blender.ops.vad.use_resolution()
    assert extension("vad_addon.properties").settings_from(stored).band == 5.0
