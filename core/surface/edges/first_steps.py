"""A first look from places near the surface onto it, with as few projections as will do."""

import numpy as np

from ...field.grid import Grid
from ...field.local_surface import LocalSurface
from ...field.steps import NearBand
from ...parallel import even_chunks, in_order
from ...progress import Progress

_CHUNK = 1 << 15  # places


def first_steps(
    x: np.ndarray, band: NearBand, surface: LocalSurface, grid: Grid, progress=None
) -> tuple[np.ndarray, np.ndarray]:
    """Steps (m,3) float64 to places x (m,3) from their foot points, and whether these lie on a rim, (m,) bool.

    Between nodes whose steps are known, and do not part, the steps are read off those; where they are not, and where a
    rim is near, x is projected. Steps read off are some thousandths of a cell from projected ones on smooth sheets, and
    more where several are near: places that are to end on the surface need a projection afterwards.
    """
    progress = Progress.of(progress)
    step, past_rim, rest = np.empty_like(x), np.zeros(len(x), bool), np.ones(len(x), bool)

    def read(part):
        cells = (x[part] - grid.origin) / grid.spacing
        inside = np.flatnonzero(((cells >= 0) & (cells <= np.array(grid.shape) - 1)).all(axis=1))
        row, between = band.between(cells[inside], grid.spacing, off_rims=True)
        return part.start + inside[row], between

    for _, (row, between) in in_order(read, even_chunks(len(x), _CHUNK, progress.part(0.0, 0.3))):
        step[row], rest[row] = between, False
    found = surface.project(x[rest], progress.part(0.3, 1.0))
    step[rest], past_rim[rest] = found.step, found.past_rim
    return step, past_rim
