import numpy as np
import pytest

from core.cleaning import detached, outliers, surroundings
from core.cleaning.outliers import find_outliers
from core.points import local_spacing
from tests import shapes


def edges_of_a_box(n):
    """Points at random places of the twelve edges of a box."""
    rng = np.random.default_rng(0)
    corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), -1).reshape(-1, 3) * [1.0, 0.6, 0.4]
    pairs = [(a, b) for a in range(8) for b in range(a) if (corners[a] != corners[b]).sum() == 1]
    ends = corners[np.array(pairs)[rng.integers(0, 12, n)]]
    t = rng.random((n, 1))
    return ends[:, 0] * t + ends[:, 1] * (1 - t)


def mixed_densities():
    """A sphere sampled with 200, 1,000 and 5,000 points a third."""
    points = shapes.scattered_sphere(30_000)
    third = np.digitize(points[:, 0], [-1 / 3, 1 / 3])
    return np.concatenate([points[third == i][:count] for i, count in enumerate((200, 1000, 5000))])


THIN_BUT_REAL = {
    "wireframe": edges_of_a_box(1000),
    "sparse wireframe": edges_of_a_box(150),
    "helix": np.stack([np.cos(t := np.linspace(0, 20, 400)), np.sin(t), 0.1 * t], axis=1),
    "mixed densities": mixed_densities(),
    "sphere": shapes.scattered_sphere(3000),
    "few on a sphere": shapes.scattered_sphere(110),
    "moebius": shapes.moebius(2000),
    "junction": shapes.junction(1500),
    "close sheets": shapes.sheets(1500, gap=0.05),
    "two apart": np.vstack([shapes.scattered_sphere(2000), 0.3 * shapes.scattered_sphere(500) + 40]),
    "a small part": np.vstack([shapes.scattered_sphere(3000), 0.05 * shapes.scattered_sphere(50) + [1.3, 0, 0]]),
    "a sparse sheet of its own": np.vstack([shapes.scattered_sphere(3000), 0.55 * shapes.square(36) + [0, 0, 2]]),
    "a sparse wire of its own": np.vstack([shapes.scattered_sphere(3000), np.linspace([-5, 0, 2], [5, 0, 2], 30)]),
    "four points": np.vstack([np.eye(3), np.zeros((1, 3))]),
}


@pytest.mark.parametrize("name", THIN_BUT_REAL)
def test_thin_but_real_stays_whole(name):
    assert not find_outliers(THIN_BUT_REAL[name]).any()


def with_strays(strays):
    clean = shapes.scattered_sphere(5000)
    return np.vstack([clean, strays]), np.arange(5000 + len(strays)) >= 5000


@pytest.mark.parametrize(("share", "found"), [(0.01, 0.9), (0.05, 0.95), (0.2, 0.95)])
def test_scattered_strays_are_found(share, found):
    points, stray = with_strays(np.random.default_rng(1).uniform(-1.5, 1.5, (int(share * 5000), 3)))
    marked = find_outliers(points)
    assert marked[stray].mean() > found
    assert marked[~stray].mean() < 0.01


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("gap", [0.03, 0.045, 0.06])
def test_sheets_a_spacing_or_two_apart_stay_whole(gap, seed):
    """Samples in a gap of their own sheet have all their neighbours on the other one."""
    x = np.random.default_rng(seed).uniform(-1, 1, (10_000, 2))
    assert find_outliers(np.column_stack([x, np.repeat([0, gap], 5000)])).sum() <= 1


@pytest.mark.parametrize("apart", [4, 6, 8])
@pytest.mark.parametrize("gap", [2, 3, 4])
def test_a_sparse_sheet_behind_a_dense_one_stays(gap, apart):
    """Backs of ears and of other thin parts that are modelled in less detail: lonely, and off the front's plane."""
    rng, spacing = np.random.default_rng(0), 0.03
    front, back = (rng.uniform(-1, 1, (int(4 / spacing**2 / each**2), 2)) for each in (1, apart))
    sheets = (front, 0.0), (back, gap * spacing)
    points = np.vstack([np.column_stack([x, 0.3 * (x**2).sum(axis=1) - below]) for x, below in sheets])
    assert find_outliers(points)[len(front) :].mean() < 0.15


