"""Sheets side by side, closer than the samples on each, as the two of a thin wall: how far apart they are.

Which sheet a sample lies on is told from its neighbours. On one sheet, two samples with normals turned alike are off
each other's tangent plane by opposite heights, but for terms of third order: their mean is next to nothing on the same
sheet, and the distance of the sheets on another. The two are told apart where a wide step lies between.
"""

import numpy as np

from ..linalg import dots, medians
from ..parallel import even_chunks, work_through
from ..progress import Progress
from .cloud import Cloud

PARALLEL = 0.8  # least |n_i . n_j| of samples on sheets side by side
_LEVEL = 0.01  # local spacings, that samples of one sheet may be off each other anyway
_STEP = 3.0  # times as far as the last of its own sheet is the first of another off a sample, at least
_FEWEST = 3  # neighbours on either sheet
_SPREAD = 2.0  # times as far as the first of them are those of the other sheet off, at most
_CLOSE = 1.0  # local spacings, at most; farther sheets are told apart without this
_SHARE = 0.3  # of the samples around, at least, with two sheets
_CHUNK = 4096  # samples


def sheet_room(cloud: Cloud, progress=None) -> np.ndarray:
    """Half the distance to the sheet beside each sample's own, (n,) float64 in units of the points: inf where none is
    closer than a local spacing, or the sheets are not told apart."""
    seen, room, progress = np.empty(len(cloud)), np.full(len(cloud), np.inf), Progress.of(progress)
    columns = np.ascontiguousarray(cloud.points.T), np.ascontiguousarray(cloud.normals.T)

    def look(part):
        seen[part] = 0.5 * _nearest_sheet(*columns, part, cloud.spacing[part], cloud.neighbours[part])

    def agree(part):
        around = seen[cloud.neighbours[part]]
        two = np.isfinite(around)
        several = two.mean(axis=1) > _SHARE
        room[part][several] = medians(np.where(two, around, np.nan)[several])

    work_through(look, even_chunks(len(cloud), _CHUNK, progress.part(0.0, 0.9)))
    work_through(agree, even_chunks(len(cloud), _CHUNK, progress.part(0.9, 1.0)))
    return room


def off_sheets(step, agreement, height, theirs):
    """How far samples at steps (3,...) from others are off the sheets of these, (...)."""
    return 0.5 * np.abs(height + np.sign(agreement) * dots(step, theirs))


def off_neighbours(points, normals, rows, neighbours):
    """Steps (3,m,k) from some samples to their neighbours (m,k), the cosines between their normals, (m,k), and how far
    these are off the sheets of those, (m,k); points and normals component by component, (3,n)."""
    step = [column.take(neighbours) - column[rows, None] for column in points]
    own, theirs = normals[:, rows, None], [column.take(neighbours) for column in normals]
    agreement = dots(theirs, own)
    return step, agreement, off_sheets(step, agreement, dots(step, own), theirs)


def _nearest_sheet(points, normals, rows, spacing, neighbours):
    """How far the nearest other sheet is off that of each of some samples, inf where there is none; points and normals
    component by component, (3,n)."""
    if neighbours.shape[1] < 2 * _FEWEST:
        return np.full(len(spacing), np.inf)
    step, agreement, off = off_neighbours(points, normals, rows, neighbours)
    along = np.sqrt(np.maximum(dots(step, step) - off**2, 0))
    off[np.abs(agreement) < PARALLEL] = np.inf

    order = np.argsort(off, axis=1)
    off, along = np.take_along_axis(off, order, axis=1), np.take_along_axis(along, order, axis=1)
    first, third = off[:, _FEWEST : 1 - _FEWEST], off[:, 2 * _FEWEST - 1 :]  # of another sheet, if it begins there
    last = np.maximum(off[:, _FEWEST - 1 : -_FEWEST], _LEVEL * spacing[:, None])
    clear = np.isfinite(third) & (third < _SPREAD * first)
    rise = np.where(clear, first, 0.0) / last
    every, own = np.arange(len(off)), rise.argmax(axis=1)
    apart, beside = first[every, own], np.arange(off.shape[1]) >= _FEWEST + own[:, None]
    beneath = np.where(beside & np.isfinite(off), along, np.inf).min(axis=1)
    within = np.sort(np.where(beside, np.inf, along), axis=1)[:, _FEWEST - 1]
    found = (rise[every, own] > _STEP) & (apart < _CLOSE * spacing) & (beneath < within)
    return np.where(found, apart, np.inf)
