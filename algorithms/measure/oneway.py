"""Whether one-way streets lead everywhere: from every place a way out, to every place a way in."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from .distances import directed_pairs
from .graph import BoolArray, IntArray
from .layers import StreetLayer
from .problems import Problem


def one_way_faults(streets: StreetLayer, sinks: BoolArray) -> list[Problem]:
    """List junctions from which no way out, or to which no way in, follows the directions.

    All sinks are one place, since the roads outside join them. Where there is none, the largest
    part of which every place leads to every other one takes their stead. Parts without any
    connection are islands, which are listed elsewhere.

    Parameters
    ----------
    streets
        The streets. Those that were there already count as two-way.
    sinks
        Shape (n,). Where traffic leaves and comes in.

    Returns
    -------
    list of Problem
        One per connected group of such junctions, of kind "one-way".
    """
    graph, count = streets.graph, len(streets.graph.nodes)
    if not streets.direction.any():
        return []
    pairs, _ = directed_pairs(graph, streets.direction)
    hub = _hub(pairs, sinks, count)
    ties = np.column_stack([hub, np.full(len(hub), count)])
    pairs = np.concatenate([pairs, ties, ties[:, ::-1]])
    touched = np.zeros(count, dtype=bool)
    touched[graph.ends[streets.designed].ravel()] = True
    touched &= _reached(np.concatenate([pairs, pairs[:, ::-1]]), count)
    found = []
    for able, text in (
        (_reached(pairs[:, ::-1], count), "From {} no way leads out along the one-way streets."),
        (_reached(pairs, count), "To {} no way leads in along the one-way streets."),
    ):
        lost = touched & ~able
        inner = lost[graph.ends].all(axis=1)
        group = _parts(graph.ends[inner], count)
        for k in np.unique(group[lost]).tolist():
            nodes = lost & (group == k)
            edges = np.flatnonzero(nodes[graph.ends].any(axis=1) & streets.designed).tolist()
            many = int(nodes.sum())
            what = "one junction" if many == 1 else f"{many} junctions"
            at = shapely.MultiPoint(graph.nodes[nodes])
            names = streets.names_of(edges)
            found.append(Problem("one-way", text.format(what), at, names))
    return found


def _hub(pairs: IntArray, sinks: BoolArray, count: int) -> IntArray:
    """Nodes that stand for the roads outside."""
    if sinks.any():
        return np.flatnonzero(sinks)
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count)).tocsr()
    label = connected_components(links, directed=True, connection="strong")[1]
    return np.flatnonzero(label == np.bincount(label).argmax())


def _reached(pairs: IntArray, count: int) -> BoolArray:
    """Tell which nodes can be reached from the outside, node number `count`."""
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(count + 1, count + 1)).tocsr()
    found = np.zeros(count + 1, dtype=bool)
    found[breadth_first_order(links, count, return_predecessors=False)] = True
    return found[:count]


def _parts(pairs: IntArray, count: int) -> IntArray:
    """Label connected nodes, shape (n,)."""
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count)).tocsr()
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)
