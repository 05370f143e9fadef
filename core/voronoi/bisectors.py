"""Blue-noise samples on the Voronoi bisectors."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from .facets import Facets
from .polygons import FacetPolygons, triangle_areas

DENSITY = 4.0  # samples in a square of one local spacing

_PACKING = 0.75  # samples that a full Poisson-disc set has in a square of its radius
_CANDIDATES = 4  # for each sample wanted


@dataclass(frozen=True)
class BisectorSamples:
    """Samples of the clipped facets.

    positions : (k,3) float64
    facet     : (k,) int64, row in `facets.pairs`, rising
    weight    : (k,) float64, area of the facet over the number of samples on it, squared units of the samples
    """

    facets: Facets
    positions: np.ndarray
    facet: np.ndarray
    weight: np.ndarray


def bisector_samples(polygons: FacetPolygons, spacing: np.ndarray, density: float = DENSITY, seed: int = 0):
    """Poisson-disc samples on every facet (section 4.2 of the paper), at least one on each.

    spacing : (n,) float64, local spacing of the points that the facets lie between
    density : mean number of samples in a square of one local spacing

    No two samples of a facet are closer than sqrt(.75 / density) local spacings. They are what greedy dart throwing
    keeps of uniform candidates; all facets are thrown at together, in rounds that keep each candidate without an
    earlier rival left.
    """
    rng = np.random.default_rng(seed)
    facets = polygons.facets
    side = spacing[facets.pairs].mean(axis=1)
    wanted = np.ceil(_CANDIDATES * density * facets.area / side**2).astype(np.int64)
    candidates, facet = _uniform(polygons, wanted, rng)

    apart = side * np.sqrt(_PACKING / density)
    layered = np.column_stack([candidates / apart[facet, None], 2.0 * facet])
    rivals = KDTree(layered).query_pairs(1.0, output_type="ndarray")
    rank = rng.permutation(len(candidates))
    earlier, later = np.where((rank[rivals[:, 0]] < rank[rivals[:, 1]])[:, None], rivals, rivals[:, ::-1]).T
    kept = greedy_choice(len(candidates), earlier, later)
    facet = facet[kept]
    weight = facets.area / np.bincount(facet, minlength=len(facets.pairs))
    return BisectorSamples(facets, candidates[kept], facet, weight[facet])


def _uniform(polygons, count, rng):
    """`count[k]` uniform points on polygon k, (c,3), and the polygon of each, (c,) rising."""
    triangles, _ = polygons.triangles()
    reached = np.concatenate([[0.0], np.cumsum(triangle_areas(triangles))])
    low, high = reached[polygons.first[:-1]], reached[polygons.first[1:]]
    facet = np.repeat(np.arange(len(count)), count)
    target = low[facet] + rng.random(len(facet)) * (high - low)[facet]
    chosen = np.searchsorted(reached, target, side="right") - 1
    chosen = np.clip(chosen, polygons.first[facet], polygons.first[facet + 1] - 1)
    root, share = np.sqrt(rng.random(len(facet)))[:, None], rng.random(len(facet))[:, None]
    apex, a, b = triangles[chosen].transpose(1, 0, 2)
    return (1 - root) * apex + root * ((1 - share) * a + share * b), facet


def greedy_choice(count: int, earlier: np.ndarray, later: np.ndarray) -> np.ndarray:
    """Indices, rising, that are kept of `count` when of each pair of rivals, (r,) int each, at most one may stay and
    they choose in turn, `earlier` before `later`."""
    kept, open_ = np.zeros(count, bool), np.ones(count, bool)
    while open_.any():
        won = open_.copy()
        won[later] = False
        kept |= won
        open_ &= ~won
        open_[later[won[earlier]]] = False
        left = open_[earlier] & open_[later]
        earlier, later = earlier[left], later[left]
    return np.flatnonzero(kept)