def test_a_few_strays_that_lie_in_a_plane_by_chance_are_found():
    """After the first round most of those left do, and are no sheet behind another for that."""
    corners = [((0, 0, 0), (1, 1, 0)), ((0, 0, 0), (0, 1, 1)), ((0, 0, 0), (1, 0, 1))]
    walls, found = shapes.scattered_rectangles(corners, 3000), []
    for seed in range(8):
        strays = np.random.default_rng(seed).uniform(-0.05, 1.05, (60, 3))
        found.append(find_outliers(np.vstack([walls, strays]))[len(walls) :].mean())
    assert np.mean(found) > 0.925


def test_chunks_change_nothing(monkeypatch):
    rng = np.random.default_rng(1)
    clumps = np.repeat(rng.uniform(-2, 2, (30, 3)), 10, axis=0) + rng.normal(size=(300, 3)) * 0.03
    points = with_strays(np.vstack([rng.uniform(-1.5, 1.5, (300, 3)), clumps]))[0]
    whole = find_outliers(points)
    for module in (outliers, detached, surroundings):
        monkeypatch.setattr(module, "_CHUNK", 50)
    np.testing.assert_array_equal(find_outliers(points), whole)


def test_strays_beside_the_surface_are_found():
    rng = np.random.default_rng(1)
    points, stray = with_strays(shapes.scattered_sphere(250, seed=5) * (1 + rng.choice([-1, 1], (250, 1)) * 0.15))
    marked = find_outliers(points)
    assert marked[stray].mean() > 0.9
    assert marked[~stray].mean() < 0.01


@pytest.mark.parametrize("far", [0, 5])
def test_few_strays_are_found_as_well(far):
    rng = np.random.default_rng(1)
    proud = shapes.scattered_sphere(15, seed=5) * (1 + rng.choice([-1, 1], (15, 1)) * 0.08)
    points, stray = with_strays(np.vstack([proud, rng.uniform(1.2, 1.5, (far, 3))]))
    np.testing.assert_array_equal(find_outliers(points), stray)


def test_beside_edges_few_samples_go_with_strays():
    rng = np.random.default_rng(1)
    cube = rng.uniform(-1, 1, (8000, 3))
    cube[np.arange(8000), rng.integers(0, 3, 8000)] = rng.choice([-1.0, 1.0], 8000)
    assert find_outliers(np.vstack([rng.uniform(-1.3, 1.3, (20, 3)), cube]))[20:].mean() < 0.003


@pytest.mark.parametrize("count", [12, 30])
def test_a_few_far_strays_are_found_though_they_lie_in_a_plane(count):
    points, stray = with_strays(np.random.default_rng(1).uniform(-0.8, 0.8, (count, 3)) * [1, 1, 0] + [0, 0, 3])
    np.testing.assert_array_equal(find_outliers(points), stray)


@pytest.mark.parametrize("share", [0.02, 0.05, 0.2])
def test_strays_among_wires_are_found_and_the_wires_stay(share):
    wires = edges_of_a_box(1000)
    strays = np.random.default_rng(1).uniform(-0.05, 1.05, (int(1000 * share), 3)) * [1.0, 0.6, 0.4]
    dropped = find_outliers(np.vstack([wires, strays]))
    assert dropped[1000:].mean() > 0.6
    assert dropped[:1000].sum() <= 8


