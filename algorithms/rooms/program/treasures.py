"""Dead ends of levels in the programs: blocks with one passage, where treasure may lie.

No edge of a route lies on a border of blocks (CND-x eq. 20). So the route gets into or out of a
block at a vertex of its rim exactly if an edge inside the block is on there and an edge beyond it,
and whether it does hardly depends on the block: at a vertex of valence 4 on a straight border these
are two edges in line, the same for every placement that has its border there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from ...network.cp.model import CpNetwork, Literal, index_of
from ...network.mip.model import NetworkModel
from .index import Gate, RoomIndex


def places_in(index: RoomIndex, room: int) -> list[int]:
    """Return the inner edges of a block at which the route would touch start or goal."""
    asked = index.problem.treasures
    ends = index.problem.network.mesh.edges
    apart = set() if asked is None else set(asked.apart)
    return [e for e in index.problem.placements.inner[room] if apart & set(ends[e].tolist())]


def treasure_count(index: RoomIndex, on: list[bool], rooms: Iterable[int]) -> int:
    """Count the treasure rooms of a level.

    Parameters
    ----------
    index
        The problem.
    on
        For each edge, whether the route runs there.
    rooms
        The blocks.
    """
    count = 0
    for r in rooms:
        passages = sum(
            any(on[e] for e in inside) and any(on[e] for e in beyond)
            for _, inside, beyond in index.gates(r)
        )
        count += passages == 1 and not any(on[e] for e in places_in(index, r))
    return count


@dataclass(eq=False)
class _Passages:
    """Literals of passages in a CP-SAT model, each made once."""

    network: CpNetwork
    made: dict[Gate, Literal] = field(default_factory=dict)
    some: dict[tuple[int, ...], Literal] = field(default_factory=dict)

    def at(self, gate: Gate) -> Literal:
        """Return whether the route passes at a gate."""
        if gate not in self.made:
            _, inside, beyond = gate
            self.made[gate] = self._both(self._any(inside), self._any(beyond))
        return self.made[gate]

    def _any(self, edges: tuple[int, ...]) -> Literal:
        """Return whether one of some edges is on."""
        literals = [self.network.literal(e) for e in edges]
        if any(a is True for a in literals):
            return True
        open_: list[Any] = [a for a in literals if a is not False]
        if not open_:
            return False
        key = tuple(a.index for a in open_)
        if len(key) > 1 and key not in self.some:
            either = self.network.model.new_bool_var("")
            self.network.write.some_of([*key, -1 - either.index])
            for x in key:
                self.network.write.implies(x, either.index)
            self.some[key] = either
        return self.some[key] if len(key) > 1 else open_[0]

    def _both(self, one: Literal, other: Literal) -> Literal:
        """Return whether two literals hold."""
        if one is False or other is False:
            return False
        if one is True or other is True:
            return other if one is True else one
        both = self.network.model.new_bool_var("")
        self.network.write.implies(both.index, one.index)
        self.network.write.implies(both.index, other.index)
        self.network.write.some_of([both.index, -1 - one.index, -1 - other.index])
        return both


def add_treasures(network: CpNetwork, index: RoomIndex) -> None:
    """Keep the number of treasure rooms in a model whose rooms are there already.

    Blocks that stay count, too: what is laid anew beside them may give them another passage.
    """
    asked = index.problem.treasures
    if asked is None:
        return
    passages = _Passages(network)
    known, open_ = 0, []
    kept = [r for r, stays in enumerate(network.tail.tolist()) if stays]
    for r in sorted([*network.further, *kept]):
        network.check()
        counts = _counted(network, index, passages, r)
        if counts is True:
            known += 1
        elif counts is not False:
            open_.append(counts.index)
    network.write.at_least(open_, [1] * len(open_), asked.least - known)
    network.write.at_least(open_, [-1] * len(open_), known - asked.most)


def _counted(network: CpNetwork, index: RoomIndex, passages: _Passages, room: int) -> Literal:
    """Return whether a placement is a treasure room."""
    chosen: Any = network.further.get(room, True)
    touch = [network.literal(e) for e in places_in(index, room)]
    if any(a is True for a in touch):
        return False
    near = [index_of(a) for a in touch if a is not False]
    at = [passages.at(gate) for gate in index.gates(room)]
    certain = sum(a is True for a in at)
    open_ = [a.index for a in at if not isinstance(a, bool)]
    if certain > 1:
        return False
    if chosen is True and not open_ and not near:
        return certain == 1
    write = network.write
    counts = network.model.new_bool_var("")
    if chosen is not True:
        write.implies(counts.index, chosen.index)
    for x in near:
        write.some_of([-1 - counts.index, -1 - x])
    write.at_least(open_, [-1] * len(open_), certain - 1, only_if=(counts.index,))
    write.at_least(open_, [1] * len(open_), 1 - certain, only_if=(counts.index,))
    # else there are two passages, or start or goal
    known = () if chosen is True else (chosen.index,)
    weights = [1] * len(open_) + [2] * len(near)
    write.at_least([*open_, *near], weights, 2 - certain, only_if=(-1 - counts.index, *known))
    return counts


def add_linear_treasures(model: NetworkModel, index: RoomIndex, room: list[Any]) -> None:
    """Keep the number of treasure rooms in a mixed-integer program.

    Parameters
    ----------
    model
        The network.
    index
        The problem.
    room
        Variable of each placement.
    """
    asked = index.problem.treasures
    if asked is None:
        return
    linear = model.linear
    made: dict[Gate, Any] = {}
    some: dict[tuple[int, ...], Any] = {}

    def any_of(edges: tuple[int, ...]) -> Any:
        if len(edges) == 1:
            return model.edge[edges[0]]
        if edges not in some:
            some[edges] = linear.real(1.0)
            for e in edges:
                linear.row([(some[edges], 1.0), (model.edge[e], -1.0)], low=0.0)
            linear.row([*((model.edge[e], 1.0) for e in edges), (some[edges], -1.0)], low=0.0)
        return some[edges]

    def passages(r: int) -> list[tuple[Any, float]]:
        able = [(v, usable(inside), usable(beyond)) for v, inside, beyond in index.gates(r)]
        return [(passage(gate), 1.0) for gate in able if gate[1] and gate[2]]

    def usable(edges: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(e for e in edges if e in model.edge)

    def passage(gate: Gate) -> Any:
        if gate not in made:
            made[gate] = linear.real(1.0)
            one, other = any_of(gate[1]), any_of(gate[2])
            linear.row([(made[gate], 1.0), (one, -1.0)], high=0.0)
            linear.row([(made[gate], 1.0), (other, -1.0)], high=0.0)
            linear.row([(made[gate], 1.0), (one, -1.0), (other, -1.0)], low=-1.0)
        return made[gate]

    total = []
    for r, chosen in enumerate(room):
        counts = linear.binary()
        total.append((counts, 1.0))
        row = passages(r)
        near = [model.edge[e] for e in places_in(index, r) if e in model.edge]
        linear.row([(counts, 1.0), (chosen, -1.0)], high=0.0)
        for x in near:
            linear.row([(counts, 1.0), (x, 1.0)], high=1.0)
        most = float(max(1, len(row)))
        linear.row([*row, (counts, most - 1.0)], high=most)
        linear.row([*row, (counts, -1.0)], low=0.0)
        linear.row([*row, *((x, 2.0) for x in near), (chosen, -2.0), (counts, 2.0)], low=0.0)
    linear.row(total, low=float(asked.least), high=float(asked.most))
