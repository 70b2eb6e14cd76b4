"""Measures of the single features of a layer of streets."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree

from .graph import TOLERANCE, FloatArray, IntArray
from .orientation import bearings
from .street_figures import Network
from .street_input import MeasuredLayer

Column = npt.NDArray[Any]


def feature_columns(layer: MeasuredLayer, network: Network, levels: IntArray) -> dict[str, Column]:
    """Measure each feature of a layer; a feature may be several edges of the graph.

    Parameters
    ----------
    layer
        The n features.
    network
        What was found about their graph.
    levels
        Class of each natural street.

    Returns
    -------
    dict
        Columns of shape (n,), NaN or None where a feature was not measured. length_m, of all
        parts; sinuosity, that length / the straight distances of the ends of the parts, sums;
        bearing_deg, the axis of the longest part (see `orientation.bearings`); natural_id,
        natural_m, connectivity and hierarchy of the natural street that the longest part of it
        belongs to; betweenness, the largest of the segments that it is on, and closeness, the
        mean of the ends of these, weighted by length; degree_start and degree_end, how many
        street ends meet at its first and its last point; dead_end, whether one of them is 1.
        Features of the same geometry have the same values.
    """
    count = len(layer.lines)
    columns: dict[str, Column] = {**_shapes(layer), **_ends(layer, network)}
    edge = layer.feature
    length = network.graph.lengths
    main = _main(edge, network.label, length, count)
    known = main >= 0
    for name, values in (
        ("natural_id", network.natural.number + 1),
        ("natural_m", network.natural.length),
        ("connectivity", network.natural.connectivity),
        ("hierarchy", levels),
    ):
        columns[name] = np.full(count, np.nan)
        columns[name][known] = values[main[known]]
    columns["betweenness"] = np.full(count, np.nan)
    columns["closeness"] = np.full(count, np.nan)
    if network.centrality is not None and len(edge):
        own = network.segments.of_edge
        at = np.searchsorted(network.segments.nodes, network.segments.ends)
        near = network.centrality.closeness[at].mean(axis=1)[own]
        most = np.full(count, -1.0)
        np.maximum.at(most, edge, network.centrality.edges[own])
        columns["betweenness"] = np.where(most >= 0, most, np.nan)
        whole = np.bincount(edge, length, minlength=count)
        weighted = np.bincount(edge, length * near, minlength=count)
        columns["closeness"] = np.where(whole > 0, weighted / np.maximum(whole, 1e-9), np.nan)
    return {name: values[layer.same_as] for name, values in columns.items()}


def _shapes(layer: MeasuredLayer) -> dict[str, Column]:
    """Length, sinuosity and bearing."""
    count = len(layer.lines)
    usable = ~shapely.is_missing(layer.lines)
    length = np.where(usable, shapely.length(layer.lines), np.nan)
    parts, owner = shapely.get_parts(layer.lines, return_index=True)
    first, last = (shapely.get_coordinates(shapely.get_point(parts, k)) for k in (0, -1))
    gap = np.hypot(*(last - first).T)
    straight = np.bincount(owner, gap, minlength=count)
    open_ended = usable & (straight > TOLERANCE)
    sinuosity = np.full(count, np.nan)
    sinuosity[open_ended] = np.maximum(length[open_ended] / straight[open_ended], 1.0)
    bearing = np.full(count, np.nan)
    # what comes later, and is longer, stays
    order = np.argsort(shapely.length(parts), kind="stable")
    bearing[owner[order]] = bearings(first, last, layer.crs)[order]
    return {"length_m": length, "sinuosity": sinuosity, "bearing_deg": bearing}


def _ends(layer: MeasuredLayer, network: Network) -> dict[str, Column]:
    """Count streets at the first point of the first part and at the last of the last one."""
    count = len(layer.lines)
    parts, owner = shapely.get_parts(layer.lines, return_index=True)
    first = np.append(True, np.diff(owner) > 0)[: len(owner)]
    last = np.append(np.diff(owner) > 0, True)[: len(owner)]
    degrees = []
    for chosen, at in ((first, 0), (last, -1)):
        xy = shapely.get_coordinates(shapely.get_point(parts[chosen], at))
        found = np.full(count, np.nan)
        found[owner[chosen]] = _degrees(network, xy)
        degrees.append(found)
    blind = np.full(count, None, dtype=object)
    known = np.isfinite(degrees[0]) & np.isfinite(degrees[1])
    blind[known] = ((degrees[0] == 1) | (degrees[1] == 1))[known]
    return {"degree_start": degrees[0], "degree_end": degrees[1], "dead_end": blind}


def _degrees(network: Network, xy: FloatArray) -> FloatArray:
    """Degree of the nodes at points, (k,); NaN where there is none."""
    if not len(network.graph.nodes):
        return np.full(len(xy), np.nan)
    gap, node = cKDTree(network.graph.nodes).query(xy)
    return np.where(gap <= 2 * TOLERANCE, network.graph.degrees[node], np.nan)


def _main(edge: IntArray, label: IntArray, length: FloatArray, count: int) -> IntArray:
    """Natural street with most of the length of each feature, (count,); -1 without edges."""
    found = np.full(count, -1, dtype=np.int64)
    if not len(edge):
        return found
    pairs, of = np.unique(np.column_stack([edge, label]), axis=0, return_inverse=True)
    share = np.bincount(of.ravel(), length)
    order = np.lexsort((-pairs[:, 1], share))
    found[pairs[order, 0]] = pairs[order, 1]
    return found