@pytest.mark.parametrize(("seed", "found"), [(0, 0.8), (2, 0.9)])
def test_clumps_among_wires_are_found_beside_them_as_well(seed, found):
    wires, rng = edges_of_a_box(1000), np.random.default_rng(seed)
    places = rng.uniform(0, 1, (5, 3)) * [1.0, 0.6, 0.4]
    clumps = np.repeat(places, 10, axis=0) + rng.normal(size=(50, 3)) * 0.015
    assert find_outliers(np.vstack([wires, clumps]))[1000:].mean() > found


def test_of_a_sparse_wire_across_dense_ones_no_more_than_ends_go_with_strays():
    wires, rng = edges_of_a_box(1000), np.random.default_rng(1)
    across = np.linspace([0.05, 0.03, 0.02], [0.95, 0.57, 0.38], 20)
    strays = rng.uniform(0, 1, (50, 3)) * [1.0, 0.6, 0.4]
    dropped = find_outliers(np.vstack([across, wires, strays]))
    assert dropped[:20].sum() <= 4  # where it touches the others
    assert dropped[1020:].mean() > 0.5


def test_a_short_sparse_wire_of_its_own_stays_among_wires():
    row = np.linspace([0.3, 0.3, 1.0], [0.7, 0.3, 1.0], 9)
    assert not find_outliers(np.vstack([row, edges_of_a_box(1000)]))[:9].any()


def test_a_detached_cloud_is_found_and_a_detached_sheet_is_not():
    rng = np.random.default_rng(1)
    points, stray = with_strays(rng.normal(size=(60, 3)) * 0.05 + [2, 0, 0])
    np.testing.assert_array_equal(find_outliers(points), stray)
    flat = rng.uniform(-0.2, 0.2, (60, 3)) * [1, 1, 0] + [2, 0, 0]
    assert not find_outliers(with_strays(flat)[0]).any()


