"""Two ways: no street whose closure cuts a part off, so that streets can be made one-way.

CND (section 7) leaves one-way streets open: its networks are connected to the sinks, not
strongly connected. By Robbins' theorem directions exist for which every vertex reaches a sink
and is reached from one exactly where no chosen edge is a bridge of the merged graph; see
`network/oneway/bridges.py`, and `network/oneway/orientation.py` for the directions.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ..oneway.bridges import design_bridges, merged_nodes
from .base import Requirement, View
from .twowayscp import add_two_ways

if TYPE_CHECKING:
    from ..cp.model import CpNetwork
    from ..mip.model import NetworkModel
    from ..problem import NetworkProblem


@dataclass(frozen=True)
class TwoWays(Requirement):
    """No chosen edge is a bridge: whichever street is closed, all others keep a way to a sink.

    It forbids cul-de-sacs and rings on stems. Existing streets are two-way and never counted,
    but a chosen edge that alone connects an existing street with the sinks is.

    Attributes
    ----------
    penalty
        Cost of each chosen edge that is a bridge of the merged graph; infinite forbids.
    """

    penalty: float = math.inf
    kind: str = field(default="two ways", init=False)

    def violations(self, view: View) -> int:
        """Return the number of bridges among the chosen edges."""
        return int(design_bridges(view.problem, view.active).sum())

    def add_to_cp(self, network: CpNetwork) -> None:
        """Give every edge a direction and every active node a way out and a way in.

        Edges that remain two-way are the bridges. Both ways follow ranks, as connection does
        (`cp.connect.add_ranks`); see `twowayscp`.
        """
        add_two_ways(network, self.penalty)

    def add_to_mip(self, model: NetworkModel) -> None:
        """Send a unit from every active node to a sink and one back, along directed edges."""
        _MipWays(model, self.penalty).add()


class _MipWays:
    """Directed edges and two flows of a whole problem, in a mixed-integer program."""

    def __init__(self, model: NetworkModel, penalty: float) -> None:
        self.model, self.penalty = model, penalty
        problem: NetworkProblem = model.index.problem
        self.node = merged_nodes(problem).tolist()
        self.demand = self._demand()

    def _demand(self) -> dict[int, Any]:
        """Return for each node a variable that is 1 where it has streets."""
        model, index = self.model, self.model.index
        found: dict[int, Any] = {}
        for e in index.edges:
            if len({self.node[v] for v in index.ends[e]}) == 1:
                continue
            for v in index.ends[e]:
                c = self.node[v]
                if not c:
                    continue
                if c not in found:
                    found[c] = model.linear.real(1.0) if index.street[v] else model.vertex[v]
                model.linear.row([(found[c], 1.0), (model.edge[e], -1.0)], low=0.0)
        return found

    def add(self) -> None:
        """Write it all, or only what is implied where bounds are all that is wanted."""
        if math.isinf(self.penalty):
            self._add_implied()
        if self.model.exact:
            self._add_flows()

    def _add_implied(self) -> None:
        """Add what every design without bridges satisfies, good for the relaxation.

        A set of vertices without a sink that has a street, because coverage demands one there
        or a vertex is active, has two ways out: a single one would be a bridge.
        """
        model, index = self.model, self.model.index
        at: dict[int, list[tuple[Any, float]]] = defaultdict(list)
        for e in index.edges:
            a, b = (self.node[v] for v in index.ends[e])
            if a != b:
                at[a].append((model.edge[e], 1.0))
                at[b].append((model.edge[e], 1.0))
        for c, y in self.demand.items():
            model.linear.row([*at[c], (y, -2.0)], low=0.0)
        for v, cover in index.cover:
            ball = set(cover)
            if any(index.problem.sinks[u] or index.street[u] for u in ball):
                continue
            exits = {e for u in ball for e in index.incident[u] if not set(index.ends[e]) <= ball}
            row = [(model.edge[e], 1.0) for e in sorted(exits)]
            if v in model.slack:
                row.append((model.slack[v], 2.0))
            model.linear.row(row, low=2.0)

    def _add_flows(self) -> None:
        """Direct every edge; send a unit out of every active node, and one into it."""
        model, linear = self.model, self.model.linear
        most = float(len(self.demand))
        balance: list[dict[int, list[tuple[Any, float]]]] = [defaultdict(list), defaultdict(list)]
        for e in model.index.edges:
            a, b = (self.node[v] for v in model.index.ends[e])
            if a == b:
                continue
            x = model.edge[e]
            arcs = [linear.binary(), linear.binary()]
            row = [(arcs[0], 1.0), (arcs[1], 1.0), (x, -1.0)]
            if not math.isinf(self.penalty):
                row.append((linear.real(1.0, self.penalty), -1.0))
            linear.row(row, high=0.0)
            for arc, p, q in ((arcs[0], a, b), (arcs[1], b, a)):
                linear.row([(arc, 1.0), (x, -1.0)], high=0.0)
                for side, sign in ((0, 1.0), (1, -1.0)):
                    flow = linear.real(most)
                    linear.row([(flow, 1.0), (arc, -most)], high=0.0)
                    balance[side][p].append((flow, sign))
                    balance[side][q].append((flow, -sign))
        for c, y in self.demand.items():
            for way in balance:
                linear.row([*way[c], (y, -1.0)], low=0.0, high=0.0)
