"""A first look from places near the surface onto it, with as few projections as will do."""

import numpy as np

from ..field.grid import Grid
from ..field.local_surface import LocalSurface
from ..field.steps import NearBand


def first_steps(
    x: np.ndarray, band: NearBand, surface: LocalSurface, grid: Grid, progress=None
) -> tuple[np.ndarray, np.ndarray]:
    """Steps (m,3) float64 to places x (m,3) from their foot points, and whether these lie on a rim, (m,) bool.

    Between nodes whose steps are known, and do not part, the steps are read off those; where they are not, and where a
    rim is near, x is projected. Steps read off are some thousandths of a cell from projected ones on smooth sheets, and
    more where several are near: places that are to end on the surface need a projection afterwards.
    """
    cells = (x - grid.origin) / grid.spacing
    row = np.flatnonzero(((cells >= 0) & (cells <= np.array(grid.shape) - 1)).all(axis=1))
    read, between = band.between(cells[row], grid.shape, grid.spacing, off_rims=True)
    row = row[read]
    rest = np.ones(len(x), bool)
    rest[row] = False
    found = surface.project(x[rest], progress)
    step, past_rim = np.empty_like(x), np.zeros(len(x), bool)
    step[row], step[rest], past_rim[rest] = between, found.step, found.past_rim
    return step, past_rim
