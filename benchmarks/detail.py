"""How close surfaces come on finer and finer grids, for docs/scale.md."""

from pathlib import Path

from core import Settings, reconstruct
from core.budget import SUITED, advised_band, suited_resolution
from core.points import local_spacing, prepare_samples

from .cases import load_case
from .metrics import surface_errors
from .tables import markdown_rows

CASES = (  # of many kinds
    "spot_10k",
    "cloth_10k",
    "klein_10k",
    "petals_10k",
    "mountain_20k",
    "moebius_5k",
    "toiletpaper_10k",
    "fish_1k",
    "spot_noise0.5_10k",
)
APART = 0.75, 1.0, SUITED, 2.0, 3.0  # cells between points
_WHOLE = 256  # the finest resolution in the whole box; beyond it in a band


def detail(path: Path, apart: float) -> dict:
    """Errors of the double cover of a case at the resolution at which its points are so many cells `apart`."""
    case = load_case(path)
    samples = prepare_samples(case.points).points
    resolution = round(suited_resolution(samples, local_spacing(samples)) * apart / SUITED)
    band = None if resolution <= _WHOLE else advised_band(Settings().offset)
    settings = Settings(resolution=resolution, band=band)
    errors = surface_errors(reconstruct(case.points, settings).surface, case.truth)
    return {"case": path.stem, "apart": apart, "resolution": resolution, **errors}


def detail_table(rows: list[dict]) -> str:
    """Markdown of the Chamfer distances of such rows, with the resolutions, a line for each case."""
    heads = ["case", *(f"**{apart:g}**" if apart == SUITED else f"{apart:g}" for apart in APART)]
    lines = [heads, ["---", *["---:"] * len(APART)]]
    for name in dict.fromkeys(row["case"] for row in rows):
        found = {row["apart"]: f"{row['cd']:.3f} ({row['resolution']})" for row in rows if row["case"] == name}
        lines.append([name, *(found[apart] for apart in APART)])
    return markdown_rows(lines)


def detail_verdict(rows: list[dict]) -> str:
    """How much closer surfaces come than at one cell, and than at that which is said to suit them."""
    cd = {apart: [row["cd"] for row in rows if row["apart"] == apart] for apart in APART}

    def ratio(apart, other):
        ratios = [one / of for one, of in zip(cd[apart], cd[other], strict=True)]
        return f"{min(ratios):.2f} to {max(ratios):.2f}"

    return (
        f"At {SUITED:g} cells the Chamfer distance is {ratio(SUITED, 1.0)} of that at one, and at "
        f"{APART[-1]:g} cells {ratio(APART[-1], SUITED)} of that at {SUITED:g}."
    )
