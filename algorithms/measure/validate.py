"""An independent check of any street layer against a site and the rules of a design.

It shares no code with the model or the search: it reads the geometry of the streets alone.
"""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import shapely

from ..errors import CancelledError, InputError
from ..progress import Progress
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
from .graph import BoolArray
from .layers import StreetLayer, read_streets, read_union
from .problems import Problem, ValidationReport, problem_layer, weighted
from .surroundings import (
    Surroundings,
    coverage_gaps,
    forbidden_lines,
    inside_obstacles,
    outside_site,
    required_lines,
)

#: Weight of a rule that must never be broken, and of one that does not matter.
FORBID = float("inf")
ALLOW = 0.0


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
    edge_length: float = 72.0,
    dead_ends: float = FORBID,
    zigzags: float = ALLOW,
    too_close: float = ALLOW,
    t_junctions: float = ALLOW,
    branches: float = ALLOW,
    lollipops: float = ALLOW,
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
        Lines in any CRS; the index holds the feature ids. Fields `status` (existing,
        connector, else new), `level` and `dist_to_sink_m` are used where present: existing
        streets are exempt from the rules and count as sinks, connectors may leave the site.
    site
        Polygons; without them coverage and the edge are not checked.
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
    edge_length
        Edge length of the candidate mesh in metres, the scale of the local rules. Zigzags
        have their turns within 1.5, streets too close run within 0.6 of it.
    dead_ends, zigzags, too_close, t_junctions, branches, lollipops
        Weights of the local rules. A lollipop is a ring that hangs on a single street.
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
    _positive(edge_length=edge_length, coverage_m=coverage_m, snap_distance=snap_distance)
    frames = (
        ("site", site, "Site"),
        ("boundary_streets", boundary_streets, "Boundary streets"),
        ("obstacles", obstacles, "Obstacles"),
        ("required", required, "Required streets"),
        ("forbidden", forbidden, "Forbidden streets"),
    )
    stages = _Stages(progress)
    stages.enter("Joining the streets", 0.0)
    layer = read_streets(streets, street_layer)
    stages.enter("Reading the surroundings", 0.3)
    around = Surroundings(
        **{name: read_union(given, layer.crs, title) for name, given, title in frames},
        snap_distance=snap_distance,
    )
    exits = _exits(layer, around, sinks, edge_length)
    stages.enter("Checking the local rules", 0.4)
    found = _local_problems(layer, exits, edge_length, min_length)
    known = sinks is not None or around.has_exits or bool(exits.any())
    problems = geometry_faults(layer) + islands(layer, exits, known=known)
    weights = (dead_ends, zigzags, too_close, t_junctions, branches, lollipops, 1.0)
    for listed, weight in zip(found.values(), weights):
        problems += weighted(listed, weight)
    stages.enter("Checking against the site", 0.7)
    place, uncovered = _place_problems(layer, around, edge_length, coverage_m)
    problems += place
    stages.enter("Measuring distances", 0.9)
    distance = distances_to_sinks(layer.graph, exits)
    problems += recorded_distances(layer, exits, distance)
    numbers = {_key(kind): float(len(listed)) for kind, listed in found.items()}
    numbers |= _lengths(layer, exits) | {"UNCOVERED_AREA": uncovered}
    frame = problem_layer(problems, layer.crs, layer.source_crs)
    report = ValidationReport(frame, numbers)
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


def _place_problems(
    layer: StreetLayer, around: Surroundings, edge_length: float, coverage_m: float | None
) -> tuple[list[Problem], float]:
    """Every problem with the surroundings, and the area without coverage."""
    problems = inside_obstacles(layer, around) + outside_site(layer, around)
    problems += required_lines(layer, around, edge_length / 2) + forbidden_lines(layer, around)
    if coverage_m is None:
        return problems, 0.0
    gaps, area = coverage_gaps(layer, around, coverage_m)
    return problems + gaps, area


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


def _lengths(layer: StreetLayer, sinks: BoolArray) -> dict[str, float]:
    """Length and distances of the designed streets, metres."""
    graph, use = layer.graph, layer.designed
    distance = distances_to_sinks(graph, sinks)
    far = farthest_along(graph, distance)[use]
    far = far[np.isfinite(far)]
    return {
        "TOTAL_LENGTH": float(graph.lengths[use].sum()),
        "MEAN_DISTANCE": mean_along(graph, distance, use),
        "MAX_DISTANCE": float(far.max()) if len(far) else 0.0,
    }


def _key(kind: str) -> str:
    return kind.upper().replace(" ", "_").replace("-", "_")


def _positive(**numbers: float | None) -> None:
    for name, value in numbers.items():
        if value is not None and not 0 < value < float("inf"):
            raise InputError(f"{name} must be greater than 0.", "Give a length in metres.")
