"""The command line: `python -m core reconstruct SCAN -o OUT` and `python -m core info SCAN`."""

import argparse
import shlex
import signal
import sys
import threading
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree
from tqdm import tqdm

from .budget import SUITED, estimate_cost
from .errors import Cancelled, InputError, MemoryBudgetError, MissingDependency, SettingsError, VADError
from .exit_status import BAD_INPUT, CANCELLED, DONE, REQUESTS_TO_END, TOO_LARGE
from .field.grid import fit_grid
from .io.atomic import together, writable_folder
from .io.faces import read_faces
from .io.npz import write_arrays
from .io.own_files import is_own
from .io.ply import write_mesh, write_points
from .io.points import READERS, read_points, read_scan
from .io.report import digest_of, report_json, report_of, write_report
from .io.vdb import write_vdb
from .modelled import MANY, Faces, missed_by_vertices
from .pipeline import reconstruct
from .points import first_of_each
from .prospect import look_ahead
from .reconstruction import Reconstruction
from .settings import Settings, default_in_words, options
from .surface.attributes import sample_attributes, vertex_attributes

PROGRAM = "python -m core"
_NO = "false", "no", "off", "0"  # after a flag, which takes none
_MESHES = {kind: f"_{kind}.ply" for kind in ("double", "single", "signed")}
_POINTS, _VOLUME, _ARRAYS, _REPORT = "_points.ply", ".vdb", ".npz", ".json"
_SAMPLED = "give points sampled all over its faces"
_REFINED = "subdivide it, or give points sampled all over its faces"
_BAR = "{percentage:3.0f}% |{bar}| {elapsed}  {desc}"

_DESCRIPTION = "Reconstruct a surface from a point cloud without normals: distance field, mesh and normals."
_EXAMPLE = f"""\
example:
  {PROGRAM} info bunny.ply
  {PROGRAM} reconstruct bunny.ply -o out --resolution 256

exit status:
  0    done
  2    the scan, an option or the output folder cannot be used: one line on stderr says what and how to help it
  3    the run would need more memory than it may have: the line says what would help
  130  cancelled by Ctrl-C or a request to end (SIGTERM, SIGHUP); no file is left half-written

With --json, stdout holds one JSON document and nothing else: the report, or {{"error": "..."}} beside the line on
stderr.
"""
_OUTPUTS = """\
files in the folder OUT, named after the scan, each written whole, or none where one cannot be put in place; one that
cannot be made, as the volume without OpenVDB, is left out with a warning:
  SCAN.vdb         OpenVDB grids: udf (distance to the surface; sdf where signed) and density (fog to look at)
  SCAN_double.ply  mesh: the closed two-sided cover of the surface (with --surface double or both)
  SCAN_single.ply  mesh: one layer, open where the surface is (with --surface single or both)
  SCAN_signed.ply  mesh: the boundary of a closed shape's inside (with --surface signed)
  SCAN_points.ply  the samples used, with normals (unit axes, the sign is arbitrary) and confidence
  SCAN.npz         NumPy arrays for other programs, with --arrays (numpy.load): values, origin, spacing, signed (the
                   field), gradient (at every node); with a band those of blocks of 8^3 nodes, with block (the lowest
                   node of each), shape and band; for the nodes near the surface node (i,j,k), direction (unit, away
                   from the surface) and foot (the nearest point of the surface)
  SCAN.json        settings, counts, seconds, warnings, the scan's path and SHA-256 (digest); written last
All are in the scan's own units and place. Vertices of meshes have the properties distance (how far off the surface)
and confidence (of the nearest sample). Meshes and points also carry what the points of a .ply do, of a table whose
columns have names or of a scanner's .pts: colours (red, green, blue), intensity and every other property that is one
number and no normal, with scan_ before its name where it has one of those two.
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line on `arguments` (default: those of the process) and return the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    with _heeding(REQUESTS_TO_END, signal.default_int_handler):
        return _status_of(arguments)


def _status_of(arguments):
    try:
        given = _parsed(arguments)
        given.run(given)
        return DONE
    except Cancelled as error:
        return _fail(error, CANCELLED, arguments)
    except MemoryBudgetError as error:
        return _fail(error, TOO_LARGE, arguments)
    except VADError as error:
        return _fail(error, BAD_INPUT, arguments)
    except MemoryError as error:
        return _fail(f"out of memory ({error}); use a lower resolution, a band or fewer points", TOO_LARGE, arguments)
    except KeyboardInterrupt:
        return _fail("cancelled", CANCELLED, arguments)
    except OSError as error:
        if error.filename is None:  # standard output cannot be written to
            raise
        return _fail(f"{error.filename}: {error.strerror}; see that it is there and yours", BAD_INPUT, arguments)


@contextmanager
def _heeding(numbers, handler):
    """Within, signals of these numbers go to the handler, but for those that are ignored, as Ctrl-C is for jobs in the
    background and the end of a terminal where nohup is asked for."""
    heeded = [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]
    previous = {number: signal.signal(number, handler) for number in heeded} if _in_main_thread() else {}
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)


def _in_main_thread():
    """Others cannot set handlers of signals."""
    return threading.current_thread() is threading.main_thread()


def _fail(error, status, arguments):
    line = " ".join(str(error).split())
    print(f"error: {line}", file=sys.stderr)
    if "--json" in arguments:
        print(report_json({"error": line}))
    return status


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, like every other error, rather than with a dump of the usage."""

    def error(self, message):
        raise SettingsError(f"{message}; see {self.prog} --help")

    def spelt(self):
        """Every option as it is spelt."""
        return list(self._option_string_actions)


