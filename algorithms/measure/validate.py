"""An independent check of any street layer against a site and the rules of a design.

It shares no code with the model or the search: it reads the geometry of the streets alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import geopandas as gpd
import numpy as np
import shapely

from ..errors import CancelledError, InputError
from ..progress import Progress
from .areas import gaps_by_area, read_areas
from .checks import (
    dead_ends,
    geometry_faults,
    islands,
    junctions,
    lollipops,
    recorded_distances,
    short_streets,
    sink_nodes_near,
    too_close_problems,
    zigzag_problems,
)
from .distances import distances_to_sinks, farthest_along, mean_along
from .functions import SiteFeatures, junctions_too_near, over_budget, too_far, too_many_exits
from .graph import BoolArray, FloatArray
from .layers import StreetLayer, read_features, read_streets, read_union
from .oneway import one_way_faults
from .problems import Problem, ValidationReport, problem_layer, weighted
from .surroundings import (
    Surroundings,
    forbidden_lines,
    inside_obstacles,
    outside_site,
    required_lines,
)

#: Weight of a rule that must never be broken, and of one that does not matter.
FORBID = float("inf")
ALLOW = 0.0
#: Kinds of limits that no rules only price.
_COUNTED = ("exits", "length budget")
#: Names of the layers of `Surroundings`, for messages.
_LAYERS = {
    "site": "Site",
    "boundary_streets": "Boundary streets",
    "obstacles": "Obstacles",
    "required": "Required streets",
    "forbidden": "Forbidden streets",
}


class _Limits(NamedTuple):
    """What is asked of the whole network; None where nothing is."""

    exits_most: int | None
    length_budget_m: float | None
    max_distance_m: float | None
    junction_spacing_m: float | None


def validate_network(
    streets: gpd.GeoDataFrame,
    *,
    site: gpd.GeoDataFrame | None = None,
    sinks: gpd.GeoDataFrame | None = None,
    obstacles: gpd.GeoDataFrame | None = None,
    boundary_streets: gpd.GeoDataFrame | None = None,
    required: gpd.GeoDataFrame | None = None,
    forbidden: gpd.GeoDataFrame | None = None,
    coverage_m: float | None = None,
    coverage_areas: gpd.GeoDataFrame | None = None,
    coverage_slack_m: float = 0.0,
    exits_most: int | None = None,
    length_budget_m: float | None = None,
    max_distance_m: float | None = None,
    junction_spacing_m: float | None = None,
    edge_length: float = 72.0,
    dead_ends: float = FORBID,
    zigzags: float = ALLOW,
    too_close: float = ALLOW,
    t_junctions: float = ALLOW,
    branches: float = ALLOW,
    lollipops: float = ALLOW,
    functions: float = FORBID,
    min_length: float = 0.0,
    snap_distance: float = 30.0,
    street_layer: str = "Streets",
    progress: Progress | None = None,
) -> ValidationReport:
    """Check a street network against a site and rules (CND section 4).

    Always checked: streets without geometry, crossings without a junction, doubled streets,
    parts without a way to a sink, streets in obstacles or outside the site, required and
    forbidden lines, and the field `dist_to_sink_m` against distances computed afresh. The
    local rules have weights: infinite makes a violation an error, another positive number a
    warning, 0 turns the rule off.

    Parameters
    ----------
    streets
        Lines in any CRS; the index holds the feature ids. Fields `status` (existing or
        given, connector, else new), `level`, `dist_to_sink_m` and `oneway` are used where
        present: existing and given streets are exempt from the rules, count as sinks and as
        two-way, connectors may leave the site. Where `oneway` is true (yes, 1) traffic runs
        along the line only, where it is -1 against it; from every junction there must then be
        a way out, and to every junction a way in.
    site
        Polygons; without them coverage and the edge are not checked. Exits and metres are
        counted for each feature.
    sinks
        Points where traffic leaves; each makes the nearest junction within half an edge
        length a sink. Without them traffic leaves by the existing streets: those of the
        layer and `boundary_streets`, or, without the latter, all along the edge of the site.
    obstacles
        Polygons where no street may run for more than a metre.
    boundary_streets
        Existing streets along the edge of the site.
    required, forbidden
        Lines that must have a street within half an edge length, and that no designed street
        may meet.
    coverage_m
        No ground of the site may be further from a street, in metres; None for no check.
    coverage_areas
        Polygons with a range of their own in the field `coverage_m`, metres. The smallest
        counts where they overlap, `coverage_m` elsewhere.
    coverage_slack_m
        Metres by which the range of an area may be missed, and within which of its edge
        nothing is checked.
    exits_most
        Greatest number of places where designed streets meet existing ones or the edge.
    length_budget_m, max_distance_m, junction_spacing_m
        Greatest length of the designed streets, longest way out from any of their ends, and
        least way between two junctions of three or more streets, metres along streets. They
        may be missed by 3 %, as courses are drawn straighter than they were counted.
    edge_length
        Edge length of the candidate mesh in metres, the scale of the local rules. Zigzags
        have their turns within 1.5, streets too close run within 0.6 of it.
    dead_ends, zigzags, too_close, t_junctions, branches, lollipops
        Weights of the local rules. A lollipop is a ring that hangs on a single street.
    functions
        Weight of `max_distance_m`, `junction_spacing_m` and of ways along one-way streets.
    min_length
        A shorter street between two junctions gives a warning, in metres.
    snap_distance
        The edge of the site lies on a boundary street that is at most this far, in metres.
    street_layer
        Name of the layer, for messages.
    progress
        Told of the stages; may cancel between them.

    Raises
    ------
    CancelledError
        If `progress` asks to stop.
    InputError
        If a layer has no CRS, the streets are no lines, or a number is out of range.

    Examples
    --------
    >>> import geopandas as gpd
    >>> from shapely.geometry import LineString, box
    >>> site = gpd.GeoDataFrame(geometry=[box(0, 0, 200, 100)], crs=32633)
    >>> stub = gpd.GeoDataFrame(geometry=[LineString([(100, 0), (100, 60)])], crs=32633)
    >>> report = validate_network(stub, site=site)
    >>> report.problems["kind"].tolist(), report.violations
    (['dead end'], 1)
    """
    limits = _Limits(exits_most, length_budget_m, max_distance_m, junction_spacing_m)
    _positive(edge_length=edge_length, coverage_m=coverage_m, snap_distance=snap_distance)
    _positive(**limits._asdict())
    frames = (site, boundary_streets, obstacles, required, forbidden)
    stages = _Stages(progress)
    stages.enter("Joining the streets", 0.0)
    layer = read_streets(streets, street_layer)
    stages.enter("Reading the surroundings", 0.3)
    around = _surroundings(layer, frames, snap_distance)
    exits = _exits(layer, around, sinks, edge_length)
    stages.enter("Checking the local rules", 0.4)
    found = _local_problems(layer, exits, edge_length, min_length)
    known = sinks is not None or around.has_exits or bool(exits.any())
    problems = geometry_faults(layer) + islands(layer, exits, known=known)
    weights = (dead_ends, zigzags, too_close, t_junctions, branches, lollipops, 1.0)
    for listed, weight in zip(found.values(), weights):
        problems += weighted(listed, weight)
    stages.enter("Checking against the site", 0.7)
    problems += _place_problems(layer, around, edge_length)
    areas = read_areas(coverage_areas, layer.crs)
    gaps, uncovered = gaps_by_area(layer, around, coverage_m, areas, coverage_slack_m)
    stages.enter("Checking exits and ways", 0.8)
    wished = _function_problems(layer, around, exits, _features(site, layer), limits)
    problems += gaps + _weighted(wished, functions)
    stages.enter("Measuring distances", 0.9)
    distance = distances_to_sinks(layer.graph, exits, direction=layer.direction)
    problems += recorded_distances(layer, exits, distance)
    numbers = {_key(kind): float(len(listed)) for kind, listed in (found | wished).items()}
    numbers |= _lengths(layer, distance) | {"UNCOVERED_AREA": uncovered}
    return _report(layer, problems, numbers)


def _report(
    layer: StreetLayer, problems: list[Problem], numbers: dict[str, float]
) -> ValidationReport:
    """Put the problems into a layer and count those that are violations."""
    report = ValidationReport(problem_layer(problems, layer.crs, layer.source_crs), numbers)
    numbers["VIOLATIONS"] = float(report.violations)
    return report


class _Stages:
    """Tells the caller of stages and stops where the caller has cancelled."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress = progress

    def enter(self, text: str, fraction: float) -> None:
        if self.progress is None:
            return
        if self.progress.cancelled():
            raise CancelledError("Cancelled before the check of the streets was finished.")
        self.progress.stage(text, fraction)


