"""Patches that are too large get corridors of their own, from the library as well."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import Point, Polygon
from shapely.ops import nearest_points

from ...levels import LOCAL
from ...parcels.streetspace import StreetWidths
from ...progress import Progress
from ...site import AccessPoint, BoundaryStreet, Site
from ...site.repair import overlay
from ..zone import Corridor
from .judge import LARGEST, REMOTE, ground_figures
from .patches import Places
from .retrieve import Fitted, fit_sample
from .space import access_of, joined, space_in

#: Patches larger than this (hectares), or with so much of their ground far from streets (share),
#: are cut once more.
TOO_LARGE, TOO_REMOTE = 1.3 * LARGEST, 0.15
#: Smaller patches are not cut (hectares).
SMALL = 1.6
#: Times that patches are cut, and samples that are tried each time.
ROUNDS, TRIED = 3, 10
#: New corridors have to be worth so much (as `Judgement.cost`).
WORTH = 0.1
#: A street goes straight on beyond a junction where it turns by less than this (degrees).
STRAIGHT = 35.0


def sample_corridors(
    site: Site,
    edge: Sequence[Corridor],
    widths: StreetWidths,
    progress: Progress | None = None,
) -> tuple[list[Corridor], Places, Fitted | None]:
    """Give a zone corridors of the sample library; patches too large are cut again by it.

    Parameters
    ----------
    site
        The zone.
    edge
        Existing streets along its edge.
    widths
        Widths of corridors by level.
    progress
        Asked for cancellation.

    Returns
    -------
    corridors : list of Corridor
        Joined to each other and to the streets along the edge.
    places : tuple
        Places in patches and the patterns that samples plan there, the most special first.
    fitted : Fitted or None
        The sample for the whole zone; None, and no corridors, where none fits.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    first = fit_sample(site, edge, widths, progress)
    if first is None:
        return [], (), None
    made = joined(first.corridors, site)
    places = first.places
    done: set[tuple[float, ...]] = set()
    for _ in range(ROUNDS):
        more: list[Corridor] = []
        for patch in _wanting(site, [*made, *edge], done):
            part = _part(site, patch, [*made, *edge])
            own = fit_sample(part, [], widths, progress, tried=TRIED)
            if own is None or not _worth(part, own):
                continue
            calm = [replace(c, level=max(c.level, LOCAL)) for c in own.corridors]
            more += joined(_narrowed(calm, widths), part)
            places = (*own.places, *places)
        if not more:
            break
        made += more
    return made, places, first


def _narrowed(corridors: Sequence[Corridor], widths: StreetWidths) -> list[Corridor]:
    """Give corridors the width of their level again."""
    by_level = widths.by_level if widths.every is None else np.full(4, widths.every)
    return [replace(own, width_m=float(by_level[own.level - 1])) for own in corridors]


def _wanting(
    site: Site, corridors: Sequence[Corridor], done: set[tuple[float, ...]]
) -> list[Polygon]:
    """Return the patches that want corridors of their own and were not looked at yet."""
    space = space_in(site.polygon, corridors)
    streets = shapely.union_all([space, site.street_frontage])
    ground = overlay(shapely.difference, site.polygon, space)
    near = shapely.buffer(streets, REMOTE, quad_segs=4)
    found = []
    for patch in shapely.get_parts(ground):
        key = tuple(np.round([*patch.centroid.coords[0], patch.area], 1).tolist())
        if patch.geom_type != "Polygon" or patch.area < SMALL * 1e4 or key in done:
            continue
        far = overlay(shapely.difference, patch, near).area / patch.area
        if patch.area > TOO_LARGE * 1e4 or far > TOO_REMOTE:
            done.add(key)
            found.append(patch)
    return found


def _part(site: Site, patch: Polygon, corridors: Sequence[Corridor]) -> Site:
    """Return a patch as a site of its own, with the streets around it."""
    streets = shapely.union_all([space_in(site.polygon, corridors), site.street_frontage])
    beside = [own for own in corridors if own.line.distance(patch) < own.width_m / 2 + 10.0]
    doors = [p for p in site.access_points if Point(p.xy).distance(patch) < 1.0]
    return replace(
        site,
        polygon=patch,
        street_frontage=access_of(patch, streets),
        boundary_streets=tuple(BoundaryStreet(own.line, own.name) for own in beside),
        access_points=(*doors, *_opposite(patch, beside)),
        inner_streets=(),
        obstacles=tuple(own for own in site.obstacles if own.intersects(patch)),
    )


def _opposite(patch: Polygon, corridors: Sequence[Corridor]) -> list[AccessPoint]:
    """Return where corridors that end on the other side of a street would go on into a patch."""
    found = []
    for own in corridors:
        xy = shapely.get_coordinates(own.line)
        for end, before in ((xy[-1], xy[-2]), (xy[0], xy[1])):
            place = nearest_points(patch.exterior, Point(end))[0]
            step, way = np.array(place.coords[0]) - end, end - before
            size = math.hypot(*step) * math.hypot(*way)
            if not 1.0 < math.hypot(*step) < 15.0 or size == 0.0:
                continue
            if float(step @ way) / size > math.cos(math.radians(STRAIGHT)):
                direction = way / math.hypot(*way)
                at = (float(place.x), float(place.y))
                toward = (float(direction[0]), float(direction[1]))
                found.append(AccessPoint(at, (float(end[0]), float(end[1])), toward))
    return found


def _worth(part: Site, own: Fitted) -> bool:
    """Tell whether new corridors make a patch better."""
    size, form, remote = ground_figures(part, [])
    before = 2.0 * size + form + 2.5 * remote
    return own.judgement.cost - own.judgement.entries < before - WORTH
