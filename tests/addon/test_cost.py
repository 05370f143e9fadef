"""What a run would cost is said before it starts."""

import re

import pytest


def test_the_estimate_names_points_resolution_time_and_memory(blender, extension, sphere):
    settings = extension("core.settings").Settings
    lines = extension("vad_addon.cost").cost_in_words(50 * sphere, settings(resolution=100))
    assert lines[0] == "500 points"
    assert float(lines[1].removesuffix(" apart")) == pytest.approx(50 * 0.17, rel=0.1)  # sqrt(4 pi / 500), about
    suits = int(lines[2].removeprefix("Suits: resolution "))
    assert suits == pytest.approx(1.25 * 2 / 0.17, rel=0.1)
    assert re.fullmatch(r"At 100: \d+ s, \d+ MiB", lines[3])


def test_the_operator_says_it_or_what_is_wrong(blender, add_mesh, sphere, capfd):
    with pytest.raises(RuntimeError, match="No active object"):
        blender.ops.vad.estimate()
    scan = add_mesh("Scan", sphere)
    assert blender.ops.vad.estimate() == {"FINISHED"}
    assert "Info: 500 points; " in capfd.readouterr().out
    scan.select_set(False)
    add_mesh("Few", sphere[:3])
    with pytest.raises(RuntimeError, match="3 distinct finite points"):
        blender.ops.vad.estimate()