def _surroundings(
    layer: StreetLayer, frames: Sequence[gpd.GeoDataFrame | None], snap_distance: float
) -> Surroundings:
    """Unite each of the layers that `_LAYERS` names."""
    united = {
        key: read_union(given, layer.crs, name)
        for given, (key, name) in zip(frames, _LAYERS.items())
    }
    return Surroundings(**united, snap_distance=snap_distance)


def _local_problems(
    layer: StreetLayer, sinks: BoolArray, edge_length: float, min_length: float
) -> dict[str, list[Problem]]:
    """Every violation of the local rules by kind, in the order of their weights."""
    chains = layer.designed_chains(sinks)
    return {
        "dead end": dead_ends(layer, sinks),
        "zigzag": zigzag_problems(layer, chains, edge_length),
        "too close": too_close_problems(layer, chains, edge_length),
        "t-junction": junctions(layer, sinks, "t-junction"),
        "branch": junctions(layer, sinks, "branch"),
        "lollipop": lollipops(layer, sinks),
        "short": short_streets(layer, chains, min_length),
    }


def _place_problems(layer: StreetLayer, around: Surroundings, edge_length: float) -> list[Problem]:
    """Every problem with the surroundings but coverage."""
    problems = inside_obstacles(layer, around) + outside_site(layer, around)
    return (
        problems + required_lines(layer, around, edge_length / 2) + forbidden_lines(layer, around)
    )


