"""What there is to know of a run before it: its samples, what its cost depends on, and which resolution suits them."""

from dataclasses import dataclass, replace

from .budget import crowded_share, suited_resolution
from .cleaning.clean import clean
from .cleaning.dense_lines import thinned_lines
from .cleaning.noise import looks_noisy
from .field.grid import fit_grid
from .points import Samples, prepare_samples
from .progress import Progress
from .settings import Settings


@dataclass(frozen=True)
class Prospect:
    """What a run would start from.

    samples  : those that it would take, in spatial order, before noise and steps of depth are mended
    prepared : number of samples before strays, insides of solids and dense lines are dropped
    cleaning : what :func:`clean` tells of that
    noisy    : whether they look noisy       crowded : share of them where sheets run close, see :func:`crowded_share`
    suited   : the resolution that suits them, see :func:`suited_resolution`, whatever the settings' own is: of lines
               those samples count that show how far it is to the next one
    """

    samples: Samples
    prepared: int
    cleaning: dict
    noisy: bool
    crowded: float
    suited: int


def look_ahead(points, settings: Settings = Settings(), progress=None) -> Prospect:
    """What a run of `settings` over points (n,3) would start from. Raises :class:`InputError` as it does."""
    progress = Progress.of(progress)
    every = prepare_samples(points, progress.part(0.0, 0.3, "points")).in_spatial_order()
    samples, done = clean(every, replace(settings, denoise=0.0), progress.part(0.3, 0.6, "cleaning"))
    spacing = samples.local_spacing(progress.part(0.6, 0.7, "cleaning"))
    noisy, crowded = looks_noisy(samples.points, spacing), crowded_share(samples.points, spacing)
    suited = _suited(samples, done["thinned"], every, settings, progress.part(0.7, 1.0, "cleaning"))
    return Prospect(samples, len(every.points), done, bool(noisy), crowded, suited)


def _suited(samples, thinned, every, settings, progress):
    """The resolution that suits what the coarsest grid leaves of dense lines."""
    cleaned = replace(settings, denoise=0.0, surface="none")
    coarsest = replace(cleaned, resolution=cleaned.coarsest)
    if settings.outliers and not thinned:
        cell = fit_grid(samples.points, coarsest.resolution).spacing
        thinned = not thinned_lines(samples.points, cell, progress.part(0.0, 0.3)).all()
    if thinned:
        samples = clean(every, coarsest, progress.part(0.3, 1.0))[0]
    return max(settings.coarsest, suited_resolution(samples.points, samples.local_spacing()))
