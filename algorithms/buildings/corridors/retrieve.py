"""Corridors for a zone without any: the sample that fits best, carried into the zone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...errors import CancelledError
from ...parcels.streetspace import StreetWidths
from ...progress import Progress, Silent
from ...site import Site
from ..tables.patches import PatchChoice
from ..zone import Corridor
from .adapt import Adapted, adapt
from .judge import Judgement, corridors_of, judge
from .outline import Outline, outline_of
from .register import Registration, register
from .runs import runs
from .samples import Sample, library
from .turning import turning_fits
from .ways import Ways

#: So many of the fits that look most alike by form and area are registered; so many of those that
#: are most alike then are carried into the zone and judged there.
REGISTERED, TRIED = 90, 24
#: Weights of form (per radian), area (per factor of e) and entries (per share of boundary).
FORM, AREA, ENTRIES = 1.0, 0.4, 8.0


@dataclass(frozen=True)
class Likeness:
    """How a sample resembles a zone (RZ section 2).

    Attributes
    ----------
    sample
        The sample, mirrored where that fits better.
    shift
        Of `turning.turning_fits`.
    form
        Distance of the turning functions, radians.
    area
        Natural logarithm of the ratio of the areas, without sign.
    entries
        How far entries lie from access points and streets, mean share of the boundary.
    registration
        Place by place.
    """

    sample: Sample
    shift: float
    form: float
    area: float
    entries: float
    registration: Registration

    @property
    def distance(self) -> float:
        """All three as one number."""
        return FORM * self.form + AREA * self.area + ENTRIES * self.entries


@dataclass(frozen=True, eq=False)
class Fitted:
    """Corridors from a sample.

    Attributes
    ----------
    corridors
        In the zone.
    places
        Places in the patches and the patterns planned there.
    adapted, likeness, judgement
        How they came about.
    """

    corridors: tuple[Corridor, ...]
    places: tuple[tuple[tuple[float, float], PatchChoice], ...]
    adapted: Adapted
    likeness: Likeness
    judgement: Judgement

    @property
    def cost(self) -> float:
        """What is wrong with them, and a little for likeness."""
        return self.judgement.cost + 0.3 * self.likeness.form + 2.0 * self.likeness.entries


def alike(outline: Outline, area_ha: float, samples: Sequence[Sample]) -> list[Likeness]:
    """Retrieve samples by form, area and entries, the most alike first (RZ section 2).

    Parameters
    ----------
    outline
        Of the zone.
    area_ha
        Its area, hectares.
    samples
        The library.

    Returns
    -------
    list of Likeness
        Each sample may appear several times: turned and mirrored.
    """
    rough = []
    for sample in samples:
        size = abs(math.log(area_ha / sample.area_ha))
        for own in (sample, sample.mirrored()):
            fits = turning_fits(outline.ring, own.ring)
            rough += [(round(FORM * form + AREA * size, 9), own, form, size, t) for form, t in fits]
    found = []
    for _, own, form, size, shift in sorted(rough, key=lambda fit: fit[0])[:REGISTERED]:
        registration = register(own, outline, shift)
        found.append(Likeness(own, shift, form, size, registration.moved, registration))
    return sorted(found, key=lambda own: round(own.distance, 9))


def fit_sample(
    site: Site,
    edge: Sequence[Corridor],
    widths: StreetWidths,
    progress: Progress | None = None,
    samples: Sequence[Sample] | None = None,
    tried: int = TRIED,
) -> Fitted | None:
    """Find corridors for a zone in the sample library (RZ section 2).

    Parameters
    ----------
    site
        The zone, without corridors.
    edge
        Existing streets along its edge.
    widths
        Widths of corridors by level.
    progress
        Asked for cancellation.
    samples
        The library, None for the one that comes with the program.
    tried
        So many fits are carried into the zone.

    Returns
    -------
    Fitted or None
        None where no sample can be carried into the zone.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    listener = progress if progress is not None else Silent()
    outline = outline_of(site)
    width = widths.every if widths.every is not None else widths.local
    ways = Ways(site, width)
    if ways.nothing:
        return None
    best: Fitted | None = None
    ranked = alike(outline, site.area_ha, library() if samples is None else samples)
    for at, likeness in enumerate(_varied(ranked)[:tried]):
        if listener.cancelled():
            msg = "Cancelled while corridors were sought in the sample library."
            raise CancelledError(msg)
        listener.stage("Fitting corridors of sample zones", at / tried)
        own = _fitted(site, outline, likeness, ways, edge, widths)
        if own is not None and (best is None or own.cost < best.cost - 1e-9):
            best = own
    return best


def _varied(ranked: Sequence[Likeness]) -> list[Likeness]:
    """Return what is tried: the most alike, no sample more than three times."""
    count: dict[str, int] = {}
    chosen = []
    for own in ranked:
        name = own.sample.name
        if count.get(name, 0) < 3:
            count[name] = count.get(name, 0) + 1
            chosen.append(own)
    return chosen


def _fitted(
    site: Site,
    outline: Outline,
    likeness: Likeness,
    ways: Ways,
    edge: Sequence[Corridor],
    widths: StreetWidths,
) -> Fitted | None:
    """Carry one sample into the zone and judge it."""
    adapted = adapt(likeness.sample, outline, likeness.registration, site, ways)
    if not adapted.edges:
        return None
    corridors = corridors_of(runs(adapted, shapely.buffer(ways.ground, 1.0)), widths)
    choices = [choice for _, choice in likeness.sample.patches]
    spots = [(float(x), float(y)) for x, y in np.asarray(adapted.places)]
    return Fitted(
        tuple(corridors),
        tuple(zip(spots, choices)),
        adapted,
        likeness,
        judge(site, adapted, corridors, edge),
    )
