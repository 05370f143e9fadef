import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from plyfile import PlyData

from core import DistanceField, Mesh, MissingDependency, Reconstruction, Settings, cli
from core.exit_status import REQUESTS_TO_END
from core.io.atomic import atomic_path
from core.io.openvdb_module import load_openvdb
from core.io.ply import write_points
from core.io.points import read_points, read_scan
from core.settings import default_in_words, options
from tests.bands import near_band

ROOT = Path(__file__).parents[2]
REPORT = {
    "settings": {},
    "counts": {"input": 400, "samples": 4},
    "seconds": {"normals": 1.0, "field": np.float64(0.5)},
    "warnings": [],
}


@pytest.fixture
def scan(tmp_path):
    """A ball of 400 points, far from the origin."""
    points = np.random.default_rng(0).normal(size=(400, 3))
    np.save(tmp_path / "ball.npy", points / np.linalg.norm(points, axis=1, keepdims=True) + [1000, 0, 0])
    return str(tmp_path / "ball.npy")


@pytest.fixture
def calls(monkeypatch):
    """Replaces the method by a recorder with a made-up result, so that these tests are about the command line."""
    made = []

    def reconstruct(points, settings, progress):
        made.append((points, settings))
        for k in range(5):
            if progress(k / 4, f"stage {k}") is False:
                raise cli.Cancelled("cancelled during 'stage'; nothing was written")
        mesh = Mesh(points[:4], np.array([[0, 1, 2]], np.int32))
        return Reconstruction(
            points[:4],
            np.arange(4),
            np.eye(4, 3),
            np.ones(4),
            DistanceField(
                np.ones((4, 4, 4), np.float32),
                np.zeros(3),
                0.25,
                sdf=settings.surface == "signed",
                near=near_band((4, 4, 4), np.array([21, 22]), np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.0]])),
            ),
            mesh if settings.surface in ("double", "both", "signed") else None,
            mesh if settings.surface in ("single", "both") else None,
            REPORT,
        )

    monkeypatch.setattr(cli, "reconstruct", reconstruct)
    return made


def run(capsys, *arguments):
    """Exit status, stdout and stderr of the command line."""
    status = cli.main([str(argument) for argument in arguments])
    printed = capsys.readouterr()
    return status, printed.out, printed.err


def refused(capsys, *arguments):
    """The one line on stderr of a call that is refused with status 2."""
    status, out, err = run(capsys, *arguments)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    return err


def test_every_file_is_written_and_told(capsys, scan, calls, tmp_path):
    status, out, err = run(capsys, "reconstruct", scan, "-o", tmp_path / "deep" / "out")
    assert status == 0
    names = ["ball.json", "ball.vdb", "ball_double.ply", "ball_points.ply"]
    assert sorted(os.listdir(tmp_path / "deep" / "out")) == names
    assert "4 samples reconstructed in 1.5 s" in out
    assert all(str(tmp_path / "deep" / "out" / name) in out for name in names)
    assert err == ""
    np.testing.assert_array_equal(calls[0][0], np.load(scan))
    assert len(PlyData.read(tmp_path / "deep" / "out" / "ball_double.ply")["face"]) == 1
    np.testing.assert_array_equal(read_points(tmp_path / "deep" / "out" / "ball_points.ply"), np.load(scan)[:4])


def test_meshes_and_points_carry_what_the_scan_does(capsys, calls, tmp_path):
    points, red = np.random.default_rng(0).normal(size=(400, 3)), np.arange(400).astype(np.uint8)
    write_points(tmp_path / "scan.ply", points, points, {"red": red, "distance": red})
    assert run(capsys, "reconstruct", tmp_path / "scan.ply", "-o", tmp_path / "out", "--surface", "both")[0] == 0
    kept = ["confidence", "red", "scan_distance"]
    for ending, names in (("double", ["distance", *kept]), ("points", kept)):
        found = read_scan(tmp_path / "out" / f"scan_{ending}.ply")[1]
        assert list(found) == names
        np.testing.assert_array_equal(found["red"], [0, 1, 2, 3])
        np.testing.assert_array_equal(found["confidence"], 1)
    found = read_scan(tmp_path / "out" / "scan_single.ply")[1]
    assert found.keys() == {"distance", *kept}
    assert (found["distance"] >= 1).all()  # the field is one, and the mesh beyond its box


