import os
import resource

import numpy as np
import pytest

from core import BandedField, DistanceField, InputError, MissingDependency, VADError
from core.field.blocks import blocks_of, table_shape
from core.field.feet import Feet
from core.io.openvdb_module import load_openvdb
from core.io.vdb import write_vdb

ORIGIN, SPACING = np.array([4_500_000.5, -2.25, 0.125]), 0.03125
SHAPE = (20, 24, 28)


@pytest.fixture(scope="module")
def openvdb():
    try:
        return load_openvdb()
    except MissingDependency as error:
        pytest.skip(str(error))


def plane(band=np.inf):
    """Distance to the tilted plane through the middle of the box; the gradient is constant on either side."""
    cells = np.stack(np.meshgrid(*map(np.arange, SHAPE), indexing="ij"), axis=-1) - np.array(SHAPE) / 2
    distance = np.abs(cells @ [0.6, 0.0, 0.8]) * SPACING
    return DistanceField(np.minimum(distance, band).astype(np.float32), ORIGIN, SPACING, band)


def values(grid, kind=np.float32, width=()):
    array = np.empty(SHAPE + width, kind)
    grid.copyToArray(array)
    return array


@pytest.mark.parametrize("band", [np.inf, 3 * SPACING, 0.1])
def test_udf_comes_back_exactly_in_its_place(openvdb, tmp_path, band):
    field = plane(band)
    write_vdb(tmp_path / "field.vdb", field)
    grids, _ = openvdb.readAll(str(tmp_path / "field.vdb"))
    density, udf = sorted(grids, key=lambda grid: grid.name)
    assert (density.name, udf.name) == ("density", "udf")
    np.testing.assert_array_equal(values(udf), field.values)
    assert udf.background == (field.values.max() if np.isinf(band) else np.float32(band))
    assert not udf.saveFloatAsHalf
    for node in [(0, 0, 0), (19, 5, 7)]:
        np.testing.assert_allclose(udf.transform.indexToWorld(node), ORIGIN + SPACING * np.array(node), rtol=1e-15)
        np.testing.assert_allclose(density.transform.indexToWorld(node), udf.transform.indexToWorld(node))


def test_cells_too_small_for_openvdb_are_refused(openvdb, tmp_path):
    values = np.ones((4, 4, 4), np.float32)
    write_vdb(tmp_path / "field.vdb", DistanceField(values, np.zeros(3), 1.5e-5))
    with pytest.raises(
        InputError, match=r"cells are 1.4e-05 wide, .* smaller than 1.5e-05; give the points in smaller"
    ):
        write_vdb(tmp_path / "other.vdb", DistanceField(values, np.zeros(3), 1.4e-5))
    assert not (tmp_path / "other.vdb").exists()


def test_signed_distances_are_a_level_set_named_sdf(openvdb, tmp_path):
    cells = np.indices(SHAPE)[0] - 9.5
    field = DistanceField((cells * SPACING).astype(np.float32), ORIGIN, SPACING, sdf=True)
    write_vdb(tmp_path / "field.vdb", field)
    grids, _ = openvdb.readAll(str(tmp_path / "field.vdb"))
    density, sdf = sorted(grids, key=lambda grid: grid.name)
    assert (density.name, sdf.name) == ("density", "sdf")
    assert sdf.gridClass == openvdb.GridClass.LEVEL_SET
    np.testing.assert_array_equal(values(sdf), field.values)
    np.testing.assert_allclose(values(density), np.clip(1 - np.abs(cells) / 2, 0, 1), atol=1e-6)


def test_a_band_is_stored_sparse_and_a_dense_field_is_not(openvdb, tmp_path):
    counts = []
    for band in (2 * SPACING, np.inf):
        write_vdb(tmp_path / "field.vdb", plane(band))
        counts.append(openvdb.read(str(tmp_path / "field.vdb"), "udf").activeVoxelCount())
    assert counts[0] < np.prod(SHAPE) / 2 < 0.99 * np.prod(SHAPE) < counts[1]