def _parsed(arguments):
    """What was given. Raises :class:`SettingsError` for a scan without a command, with the two that there are, and for
    what no option takes, with the option that may be meant."""
    if arguments and Path(arguments[0]).suffix.lower() in READERS:
        scan = shlex.quote(arguments[0])
        raise SettingsError(
            f"no command before {scan}; its surface: {PROGRAM} reconstruct {scan} -o FOLDER; what it holds: {PROGRAM} "
            f"info {scan}"
        )
    given, unknown = _parser().parse_known_args(arguments)
    if unknown:
        meant = _meant(unknown[0], arguments[arguments.index(unknown[0]) - 1], given.spelt)
        raise SettingsError(
            f"unrecognized: {' '.join(unknown)}{f' (is {meant[0]} meant?)' if meant else ''}; {given.command} takes "
            f"one scan at a time, and the options of {PROGRAM} {given.command} --help"
        )
    return given


def _meant(unknown, before, spelt):
    """The option that may be meant by one that there is not, or by what follows one, `before`; one or none."""
    opposite = before.replace("--", "--no-", 1)
    if unknown.lower() in _NO and opposite in spelt:
        return [opposite]
    name = unknown.partition("=")[0]
    begun = list({option.replace("_", "-") for option in spelt if option.startswith(name)})
    return begun if len(begun) == 1 else get_close_matches(name, spelt, 1, 0.75)


