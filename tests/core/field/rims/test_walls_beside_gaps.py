import numpy as np
import pytest

from core.field.rims.walls_beside_gaps import walled
from core.neighbourhoods.cloud import Cloud
from tests.core.field.rims.test_sampling_gaps import UP, before_and_after, rims_of

SLOT = 0.08  # its width, 2 local spacings


def slotted_plate(random, walls):
    """A plate with a slot along y and its walls: "down" on both sides, or a sheet that
    "crosses" the gap, or none. Points and normals, (n,3) each, and how many are of the plate."""
    plate = np.pad(random.uniform(-1, 1, (2500, 2)), ((0, 0), (0, 1)))
    plate[:, 0] += np.sign(plate[:, 0]) * SLOT / 2
    y, z = random.uniform(-1, 1, (2, 2500))
    depth = np.minimum(z, -z) - 0.05 if walls == "down" else z
    x = {"down": np.sign(random.uniform(-1, 1, len(y))) * SLOT / 2, "crosses": 0 * y, None: y[:0]}[walls]
    wall = np.stack([x, y[: len(x)], depth[: len(x)]], axis=1)
    normals = np.concatenate([np.tile(UP, (len(plate), 1)), np.tile(np.eye(3)[0], (len(wall), 1))])
    return np.concatenate([plate, wall]), normals, len(plate)


def test_the_walls_of_a_slot_keep_it_open(random):
    """Beside walls most samples have no gap, as the walls, unfolded, fill it; those that do have one do not bridge it,
    but for a few that stand too far from them."""
    points, normals, plate = slotted_plate(random, "down")
    x, y, _ = points[:plate].T

    def bridging(count):
        rims = rims_of(points[:count], normals[:count])[0]
        across = rims.bridged[:plate] & (np.abs(x) < SLOT) & (np.abs(y) < 0.9) & (x * rims.outward[:plate, 0] < 0)
        return across.sum()

    assert bridging(plate) > 15
    assert bridging(len(points)) < 4


def test_gaps_as_wide_as_chance_leaves_them_are_not_bridged_across_drilled_holes(random):
    radius = 0.075
    middles = np.stack(np.meshgrid([-0.6, 0, 0.6], [-0.6, 0, 0.6]), axis=-1).reshape(-1, 1, 2)
    flat = random.uniform(-1, 1, (6000, 2))
    plate = np.pad(flat[(np.linalg.norm(flat - middles, axis=2) > radius).all(axis=0)], ((0, 0), (0, 1)))
    turn, down = random.uniform(0, [[[2 * np.pi]], [[1]]], (2, 9, 300))
    round_ = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
    wall = radius * round_ + np.concatenate([np.broadcast_to(middles, (9, 300, 2)), -down[..., None]], axis=2)
    points = np.concatenate([plate, wall.reshape(-1, 3)])
    normals = np.concatenate([np.tile(UP, (len(plate), 1)), round_.reshape(-1, 3)])
    after = before_and_after(points, normals)[1]
    step = plate[:, :2] - middles
    nearest = np.linalg.norm(step, axis=2).argmin(axis=0)
    step = step[nearest, np.arange(len(plate))]
    beside = np.linalg.norm(step, axis=1) < radius + 0.03
    inwards = np.einsum("ni,ni->n", step, after.outward[: len(plate), :2]) < -0.7 * np.linalg.norm(step, axis=1)
    assert (beside & inwards).sum() > 100
    assert (after.bridged[: len(plate)] & beside & inwards).sum() < 6


@pytest.mark.parametrize(("walls", "least", "most"), [("down", 0.8, 1.0), ("crosses", 0.0, 0.4), (None, 0.0, 0.0)])
def test_walls_count_beside_either_sample_and_sheets_that_cross_are_none(walls, least, most, random):
    points, normals, _ = slotted_plate(random, walls)
    _, cloud = rims_of(points, normals)
    left, right = (cloud.tree.query([[side * 0.06, y, 0] for y in np.linspace(-0.9, 0.9, 41)])[1] for side in (-1, 1))
    found = walled(left, right, cloud)
    assert least <= found.mean() <= most
    np.testing.assert_array_equal(found, walled(right, left, cloud))


@pytest.mark.parametrize(("place", "found"), [(-0.3, False), (0.5, True), (1.5, True), (2.3, False)])
def test_a_wall_counts_between_two_samples_and_not_beyond_them(place, found):
    points, normals = np.array([[0.0, 0, 0], [2, 0, 0], [place, 0, -0.5]]), np.eye(3)[[2, 2, 0]]
    assert walled(np.array([0]), np.array([1]), Cloud.of(points, normals, np.ones(3))) == found
