"""Other programs go by the ending of a name."""

import os

import pytest

from core import InputError, Settings, reconstruct
from core.io.atomic import writable_folder
from core.io.npz import write_arrays
from core.io.paths import ending_in
from core.io.ply import write_mesh, write_points
from core.io.points import read_points
from core.io.report import write_report
from core.io.vdb import write_vdb
from tests import shapes


@pytest.fixture(scope="module")
def result():
    return reconstruct(shapes.sphere(200), Settings(resolution=16))


WRITERS = {
    ".ply of a mesh": lambda path, result: write_mesh(path, result.surface),
    ".ply of points": lambda path, result: write_points(path, result.points, result.normals),
    ".vdb": lambda path, result: write_vdb(path, result.field),
    ".npz": lambda path, result: write_arrays(path, result),
}


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("name", ["scan.obj", "scan", "scan{}.gz"])
def test_a_name_that_says_something_else_is_refused_with_one_that_fits(tmp_path, result, kind, name):
    """A mesh written as scan.obj was a PLY file that no program opens."""
    name = name.format(kind.split()[0])
    with pytest.raises(InputError, match=f"name it scan{kind.split()[0]}$"):
        WRITERS[kind](tmp_path / name, result)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("kind", WRITERS)
def test_upper_case_is_taken(tmp_path, result, kind):
    name = f"SCAN{kind.split()[0].upper()}"
    WRITERS[kind](tmp_path / name, result)
    assert os.listdir(tmp_path) == [name]


@pytest.mark.parametrize("path", [5, None, b"scan.ply", "sc\0an.ply", "sc\ud800an.ply"])
def test_what_is_no_path_is_refused(result, path):
    uses = [*WRITERS.values(), lambda path, _: read_points(path), lambda path, _: writable_folder(path)]
    for use in [*uses, lambda path, result: write_report(path, result.report)]:
        with pytest.raises(InputError, match="is not the path of a file"):
            use(path, result)


def test_text_is_taken_for_a_path():
    assert str(ending_in(".ply", "a.b/scan.PLY")) == os.path.join("a.b", "scan.PLY")
