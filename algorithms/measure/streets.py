"""Measures of any layer of streets, designed or real: as fields, layers and figures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import pandas as pd
import shapely

from ..errors import InputError
from ..progress import Progress, Share, Silent
from ..site.watch import aside, ask
from .centrality import EXACT, SOURCES, Centrality, centrality
from .density import level_widths
from .graph import FloatArray, IntArray
from .junction_kinds import junction_kinds
from .living import living_structure
from .natural import MAX_TURN, natural_lines, natural_streets
from .orientation import bearings
from .polygons import read_polygons, united
from .segments import street_segments
from .street_features import feature_columns
from .street_figures import Network, StreetFigures, street_figures
from .street_input import MeasuredLayer, lines_of, read_measured

#: What goes on here, for those who cancel it.
_WORK = "the streets were measured"
#: The field with the widths of streets, where it has this name.
WIDTH_FIELD = "width_m"


@dataclass(frozen=True)
class StreetOptions:
    """How streets are measured.

    Attributes
    ----------
    max_turn
        Greatest turn within a natural street, degrees.
    width_field
        Field with the widths of streets in metres; empty: `width_m`, where there is one.
    width
        Width of streets without one, metres; None: that of their level (see `density.WIDTHS`),
        a local street's where it has none.
    centrality
        Whether to measure betweenness and closeness.
    exact, sources, seed
        See `centrality.centrality`.
    """

    max_turn: float = MAX_TURN
    width_field: str = ""
    width: float | None = None
    centrality: bool = True
    exact: int = EXACT
    sources: int = SOURCES
    seed: int = 0


@dataclass(frozen=True, eq=False)
class StreetReport:
    """What was found about a layer of streets; all layers in its CRS.

    Attributes
    ----------
    streets
        The layer as it was given, with the columns of `street_features.feature_columns` set anew;
        features keep only what is line of them.
    natural
        One row for each natural street: natural_id, as in `streets`, from 1 for the longest;
        length_m, segments (pieces between nodes), connectivity (number of others that it meets),
        hierarchy (class of head/tail breaks of the connectivity, 1 for the many small ones).
    nodes
        Junctions and dead ends as points: junction_id from 1, degree, kind and deviation_deg (see
        `junction_kinds.JunctionKinds`), betweenness and closeness (see `centrality.Centrality`).
    figures
        See there.
    problems
        What was left out or is doubtful: layer, feature, problem, action, severity.
    sources, connected
        Number of nodes that centrality was measured from and of those that are joined to others:
        the same where it is exact; 0 where it was not measured.
    """

    streets: gpd.GeoDataFrame
    natural: gpd.GeoDataFrame
    nodes: gpd.GeoDataFrame
    figures: StreetFigures
    problems: gpd.GeoDataFrame
    sources: int
    connected: int


def measure_streets(
    streets: gpd.GeoDataFrame,
    *,
    site: gpd.GeoDataFrame | None = None,
    options: StreetOptions | None = None,
    street_layer: str = "Streets",
    site_layer: str = "Site",
    progress: Progress | None = None,
) -> StreetReport:
    """Measure the streets of a layer.

    Parameters
    ----------
    streets
        Lines in any CRS that meet at their ends or at shared vertices; the index holds the
        feature ids. Not changed.
    site
        Polygons; None: all streets count. Fields are measured in the whole layer in any case.
    options
        How; None: as usual.
    street_layer, site_layer
        Names of the layers, for messages.
    progress
        Told of stages and asked for cancellation, or None.

    Raises
    ------
    InputError
        If a layer has no CRS, or there is no line or no polygon of a site.
    CancelledError
        If the caller cancels.

    Examples
    --------
    >>> x = 500_000
    >>> lines = [[(x, 0), (x + 100, 0)], [(x + 50, 0), (x + 50, 60)]]
    >>> frame = gpd.GeoDataFrame(geometry=[shapely.LineString(own) for own in lines], crs=32633)
    >>> found = measure_streets(frame)
    >>> found.figures.intersections, found.figures.dead_ends, found.nodes["kind"].tolist()[0]
    (1, 3, 'dead end')
    """
    told, wish = progress or Silent(), options or StreetOptions()
    told.stage("Reading the streets", 0.0)
    layer = read_measured(streets, street_layer, progress)
    ask(progress, _WORK)
    ground = None
    if site is not None:
        area = read_polygons(site, site_layer, layer.crs, progress)
        layer.problems.extend(area.problems)
        ground = united(area.shapes, progress)
    widths = _widths(streets, layer, wish, street_layer)
    network, levels = _network(layer, ground, widths, wish, told)
    told.stage("Computing figures", 0.85)
    ask(progress, _WORK)
    figures = street_figures(network, progress)
    if ground is not None and not figures.segments:
        text = "none of the streets lies in the site"
        layer.problems.add(site_layer, "", text, "no figures", "warning", ground, layer.crs)
    ask(progress, _WORK)
    columns = feature_columns(layer, network, levels)
    ask(progress, _WORK)
    source, found = layer.streets.source_crs, network.centrality
    return StreetReport(
        streets=_with_columns(streets, columns),
        natural=_natural(network, levels).set_crs(layer.crs).to_crs(source),
        nodes=_nodes(network).set_crs(layer.crs).to_crs(source),
        figures=figures,
        problems=layer.problems.to_frame(source),
        sources=found.sources if found is not None else 0,
        connected=found.connected if found is not None else 0,
    )


def _network(
    layer: MeasuredLayer,
    site: shapely.Geometry | None,
    widths: FloatArray,
    wish: StreetOptions,
    told: Progress,
) -> tuple[Network, IntArray]:
    """Measure what figures and fields are made of; the class of each natural street."""
    graph = layer.streets.graph
    told.stage("Joining natural streets", 0.3)
    lines = np.array(graph.lines, dtype=object)
    label = aside(lambda _: natural_streets(graph, wish.max_turn), lines, told, work=_WORK)
    natural = aside(lambda _: natural_lines(graph, label), lines, told, work=_WORK)
    segments = aside(lambda _: street_segments(graph), lines, told, work=_WORK)
    kinds = junction_kinds(graph)
    ask(told, _WORK)
    ends = graph.nodes[segments.ends.ravel()].reshape(-1, 4)
    network = Network(
        graph=graph,
        segments=segments,
        kinds=kinds,
        natural=natural,
        label=label,
        bearing=bearings(ends[:, :2], ends[:, 2:], layer.crs),
        centrality=None,
        widths=widths,
        site=site,
    )
    if wish.centrality:
        network = replace(network, centrality=_centrality(network, wish, told))
    return network, living_structure(natural.connectivity).levels


def _centrality(network: Network, wish: StreetOptions, told: Progress) -> Centrality:
    """Measure it between junctions and dead ends."""
    nodes, segments = network.segments.nodes, network.segments
    return centrality(
        len(nodes),
        np.searchsorted(nodes, segments.ends),
        segments.length,
        exact=wish.exact,
        sources=wish.sources,
        seed=wish.seed,
        progress=Share(told, 0.4, 0.85),
    )


def _widths(
    frame: gpd.GeoDataFrame, layer: MeasuredLayer, wish: StreetOptions, name: str
) -> FloatArray:
    """Widths of edges, (e,), metres."""
    level = layer.streets.level.astype(np.int64)
    usual = level_widths(level) if wish.width is None else np.full(len(level), wish.width)
    field = wish.width_field
    if field and field not in frame.columns:
        raise InputError(f"has no field '{field}'.", "Choose the field with widths.", layer=name)
    field = field or next((c for c in frame.columns if str(c).lower() == WIDTH_FIELD), "")
    if not field:
        return usual
    given = pd.to_numeric(frame[field], errors="coerce").to_numpy(dtype=float)[layer.feature]
    return np.where(np.isfinite(given) & (given > 0), given, usual)


def _natural(network: Network, levels: IntArray) -> gpd.GeoDataFrame:
    own = network.natural
    columns = {
        "natural_id": own.number + 1,
        "length_m": own.length,
        "segments": own.segments,
        "connectivity": own.connectivity,
        "hierarchy": levels,
    }
    return gpd.GeoDataFrame(columns, geometry=own.lines)


def _nodes(network: Network) -> gpd.GeoDataFrame:
    """Junctions and dead ends; places of rings without a junction are neither."""
    kinds, found = network.kinds, network.centrality
    at = np.flatnonzero(kinds.kind != "")
    local = np.searchsorted(network.segments.nodes, at)
    nothing = np.full(len(at), np.nan)
    columns = {
        "junction_id": np.arange(1, len(at) + 1),
        "degree": kinds.degree[at],
        "kind": kinds.kind[at],
        "deviation_deg": kinds.deviation[at],
        "betweenness": nothing if found is None else found.nodes[local],
        "closeness": nothing if found is None else found.closeness[local],
    }
    return gpd.GeoDataFrame(columns, geometry=shapely.points(network.graph.nodes[at]))


def _with_columns(
    frame: gpd.GeoDataFrame, columns: dict[str, npt.NDArray[Any]]
) -> gpd.GeoDataFrame:
    """Give a layer with the measures as columns."""
    # names in capitals, as files have them, are the same fields
    same = [c for c in frame.columns if str(c).lower() in columns and c != frame.geometry.name]
    made = gpd.GeoDataFrame(frame.drop(columns=same).assign(**columns))
    return made.set_geometry(gpd.GeoSeries(lines_of(made.geometry), made.index, crs=made.crs))
