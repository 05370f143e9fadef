"""Noisy samples, moved onto the surface that their neighbours share.

The paper alternates between normals and offsets along them (section 4.3, `benchmarks.alternation`) on the Voronoi
diagram, which noise breaks first. Robust quadrics through the neighbours need no diagram, and their normals come with
them; by these, edges stay (see :mod:`.meeting_sheets`).
"""

import numpy as np
from scipy.spatial import KDTree

from ..given_arrays import spacing_of, workable_points
from ..linalg import shortened
from ..neighbourhoods.clusters import Clusters
from ..neighbourhoods.quadrics import fit_quadrics
from ..points import refuse_copies
from ..progress import Progress
from ..settings import Settings
from .meeting_sheets import onto_one_sheet
from .noise import noisy_samples
from .noise_level import LADDER, estimate_noise
from .voxels import find_voxels

LONGEST_MOVE = 4.0  # standard deviations of the noise

_SHARES = 0.7, 0.6, 0.25  # of the best single neighbourhood, pass by pass, which together average over more than one;
# the last takes out what is left between samples side by side
_LEFT = 1.0, 0.5, 0.35  # of the noise, before each pass
_STEPS_PER_OCTAVE = 2  # of the neighbourhood sizes used


def denoise(points, spacing, strength: float | str = "auto", seed: int = 0, progress=None) -> tuple[np.ndarray, dict]:
    """Samples moved towards quadrics through their neighbours, and what was done, for the report.

    points   : (n,3) float64     spacing : (n,) float64, local spacing, same units
    strength : "auto" moves the samples that are found noisy; a number in [0,1] moves all this share of the way (0 none)

    No sample moves further than LONGEST_MOVE times the noise estimated around it. Returns the very array given where
    nothing is to do. Raises :class:`InputError` for points that are not finite, that powers of distances between cannot
    be worked with, or that occur twice, and for spacings that are none, :class:`SettingsError` for another strength or
    seed.
    """
    progress, given, points = Progress.of(progress), points, workable_points(points)
    spacing = spacing_of(points, spacing)
    strength = Settings(denoise=strength, seed=seed).denoise
    if len(points) <= LADDER[0] or strength == 0:
        return given, {}
    refuse_copies(points)
    voxels = find_voxels(points, seed)
    if strength == "auto":
        noisy, strength = noisy_samples(points, spacing, seed, progress.part(0.0, 0.1), voxels), 1.0
    else:
        noisy = np.ones(len(points), bool)
    if not noisy.any():
        return given, {}
    least = 0.0 if voxels is None else voxels.noise
    noise = estimate_noise(points, seed, progress.part(0.1, 0.4), noisy, least)
    sizes = [_rounded(share * noise.neighbours, len(points)) for share in _SHARES]
    moved = points
    for turn, neighbours in enumerate(sizes):
        left = _LEFT[turn] * noise.level
        moved = _onto_sheets(moved, noisy, neighbours, left, progress.part(0.4 + 0.2 * turn, 0.6 + 0.2 * turn))
    step = shortened(strength * (moved - points), LONGEST_MOVE * noise.level)
    counts = {
        "noisy": int(noisy.sum()),
        "noise": float(np.median(noise.level[noisy])),
        "neighbours": [int(k) for k in np.percentile(sizes[0][noisy], (5, 50, 95), method="nearest")],
        "mean_move": float(np.linalg.norm(step[noisy], axis=1).mean()),
    }
    return points + step, counts if voxels is None else counts | {"voxel": voxels.side}


def _rounded(neighbours, n):
    """Few distinct sizes, from the ladder's smallest to n - 1."""
    steps = np.rint(_STEPS_PER_OCTAVE * np.log2(neighbours))
    return np.clip(np.rint(2 ** (steps / _STEPS_PER_OCTAVE)).astype(int), LADDER[0], n - 1)


def _onto_sheets(points, noisy, neighbours, level, progress):
    """Points moved onto quadrics through their neighbours, near edges onto those of one face, see
    :mod:`.meeting_sheets`."""
    step, normal, spread = np.zeros_like(points), np.zeros_like(points), np.zeros(len(points))
    moved, clusters, tree = points.copy(), Clusters(points), KDTree(points)
    sizes = [(int(k), np.flatnonzero(noisy & (neighbours == k))) for k in np.unique(neighbours[noisy])]
    for (k, rows), part in progress.part(0.0, 0.6).turns(sizes):
        fit = fit_quadrics(points, rows, k, part, clusters)
        step[rows], normal[rows], spread[rows] = fit.step, fit.normal, fit.spread
    for (k, rows), part in progress.part(0.6, 1.0).turns(sizes):
        moved[rows] += onto_one_sheet(tree, rows, k, (step, normal, spread), level, part)
    return moved
