"""The two sides of open surfaces, by closed form, by a dense eigenvector and on surfaces that have none."""

from dataclasses import replace

import numpy as np
import pytest

from core import Settings, reconstruct
from core.field.blocks import Blocks
from core.linalg import symmetric
from core.progress import Progress
from core.surface.signs.two_sides import _orientations, two_sided
from core.surface.single.single_layer import SingleLayer
from tests import shapes


@pytest.fixture
def asked(monkeypatch):
    """A function of points and settings: what `two_sided` is given, or would be, in a run, and what it answers."""
    between = SingleLayer.between.func

    def ask(points, **settings):
        seen = {}

        def look(of):
            given = of.values, of.band, of.crossings, of.local, of.grid
            seen.update(zip(("values", "band", "crossings", "surface", "grid"), given, strict=True))
            signed = two_sided(*given, Progress())
            seen["signed"] = signed.dense() if isinstance(signed, Blocks) else signed
            return between(of)

        monkeypatch.setattr(SingleLayer, "between", property(look))
        reconstruct(points, Settings(**{"resolution": 48, "surface": "single", "denoise": 0, **settings}))
        return seen

    return ask


def bowl(seed=0):
    x = shapes.scattered_sphere(3000, seed)
    return x[x[:, 2] > 0] @ shapes.random_rotation(seed).T


def ball_through(points):
    """Centre and radius of the ball that points (n,3) lie on, by least squares."""
    found = np.linalg.lstsq(np.column_stack([2 * points, np.ones(len(points))]), (points**2).sum(axis=1), rcond=None)[0]
    return found[:3], np.sqrt(found[3] + found[:3] @ found[:3])


def of_band(seen):
    """Nodes of the band off the rims: their positions, and their signed distances in cells."""
    node, grid = seen["band"].node[~seen["band"].past_rim], seen["grid"]
    return grid.positions(node), seen["signed"].reshape(-1)[node] / grid.spacing


@pytest.mark.parametrize("seed", range(3))
def test_the_sides_of_a_bowl_are_within_and_without(asked, seed):
    seen = asked(bowl(seed))
    centre, radius = ball_through(seen["surface"].points)
    x, signed = of_band(seen)
    true = (np.linalg.norm(x - centre, axis=1) - radius) / seen["grid"].spacing
    true *= np.sign(true @ signed)
    assert (np.sign(signed) == np.sign(true))[np.abs(true) > 0.05].all()
    assert np.percentile(np.abs(signed - true), 95) < 0.05


def test_a_sheet_goes_on_level_past_its_rim(asked):
    turn = shapes.random_rotation(1)
    seen = asked(np.column_stack([np.random.default_rng(0).uniform(-1, 1, (1500, 2)), np.zeros(1500)]) @ turn.T)
    band, grid = seen["band"], seen["grid"]
    height = (grid.positions(band.node) - seen["surface"].points[0]) @ turn[:, 2] / grid.spacing
    signed = seen["signed"].reshape(-1)[band.node] / grid.spacing
    height *= np.sign(height @ signed)
    assert band.past_rim.sum() > 500
    clear = np.abs(height) > 0.2
    assert (np.sign(signed) == np.sign(height))[clear].mean() > 0.99
    assert np.percentile(np.abs(signed - height)[band.past_rim & clear], 99) < 0.01


def test_is_known_in_the_band_alone(asked):
    seen = asked(bowl())
    far = np.ones(seen["signed"].size, bool)
    far[seen["band"].node] = False
    np.testing.assert_array_equal(seen["signed"].reshape(-1)[far], np.float32(3 * seen["grid"].spacing))


def test_is_the_same_in_a_band(asked):
    whole, band = asked(bowl()), asked(bowl(), band=4.0)
    np.testing.assert_array_equal(band["signed"], whole["signed"])


@pytest.mark.parametrize("name", ["wide", "narrow", "junction", "crossed junctions"])
def test_one_sided_surfaces_and_junctions_have_none(asked, name):
    """A band of 3 cells turns over in a patch as short as a speck, which parts it all the same."""
    points = {
        "wide": shapes.moebius(1500),
        "narrow": shapes.moebius(1500, 0.1),
        "junction": shapes.junction(2000) @ shapes.random_rotation(3).T,
        "crossed junctions": np.concatenate([shapes.junction(2000), shapes.sheets(2000, 0.8)]),
    }[name]
    assert asked(points, resolution=64)["signed"] is None


def test_samples_that_no_votes_link_are_taken(asked):
    """A line and a sample beside it, which a coarse grid hardly shows."""
    seen = asked(np.concatenate([np.arange(200.0)[:, None] * [1, 0, 0], [[0, 1, 0]]]), resolution=32)
    assert seen["signed"] is None or np.isfinite(seen["signed"]).all()


def test_wrong_votes_are_overruled(asked):
    """Of the crossings of a bowl 3 %, at random, are taken for none."""
    seen = asked(bowl())
    crossings, random = seen["crossings"], np.random.default_rng(0)
    kept = random.random(len(crossings.node)) > 0.03
    fewer = replace(crossings, **{name: getattr(crossings, name)[kept] for name in ("node", "axis", "place", "normal")})
    given = seen["values"], seen["band"], fewer, seen["surface"], seen["grid"], Progress()
    signed = two_sided(*given).reshape(-1)[seen["band"].node]
    before = seen["signed"].reshape(-1)[seen["band"].node]
    assert np.mean(np.sign(signed) == np.sign(before) * np.sign(signed @ before)) > 0.998


@pytest.mark.parametrize("wrong", [0.0, 0.05, 0.15])
def test_orientations_are_the_signs_of_the_first_eigenvector(wrong):
    """Of the signed Laplacian, by LAPACK, for two parts of a random graph each."""
    random, n = np.random.default_rng(0), 120
    true = random.choice([-1.0, 1.0], n)
    low, high = random.integers(0, n, (2, 1500))
    same = (low // 60 == high // 60) & (low != high)
    low, high = low[same], high[same]
    sign = true[low] * true[high] * np.where(random.random(len(low)) < wrong, -1, 1)
    links = symmetric(sign * random.uniform(0.5, 1.5, len(low)), low, high, n)
    found, dense = np.sign(_orientations(links, Progress())), links.toarray()
    laplacian = np.diag(np.abs(dense).sum(axis=1)) - dense
    for part in (slice(0, 60), slice(60, 120)):
        first = np.sign(np.linalg.eigh(laplacian[part, part])[1][:, 0])
        assert np.abs(found[part] @ first) >= 58
        assert np.abs(found[part] @ true[part]) >= 56
