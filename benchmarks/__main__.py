"""Arguments of `python -m benchmarks`."""

import argparse
import json
import platform
import sys
import time
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

from core import InputError, Settings, SettingsError
from core.io.atomic import atomic_path, writable_folder
from core.io.report import write_report
from core.settings import options

from .against import peer_tables, verdicts
from .cases import SAMPLINGS, count_points, find_cases, has_sampling
from .peers import check_open3d, peer_libraries
from .report import comparison, markdown_tables, read_run, terminal_header, terminal_row
from .results import write_results
from .run import Plan, run_cases, time_cases
from .status import CASE_FAILED, DONE, exit_status

_LIBRARIES = ("numpy", "scipy", "libigl")


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        raise SettingsError(f"{message}; see {self.prog} --help")


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    return exit_status(lambda: _benchmark(_parser().parse_args(arguments)))


def _parser():
    parser = _Parser(
        prog="python -m benchmarks",
        description="Reconstruct every case of a folder; measure field, normals, surface and cost against the truth.",
        epilog="exit status: 0 done, 1 a case failed, 2 bad input (one line says what), 130 cancelled",
        allow_abbrev=False,
    )
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="holds the cases, .npz files")
    parser.add_argument("--cases", metavar="A,B", type=lambda text: text.split(","), help="only these (default: all)")
    parser.add_argument("--blue-noise", action="store_true", help="the blue-noise samples instead of the uniform ones")
    parser.add_argument("--resolution", metavar="CELLS", type=int, help="short for --set resolution=CELLS")
    parser.add_argument(
        "--set", metavar="NAME=VALUE", type=_assignment, nargs="+", default=[], help=f"settings: {', '.join(options())}"
    )
    parser.add_argument("--peer", action="store_true", help="also run the peers (needs open3d, and cgal for one)")
    parser.add_argument("--repeats", metavar="N", type=_count, default=1, help="runs to take times of (default: 1)")
    parser.add_argument("--surfaces", action="store_true", help="surfaces, normals and cost alone, not the field")
    parser.add_argument("--jobs", metavar="N", type=_count, default=1, help="cases at a time (default: 1)")
    parser.add_argument("--keep", metavar="FOLDER", type=Path, help="keep what is measured; go on from what is there")
    parser.add_argument("--minutes", metavar="N", type=float, help="begin no case later than this; say what is missing")
    parser.add_argument("--save", metavar="NAME", type=Path, help="write NAME.json and NAME.md")
    parser.add_argument("--compare", metavar="JSON", type=Path, help="say what changed since a saved run")
    parser.add_argument(
        "--results", action="store_true", help="run everything, all samplings, with the peers; write docs/results.md"
    )
    parser.add_argument("--page", metavar="NAME", help="with --results: write docs/NAME.md instead")
    return parser


def _assignment(text):
    name, equals, value = text.partition("=")
    if not equals or name not in options():
        raise argparse.ArgumentTypeError(f"{text!r} sets nothing; write NAME=VALUE, NAME one of {', '.join(options())}")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value


def _count(text):
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of repeats; write 1 or more")
    return int(text)


def _benchmark(given):
    chosen = dict(given.set) | ({} if given.resolution is None else {"resolution": given.resolution})
    plan = Plan(
        Settings(**chosen),
        peers=given.peer or given.results,
        field=not given.surfaces,
        repeats=given.repeats,
        jobs=given.jobs,
        keep=given.keep,
        until=float("inf") if given.minutes is None else time.monotonic() + 60 * given.minutes,
    )
    if plan.peers:
        check_open3d()
    if given.results:
        if chosen or given.cases or given.blue_noise or given.save or given.compare:
            raise SettingsError("--results covers all cases at the default settings; drop the other options")
        paths = find_cases(given.folder)
        samplings = [sampling for sampling in SAMPLINGS if any(has_sampling(path, sampling) for path in paths)]
        runs = {}
        for sampling in samplings:
            runs[sampling] = _run(paths, sampling, plan)
            if plan.repeats > 1 and len(runs) == 1:
                runs[sampling]["alone"] = dict(time_cases(paths, sampling, plan))
        print(f"wrote {write_results(runs, given.page or 'results')}")
        return _status(*runs.values())
    if given.page:
        raise SettingsError("--page names the page that --results writes; add that or drop this")

    earlier = read_run(given.compare) if given.compare else None
    if given.save:
        writable_folder(given.save.parent)
    sampling = "blue noise" if given.blue_noise else "uniform"
    run = _run(find_cases(given.folder, given.cases), sampling, plan)
    print("".join(f"{line}\n" for line in verdicts(run["cases"])), end="")
    if given.save:
        _save(run, given.save)
    if earlier:
        print("\n".join(comparison(earlier, run)))
    return _status(run)


def _run(found, sampling, plan):
    """Run the cases that have the sampling, those of few points first, printing as they finish."""
    points = {path: count_points(path, sampling) for path in found}
    paths = sorted((path for path in found if points[path]), key=points.get)
    if not paths:
        raise InputError(f"no case has {sampling} samples; choose the other sampling or other cases")
    for path in found:
        if path not in paths:
            print(f"{path.stem} has no {sampling} samples and is left out")
    print(terminal_header(), flush=True)
    cases = []
    for result in run_cases(paths, sampling, plan):
        print(terminal_row(result), flush=True)
        cases.append(result)
    names = [*_LIBRARIES, *(module.lower() for module in peer_libraries() if plan.peers)]
    libraries = {name: version(name) for name in names}
    return {
        "sampling": sampling,
        "settings": asdict(plan.settings),
        "repeats": plan.repeats,
        "jobs": plan.jobs,
        "field": plan.field,
        "versions": {"python": platform.python_version(), **libraries},
        "cases": sorted(cases, key=lambda result: [path.stem for path in found].index(result["case"])),
    }


def _save(run, stem):
    path = stem.with_name(f"{stem.name}.json")
    write_report(path, run)
    with atomic_path(stem.with_name(f"{stem.name}.md")) as temporary:
        tables = f"{markdown_tables(run['cases'])}\n{peer_tables(run['cases'])}"
        temporary.write_text(f"# {stem.name}: {run['sampling']} samples\n\n{tables}", "utf-8")
    print(f"wrote {path} and {stem.name}.md")


def _status(*runs):
    return CASE_FAILED if any("error" in result for run in runs for result in run["cases"]) else DONE


if __name__ == "__main__":
    sys.exit(main())