def _function_problems(
    layer: StreetLayer,
    around: Surroundings,
    sinks: BoolArray,
    sites: SiteFeatures,
    limits: _Limits,
) -> dict[str, list[Problem]]:
    """Every violation of what is asked of the whole network, by kind; one-way streets always."""
    found = {"one-way": one_way_faults(layer, sinks)}
    if limits.exits_most is not None:
        found["exits"] = too_many_exits(layer, around, sinks, sites, limits.exits_most)
    if limits.length_budget_m is not None:
        found["length budget"] = over_budget(layer, sites, limits.length_budget_m)
    if limits.max_distance_m is not None:
        found["way out"] = too_far(layer, sinks, limits.max_distance_m)
    if limits.junction_spacing_m is not None:
        found["junction spacing"] = junctions_too_near(layer, limits.junction_spacing_m)
    return found


def _weighted(wished: dict[str, list[Problem]], weight: float) -> list[Problem]:
    """Give what is asked of the whole network its severity; counts are never only priced."""
    return [
        problem
        for kind, listed in wished.items()
        for problem in weighted(listed, FORBID if kind in _COUNTED else weight)
    ]


def _features(site: gpd.GeoDataFrame | None, layer: StreetLayer) -> SiteFeatures:
    """Give the polygons for each of which exits and metres are counted."""
    found = read_features(site, layer.crs, "Site")
    if not found:
        return SiteFeatures(("",), ())
    return SiteFeatures(tuple(label for label, _ in found), tuple(shape for _, shape in found))


def _exits(
    layer: StreetLayer, around: Surroundings, sinks: gpd.GeoDataFrame | None, edge_length: float
) -> BoolArray:
    """Tell which nodes are sinks, shape (n,)."""
    if sinks is None:
        return around.sink_nodes(layer) | _led_out(layer, around)
    exits = np.zeros(len(layer.graph.nodes), dtype=bool)
    points = shapely.get_coordinates(read_union(sinks, layer.crs, "Sinks"))
    exits[sink_nodes_near(layer, points, edge_length / 2)] = True
    return exits


def _led_out(layer: StreetLayer, around: Surroundings) -> BoolArray:
    """Tell which nodes are outer ends of connectors: the road that they lead to goes on."""
    graph = layer.graph
    degree = np.bincount(graph.ends.ravel(), minlength=len(graph.nodes))
    ends = np.zeros(len(graph.nodes), dtype=bool)
    ends[graph.ends[layer.connector].ravel()] = True
    ends &= degree == 1
    if not around.site.is_empty and ends.any():
        outer = np.flatnonzero(ends)
        ends[outer] = ~shapely.contains_xy(around.site, graph.nodes[outer])
    return ends


def _lengths(layer: StreetLayer, distance: FloatArray) -> dict[str, float]:
    """Length and distances of the designed streets, metres."""
    graph, use = layer.graph, layer.designed
    far = farthest_along(graph, distance, layer.direction)[use]
    far = far[np.isfinite(far)]
    return {
        "TOTAL_LENGTH": float(graph.lengths[use].sum()),
        "MEAN_DISTANCE": mean_along(graph, distance, use, layer.direction),
        "MAX_DISTANCE": float(far.max()) if len(far) else 0.0,
    }


def _key(kind: str) -> str:
    return kind.upper().replace(" ", "_").replace("-", "_")


def _positive(**numbers: float | None) -> None:
    for name, value in numbers.items():
        if value is not None and not 0 < value < float("inf"):
            raise InputError(
                f"{name} must be greater than 0.", "Give a greater number, or nothing."
            )
