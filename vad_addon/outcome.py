"""One run, from points to arrays that Blender can take as they are. Free of Blender: the worker process runs it too."""

import json
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from ..core import pipeline
from ..core.cleaning.clean import clean
from ..core.errors import VADError
from ..core.field.integration import near_band
from ..core.field.local_surface import fit_local_surface
from ..core.io.report import report_json
from ..core.io.vdb import write_vdb
from ..core.normals.estimate import checked_constraints, estimate_normals
from ..core.normals.known import known_normals
from ..core.points import prepare_samples
from ..core.progress import Progress
from ..core.prospect import look_ahead
from ..core.settings import Settings
from ..core.surface.attributes import nearest_samples, residuals
from ..core.surface.extract import extract_surfaces
from ..core.surface.facts import mesh_facts
from . import stored_field

CLEANING, NORMALS, ALL = "cleaning", "normals", "all"  # how far a run goes
COST = "cost"  # no run, but what its cost depends on
OTHERWISE = "choose another folder for temporary files in Blender's preferences"  # where a run finds no room


@dataclass(frozen=True)
class Task:
    """What a run is given, in input units.

    points      : (n,3) float64
    constraints : (indices (k,), axes (k,3)) or None
    until       : the last stage: CLEANING, NORMALS or ALL; or COST
    known       : (axes (n,3), confidence (n,)) of an earlier run, which is taken up after its normals, or None
    origin      : (3,) float64, exact in single precision, that results are to be relative to; None: their own centre
    volume      : .vdb file of the field that is `known` too, or None; :func:`stored_field.suffices` for these settings
    """

    points: np.ndarray
    settings: Settings
    constraints: tuple[np.ndarray, np.ndarray] | None = None
    until: str = ALL
    known: tuple[np.ndarray, np.ndarray] | None = None
    origin: np.ndarray | None = None
    volume: Path | None = None

    def save(self, path: Path) -> None:
        arrays = {"points": self.points}
        for name in _PAIRS:
            if (pair := getattr(self, name)) is not None:
                arrays |= {f"{name}.{part}": array for part, array in enumerate(pair)}
        if self.origin is not None:
            arrays["origin"] = self.origin
        if self.volume is not None:
            arrays["volume"] = str(self.volume)
        np.savez(path, **arrays, settings=json.dumps(asdict(self.settings)), until=self.until)

    @classmethod
    def load(cls, path: Path) -> "Task":
        with np.load(path) as file:
            arrays = dict(file)
        pairs = {name: (arrays[f"{name}.0"], arrays[f"{name}.1"]) for name in _PAIRS if f"{name}.0" in arrays}
        settings = Settings(**json.loads(str(arrays["settings"])))
        if "volume" in arrays:
            pairs["volume"] = Path(str(arrays["volume"]))
        return cls(arrays["points"], settings, until=str(arrays["until"]), origin=arrays.get("origin"), **pairs)


_PAIRS = "constraints", "known"


@dataclass(frozen=True)
class Skin:
    """A mesh of quads and triangles and what its vertices know.

    vertices : (v,3) float64 in input units     quads     : (q,4) int32
    nearest  : (v,) int64, the nearest sample   triangles : (t,3) int32
    distance : (v,) float64, how far off, in input units
    """

    vertices: np.ndarray
    quads: np.ndarray
    triangles: np.ndarray
    nearest: np.ndarray
    distance: np.ndarray


_SKINS = "surface", "sheet"


