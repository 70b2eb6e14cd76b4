"""Figures of a street pattern, designed or real, by which one can be held against the other.

`measure_plan` tells what a plan has; this tells how a pattern looks, in shares and quotients
that do not grow with the place. Nothing is known of how the streets came about: a layer cut out
of a map is measured exactly as a designed one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely

from ..errors import InputError
from ..site.crs import layer_crs
from .distances import distances_to_sinks, mean_along
from .graph import BoolArray, Chain, FloatArray, StreetGraph, chains
from .layers import EXISTING, StreetLayer, read_streets, read_union
from .plan import BEND, CONTINUES, THIN, WIDTH_BAND, block_sides, blocks
from .turns import bends, leaving, turns

#: Corners further than this from a right angle, and from straight on, are odd (degrees).
ODD = 20.0
#: Directions at junctions are taken over this length, or half of a shorter street (metres).
LOOK = 15.0
#: Turns in one direction within this length are one bend (metres).
WINDOW = 20.0
#: At a junction a street goes straight on up to this turn (degrees).
THROUGH = 45.0
#: Junctions nearer along a street than this share of the block width are offset.
OFFSET = 0.3
#: A block wider than this share of the asked width is too deep: its middle has no street.
DEEP = 1.35
#: Streets that end this near to the edge of the site lie on it (metres).
TOUCH = 2.0
#: Share of a street that has to lie inside the site for it to be one of its streets.
INSIDE = 0.5


@dataclass(frozen=True)
class PatternMetrics:
    """Figures of a street pattern inside a site.

    Attributes
    ----------
    length_per_hectare
        New streets, metres per hectare of site.
    bends_per_km
        Turns over 20 degrees between junctions, per kilometre of new street.
    turning_per_km
        All turns along new streets, also where they go on through a junction, in degrees per
        kilometre, left and right alike: what wobbles turns more than what is straight.
    t_junctions, crossings
        Shares of junctions of new streets inside the site where three, and where four or more
        streets meet.
    dead_ends_per_km
        Blind ends inside the site, per kilometre.
    odd_corners
        Share of the corners at junctions that are more than 20 degrees from 90 and from 180;
        corners between two existing streets do not count.
    offsets
        Junctions with another one nearer than 0.3 block widths along a street, as a share of
        those of new streets.
    continued, arriving
        Share of streets that arrive at the site and go on into it with a turn of less than 30
        degrees, and how many arrive.
    blocks
        Number of blocks.
    width_off, length_off
        Mean of how many times blocks are wider or narrower, longer or shorter than asked, as
        the absolute natural logarithm: 0.69 for half as well as for double.
    good, thin, deep
        Shares of the blocks with 76-111 % of the asked width, less than 62 %, more than 135 %.
    rectangularity
        Mean share of a block in the smallest rectangle around it.
    way_out
        Mean distance along streets from new streets to existing ones, metres.
    """

    length_per_hectare: float
    bends_per_km: float
    turning_per_km: float
    t_junctions: float
    crossings: float
    dead_ends_per_km: float
    odd_corners: float
    offsets: float
    continued: float
    arriving: int
    blocks: int
    width_off: float
    length_off: float
    good: float
    thin: float
    deep: float
    rectangularity: float
    way_out: float

    def as_dict(self) -> dict[str, float]:
        """Give the figures by name, in the order of the class."""
        return asdict(self)


@dataclass(frozen=True)
class Grain:
    """How large the blocks of a pattern are, in metres.

    Attributes
    ----------
    width, length
        Medians by area: half of the ground lies in blocks that are narrower, and shorter.
    longest
        Three quarters of the ground lie in blocks that are no longer.
    """

    width: float
    length: float
    longest: float


def measure_pattern(
    streets: gpd.GeoDataFrame,
    site: gpd.GeoDataFrame,
    existing: gpd.GeoDataFrame,
    *,
    block_width: float,
    block_length: float,
    obstacles: gpd.GeoDataFrame | None = None,
) -> PatternMetrics:
    """Measure the pattern of streets inside a site.

    Parameters
    ----------
    streets
        The streets inside, in any CRS; those whose field `status` says existing or given are
        left out.
    site
        Polygons of the site.
    existing
        The streets on its edge and around it.
    block_width, block_length
        What blocks are measured against, metres, greater than 0.
    obstacles
        Pieces of ground that are more than half obstacle are no blocks.

    Raises
    ------
    InputError
        If a layer has no CRS or holds no lines, or a length is not above 0.

    Examples
    --------
    >>> import geopandas as gpd
    >>> from shapely.geometry import LineString, box
    >>> site = gpd.GeoDataFrame(geometry=[box(0, 0, 144, 150)], crs=32633)
    >>> edge = gpd.GeoDataFrame(geometry=[site.geometry[0].exterior], crs=32633)
    >>> spine = gpd.GeoDataFrame(geometry=[LineString([(72, 0), (72, 150)])], crs=32633)
    >>> found = measure_pattern(spine, site, edge, block_width=72, block_length=150)
    >>> found.blocks, found.good, found.odd_corners, found.bends_per_km
    (2, 1.0, 0.0, 0.0)
    """
    if not (block_width > 0 and block_length > 0):
        raise InputError(
            f"Blocks of {block_width:g} by {block_length:g} m are asked for.",
            "Give lengths in metres greater than 0.",
        )
    layer = _together(streets, existing)
    ground = read_union(site, layer.crs, "Site")
    graph, new = layer.graph, _inside(layer, ground)
    inner = blocks(layer, ground, read_union(obstacles, layer.crs, "Obstacles"))
    width, side, filled = block_sides(inner)
    length, area = float(graph.lengths[new].sum()), float(ground.area) / 1e4
    at = _at(graph, new)
    old = _at(graph, ~new)
    degrees = graph.degrees
    junction = at & ~old & (degrees > 2)
    ways = chains(graph, new, old)
    blind = at & ~old & (degrees == 1) & ~graph.near(ground.boundary, TOUCH)
    continued, arriving = _continued(graph, new, ground)
    km = max(length / 1000, 1e-9)
    way = distances_to_sinks(graph, at & old)
    return PatternMetrics(
        length_per_hectare=length / area if area else 0.0,
        bends_per_km=len(bends(ways, BEND, WINDOW)) / km,
        turning_per_km=_turning(graph, new, ways) / km,
        t_junctions=_share(degrees[junction] == 3),
        crossings=_share(degrees[junction] > 3),
        dead_ends_per_km=int(blind.sum()) / km,
        odd_corners=_share(_corners(graph, new) > ODD),
        offsets=_offsets(graph, new, OFFSET * block_width),
        continued=continued / arriving if arriving else 1.0,
        arriving=arriving,
        blocks=len(inner),
        width_off=_off(width, block_width),
        length_off=_off(side, block_length),
        good=_share(
            (width >= WIDTH_BAND[0] * block_width) & (width <= WIDTH_BAND[1] * block_width)
        ),
        thin=_share(width < THIN * block_width),
        deep=_share(width > DEEP * block_width),
        rectangularity=float(filled.mean()) if len(filled) else 0.0,
        way_out=mean_along(graph, way, new),
    )


def pattern_grain(
    streets: gpd.GeoDataFrame, site: gpd.GeoDataFrame, existing: gpd.GeoDataFrame
) -> Grain:
    """Measure how large the blocks of a pattern are, by area.

    Parameters
    ----------
    streets, site, existing
        See `measure_pattern`.

    Raises
    ------
    InputError
        If a layer has no CRS, holds no lines, or there is no block.
    """
    layer = _together(streets, existing)
    found = blocks(layer, read_union(site, layer.crs, "Site"), shapely.GeometryCollection())
    if not found:
        raise InputError("There is no block.", "Give a site with streets around it.", layer="Site")
    width, side, _ = block_sides(found)
    area = np.asarray(shapely.area(np.array(found, dtype=object)))
    return Grain(
        _quantile(width, area, 0.5), _quantile(side, area, 0.5), _quantile(side, area, 0.75)
    )


def _together(streets: gpd.GeoDataFrame, existing: gpd.GeoDataFrame) -> StreetLayer:
    """Read new and existing streets as one layer, in the CRS of the new ones."""
    named = (("Streets", streets, "new"), ("Existing streets", existing, EXISTING[0]))
    full = [entry for entry in named if len(entry[1])] or [*named[:1]]
    given = [layer_crs(frame, name) for name, frame, _ in full]
    parts = []
    for _, frame, status in full:
        mine = frame
        if status == "new" and "status" in frame.columns:
            mine = frame[~frame["status"].isin(EXISTING)]
        shapes = mine.geometry.to_crs(given[0]).to_numpy()
        words = {"status": [status] * len(mine)}
        parts.append(gpd.GeoDataFrame(words, geometry=shapes, crs=given[0]))
    together = gpd.GeoDataFrame(pd.concat(parts, ignore_index=True))
    return read_streets(together, "Streets")


def _inside(layer: StreetLayer, site: shapely.Geometry) -> BoolArray:
    """Tell which edges are new streets of the site, shape (e,)."""
    lines = np.array(layer.graph.lines, dtype=object)
    within = shapely.length(shapely.intersection(lines, shapely.buffer(site, -TOUCH)))
    return np.asarray(layer.designed & (within > INSIDE * layer.graph.lengths))


def _at(graph: StreetGraph, edges: BoolArray) -> BoolArray:
    """Mark the nodes of edges, shape (n,)."""
    mark = np.zeros(len(graph.nodes), dtype=bool)
    mark[graph.ends[edges].ravel()] = True
    return mark


def _legs(graph: StreetGraph) -> tuple[list[list[int]], FloatArray]:
    """List the legs at each node (2 e for the start of edge e, 2 e + 1), and their directions."""
    at: list[list[int]] = [[] for _ in graph.nodes]
    for leg, node in enumerate(graph.ends.ravel().tolist()):
        at[node].append(leg)
    lengths = graph.lengths
    away = np.zeros((len(lengths), 2, 2))
    for e, line in enumerate(graph.lines):
        away[e] = leaving([line], min(LOOK, float(lengths[e]) / 2))[0]
    away = away.reshape(-1, 2)
    return at, np.asarray(away / np.maximum(np.hypot(*away.T), 1e-9)[:, None])


def _corners(graph: StreetGraph, new: BoolArray) -> FloatArray:
    """Measure how far corners are from 90 or 180 degrees, shape (k,)."""
    at, away = _legs(graph)
    angle = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    found: list[float] = []
    for legs in at:
        if len(legs) < 3:
            continue
        order = sorted(legs, key=lambda leg: float(angle[leg]))
        for one, other in zip(order, [*order[1:], order[0]]):
            if new[one // 2] or new[other // 2]:
                corner = float(angle[other] - angle[one]) % 360.0
                found.append(min(abs(corner - 90.0), abs(corner - 180.0)))
    return np.array(found)


def _turning(graph: StreetGraph, new: BoolArray, ways: Sequence[Chain]) -> float:
    """Sum of all turns along new streets, through junctions too, degrees."""
    total = sum(abs(turn.angle) for way in ways for turn in turns(way.line, WINDOW))
    at, away = _legs(graph)
    for legs in at:
        if len(legs) < 3:
            continue
        pairs = sorted(
            (float(away[a] @ away[b]), a, b)
            for i, a in enumerate(legs)
            for b in legs[i + 1 :]
            if new[a // 2] or new[b // 2]
        )
        used: set[int] = set()
        for cosine, a, b in pairs:
            if cosine <= -np.cos(np.radians(THROUGH)) and not used & {a, b}:
                used |= {a, b}
                total += 180.0 - float(np.degrees(np.arccos(max(cosine, -1.0))))
    return total


def _offsets(graph: StreetGraph, new: BoolArray, least: float) -> float:
    """Share of the junctions of new streets that have another one too near along a street."""
    at = _at(graph, new)
    many = at & (graph.degrees > 2)
    if not many.any():
        return 0.0
    wrong = np.zeros(len(graph.nodes), dtype=bool)
    for chain in chains(graph, np.ones(len(graph.lines), dtype=bool), np.zeros_like(many)):
        u, v = chain.ends
        if u != v and chain.line.length < least and many[u] and many[v]:
            wrong[[u, v]] = True
    return float(wrong[many].mean())


def _continued(graph: StreetGraph, new: BoolArray, site: shapely.Geometry) -> tuple[int, int]:
    """Count the streets that arrive from outside, and those of them that go on inside."""
    at, away = _legs(graph)
    lines = np.array(graph.lines, dtype=object)
    tips = (
        shapely.line_interpolate_point(lines, np.minimum(LOOK, graph.lengths / 2)),
        shapely.line_interpolate_point(lines, -np.minimum(LOOK, graph.lengths / 2)),
    )
    outside = np.zeros(2 * len(lines), dtype=bool)
    for side in (0, 1):
        outside[side::2] = ~new & ~shapely.dwithin(tips[side], site, TOUCH)
    least = np.cos(np.radians(CONTINUES))
    continued = arriving = 0
    for node in np.flatnonzero(graph.near(site.boundary, TOUCH)).tolist():
        inner = [leg for leg in at[node] if new[leg // 2]]
        for leg in at[node]:
            # a street that ends at the edge of the map, or runs on along the site, does not arrive
            if not outside[leg] or len(at[node]) < 3:
                continue
            if any(not new[o // 2] and away[o] @ away[leg] < -least for o in at[node]):
                continue
            arriving += 1
            continued += any(away[o] @ away[leg] < -least for o in inner)
    return continued, arriving


def _off(values: FloatArray, asked: float) -> float:
    """Mean of the absolute logarithms of how many times values are what was asked."""
    if not len(values):
        return 0.0
    return float(np.abs(np.log(np.maximum(values, 1.0) / asked)).mean())


def _share(values: BoolArray) -> float:
    return float(np.asarray(values).mean()) if len(values) else 0.0


def _quantile(values: FloatArray, weights: FloatArray, share: float) -> float:
    """Return the least value that this share of the weight does not exceed."""
    order = np.argsort(values, kind="stable")
    reached = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(reached, share * reached[-1])])
