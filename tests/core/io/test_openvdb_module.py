import subprocess
import sys

import pytest

from core import MissingDependency
from core.io.openvdb_module import load_openvdb


@pytest.fixture
def fresh():
    load_openvdb.cache_clear()
    yield
    load_openvdb.cache_clear()


def test_an_installed_module_comes_first(fresh, monkeypatch):
    monkeypatch.setitem(sys.modules, "openvdb", pytest)
    assert load_openvdb() is pytest


def test_the_wheel_is_used_without_importing_bpy_or_touching_the_path():
    pytest.importorskip("bpy")
    script = (
        "import sys; path = list(sys.path); from core.io.openvdb_module import load_openvdb; grids = load_openvdb();"
        "assert sys.path == path and 'bpy' not in sys.modules; print(grids.FloatGrid().background)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "0.0\n"


def test_without_both_the_remedy_is_named(fresh, monkeypatch):
    monkeypatch.setitem(sys.modules, "openvdb", None)
    monkeypatch.setitem(sys.modules, "bpy", None)
    with pytest.raises(MissingDependency, match="pip install bpy"):
        load_openvdb()


def test_an_installed_module_that_does_not_load_says_why(fresh, monkeypatch, tmp_path):
    (tmp_path / "openvdb.py").write_text("import a_library_that_is_missing")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "openvdb", raising=False)
    with pytest.raises(MissingDependency, match="a_library_that_is_missing"):
        load_openvdb()


def test_a_module_that_does_not_load_says_why(fresh, monkeypatch, tmp_path):
    site = tmp_path / "bpy" / "5.0" / "python" / "lib" / "python3.11" / "site-packages"
    site.mkdir(parents=True)
    (site / "openvdb.py").write_text("raise ImportError('libtbb is missing')")
    (tmp_path / "bpy" / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "bpy", raising=False)
    monkeypatch.setitem(sys.modules, "openvdb", None)
    with pytest.raises(MissingDependency, match="libtbb is missing"):
        load_openvdb()
