"""Where rims run past the samples beside them.

Random samples stop short of a rim, and chords between them cut off what lies beyond a gap in the sampling. Samples that
are uniform below a line most likely have that line above them which leaves the least area below it (A. P. Korostelev
and A. B. Tsybakov, Minimax Theory of Image Reconstruction, 1993). So around each sample at a rim a line is laid over
the outermost samples of its sheet: straight, or bent upwards to both sides, or to one, where a bay is more likely than
a gap.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from ..linalg import row_dots
from ..parallel import in_order
from ..progress import Progress
from .borders import RIM, Rims, chain_lengths, one_sheet

_CHAIN = 12  # least number of samples in a row that are a rim; fewer are gaps in the sampling
_WINDOW = 5.0  # local spacings to either side of a sample, how far its line looks
_NEAREST = 96  # samples, how many it looks at
_BINS = 16  # of the window; each keeps its outermost sample
_CONE, _LIFT = 0.8, 0.2  # samples steeper than this above a sample, and further, are across a bay
_BENDS = 0.0, 0.05, 0.1, 0.2, 0.4  # upwards, quadratic, over local spacings squared
_KINKS = 0.5, 1.0, 2.0, 4.0  # upwards, linear, to the right, to the left or to both sides
_STIFFNESS = 0.15  # area that a bend must save, relative to what it covers itself
_STEEPEST, _HALVINGS = 2.0, 8  # of the line's slope, and steps to find it
_BEYOND = 0.07  # the rim lies this far past the line, local spacings
_FARTHEST = 1.5  # and at most this far past a sample
_REACH, _LINES = 2.0, 4  # local spacings from a line's sample to others it bounds; lines tried for each
_CHUNK = 512  # rim samples


def with_rim_lines(rims: Rims, points, normals, spacing, tree: KDTree, progress=None) -> Rims:
    """The rims with margins up to the lines through their outermost samples, and with other samples' patches, bridged
    gaps too, ended at those lines.

    points, normals : (n,3) float64     spacing : (n,) local spacing     tree : of the points
    """
    progress = Progress.of(progress)
    rim = rims.gap & ~rims.bridged
    row = np.flatnonzero(rim & (chain_lengths(rims, rim) >= _CHAIN))
    if not len(row):
        return rims

    def lay(part):
        return _lines(row[part], rims.outward[row[part]], points, normals, spacing, tree)

    lines = [found for _, found in in_order(lay, progress.chunks(len(row), _CHUNK))]
    lines = _Lines(row, *(np.concatenate(each) for each in zip(*lines, strict=True)))
    margin = rims.margin.copy()
    size = spacing[row]
    margin[row, 0] = size * _margin(lines.height / np.sqrt(1 + lines.slope**2))

    own = np.zeros(len(points), bool)
    own[row] = True
    other = np.flatnonzero(~rims.gap | rims.bridged)
    way, distance = _nearest_line(lines, rims, other, points, normals, spacing)
    known = RIM * spacing
    known[other] = np.where(np.isfinite(distance), distance, known[other])
    known[row] = margin[row, 0]
    ends = rims.ends[row] / size[:, None, None]
    along, up = (np.einsum("rei,ri->re", ends, axis) for axis in (lines.tangent, rims.outward[row]))
    over = (lines.at(along) - up) / np.sqrt(1 + lines.slope**2)[:, None]
    margin[row, 1:] = np.minimum(size[:, None] * _margin(over), known[rims.beside[row]])

    ended = distance < np.maximum(spacing, rims.farthest)[other]
    crease, limit = rims.crease.copy(), rims.limit.copy()
    slot = np.isfinite(limit[other, 0]).astype(int)
    ended &= ~np.isfinite(limit[other, slot])
    limit[other[ended], slot[ended]] = distance[ended]
    crease[other[ended], slot[ended]] = way[ended]
    return replace(rims, margin=margin, crease=crease, limit=limit)


class _Lines:
    """Rim lines over samples, in local spacings: height over the tangent plane's axes at each."""

    def __init__(self, row, tangent, height, slope, bend):
        self.row, self.tangent, self.height, self.slope, self.bend = row, tangent, height, slope, bend

    def at(self, along, of=slice(None)):
        """Height of lines (r,) at places (r,p) along them."""
        return self.height[of, None] + self.slope[of, None] * along + _bent(self.bend[of], along)

    def steepness(self, along, of):
        """Slope of lines (m,) at one place each, (m,)."""
        quadratic, right, left = self.bend[of].T
        return self.slope[of] + 2 * quadratic * along + np.where(along > 0, right, -left)