@dataclass(frozen=True)
class Outcome:
    """What a run found, in input units; see :class:`core.Reconstruction` for points, source_index, normals, confidence.

    A run that ends after the cleaning has no normals and no confidence (None). One that ends before the field has no
    surface, sheet and volume; its `cell` is the median spacing and its `shape` is empty.

    surface  : Skin of the double cover or of the signed surface, or None
    sheet    : Skin of the single layer, or None
    volume   : .vdb file of the field, relative to `origin`, or None; it belongs to whoever takes the outcome, unless it
               is the task's
    origin   : (3,) float64, centre of the samples, exact in single precision
    cell     : float, spacing of the field's grid
    shape    : nodes of the grid along each axis
    report   : JSON text
    warnings : what went less than well, one line each
    seconds  : duration of the reconstruction
    spacing  : (n',) float64, local spacing of the points, if asked for COST
    noisy    : whether they look noisy, if asked for that
    crowded  : share of them where sheets run close, if asked for that, see :func:`crowded_share`
    suited   : the resolution that suits them, if asked for that, see :class:`Prospect`
    """

    points: np.ndarray
    source_index: np.ndarray
    normals: np.ndarray | None
    confidence: np.ndarray | None
    surface: Skin | None
    sheet: Skin | None
    volume: Path | None
    origin: np.ndarray
    cell: float
    shape: tuple[int, ...]
    report: str
    warnings: tuple[str, ...]
    seconds: float
    spacing: np.ndarray | None = None
    noisy: bool | None = None
    crowded: float | None = None
    suited: int | None = None

    def save(self, path: Path) -> None:
        names = "points", "source_index", "normals", "confidence", "origin", "spacing"
        arrays = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        for skin in _SKINS:
            if (found := getattr(self, skin)) is not None:
                arrays |= {f"{skin}.{name}": array for name, array in vars(found).items()}
        told = "cell", "shape", "report", "warnings", "seconds", "noisy", "crowded", "suited"
        facts = {name: getattr(self, name) for name in told}
        facts["volume"] = self.volume and str(self.volume)
        np.savez(path, **arrays, facts=json.dumps(facts))

    @classmethod
    def load(cls, path: Path) -> "Outcome":
        with np.load(path) as file:
            arrays = dict(file)
        facts = json.loads(str(arrays.pop("facts")))
        facts |= dict(
            shape=tuple(facts["shape"]),
            warnings=tuple(facts["warnings"]),
            volume=Path(facts["volume"]) if facts["volume"] else None,
        )
        for skin in _SKINS:
            names = [name for name in arrays if name.startswith(f"{skin}.")]
            found = {name.partition(".")[2]: arrays.pop(name) for name in names}
            facts[skin] = Skin(**found) if found else None
        return cls(**dict.fromkeys(("normals", "confidence")) | arrays | facts)


def compute(task: Task, folder: Path, progress=None) -> Outcome:
    """Do the task, and write the volume into `folder`. A volume that cannot be written is a warning, no failure.

    Raises :class:`VADError` for what the core refuses and where memory runs out.
    """
    try:
        progress = Progress.of(progress)
        if task.volume:
            return _extracted(task, progress)
        return _reconstructed(task, folder, progress) if task.until == ALL else _begun(task, progress)
    except VADError:  # some are memory errors, too, with a reason of their own
        raise
    except MemoryError as error:
        raise VADError("Out of memory: lower the resolution, or give fewer points") from error


def _begun(task, progress):
    """The first stages alone."""
    start = time.perf_counter()
    if task.until == COST:
        found = look_ahead(task.points, task.settings, progress)
        spacing = found.samples.local_spacing()[found.samples.given_order()] * found.samples.scale
        told = {"noisy": found.noisy, "crowded": found.crowded, "suited": found.suited, "spacing": spacing}
        return _of_samples(task, found.samples, found.cleaning, start, **told)
    share = 0.5 if task.until == NORMALS else 1.0
    samples = prepare_samples(task.points, progress.part(0.0, 0.3 * share, "points")).in_spatial_order()
    samples, cleaning = clean(samples, task.settings, progress.part(0.3 * share, 0.7 * share, "cleaning"))
    spacing = samples.local_spacing(progress.part(0.7 * share, share, "cleaning"))
    if task.until != NORMALS:
        return _of_samples(task, samples, cleaning, start)
    constraints, ignored = checked_constraints(task.constraints, samples.source_index, len(task.points))
    part, row = progress.part(share, 1.0, "normals"), samples.given_order()
    normals, confidence, _ = estimate_normals(samples.points, spacing, task.settings, constraints, part)
    return _of_samples(task, samples, cleaning, start, ignored, normals=normals[row], confidence=confidence[row])


