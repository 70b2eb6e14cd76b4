"""Cheap repair of broken links: short ways are added where they disturb least."""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Callable
from typing import TYPE_CHECKING, Optional

from ..local import close_pairs
from .base import View
from .corridor import corridor
from .links import Link

if TYPE_CHECKING:
    from ..problem import BoolArray
    from ..structure import Structure

#: Price of an edge that breaks a rule, in edges.
BREACH = 30.0
#: Price above which a dead end stays one: no more than a few edges and no breach.
FAR = 12.0


def repair(
    index: Structure, active: BoolArray, check: Optional[Callable[[], None]] = None
) -> BoolArray:
    """Add ways to a design that make its broken links.

    Routes without branches come first, and what branches off them is taken away; then ways
    for links and for the dead ends that they leave, along chosen streets where these lead,
    elsewhere away from streets too close. The result may break rules: it is a design to start
    from, or to hint at.

    Parameters
    ----------
    index
        The problem.
    active
        Shape (e,). A design.
    check
        Called once per link; may raise an error to end the repair.

    Returns
    -------
    BoolArray
        Shape (e,). Another design; the same if no link is broken.
    """
    links = [r for r in index.problem.requirements if isinstance(r, Link)]
    view = View(index.problem, active)
    if not any(link.violations(view) for link in links):
        return active
    mend = _Mend(index, active)
    # those that are not broken may be cut by what is taken away
    for link in sorted(links, key=lambda link: not link.private):
        if check is not None:
            check()
        mend.add(link)
    mend.join_dead_ends()
    return mend.active


class _Mend:
    """A design that is being repaired."""

    def __init__(self, index: Structure, active: BoolArray) -> None:
        self.index = index
        self.active = active.copy()
        self.shut: set[int] = set()
        self.close: dict[int, list[int]] = defaultdict(list)
        if index.problem.too_close > 0:
            for a, b in close_pairs(index.problem.mesh):
                self.close[a].append(b)
                self.close[b].append(a)

    def add(self, link: Link) -> None:
        """Make a link, if it is broken and there is a way."""
        problem = self.index.problem
        view = View(problem, self.active)
        if not link.violations(view):
            if link.private:
                self._shut(link.path(view) or [], link)
            return
        price = self._branches if link.private else self._price
        path = corridor(problem, link).path(self._open, price)
        if path is None:
            return
        if link.private:
            for v in self._shut(path, link):
                self.active[self.index.incident[v]] = False
        for e in path:
            self.active[e] = not problem.existing[e]

    def _shut(self, path: list[int], link: Link) -> set[int]:
        """Close the inner vertices of a route to other streets; return them."""
        inner = {v for e in path for v in self.index.ends[e]} - {link.start, link.end}
        self.shut |= inner
        return inner

    def _open(self, edge: int) -> bool:
        """Tell whether a way may use an edge."""
        if self.shut.intersection(self.index.ends[edge]):
            return False
        return self.index.usable[edge] or bool(self.index.problem.existing[edge])

    def _price(self, edge: int) -> float:
        """Return what an edge of a way costs."""
        if self.active[edge] or self.index.problem.existing[edge]:
            return 0.0
        beside = any(self.active[other] for other in self.close.get(edge, ()))
        return 1.0 + (BREACH if beside else 0.0)

    def _branches(self, edge: int) -> float:
        """Return what an edge of a route costs: the streets that it would cut off."""
        incident = self.index.incident
        met = sum(bool(self.active[e]) for v in self.index.ends[edge] for e in incident[v])
        return 1.0 + met

    def join_dead_ends(self) -> None:
        """Lead dead ends on to the next street."""
        for v in self.index.free:
            mine = [e for e in self.index.incident[v] if self.active[e]]
            if len(mine) == 1 and self.index.two[v]:
                for e in self._way_on(v) or ():
                    self.active[e] = True

    def _way_on(self, start: int) -> Optional[list[int]]:
        """Return the cheapest new way from a vertex to another street."""
        heap: list[tuple[float, int, tuple[int, ...]]] = [(0.0, start, ())]
        seen: set[int] = set()
        while heap:
            paid, v, path = heapq.heappop(heap)
            if v in seen:
                continue
            seen.add(v)
            incident = self.index.incident[v]
            if path and (self.index.street[v] or any(self.active[e] for e in incident)):
                return list(path)
            for e in incident:
                cost = paid + self._price(e)
                if not self.active[e] and self._open(e) and cost <= FAR:
                    heapq.heappush(heap, (cost, self.index.vertex_of(e, v), (*path, e)))
        return None
