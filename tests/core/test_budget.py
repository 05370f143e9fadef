import os
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from core import Settings, VADError, reconstruct
from core.budget import Estimate, _probe, check_budget, crowded_share, estimate_cost, free_memory_mb, suited_resolution
from core.cleaning.noise import looks_noisy
from core.cli import main
from core.errors import MemoryBudgetError
from core.field.grid import fit_grid
from core.points import local_spacing
from tests import shapes

POINTS = shapes.sphere(1500)


def cost(points, resolution, **others):
    grid = fit_grid(points, resolution)
    return estimate_cost(local_spacing(points), grid, Settings(resolution=resolution, **others)), grid


def test_more_points_and_finer_grids_cost_more():
    small, fine, many = cost(POINTS, 64)[0], cost(POINTS, 256)[0], cost(shapes.sphere(150_000), 64)[0]
    for dear in (fine, many):
        assert dear.seconds > 1.5 * small.seconds
        assert dear.memory_mb > 1.5 * small.memory_mb


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the peak of a child process is read from /proc")
@pytest.mark.parametrize(
    ("samples", "settings"),
    [
        (2000, "192"),
        (30_000, "64"),
        (10_000, "128"),
        (10_000, "128, surface='both'"),
        (2000, "192, band=4"),
        (2000, "192, integration='poisson'"),
        (6000, "64, solver='energy'"),
    ],
)
def test_memory_is_what_a_run_takes_within_two_fifths(samples, settings):
    script = (
        "from core import Settings, reconstruct; from core.memory import peak_memory_mb; from tests import shapes;"
        f"points = shapes.sphere({samples}); before = peak_memory_mb();"
        f"result = reconstruct(points, Settings(resolution={settings}));"
        "print(result.report['estimate']['memory_mb'], peak_memory_mb() - before)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=os.getcwd())
    estimated, taken = map(float, done.stdout.split())
    assert taken / 1.4 < estimated < 1.4 * taken


@pytest.mark.parametrize(
    ("samples", "settings"),
    [
        (8000, {}),
        (1500, {"surface": "both"}),
        (4000, {"band": 4.0}),
        (3000, {"solver": "energy", "backend": "numpy", "surface": "none"}),
    ],
)
def test_processor_time_is_what_a_run_takes_within_a_factor_of_three(samples, settings):
    """In the median of three runs: other work on the machine may slow the probe, or the run."""
    settings, shares = Settings(resolution=96, denoise=0, **settings), []
    for _ in range(3):
        begun = time.process_time()
        estimated = reconstruct(shapes.sphere(samples), settings).report["estimate"]["cpu_seconds"]
        shares.append(estimated / (time.process_time() - begun))
    assert 1 / 3 < np.median(shares) < 3


def test_no_more_nodes_are_near_the_surface_than_there_are():
    corners = np.indices((2, 2, 2)).reshape(3, 8).T
    assert cost(corners, 128)[0].cpu_seconds < 3 * cost(np.concatenate([corners, POINTS / 4]), 128)[0].cpu_seconds


def test_a_clock_that_ticks_slowly_does_for_the_probe(monkeypatch):
    tick, true = 1 / 64, time.thread_time
    monkeypatch.setattr("core.budget.time.thread_time", lambda: true() // tick * tick)
    for _ in range(40):
        took, busy = _probe()
        assert 0 < took < 1
        assert 1 <= busy < 1000


def test_a_grid_without_room_for_the_offset_is_not_advised():
    grid, spacing = fit_grid(np.array([[0, 0, 0], [1, 1, 1.0]]), 400), np.full(1000, 0.1)
    for offset, advised in ((1.0, "use resolution 32 or less"), (4.0, "lower the offset")):
        settings = Settings(resolution=400, offset=offset, memory_limit=83.0)
        with pytest.raises(MemoryBudgetError, match=advised):
            check_budget(estimate_cost(spacing, grid, settings), spacing, grid, settings)


@pytest.mark.parametrize(("band", "offset"), [(4, 1.0), (4, 0.5)])
def test_a_lower_offset_is_not_advised_where_it_does_not_help(band, offset):
    """What is too much is what a run takes at any resolution."""
    _, grid = cost(POINTS, 48)
    settings = Settings(resolution=48, band=band, offset=offset, memory_limit=64)
    with pytest.raises(MemoryBudgetError, match=r"may be used; raise memory_limit$"):
        check_budget(Estimate(1.0, 126.0, 1.0), np.full(300, 0.3), grid, settings)


def test_noise_costs(monkeypatch):
    """On a machine of one speed: the probe of two estimates may differ by a third on a busy one."""
    monkeypatch.setattr("core.budget._probe", lambda: (0.004, 1.0))
    points = shapes.scattered_sphere(3000)
    grid, spacing = fit_grid(points, 64), local_spacing(points)
    clean, noisy = (estimate_cost(spacing, grid, noisy=noisy).cpu_seconds for noisy in (False, True))
    assert noisy > 1.3 * clean
    assert estimate_cost(spacing, grid, noisy=True, crowded=1.0).cpu_seconds == noisy  # noise looks like sheets
    moved = points + np.random.default_rng(0).normal(size=points.shape) * 0.03
    assert not looks_noisy(points, spacing)
    assert looks_noisy(moved, local_spacing(moved))


@pytest.mark.parametrize(("denoise", "looks", "counts"), [("auto", True, True), (0.2, False, True), (0.0, True, False)])
def test_noise_that_is_left_costs_nothing(monkeypatch, denoise, looks, counts):
    monkeypatch.setattr("core.budget._probe", lambda: (0.004, 1.0))
    grid, spacing, settings = fit_grid(POINTS, 64), local_spacing(POINTS), Settings(resolution=64, denoise=denoise)
    found, noisy = (estimate_cost(spacing, grid, settings, noisy=looks), estimate_cost(spacing, grid, noisy=counts))
    assert found.cpu_seconds == noisy.cpu_seconds


@pytest.mark.parametrize("dear", [{"solver": "energy"}, {"integration": "poisson"}])
def test_solver_and_integration_cost(monkeypatch, dear):
    monkeypatch.setattr("core.budget._probe", lambda: (0.004, 1.0))
    assert cost(POINTS, 96, **dear)[0].cpu_seconds > 1.3 * cost(POINTS, 96)[0].cpu_seconds


def test_sheets_that_run_close_cost(monkeypatch):
    """Concentric spheres a spacing apart; around a single one of as many points no two sheets are seen."""
    monkeypatch.setattr("core.budget._probe", lambda: (0.004, 1.0))
    points = shapes.scattered_sphere(3000)
    spacing = local_spacing(points)
    shells = np.concatenate([points, (1 + np.median(spacing)) * shapes.scattered_sphere(3000, seed=1)])
    alone, crowded = crowded_share(points, spacing), crowded_share(shells, local_spacing(shells))
    assert alone < 0.02
    assert crowded > 0.5
    grid = fit_grid(points, 64)

    def work(share, surface):
        return estimate_cost(spacing, grid, Settings(surface=surface), crowded=share).cpu_seconds

    assert work(crowded, "single") > work(crowded, "double") > 1.5 * work(alone, "double")
    assert work(crowded, "none") == work(0, "none")


def test_a_run_beyond_half_of_the_limit_warns():
    limit = 1.5 * cost(POINTS, 96, surface="none")[0].memory_mb
    run = Settings(resolution=96, surface="none")
    (warning,) = reconstruct(POINTS, replace(run, memory_limit=limit)).report["warnings"]
    assert f"of {limit:.0f} MiB" in warning
    assert not reconstruct(POINTS, replace(run, memory_limit=2 * limit)).report["warnings"]


def test_the_message_names_the_need_the_limit_and_a_resolution_that_fits():
    with pytest.raises(MemoryBudgetError) as caught:
        reconstruct(POINTS, Settings(resolution=256, memory_limit=300))
    message = str(caught.value)
    assert isinstance(caught.value, VADError)
    assert "resolution 256" in message
    assert "300 MiB" in message
    fitting = int(message.split("use resolution ")[1].split()[0])
    assert cost(POINTS, fitting)[0].memory_mb <= 300 < cost(POINTS, fitting + 8)[0].memory_mb
    assert reconstruct(POINTS, Settings(resolution=32, memory_limit=300, surface="none")).field.values.size


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_at_the_suited_resolution_points_are_a_cell_and_a_half_apart(scale):
    points = scale * POINTS
    spacing = local_spacing(points)
    resolution = suited_resolution(points, spacing)
    cell = fit_grid(points, resolution).spacing
    assert np.median(spacing) == pytest.approx(1.5 * cell, rel=0.02)
    assert suited_resolution(points, 1e-6 * spacing) == 2048
    assert suited_resolution(points, 1e6 * spacing) == 16


def test_in_a_band_cost_grows_with_the_surface():
    coarse, fine = (cost(POINTS, resolution, band=4)[0] for resolution in (512, 2048))
    assert 12 < (fine.memory_mb - 110) / (coarse.memory_mb - 110) < 17
    whole = cost(POINTS, 512)[0]
    assert coarse.memory_mb < whole.memory_mb / 1.8


def test_a_band_is_the_remedy_and_has_one_itself():
    in_band = cost(POINTS, 256, band=4)[0].memory_mb
    for limit, helps in ((in_band + 1, True), (in_band - 1, False)):
        with pytest.raises(MemoryBudgetError) as caught:
            reconstruct(POINTS, Settings(resolution=256, memory_limit=limit))
        assert ("set band to 4" in str(caught.value)) is helps
    with pytest.raises(MemoryBudgetError, match=r"set band to 5,"):
        reconstruct(POINTS, Settings(resolution=256, offset=3, memory_limit=in_band + 1))
    settings = Settings(resolution=1024, band=4, memory_limit=1000)
    estimate, grid = cost(POINTS, 1024, band=4)
    with pytest.raises(MemoryBudgetError) as caught:
        check_budget(estimate, local_spacing(POINTS), grid, settings)
    fitting = int(str(caught.value).split("use resolution ")[1].split()[0])
    assert "band" not in str(caught.value)
    assert cost(POINTS, fitting, band=4)[0].memory_mb < 1000 < cost(POINTS, fitting + 10, band=4)[0].memory_mb


def test_too_many_points_for_any_grid_are_named():
    _, grid = cost(POINTS, 64)
    settings, spacing = Settings(resolution=64, memory_limit=1000), np.full(1_000_000, 0.01)
    with pytest.raises(MemoryBudgetError, match=r"thin the 1000000 points to [0-9]+ or fewer"):
        check_budget(Estimate(1.0, 50_000.0, 1.0), spacing, grid, settings)


@pytest.mark.parametrize("processors", [2, 8])
def test_the_advice_to_thin_fits_on_any_number_of_cores(monkeypatch, processors):
    monkeypatch.setattr("os.cpu_count", lambda: processors)
    _, grid = cost(POINTS, 16)
    settings = Settings(resolution=16, memory_limit=300)
    with pytest.raises(MemoryBudgetError) as caught:
        check_budget(Estimate(1.0, 1000.0, 1.0), np.full(200_000, 1e-4), grid, settings)
    fitting = int(str(caught.value).split(" points to ")[1].split()[0])
    assert estimate_cost(np.full(fitting, 1e-4), grid, settings).memory_mb == pytest.approx(300, abs=1)


def test_points_to_thin_and_a_resolution_that_fit_together():
    spacing, grid = cost(POINTS, 512)[1].spacing * np.full(40_000, 2.0), cost(POINTS, 512)[1]
    settings = Settings(resolution=512, memory_limit=90)
    with pytest.raises(MemoryBudgetError) as caught:
        check_budget(estimate_cost(spacing, grid, settings), spacing, grid, settings)
    words = str(caught.value).split()
    count, resolution = int(words[words.index("to") + 1]), int(words[words.index("resolution", 3) + 1])
    fewer, coarser = spacing[:count] * np.sqrt(40_000 / count), fit_grid(POINTS, resolution)
    assert estimate_cost(fewer, coarser, replace(settings, resolution=resolution)).memory_mb <= 90


def test_no_points_are_advised_that_are_too_few():
    _, grid = cost(POINTS, 16)
    with pytest.raises(MemoryBudgetError, match=r"may be used; raise memory_limit$"):
        check_budget(
            Estimate(1.0, 1000.0, 1.0),
            np.full(500, 0.1),
            grid,
            Settings(resolution=16, memory_limit=64, solver="energy", backend="torch"),
        )


@pytest.mark.parametrize("version", [1, 2])
def test_pages_of_files_that_a_container_can_give_up_are_free(monkeypatch, tmp_path, version):
    folder = tmp_path / "memory" if version == 1 else tmp_path
    folder.mkdir(exist_ok=True)
    names = (
        ("limit_in_bytes", "usage_in_bytes", "total_inactive_file")
        if version == 1
        else ("max", "current", "inactive_file")
    )
    for name, value in zip(names, (64, 48), strict=False):
        (folder / f"memory.{name}").write_text(str(value << 20))
    (folder / "memory.stat").write_text(f"anon 1\n{names[2]} {16 << 20}\n")
    monkeypatch.setattr("core.budget._CGROUP", tmp_path)
    monkeypatch.setattr("core.budget._linux_available", lambda: 1e9)
    monkeypatch.setattr("sys.platform", "linux")
    assert free_memory_mb() == 32


def test_auto_is_seven_tenths_of_what_is_free(monkeypatch):
    estimate, grid = cost(POINTS, 64)
    monkeypatch.setattr("core.budget.free_memory_mb", lambda: estimate.memory_mb / 0.7 * 1.01)
    check_budget(estimate, local_spacing(POINTS), grid, Settings(resolution=64))
    monkeypatch.setattr("core.budget.free_memory_mb", lambda: estimate.memory_mb / 0.7 * 0.99)
    with pytest.raises(MemoryBudgetError):
        check_budget(estimate, local_spacing(POINTS), grid, Settings(resolution=64))


def test_free_memory_is_a_part_of_what_there_is():
    assert 10 < free_memory_mb() < 2**24


def test_the_command_line_ends_with_status_3_and_writes_nothing(tmp_path, capsys):
    np.save(tmp_path / "ball.npy", POINTS)
    arguments = [
        "reconstruct",
        tmp_path / "ball.npy",
        "-o",
        tmp_path / "out",
        "--resolution",
        300,
        "--memory-limit",
        200,
    ]
    assert main([str(argument) for argument in arguments]) == 3
    assert "use resolution" in capsys.readouterr().err
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").iterdir())


def test_info_tells_both(tmp_path, capsys):
    np.save(tmp_path / "ball.npy", POINTS)
    assert main(["info", str(tmp_path / "ball.npy"), "--resolution", "96"]) == 0
    *_, suits, run = capsys.readouterr().out.splitlines()
    assert " s and " in run
    assert f"resolution {suited_resolution(POINTS, local_spacing(POINTS))}, at which points are 1.5 cells" in suits