def _of_samples(task, samples, cleaning, start, warnings=(), **found):
    """The outcome of a run that ended before the field."""
    row = samples.given_order()
    nothing = dict.fromkeys(("normals", "confidence", "surface", "sheet", "volume"))
    return Outcome(
        points=samples.given[row],
        source_index=samples.source_index[row],
        origin=centre(samples.given),
        cell=float(np.median(samples.local_spacing())) * samples.scale,
        shape=(),
        report=report_json({"settings": asdict(task.settings), "cleaning": cleaning}),
        warnings=(*samples.warnings, *warnings),
        seconds=time.perf_counter() - start,
        **nothing | found,
    )


def _reconstructed(task, folder, progress):
    progress.part(0.0, 0.0, "points")(0.0)
    result = pipeline.reconstruct(
        task.points, task.settings, task.constraints, progress.part(0.0, 0.95), normals=task.known
    )
    origin = centre(result.points) if task.origin is None else task.origin
    finish = progress.part(0.95, 1.0, "volume")
    finish(0.0)
    warnings = list(result.report["warnings"])
    volume = folder / "field.vdb"
    try:
        write_vdb(volume, replace(result.field, origin=result.field.origin - origin), otherwise=OTHERWISE)
    except VADError as error:
        warnings.append(f"No volume: {error}")
        volume = None
    finish(1.0)
    return Outcome(
        points=result.points,
        source_index=result.source_index,
        normals=result.normals,
        confidence=result.confidence,
        surface=result.surface and _skin(result.surface, result),
        sheet=result.sheet and _skin(result.sheet, result),
        volume=volume,
        origin=origin,
        cell=result.field.spacing,
        shape=result.field.shape,
        report=report_json(result.report),
        warnings=tuple(warnings),
        seconds=sum(result.report["seconds"].values()),
    )


def _extracted(task, progress):
    """The surface alone, from the field in the task's volume; the report tells of what was done here only. How far off
    vertices are is measured on the local surface itself, not interpolated in the grid."""
    start, settings = time.perf_counter(), task.settings
    progress.part(0.0, 0.0, "points")(0.0)
    samples = prepare_samples(task.points)
    normals, confidence = known_normals(task.known, len(task.points), samples.source_index)
    grid, spacing = stored_field.grid_of(task.volume, task.origin, samples), samples.local_spacing()
    values = stored_field.distances(task.volume, grid.shape) / np.float32(samples.scale)
    part = progress.part(0.0, 0.2, "surface")
    local = fit_local_surface(samples.points, normals, confidence, spacing, settings.bridge, part)
    band = near_band(local, grid, progress.part(0.2, 0.5, "surface"))  # of which volumes hold the distances alone
    found = extract_surfaces(values, band, local, grid, settings, lambda x: x, progress.part(0.5, 0.9))
    skin = None
    if mesh := found.meshes.get("double"):
        off = np.linalg.norm(local.project(mesh.vertices, progress.part(0.9, 1.0)).step, axis=1) * samples.scale
        nearest = local.source[local.tree.query(mesh.vertices, workers=-1)[1]]
        skin = Skin(samples.to_input_units(mesh.vertices), mesh.quads, mesh.triangles, nearest, off)
    seconds = time.perf_counter() - start
    return Outcome(
        points=samples.given,
        source_index=samples.source_index,
        normals=normals,
        confidence=confidence,
        surface=skin,
        sheet=None,
        volume=task.volume,
        origin=task.origin,
        cell=grid.spacing * samples.scale,
        shape=grid.shape,
        report=report_json(
            {"settings": asdict(settings), "meshes": mesh_facts(found), "seconds": {"surface": seconds}}
        ),
        warnings=(*samples.warnings, *found.warnings),
        seconds=seconds,
    )


def _skin(mesh, result):
    return Skin(mesh.vertices, mesh.quads, mesh.triangles, nearest_samples(mesh, result), residuals(mesh, result))


def centre(points: np.ndarray) -> np.ndarray:
    """Centre of the bounding box of (n,3) points, rounded to what an object's location can hold exactly."""
    return (0.5 * (points.min(axis=0) + points.max(axis=0))).astype(np.float32).astype(np.float64)
