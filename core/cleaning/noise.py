"""Which samples are noisy."""

import numpy as np
from scipy.spatial import KDTree

from ..normals.mirrors import Mirrors
from ..normals.reflection import reflection_sweeps
from ..progress import Progress
from ..voronoi.facets import voronoi_facets
from .anchors import SMOOTHING, nearest_anchor, some_samples
from .averaged import cells_of_means
from .flat_patches import shows_flat_patches
from .roughness import least_part, roughness
from .thin_walls import find_two_sheets
from .voxels import Voxels, find_voxels

_FEWEST = 100  # samples; fewer say nothing about noise
_AGREED = 0.96  # median confidence of normals that noise of a tenth of a local spacing does not reach
_TURNED = 1.5  # times the squared level, in local spacings, that slight noise takes off the confidence of normals
_CORE_LEVEL = 0.1  # local spacings: the core of a noisy part is above this
_CORE_AGREED = 0.87  # and its normals agree less than this; creases and thin sheets kept above .88
_PATCHES, _PATCH = 16, 300  # patches of a large cloud in which normals are asked, samples in each
_MIDDLE = 100  # of these, those whose neighbours are all there
_SWEEPS = 20  # more change the median confidence by less than .0005 where it is above .9
_STAIRS, _UNEVEN = 0.2, 0.03  # share of samples in a region of voxels, and local spacings off quadrics, at least


def looks_noisy(points, spacing) -> bool:
    """Whether samples (n,3) with local spacing (n,) are as far off quadrics as noisy ones are, or voxels; quick, and
    less sure than :func:`noisy_samples`, which asks the normals as well."""
    if len(points) < _FEWEST:
        return False
    found, voxels = roughness(points, spacing, 0, Progress()), find_voxels(points)
    return found.whole or (voxels is not None and _around_stairs(found, voxels).any())


def noisy_samples(points, spacing, seed: int = 0, progress=None, voxels: Voxels | None = None) -> np.ndarray:
    """(n,) bool: which samples (n,3) with local spacing (n,) are noisy, rather than too few for some of the detail.

    Judged by how far each sample lies off the quadric through its neighbours, in local spacings. Noise looks alike from
    12 and from 20 neighbours and, unless it is heavy, from 32; unresolved detail grows. Sheets closer than their
    samples look like noise to the quadrics, but normals agree there from sample to sample, as in no noise.

    A cloud is noisy as a whole where nearly all of it looks so; noise of hundredths of a local spacing, as of rounded
    coordinates, counts where it grows no more up to 32 neighbours, either. Otherwise its noisy parts are those that
    look so throughout, or around a core that is well above all limits and not small: creases and thin sheets look noisy
    in places. Nothing is noisy where samples show two sheets that are hardly farther apart than the noise would be, see
    :mod:`.thin_walls`, or that they lie on flat faces, see :mod:`.flat_patches`.

    Samples of `voxels` always lie in layers and on flat faces, so neither is asked of them; they are noisy around
    stairs as well.
    """
    clean = np.zeros(len(points), bool)
    if len(points) < _FEWEST:
        return clean
    progress = Progress.of(progress)
    found = roughness(points, spacing, seed, progress)
    for suspect, part in _noisy_anchors(points, spacing, found, voxels, seed, progress.part(0.1, 0.9)):
        if suspect.any():
            level, beside = np.median(found.relative[suspect]), suspect[found.region[:, :SMOOTHING]]
            amid = suspect & beside.all(axis=1)
            amid = found.anchors[amid if amid.any() else suspect]
            suspect = beside.any(axis=1)  # noise left beside would stand out as a seam
            if voxels is not None or not _seems_only(points, spacing, found.anchors[suspect], amid, level, seed, part):
                break
    else:
        return clean
    return suspect[nearest_anchor(points, points[found.anchors], progress.part(0.9, 1.0))]


def _seems_only(points, spacing, anchors, amid, level, seed, progress):
    """Whether samples that seem to have noise of `level` local spacings at some anchors have none. Where they show
    two sheets, as of thin walls, they have none unless these are scans shifted against each other, or means of cells as
    wide as the sheets are apart; elsewhere they have none if they lie on flat faces. Those are looked for at the
    anchors `amid` alone: beside noise a smooth surface looks flat."""
    sheets = find_two_sheets(points, spacing, anchors, level, progress)
    if sheets is None:
        return shows_flat_patches(points, spacing, amid, level)
    cell = cells_of_means(points, spacing, seed)
    return (cell is None or sheets.typical_half > 0.5 * cell) and not sheets.are_scans()


def _noisy_anchors(points, spacing, found, voxels, seed, progress):
    """Yields anchors that may be noisy, (m,) bool, each time with a slice of the progress for a closer look at them: of
    voxels those around stairs; all, where the cloud is noisy as a whole; and those in its noisy parts. The latter two
    are told by how rough they are and how far normals agree."""
    if voxels is not None:
        yield _around_stairs(found, voxels), progress.part(0.0, 0.0)
    if found.whole:
        agreement = _typical_agreement(points, spacing, seed, progress.part(0.0, 0.3))
        turned = agreement < 1 - _TURNED * np.median(found.relative) ** 2
        if (found.loud and agreement < _AGREED) or (found.slight and turned):
            yield np.ones(len(found.anchors), bool), progress.part(0.3, 0.4)
    parts = found.even
    if found.suspect.sum() >= least_part(found.anchors):
        parts = parts | _around_loud_cores(found, _agreement(points, spacing, progress.part(0.4, 0.8)))
    yield parts, progress.part(0.8, 1.0)


def _around_stairs(found, voxels):
    """Which anchors are in regions of stairs, or beside one in such, (m,) bool. Stairs all of which lie on one plane
    are that plane."""
    stairs = voxels.stairs(found.anchors)[found.region].mean(axis=1) > _STAIRS
    return (stairs & (found.relative > _UNEVEN))[found.region].any(axis=1)


def _around_loud_cores(found, confidence):
    """Which anchors look noisy to normals with such a confidence (n,), too, around a core that does most of all, (m,)
    bool; none where that is small."""
    agreement = np.median(confidence[found.anchors][found.region], axis=1)
    suspect = found.suspect & (agreement < _AGREED)
    core = suspect & (found.relative > _CORE_LEVEL) & (agreement < _CORE_AGREED)
    return suspect & (core.sum() >= least_part(found.anchors)) & core[found.region].any(axis=1)


def _typical_agreement(points, spacing, seed, progress):
    """Median confidence of the samples; in a large cloud of those in the middle of some patches of nearest neighbours,
    which is within .011 of it on eight clouds of 5,000 to 20,000, with and without noise."""
    if len(points) <= _PATCHES * _PATCH:
        return np.median(_agreement(points, spacing, progress))
    centres = some_samples(points, _PATCHES, seed)
    patch = KDTree(points).query(points[centres], k=_PATCH)[1]
    rows = np.unique(patch)
    confidence = _agreement(points[rows], spacing[rows], progress)
    return np.median(confidence[np.searchsorted(rows, patch[:, :_MIDDLE])])


def _agreement(points, spacing, progress):
    """Confidence (n,) of normals that are not told apart at creases, where those of noise would be as well."""
    mirrors = Mirrors(points, spacing, voronoi_facets(points, spacing, progress=progress.part(0.0, 0.7)))
    return mirrors.confidence(reflection_sweeps(mirrors, progress=progress.part(0.7, 1.0), most=_SWEEPS)[0])