def test_json_is_all_there_is_on_stdout_and_equals_the_report_file(capsys, scan, calls, tmp_path):
    status, out, _ = run(capsys, "reconstruct", scan, "-o", tmp_path / "out", "--json")
    report = json.loads(out)
    assert status == 0
    assert report["seconds"] == {"normals": 1.0, "field": 0.5}
    assert sorted(report["files"]) == sorted(str(path) for path in (tmp_path / "out").iterdir())
    assert report == json.loads((tmp_path / "out" / "ball.json").read_text())


def test_no_mesh_was_asked(capsys, scan, calls, tmp_path):
    run(capsys, "reconstruct", scan, "-o", tmp_path / "out", "--surface", "none")
    assert sorted(os.listdir(tmp_path / "out")) == ["ball.json", "ball.vdb", "ball_points.ply"]


@pytest.mark.parametrize(
    ("surface", "meshes"),
    [("single", {"single"}), ("both", {"single", "double"}), ("signed", {"signed"})],
)
def test_each_mesh_has_a_file(capsys, scan, calls, tmp_path, surface, meshes):
    run(capsys, "reconstruct", scan, "-o", tmp_path / "out", "--surface", surface)
    assert set(os.listdir(tmp_path / "out")) == {
        "ball.json", "ball.vdb", "ball_points.ply", *(f"ball_{mesh}.ply" for mesh in meshes)
    }  # fmt: skip


def test_arrays_on_request(capsys, scan, calls, tmp_path):
    status, out, _ = run(capsys, "reconstruct", scan, "-o", tmp_path / "out", "--arrays", "--json")
    assert status == 0
    assert str(tmp_path / "out" / "ball.npz") in json.loads(out)["files"]
    with np.load(tmp_path / "out" / "ball.npz", allow_pickle=False) as arrays:
        np.testing.assert_array_equal(arrays["values"], np.ones((4, 4, 4)))
        np.testing.assert_array_equal(arrays["node"], [[1, 1, 1], [1, 1, 2]])
        np.testing.assert_allclose(arrays["direction"], [[0, 0, 1], [0, 0, 0]])


@pytest.mark.parametrize("linked", [False, True])
def test_the_scan_is_never_replaced(capsys, calls, tmp_path, linked):
    scan = tmp_path / ("other.npz" if linked else "ball.npz")
    np.savez(scan, points=np.random.default_rng(0).normal(size=(400, 3)))
    if linked:
        os.link(scan, tmp_path / "ball.npz")
        scan = tmp_path / "link" / "ball.npz"
        scan.parent.mkdir()
        scan.symlink_to(tmp_path / "ball.npz")
    before = scan.read_bytes()
    err = refused(capsys, "reconstruct", scan, "-o", tmp_path, "--arrays")
    assert "ball.npz would replace the scan" in err
    assert scan.read_bytes() == before
    assert run(capsys, "reconstruct", scan, "-o", tmp_path)[0] == 0


def test_gradient_grid_on_request(capsys, scan, calls, tmp_path):
    openvdb = load_openvdb()
    for flags, names in (([], {"udf", "density"}), (["--gradient"], {"udf", "density", "gradient"})):
        run(capsys, "reconstruct", scan, "-o", tmp_path / "out", *flags)
        assert {grid.name for grid in openvdb.readAll(str(tmp_path / "out" / "ball.vdb"))[0]} == names


def test_defaults_are_those_of_settings(capsys, scan, calls, tmp_path):
    run(capsys, "reconstruct", scan, "-o", tmp_path)
    assert calls[0][1] == Settings()


REQUIRED = {"diffusion": {"integration": "poisson"}, "resolution": {"band": "4"}}  # by the other value of a setting


@pytest.mark.parametrize("name", options())
def test_every_setting_is_an_option(capsys, scan, calls, tmp_path, name):
    field, required = options()[name], REQUIRED.get(name, {})
    option = name.replace("_", "-")
    if field.type is bool:
        other, given = not field.default, [f"--no-{option}"]
    else:
        other = field.metadata["choices"][-1] if field.metadata["choices"] else field.metadata["limits"][1]
        given = [f"--{option}", other]
    given += [word for pair in required.items() for word in (f"--{pair[0]}", pair[1])]
    run(capsys, "reconstruct", scan, "-o", tmp_path, *given)
    assert calls[0][1] == Settings(**{name: other}, **required)


@pytest.mark.parametrize(
    ("option", "value"),
    [("resolution", "0"), ("resolution", "10000"), ("resolution", "64.5"), ("resolution", "fine"), ("bridge", "-1"),
     ("bridge", "nan"), ("surface", "triple"), ("seed", "-1")],
)  # fmt: skip
def test_a_bad_value_gets_the_message_of_settings(capsys, scan, calls, tmp_path, option, value):
    message = refused(capsys, "reconstruct", scan, "-o", tmp_path / "out", f"--{option}", value)
    assert option in message
    assert value in message
    assert not (tmp_path / "out").exists()
    assert not calls


