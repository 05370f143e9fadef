"""Us against the peers, case by case, and what that adds up to."""

import operator
import statistics
from collections.abc import Iterator

from .alone import WITHIN
from .cases import SPOILED
from .peers import PEERS
from .report import ABSENT
from .status import word
from .tables import markdown_rows

WORSE_BY = 1.3  # of the best peer's CD, at most
SHARE = 0.85  # of the clean cases, at least, with the lowest CD
OURS = {"double": "VAD, double cover", "single": "VAD, single layer"}
FINE = {"fine": "VAD, double cover, finer grid"}
_DEFAULT = "double"
_MEASURES = {
    "hd": ("the lowest HD", operator.le),
    "nc": ("the highest NC", operator.ge),
    "f005": ("the highest F@.005", operator.ge),
    "f010": ("the highest F@.010", operator.ge),
}
_COLUMNS = {
    "cd": "{:.3f}",
    "hd": "{:.1f}",
    "nc": "{:.4f}",
    "seconds": "{:.2f}",
    "cpu": "{:.2f}",
    "memory_mb": "{:.0f}",
}


def contenders(result: dict) -> dict[str, dict]:
    """Measures of our surfaces and of every peer on a case, by name; those of a failed peer are only `error`."""
    both = {"memory_mb": result["memory_mb"], "variant": None}
    ours = {
        "double": result["mesh"] | both | {"seconds": result["seconds"]["total"], "cpu": result["seconds"]["cpu"]},
        "single": result["sheet"] | both,
    }
    return ours | {name: result[name] for name in FINE if name in result} | result["peers"]


def best_peer(result: dict) -> str | None:
    """Name of the peer with the lowest CD; None where none succeeded."""
    made = {name: found["cd"] for name, found in result["peers"].items() if "cd" in found}
    return min(made, key=made.get) if made else None


def shown(results: list[dict]) -> list[dict]:
    """The results with our closed surface that peers were run on, too."""
    return [result for result in results if "mesh" in result and result.get("peers")]


def compared(results: list[dict]) -> list[dict]:
    """Those of them that can be compared: with the surface of at least one peer."""
    return [result for result in shown(results) if best_peer(result)]


def unmatched(results: list[dict]) -> list[str]:
    """Names of the others, on which no peer came to an end."""
    return [result["case"] for result in shown(results) if not best_peer(result)]


def over_best(result: dict, ours: str = _DEFAULT) -> float:
    """The CD of one of our surfaces over that of the best peer."""
    return contenders(result)[ours]["cd"] / result["peers"][best_peer(result)]["cd"]


def verdicts(results: list[dict]) -> Iterator[str]:
    """What the comparison adds up to over the clean cases, for either surface, for the double cover on a finer grid
    where there are points for it, and where we lose."""
    clean = [result for result in compared(results) if result["category"] not in SPOILED]
    if not clean:
        return
    finer = FINE if any(name in result for name in FINE for result in clean) else {}
    for name, title in (OURS | finer).items():
        ratios = {r["case"]: over_best(r, name if name in contenders(r) else _DEFAULT) for r in clean}
        won = sum(ratio < 1 for ratio in ratios.values())
        worst = max(ratios, key=ratios.get)
        target = ""
        if name in finer:
            title = f"VAD, double cover, on a grid twice as fine where it is measured ({_listed_cases(clean, name)})"
        if name == _DEFAULT:
            target = f"{word(won >= SHARE * len(clean) and ratios[worst] <= WORSE_BY)}: "
        yield (
            f"{target}{title}: the lowest CD on {won} of {len(clean)} clean cases ({won / len(clean):.0%}; {SHARE:.0%} "
            f"is asked); at worst {ratios[worst]:.2f} × the best peer's, on {worst} (at most {WORSE_BY} is asked)."
        )
    yield f"VAD, double cover, of these {len(clean)} by the other measures: {_firsts(clean)}."
    if alone := unmatched(results):
        yield f"Not counted, as no peer came to an end there: {', '.join(alone)}."
    for result in compared(results):
        if over_best(result) >= 1:
            kind = "" if result["category"] not in SPOILED else f", {result['category']}"
            yield (
                f"Lost: {result['case']}{kind}: CD {result['mesh']['cd']:.3f}, single layer "
                f"{result['sheet']['cd']:.3f}, {PEERS[best_peer(result)].title} "
                f"{result['peers'][best_peer(result)]['cd']:.3f}."
            )


def _listed_cases(results, name):
    return ", ".join(result["case"] for result in results if name in result)


def _firsts(results):
    """On how many of them no peer, each with the variant of its lowest CD, is ahead of our double cover, by measure."""
    said = []
    for key, (what, ahead) in _MEASURES.items():
        others = [[found[key] for found in result["peers"].values() if key in found] for result in results]
        won = sum(all(ahead(r["mesh"][key], x) for x in o) for r, o in zip(results, others, strict=True))
        said.append(f"{what} on {won}")
    return ", ".join(said)


