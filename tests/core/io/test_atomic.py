import os
import resource
from pathlib import Path

import pytest

from core import VADError
from core.io.atomic import atomic_path, together, writable_folder


def test_a_finished_file_replaces_the_old_one(tmp_path):
    target = tmp_path / "file.txt"
    target.write_text("old")
    with atomic_path(target) as temporary:
        temporary.write_text("new")
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert os.listdir(tmp_path) == ["file.txt"]


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt, VADError])
def test_a_failure_midway_leaves_the_old_file_and_nothing_else(tmp_path, failure):
    target = tmp_path / "file.txt"
    target.write_text("old")

    def broken():
        with atomic_path(target) as temporary:
            temporary.write_text("half")
            raise failure

    with pytest.raises(failure):
        broken()
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["file.txt"]


def write_both(folder, text, failure=None):
    with together():
        for name in ("file.txt", "report.txt"):
            with atomic_path(folder / name) as temporary:
                temporary.write_text(text)
        if failure:
            raise failure


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt, VADError])
def test_files_written_together_take_their_places_at_the_end_or_not_at_all(tmp_path, failure):
    with pytest.raises(failure):
        write_both(tmp_path, "old", failure)
    assert os.listdir(tmp_path) == []
    write_both(tmp_path, "old")
    with pytest.raises(failure):
        write_both(tmp_path, "new", failure)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"file.txt": "old", "report.txt": "old"}
    write_both(tmp_path, "new")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"file.txt": "new", "report.txt": "new"}


def test_what_tells_of_the_others_goes_before_they_do(tmp_path, monkeypatch):
    write_both(tmp_path, "old")
    moved, replace = [], os.replace
    monkeypatch.setattr(os, "replace", lambda one, other: moved.append(Path(one).name) or replace(one, other))
    write_both(tmp_path, "new")
    assert [name for name in moved if not name.startswith(".")] == ["report.txt", "file.txt"]


@pytest.mark.parametrize(("taken", "other"), [("file.txt", "report.txt"), ("report.txt", "file.txt")])
@pytest.mark.parametrize("there", [True, False])
def test_where_one_cannot_take_its_place_all_stay_as_they_were(tmp_path, taken, other, there):
    (tmp_path / taken / "of_others").mkdir(parents=True)
    if there:
        (tmp_path / other).write_text("old")
    with pytest.raises(VADError, match=f"{taken} cannot be written"):
        write_both(tmp_path, "new")
    assert sorted(os.listdir(tmp_path)) == sorted([taken, other] if there else [taken])
    assert not there or (tmp_path / other).read_text() == "old"
    assert (tmp_path / taken / "of_others").is_dir()


def test_a_full_disk_is_one_line_that_names_the_file(tmp_path):
    target = tmp_path / "file.bin"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with (
            pytest.raises(VADError, match=r"file\.bin cannot be written \(File too large\)"),
            atomic_path(target) as temporary,
        ):
            temporary.write_bytes(bytes(2000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert os.listdir(tmp_path) == []


def test_files_get_the_usual_permissions(tmp_path):
    with atomic_path(tmp_path / "file.txt") as temporary:
        temporary.write_text("")
    (tmp_path / "plain.txt").write_text("")
    assert (tmp_path / "file.txt").stat().st_mode == (tmp_path / "plain.txt").stat().st_mode


@pytest.mark.parametrize("name", ["missing/file.txt", "plain/file.txt", "folder"])
def test_an_impossible_target_is_refused(tmp_path, name):
    (tmp_path / "plain").write_text("")
    (tmp_path / "folder").mkdir()
    with pytest.raises(VADError, match="cannot be written"), atomic_path(tmp_path / name) as temporary:
        temporary.write_text("")
    assert sorted(os.listdir(tmp_path)) == ["folder", "plain"]


@pytest.mark.parametrize("path", ["", ".", os.sep])
def test_a_path_without_a_name_is_refused(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(VADError, match="is a folder; give the path of a file"), atomic_path(path):
        pass
    assert not os.listdir(tmp_path)


def test_writable_folder_makes_parents_and_leaves_no_trace(tmp_path):
    assert os.listdir(writable_folder(tmp_path / "a" / "b")) == []
    assert os.listdir(writable_folder(tmp_path / "a" / "b")) == []


def test_writable_folder_refuses_a_file_and_a_denied_folder(tmp_path, monkeypatch):
    (tmp_path / "plain").write_text("")
    with pytest.raises(VADError, match="plain"):
        writable_folder(tmp_path / "plain")

    def denied(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("core.io.atomic.tempfile.TemporaryFile", denied)
    with pytest.raises(VADError, match="Permission denied"):
        writable_folder(tmp_path)
