"""All that is known of a ground is weighed: the starts of its growth."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS

from ...errors import CancelledError, InputError
from ...progress import Progress
from ...site.repair import Problems
from ..grammar import Grammar
from ..types import FloatArray, Start
from .arrivals import Arrival, Streets, Vector, arrivals, asked_for, unit
from .domain import SLIVER
from .entries import entries, longest_axis, middle_entry
from .given import GivenNetwork
from .legs import Sight
from .starts import Place, in_open_land, settle, street_places, thinned, with_main, with_sight

#: Starts nearer than this are one, in units of the grammar: half of CitySprout's intersect radius.
SPACING = 0.4
#: Ground between streets that is larger than a square with this side, in units of the grammar, is
#: entered from a street though none arrives there.
ROOMY = 6.0
#: Streets leave to opposite sides where the cosine of the angle between them is less.
OPPOSITE = -0.9
#: Without a domain nothing further away counts as open ground ahead, in units of the grammar.
FAR = 5.0


@dataclass(frozen=True)
class Wish:
    """What the planner asks of the starts.

    Attributes
    ----------
    grammar
        Gives their states.
    points, point_layer
        Where they are, or None, and the name of that layer.
    direction
        Of those that nothing else gives one, degrees clockwise from north, or None.
    scale
        Metres per unit of the grammar.
    spacing
        Nearer starts are one, metres.
    reach
        Points this near to a street are on it, metres.
    progress
        Asked for cancellation.
    """

    grammar: Grammar
    points: gpd.GeoDataFrame | None
    point_layer: str
    direction: float | None
    scale: float
    spacing: float
    reach: float
    progress: Progress

    @property
    def way(self) -> Vector | None:
        """Unit vector of the direction, or None."""
        return None if self.direction is None else unit(self.direction)


def starts_in(
    domain: shapely.Geometry,
    net: GivenNetwork,
    roads: list[Arrival],
    cut: FloatArray,
    wish: Wish,
    crs: CRS,
    problems: Problems,
) -> tuple[tuple[Start, ...], GivenNetwork]:
    """Find where growth begins in a domain.

    Parameters
    ----------
    domain
        Ground that streets may grow in.
    net
        The streets that are there.
    roads
        Roads from outside that reach it.
    cut
        Shape (k, 2). Ends of streets that go on outside of the ground.
    wish
        What the planner asks.
    crs
        Working CRS.
    problems
        Takes findings.

    Returns
    -------
    tuple
        The starts, and the streets with nodes where these are.

    Raises
    ------
    InputError
        If points are given and none of them can be used.
    """
    x0, y0, x1, y1 = domain.bounds
    sight = Sight(domain, net, max(x1 - x0, y1 - y0))
    streets = Streets(net, domain)
    if wish.points is not None:
        way = wish.way or longest_axis(domain)
        places = asked_for(
            wish.points, crs, streets, sight, problems, layer=wish.point_layer,
            snap_distance=wish.reach, direction=way,
        )  # fmt: skip
        return settle(thinned(places, wish.spacing), net, wish.grammar)
    places = [p for p in street_places(net, cut) if streets.holds(p.xy)]
    places = with_sight([*arrivals(roads, streets, wish.reach), *places], sight, wish.spacing)
    ask(wish.progress, "Looking for places where streets begin", 0.8)
    places = with_main(thinned(places, wish.spacing), wish.grammar)
    for face, alone in _unserved(domain, net, places, ROOMY * wish.scale):
        ask(wish.progress, "Looking for places where streets begin", 0.9)
        found = _entries(net, face, places, wish, sight)
        if alone and not found:
            found = [middle_entry(face, wish.way)]
            if len(net.ends):
                what = "no street from which streets could grow reaches this part of the ground"
                todo = "they begin in its middle; see how it is to be reached"
                problems.add("", "", what, todo, "warning", face, crs)
        places += found
    return settle(places, net, wish.grammar)


def _entries(
    net: GivenNetwork, face: shapely.Geometry, places: list[Place], wish: Wish, sight: Sight
) -> list[Place]:
    """Find entries to ground; where others leave the same street to its other side, fit to them.

    The first crosses the street there, the further ones stand between those across, so that one
    main street crosses and the others meet the street in junctions of three.
    """
    size: dict[str, Any] = {"scale": wish.scale, "room": wish.spacing}
    found = entries(net, face, wish.grammar, sight, **size)
    if not found:
        return []
    across = _across(found[0], places, 2 * wish.spacing)
    if across is None:
        return found
    further = entries(net, face, wish.grammar, sight, **size, shift=0.5)[1:]
    kept = [place for place in further if _across(place, places, 2 * wish.spacing) is None]
    return [replace(found[0], xy=across.xy), *kept]


def _across(place: Place, others: list[Place], distance: float) -> Place | None:
    """Find the nearest place where a street leaves to the other side, None beyond a distance."""
    near = [
        other
        for other in others
        if other.on_street
        and math.dist(other.xy, place.xy) < distance
        and other.way[0] * place.way[0] + other.way[1] * place.way[1] < OPPOSITE
    ]
    return min(near, key=lambda other: math.dist(other.xy, place.xy), default=None)


def _unserved(
    domain: shapely.Geometry, net: GivenNetwork, places: list[Place], size: float
) -> list[tuple[shapely.Geometry, bool]]:
    """Find ground between streets into which no street leads yet.

    Returns
    -------
    list of tuple
        Polygons with an area of more than `size` squared; and where no street leads into a part of
        the domain at all its largest polygon. Whether it is one of the latter.
    """
    parts = shapely.get_parts(domain)
    lines = [*shapely.get_rings(parts), *shapely.linestrings(net.nodes[net.ends])]
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(shapely.union_all(lines))))
    faces = faces[~shapely.is_empty(shapely.buffer(faces, -SLIVER / 2))]
    faces = shapely.normalize(faces)
    faces = faces[np.lexsort((*shapely.bounds(faces).T, -np.round(shapely.area(faces))))]
    inner = shapely.point_on_surface(faces)
    face, part = shapely.STRtree(parts).query(inner, predicate="intersects")
    ahead = [(p.xy[0] + p.way[0], p.xy[1] + p.way[1]) for p in places]
    served = np.zeros(len(faces), dtype=bool)
    if places:
        tree = shapely.STRtree(faces)
        served[tree.query(shapely.points(ahead), predicate="intersects")[1]] = True
    found = []
    done = set(part[served[face]].tolist())
    for k, own in sorted(zip(face.tolist(), part.tolist())):
        alone = own not in done
        done.add(own)
        if alone or (not served[k] and faces[k].area > size * size):
            found.append((faces[k], alone))
    return found


def starts_everywhere(
    net: GivenNetwork, wish: Wish, crs: CRS, problems: Problems
) -> tuple[tuple[Start, ...], GivenNetwork]:
    """Find where growth begins around roads, where there is no domain.

    Parameters
    ----------
    net, wish, crs, problems
        As of `starts_in`.

    Returns
    -------
    tuple
        As of `starts_in`.

    Raises
    ------
    InputError
        If no point can be used, or the roads leave no open land.
    """
    sight = Sight(None, net, FAR * wish.scale)
    if wish.points is not None:
        places = asked_for(
            wish.points, crs, Streets(net, None), sight, problems, layer=wish.point_layer,
            snap_distance=wish.reach, direction=wish.way or (0.0, 1.0),
        )  # fmt: skip
        return settle(thinned(places, wish.spacing), net, wish.grammar)
    places = with_sight(in_open_land(street_places(net), net), sight, wish.spacing)
    ask(wish.progress, "Looking for places where streets begin", 0.8)
    places = with_main(thinned(places, wish.spacing), wish.grammar)
    if not places:
        places = entries(net, None, wish.grammar, sight, scale=wish.scale, room=2 * wish.spacing)
    if not places:
        raise InputError(
            "The roads leave no open land from which streets could grow.",
            "Give points where they begin, or a smaller scale.",
        )
    return settle(places, net, wish.grammar)


def spacing_of(spacing: float | None, scale: float) -> float:
    """Give the spacing of starts, metres.

    Parameters
    ----------
    spacing
        As the planner gives it, or None.
    scale
        Metres per unit of the grammar.

    Raises
    ------
    InputError
        If one of them is not greater than 0.
    """
    if not scale > 0:
        raise InputError(f"The scale is {scale:g}.", "Give metres per unit greater than 0.")
    if spacing is not None and not spacing > 0:
        raise InputError(f"The spacing of starts is {spacing:g} m.", "Give more than 0 m.")
    return SPACING * scale if spacing is None else spacing


def ask(progress: Progress, text: str, fraction: float) -> None:
    """Tell the stage, and stop where the caller has cancelled.

    Parameters
    ----------
    progress
        The caller.
    text, fraction
        As of `Progress.stage`.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    progress.stage(text, fraction)
    if progress.cancelled():
        raise CancelledError("Cancelled while the ground was prepared.")
