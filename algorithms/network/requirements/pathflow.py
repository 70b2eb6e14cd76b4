"""The arcs over which the path of a link can run, for the models."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Optional

from ..cp.model import FINEST, whole_scale
from .corridor import Corridor, Step, distances

#: Edge and the vertex that it leads to.
Arc = tuple[int, int]


@dataclass(eq=False)
class Arcs:
    """Arcs from `start` to `end` and what each takes of the budget.

    Attributes
    ----------
    start, end
        Vertices; no arc enters `start` or leaves `end`.
    budget
        By how much a path may be longer than the shortest, half of the slack included.
    slack
        What makes up for rounding.
    arcs
        All arcs, in the order of edges.
    excess
        For each arc, by how much it makes the way longer than the shortest way from where it
        begins: its length plus the way left after it less the way left before it.
    by_edge
        Arcs of each edge.
    out, into
        Arcs that leave and enter each vertex.
    """

    start: int
    end: int
    budget: float
    slack: float
    arcs: list[Arc] = field(default_factory=list)
    excess: dict[Arc, float] = field(default_factory=dict)
    by_edge: dict[int, list[Arc]] = field(default_factory=lambda: defaultdict(list))
    out: dict[int, list[Arc]] = field(default_factory=lambda: defaultdict(list))
    into: dict[int, list[Arc]] = field(default_factory=lambda: defaultdict(list))

    @property
    def vertices(self) -> list[int]:
        """All vertices, ascending."""
        return sorted({*self.out, *self.into})


def arcs_of(way: Corridor, able: Callable[[int], bool]) -> Optional[Arcs]:
    """Return the arcs on paths that are short enough over able edges; None without a path.

    The lengths of the arcs of a path add up to the shortest length plus the excesses, so that
    excesses say the same as lengths in smaller numbers.

    Parameters
    ----------
    way
        The corridor in the whole problem.
    able
        Tells whether an edge may be a street.
    """
    steps: dict[int, list[Step]] = {}
    for v, around in way.steps.items():
        mine = [step for step in around if able(step[0])]
        if mine:
            steps[v] = mine
    there = distances(steps, way.start, way.limit)
    left = distances(steps, way.end, way.limit)
    if way.end not in there:
        return None
    shortest = left[way.start]
    found = Arcs(way.start, way.end, way.limit - way.slack / 2 - shortest, way.slack)
    for u in sorted(steps):
        if u == way.end or u not in there:
            continue
        for e, v, length in steps[u]:
            if v == way.start or v not in left or there[u] + length + left[v] > way.limit:
                continue
            arc = (e, v)
            found.arcs.append(arc)
            found.excess[arc] = max(0.0, round(length + left[v] - left[u], 9))
            found.by_edge[e].append(arc)
            found.out[u].append(arc)
            found.into[v].append(arc)
    return found


def whole_excess(arcs: Arcs) -> tuple[dict[Arc, int], int]:
    """Return the excesses and the budget as whole numbers that mean the same.

    Rounding moves the length of a path by less than a quarter of the slack.
    """
    scale = float(whole_scale(arcs.excess.values()))
    if scale >= FINEST:
        scale = max(scale, math.ceil(4 * len(arcs.vertices) / arcs.slack))
    budget = math.floor(arcs.budget * scale)
    return {arc: round(arcs.excess[arc] * scale) for arc in arcs.arcs}, budget