def _parser():
    layout = argparse.RawDescriptionHelpFormatter
    parser = _Parser(
        prog=PROGRAM, description=_DESCRIPTION, epilog=_EXAMPLE, formatter_class=layout, allow_abbrev=False
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    formats = f"point cloud: {', '.join(READERS)}"

    text = "reconstruct one scan and write volume, mesh, points and report"
    command = commands.add_parser(
        "reconstruct", help=text, description=text, epilog=_OUTPUTS, formatter_class=layout, allow_abbrev=False
    )
    command.add_argument("scan", metavar="SCAN", type=_path, help=formats)
    command.add_argument("-o", "--output", metavar="OUT", type=_path, required=True, help="folder for the results")
    _add_settings(command, options())
    command.add_argument("--gradient", action="store_true", help="also write the grid gradient into SCAN.vdb")
    command.add_argument("--arrays", action="store_true", help="also write SCAN.npz for other programs")
    command.add_argument("--json", action="store_true", help="print the report and the files written as JSON")
    command.set_defaults(run=_reconstruct, command="reconstruct", spelt=command.spelt())

    text = "say what a scan holds, which resolution suits it, and what time and memory a run so set would take"
    command = commands.add_parser("info", help=text, description=text, formatter_class=layout, allow_abbrev=False)
    command.add_argument("scan", metavar="SCAN", type=_path, help=formats)
    _add_settings(command, options())
    command.add_argument("--json", action="store_true", help="print as JSON")
    command.set_defaults(run=_info, command="info", spelt=command.spelt())
    return parser


def _add_settings(parser, fields):
    """An option for each field of Settings; what it may be is checked by Settings alone."""
    for name, field in fields.items():
        limits, choices, word, unit = (field.metadata[key] for key in ("limits", "choices", "word", "unit"))
        if field.type is bool:
            text = f"{field.metadata['help']} (default {field.default})"
            parser.add_argument(
                f"--{name}", action=argparse.BooleanOptionalAction, default=field.default, help=text.replace("%", "%%")
            )
            continue
        allowed = f"one of {', '.join(choices)}" if choices else f"{limits[0]} to {limits[1]} {unit}".strip()
        if word:
            allowed += f", or {word}"
        parser.add_argument(
            *dict.fromkeys((f"--{name.replace('_', '-')}", f"--{name}")),
            metavar="INT" if field.type is int else "FLOAT" if limits else "STR",
            type=_number if limits else str,
            default=field.default,
            help=f"{field.metadata['help']} ({allowed}; default {default_in_words(field)})".replace("%", "%%"),
        )


def _path(text):
    if not text:
        raise argparse.ArgumentTypeError("it is empty; give a path")
    return Path(text)


def _number(text):
    """A number where `text` is one; else the text, for Settings to refuse."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _reconstruct(given):
    settings = Settings(**{name: getattr(given, name) for name in options()})
    points, carried = read_scan(given.scan)
    digest = digest_of(given.scan)
    if given.output.suffix.lower() in (*READERS, _VOLUME, _REPORT) and not given.output.exists():
        raise InputError(f"{given.output} is to be a folder, in which files are named after the scan; give its name")
    folder = writable_folder(given.output)
    _spare(given.scan, digest, folder, given.arrays)
    missed = _missed(given.scan, points)  # the scan may be gone after the run
    with _progress() as progress:
        result = reconstruct(points, settings, progress=progress)
    result = replace(result, report={**result.report, "warnings": [*result.report["warnings"], *missed]})
    report = _write(result, carried, folder, given.scan, digest, given.gradient, given.arrays)
    for warning in report["warnings"]:
        print(f"warning: {warning}", file=sys.stderr)
    print(report_json(report) if given.json else _summary(report))


def _missed(scan, points):
    """What the points of a scan do not show of the mesh that they are of, if it is one of few vertices: no or one line.
    Where these are many, reading faces takes long, and they mostly show all."""
    if len(points) > MANY or not np.isfinite(points).all():
        return []
    missed = missed_by_vertices(Faces.of(points, *read_faces(scan, len(points))), _SAMPLED, _REFINED)
    return [f"{scan} is a mesh: its vertices alone are read, and {missed}"] if missed else []


def _spare(scan, digest, folder, arrays):
    """Raise :class:`InputError` where a file that is to be written is the scan itself, a result of another scan, or one
    that this program did not make."""
    endings = _POINTS, _VOLUME, *_MESHES.values(), *([_ARRAYS] if arrays else []), _REPORT
    there = [path for path in (folder / f"{scan.stem}{ending}" for ending in endings) if path.exists()]
    for path in there:
        if path.samefile(scan):
            raise InputError(f"{path} would replace the scan, which is that file; give another folder for the results")
    report = report_of(folder / f"{scan.stem}{_REPORT}")
    if report:
        other, same = Path(report["scan"]), report.get("digest") == digest  # it may have been moved, or out of reach
        with suppress(OSError, ValueError):  # nor need its name be one that this machine can write
            same = other.samefile(scan)
        if not same:
            raise InputError(f"{folder} holds the results of {other}, which have the same names; give another folder")
    for path in there:
        if not is_own(path):
            raise InputError(f"{path} is there, and was not made by this program; give another folder for the results")


@contextmanager
def _progress():
    """A progress callback that draws a bar where stderr is a terminal, and cancels after the first Ctrl-C or request to
    end.

    The second stops at once, as it would any Python program.
    """
    pressed = []

    def interrupt(signum, frame):
        pressed.append(signum)
        signal.signal(signum, signal.default_int_handler)

    def report(fraction, text):
        if not bar.disable:
            bar.set_description_str(text, refresh=text != bar.desc)
            bar.update(fraction - bar.n)
        return not pressed

    with (
        _heeding((signal.SIGINT, *REQUESTS_TO_END), interrupt),
        tqdm(total=1.0, bar_format=_BAR, miniters=0, disable=None, leave=False) as bar,
    ):
        yield report


def _write(result: Reconstruction, carried, folder, scan, digest, gradient, arrays):
    """Write every file, all of them or none; the report, which lists them, goes last. Returns the report."""
    samples = dict(points=result.points, normals=result.normals, attributes=sample_attributes(result, carried))
    writers = {
        _POINTS: partial(write_points, **samples),
        _VOLUME: partial(write_vdb, field=result.field, gradient=gradient),
    }
    closed = _MESHES["signed" if result.field.sdf else "double"]
    for ending, mesh in ((closed, result.surface), (_MESHES["single"], result.sheet)):
        if mesh is not None:
            writers[ending] = partial(write_mesh, mesh=mesh, attributes=vertex_attributes(mesh, result, carried))
    if arrays:
        writers[_ARRAYS] = partial(write_arrays, result=result)

    summary = folder / f"{scan.stem}{_REPORT}"
    report = {**result.report, "scan": scan.absolute(), "digest": digest}
    report |= {"files": [], "warnings": list(result.report["warnings"])}
    for ending in (_VOLUME, *_MESHES.values(), _ARRAYS):
        if ending not in writers and (path := folder / f"{scan.stem}{ending}").exists():
            report["warnings"].append(f"{path} is not of this run, which does not write it")
    with together():
        for ending, write in writers.items():
            path = folder / f"{scan.stem}{ending}"
            try:
                write(path)
                report["files"].append(path)
            except (InputError, MissingDependency) as error:
                report["warnings"].append(f"{path} is not written: {error}")
        report["files"].append(summary)
        write_report(summary, report)
    return report


def _summary(report):
    """What a person wants to know after a run."""
    return "\n".join(
        [
            f"{report['counts']['samples']} samples reconstructed in {sum(report['seconds'].values()):.1f} s",
            *(f"wrote {path}" for path in report["files"]),
        ]
    )


def _info(given):
    settings = Settings(**{name: getattr(given, name) for name in options()})
    points = read_points(given.scan)
    found = look_ahead(points, settings)
    samples, dropped = found.samples, found.cleaning["outliers"]
    nearest = KDTree(samples.points).query(samples.points, k=2, workers=-1)[0][:, 1] * samples.scale
    used = points[samples.source_index]
    finite = np.flatnonzero(np.isfinite(points).all(axis=1))
    distinct = len(first_of_each(points, finite))
    low, high = used.min(axis=0), used.max(axis=0)
    grid = fit_grid(used, settings.resolution)
    spacing = samples.local_spacing() * samples.scale
    facts = {
        "scan": given.scan,
        "points": len(points),
        "not_finite": len(points) - len(finite),
        "duplicates": len(finite) - distinct,
        "near_copies": distinct - found.prepared,
        "outliers": dropped,
        "in_solids_or_lines": found.prepared - dropped - len(samples.points),
        "box": {"low": low, "high": high, "size": high - low},
        "nearest_neighbour": {"smallest": nearest.min(), "median": np.median(nearest), "largest": nearest.max()},
        "spacing": np.median(spacing),
        "resolution": settings.resolution,
        "suited_resolution": found.suited,
        "band": settings.band,
        "grid": {"shape": grid.shape, "cell": grid.spacing},
        "noisy": found.noisy,
        "crowded": found.crowded,
        "estimate": asdict(estimate_cost(spacing, grid, settings, found.noisy, found.crowded)),
    }
    missed = _missed(given.scan, points)
    print(report_json(facts | {"warnings": missed}) if given.json else "\n".join([_described(facts), *missed]))


def _described(facts):
    low, high, size = (" ".join(f"{x:.9g}" for x in facts["box"][key]) for key in ("low", "high", "size"))
    smallest, median, largest = (f"{x:.3g}" for x in facts["nearest_neighbour"].values())
    shape = " x ".join(map(str, facts["grid"]["shape"]))
    cost = facts["estimate"]
    band = "" if facts["band"] is None else f", those within {facts['band']:g} cells of the surface alone"
    return (
        f"points   {facts['points']}, of which {facts['not_finite']} not finite, {facts['duplicates']} duplicates, "
        f"{facts['near_copies']} near copies of others and {facts['outliers']} outliers; "
        f"{facts['in_solids_or_lines']} more are dropped inside solids and on dense lines\n"
        f"box      {low} to {high}, size {size}\n"
        f"nearest  {median} from point to point in the median ({smallest} to {largest})\n"
        f"spacing  {facts['spacing']:.3g}, the local spacing in which --bridge counts (median)\n"
        f"cell     {facts['grid']['cell']:.3g} at resolution {facts['resolution']}, a grid of {shape} nodes{band}\n"
        f"suits    resolution {facts['suited_resolution']}, at which points are {SUITED:g} cells apart\n"
        f"run      about {cost['seconds']:.0f} s and {cost['memory_mb']:.0f} MiB; {cost['cpu_seconds']:.0f} s of the "
        f"processor{'; points look noisy' if facts['noisy'] else ''}"
    )
