"""A bound of routes: what runs through a block costs at least the shortest way through it."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable
from typing import Optional

import numpy as np

from ...network.mip.sparse import LpResult, LpSolver, SparseModel
from ...network.requirements.budget import LeastLength
from ...network.structure import Structure
from ..program.index import RoomIndex

#: Edges at each vertex of a block: the vertex at the other end, the cost, and the edge.
_Ways = dict[int, list[tuple[int, float, int]]]


def passing_bound(
    index: Structure,
    rooms: RoomIndex,
    stop: Callable[[], bool],
    check: Optional[Callable[[], None]] = None,
) -> float:
    """Return the least cost of blocks that tile a level, each with the least way through it.

    No edge of a route lies on borders of blocks (CND-x eq. 20), so that each edge lies inside one
    block. Where ends are forbidden, what runs in a block joins two places on its rim or closes a
    ring; the linear program over all tilings then bounds the cost of every route.

    Parameters
    ----------
    index, rooms
        The problem, of kind "level".
    stop
        Asked about 20 times a second; true ends the run without a bound.
    check
        Called often; may raise an error to end the work.

    Returns
    -------
    float
        In units of the objective; -inf where there is none.
    """
    problem = rooms.problem
    linear = SparseModel(check)
    ends = may_end(index)
    variables = []
    for r in range(len(problem.placements.faces)):
        if check is not None:
            check()
        cost = least_way(index, rooms, r, ends)
        possible = math.isfinite(cost)
        variables.append(linear.real(1.0 if possible else 0.0, cost if possible else 0.0))
    for f in np.flatnonzero(problem.floor).tolist():
        linear.row([(variables[r], 1.0) for r in rooms.by_face[f]], low=1.0, high=1.0)
    linear.finish()
    result: LpResult = LpSolver(linear).solve(stop)
    return index.fixed + result.bound


def least_length_cost(index: Structure) -> float:
    """Return the least cost of edges that are as long as a hard `LeastLength` asks; 0 without.

    The edges that cost least for their length are taken first, the last of them in part.
    """
    best = 0.0
    for limit in index.problem.requirements:
        if not isinstance(limit, LeastLength) or not limit.hard:
            continue
        able = [(index.cost[e], int(limit.steps[e])) for e in index.edges if limit.steps[e]]
        left, cost = float(limit.wanted), 0.0
        for own, length in sorted(able, key=lambda pair: pair[0] / pair[1]):
            part = min(1.0, max(0.0, left) / length)
            cost, left = cost + part * own, left - part * length
        best = max(best, cost)
    return index.fixed + best


def may_end(index: Structure) -> list[bool]:
    """Tell for each vertex whether a route may end there, as far as the rules say."""
    problem = index.problem
    forbidden = {
        (frozenset(pattern.on), frozenset(pattern.off))
        for pattern in problem.patterns
        if math.isinf(pattern.weight) and len(pattern.on) == 1
    }
    able = []
    for v, fan in enumerate(problem.mesh.vertex_edges):
        own = frozenset(e for e in fan.tolist() if problem.candidate[e])
        never = bool(own) and all((frozenset((e,)), own - {e}) in forbidden for e in own)
        able.append(not index.two[v] and not never)
    return able


def least_way(index: Structure, rooms: RoomIndex, room: int, ends: list[bool]) -> float:
    """Return the least cost of the route inside a block; infinite where none can run.

    Parameters
    ----------
    index, rooms
        The problem.
    room
        The placement.
    ends
        Shape (n,). Vertices where a route may end.
    """
    placements = rooms.problem.placements
    inner = [e for e in placements.inner[room] if index.usable[e]]
    if not inner:
        return math.inf
    if any(ends[v] for e in inner for v in index.ends[e]):
        return min(index.cost[e] for e in inner)
    ways: _Ways = {}
    for e in inner:
        u, v = index.ends[e]
        ways.setdefault(u, []).append((v, index.cost[e], e))
        ways.setdefault(v, []).append((u, index.cost[e], e))
    rim = {v for e in placements.rim[room] for v in index.ends[e]}
    best = math.inf
    for start in sorted(rim.intersection(ways)):
        best = min(best, _shortest(ways, start, rim - {start}, best))
    if len(inner) >= len(ways):
        # a ring; the least one through each edge is that edge and the least way around it
        for e in inner:
            u, v = index.ends[e]
            best = min(best, index.cost[e] + _shortest(ways, u, (v,), best, without=e))
    return best


def _shortest(
    ways: _Ways, start: int, goals: Iterable[int], limit: float, without: int = -1
) -> float:
    """Return the cost of the shortest way to any goal, infinite where it is not below a limit."""
    wanted = frozenset(goals)
    heap, done = [(0.0, start)], set()
    while heap:
        cost, v = heapq.heappop(heap)
        if cost >= limit:
            break
        if v in wanted:
            return cost
        if v in done:
            continue
        done.add(v)
        for w, more, e in ways[v]:
            if e != without and w not in done:
                heapq.heappush(heap, (cost + more, w))
    return math.inf
