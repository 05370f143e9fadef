"""The tables of docs/noise.md, out of what was measured: lines of cells, the head first."""

import numpy as np

from . import noise_uneven, published
from .tables import markdown_rows

_LINE = 160  # characters of a message that is shown


def distances(rows):
    yield "case", "noise %", "as they come", "here", "factor", "alternation", "rounds", "jet", "measured"
    for row in rows:
        ours, other = row["ours"], row["alternating"]
        yield (
            row["case"],
            f"{row['percent']:g}",
            f"{row['before']:.2f}",
            f"{ours['after']:.2f}",
            f"{row['before'] / ours['after']:.1f}",
            f"{other['after']:.2f}",
            str(len(other["changes"])),
            f"{row['jet']['after']:.2f}" if "jet" in row else "–",
            f"{ours['noise']:.2f} / {row['deviation']:.2f}",
        )


def normals(rows):
    yield "case", "noise %", "here", "best PCA", "k", "alternation", "Open3D"
    for row in rows:
        found = (f"{row[way]['nc']:.4f}" if way in row else "–" for way in ("ours", "pca", "alternating", "poisson"))
        here, pca, other, open3d = found
        yield row["case"], f"{row['percent']:g}", here, pca, str(row["pca"]["k"]), other, open3d


def surfaces(rows):
    ways = {"ours": "here", "alternating": "alternation", "jet": "jet, front", "poisson": "Poisson"}
    yield "case", "noise %", *ways.values()
    for row in rows:
        yield row["case"], f"{row['percent']:g}", *cells(row, ways)


def more(rows):
    yield "case", "noise %", "points", "distance", "measured", "neighbours", "here", "pieces", "Poisson"
    for row in rows:
        yield (
            row["case"],
            f"{row['percent']:g}",
            f"{row['points']:,}",
            f"{row['before']:.2f} → {row['after']:.2f}",
            f"{row['noise']:.2f} / {row['deviation']:.2f}",
            str(row["neighbours"][1]),
            *cells(row, ("ours",)),
            str(row["pieces"]),
            *cells(row, ("poisson",)),
        )


def halves(rows):
    yield "case", "moved", "noisy half, before → after", "CD", "`denoise=0`", "`denoise=1`"
    for row in rows:
        yield (
            row["case"],
            f"{row['found']:.1%} / {row['falsely']:.1%}",
            f"{row['before']:.2f} → {row['after']:.2f}",
            f"{row['cd']:.3f}",
            f"{row['cd_none']:.3f}",
            f"{row['cd_every']:.3f}",
        )


def strays(rows):
    yield "case", "strays", "found", "lost", "CD", "HD", "pieces", "CD, left in"
    for row in rows:
        yield (
            row["case"],
            f"{row['share']:.0%}",
            "–" if row["found"] is None else f"{row['found']:.1%}",
            f"{row['lost']:.2%}",
            f"{row['cd']:.3f}",
            f"{row['hd']:.0f}",
            str(row["pieces"]),
            f"{row['untreated_cd']:.3f}",
        )


def hostile(rows):
    yield "given", "outcome", "got"
    for row in rows:
        got = "".join(sign if sign.isascii() and sign.isprintable() and sign != "|" else "·" for sign in row["got"])
        yield row["given"], row["outcome"], got if len(got) <= _LINE else f"{got[:_LINE]} …"


def silences(runs):
    yield "run", "stage", "waits, s", "looks", "CPU s"
    for name, stages in runs.items():
        for stage, found in stages.items():
            yield name, stage, f"{found['seconds']:.2f}", str(found["looks"]), f"{found['cpu']:.2f}"


def stops(runs):
    yield "run", "cancels", "back after, s", "gone after, s"
    for name, rows in runs.items():
        back, gone = (max(row[key] for row in rows) for key in ("stopped", "gone"))
        yield name, str(len(rows)), f"{back:.2f}", f"{gone:.2f}"


def beside_published(measured):
    between, strays = measured["between"], measured["strays"]
    names = dict.fromkeys(row["case"] for row in between)
    yield "", *(f"{name}, here" for name in names), "published for the paper's method", "for a later one"
    for percent, figure in published.NOISE.items():
        here = (f"{row['cd']:.2f}" for row in between if row["percent"] == percent)
        yield f"{percent:g} % noise", *here, f"{figure:.2f}", "–"
    for percent, figure in published.OUTLIERS.items():
        here = (f"{row['cd']:.3f}" for row in strays if round(100 * row["share"]) == percent)
        yield f"{percent} % outliers", *here, f"{figure:.3f}", f"{published.OUTLIERS_LATER[percent]:.3f}"


def faint(rows):
    yield "case", "part", "of the points", "noise, local spacings", "moved", "CD", "there alone"
    for row in rows:
        yield (
            row["case"],
            row["part"],
            f"{row['share']:.0%}",
            f"{row['level']:g}",
            f"{row['moved']:.0%}",
            f"{row['cd']:.3f}",
            f"{row['cd_best']:.3f}",
        )


def by_level(rows, what):
    yield "case", f"{what}, local spacings", "moved", "here", "`denoise=0`", "`denoise=1`"
    for row in rows:
        yield row["case"], f"{row['level']:g}", f"{row['moved']:.0%}", *cells(row, ("ours", "none", "every"))


def wires(rows):
    kinds = [(run["share"], run["clouds"]) for run in rows[0]["runs"]]
    yield "wires", *(f"{share:.0%}{' in clouds' if clouds else ''}" for share, clouds in kinds)
    for row in rows:
        found = ("–" if run["found"] is None else f"{run['found']:.0%}" for run in row["runs"])
        yield row["wires"], *(f"{a} / {run['lost']:.1%}" for a, run in zip(found, row["runs"], strict=True))


def uneven(rows):
    yield "shape", "points", "here", f"bridge {noise_uneven.BRIDGE:g}", "Poisson"
    for row in rows:
        yield row["shape"], f"{row['points']:,}", *cells(row, ("ours", "bridged", "poisson"))


def cells(row, ways):
    """CD (HD) of each of the ways; a dash where there are none."""
    return (f"{row[way]['cd']:.3f} ({row[way]['hd']:.0f})" if way in row else "–" for way in ways)


def cost_rows(rows):
    yield "case", "sampling", "surface", "cells", "CPU s said", "taken", "ratio", "MiB said", "taken", "ratio"
    for row in rows:
        cells = f"{row['resolution']}" + ("" if row["band"] is None else f", band {row['band']:g}")
        pairs = ((row[f"{key}_said"], row[key], form) for key, form in (("cpu", "{:.1f}"), ("memory", "{:.0f}")))
        told = (cell for a, b, form in pairs for cell in (form.format(a), form.format(b), f"{a / b:.2f}"))
        yield row["case"], row["sampling"], row["surface"], cells, *told


def cost(rows, way):
    return float(np.median([row[way]["cpu"] / row["ours"]["cpu"] for row in rows if way in row]))


def place(row):
    return f"{row['case']} {row['percent']:g} %"


def listed(names):
    return ", ".join(names) or "none"


def markdown(lines):
    head, *rest = lines
    return markdown_rows([head, ["---"] * len(head), *rest])