def peer_tables(results: list[dict], level: int = 2) -> str:
    """Verdicts and both tables under a heading of the level; empty where there is nothing to compare."""
    if not shown(results):
        return ""
    said = "\n".join(f"- {line}" for line in verdicts(results))
    parts = [f"{'#' * level} Against the peers", said, overview(results), full_table(results)]
    return "\n\n".join(part for part in parts if part) + "\n"


def alone_section(found: dict[str, dict]) -> str:
    """Our time beside that of the common route, of all that :func:`time_alone` found, by case; empty where nothing."""
    times = {case: times for case, times in found.items() if "ratio" in times}
    if not times:
        return ""
    failed = [case for case in found if case not in times]
    lines = [["case", "VAD, s", "CPU s", "Poisson, s", "CPU s", "clock", "CPU", "load before"], ["---"] + ["---:"] * 7]
    for case, measured in times.items():
        spent = [f"{measured[way][key]:.2f}" for way in ("ours", "poisson") for key in ("seconds", "cpu")]
        ratios = [f"{measured['ratio'][key]:.2f}" for key in ("seconds", "cpu")]
        lines.append([case, *spent, *ratios, ABSENT if measured["load"] is None else f"{measured['load']:.1f}"])
    said = [_within(times, key, name) for key, name in (("seconds", "By the clock"), ("cpu", "CPU"))]
    said = "\n".join(f"- {line}" for line in (*said, *([f"**Failed**: {', '.join(failed)}."] if failed else [])))
    return f"""\
## Time

Our whole run over Open3D's normals, orientation and Poisson on the same points, in turn, with nothing else of this
bench running: medians. *load*: processes at work on the machine in the minute before, this bench's own among them.

{said}

{markdown_rows(lines)}
"""


def _within(times, key, name):
    ratios = [measured["ratio"][key] for measured in times.values()]
    few, middle = sum(ratio <= WITHIN for ratio in ratios), statistics.median(ratios)
    ours, theirs = (sum(measured[way][key] for measured in times.values()) for way in ("ours", "poisson"))
    return (
        f"{word(few == len(ratios))}: {name}: {min(ratios):.2f} to {max(ratios):.2f}, median "
        f"{middle:.2f}, all cases together {ours / theirs:.2f}; at most {WITHIN} on {few} of {len(ratios)} cases."
    )


def overview(results: list[dict]) -> str:
    """CD of every way on every case, the lowest in bold, as a Markdown table."""
    titles = _titles(results)
    lines = [["case", *titles.values(), "double cover / best peer"], ["---", *("---:" for _ in titles), "---:"]]
    for result in shown(results):
        found = contenders(result)
        lowest = min(measures["cd"] for measures in found.values() if "cd" in measures)
        cells = [_cd(found.get(name, {}), lowest) for name in titles]
        lines.append([result["case"], *cells, f"{over_best(result):.2f}" if best_peer(result) else ABSENT])
    return markdown_rows(lines)


def _cd(measures, lowest):
    if "cd" not in measures:
        return ABSENT if "error" not in measures else "too slow" if measures.get("too_slow") else "failed"
    return f"**{measures['cd']:.3f}**" if measures["cd"] == lowest else f"{measures['cd']:.3f}"


def full_table(results: list[dict]) -> str:
    """CD, HD, NC of the surface, time and memory of every way on every case, as a Markdown table."""
    titles = _titles(results)
    lines = [["case", "way", "variant", "CD", "HD", "NC", "seconds", "CPU", "MB"], ["---"] * 3 + ["---:"] * 6]
    for result in shown(results):
        for name, found in contenders(result).items():
            if "error" in found:
                lines.append([result["case"], titles[name], found["error"], *[ABSENT] * 6])
                continue
            variant = found["variant"] or ABSENT
            numbers = [form.format(found[key]) for key, form in _COLUMNS.items()]
            lines.append([result["case"], titles[name], variant, *numbers])
    return markdown_rows(lines)


def ways() -> str:
    """What each peer is, as a Markdown list; those that are not installed are said to be left out."""
    lines = []
    for peer in PEERS.values():
        choice = f"; {peer.unit}: the best of {_listed(peer.variants)}" if peer.unit else ""
        lines.append(f"- *{peer.title}*: {peer.how}{choice}{'' if peer.available else ' (not installed, left out)'}.")
    return "\n".join(lines)


def _listed(variants):
    return "; ".join(" and ".join(map(str, v)) if isinstance(v, tuple) else str(v) for v in variants)


def _titles(results):
    run = {name for result in shown(results) for name in result["peers"]}
    finer = FINE if any(name in result for name in FINE for result in shown(results)) else {}
    return OURS | finer | {name: peer.title for name, peer in PEERS.items() if name in run}
