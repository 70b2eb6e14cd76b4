"""Roads: grown streets of one road number, merged in their order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from ..grammar import ROAD_TYPES
from ..types import FloatArray, Growth, IntArray
from .chains import chains
from .outward import Shapes


@dataclass(frozen=True, eq=False)
class Roads:
    """Roads, r of them, by their numbers.

    Attributes
    ----------
    number
        Shape (r,). Road numbers.
    lines
        Shape (r,). MultiLineStrings; a part ends where the road forks or ends.
    kind
        Shape (r,). The road type of most of its length, a key of `ROAD_TYPES`.
    segments
        Shape (r,). Number of grown streets.
    length
        Shape (r,). Metres.
    first, last
        Shape (r,). Iterations in which its first and its last street appeared.
    junctions
        Shape (r,). Nodes along it at which three or more streets meet, of whatever roads.
    """

    number: IntArray
    lines: Shapes
    kind: tuple[str, ...]
    segments: IntArray
    length: FloatArray
    first: IntArray
    last: IntArray
    junctions: IntArray


def grown_roads(growth: Growth) -> Roads:
    """Merge grown streets by their road numbers.

    Parameters
    ----------
    growth
        What has grown.
    """
    edges = np.flatnonzero(growth.grown)
    number, road = np.unique(growth.road[edges], return_inverse=True)
    count = len(number)
    length = growth.lengths[edges]
    step = growth.step[edges]
    first = np.full(count, np.iinfo(np.int64).max)
    last = np.zeros(count, dtype=np.int64)
    np.minimum.at(first, road, step)
    np.maximum.at(last, road, step)
    nodes = np.unique(np.column_stack([np.repeat(road, 2), growth.ends[edges].ravel()]), axis=0)
    busy = growth.degrees[nodes[:, 1]] >= 3
    kinds = list(ROAD_TYPES)
    shares = np.zeros((count, len(kinds)))
    own = np.array([kinds.index(kind) for kind in growth.edge_type[edges].tolist()], dtype=int)
    np.add.at(shares, (road, own), length)
    return Roads(
        number,
        _lines(growth, edges, road, count),
        tuple(kinds[k] for k in shares.argmax(axis=1).tolist()),
        np.bincount(road, minlength=count).astype(np.int64),
        np.bincount(road, weights=length, minlength=count).astype(float),
        first,
        last,
        np.bincount(nodes[busy, 0], minlength=count).astype(np.int64),
    )


def _lines(growth: Growth, edges: IntArray, road: IntArray, count: int) -> Shapes:
    """Draw the roads, shape (count,)."""
    if not count:
        return np.zeros(0, dtype=object)
    # a node stands for itself on each road anew, so that roads do not mix where they meet
    pairs = np.column_stack([np.repeat(road, 2), growth.ends[edges].ravel()])
    nodes, ends = np.unique(pairs, axis=0, return_inverse=True)
    ends = ends.reshape(-1, 2)
    runs = chains(ends, np.ones(len(nodes), dtype=bool))
    owner = road[runs.first]
    order = np.argsort(owner, kind="stable")
    lines = runs.lines(growth.xy[nodes[:, 1]])[order]
    return np.asarray(shapely.multilinestrings(lines, indices=owner[order]), dtype=object)
