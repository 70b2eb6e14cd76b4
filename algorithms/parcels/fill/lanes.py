"""Rear lanes: a deep block is parted by a narrow lane that gives access to rows along it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import MultiLineString, Polygon

from ...measure.parcel_shape import corner_deviation, rectangle_ratio, undesirable
from ..halving.faces import CORNER
from ..halving.halve import halve_block
from ..halving.mosaic import Mosaic
from ..halving.rectangle import smallest_rectangle
from ..halving.skeleton import skeleton_block
from ..halving.wavefront import SkeletonError
from ..rules import ParcelRules
from ..types import Block, Plot

Place = tuple[float, float]
#: Most lanes one inside the other.
LEVELS = 4
#: A court counts as much as this share of the parcels that its land holds, for another lane
#: may serve it.
HOPE = 0.5
#: Ways to lay lanes that are cut in full.
CHOICES = 2
#: Lanes for which parcels are cut by way of trial, and the land that a row takes, in depths.
PROMISING, ROWS = 5, 1.2
#: An undesirable parcel is worth less by this.
UGLY = 0.6


@dataclass(frozen=True)
class Parted:
    """A block parted by lanes.

    Attributes
    ----------
    lanes
        Land of the lanes.
    pieces
        What is left: blocks whose streets are the lanes too.
    """

    lanes: list[Polygon]
    pieces: list[Block]


def lane_choices(
    block: Block,
    rules: ParcelRules,
    cancelled: Callable[[], bool] = lambda: False,
    count: int = CHOICES,
) -> list[Parted]:
    """Part a deep block by lanes from street to street, as many as it takes, in several ways.

    Lanes along the axes of the smallest rectangle around and along the longest sides are tried,
    in the middle and at two depths from either edge; what promises most parcels comes first, and
    pieces that are still too deep are parted again.

    Parameters
    ----------
    block
        A sound block.
    rules
        What is asked; `lane_width`, `width`, `depth` and areas count.
    cancelled
        Asked between trials; what was found so far is returned.
    count
        How many ways to return at most, greater than 0.

    Returns
    -------
    list of Parted
        Best first; none if no lane serves more parcels than there are without.
    """
    found = []
    for first in _best_lanes(block, rules, cancelled)[:count]:
        lanes, done = list(first.lanes), []
        todo = [(piece, 1) for piece in first.pieces]
        while todo:
            piece, level = todo.pop()
            more = _best_lanes(piece, rules, cancelled)[:1] if level < LEVELS else []
            if not more:
                done.append(piece)
            for parted in more:
                lanes += parted.lanes
                todo += [(part, level + 1) for part in parted.pieces]
        found.append(Parted(lanes, done))
    return found


def value(block: Block, rules: ParcelRules) -> tuple[float, float]:
    """Return the worth of a block cut by the straight skeleton, and the area of its courts.

    Parameters
    ----------
    block, rules
        See `lane_choices`.
    """
    try:
        plots = skeleton_block(block, rules)
    except SkeletonError:
        plots = halve_block(block, rules)
    return worth(plots, rules)


def worth(plots: list[Plot], rules: ParcelRules) -> tuple[float, float]:
    """Return the worth of plots in parcels, and the area of courts, square metres.

    Parameters
    ----------
    plots, rules
        See `lane_choices`.
    """
    shapes = np.array([plot.polygon for plot in plots if plot.use == "parcel"], dtype=object)
    court = sum(plot.polygon.area for plot in plots if plot.use == "court")
    if not len(shapes):
        return 0.0, court
    # parcels larger than wished for count by their land, up to a point
    size = np.clip(shapely.area(shapes) / rules.area, 0.5, 1.3)
    bad = undesirable(corner_deviation(shapes), rectangle_ratio(shapes))
    return float(size.sum() - UGLY * bad.sum()), court


def _best_lanes(block: Block, rules: ParcelRules, cancelled: Callable[[], bool]) -> list[Parted]:
    """Return a block parted by one lane, in the ways that are better than none, best first."""
    before, court = value(block, rules)
    if court < rules.least_area:
        return []
    tried: list[tuple[float, float, Parted]] = []
    for place, way in lane_places(block, rules):
        parted = cut_lane(block, place, way, rules.lane_width)
        if parted is not None:
            cost = _awkward(block, parted.lanes[0], way, rules)
            tried.append((cost - _served(parted, rules), cost, parted))
    tried.sort(key=lambda entry: entry[0])
    found: list[tuple[float, Parted]] = []
    for _, cost, parted in tried[:PROMISING]:
        if cancelled():
            break
        gained = -cost
        for piece in parted.pieces:
            parcels, left = value(piece, rules)
            gained += parcels + HOPE * left / rules.area
        if gained > before + 1e-9:
            found.append((gained, parted))
    return [parted for _, parted in sorted(found, key=lambda pair: -pair[0])]


def _served(parted: Parted, rules: ParcelRules) -> float:
    """Return roughly how many parcels the land near streets and lanes holds."""
    rims = [
        piece.polygon.boundary
        if piece.closed.is_empty
        else piece.polygon.boundary.difference(piece.closed.buffer(0.02, cap_style="flat"))
        for piece in parted.pieces
    ]
    near = shapely.buffer(rims, ROWS * rules.depth, quad_segs=2)
    land = shapely.intersection(near, [piece.polygon for piece in parted.pieces])
    return float(shapely.area(land).sum() / rules.area)


def _awkward(block: Block, lane: Polygon, way: Place, rules: ParcelRules) -> float:
    """Return what the ends of a lane cost, in parcels: near corners, or askew to the street."""
    rim = shapely.get_coordinates(block.polygon.simplify(0.5).exterior)
    edges = np.diff(rim, axis=0)
    sizes = np.maximum(np.hypot(edges[:, 0], edges[:, 1]), 1e-9)
    lines = shapely.linestrings(np.stack([rim[:-1], rim[1:]], axis=1))
    touching = (
        shapely.length(shapely.intersection(lines, lane.buffer(0.05))) > 0.5 * rules.lane_width
    )
    askew = np.abs(edges @ np.array(way)) / sizes > math.cos(math.radians(60))
    heading = np.arctan2(edges[:, 1], edges[:, 0])
    turn = (heading - np.roll(heading, 1) + np.pi) % (2 * np.pi) - np.pi
    corners = shapely.points(rim[:-1][np.abs(turn) > math.radians(CORNER)])
    near = int((shapely.distance(corners, lane) < rules.width).sum()) if len(corners) else 0
    return float(np.count_nonzero(touching & askew) + near)


def lane_places(block: Block, rules: ParcelRules) -> Iterator[tuple[Place, Place]]:
    """Yield middle lines of lanes to try, as places and directions.

    Parameters
    ----------
    block, rules
        See `lane_choices`.
    """
    xy = shapely.get_coordinates(block.polygon.exterior)
    (cx, cy), long_way, _, _ = smallest_rectangle(xy[:-1])
    edges = np.diff(xy, axis=0)
    sizes = np.hypot(edges[:, 0], edges[:, 1])
    ways = [long_way, (-long_way[1], long_way[0])]
    for i in np.argsort(-sizes, kind="stable")[:3].tolist():
        x, y = (edges[i] / sizes[i]).tolist()
        if all(abs(x * ay - y * ax) > 0.05 for ax, ay in ways):
            ways.append((x, y))
    for wx, wy in ways:
        off = (xy - (cx, cy)) @ np.array([-wy, wx])
        low, high = float(off.min()), float(off.max())
        two_rows = 2 * rules.depth + rules.lane_width / 2
        places = [(low + high) / 2, low + two_rows, high - two_rows]
        for at in places[: 3 if high - low > 2 * two_rows else 1]:
            yield (cx - at * wy, cy + at * wx), (wx, wy)


def cut_lane(block: Block, place: Place, way: Place, width: float) -> Parted | None:
    """Part a block by a straight lane.

    Parameters
    ----------
    block
        A sound block.
    place, way
        A place on the middle line of the lane, and its direction of length 1.
    width
        Of the lane, metres.

    Returns
    -------
    Parted or None
        None if the lane would be in pieces, or meet no street.
    """
    mosaic = Mosaic(block.polygon, block.closed)
    (x, y), (wx, wy) = place, way
    off = width / 2
    parts = mosaic.cut(0, (x - off * wy, y + off * wx), way)
    parts = [new for part in parts for new in mosaic.cut(part, (x + off * wy, y - off * wx), way)]
    middle = {
        part for part in parts
        if np.ptp((mosaic.places(part) - place) @ np.array([-wy, wx])) < width + 0.1
        and abs(float(((mosaic.places(part) - place) @ np.array([-wy, wx])).mean())) < width / 2
    }  # fmt: skip
    if len(middle) != 1 or len(parts) < 3:
        return None
    lane = middle.pop()
    if mosaic.frontage(lane) < 0.9 * width:
        return None
    rest = sorted(set(parts) - {lane})
    mine = {(b, a) for a, b in mosaic.edges(lane)}
    pieces = []
    for part in rest:
        edges = mosaic.edges(part)
        closed = [
            (mosaic.xy[a], mosaic.xy[b])
            for a, b in edges
            if not mosaic.is_front((a, b)) and (a, b) not in mine
        ]
        polygon = mosaic.polygons([part])[0]
        pieces.append(replace(block, polygon=polygon, closed=MultiLineString(closed)))
    return Parted(mosaic.polygons([lane]), pieces)
