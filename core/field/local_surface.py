"""The surface near the samples, as distance and foot point of any query close to it."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..progress import Progress
from .borders import Rims, excess, find_rims
from .curvature import bending, tangent_frames
from .diffusion import fused_axes, kernel_weights

NEIGHBOURS = 16  # of a sample, that its patch is fitted to
NEAREST = 12  # of a query, that it is projected with
CHUNK = 32768
UNCOVERED = 1.5  # the surface is never further from its nearest sample than this, local spacings (or the bridged reach)

_PARALLEL = 0.7  # least |n . axis| of samples whose patch may cover a query
_MEMBERSHIP = 8.0  # how fast samples off each other's plane stop counting as one sheet
_OTHER_SHEETS = 2  # at most, beside that of the nearest sample
_TRUSTED = 0.95  # least confidence of a sample that stands for another sheet
_MEMBER = 0.3  # least membership of samples whose patch may cover a query


@dataclass(frozen=True)
class Projection:
    """Where queries fall on the surface.

    distance : (m,) float64, to the surface
    step     : (m,3) float64, from the foot point to the query
    past_rim : (m,) bool, whether the foot point lies on a rim of the sheet, where `step` is no normal
    """

    distance: np.ndarray
    step: np.ndarray
    past_rim: np.ndarray

    def __getitem__(self, chosen) -> "Projection":
        return Projection(self.distance[chosen], self.step[chosen], self.past_rim[chosen])


@dataclass(frozen=True)
class LocalSurface:
    """Quadratic patches with rims, blended by the diffusion kernels.

    points, normals : (n,3) float64     spacing : (n,) float64, local spacing     bend : (n,3,3) float64
    confidence      : (n,) float64 in [0,1], of the normals
    bridge          : gaps up to this many local spacings are closed
    """

    points: np.ndarray
    normals: np.ndarray
    spacing: np.ndarray
    bend: np.ndarray
    confidence: np.ndarray
    bridge: float
    rims: Rims
    tree: KDTree

    def project(self, x: np.ndarray, progress=None) -> "Projection":
        """Distances and foot points of queries (m,3) close to the surface.

        The projection distance of the paper (section 3.1), blended: tau minimises, over the samples of one sheet near
        the query, the diffusion-weighted sum of squared offsets from their patches when the query is moved by tau
        along the fused axis. Past a rim the lateral distance to the nearest patch is added at a right angle. Of the
        sheets that the nearest samples belong to, the closest counts. Accurate within a few local spacings of the
        surface; never more than the distance to the nearest sample.
        """
        progress = Progress.of(progress)
        found = Projection(np.empty(len(x)), np.empty((len(x), 3)), np.empty(len(x), bool))
        for first in range(0, len(x), CHUNK):
            progress(first / len(x))
            part = slice(first, first + CHUNK)
            found.distance[part], found.step[part], found.past_rim[part] = self._project(x[part])
        return found

    def _project(self, x):
        k = min(NEAREST, len(self.points))
        distance, sample = self.tree.query(x, k=k, workers=-1)
        distance = np.maximum(distance, 1e-9 * self.spacing[sample])
        found, step, past_rim, member = self._onto_sheet(x, sample, distance, np.zeros(len(x), np.int64))
        rest = (member <= _MEMBER) & (self.confidence[sample] >= _TRUSTED)
        for _ in range(_OTHER_SHEETS):
            row = np.flatnonzero(rest.any(axis=1))
            anchor = rest[row].argmax(axis=1)
            other, other_step, other_rim, member = self._onto_sheet(x[row], sample[row], distance[row], anchor)
            closer = other < found[row]
            chosen = row[closer]
            found[chosen], step[chosen], past_rim[chosen] = other[closer], other_step[closer], other_rim[closer]
            rest[row] &= member <= _MEMBER
        return found, step, past_rim

    def _onto_sheet(self, x, sample, distance, anchor):
        """Distance, step and whether past a rim, for the sheet of each query's sample number `anchor` (m,); and how
        surely each sample belongs to that sheet, (m,k)."""
        every = np.arange(len(x))
        spacing, normals = self.spacing[sample], self.normals[sample]
        offset = x[:, None] - self.points[sample]
        height = np.einsum("mki,mki->mk", offset, normals)
        lateral = offset - height[..., None] * normals

        member = self._membership(sample, normals, anchor)
        kernel, length = kernel_weights(distance, spacing)
        weight = kernel * member
        weight /= weight.max(axis=1, keepdims=True)
        axis = fused_axes(weight, length, distance, height, normals)
        cosine = np.einsum("mki,mi->mk", normals, axis)

        bent = np.einsum("mkij,mkj->mki", self.bend[sample], lateral)
        sagitta = 0.5 * np.einsum("mki,mki->mk", lateral, bent)
        above = (height - sagitta) / np.sqrt(1 + np.einsum("mki,mki->mk", bent, bent))
        tau = np.einsum("mk,mk,mk->m", weight, cosine, above) / np.einsum("mk,mk,mk->m", weight, cosine, cosine)

        beyond, outward = excess(self.rims, sample, lateral, spacing)
        covers = (np.abs(cosine) > _PARALLEL) & (member > _MEMBER)
        covers[every, anchor] |= ~covers.any(axis=1)
        best = np.where(covers, beyond, np.inf).argmin(axis=1)
        step = tau[:, None] * axis + outward[every, best]
        found = np.linalg.norm(step, axis=1)

        own, away = sample[every, anchor], distance[every, anchor]
        slack = np.maximum(UNCOVERED * self.spacing[own], 1.1 * self.rims.reach[own])
        bounded = np.clip(found, away - slack, away)
        lifted = bounded > found
        step[lifted] = offset[every, anchor][lifted]
        found[lifted] = away[lifted]
        step *= (bounded / np.maximum(found, np.finfo(float).tiny))[:, None]
        return bounded, step, beyond[every, best] > 0, member

    def _membership(self, sample, normals, anchor):
        """(m,k) in [0,1]: how surely each sample lies on one sheet with the anchor, from their offsets off each
        other's tangent plane relative to their distance; keeps close sheets apart."""
        every = np.arange(len(sample))
        between = self.points[sample] - self.points[sample[every, anchor]][:, None]
        squared = np.einsum("mki,mki->mk", between, between)
        height = np.einsum("mki,mi->mk", between, normals[every, anchor])
        height_back = np.einsum("mki,mki->mk", between, normals)
        return np.exp(-_MEMBERSHIP * (height**2 + height_back**2) / np.maximum(squared, np.finfo(float).tiny))


def patch_neighbours(tree: KDTree) -> np.ndarray:
    """The samples that each one's patch is fitted to, (n,k) int, nearest first: 16, or all others where there are
    fewer."""
    return tree.query(tree.data, k=min(NEIGHBOURS, tree.n - 1) + 1, workers=-1)[1][:, 1:]


def fit_local_surface(points, normals, confidence, spacing, bridge: float) -> LocalSurface:
    """Patches and rims of samples (n,3) with axes (n,3), their confidence (n,) and local spacing (n,); gaps up to
    `bridge` spacings are closed."""
    tree = KDTree(points)
    frames = tangent_frames(normals)
    neighbours = patch_neighbours(tree)
    bend = bending(points, normals, frames, spacing, neighbours)
    rims = find_rims(points, normals, frames, spacing, neighbours, tree, bridge)
    return LocalSurface(points, normals, spacing, bend, confidence, bridge, rims, tree)