def test_density_is_visible_fog_around_the_surface(openvdb, tmp_path):
    field = plane()
    write_vdb(tmp_path / "field.vdb", field)
    density = openvdb.read(str(tmp_path / "field.vdb"), "density")
    assert density.background == 0
    assert density.gridClass == openvdb.GridClass.FOG_VOLUME
    fog = values(density)
    np.testing.assert_allclose(fog, np.clip(1 - field.values / (2 * SPACING), 0, 1), atol=1e-6)
    assert fog[field.values == 0].min() == 1
    assert not fog[field.values > 2 * SPACING].any()


def test_gradient_points_away_from_the_plane(openvdb, tmp_path):
    field = plane()
    write_vdb(tmp_path / "field.vdb", field, gradient=True)
    slopes = values(openvdb.read(str(tmp_path / "field.vdb"), "gradient"), width=(3,))
    away = field.values > 1.5 * SPACING
    cells = np.stack(np.meshgrid(*map(np.arange, SHAPE), indexing="ij"), axis=-1) - np.array(SHAPE) / 2
    side = np.sign(cells @ [0.6, 0.0, 0.8])[..., None] * [0.6, 0.0, 0.8]
    np.testing.assert_allclose(slopes[away], side[away], atol=1e-4)


def test_a_full_disk_is_noticed(openvdb, tmp_path):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    (tmp_path / "field.vdb").write_text("old")
    write_vdb(tmp_path / "whole.vdb", plane())
    size = (tmp_path / "whole.vdb").stat().st_size
    (tmp_path / "whole.vdb").unlink()
    for room in (0, 40, 500, size // 2, size - 1):
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, limits[1]))
        try:
            with pytest.raises(VADError, match=r"field\.vdb cannot be written whole"):
                write_vdb(tmp_path / "field.vdb", plane())
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert os.listdir(tmp_path) == ["field.vdb"]
    assert (tmp_path / "field.vdb").read_text() == "old"


def test_a_missing_folder(openvdb, tmp_path):
    with pytest.raises(VADError, match="cannot be written"):
        write_vdb(tmp_path / "missing" / "field.vdb", plane())


NO_FEET = Feet(np.empty((3, 0), np.float32), np.empty((3, 0), np.float32), np.empty(0, np.float32))


def shell(radius, sdf):
    """Distance to a sphere of `radius` cells around the middle of a box of 40^3 nodes, in a band of 3 cells."""
    shape, limit = (40, 40, 40), np.float32(3 * SPACING)
    distance = SPACING * (np.linalg.norm(np.indices(shape) - 19.6, axis=0) - radius)
    signed = np.clip(distance if sdf else np.abs(distance), -limit, limit).astype(np.float32)
    blocks = blocks_of(shape, np.arange(np.prod(table_shape(shape))), limit)
    blocks.put(np.arange(signed.size), signed.reshape(-1))
    return BandedField(blocks.merged(), ORIGIN, SPACING, 3 * SPACING, sdf, NO_FEET), signed


@pytest.mark.parametrize("sdf", [False, True])
def test_a_band_is_written_sparsely_and_comes_back_whole(openvdb, tmp_path, sdf):
    """Inside the sphere there are constant blocks, of negative distances where signed."""
    field, expected = shell(16.0, sdf)
    assert len(field.blocks.stored) < 125
    write_vdb(tmp_path / "field.vdb", field, gradient=True)
    grids, _ = openvdb.readAll(str(tmp_path / "field.vdb"))
    density, gradient, distance = sorted(grids, key=lambda grid: grid.name)
    found, fog = np.empty((2, 40, 40, 40), np.float32)
    slopes = np.empty((40, 40, 40, 3))
    distance.copyToArray(found)
    density.copyToArray(fog)
    gradient.copyToArray(slopes)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_allclose(fog, np.clip(1 - np.abs(expected) / (2 * SPACING), 0, 1), atol=1e-6)
    assert distance.background == np.float32(3 * SPACING)
    assert distance.leafCount() == len(field.blocks.stored)
    assert fog.astype(bool).sum() == density.activeVoxelCount() < found.size / 4
    known = np.abs(expected) < 1.9 * SPACING
    known &= (np.abs(expected) > 1.1 * SPACING) | sdf
    length = np.linalg.norm(slopes, axis=3)
    np.testing.assert_allclose(length[known], 1, atol=0.02)
    assert not length[np.abs(expected) >= 3 * SPACING].any()
