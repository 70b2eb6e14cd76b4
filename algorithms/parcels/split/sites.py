"""Streets and parcels for every site of a layer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import LineString

from ...errors import CancelledError, InputError
from ...progress import Progress, Silent
from ...site.types import Site
from ..roadmesh import GivenStreet
from ..rules import ParcelRules
from .elements import KeyArea, Prepared, prepare_ground
from .layout import Layout
from .rules import SplitRules
from .site_layers import SiteLayouts
from .variations import Arriving, Executor, Numbered, vary

#: Sites with room for more parcels than this are a mistake: memory would not do for them.
MOST = 200_000


@dataclass(frozen=True)
class Elements:
    """What the planner fixes on a site, in its working CRS.

    Attributes
    ----------
    areas
        Areas whose use is fixed.
    streets
        Main streets that split the site first.
    guides
        Drawn lines that a guided field follows.
    """

    areas: Sequence[KeyArea] = ()
    streets: Sequence[GivenStreet] = ()
    guides: Sequence[LineString] = ()


def lay_out_sites(
    sites: Sequence[Site],
    rules: ParcelRules,
    split: SplitRules,
    *,
    elements: Callable[[Site], Elements] | None = None,
    count: int = 1,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> list[SiteLayouts]:
    """Lay out every site in several variations.

    Parameters
    ----------
    sites
        The sites, see `site.prepare_sites`.
    rules, split
        What is asked of parcels and of streets.
    elements
        Gives what the planner fixes on a site.
    count, seed, executor
        See `vary`.
    progress
        Told of the work; where the caller cancels, the sites that are done are returned.

    Returns
    -------
    list of SiteLayouts
        In the order of the sites, their variations the best first.

    Raises
    ------
    InputError
        If nothing of a site is left to lay out, or it is far too large.
    CancelledError
        If the caller cancels before there is a layout.
    """
    told = progress or Silent()
    found: list[SiteLayouts] = []
    for site in sites:
        _check_size(site, rules)
    for k, site in enumerate(sites):
        own = elements(site) if elements is not None else Elements()
        ready = prepare_ground(
            site, street_width=split.street_width, streets=own.streets, areas=own.areas
        )
        if not ready.grounds:
            raise InputError(
                "Key areas and obstacles leave no land to lay out.",
                "Make them smaller, or leave some out.",
                layer=site.name,
                feature=site.feature,
            )
        share = Numbered(told, k / len(sites), (k + 1) / len(sites), "Site", k, len(sites))
        try:
            layouts = _pieces(ready, site, own, rules, split, count, seed, executor, share)
        except CancelledError:
            if not found:
                raise
            told.warn(f"Cancelled: {len(found)} of {len(sites)} sites are laid out.")
            break
        found.append(SiteLayouts(site, layouts, ready.areas, ready.remarks))
    return found


def _check_size(site: Site, rules: ParcelRules) -> None:
    """Refuse a site that nobody can mean, such as a country or one in a wrong CRS."""
    room = site.polygon.area / rules.area
    if room > MOST:
        raise InputError(
            f"It has {site.polygon.area / 1e6:,.0f} km2, room for {room:,.0f} parcels; "
            f"{MOST:,} is the most.",
            "Choose a smaller site, or larger parcels; see whether the coordinate reference "
            "system is right.",
            layer=site.name,
            feature=site.feature,
        )


def _pieces(
    ready: Prepared,
    site: Site,
    own: Elements,
    rules: ParcelRules,
    split: SplitRules,
    count: int,
    seed: int,
    executor: Executor | None,
    progress: Progress,
) -> list[list[Layout]]:
    """Lay out the pieces of a site; variation k has the k-th best layout of each."""
    arriving: Arriving = [
        (np.array(point.xy), np.array(point.direction)) for point in site.access_points
    ]
    by_piece = []
    whole = sum(ground.polygon.area for ground in ready.grounds)
    begin = 0.0
    for k, ground in enumerate(ready.grounds):
        end = begin + ground.polygon.area / whole
        share = Numbered(progress, begin, end, "Piece of land", k, len(ready.grounds))
        by_piece.append(
            vary(
                ground, rules, split, count=count, seed=seed, arriving=arriving,
                guides=own.guides, executor=executor, progress=share,
            )
        )  # fmt: skip
        begin = end
    most = max(len(layouts) for layouts in by_piece)
    return [[layouts[min(k, len(layouts) - 1)] for layouts in by_piece] for k in range(most)]