@pytest.mark.parametrize(("count", "far", "dropped"), [(80, 9, True), (80, 2.5, False), (130, 9, False)])
def test_few_samples_go_that_are_further_from_all_others_than_these_reach(count, far, dropped):
    """Though they are two surfaces of their own; beside 5000 others 80 are few, and 130 are not."""
    flat = np.random.default_rng(1).uniform(-0.2, 0.2, (count, 3)) * [1, 1, 0]
    flat[: count // 2] += [far, 0, 0]
    flat[count // 2 :] -= [0, far, far]
    points, stray = with_strays(flat)
    np.testing.assert_array_equal(find_outliers(points), stray & dropped)


@pytest.mark.parametrize("noise", [0.01, 0.025])
def test_a_noisy_sheet_of_its_own_stays(noise):
    rng = np.random.default_rng(1)
    wall = rng.uniform(-2, 2, (30000, 3)) * [1, 1, 0]
    sheet = rng.uniform(-1, 1, (400, 3)) * [0.4, 0.2, 0] + rng.normal(size=(400, 3)) * [0, 0, noise] + [0, 0, 1]
    assert not find_outliers(np.vstack([wall, sheet]))[30000:].any()


def test_a_noisy_sheet_of_fewer_samples_than_others_stays():
    rng = np.random.default_rng(1)
    near = rng.uniform(-0.3, 0.3, (10000, 3)) * [1, 1, 0]
    far = rng.uniform(-1, 1, (2000, 3)) * [1, 1, 0] + rng.normal(size=(2000, 3)) * [0, 0, 0.022] + [0, 0, 1]
    assert find_outliers(np.vstack([near, far])).mean() < 0.002


@pytest.mark.parametrize("count", [18, 24, 60])
def test_a_small_closed_body_of_its_own_stays(count):
    rng, half = np.random.default_rng(2), 0.012 * np.sqrt(count)
    box = rng.uniform(-half, half, (count, 3))
    box[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-half, half], count)
    for body in (box, half * shapes.scattered_sphere(count)):
        points, _ = with_strays(body + np.array([2, 0, 0]))
        assert not find_outliers(points)[-count:].any()


@pytest.mark.parametrize("count", [9, 15, 25])
def test_a_few_samples_of_their_own_stay_beside_others_and_go_far_from_all(count):
    """At the end of a thin part all neighbours of a sample may be of that end, and others hardly further."""
    end = np.random.default_rng(0).normal(size=(count, 3)) * [0.03, 0.05, 0.03]
    end[:, 0] += 1 - end[:, 0].min()
    for gap, dropped in ((0.15, False), (1, True)):
        points = np.vstack([shapes.scattered_sphere(3000), end + gap * np.eye(3)[0]])
        np.testing.assert_array_equal(find_outliers(points), (np.arange(len(points)) >= 3000) & dropped)


@pytest.mark.parametrize("seed", range(2))
def test_one_stray_takes_no_samples_at_edges_with_it(seed):
    rng = np.random.default_rng(seed)
    box = rng.uniform(-1, 1, (500, 3))
    box[np.arange(500), rng.integers(0, 3, 500)] = rng.choice([-1.0, 1.0], 500)
    points = np.vstack([box * [1, 0.3, 0.15], [[0, 0, 2]]])
    np.testing.assert_array_equal(find_outliers(points), np.arange(501) == 500)


def test_of_many_small_bodies_none_goes():
    rng = np.random.default_rng(4)
    bodies = [0.2 * shapes.scattered_sphere(12, seed) + [seed % 8, seed // 8, 0] for seed in range(64)]
    bodies = [body * [1, rng.uniform(0.5, 1), 1] for body in bodies]
    assert not find_outliers(np.vstack(bodies)).any()


@pytest.mark.parametrize("far", [3.0, 1e3, 1e6])
def test_one_far_sample_is_found(far):
    points, stray = with_strays(np.array([[far, 0, 0]]))
    np.testing.assert_array_equal(find_outliers(points), stray)


def test_clumps_that_hover_over_a_surface_are_found():
    """The lowest of their samples are as near to it as others are to each other, but few are."""
    rng, spacing = np.random.default_rng(1), np.sqrt(4 * np.pi / 20000)
    clumps = []
    for up in shapes.sphere(12):
        clump = 0.02 * rng.normal(size=(60, 3))
        clumps.append(clump + (1 + 3.4 * spacing - (clump @ up).min()) * up)
    stray = find_outliers(np.concatenate([shapes.scattered_sphere(20000), *clumps]))
    assert stray[:20000].sum() <= 1
    assert stray[20000:].all()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_strays_that_lean_on_each_other_are_found(seed):
    """Of two strays beside each other each bends the plane and the quadric that the other is measured against."""
    rng, spacing = np.random.default_rng(seed), np.sqrt(4 * np.pi / 5000)
    up = shapes.scattered_sphere(60, seed)
    pairs = [(1 + rng.uniform(1.5, 4, (60, 1)) * spacing) * up + 0.5 * spacing * rng.normal(size=(60, 3)) for _ in "ab"]
    points, stray = with_strays(np.concatenate([*pairs, rng.uniform(-1.5, 1.5, (50, 3))]))
    marked = find_outliers(points)
    assert marked[np.abs(np.linalg.norm(points, axis=1) - 1) > spacing].all()
    assert not marked[~stray].any()


def test_where_sheets_cross_few_samples_go_with_strays():
    rng = np.random.default_rng(2)
    crossing = rng.uniform(-1.0, 1.0, (6000, 3))
    crossing[:3000, 2] = crossing[3000:, 0] = 0.0
    marked = find_outliers(np.vstack([crossing, rng.uniform(-1.2, 1.2, (200, 3))]))
    assert marked[:6000].sum() <= 3
    assert marked[6000:].mean() > 0.95


@pytest.mark.parametrize("seed", [1, 3])
def test_strays_beside_a_bent_surface_are_found_in_planes_of_its_samples(seed):
    """Planes of samples further along a bent surface run through what lies above it, as those of sheets that cross."""
    chance, strays = np.random.default_rng(seed), np.random.default_rng(seed + 10)
    around, across = chance.uniform(0, 2 * np.pi, (2, 20_000))
    even = chance.random(20_000) < (1 + 0.4 * np.cos(across)) / 1.4
    out, across = 1 + 0.4 * np.cos(across[even][:5000]), across[even][:5000]
    around = around[even][:5000]
    torus = np.stack([out * np.cos(around), out * np.sin(around), 0.4 * np.sin(across)], axis=1)
    strays = strays.uniform([-1.5, -1.5, -0.5], [1.5, 1.5, 0.5], (250, 3))
    marked = find_outliers(np.vstack([torus, strays]))
    off = np.abs(np.hypot(np.hypot(strays[:, 0], strays[:, 1]) - 1, strays[:, 2]) - 0.4)
    assert not marked[:5000].any()
    assert (~marked[5000:][off > 0.4 * np.median(local_spacing(torus))]).sum() <= 1


@pytest.mark.parametrize("around", [32, 64])
@pytest.mark.parametrize("height", [0.0, 1.0, 2.0])
def test_poles_and_tips_of_rings_of_vertices_stay(around, height):
    turn = 2 * np.pi * np.arange(around) / around
    out = np.arange(1, 20)[:, None] / 20
    rings = np.stack([out * np.cos(turn), out * np.sin(turn), height * (1 - out) + 0 * turn], axis=2).reshape(-1, 3)
    assert not find_outliers(np.vstack([rings, [[0, 0, height]]])).any()


def test_strays_that_more_and_more_others_hide_are_found():
    """Each outer one of a string of far strays is lonely once those within are gone."""
    string = np.array([[2.0, 0, 0], [2.1, 0, 0.1], [2.5, 0, 0], [3.3, 0.5, 0]])
    strays = np.vstack([turn * string[:, [a, b, c]] for turn in (1, -1) for a, b, c in ((0, 1, 2), (1, 2, 0))])
    points, stray = with_strays(strays)
    np.testing.assert_array_equal(find_outliers(points), stray)


def test_points_given_twice_are_looked_at_without_a_warning():
    """Nothing is around such a stray in a ring as far off as its nearest, which is no way off."""
    strays = np.random.default_rng(0).uniform(-2, 2, (10, 3))
    once = np.concatenate([shapes.scattered_sphere(150), strays])
    assert not find_outliers(np.tile(once, (2, 1)))[:150].any()


@pytest.mark.parametrize("gap", [0.08, 0.1, 0.12])
def test_sparse_samples_of_a_thin_wall_are_no_strays(gap):
    """A plate, dense on one side, whose two faces are about as far apart as its sparse samples are on the other."""
    u, v = np.linspace(-1, 0, 100), np.arange(0.1, 1, 0.08)
    dense, sparse = (
        np.stack([*np.meshgrid(along, across), np.zeros((len(across), len(along)))], axis=-1).reshape(-1, 3)
        for along, across in ((u, np.linspace(-0.5, 0.5, 100)), (v, np.arange(-0.5, 0.5, 0.08)))
    )
    sparse[:, :2] += np.random.default_rng(0).normal(scale=0.01, size=(len(sparse), 2))
    faces = [dense, dense + np.array([0, 0, gap]), sparse, sparse + np.array([0.04, 0.04, gap])]
    assert find_outliers(np.concatenate(faces)).sum() < 0.1 * 2 * len(sparse)


@pytest.mark.parametrize("beyond", [4, 6])
def test_lonely_samples_in_line_with_a_wire_stay(beyond):
    """The end of a wire that is sampled less there."""
    along = np.linspace(0, 1, 60)
    side = np.linspace(0, 1, 4)
    wires = np.array([[x, y, z] for y in side for z in side for x in (*along, 1 + beyond * along[1])])
    assert not find_outliers(wires).any()
