import os

import numpy as np
import pytest

from core import InputError
from core.io.points import READERS, read_points


def refusal(path):
    """The message, which has to be one line that names the file."""
    with pytest.raises(InputError) as caught:
        read_points(path)
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    return message


def test_missing_file_folder_and_pipe(tmp_path):
    assert "No such file" in refusal(tmp_path / "none.ply")
    (tmp_path / "folder.ply").mkdir()
    assert "is not a file" in refusal(tmp_path / "folder.ply")
    os.mkfifo(tmp_path / "pipe.xyz")
    assert "is not a file" in refusal(tmp_path / "pipe.xyz")


@pytest.mark.parametrize("name", ["scan.las", "scan", "scan.ply.gz"])
def test_unknown_extension_names_the_known_ones(tmp_path, name):
    (tmp_path / name).write_text("0 0 0\n")
    message = refusal(tmp_path / name)
    assert all(extension in message for extension in READERS)


@pytest.mark.parametrize("extension", READERS)
def test_empty_file(tmp_path, extension):
    (tmp_path / f"scan{extension}").touch()
    assert "is empty" in refusal(tmp_path / f"scan{extension}")


@pytest.mark.parametrize("extension", READERS)
def test_binary_junk(tmp_path, extension):
    path = tmp_path / f"scan{extension}"
    rng = np.random.default_rng(0)
    for _ in range(20):
        path.write_bytes(rng.bytes(2000))
        refusal(path)


@pytest.mark.parametrize("extension", READERS)
def test_permission_denied(tmp_path, extension, monkeypatch):
    path = tmp_path / f"scan{extension}"
    path.write_text("0 0 0\n")

    def denied(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setitem(READERS, extension, denied)
    assert "Permission denied" in refusal(path)


def test_extension_in_capitals(tmp_path):
    (tmp_path / "SCAN.XYZ").write_text("1 2 3\n")
    assert read_points(tmp_path / "SCAN.XYZ").tolist() == [[1, 2, 3]]


def test_result_is_contiguous_float64(tmp_path):
    np.save(tmp_path / "scan.npy", np.ones((5, 7), np.float32, order="F"))
    points = read_points(tmp_path / "scan.npy")
    assert points.dtype == np.float64
    assert points.shape == (5, 3)
    assert points.flags.c_contiguous
