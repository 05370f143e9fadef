import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from core import Settings, reconstruct
from core.cleaning.clean import clean
from core.cleaning.noise import looks_noisy, noisy_samples
from core.cleaning.noise_level import estimate_noise
from core.cleaning.positions import denoise
from core.cleaning.voxels import find_voxels
from core.points import local_spacing, prepare_samples
from tests import shapes


def occupied(points, side):
    """Centres of the voxels that points are in."""
    return (np.unique(np.floor(points / side), axis=0) + 0.5) * side


def segmented(inside, side, size=1.2):
    """Centres of the voxels of a volume that have another outside beside one of their faces."""
    axes = [np.arange(-size, size, step) for step in np.broadcast_to(side, 3)]
    x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    volume = inside(x)
    return x[volume & ~binary_erosion(volume)]


def ball(x):
    return np.linalg.norm(x, axis=-1) < 1


def box_surface(n):
    grid = np.stack(np.meshgrid(*[np.arange(float(n))] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid[((grid == 0) | (grid == n - 1)).any(axis=1)]


def heights(step, steep=1.0):
    x, y = np.meshgrid(np.arange(70.0), np.arange(70.0), indexing="ij")
    z = steep * 8 * np.sin(x / 11) * np.cos(y / 14)
    return np.stack([x, y, np.rint(z / step) * step], axis=-1).reshape(-1, 3), z.ravel()


VOXELS = {
    "ball": (segmented(ball, 0.06), 0.06),
    "slices": (segmented(ball, (0.05, 0.05, 0.12)), 0.12),
    "torus": (occupied(shapes.torus(60000), 0.08), 0.08),
    "half of them": (occupied(shapes.torus(60000), 0.05)[::2], 0.05),
    "box": (box_surface(12), 1.0),
    "heights": (heights(0.3)[0], 0.3),
}


@pytest.mark.parametrize("name", VOXELS)
def test_the_side_is_found_in_any_turn(name):
    points, side = VOXELS[name]
    for turn in (np.eye(3), shapes.random_rotation(1)):
        assert find_voxels((points + 5.0) @ turn.T).side == pytest.approx(side, rel=1e-9)
        assert find_voxels((points @ turn.T).astype(np.float32).astype(float)).side == pytest.approx(side, rel=1e-4)


def test_strays_among_them_do_not_matter(random):
    points, side = VOXELS["torus"]
    strays = random.uniform(-1.4, 1.4, size=(len(points) // 50, 3))
    assert find_voxels(np.vstack([strays, points])).side == pytest.approx(side, rel=1e-6)


def around_prism(corners):
    """Vertices of a prism of many rings."""
    turn = 2 * np.pi * np.arange(corners) / corners
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    return (ring + [[[0, 0, 0.1 * z]] for z in range(40)]).reshape(-1, 3)


@pytest.mark.parametrize(
    "points",
    [
        shapes.scattered_sphere(3000),
        shapes.sphere(3000),
        around_prism(16),
        0.01 * np.rint(shapes.torus(5000) / 0.01),
        heights(0.02)[0],
        np.pad(np.indices((40, 40)).reshape(2, -1).T.astype(float), ((0, 0), (0, 1))),
    ],
    ids=["random", "spiral", "prism", "rounded finely", "fine heights", "flat grid"],
)
def test_others_are_none(points):
    assert find_voxels(points) is None


def test_stairs_are_where_terraces_end():
    ball, box = VOXELS["ball"][0], VOXELS["box"][0]
    assert find_voxels(ball).stairs(np.arange(len(ball))).mean() > 0.6
    assert not find_voxels(box).stairs(np.arange(len(box))).any()
    stair = np.array([[x, y, z] for x, z in ((0, 0), (1, 0), (2, 0), (3, 1), (4, 1), (5, 1)) for y in range(20)], float)
    found = find_voxels(stair).stairs(np.arange(len(stair)))
    np.testing.assert_array_equal(np.unique(stair[found, 0]), [2, 3])


@pytest.mark.parametrize(("name", "share"), [("ball", 1), ("torus", 1), ("half of them", 1), ("slices", 0.9)])
def test_voxels_of_curved_surfaces_are_noisy(name, share):
    """But for the middles of the largest terraces, of slices far apart."""
    points = VOXELS[name][0] @ shapes.random_rotation(2).T
    spacing = local_spacing(points)
    assert looks_noisy(points, spacing)
    assert noisy_samples(points, spacing, voxels=find_voxels(points)).mean() >= share


def test_a_box_of_voxels_stays():
    points = VOXELS["box"][0]
    assert denoise(points, local_spacing(points))[0] is points


def test_only_what_is_around_stairs_is_moved():
    """A house with a pitched roof, whose walls lie along the voxels."""
    side = 0.04

    def house(x):
        return (np.abs(x) < [0.9, 0.7, 1.0]).all(axis=-1) & (x[..., 2] < 0.8 - 0.45 * np.abs(x[..., 1]))

    points = segmented(house, side)
    moved, done = denoise(points, local_spacing(points))
    still = (moved == points).all(axis=1)
    assert still[points[:, 2] < -0.2].all()
    roof = (points[:, 2] > 0.55 - 0.45 * np.abs(points[:, 1])) & (np.abs(points[:, 0]) < 0.6)
    roof &= (np.abs(points[:, 1]) > 0.2) & (np.abs(points[:, 1]) < 0.5)
    assert not still[roof].any()
    assert done["voxel"] == pytest.approx(side)
    off = (points[roof, 2] + 0.45 * np.abs(points[roof, 1])).std()
    assert (moved[roof, 2] + 0.45 * np.abs(moved[roof, 1])).std() < 0.35 * off


@pytest.mark.parametrize(("name", "left"), [("ball", 0.25), ("slices", 0.6)])
def test_terraces_are_levelled(name, left):
    points, side = VOXELS[name]
    before, after = (np.linalg.norm(x, axis=1) for x in (points, denoise(points, local_spacing(points))[0]))
    assert after.std() < left * before.std()
    assert after.mean() == pytest.approx(before.mean(), abs=0.15 * side)


@pytest.mark.parametrize(("step", "steep"), [(1.0, 1.0), (0.5, 1.0), (1.0, 3.0)])
def test_heights_are_taken_off_their_steps(step, steep):
    points, z = heights(step, steep)
    moved = denoise(points, local_spacing(points))[0]
    inside = (np.abs(points[:, :2] - 34.5) < 30).all(axis=1)
    slope = np.hypot(*np.gradient(z.reshape(70, 70))).ravel()
    off = (moved[:, 2] - steep * 8 * np.sin(moved[:, 0] / 11) * np.cos(moved[:, 1] / 14)) / np.hypot(1, slope)
    given = (points[:, 2] - z) / np.hypot(1, slope)
    assert off[inside].std() < 0.4 * given[inside].std()


def test_the_level_is_no_less_than_is_known():
    points, side = VOXELS["ball"]
    known = find_voxels(points).noise
    assert known == pytest.approx(side / np.sqrt(12))
    free, held = (estimate_noise(points, least=least) for least in (0.0, known))
    assert (held.level >= known).all()
    assert (free.level < known).any()
    assert np.median(held.neighbours) > 1.5 * np.median(free.neighbours)


def test_steps_are_told_in_input_units():
    points, side = VOXELS["ball"]
    cleaned, done = clean(prepare_samples(1000 * points))
    assert done["voxel"] == pytest.approx(1000 * side)
    assert any("points are in steps of 60, as voxels" in warning for warning in cleaned.warnings)
    as_given = prepare_samples(points)
    assert clean(as_given, Settings(denoise=0))[0] is as_given


def filled_ball(side):
    steps = np.arange(-1.2, 1.2, side)
    x = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1)
    return x[ball(x)]


def test_a_solid_of_voxels_is_its_boundary():
    solid, turn = filled_ball(0.06), shapes.random_rotation(4).T
    cleaned, _ = clean(prepare_samples(solid @ turn))
    assert len(cleaned.points) == len(VOXELS["ball"][0])
    kept = solid[cleaned.source_index]
    np.testing.assert_array_equal(np.unique(kept, axis=0), np.unique(VOXELS["ball"][0], axis=0))
    assert any(f"{len(solid) - len(kept)} of {len(solid)} points lie inside" in told for told in cleaned.warnings)
    assert len(clean(prepare_samples(solid), Settings(outliers=False))[0].points) == len(solid)


@pytest.mark.parametrize("name", VOXELS)
def test_boundaries_of_voxels_are_no_solids(name):
    assert find_voxels(VOXELS[name][0]).inside().mean() < 0.05


@pytest.mark.parametrize("name", ["ball", "torus"])
def test_a_surface_of_voxels_is_whole_and_smooth(name):
    points, side = VOXELS[name]
    result = reconstruct(points @ shapes.random_rotation(3).T, Settings(resolution=64))
    assert len(shapes.components(result.surface)) == 2
    assert shapes.euler(result.surface) == {"ball": 4, "torus": 0}[name]
    vertices = result.surface.vertices @ shapes.random_rotation(3)
    off = np.linalg.norm(vertices, axis=1) if name == "ball" else shapes.torus_distance(vertices)
    assert off.std() < 0.15 * side
