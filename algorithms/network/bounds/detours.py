"""What a vertex loses that cannot go to its sink the shortest way."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Optional

from ..mip.model import NetworkModel
from ..structure import Structure

#: Lengths that differ by less than this part of the longest edge count as equal.
EQUAL = 1e-7


def detours(index: Structure) -> tuple[dict[int, list[int]], dict[int, float]]:
    """Return the edges on shortest ways of each vertex and the least possible detour.

    Parameters
    ----------
    index
        The problem.

    Returns
    -------
    dict
        For each free vertex that is no sink: usable edges that begin a shortest way.
    dict
        For the same vertices: by how much the distance of the vertex exceeds `reach` at
        least if each of those edges either is not chosen or leads to a free vertex that has a
        detour itself; infinite if the vertex can then reach no sink.
    """
    problem = index.problem
    same = EQUAL * float(problem.length.max(initial=1.0))
    mine = [v for v in index.free if not problem.sinks[v] and math.isfinite(index.reach[v])]
    onward: dict[int, list[int]] = {}
    least: dict[int, float] = {}
    for v in sorted(mine, key=lambda u: index.reach[u]):
        best = math.inf
        onward[v] = []
        for e in index.incident[v]:
            w = index.vertex_of(e, v)
            more = float(problem.length[e]) + index.reach[w] - index.reach[v]
            if more > same:
                best = min(best, more)
                continue
            onward[v].append(e)
            # a nearer vertex has been seen already, unless its way is certain
            best = min(best, least.get(w, math.inf))
        least[v] = best
    return onward, least


def add_detours(model: NetworkModel, check: Optional[Callable[[], None]] = None) -> None:
    """Charge each active vertex its least distance, and the least detour if it needs one.

    With p_v <= y_v saying that the distance of v is the least possible:
    ``p_v <= sum of s`` over the edges that begin a shortest way, ``s <= x_e`` and, where the
    edge leads to a free vertex w, ``s <= p_w``. The cost is ``reach y + detour (y - p)``.

    Parameters
    ----------
    model
        A relaxation without a flow.
    check
        Called often; may raise an error to end the work.
    """
    index, linear = model.index, model.linear
    price = index.problem.weight_distance
    onward, least = detours(index)
    straight: dict[int, Any] = {}
    for v, edges in onward.items():
        if check is not None:
            check()
        y = model.vertex[v]
        linear.add_cost(y, price * index.reach[v])
        detour = least[v]
        if not math.isfinite(detour):
            # whatever is chosen: if it is connected at all, it goes the shortest way
            straight[v] = y
            continue
        p = straight[v] = linear.real(1.0)
        linear.row([(p, 1.0), (y, -1.0)], high=0.0)
        # a cost of y - p, with all costs at least 0
        late = linear.real(1.0, price * detour)
        linear.row([(late, 1.0), (y, -1.0), (p, 1.0)], low=0.0)
        support: list[tuple[Any, float]] = [(p, -1.0)]
        for e in edges:
            x, after = model.edge[e], straight.get(index.vertex_of(e, v))
            if after is None:
                support.append((x, 1.0))
                continue
            way = linear.real(1.0)
            linear.row([(way, 1.0), (x, -1.0)], high=0.0)
            linear.row([(way, 1.0), (after, -1.0)], high=0.0)
            support.append((way, 1.0))
        linear.row(support, low=0.0)
