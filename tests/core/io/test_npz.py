import gc
import os
import resource

import numpy as np
import pytest

from core import Settings, VADError, reconstruct
from core.io.npz import write_arrays
from tests import shapes


@pytest.fixture(scope="module")
def result():
    return reconstruct(shapes.sphere(400) * 3 + [10, 0, 0], Settings(resolution=24, surface="none"))


@pytest.fixture(scope="module")
def arrays(result, tmp_path_factory):
    path = tmp_path_factory.mktemp("arrays") / "ball.npz"
    write_arrays(path, result)
    with np.load(path, allow_pickle=False) as archive:
        return dict(archive)


def test_the_field_comes_back_exactly(arrays, result):
    np.testing.assert_array_equal(arrays["values"], result.field.values)
    np.testing.assert_array_equal(arrays["origin"], result.field.origin)
    assert arrays["spacing"] == result.field.spacing
    assert not arrays["signed"]


def test_shapes_and_types_are_those_of_the_docstring(arrays, result):
    near = len(arrays["node"])
    assert {name: (array.dtype.name, array.shape) for name, array in arrays.items()} == {
        "values": ("float32", result.field.values.shape),
        "origin": ("float64", (3,)),
        "spacing": ("float64", ()),
        "signed": ("bool", ()),
        "gradient": ("float32", (*result.field.values.shape, 3)),
        "node": ("int32", (near, 3)),
        "direction": ("float32", (near, 3)),
        "foot": ("float64", (near, 3)),
    }
    assert near == pytest.approx((result.field.values <= 2 * result.field.spacing).sum(), rel=0.01)


def test_gradient_is_that_of_the_distance(arrays):
    at = arrays["origin"] + arrays["spacing"] * np.moveaxis(np.indices(arrays["values"].shape), 0, -1) - [10, 0, 0]
    away = np.linalg.norm(at, axis=-1)
    outside = (away > 3 + 1.5 * arrays["spacing"]) & (at.max(axis=-1) < 3)
    np.testing.assert_allclose(arrays["gradient"][outside], (at / away[..., None])[outside], atol=0.15)


def test_direction_leads_from_foot_to_node_and_foot_lies_on_the_surface(arrays):
    at = arrays["origin"] + arrays["spacing"] * arrays["node"]
    distance = arrays["values"][tuple(arrays["node"].T)]
    np.testing.assert_allclose(arrays["foot"] + distance[:, None] * arrays["direction"], at, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(arrays["foot"] - [10, 0, 0], axis=1), 3, atol=0.02)
    lengths = np.linalg.norm(arrays["direction"], axis=1)
    np.testing.assert_allclose(lengths[distance > 0], 1, atol=1e-6)


def test_a_missing_folder(result, tmp_path):
    with pytest.raises(VADError, match="cannot be written"):
        write_arrays(tmp_path / "missing" / "ball.npz", result)


@pytest.mark.filterwarnings("error")
def test_a_full_disk_leaves_the_old_file_and_no_archive_open(result, tmp_path):
    (tmp_path / "ball.npz").write_text("old")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, limits[1]))
    try:
        with pytest.raises(VADError, match=r"ball\.npz cannot be written \(File too large\)"):
            write_arrays(tmp_path / "ball.npz", result)
        gc.collect()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert os.listdir(tmp_path) == ["ball.npz"]
    assert (tmp_path / "ball.npz").read_text() == "old"


def test_a_band_is_written_in_blocks(tmp_path):
    run = reconstruct(shapes.sphere(500), Settings(resolution=32, band=3, surface="none"))
    write_arrays(tmp_path / "field.npz", run)
    with np.load(tmp_path / "field.npz", allow_pickle=False) as file:
        arrays = dict(file)
    assert arrays["shape"].tolist() == list(run.field.shape)
    assert arrays["band"] == run.field.band
    whole = np.full([8 * -(-n // 8) for n in run.field.shape], np.float32(run.field.band))
    for (i, j, k), values in zip(arrays["block"], arrays["values"], strict=True):
        whole[i : i + 8, j : j + 8, k : k + 8] = values
    np.testing.assert_array_equal(whole[tuple(map(slice, run.field.shape))], run.field.values)
    known = arrays["gradient"].any(axis=-1) & (arrays["values"] > 1.5 * run.field.spacing)
    np.testing.assert_allclose(np.linalg.norm(arrays["gradient"][known], axis=-1), 1, atol=0.1)
    assert known.sum() > 100
    assert np.abs(shapes.sphere_distance(arrays["foot"])).max() < 0.1 * run.field.spacing


def test_signed_distances_are_said_to_be_so(tmp_path):
    result = reconstruct(shapes.sphere(400), Settings(resolution=24, surface="signed"))
    write_arrays(tmp_path / "ball.npz", result)
    with np.load(tmp_path / "ball.npz") as arrays:
        assert arrays["signed"]
        assert arrays["values"].min() < -0.9
