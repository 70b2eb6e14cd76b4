"""What real and grown streets measure, side by side; and what CitySprout published of its own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import shapely
from platwright.growth.grammars.shipped import shipped_grammar
from platwright.growth.grow import grow
from platwright.growth.rules import GrowthRules
from platwright.growth.types import Ground, Growth, Start
from platwright.measure.centrality import centrality
from platwright.measure.circuity import mean_circuity
from platwright.measure.density import road_density
from platwright.measure.graph import StreetGraph
from platwright.measure.living import living_v2
from platwright.measure.natural import meetings
from platwright.osm.classes import street_level

from _gallery_growth_places import CITIES, POPULATION, PUBLISHED

#: Paths and service ways are not compared.
PATH = 4
COLUMNS = (
    ("km", "LENGTH_KM", "{:.0f}"),
    ("km/km²", "STREET_KM_KM2", "{:.1f}"),
    ("street space", "ROADS_PCT", "{:.0f} %"),
    ("circuity", "CIRCUITY", "{:.2f}"),
    ("order", "ORDER", "{:.2f}"),
    ("T", "T_PCT", "{:.0f} %"),
    ("X", "X_PCT", "{:.0f} %"),
    ("dead ends", "DEAD_ENDS_PCT", "{:.0f} %"),
    ("median block, ha", "BLOCK_MEDIAN_HA", "{:.2f}"),
    ("livability", "LIVABILITY", "{:.0f}"),
)


def streets_of_town(path: Path) -> gpd.GeoDataFrame:
    """Read the streets of a town that cars use, with their level."""
    streets = gpd.read_file(path, layer="streets")
    streets["level"] = [street_level(kind) for kind in streets["highway"]]
    return streets[streets["level"] < PATH].reset_index(drop=True)


def head() -> list[str]:
    """Return the head of the table."""
    names = " | ".join(name for name, _, _ in COLUMNS)
    return [f"| | {names} | L per km |", "|---" * (len(COLUMNS) + 2) + "|"]


def row(name: str, numbers: Mapping[str, Any]) -> str:
    """Return the row of a layer."""
    cells = [form.format(float(numbers[key])) for _, key, form in COLUMNS]
    each = float(numbers["LIVABILITY"]) / float(numbers["LENGTH_KM"])
    return f"| {name} | {' | '.join(cells)} | {each:.0f} |"


def published() -> list[str]:
    """Grow as CitySprout does, and put its medians and ours into a table.

    Its road density is length by the ground that the alpha shape of the nodes covers; its living
    metric compares the betweenness of roads that meet.
    """
    lines = [
        "| grammar | circuity | | road density, hm/hm² | | living, λ = 1 | | living, λ = 5 | |",
        "|---" * 9 + "|",
        "| | theirs | ours | theirs | ours | theirs | ours | theirs | ours |",
    ]
    for name, theirs in PUBLISHED.items():
        ours = np.median([_city(name, seed) for seed in range(CITIES)], axis=0)
        pairs = " | ".join(f"{one:.3f} | {other:.3f}" for one, other in zip(theirs, ours))
        lines.append(f"| {name} | {pairs} |")
    return lines


def _city(name: str, seed: int) -> tuple[float, float, float, float]:
    """Grow a city of their size, in their units, and measure it as they do."""
    grammar = shipped_grammar(name)
    ground = Ground((Start((0.0, 0.0), (0.0, 1.0), grammar.start),))
    rules = GrowthRules(
        grammar, iterations=1000, population=POPULATION, as_published=True, seed=seed
    )
    growth = grow(ground, rules)
    graph = _graph(growth)
    found = centrality(
        len(graph.nodes), graph.ends, graph.lengths, exact=len(graph.nodes), sources=1
    )
    road = np.unique(growth.road, return_inverse=True)[1]
    score = np.bincount(road, found.edges)
    pairs = meetings(graph.ends, road)
    circuity = mean_circuity(graph, apart=0.0, pairs=10**9)
    return (
        circuity.mean_of_ratios,
        road_density(graph).hm_per_hm2,
        living_v2(pairs, score, 1.0),
        living_v2(pairs, score, 5.0),
    )


def _graph(growth: Growth) -> StreetGraph:
    lines = tuple(shapely.linestrings(growth.xy[growth.ends]))
    return StreetGraph(growth.xy, growth.ends, lines, np.arange(len(growth.ends)))


def faults(streets: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Find where streets cross, touch or overlap others without a junction, as points.

    Parameters
    ----------
    streets
        The layer of the tool: straight lines from node to node.
    """
    lines = streets.geometry.to_numpy()
    one, other = shapely.STRtree(lines).query(lines, predicate="intersects")
    met = shapely.intersection(lines[one], lines[other])
    ends = shapely.boundary(lines)
    # What two streets share is an end of both of them where they meet in a junction.
    both = shapely.intersection(ends[one], ends[other])
    odd = (one < other) & ~shapely.is_empty(shapely.difference(met, shapely.buffer(both, 0.01)))
    near = _touching(lines, ends)
    places = np.concatenate([shapely.point_on_surface(met[odd]), near])
    # one mark for a place, however many streets meet there
    places = places[
        np.unique(np.round(shapely.get_coordinates(places)), axis=0, return_index=True)[1]
    ]
    return gpd.GeoDataFrame(geometry=places, crs=streets.crs)


def _touching(lines: Any, ends: Any) -> Any:
    """Return ends of lines that lie on another one, though no end of that is there."""
    points = np.unique(shapely.get_coordinates(ends), axis=0)
    place = shapely.points(points)
    at, line = shapely.STRtree(lines).query(place, predicate="dwithin", distance=0.01)
    lies = shapely.distance(place[at], ends[line]) > 2 * 0.01
    return place[np.unique(at[lies])]
