"""Against the definition, sample by sample in double precision."""

import numpy as np
import pytest

from core.field.patches import Patches
from core.field.rims.borders import DISC, OPPOSITE, Rims


@pytest.fixture
def rims(random):
    """Of 60 samples in planes of all directions, with gaps, bridged ones, rims and creases of all kinds."""
    n = 60
    gap = random.random(n) < 0.7
    limit = np.where(random.random((n, 2)) < 0.4, random.uniform(0.1, 1.0, (n, 2)), np.inf)
    limit.sort(axis=1)
    return Rims(
        gap=gap,
        bridged=gap & (random.random(n) < 0.5),
        outward=unit(random.normal(size=(n, 3))),
        opening=random.uniform(-0.5, 0.5, n),
        beside=np.zeros((n, 2), np.int64),
        ends=random.normal(size=(n, 2, 3)),
        margin=random.uniform(0.1, 0.6, (n, 3)),
        reach=random.uniform(0, 2, n),
        behind=random.uniform(0, 2, n) * (random.random(n) < 0.5),
        crease=unit(random.normal(size=(n, 2, 3))),
        limit=limit,
    )


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def expected(rims, i, lateral, spacing):
    """How far out of the patch of sample i, and the step there."""
    length = np.linalg.norm(lateral)
    along = lateral @ rims.outward[i]
    ahead, radius = rims.gap[i] and along > length * rims.opening[i], DISC * spacing
    if ahead:
        radius = max(radius, rims.reach[i])
    if rims.gap[i] and along < -OPPOSITE * length:
        radius = max(radius, rims.behind[i])
    found = [(max(length - radius, 0.0), lateral * max(1 - radius / length, 0.0))]
    if ahead and not rims.bridged[i]:
        past = []
        for end, margin in zip(rims.ends[i], rims.margin[i, 1:], strict=True):
            share = np.linspace(0, 1, 100_001)
            steps = lateral - share[:, None] * end
            outs = np.linalg.norm(steps, axis=1) - (1 - share) * rims.margin[i, 0] - share * margin
            least = outs.argmin()
            past.append((outs[least], steps[least] / np.linalg.norm(steps[least])))
        out, way = min(past, key=lambda edge: edge[0])
        found.append((out, out * way))
    over = sum(max(lateral @ way - least, 0.0) * way for way, least in zip(rims.crease[i], rims.limit[i], strict=True))
    found.append((np.linalg.norm(over), over))
    return max(found, key=lambda each: each[0])


def test_excess_is_that_of_the_definition(rims, random):
    sample = random.integers(0, len(rims.gap), (80, 7))
    lateral = random.normal(size=(3, 80, 7)).astype(np.float32)
    spacing = random.uniform(0.5, 1.5, (80, 7)).astype(np.float32)
    beyond, step = Patches.of(rims).excess(sample, lateral, spacing)
    for at in np.ndindex(*sample.shape):
        distance, way = expected(rims, sample[at], lateral[(slice(None), *at)].astype(float), float(spacing[at]))
        np.testing.assert_allclose(beyond[at], distance, atol=1e-5)
        np.testing.assert_allclose(step[(slice(None), *at)], way, atol=1e-5)
