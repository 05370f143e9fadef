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

from ...linalg import row_dots, unit
from ...neighbourhoods.cloud import Cloud
from ...parallel import in_order
from ...progress import Progress
from ...trees import k_nearest
from .borders import RIM, Rims, chains, one_sheet
from .rim_fits import beside, lowest_lines
from .rim_gaps import RimGaps, find_rim_gaps, spacing_around

_CHAIN = 12  # least number of samples in a row that are a rim; fewer may be gaps in the sampling
_SHORT = 4  # the same of those that see more than half of the plane around them empty
_WIDE = -0.05  # cosine of half the angle that they see empty, on average at most
_WINDOW = 5.0  # local spacings to either side of a sample, how far its line looks
_NEAREST = 96  # samples, how many it looks at
_BINS = 16  # of the window; each keeps its outermost sample
_HALVINGS = 8  # to find a line's slope
_BENDS = 0.0, 0.05, 0.1, 0.2, 0.4  # upwards, quadratic, over local spacings squared
_KINKS = 0.5, 1.0, 2.0, 4.0  # upwards, linear, to the right, to the left or to both sides
_STIFFNESS = 0.15  # area that a bend must save, relative to what it covers itself
_BEYOND = 0.07, 0.04  # the rim lies this far past the line, local spacings: of samples at random, evenly spaced ones
_FARTHEST = 1.5  # and at most this far past a sample that is in no gap in the sampling
_RAISED, _TURNED = 0.2, 0.2  # local spacings further out, at least, that a gap's rim lies; cosine to the way out
_REACH, _LINES = 2.0, 4  # local spacings from a line's sample to others it bounds; lines tried for each
_FAR_REACH, _AT_CORNERS, _TURNED_OFF = 3.0, 16, 0.5  # of samples in gaps, at corners; largest cosine of rims there
_CHUNK = 512  # rim samples


def with_rim_lines(rims: Rims, cloud: Cloud, progress=None) -> Rims:
    """The rims with margins up to the lines through their outermost samples, or across gaps in the sampling, and with
    patches of other samples, bridged gaps too, ended at those lines."""
    row, spacing = np.flatnonzero(_at_rims(rims)), cloud.spacing
    if not len(row):
        return rims
    lines = _lines_over(row, rims.outward[row], cloud, Progress.of(progress))
    margin, size = rims.margin.copy(), spacing[row]
    margin[row, 0] = size * lines.margin(lines.height / np.sqrt(1 + lines.slope**2))

    other = np.flatnonzero(~rims.open)
    way, distance = _nearest_line(lines, other, cloud)
    known = RIM * spacing
    known[other] = np.where(np.isfinite(distance), distance, known[other])
    known[row] = margin[row, 0]
    ends = rims.ends[row] / size[:, None, None]
    along, up = (np.einsum("rei,ri->re", ends, axis) for axis in (lines.tangent, lines.up))
    over = (lines.at(along) - up) / np.sqrt(1 + lines.slope**2)[:, None]
    margin[row, 1:] = np.minimum(size[:, None] * lines.margin(over.T).T, known[rims.beside[row]])

    in_gap = np.isinf(lines.farthest)
    across = row[in_gap]
    reach = rims.reach.copy()
    reach[across] = margin[across, 0]
    corner = _nearest_line(lines, across, cloud, lines.up[in_gap])
    lines_at = (np.concatenate(pair) for pair in zip((other, way, distance), (across, *corner), strict=True))
    return _ended(replace(rims, margin=margin, reach=reach), *lines_at, spacing)


def _at_rims(rims):
    """Which samples lie at rims, (n,) bool, not at gaps in the sampling."""
    rim = rims.open
    chain = chains(rims, rim)
    length = np.bincount(chain)
    wide = np.bincount(chain, rims.opening) < _WIDE * length
    return rim & ((length >= _CHAIN) | (wide & (length >= _SHORT)))[chain]


def _ended(rims, sample, way, distance, spacing):
    """The rims with patches of samples (m,) ended at lines in directions (m,3) and distances (m,), where those are
    shorter than the patches reach and no two creases do so already."""
    ended = distance < np.maximum(spacing, rims.farthest)[sample]
    crease, limit = rims.crease.copy(), rims.limit.copy()
    slot = np.isfinite(limit[sample, 0]).astype(int)
    ended &= ~np.isfinite(limit[sample, slot])
    limit[sample[ended], slot[ended]] = distance[ended]
    crease[sample[ended], slot[ended]] = way[ended]
    return replace(rims, crease=crease, limit=limit)