@pytest.mark.parametrize(
    "arguments", [[], ["restore"], ["reconstruct"], ["reconstruct", "a.ply"], ["info", "a.ply", "--res", "64"]]
)
def test_bad_usage_is_one_line_that_points_to_the_help(capsys, arguments):
    assert "--help" in refused(capsys, *arguments)


@pytest.mark.parametrize("command", [["reconstruct", "-o", "out"], ["info"]])
def test_a_bad_scan_is_one_line(capsys, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.xyz").write_text("1 2 3\n1 2\n")
    assert "line 2" in refused(capsys, *command, "bad.xyz")
    assert "No such file" in refused(capsys, *command, "none.xyz")
    assert os.listdir(tmp_path) == ["bad.xyz"]


def test_an_unusable_output_folder_is_refused_before_the_work(capsys, scan, calls):
    assert "nothing can be written into" in refused(capsys, "reconstruct", scan, "-o", scan)
    assert not calls


@pytest.mark.parametrize("ending", [".ply", ".PLY", ".vdb", ".json"])
def test_a_file_in_place_of_the_output_folder_is_refused(capsys, scan, calls, tmp_path, ending):
    assert "is to be a folder" in refused(capsys, "reconstruct", scan, "-o", tmp_path / f"mesh{ending}")
    assert not (tmp_path / f"mesh{ending}").exists()
    (tmp_path / f"mesh{ending}").mkdir()
    assert run(capsys, "reconstruct", scan, "-o", tmp_path / f"mesh{ending}")[0] == 0


def test_empty_paths_are_refused(capsys, scan, calls, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "empty; give a path" in refused(capsys, "reconstruct", scan, "-o", "")
    assert "empty; give a path" in refused(capsys, "reconstruct", "", "-o", "out")
    assert not calls


def test_results_of_another_scan_of_that_name_stay(capsys, scan, calls, tmp_path, monkeypatch):
    """Whether its name has another ending or it lies in another folder, and where the first scan is gone."""
    monkeypatch.chdir(tmp_path)
    assert run(capsys, "reconstruct", "ball.npy", "-o", "out")[0] == 0
    written = (tmp_path / "out" / "ball.json").read_bytes()
    (tmp_path / "b").mkdir()
    np.savetxt(tmp_path / "ball.xyz", np.load(scan))
    np.save(tmp_path / "b" / "ball.npy", np.load(scan))
    for other in ("ball.xyz", "b/ball.npy"):
        assert f"holds the results of {scan}" in refused(capsys, "reconstruct", other, "-o", "out")
    assert (tmp_path / "out" / "ball.json").read_bytes() == written
    monkeypatch.chdir(tmp_path / "b")
    assert run(capsys, "reconstruct", "../ball.npy", "-o", "../out")[0] == 0
    os.remove(scan)
    np.save("ball.npy", np.load("ball.npy") + 1)
    written = (tmp_path / "out" / "ball.json").read_bytes()
    assert "out holds the results of" in refused(capsys, "reconstruct", "ball.npy", "-o", "../out")
    assert (tmp_path / "out" / "ball.json").read_bytes() == written


def test_results_of_a_scan_out_of_reach_are_told_by_its_digest(capsys, scan, calls, tmp_path, monkeypatch):
    assert run(capsys, "reconstruct", scan, "-o", tmp_path / "out")[0] == 0
    (tmp_path / "b").mkdir()
    copy = tmp_path / "b" / "ball.npy"
    copy.write_bytes(Path(scan).read_bytes())
    samefile = Path.samefile

    def denied(path, other):
        if str(path) == str(scan):
            raise PermissionError(13, "Permission denied", str(path))
        return samefile(path, other)

    monkeypatch.setattr(Path, "samefile", denied)
    assert run(capsys, "reconstruct", copy, "-o", tmp_path / "out")[0] == 0
    report = tmp_path / "out" / "ball.json"
    report.write_text(json.dumps(json.loads(report.read_text()) | {"scan": str(scan)}))
    np.save(copy, np.load(copy) + 1)
    assert f"holds the results of {scan}" in refused(capsys, "reconstruct", copy, "-o", tmp_path / "out")


def test_a_scan_that_was_moved_updates_its_results(capsys, scan, calls, tmp_path):
    assert run(capsys, "reconstruct", scan, "-o", tmp_path / "out")[0] == 0
    (tmp_path / "b").mkdir()
    moved = Path(scan).rename(tmp_path / "b" / "ball.npy")
    assert run(capsys, "reconstruct", moved, "-o", tmp_path / "out")[0] == 0
    assert json.loads((tmp_path / "out" / "ball.json").read_text())["scan"] == str(moved)


@pytest.mark.parametrize("ending", ["_points.ply", "_double.ply", "_signed.ply", ".vdb", ".npz", ".json"])
def test_files_that_others_made_stay(capsys, scan, calls, tmp_path, ending):
    path = tmp_path / f"ball{ending}"
    path.write_bytes(b'{"scan": 3}')
    message = refused(capsys, "reconstruct", scan, "-o", tmp_path, "--arrays")
    assert f"{path} is there, and was not made by this program" in message
    assert path.read_bytes() == b'{"scan": 3}'
    assert not calls


@pytest.mark.parametrize("ending", ["_double.ply", ".json"])
@pytest.mark.parametrize("make", [os.mkdir, getattr(os, "mkfifo", os.mkdir)])
def test_folders_and_pipes_stay(scan, tmp_path, ending, make):
    path = tmp_path / f"ball{ending}"
    make(path)
    command = [sys.executable, "-m", "core", "reconstruct", scan, "-o", str(tmp_path), "--arrays"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=30)
    assert done.returncode == 2
    assert f"{path} is there, and was not made by this program" in done.stderr
    assert path.exists()


def test_files_of_others_that_resemble_ours_stay(capsys, scan, calls, tmp_path):
    (tmp_path / "ball.json").write_text('{"scan": "ball.npy", "scanner": "a", "files": ["ball.vdb"]}')
    assert "ball.json is there, and was not made" in refused(capsys, "reconstruct", scan, "-o", tmp_path)
    (tmp_path / "ball.json").unlink()
    np.savez(tmp_path / "ball.npz", values=np.zeros(3))
    assert "ball.npz is there, and was not made" in refused(capsys, "reconstruct", scan, "-o", tmp_path, "--arrays")


@pytest.mark.parametrize("surface", ["both", "signed"])
def test_results_of_a_run_that_was_killed_before_its_report_are_replaced(capsys, scan, calls, tmp_path, surface):
    arguments = "reconstruct", scan, "-o", tmp_path / "out", "--arrays", "--surface", surface
    assert run(capsys, *arguments)[0] == 0
    (tmp_path / "out" / "ball.json").unlink()
    assert run(capsys, *arguments)[0] == 0
    assert run(capsys, *arguments)[0] == 0


def test_a_file_that_a_user_saved_over_a_result_stays(capsys, scan, calls, tmp_path):
    """Its name in the report of an earlier run does not make it ours."""
    arguments = "reconstruct", scan, "-o", tmp_path / "out", "--arrays"
    assert run(capsys, *arguments)[0] == 0
    for ending in ("_double.ply", "_points.ply", ".vdb", ".npz"):
        path = tmp_path / "out" / f"ball{ending}"
        written = path.read_bytes()
        path.write_bytes(b"edited")
        assert f"{path} is there, and was not made by this program" in refused(capsys, *arguments)
        assert path.read_bytes() == b"edited"
        path.write_bytes(written)


@pytest.mark.parametrize("failing", ["write_vdb", "write_mesh", "write_arrays", "write_report"])
def test_a_run_that_fails_while_it_writes_changes_nothing(capsys, scan, calls, tmp_path, monkeypatch, failing):
    folder = tmp_path / "out"
    arguments = "reconstruct", scan, "-o", folder, "--arrays"
    assert run(capsys, *arguments)[0] == 0
    before = {path: path.read_bytes() for path in folder.iterdir()}

    def full(path, *given, **named):
        with atomic_path(path) as temporary:
            temporary.write_bytes(b"half")
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(cli, failing, full)
    assert "cannot be written (No space left on device)" in refused(capsys, *arguments, "--surface", "both")
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_a_scan_without_a_command_is_told_the_two(capsys, scan):
    message = refused(capsys, scan, "--resolution", "64")
    assert f"python -m core reconstruct {scan} -o FOLDER" in message
    assert f"python -m core info {scan}" in message
    assert "'my scan.ply'" in refused(capsys, "my scan.ply")


def test_what_no_option_takes_is_told_with_the_help_that_lists_them(capsys, scan, calls):
    message = refused(capsys, "reconstruct", scan, "-o", "out", "--resolutoin", "32")
    assert "--resolutoin 32 (is --resolution meant?)" in message
    assert "python -m core reconstruct --help" in message
    for given in ("--no-outlier", "--outlier", "--memory-limt=640"):
        meant = {"--memory-limt=640": "--memory-limit"}.get(given, f"{given}s")
        assert f"{given} (is {meant} meant?)" in refused(capsys, "reconstruct", scan, "-o", "out", given)
    for no in ("False", "no", "0"):
        message = refused(capsys, "reconstruct", scan, "-o", "out", "--outliers", no)
        assert f"{no} (is --no-outliers meant?)" in message
    assert "meant" not in refused(capsys, "reconstruct", scan, "-o", "out", "--outliers", "True")
    for given, meant in (("--res", "--resolution"), ("--mem=640", "--memory-limit")):
        assert f"{given} (is {meant} meant?)" in refused(capsys, "reconstruct", scan, "-o", "out", given)
    for given in ("--signed", "--version", "--voxel"):
        assert "meant" not in refused(capsys, "reconstruct", scan, "-o", "out", given)
    message = refused(capsys, "reconstruct", scan, "b.ply", "c.ply", "-o", "out")
    assert "b.ply c.ply; reconstruct takes one scan at a time" in message
    assert "python -m core info --help" in refused(capsys, "info", scan, "--zzz")


def test_errors_with_json_are_json_too(capsys):
    status, out, err = run(capsys, "info", "none.ply", "--json")
    assert status == 2
    assert err == f"error: {json.loads(out)['error']}\n"
    status, out, _ = run(capsys, "reconstruct", "--json")
    assert "required" in json.loads(out)["error"]


def test_without_openvdb_the_rest_is_delivered_with_a_warning(capsys, scan, calls, tmp_path, monkeypatch):
    def absent():
        raise MissingDependency("OpenVDB is not installed; get it")

    monkeypatch.setattr("core.io.vdb.load_openvdb", absent)
    status, out, err = run(capsys, "reconstruct", scan, "-o", tmp_path / "out", "--json")
    assert status == 0
    assert sorted(os.listdir(tmp_path / "out")) == ["ball.json", "ball_double.ply", "ball_points.ply"]
    assert "ball.vdb is not written: OpenVDB is not installed; get it" in json.loads(out)["warnings"][0]
    assert err == f"warning: {json.loads(out)['warnings'][0]}\n"
    assert REPORT["warnings"] == []


def test_a_scan_too_small_for_openvdb_has_the_rest_with_a_warning(capsys, tmp_path):
    points = np.random.default_rng(0).normal(size=(200, 3))
    np.savetxt(tmp_path / "ball.xyz", 1e-5 * points / np.linalg.norm(points, axis=1, keepdims=True))
    status, _, err = run(capsys, "reconstruct", tmp_path / "ball.xyz", "-o", tmp_path / "out", "--resolution", "16")
    assert status == 0
    assert sorted(os.listdir(tmp_path / "out")) == ["ball.json", "ball_double.ply", "ball_points.ply"]
    assert "ball.vdb is not written: cells are" in err


@pytest.fixture
def ctrl_c_heeded():
    """Also where the tests run in the background of a shell that has it ignored; requests to end under nohup."""
    numbers = signal.SIGINT, *REQUESTS_TO_END
    before = {number: signal.signal(number, signal.default_int_handler) for number in numbers}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("ctrl_c_heeded")
@pytest.mark.parametrize("number", [signal.SIGINT, *REQUESTS_TO_END])
@pytest.mark.parametrize("presses", [1, 2])
def test_ctrl_c_cancels_and_writes_nothing(capsys, scan, calls, tmp_path, monkeypatch, presses, number):
    def reconstruct(points, settings, progress):
        for _ in range(presses):
            os.kill(os.getpid(), number)
        assert progress(0.5, "field") is False
        raise cli.Cancelled("cancelled during 'field'; nothing was written")

    monkeypatch.setattr(cli, "reconstruct", reconstruct)
    before = signal.getsignal(number)
    status, out, err = run(capsys, "reconstruct", scan, "-o", tmp_path / "out")
    assert (status, out) == (130, "")
    assert err.startswith("error: cancelled")
    assert err.count("\n") == 1
    assert os.listdir(tmp_path / "out") == []
    assert signal.getsignal(number) == before


def test_signals_that_a_shell_has_ignored_stay_so(capsys, scan, calls, tmp_path, monkeypatch):
    """Ctrl-C is not for jobs in the background."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        make = cli.reconstruct

        def reconstruct(*arguments, **options):
            os.kill(os.getpid(), signal.SIGINT)
            return make(*arguments, **options)

        monkeypatch.setattr(cli, "reconstruct", reconstruct)
        assert run(capsys, "reconstruct", scan, "-o", tmp_path / "out")[0] == 0
    finally:
        signal.signal(signal.SIGINT, before)


def test_the_bar_shows_on_a_terminal_only(capsys, scan, calls, tmp_path, monkeypatch):
    assert run(capsys, "reconstruct", scan, "-o", tmp_path)[2] == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert "stage" in run(capsys, "reconstruct", scan, "-o", tmp_path)[2]


@pytest.mark.parametrize("arguments", [["--help"], ["reconstruct", "--help"], ["info", "--help"]])
def test_help(capsys, arguments):
    with pytest.raises(SystemExit) as caught:
        cli.main(arguments)
    assert caught.value.code == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "SCAN" in text or "python -m core reconstruct bunny.ply -o out" in text
    for name, field in options().items() if arguments[0] == "reconstruct" else ():
        assert f"--{name.replace(chr(95), chr(45))}" in text
        assert field.metadata["help"][:30] in text
        assert f"default {default_in_words(field)}" in text


def test_info_knows_of_the_band(capsys, scan):
    fine = "info", scan, "--resolution", 512, "--json"
    whole, band = (json.loads(run(capsys, *fine, *more)[1]) for more in ([], ["--band", 4]))
    assert (whole["band"], band["band"]) == (None, 4.0)
    assert band["estimate"]["memory_mb"] < whole["estimate"]["memory_mb"] / 2
    assert "those within 4 cells of the surface alone" in run(capsys, "info", scan, "--band", 4)[1]
    assert "set band" in refused(capsys, "info", scan, "--resolution", 1024)


def test_info_is_of_a_run_so_set(capsys, scan):
    """An option of `reconstruct` is one here, too."""
    asked = "info", scan, "--json", "--surface", "none"
    plain, dear = (json.loads(run(capsys, *asked, *more)[1]) for more in ([], ["--integration", "poisson"]))
    assert dear["estimate"]["memory_mb"] > plain["estimate"]["memory_mb"] + 10
    assert "offset is 9;" in refused(capsys, "info", scan, "--offset", 9)


def test_info_counts_and_measures(capsys, tmp_path):
    """A 20 x 10 lattice of step 0.5 with two repeated points and one that is not finite."""
    x, y = np.meshgrid(np.arange(20), np.arange(10))
    lattice = np.stack([x.ravel(), y.ravel(), np.zeros(200)], axis=1) * 0.5 + [7, 8, 9]
    np.save(tmp_path / "lattice.npy", np.vstack([lattice, lattice[:2], [[np.nan, 0, 0]]]))
    status, out, _ = run(capsys, "info", tmp_path / "lattice.npy", "--json", "--resolution", 64)
    facts = json.loads(out)
    assert status == 0
    assert (facts["points"], facts["not_finite"], facts["duplicates"]) == (203, 1, 2)
    assert facts["box"] == {"low": [7, 8, 9], "high": [16.5, 12.5, 9], "size": [9.5, 4.5, 0]}
    np.testing.assert_allclose([facts["nearest_neighbour"][key] for key in ("smallest", "median", "largest")], 0.5)
    assert facts["resolution"] == 64
    np.testing.assert_allclose(facts["grid"]["cell"], 9.5 * 1.25 / 64)  # padded by an eighth on either side
    assert facts["grid"]["shape"][0] == 65
    np.testing.assert_allclose(facts["spacing"], 0.5 * (4 + 2 * np.sqrt(2)) / 6)  # four straight, two diagonal
    status, out, _ = run(capsys, "info", tmp_path / "lattice.npy")
    assert "203, of which 1 not finite, 2 duplicates, 0 near copies of others and 0 outliers" in out
    assert "size 9.5 4.5 0" in out


def test_info_is_of_a_run_that_drops_strays(capsys, scan, tmp_path):
    np.save(tmp_path / "stray.npy", np.vstack([np.load(scan), [[3000.0, 0, 0]]]))
    clean, stray = (json.loads(run(capsys, "info", path, "--json")[1]) for path in (scan, tmp_path / "stray.npy"))
    assert (clean["outliers"], stray["outliers"], stray["points"]) == (0, 1, 401)
    assert {key: stray[key] for key in ("box", "grid", "suited_resolution")} == {
        key: clean[key] for key in ("box", "grid", "suited_resolution")
    }


def test_info_tells_what_a_run_takes_of_dense_lines(capsys, tmp_path):
    turn, height = np.meshgrid(np.linspace(0, 2 * np.pi, 4000, endpoint=False), np.linspace(0, 1, 9))
    np.save(tmp_path / "rings.npy", np.stack([np.cos(turn), np.sin(turn), height], axis=2).reshape(-1, 3))
    coarse, fine = (
        json.loads(run(capsys, "info", tmp_path / "rings.npy", "--json", "--resolution", each)[1]) for each in (32, 256)
    )
    assert 0 < fine["in_solids_or_lines"] < coarse["in_solids_or_lines"] < 36_000
    assert fine["spacing"] < coarse["spacing"]
    assert fine["suited_resolution"] == coarse["suited_resolution"]
    out = run(capsys, "info", tmp_path / "rings.npy", "--resolution", 32)[1]
    assert f"{coarse['in_solids_or_lines']} more are dropped inside solids and on dense lines" in out


def test_info_tells_near_copies_from_duplicates(capsys, tmp_path):
    points = np.random.default_rng(0).uniform(size=(1000, 3)) * [1, 1, 0]
    np.save(tmp_path / "scan.npy", np.vstack([points, points[:400] + 1e-6, points[:7]]))
    facts = json.loads(run(capsys, "info", tmp_path / "scan.npy", "--json")[1])
    assert facts["duplicates"] == 7
    assert 400 <= facts["near_copies"] < 420


@pytest.fixture
def cube(tmp_path):
    """A cube of eight vertices, as modelled."""
    corners = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    path = tmp_path / "cube.obj"
    path.write_text(corners + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n")
    return path


def test_of_meshes_with_few_vertices_it_is_told_that_these_alone_are_read(capsys, cube, calls, tmp_path):
    said = f"{cube} is a mesh: its vertices alone are read, and they are few for its shape: from face to face it turns "
    said += "by 90 degrees; subdivide it, or give points sampled all over its faces"
    status, out, err = run(capsys, "reconstruct", cube, "-o", tmp_path / "out", "--json")
    assert (status, err) == (0, f"warning: {said}\n")
    assert json.loads(out)["warnings"] == [said]
    assert REPORT["warnings"] == []
    assert run(capsys, "info", cube)[1].endswith(f"\n{said}\n")
    assert json.loads(run(capsys, "info", cube, "--json")[1])["warnings"] == [said]


def test_a_scan_that_is_gone_after_the_run_has_its_results(capsys, cube, calls, tmp_path, monkeypatch):
    monkeypatch.setattr(cli, "_progress", lambda before=cli._progress: cube.unlink() or before())
    assert run(capsys, "reconstruct", cube, "-o", tmp_path / "out")[0] == 0
    assert "cube_double.ply" in os.listdir(tmp_path / "out")


def test_options_are_taken_as_the_settings_spell_them(capsys, scan, calls, tmp_path):
    for name in ("--memory_limit", "--memory-limit"):
        assert run(capsys, "reconstruct", scan, "-o", tmp_path, name, "640")[0] == 0
        assert calls[-1][1].memory_limit == 640


def test_files_of_another_run_are_told_and_stay(capsys, scan, calls, tmp_path):
    run(capsys, "reconstruct", scan, "-o", tmp_path, "--surface", "both")
    before = (tmp_path / "ball_single.ply").read_bytes()
    _, _, err = run(capsys, "reconstruct", scan, "-o", tmp_path, "--surface", "signed")
    for ending in ("double", "single"):
        assert f"warning: {tmp_path / f'ball_{ending}.ply'} is not of this run" in err
    assert (tmp_path / "ball_single.ply").read_bytes() == before


def test_a_run_out_of_memory_is_one_line_and_status_3(capsys, scan, monkeypatch, tmp_path):
    def reconstruct(*given, **named):
        raise MemoryError("Unable to allocate 9 GiB")

    monkeypatch.setattr(cli, "reconstruct", reconstruct)
    status, out, err = run(capsys, "reconstruct", scan, "-o", tmp_path, "--json")
    assert status == 3
    assert err.startswith("error: out of memory (Unable to allocate 9 GiB); use a lower resolution")
    assert err.count("\n") == 1
    assert json.loads(out)["error"] in err


def test_a_scan_that_goes_meanwhile_is_named(capsys, scan, monkeypatch, tmp_path):
    def gone(*given):
        raise FileNotFoundError(2, "No such file or directory", str(scan))

    monkeypatch.setattr(cli, "_spare", gone)
    assert f"error: {scan}: No such file or directory" in refused(capsys, "reconstruct", scan, "-o", tmp_path)


def test_ctrl_c_while_modules_load_is_a_cancel(tmp_path):
    (tmp_path / "numpy.py").write_text("raise KeyboardInterrupt")
    done = subprocess.run(
        [sys.executable, "-m", "core", "info", "scan.ply"],
        cwd=ROOT, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: cancelled\n")


def test_a_real_process_from_scan_to_files(scan, tmp_path):
    command = [
        sys.executable,
        "-m",
        "core",
        "reconstruct",
        scan,
        "-o",
        str(tmp_path / "out"),
        "--resolution",
        "24",
        "--json",
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    for path in map(Path, report["files"]):
        assert path.stat().st_size > 0
    vertices = read_points(tmp_path / "out" / "ball_double.ply")
    assert np.abs(np.linalg.norm(vertices - [1000, 0, 0], axis=1) - 1).max() < 0.2


@pytest.mark.usefixtures("ctrl_c_heeded")
@pytest.mark.parametrize("number", [signal.SIGINT, *REQUESTS_TO_END])
def test_a_real_process_refuses_and_cancels(scan, tmp_path, number):
    command = [sys.executable, "-m", "core", "reconstruct", scan, "-o", str(tmp_path / "out")]
    done = subprocess.run([*command, "--resolution", "0"], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (2, "")
    assert "resolution is 0" in done.stderr
    assert done.stderr.count("\n") == 1

    running = subprocess.Popen([*command, "--resolution", "192"], cwd=ROOT, stderr=subprocess.PIPE, text=True)
    while running.poll() is None and not (tmp_path / "out").exists():  # made once the scan is read and the work begins
        time.sleep(0.02)
    time.sleep(0.2)
    running.send_signal(number)
    _, err = running.communicate(timeout=120)
    assert running.returncode == 130
    assert err.count("\n") == 1
    assert os.listdir(tmp_path / "out") == []


@pytest.mark.skipif(os.name != "posix", reason="Windows knows no such request")
def test_a_request_to_end_while_modules_are_loaded_cancels(scan):
    """`-X importtime` tells of each module when it is loaded; NumPy comes first of what takes its time."""
    command = [sys.executable, "-X", "importtime", "-m", "core", "info", scan]
    running = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)
    while line := running.stderr.readline():
        if "core.exit_status" in line:
            break
    time.sleep(0.1)
    running.send_signal(signal.SIGTERM)
    _, err = running.communicate(timeout=60)
    assert running.returncode == 130
    assert err.splitlines()[-1] == "error: cancelled"


@pytest.mark.parametrize("command", [["info"], ["reconstruct", "-o", "out"]])
def test_a_thread_may_run_it(scan, calls, capsys, command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status = []
    thread = threading.Thread(target=lambda: status.append(cli.main([*command, str(scan)])))
    thread.start()
    thread.join()
    assert status == [0]
    printed = capsys.readouterr().out
    assert "points" in printed or "samples" in printed


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_output_that_cannot_be_printed_is_one_line(scan):
    command = [sys.executable, "-m", "core", "info", scan]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == 2
    assert "standard output cannot be written to" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(os.name != "posix", reason="closes a file of the shell")
def test_no_standard_output_is_none_needed(scan):
    done = subprocess.run(
        f"{sys.executable} -m core info {scan} >&-", shell=True, cwd=ROOT, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(os.name != "posix", reason="closes a file of the shell")
def test_no_standard_error_is_none_needed(scan, tmp_path):
    command = f"{sys.executable} -m core reconstruct {scan} -o {tmp_path}/out --resolution 16 --json 2>&-"
    done = subprocess.run(command, shell=True, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert len(json.loads(done.stdout)["files"]) == 4
    done = subprocess.run(f"{command} --outliers=3", shell=True, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "--outliers" in json.loads(done.stdout)["error"]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have text alone for names")
def test_into_a_folder_whose_name_is_no_text_goes_all_but_the_volume(scan, tmp_path):
    folder = os.path.join(os.fsencode(tmp_path), b"o\xff")
    command = [os.fsencode(sys.executable), b"-m", b"core", b"reconstruct", scan.encode(), b"-o", folder]
    done = subprocess.run([*command, b"--resolution", b"16"], cwd=ROOT, capture_output=True, timeout=60)
    assert done.returncode == 0
    assert sorted(os.listdir(folder)) == [b"ball.json", b"ball_double.ply", b"ball_points.ply"]
    assert b"holds bytes that are no text" in done.stderr
