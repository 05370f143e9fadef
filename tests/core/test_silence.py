"""No stage works through more than so many samples without a look at the progress callback, however many there are;
and what it finds does not depend on where it looks up."""

import numpy as np
import pytest

from core import trees
from core.cleaning import outliers, surroundings
from core.cleaning.positions import denoise
from core.field import curvature, local_surface
from core.field.rims import borders
from core.neighbourhoods import quadrics
from core.points import local_spacing
from tests import shapes

N, CHUNK = 600, 100
POINTS = shapes.scattered_sphere(N)
SPACING = local_spacing(POINTS)
DIRTY = np.vstack([POINTS, np.random.default_rng(0).uniform(-2, 2, (N // 5, 3))])
NOISY = POINTS + np.random.default_rng(0).normal(size=POINTS.shape) * 0.03


def patches(progress):
    fitted = local_surface.fit_local_surface(POINTS, POINTS, np.ones(N), SPACING, 3.0, progress)
    return fitted.bend, *(getattr(fitted.rims, name) for name in borders.Rims.__dataclass_fields__)


STAGES = {
    "spacing": lambda progress: (local_spacing(POINTS, progress),),
    "outliers": lambda progress: (outliers.find_outliers(DIRTY, progress),),
    "denoising": lambda progress: (denoise(NOISY, SPACING, 1.0, progress=progress)[0],),
    "patches": patches,
}


def looks_and_results(stage):
    looks = []
    return looks, STAGES[stage](lambda fraction, text: looks.append(fraction))


@pytest.mark.parametrize(
    ("stage", "module", "name", "size"),
    [
        ("spacing", trees, "_CHUNK", CHUNK),
        ("outliers", surroundings, "_CHUNK", CHUNK),
        ("denoising", quadrics, "_QUERIED", 12 * CHUNK),
        ("patches", trees, "_CHUNK", CHUNK),
        ("patches", curvature, "_CHUNK", CHUNK),
        ("patches", borders, "_CHUNK", CHUNK),
    ],
)
def test_looks_grow_with_the_samples_and_change_nothing(stage, module, name, size, monkeypatch):
    few, whole = looks_and_results(stage)
    monkeypatch.setattr(module, name, size)
    many, parts = looks_and_results(stage)
    assert len(many) >= len(few) + N // CHUNK - 1
    assert many == sorted(many)
    assert 0 <= many[0] <= many[-1] <= 1
    for expected, found in zip(whole, parts, strict=True):
        np.testing.assert_array_equal(found, expected)
