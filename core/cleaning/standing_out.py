"""Samples that stand out above a surface while those around them do not."""

import numpy as np
from scipy.spatial import KDTree

from ..neighbourhoods.quadrics import fit_quadrics, quadrics_at
from ..progress import Progress
from ..trees import k_nearest
from .surroundings import FEWEST, NEIGHBOURS, Surroundings

_AT_ITS_HEIGHT = 24, 6, 0.15  # samples with itself; so many this close to its height, over their spacing, are a sheet
_PROUD = 1.2, 0.9, 8.0  # spacing over that of the neighbours; off their plane, over their spacing, and over theirs
_FITTED = 20  # neighbours of the quadrics that heights are measured against
_SUSPECT = 1.4  # spacing over that of the neighbours
_HOVERING = 7.5  # distance from the quadric over the largest of the medians around each neighbour
_FAR = 0.3  # and over the local spacing; of the neighbours' plane, too
_PLANES = 16, 0.15, 2  # the nearest; off their planes, over their spacing, and of how many of these where sheets cross
_SMOOTH = 0.01  # the medians above over the local spacing, where the surface below is smooth
_TURNED = 0.85  # cosine between its normal and those of such planes then, at most: those along a bent surface turn less


def proud(around: Surroundings) -> np.ndarray:
    """(n,) bool: which samples are a little lonely and off their neighbours' plane, where none of these is."""
    lonely, off, over_theirs = _PROUD
    found = (around.lonely > lonely) & (around.off > off) & ~around.wire
    return _in_no_sheet(around, _standing_out(around, found, around.off, over_theirs))


def hovering(around: Surroundings, progress: Progress) -> np.ndarray:
    """(n,) bool: which samples are far off the quadric of their neighbours, where these are not.

    Strays hide those beside them: what may be one is measured against the surface of all the others.
    """
    points = around.points
    height = fit_quadrics(points, np.arange(len(points)), _FITTED, progress.part(0.0, 0.6)).left_out()
    higher = (around.off > _FAR) & (height > _FAR * around.spacing)
    suspect = (_standing_out(around, higher, height, 1.0) | (around.lonely > _SUSPECT)) & ~around.wire
    suspect = _in_no_sheet(around, suspect)
    row, rest = np.flatnonzero(suspect), np.flatnonzero(~suspect)
    if not len(row) or len(rest) < FEWEST:
        return np.zeros(len(points), bool)
    surface, tree = points[rest], KDTree(points[rest])
    near = k_nearest(tree, points[row], NEIGHBOURS)[1]
    around_near, row_near = np.unique(k_nearest(tree, surface[near], NEIGHBOURS + 1)[1], return_inverse=True)
    theirs = fit_quadrics(surface, around_near, _FITTED, progress.part(0.6, 0.8)).left_out()[row_near]
    theirs = np.median(theirs.reshape(*near.shape, -1), axis=2).max(axis=1)
    below = quadrics_at(surface, points[row], _FITTED, progress.part(0.8, 1.0))
    spacing = np.median(around.spacing[rest[near]], axis=1)
    above = below.height > np.maximum(_HOVERING * theirs, _FAR * spacing)
    cross = _where_sheets_cross(around, row, rest, tree, below.normal, theirs < _SMOOTH * spacing)
    suspect[row] = above & ~cross
    return suspect


def _where_sheets_cross(around, row, rest, tree, normal, smooth):
    """Which of samples `row` (m,) lie in the planes of several of those near among `rest`, of which the tree is; where
    the surface below, of normals (m,3), is `smooth`, (m,) bool, in planes that are turned from it."""
    count, close, several = _PLANES
    near = rest[k_nearest(tree, around.points[row], count)[1]]
    height = np.einsum("mki,mki->mk", around.points[row, None] - around.centre[near], around.across[near])
    turned = ~smooth[:, None] | (np.abs(np.einsum("mi,mki->mk", normal, around.across[near])) < _TURNED)
    return (turned & (np.abs(height) < close * around.spacing[near])).sum(axis=1) >= several


def _standing_out(around, found, height, times):
    """Which of the samples `found` have so many times the largest of the median heights around each neighbour."""
    row, neighbours = np.flatnonzero(found), around.neighbours
    theirs = np.median(height[neighbours[neighbours[row]]], axis=2).max(axis=1)
    found[row] = height[row] > times * theirs
    return found


def _in_no_sheet(around, found):
    """Which of the samples `found` lie in no sheet of their own close beside another one. Those that do have others
    around at their own height, over the flattest neighbourhood near them."""
    count, fewest, off = _AT_ITS_HEIGHT
    row = np.flatnonzero(found)
    points, near = around.points, around.neighbours[row, 1:]
    flattest = near[np.arange(len(row)), around.thickness[near].argmin(axis=1)]
    others = around.tree.query(points[row], k=range(2, min(count, len(points)) + 1))[1]
    height = np.einsum("mki,mi->mk", points[others] - points[row, None], around.across[flattest])
    found[row] = (np.abs(height) < off * around.spacing[flattest, None]).sum(axis=1) < fewest
    return found
