"""Layers of streets as networks for traffic."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..measure.layers import EXISTING
from ..measure.oneway import one_way_faults
from ..measure.street_input import MeasuredLayer, read_measured
from ..progress import Progress
from ..site.repair import Problems
from .speeds import StreetRules, capacities_of, lanes_of, levels_of, speeds_of, unusable
from .types import BoolArray, IntArray, TrafficNetwork


def read_network(
    frame: gpd.GeoDataFrame,
    layer: str = "Streets",
    rules: StreetRules | None = None,
    progress: Progress | None = None,
) -> tuple[TrafficNetwork, Problems]:
    """Read a layer of streets as a network for traffic.

    Used where they are there: the fields `level` (1 to 4), else OpenStreetMap's `highway`;
    `status` (existing and given streets were there before the design); `speed_kmh`, else
    `maxspeed`; `oneway` (true, yes or 1; -1 against the line), also of existing streets; `lanes`,
    which counts both directions; `capacity` (vehicles per hour of a direction).

    Parameters
    ----------
    frame
        Lines in any CRS; the index holds the feature ids. Not changed.
    layer
        Name of the layer, for messages.
    rules
        What counts where no field says; None for the defaults.
    progress
        Asked for cancellation, or None.

    Returns
    -------
    TrafficNetwork, Problems
        The network, and what was left out or is doubtful: parts without connection, ways that
        one-way streets bar, values that are no speed.

    Raises
    ------
    InputError
        If the layer has no CRS, coordinates that do not fit it, or no line at all; if a rule is
        not positive.
    CancelledError
        If the caller cancels.

    Examples
    --------
    >>> import geopandas as gpd
    >>> from shapely.geometry import LineString
    >>> long, short = [(500000, 0), (500100, 0)], [(500050, 0), (500050, 60)]
    >>> lines = [LineString(long), LineString(short)]
    >>> network, problems = read_network(gpd.GeoDataFrame(geometry=lines, crs=32633))
    >>> network.length.tolist(), len(problems)
    ([50.0, 50.0, 60.0], 0)
    """
    rules = rules or StreetRules()
    rules.check()
    # To the measures, which judge designs, existing streets are two-way; traffic obeys the signs.
    read = read_measured(frame.drop(columns="status", errors="ignore"), layer, progress)
    graph, problems = read.streets.graph, read.problems
    level = levels_of(frame)
    one_way = np.zeros(len(frame), dtype=bool)
    one_way[read.feature[read.streets.direction != 0]] = True
    lanes = lanes_of(frame, level, one_way, rules)
    for k, text in unusable(frame):
        what = "taken as of a street of its level"
        problems.add(layer, frame.index[k], text, what, "warning", read.lines[k], read.crs)
    network = TrafficNetwork(
        nodes=graph.nodes,
        ends=graph.ends,
        lines=np.array(graph.lines, dtype=object),
        feature=read.feature,
        direction=read.streets.direction,
        speed=speeds_of(frame, level, rules)[read.feature],
        capacity=capacities_of(frame, level, lanes, rules)[read.feature],
        lanes=lanes[read.feature],
        level=level[read.feature],
        existing=_existing(frame)[read.feature],
        crs=read.crs,
    )
    _note_islands(network, frame, layer, problems)
    _note_one_way(read, frame, layer, problems)
    return network, problems


def pieces_layer(network: TrafficNetwork, frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Give the pieces of a network as a layer with all fields of their features.

    Parameters
    ----------
    network
        From `read_network`.
    frame
        The layer that it was read from.

    Returns
    -------
    geopandas.GeoDataFrame
        One row per piece, in the CRS of the layer and the order of the network; the index holds
        the ids of the features.
    """
    table = frame.drop(columns=frame.geometry.name).iloc[network.feature]
    lines = gpd.GeoSeries(network.lines, crs=network.crs).to_crs(frame.crs)
    return gpd.GeoDataFrame(table, geometry=lines.to_numpy(), crs=frame.crs)


def components(network: TrafficNetwork) -> IntArray:
    """Label the connected part that each node belongs to, whatever the direction, shape (n,).

    Parameters
    ----------
    network
        Any network.
    """
    count = len(network.nodes)
    links = coo_array((np.ones(len(network.ends)), network.ends.T), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _existing(frame: gpd.GeoDataFrame) -> BoolArray:
    if "status" not in frame.columns:
        return np.zeros(len(frame), dtype=bool)
    return np.isin([str(value).lower() for value in frame["status"]], EXISTING)


def _note_islands(
    network: TrafficNetwork, frame: gpd.GeoDataFrame, layer: str, problems: Problems
) -> None:
    """Tell of every part that does not hang together with the longest one."""
    part = components(network)[network.ends[:, 0]]
    total = np.bincount(part, network.length)
    for k in np.flatnonzero(total > 0).tolist():
        if k == int(total.argmax()):
            continue
        pieces = np.flatnonzero(part == k)
        names = dict.fromkeys(str(frame.index[f]) for f in network.feature[pieces].tolist())
        text = f"{total[k]:.0f} m of streets are not connected with the others"
        what = "trips between the parts find no way: join the streets at their ends"
        shape = shapely.multilinestrings(list(network.lines[pieces]))
        problems.add(layer, ", ".join(names), text, what, "warning", shape, network.crs)


def _note_one_way(
    read: MeasuredLayer, frame: gpd.GeoDataFrame, layer: str, problems: Problems
) -> None:
    nowhere = np.zeros(len(read.streets.graph.nodes), dtype=bool)
    for fault in one_way_faults(read.streets, nowhere):
        # To the graph a feature is called by its position.
        names = ", ".join(str(frame.index[int(name)]) for name in fault.features)
        what = "some trips may find no way: turn a street round, or open it both ways"
        problems.add(layer, names, fault.text, what, "warning", fault.geometry, read.crs)
