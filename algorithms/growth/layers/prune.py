"""Taking away what ends blind."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..types import BoolArray, Growth, IntArray
from .outward import at_nodes, on_outer_edge

if TYPE_CHECKING:
    from ..land.ground import RealGround


def without_dead_ends(growth: Growth, real: RealGround) -> Growth:
    """Take grown streets that end blind away, again and again until none is left.

    Streets that end at the outer edge of the domain stay, since they lead on to what comes
    later; those that end at an obstacle go. Existing streets stay as they are, and so do nodes
    where only two streets are left. The record of the iterations tells of the growth as it was.

    Parameters
    ----------
    growth
        What has grown.
    real
        Where.

    Returns
    -------
    Growth
        What is left of it, numbered anew; nodes of the ground come first, as they did.
    """
    kept = _without_blind(growth, on_outer_edge(growth, real))
    given = len(real.ground.nodes)
    nodes = at_nodes(growth, kept)
    nodes[:given] = True
    number = np.cumsum(nodes) - 1
    bends = _bends(growth, kept, given, real.ground.bends)
    return replace(
        growth,
        xy=growth.xy[nodes],
        road_type=growth.road_type[nodes],
        node_type=growth.node_type[nodes],
        born=growth.born[nodes],
        incoming_road=growth.incoming_road[nodes],
        incoming=growth.incoming[nodes],
        bends=bends[nodes],
        ends=number[growth.ends[kept]].astype(np.int64),
        road=growth.road[kept],
        edge_type=growth.edge_type[kept],
        step=growth.step[kept],
        street=growth.street[kept],
    )


def _without_blind(growth: Growth, open_ends: BoolArray) -> BoolArray:
    """Tell which edges stay, shape (e,).

    Only the blind ends themselves are looked at in each round, so that long ones take no longer
    than as many short ones.
    """
    ends, count = growth.ends, len(growth.xy)
    degree = growth.degrees
    # the edges of a node combined by exclusive or: of one that has one edge, that edge
    edge_of = np.zeros(count, dtype=np.int64)
    for side in (0, 1):
        np.bitwise_xor.at(edge_of, ends[:, side], np.arange(len(ends)))
    kept = np.ones(len(ends), dtype=bool)
    blind = np.flatnonzero((degree == 1) & ~open_ends)
    while len(blind):
        edges = np.unique(edge_of[blind])
        edges = edges[growth.grown[edges]]
        kept[edges] = False
        nodes = ends[edges].ravel()
        np.subtract.at(degree, nodes, 1)
        np.bitwise_xor.at(edge_of, nodes, np.repeat(edges, 2))
        nodes = np.unique(nodes)
        blind = nodes[(degree[nodes] == 1) & ~open_ends[nodes]]
    return kept


def _bends(growth: Growth, kept: BoolArray, given: int, before: BoolArray) -> BoolArray:
    """Tell where existing streets only bend now that fewer others join them, shape (n,).

    Places where a piece was split for a street that has gone are such, too.
    """
    existing = kept & ~growth.grown
    degree = np.bincount(growth.ends[kept].ravel(), minlength=len(growth.xy))
    may = np.ones(len(growth.xy), dtype=bool)
    may[:given] = before
    may &= (degree == 2) & ~at_nodes(growth, kept & growth.grown)
    return np.asarray(may & _one_street(growth, existing))


def _one_street(growth: Growth, edges: BoolArray) -> BoolArray:
    """Tell which nodes meet edges of a single street only, shape (n,)."""
    nodes, street = growth.ends[edges].ravel(), np.repeat(growth.street[edges], 2)
    least = np.full(len(growth.xy), np.iinfo(np.int64).max)
    most: IntArray = np.full(len(growth.xy), -1)
    np.minimum.at(least, nodes, street)
    np.maximum.at(most, nodes, street)
    return np.asarray(least == most)