def _margin(height):
    return np.clip(height + _BEYOND, 0, _FARTHEST)


def _lines(row, outward, points, normals, spacing, tree):
    """Tangents (r,3), heights, slopes (r,) and bends (r,3) of the lines of least area over samples `row`."""
    distance, other = tree.query(points[row], k=min(_NEAREST, len(points)), workers=-1)
    size = spacing[row, None]
    step = points[other] - points[row, None]
    tangent = np.cross(normals[row], outward)
    along, up = (np.einsum("rki,ri->rk", step, axis) / size for axis in (tangent, outward))
    counts = one_sheet(step, normals[row, None], normals[other]) & (distance < _WINDOW * size)
    counts &= up <= _CONE * np.abs(along) + _LIFT
    along, up = _outermost(along, np.where(counts, up, -np.inf))
    window = np.minimum(_WINDOW, distance[:, -1] / size[:, 0])

    least = np.full(len(row), np.inf)
    height, slope, bend = np.zeros(len(row)), np.zeros(len(row)), np.zeros((len(row), 3))
    for tried in _shapes():
        a, b = _lowest(along, up - _bent(tried, along))
        own = tried[0] * window**2 / 3 + (tried[1] + tried[2]) * window / 4
        area = a + (1 + _STIFFNESS) * own
        less = area < least
        least[less], height[less], slope[less], bend[less] = area[less], a[less], b[less], tried
    return tangent, height, slope, bend


def _shapes():
    """Bends that are tried: quadratic, right, left."""
    both = [(0.0, right, left) for kink in _KINKS for right, left in ((kink, 0.0), (0.0, kink), (kink, kink))]
    return np.array([(bend, 0.0, 0.0) for bend in _BENDS] + both)


def _bent(bend, along):
    quadratic, right, left = (bend[..., k, None] for k in range(3))
    return quadratic * along**2 + right * np.maximum(along, 0) + left * np.maximum(-along, 0)


def _lowest(along, up):
    """Height over 0 and slope, (r,) each, of the lowest straight lines above points (r,p) that include 0, 0."""
    low, high = np.full(len(along), -_STEEPEST), np.full(len(along), _STEEPEST)
    every = np.arange(len(along))
    for _ in range(_HALVINGS):
        slope = (low + high) / 2
        touched = along[every, (up - slope[:, None] * along).argmax(axis=1)]
        low, high = np.where(touched >= 0, slope, low), np.where(touched <= 0, slope, high)
    slope = (low + high) / 2
    return (up - slope[:, None] * along).max(axis=1), slope


def _outermost(along, up):
    """The highest of points (r,k) in each bin, after the own sample at 0, 0: two arrays (r,1+bins)."""
    held = np.zeros((len(along), 1 + _BINS))
    highest = np.full((len(along), 1 + _BINS), -np.inf)
    highest[:, 0] = 0
    bins = 1 + np.clip(((along / _WINDOW + 1) * _BINS / 2).astype(int), 0, _BINS - 1)
    order = np.argsort(up, axis=1)
    row = np.broadcast_to(np.arange(len(along))[:, None], order.shape)
    along, up, bins = (np.take_along_axis(each, order, axis=1) for each in (along, up, bins))
    held[row, bins], highest[row, bins] = along, up  # of one bin the last, which is the highest
    return held, highest


def _nearest_line(lines, rims, other, points, normals, spacing):
    """Unit direction (m,3) towards the nearest line and distance (m,) to the rim there for samples `other`, inf where
    none of the nearest rim samples' lines is that of their sheet."""
    far, near = KDTree(points[lines.row]).query(points[other], k=range(1, 1 + min(_LINES, len(lines.row))), workers=-1)
    way, found = np.zeros((len(other), 3)), np.full(len(other), np.inf)
    for far_k, of in zip(far.T, near.T, strict=True):
        row = lines.row[of]
        step, size = points[other] - points[row], spacing[row]
        along, up = (row_dots(step, axis) / size for axis in (lines.tangent[of], rims.outward[row]))
        towards = rims.outward[row] - lines.steepness(along, of)[:, None] * lines.tangent[of]
        length = np.linalg.norm(towards, axis=1)
        distance = size * (np.maximum((lines.at(along[:, None], of)[:, 0] - up) / length, 0) + _BEYOND)
        closer = one_sheet(step, normals[row], normals[other]) & (far_k < _REACH * size) & (distance < found)
        found[closer], way[closer] = distance[closer], towards[closer]
    way -= row_dots(way, normals[other])[:, None] * normals[other]
    return way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), np.finfo(float).tiny), found
