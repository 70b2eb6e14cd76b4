"""Two vertices are joined by a short way: point-to-point links and through routes.

The paper lists all short paths between two vertices and demands one of them (CND section 4.2
L1, equations 7-8). Here one unit of flow runs over the arcs that lie on such paths, and the
lengths of these arcs, weighted with the flow, keep the limit. Both say the same: a flow from
one vertex to another consists of paths (and rings, which only add length), the mean of whose
lengths keeps the limit only if one of them does. The list grows exponentially with the
tolerance, the flow does not grow beyond the mesh.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional

from ...errors import InputError
from .base import Requirement, View
from .corridor import Corridor, corridor
from .pathflow import Arc, Arcs, arcs_of, whole_excess

if TYPE_CHECKING:
    from ..cp.model import CpNetwork, Literal
    from ..mip.model import NetworkModel
    from ..problem import BoolArray, NetworkProblem


@dataclass(frozen=True)
class Link(Requirement):
    """A path of streets from one vertex to another, no longer than a limit.

    Existing edges are streets. The penalty is due once if there is no such path.

    Attributes
    ----------
    start, end
        Two different vertices of the mesh.
    limit
        Greatest length of the path; a hundred-thousandth more still keeps it.
    hops
        Whether the length is the number of edges; else it is the sum of
        `NetworkProblem.length`.
    private
        Whether nothing branches off on the way, as through traffic wants it (CND figure 6d).
        Such a route is all new: it runs over chosen edges, its inner vertices touch no
        existing street and have no other chosen edge. At its ends, mostly access points on
        existing streets, anything may meet.
    penalty
        Cost if there is no such path; infinite forbids.
    kind
        Name in counts and reports; routes for through traffic are called "through route".
    """

    start: int
    end: int
    limit: float
    hops: bool = False
    private: bool = False
    penalty: float = math.inf
    kind: str = "link"

    def __post_init__(self) -> None:
        """Refuse what no network can be asked."""
        if self.start == self.end:
            raise InputError(
                f"A link joins vertex {self.start} of the mesh with itself.",
                "Give two different vertices.",
            )
        if not (self.limit > 0 and math.isfinite(self.limit)):
            raise InputError(
                f"The limit of a link is {self.limit:g}.", "Give a length greater than 0."
            )
        if not self.penalty >= 0:
            raise InputError(
                f"The penalty of a link is {self.penalty:g}.", "Give 0 or a positive number."
            )
        if self.private and self.kind == "link":
            object.__setattr__(self, "kind", "through route")

    def violations(self, view: View) -> int:
        """Return 1 if there is no such path, else 0."""
        return 0 if self.path(view) is not None else 1

    def path(self, view: View) -> Optional[list[int]]:
        """Return the edges of such a path of a design in order, or None."""
        way = corridor(view.problem, self)
        if self.private:
            return _branchless(way, view)
        on = view.active | view.problem.existing
        return way.path(lambda e: bool(on[e]))

    def without(self, problem: NetworkProblem) -> Requirement | None:
        """Keep the link in a part of a problem if the streets chosen there can make it.

        It is dropped where existing streets make it already, and where no path of the part's
        candidates and existing streets is short enough: a link across several parts counts in
        the last part that completes it. So no part is made impossible by a link that cannot
        be made in it.

        Parameters
        ----------
        problem
            The part.
        """
        way = corridor(problem, self)
        if math.isinf(way.shortest):
            return None
        if not self.private and way.path(lambda e: bool(problem.existing[e])) is not None:
            return None
        return self

    def add_to_cp(self, network: CpNetwork) -> None:
        """Write the link into a CP-SAT model: path literals of arcs, one unit of flow.

        A window whose edges cannot be on the path, or at it, leaves the link as it is.
        """
        problem = network.index.problem
        way = corridor(problem, self)
        window = len(network.free) < len(network.index.edges)
        if window and not self._touches(way, network):
            return
        known: dict[int, Literal] = {
            e: True if problem.existing[e] else network.literal(e) for e in way.edges
        }
        arcs = arcs_of(way, lambda e: known[e] is not False)
        if arcs is None:
            if self.hard:
                network.clause([])
            else:
                network.cost(True, self.penalty)
            return
        if not self.private and way.path(lambda e: known[e] is True) is not None:
            return
        on: Literal = True
        if not self.hard:
            on = network.model.new_bool_var("")
            network.cost(network.negated(on), self.penalty)
        path = _path_literals(network, arcs, known, on)
        if self.private:
            _no_branches(network, arcs, path)
        network.hints.append(lambda active: self._hint(network, active, path, on))

    def _hint(
        self, network: CpNetwork, active: BoolArray, path: dict[Arc, int], on: Literal
    ) -> None:
        """Suggest the path of a design."""
        problem = network.index.problem
        # models that choose more than edges, such as rooms, hint at these after the edges
        edges = self.path(View(problem, active[: len(problem.mesh.edges)])) or []
        taken, v = set(), self.start
        for edge in edges:
            v = network.index.vertex_of(edge, v)
            taken.add((edge, v))
        network.write.suggest(path.values(), [int(arc in taken) for arc in path])
        if not isinstance(on, bool):
            network.model.add_hint(on, bool(edges))

    def _touches(self, way: Corridor, network: CpNetwork) -> bool:
        """Tell whether a free edge of a window can change the link."""
        if not self.private:
            return not way.edges.isdisjoint(network.free)
        ends = network.index.ends
        return any(v in way.left for e in network.free for v in ends[e])

    def add_to_mip(self, model: NetworkModel) -> None:
        """Write the link into a mixed-integer program: one unit of flow, or less at a price.

        The flow may be split: each of its paths is active since the edges are, and one of
        them keeps the limit. Where nothing may branch off, every active edge at a vertex
        carries at least the flow through it, so that there are only two.
        """
        problem, linear = model.index.problem, model.linear
        way = corridor(problem, self)
        arcs = arcs_of(way, lambda e: bool(problem.existing[e]) or e in model.edge)
        missing = None if self.hard else linear.real(1.0, self.penalty)
        if arcs is None:
            # no flow at all: forbidden, or the whole price
            parts = [] if missing is None else [(missing, 1.0)]
            if not parts:
                parts = [(linear.real(0.0), 1.0)]
            linear.row(parts, low=1.0)
            return
        flow = {arc: linear.real(1.0) for arc in arcs.arcs}
        share = [] if missing is None else [(missing, 1.0)]
        for edge, both in arcs.by_edge.items():
            if edge in model.edge:
                row = [(flow[arc], 1.0) for arc in both]
                linear.row([*row, (model.edge[edge], -1.0)], high=0.0)
        for v in arcs.vertices:
            row = [(flow[arc], 1.0) for arc in arcs.out.get(v, ())]
            row += [(flow[arc], -1.0) for arc in arcs.into.get(v, ())]
            if v == self.start:
                linear.row([*row, *share], low=1.0, high=1.0)
            elif v != self.end:
                linear.row(row, low=0.0, high=0.0)
        budget = [(flow[arc], arcs.excess[arc]) for arc in arcs.arcs if arcs.excess[arc] > 0]
        if budget:
            # times the flow, so that a part of the flow has a part of the budget
            spare = arcs.budget
            linear.row([*budget, *((m, spare) for m, _ in share)], high=spare)
        if self.private:
            _no_branches_linear(model, arcs, flow)


def _branchless(way: Corridor, view: View) -> Optional[list[int]]:
    """Return a path of chosen edges that nothing branches off, or None."""
    mesh, active = view.problem.mesh, view.active
    for first, vertex, length in way.steps.get(way.start, ()):
        path, far, edge, v = [first], length, first, vertex
        while active[edge] and far <= way.limit:
            if v == way.end:
                return path
            onward = [e for e in mesh.vertex_edges[v].tolist() if active[e] and e != edge]
            steps = [step for step in way.steps.get(v, ()) if step[0] in onward]
            if len(onward) != 1 or not steps or v == way.start:
                break
            edge, v, length = steps[0]
            far += length
            path.append(edge)
    return None


def _path_literals(
    network: CpNetwork, arcs: Arcs, known: dict[int, Literal], on: Literal
) -> dict[Arc, int]:
    """Add a path as literals of arcs; return their indices in the model.

    No more leaves a vertex than enters it: traced back from the end the path leads to the
    start. What enters and goes no further means nothing.
    """
    write = network.write
    path = {arc: write.whole(1) for arc in arcs.arcs}
    for edge, both in arcs.by_edge.items():
        network.check()
        literal = known[edge]
        if not isinstance(literal, bool):
            for arc in both:
                write.implies(path[arc], literal.index)
        if len(both) == 2:
            write.at_most_one([path[arc] for arc in both])
    for v in arcs.vertices:
        out = [path[arc] for arc in arcs.out.get(v, ())]
        into = [path[arc] for arc in arcs.into.get(v, ())]
        if v == arcs.end:
            write.some_of(into if isinstance(on, bool) else [*into, -1 - on.index])
        elif v != arcs.start:
            write.at_least([*into, *out], [1] * len(into) + [-1] * len(out), 0)
        if len(out) > 1 and len(into) != 1:
            # a path may as well leave each vertex once
            write.at_most_one(out)
    weights, budget = whole_excess(arcs)
    if sum(weights.values()) > budget:
        used = [arc for arc in arcs.arcs if weights[arc]]
        write.at_least([path[arc] for arc in used], [-weights[arc] for arc in used], -budget)
    return path


def _no_branches(network: CpNetwork, arcs: Arcs, path: dict[Arc, int]) -> None:
    """Forbid other chosen edges at the inner vertices of a path."""
    index = network.index
    for v in arcs.vertices:
        if v in (arcs.start, arcs.end):
            continue
        for edge in index.incident[v]:
            literal = network.literal(edge)
            if literal is False:
                continue
            own = [path[arc] for arc in arcs.by_edge.get(edge, ())]
            if not isinstance(literal, bool):
                own.append(-1 - literal.index)
            for arc in arcs.into.get(v, ()):
                if arc[0] != edge:
                    network.write.some_of([-1 - path[arc], *own])


def _no_branches_linear(model: NetworkModel, arcs: Arcs, flow: dict[Arc, Any]) -> None:
    """Let every active edge at an inner vertex carry at least the flow through it."""
    for v in arcs.vertices:
        if v in (arcs.start, arcs.end):
            continue
        through = [(flow[arc], 1.0) for arc in arcs.into.get(v, ())]
        for edge in model.index.incident[v]:
            own = [(flow[arc], -1.0) for arc in arcs.by_edge.get(edge, ())]
            model.linear.row([*through, *own, (model.edge[edge], 1.0)], high=1.0)
