"""A first design at once: straight mesh lines from sink to sink that cover everything."""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Optional

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_matrix

from ..problem import BoolArray
from ..structure import Structure

#: Nodes after which the program over lines is good enough: the same every time, unlike seconds.
NODES = 500
#: Seconds that it may take at most; on meshes of 10,000 edges it takes a fifth of one.
LONGEST = 5.0


def chords(index: Structure) -> list[list[int]]:
    """List the straight mesh lines with both ends at sinks or streets connected to sinks.

    Parameters
    ----------
    index
        The problem.

    Returns
    -------
    list of list of int
        Usable edges of each line, in order; no edge is in two lines.
    """
    seen: set[int] = set()
    found: list[list[int]] = []
    for edge in index.edges:
        if edge in seen:
            continue
        u, v = index.ends[edge]
        ahead, end_ahead = follow(index, edge, v)
        if ahead and ahead[-1] == edge:  # a closed line without any end
            seen.update(ahead)
            continue
        back, end_back = follow(index, edge, u)
        line = [*reversed(back), edge, *ahead]
        seen.update(line)
        if index.root[end_ahead] and index.root[end_back]:
            found.append(line)
    return found


def follow(
    index: Structure, edge: int, vertex: int, *, through: bool = False
) -> tuple[list[int], int]:
    """Follow a straight line from an edge on until it ends or closes.

    Parameters
    ----------
    index
        The problem.
    edge
        Where to begin.
    vertex
        End of the edge beyond which to go on.
    through
        Whether to go on through sinks and existing streets.

    Returns
    -------
    list of int
        The usable edges beyond `vertex`; the last is `edge` if the line is closed.
    int
        Where the line ends.
    """
    line: list[int] = []
    first = edge
    while through or not (index.root[vertex] or index.street[vertex]):
        following = index.problem.mesh.continuation(vertex, edge)
        if following < 0 or not index.usable[following]:
            break
        line.append(following)
        if following == first:
            break
        edge, vertex = following, index.vertex_of(following, vertex)
    return line, vertex


def chord_start(index: Structure, time_limit: float = LONGEST) -> Optional[BoolArray]:
    """Choose straight lines that cover everything at least cost.

    A small program over lines instead of edges: coverage (CND eq. 6), required edges, no two
    lines with close pairs where these are forbidden, no line with another forbidden pattern.
    It sees neither soft rules between lines nor distances by several lines, so that its
    result is a start, not an optimum.

    Parameters
    ----------
    index
        The problem.
    time_limit
        Seconds; a run that it ends may give another start the next time.

    Returns
    -------
    BoolArray or None
        Shape (e,), or None where no such design exists or was found. It may still break a
        hard rule across lines: evaluate it.
    """
    lines = chords(index)
    if not lines:
        return None
    of_edge = {e: i for i, line in enumerate(lines) for e in line}
    rows: list[tuple[list[int], float]] = []
    at_vertex: dict[int, set[int]] = defaultdict(set)
    for e, i in of_edge.items():
        for v in index.ends[e]:
            at_vertex[v].add(i)
    for _, ball in index.cover:
        rows.append((sorted({i for u in ball for i in at_vertex[u]}), 1.0))
    for e in np.flatnonzero(index.problem.required).tolist():
        rows.append(([of_edge[e]] if e in of_edge else [], 1.0))
    for term in index.terms:
        if term.hard:
            for on, off in term.alternatives:
                if not on:
                    rows.append((sorted({of_edge[e] for e in off if e in of_edge}), 1.0))
    if any(not columns for columns, _ in rows):
        return None
    exclusions, prices = _exclusions(index, of_edge), _prices(index, lines)
    chosen = _choose(len(lines), rows, exclusions, prices, time_limit)
    if chosen is None:
        return None
    active = np.zeros(len(index.ends), dtype=bool)
    for i in chosen:
        active[lines[i]] = True
    return active


def _exclusions(index: Structure, of_edge: dict[int, int]) -> list[tuple[int, ...]]:
    """Return sets of lines that cannot be chosen together, since a hard rule forbids it."""
    found: set[tuple[int, ...]] = set()
    for term in index.terms:
        if not term.hard:
            continue
        for on, off in term.alternatives:
            if on and not off and all(e in of_edge for e in on):
                found.add(tuple(sorted({of_edge[e] for e in on})))
    return sorted(found)


def _prices(index: Structure, lines: list[list[int]]) -> list[float]:
    """Return the cost of each line: its length and the least distances of its vertices."""
    weight = index.problem.weight_distance
    prices = []
    for line in lines:
        vertices = {v for e in line for v in index.ends[e] if not index.root[v]}
        price = sum(index.cost[e] for e in line)
        if weight > 0:
            price += weight * sum(index.reach[v] for v in vertices)
        prices.append(price + 1e-3 * len(line))
    return prices


def _choose(
    count: int,
    rows: list[tuple[list[int], float]],
    exclusions: list[tuple[int, ...]],
    prices: list[float],
    time_limit: float,
) -> Optional[list[int]]:
    """Solve the program; return the lines chosen or None."""
    if any(not math.isfinite(p) for p in prices):
        return None
    constraints = []
    if rows:
        at_least = _matrix([columns for columns, _ in rows], count)
        constraints.append(LinearConstraint(at_least, lb=np.array([low for _, low in rows])))
    if exclusions:
        at_most = _matrix([list(group) for group in exclusions], count)
        upper = np.array([len(group) - 1 for group in exclusions], dtype=float)
        constraints.append(LinearConstraint(at_most, ub=upper))
    result = milp(
        np.array(prices),
        integrality=np.ones(count),
        bounds=Bounds(0, 1),
        constraints=constraints,
        options={"time_limit": time_limit, "mip_rel_gap": 0.01, "node_limit": NODES},
    )
    if result.x is None:
        return None
    return np.flatnonzero(result.x > 0.5).tolist()  # type: ignore[no-any-return]


def _matrix(groups: list[list[int]], count: int) -> csr_matrix:
    """Return the 0-1 matrix with a row per group."""
    rows = [r for r, group in enumerate(groups) for _ in group]
    columns = [c for group in groups for c in group]
    return csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(groups), count))
