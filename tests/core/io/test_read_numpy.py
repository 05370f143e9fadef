import io
import zipfile
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from core import InputError
from core.io import read_numpy
from core.io.points import read_points

real_types = st.sampled_from(["<f8", ">f8", "<f4", ">f4", "<f2", "<i2", ">i8", "u1"])
tables = real_types.flatmap(lambda kind: arrays(kind, st.tuples(st.integers(1, 6), st.integers(3, 5))))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("numpy")


def refusal(path):
    with pytest.raises(InputError) as caught:
        read_points(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    return str(caught.value)


def npy(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def header_only(shape, rows=b""):
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, dict(descr="<f8", fortran_order=False, shape=shape))
    return stream.getvalue() + rows


@settings(deadline=None)
@given(tables, st.booleans(), st.booleans())
def test_round_trip(folder, table, fortran, compressed):
    table = np.asarray(table, order="F" if fortran else "C")
    expected = table[:, :3].astype(np.float64)
    np.save(folder / "scan.npy", table)
    np.testing.assert_array_equal(read_points(folder / "scan.npy"), expected)
    save = np.savez_compressed if compressed else np.savez
    save(folder / "scan.npz", other=np.zeros((9, 3)), points=table)
    np.testing.assert_array_equal(read_points(folder / "scan.npz"), expected)


def test_the_only_triples_of_a_npz_are_taken(folder):
    np.savez(folder / "scan.npz", xyz=np.eye(3), colour=np.zeros((3, 4)), name=np.array("a"))
    np.testing.assert_array_equal(read_points(folder / "scan.npz"), np.eye(3))


def test_a_npz_without_a_clear_choice_names_what_it_holds(folder):
    np.savez(folder / "two.npz", before=np.eye(3), after=np.eye(3))
    assert "before (3, 3), after (3, 3)" in refusal(folder / "two.npz")
    np.savez(folder / "none.npz", flat=np.zeros(9))
    assert "flat (9,)" in refusal(folder / "none.npz")
    np.savez(folder / "empty.npz")
    assert "no array" in refusal(folder / "empty.npz")


def test_pickles_are_never_loaded(folder):
    class Trap:
        def __reduce__(self):
            return open, (str(folder / "sprung"), "w")

    trap = np.array([[Trap()] * 3], dtype=object)
    np.save(folder / "scan.npy", trap)
    assert "pickled" in refusal(folder / "scan.npy")
    np.savez(folder / "scan.npz", points=trap)
    assert "pickled" in refusal(folder / "scan.npz")
    assert not (folder / "sprung").exists()


@pytest.mark.parametrize(
    "array", [np.zeros(6), np.zeros((4, 2)), np.zeros((2, 2, 3)), np.zeros((4, 3), complex), np.array([["a"] * 3])]
)
def test_wrong_shape_or_type_is_named(folder, array):
    np.save(folder / "scan.npy", array)
    assert f"shape {array.shape} and type {array.dtype}" in refusal(folder / "scan.npy")


@pytest.mark.parametrize("shape", [(10**6, 3), (10**17, 3), (10**30, 3), (2**61, 8), (-1, 3)])
def test_a_lying_header_is_refused_before_allocation(folder, shape):
    (folder / "scan.npy").write_bytes(header_only(shape, bytes(240)))
    refusal(folder / "scan.npy")
    with zipfile.ZipFile(folder / "scan.npz", "w") as archive:
        archive.writestr("points.npy", header_only(shape, bytes(240)))
    refusal(folder / "scan.npz")


def test_truncation_anywhere_is_refused(folder):
    whole = npy(np.random.default_rng(0).normal(size=(20, 3)))
    for length in range(1, len(whole), 7):
        (folder / "scan.npy").write_bytes(whole[:length])
        refusal(folder / "scan.npy")
    np.savez_compressed(folder / "whole.npz", points=np.random.default_rng(0).normal(size=(20, 3)))
    whole = (folder / "whole.npz").read_bytes()
    for length in range(1, len(whole), 7):
        (folder / "scan.npz").write_bytes(whole[:length])
        refusal(folder / "scan.npz")


def test_damage_anywhere_is_refused_or_harmless(folder):
    """A flipped byte either changes a number or is refused; nothing else comes out."""
    rng = np.random.default_rng(0)
    for name, save in (("scan.npy", np.save), ("scan.npz", np.savez_compressed)):
        save(folder / name, rng.normal(size=(20, 3)))
        whole = (folder / name).read_bytes()
        for place in range(len(whole)):
            damaged = bytearray(whole)
            damaged[place] ^= rng.integers(1, 256)
            (folder / name).write_bytes(damaged)
            with suppress(InputError):
                assert read_points(folder / name).shape[1] == 3


@pytest.mark.parametrize("way", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_damage_in_other_compressions_is_refused_or_harmless(folder, way):
    with zipfile.ZipFile(folder / "whole.npz", "w", way) as archive:
        archive.writestr("points.npy", npy(np.random.default_rng(0).normal(size=(20, 3))))
    whole = (folder / "whole.npz").read_bytes()
    for place in range(30, 200):
        damaged = bytearray(whole)
        damaged[place] ^= 0xFF
        (folder / "scan.npz").write_bytes(damaged)
        with suppress(InputError):
            assert read_points(folder / "scan.npz").shape == (20, 3)


def test_no_rows(folder):
    np.save(folder / "scan.npy", np.zeros((0, 3)))
    assert "holds no points" in refusal(folder / "scan.npy")


def test_a_zip_bomb_is_refused_by_its_stated_limit(folder, monkeypatch):
    monkeypatch.setattr(read_numpy, "MAX_UNPACKED", 10**6)
    np.savez_compressed(folder / "scan.npz", points=np.zeros((10**5, 3)))
    assert (folder / "scan.npz").stat().st_size < 10**4
    assert "at most 1000000 are read" in refusal(folder / "scan.npz")