class _Lines:
    """Rim lines over samples, in local spacings: height along `up` (r,3) at places along `tangent` (r,3).

    beyond   : (r,) how far past the line the rim lies
    farthest : (r,) how far past its sample it may
    """

    def __init__(self, row, up, normals, height, slope, bend, beyond):
        self.row, self.up, self.tangent = row, up, np.cross(normals, up)
        self.height, self.slope, self.bend, self.beyond = height, slope, bend, beyond
        self.farthest = np.full(len(row), _FARTHEST)

    def lay_over(self, gaps: RimGaps, normals, spacing):
        """Take the rim across gaps in the sampling instead, where it lies further out there."""
        of, row = gaps.of, self.row[gaps.of]
        height = gaps.depth / spacing[row]
        own = np.minimum(self.height[of] / np.sqrt(1 + self.slope[of] ** 2), _FARTHEST)
        higher = height > own + _RAISED
        higher &= row_dots(gaps.up, self.up[of]) > _TURNED
        of, row = of[higher], row[higher]
        self.up[of], self.tangent[of] = gaps.up[higher], np.cross(normals[row], gaps.up[higher])
        self.height[of], self.slope[of], self.bend[of], self.farthest[of] = height[higher], 0.0, 0.0, np.inf

    def margin(self, height):
        """How far the rims lie past places so far below the lines, (...,r)."""
        return np.clip(height + self.beyond, 0, self.farthest)

    def at(self, along, of=slice(None)):
        """Height of lines (r,) at places (r,p) along them."""
        return self.height[of, None] + self.slope[of, None] * along + _bent(self.bend[of], along)

    def steepness(self, along, of):
        """Slope of lines (m,) at one place each, (m,)."""
        quadratic, right, left = self.bend[of].T
        return self.slope[of] + 2 * quadratic * along + np.where(along > 0, right, -left)


def _lines_over(row, outward, cloud, progress):
    """The rim lines over samples `row` (r,) with ways out of the sheet (r,3), across gaps in the sampling."""

    def lay(part):
        return _lines(row[part], outward[part], cloud)

    found = [lines for _, lines in in_order(lay, progress.part(0.0, 0.5).chunks(len(row), _CHUNK))]
    usual, at_random = spacing_around(row, cloud)
    fits = (np.concatenate(each) for each in zip(*found, strict=True))
    lines = _Lines(row, outward.copy(), cloud.normals[row], *fits, np.where(at_random, *_BEYOND))
    gaps = find_rim_gaps(row, outward, usual, at_random, cloud, progress.part(0.5, 1.0))
    lines.lay_over(gaps, cloud.normals, cloud.spacing)
    return lines


def _lines(row, outward, cloud):
    """Heights, slopes (r,) and bends (r,3) of the lines of least area over samples `row`."""
    around = beside(row, outward, cloud.spacing[row], cloud, _WINDOW, _NEAREST)
    along, up = around.outermost(_WINDOW, _BINS)
    least = np.full(len(row), np.inf)
    height, slope, bend = np.zeros(len(row)), np.zeros(len(row)), np.zeros((len(row), 3))
    for tried in _shapes():
        a, b = lowest_lines(along, up - _bent(tried, along), _HALVINGS)
        own = tried[0] * around.window**2 / 3 + (tried[1] + tried[2]) * around.window / 4
        area = a + (1 + _STIFFNESS) * own
        less = area < least
        least[less], height[less], slope[less], bend[less] = area[less], a[less], b[less], tried
    return height, slope, bend


def _shapes():
    """Bends that are tried: quadratic, right, left."""
    both = [(0.0, right, left) for kink in _KINKS for right, left in ((kink, 0.0), (0.0, kink), (kink, kink))]
    return np.array([(bend, 0.0, 0.0) for bend in _BENDS] + both)


def _bent(bend, along):
    quadratic, right, left = (bend[..., k, None] for k in range(3))
    return quadratic * along**2 + right * np.maximum(along, 0) + left * np.maximum(-along, 0)


def _nearest_line(lines, other, cloud, across=None):
    """Unit direction (m,3) towards the nearest line and distance (m,) to the rim there for samples `other`, inf where
    none of the nearest rim samples' lines is that of their sheet; with directions `across` (m,3), of the rims that turn
    off those at corners."""
    points, normals, spacing = cloud.points, cloud.normals, cloud.spacing
    most, reach = (_LINES, _REACH) if across is None else (_AT_CORNERS, _FAR_REACH)
    far, near = k_nearest(KDTree(points[lines.row]), points[other], most, workers=-1)
    way, found = np.zeros((len(other), 3)), np.full(len(other), np.inf)
    for far_k, of in zip(far.T, near.T, strict=True):
        row = lines.row[of]
        step, size = points[other] - points[row], spacing[row]
        along, up = (row_dots(step, axis) / size for axis in (lines.tangent[of], lines.up[of]))
        towards = lines.up[of] - lines.steepness(along, of)[:, None] * lines.tangent[of]
        length = np.linalg.norm(towards, axis=1)
        distance = size * (np.maximum((lines.at(along[:, None], of)[:, 0] - up) / length, 0) + lines.beyond[of])
        closer = one_sheet(step, normals[row], normals[other]) & (far_k < reach * size) & (distance < found)
        if across is not None:
            closer &= row_dots(lines.up[of], across) < _TURNED_OFF
        found[closer], way[closer] = distance[closer], towards[closer]
    return unit(way - row_dots(way, normals[other])[:, None] * normals[other]), found
