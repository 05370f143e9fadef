"""The surface near the samples, as distance and foot point of any query close to it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from ..given_arrays import finite_points, spacing_of, span_of
from ..linalg import COMPONENTS
from ..neighbourhoods.close_sheets import sheet_room
from ..neighbourhoods.cloud import Cloud
from ..normals.known import known_normals
from ..points import refuse_copies
from ..progress import Progress
from ..settings import Settings
from ..trees import k_nearest
from .curvature import bending
from .grid import Grid
from .patches import Patches
from .projection import NEAREST, Projection, project
from .rims.borders import Rims, find_rims
from .rims.line_creases import samples_beside_creases
from .rims.line_gaps import with_line_gaps_bridged
from .rims.rim_lines import with_rim_lines
from .rims.sampling_gaps import with_openings_kept, with_sampling_gaps_bridged, with_sparser_parts_joined

_AROUND = 32  # samples, whose median spacing is that of a place
_SMALLEST, _LARGEST = 1e-7, 1e10  # span of the points


@dataclass(frozen=True)
class Columns:
    """What projections look up, component by component; all but the points float32.

    points : (3,n) float64     normals : (3,n)     bend : (6,n) xx, yy, zz, xy, xz, yz     spacing, room : (n,)
    """

    points: np.ndarray
    normals: np.ndarray
    bend: np.ndarray
    spacing: np.ndarray
    room: np.ndarray


@dataclass(frozen=True)
class LocalSurface:
    """Quadratic patches with rims, blended by the diffusion kernels.

    points, normals : (n,3) float64     spacing : (n,) float64, local spacing     bend : (n,3,3) float64
    confidence      : (n,) float64 in [0,1], of the normals
    room            : (n,) float64, half the distance to the sheet beside each one's own, see :func:`sheet_room`
    bridge          : gaps up to this many local spacings are closed
    source          : (n,) int64, the sample given that each is, or is added beside, see :mod:`.rims.line_creases`
    """

    points: np.ndarray
    normals: np.ndarray
    spacing: np.ndarray
    bend: np.ndarray
    confidence: np.ndarray
    room: np.ndarray
    bridge: float
    rims: Rims
    tree: KDTree
    source: np.ndarray

    @cached_property
    def columns(self) -> Columns:
        bend = np.stack([self.bend[:, a, b] for a, b in COMPONENTS])
        single = (np.ascontiguousarray(each, np.float32) for each in (self.normals.T, bend, self.spacing, self.room))
        return Columns(np.ascontiguousarray(self.points.T), *single)

    @cached_property
    def patches(self) -> Patches:
        return Patches.of(self.rims)

    def project(self, x: np.ndarray, progress=None, nearest: int = NEAREST) -> Projection:
        """Where queries (m,3) close to the surface fall on it, see :func:`project`."""
        return project(self, x, Progress.of(progress), nearest)

    def spacing_in_cells(self, grid: Grid) -> float:
        """The median local spacing, cells."""
        return float(np.median(self.spacing)) / grid.spacing

    def around(self, places: np.ndarray) -> np.ndarray:
        """The samples around places (m,3), whose median spacing is that of the place: the nearest 32, or all where
        there are fewer, (m,k) int."""
        return k_nearest(self.tree, places, _AROUND, workers=-1)[1]


def fit_local_surface(points, normals, confidence, spacing, bridge: float, progress=None) -> LocalSurface:
    """Patches and rims of samples (n,3) with axes (n,3) of any length, their confidence (n,) in [0,1] and
    local spacing (n,), units of the samples; gaps up to `bridge` spacings are closed. Some may be added beside creases,
    after those given, see :mod:`.rims.line_creases`. Raises :class:`InputError` for other shapes, what is not finite,
    points that occur twice, axes without a direction, spacings not above 0, and points that span more or less than
    single precision holds the fourth powers of, :class:`SettingsError` for a bridge outside its limits."""
    bridge = Settings(bridge=bridge).bridge
    progress, points = Progress.of(progress), finite_points(points, least=2)
    span_of(points, "powers of distances in single precision", _SMALLEST, _LARGEST)
    refuse_copies(points)
    normals, confidence = known_normals((normals, confidence), len(points), slice(None))
    spacing = spacing_of(points, spacing)
    given = points, normals, confidence, spacing, np.arange(len(points))
    local, cloud = _fitted(*given, bridge, None, progress.part(0.0, 0.9))
    added = samples_beside_creases(local.rims, cloud, progress.part(0.9, 0.92))
    if not len(added.beside):
        return local
    more = added.points, added.normals, confidence[added.beside], spacing[added.beside], added.beside
    given = (np.concatenate(pair) for pair in zip(given, more, strict=True))
    return _fitted(*given, bridge, added, progress.part(0.92, 1.0))[0]


def _fitted(points, normals, confidence, spacing, source, bridge, added, progress):
    """The local surface of samples, the last of which may be `added`, and the samples with those around each."""
    cloud = Cloud.of(points, normals, spacing, progress.part(0.0, 0.1))
    room = sheet_room(cloud, progress.part(0.1, 0.2))
    bend = bending(cloud, room, progress.part(0.2, 0.5))
    rims = find_rims(cloud, bend, bridge, progress.part(0.5, 0.84))
    rims = with_openings_kept(rims, cloud, bridge, progress.part(0.84, 0.86))
    rims = with_sparser_parts_joined(rims, cloud, bridge, progress.part(0.86, 0.87))
    rims = with_line_gaps_bridged(rims, cloud, bridge, progress.part(0.87, 0.88))
    if added is not None:
        rims = added.joined(rims, cloud)
    rims = with_sampling_gaps_bridged(rims, cloud, bend, bridge, progress.part(0.88, 0.9))
    rims = with_rim_lines(rims, cloud, progress.part(0.9, 1.0))
    return LocalSurface(points, normals, spacing, bend, confidence, room, bridge, rims, cloud.tree, source), cloud
