"""Which rule a node follows, and the random numbers of a growth.

States and rules are coded by integers and tuples here, since they are looked up for every node
of every iteration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from ..grammar import NODE_TYPES, ROAD_TYPES, Child, Grammar, Rule, State
from .cells import PointCells, box

#: All states; the position of a state is its code. Nodes of the ground that did not grow have
#: `NO_STATE`.
STATES = tuple(State(road, node) for road in ROAD_TYPES for node in NODE_TYPES)
CODE = {state: code for code, state in enumerate(STATES)}
NO_STATE = -1

#: Random numbers are drawn from numpy in blocks of this size, as single draws are slow.
BLOCK = 4096


class Draw(NamedTuple):
    """A `Child` in numbers: least values and spans, lengths in metres.

    Attributes
    ----------
    turn, turn_span, mirrored, length, length_span, new_road
        As in `Child`.
    state, edge_state
        Codes of its end, in free ground and at the edge of the ground.
    road
        Position of the road type among `ROAD_TYPES`.
    """

    turn: float
    turn_span: float
    mirrored: bool
    length: float
    length_span: float
    new_road: bool
    state: int
    edge_state: int
    road: int


class Choice(NamedTuple):
    """A `Rule` in numbers: the state that follows, what it draws, distances in metres."""

    becomes: int
    draws: tuple[Draw, ...]
    distances: tuple[tuple[int, float], ...]


def random_numbers(seed: int) -> Callable[[], float]:
    """Return a function that gives the next random number of [0, 1)."""

    def stream() -> Iterator[float]:
        generator = np.random.default_rng(seed)
        while True:
            yield from generator.random(BLOCK).tolist()

    return stream().__next__


def coded(grammar: Grammar, scale: float) -> dict[int, tuple[tuple[float, ...], list[Choice]]]:
    """Return the rules of a grammar by code of state: sums of probabilities, and choices.

    Parameters
    ----------
    grammar
        The rules.
    scale
        Metres per unit.
    """
    table = {}
    for state, rules in grammar.rules.items():
        if not rules:
            continue
        sums = np.cumsum([rule.probability for rule in rules]).tolist()
        table[CODE[state]] = (tuple(sums), [_choice(state, rule, scale) for rule in rules])
    return table


def _choice(state: State, rule: Rule, scale: float) -> Choice:
    # Compared a hair shorter: streets of one length meet at exactly such distances.
    return Choice(
        CODE[State(state.road, rule.becomes)],
        tuple(_draw(child, scale) for child in rule.children),
        tuple((CODE[s], d * scale * (1 - 1e-9)) for s, d in rule.min_distances.items()),
    )


def _draw(child: Child, scale: float) -> Draw:
    road = child.state.road
    return Draw(
        child.angle[0],
        child.angle[1] - child.angle[0],
        child.mirrored,
        child.length[0] * scale,
        (child.length[1] - child.length[0]) * scale,
        child.new_road,
        CODE[child.state],
        CODE[State(road, "BOUNDARY")],
        list(ROAD_TYPES).index(road),
    )


class Chooser:
    """Chooses the rules of nodes, and knows where the states are that keep distances.

    Parameters
    ----------
    grammar
        The rules.
    scale
        Metres per unit.
    seed
        Of all random numbers.
    x, y, state
        Columns of the nodes, which grow: positions in metres and codes of states.
    """

    def __init__(
        self,
        grammar: Grammar,
        scale: float,
        seed: int,
        columns: tuple[list[float], list[float], list[int]],
    ) -> None:
        self.random = random_numbers(seed)
        self.table = coded(grammar, scale)
        self.x, self.y, self.state = columns
        farthest: dict[int, float] = {}
        for _, choices in self.table.values():
            for choice in choices:
                for code, distance in choice.distances:
                    farthest[code] = max(distance, farthest.get(code, 0.0))
        #: One grid per state to which distances are kept.
        self.kept = {code: PointCells(far) for code, far in farthest.items() if far > 0}

    def change(self, node: int, before: int, after: int) -> None:
        """Give a node another state; `NO_STATE` before for a new node."""
        self.state[node] = after
        if before != after:
            if before in self.kept:
                self.kept[before].remove(node, self.x[node], self.y[node])
            if after in self.kept:
                self.kept[after].add(node, self.x[node], self.y[node])

    def choose(self, node: int) -> Choice | None:
        """Return the rule that a node follows now, None where its state has none.

        By probability first; where a minimum distance of that rule is not kept the others in
        random order, and where none is kept the last that was tried (CS section 1, steps 2-3).
        """
        entry = self.table.get(self.state[node])
        if entry is None:
            return None
        sums, choices = entry
        if len(choices) == 1:
            return choices[0]
        random = self.random
        place, first = random() * sums[-1], 0
        while first < len(sums) - 1 and place >= sums[first]:
            first += 1
        choice = choices[first]
        if not choice.distances or self._far(node, choice):
            return choice
        others = [c for k, c in enumerate(choices) if k != first]
        while others:
            choice = others.pop(int(random() * len(others)))
            if not choice.distances or self._far(node, choice):
                break
        return choice

    def _far(self, node: int, choice: Choice) -> bool:
        """Tell whether a node is as far from other nodes as a rule wants it."""
        xs, ys = self.x, self.y
        x, y = xs[node], ys[node]
        for code, distance in choice.distances:
            grid = self.kept.get(code)
            if grid is None:
                continue
            square, find = distance * distance, grid.cells.get
            for key in box(x, y, distance, grid.per):
                for other in find(key, ()):
                    dx, dy = xs[other] - x, ys[other] - y
                    if dx * dx + dy * dy < square and other != node:
                        return False
        return True
