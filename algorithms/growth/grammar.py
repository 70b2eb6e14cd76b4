"""What a grammar says: states of nodes, and the rules by which they grow.

A grammar is data. It is read from a file and checked by `grammarfile`; nothing in it is ever
evaluated as code. Angles are radians here and lengths are in the grammar's own unit; files say
degrees (or radians), and the planner says how many metres the unit has.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

#: Types of road (CS Table 2), by their letters.
MAIN, LARGE, SMALL = "m", "l", "s"
ROAD_TYPES: Mapping[str, str] = {MAIN: "main", LARGE: "large", SMALL: "small"}

#: Types of node (CS Table 2), by the names they have in grammars. K and BOUNDARY, which the
#: supplement does not name, never grow: K is done, BOUNDARY lies at the edge of the ground.
START, LEAF, TWIG, BRANCH, DONE, EDGE = "Start", "L", "T", "B", "K", "BOUNDARY"
NODE_TYPES: Mapping[str, str] = {
    START: "start",
    LEAF: "leaf",
    TWIG: "twig",
    BRANCH: "branch",
    DONE: "done",
    EDGE: "edge",
}
#: Types of node that no rule may be given for.
NEVER_GROW = (DONE, EDGE)


@dataclass(frozen=True, order=True)
class State:
    """What a node is: the RN value of CS section 1.

    Attributes
    ----------
    road
        A key of `ROAD_TYPES`.
    node
        A key of `NODE_TYPES`.
    """

    road: str
    node: str

    @property
    def label(self) -> str:
        """The state as grammars write it, such as mStart or lB."""
        return self.road + self.node

    @property
    def words(self) -> str:
        """The state in words, such as "main start"."""
        return f"{ROAD_TYPES[self.road]} {NODE_TYPES[self.node]}"


#: Every state there can be, by its label.
STATES: Mapping[str, State] = {
    road + node: State(road, node) for road in ROAD_TYPES for node in NODE_TYPES
}


@dataclass(frozen=True)
class Child:
    """One street that a rule draws from a node.

    Attributes
    ----------
    angle
        Least and greatest deflection from the direction in which the node was reached, radians,
        counter-clockwise; both are equal where it is one value.
    mirrored
        Whether the deflection changes its sign in half of the cases.
    length
        Least and greatest length, in the grammar's unit, greater than 0.
    state
        What the node at its end becomes.
    new_road
        Whether a new road begins, or the road by which the node was reached goes on.
    """

    angle: tuple[float, float]
    length: tuple[float, float]
    state: State
    mirrored: bool = False
    new_road: bool = False


@dataclass(frozen=True)
class Rule:
    """One production rule (CS Table 4).

    Attributes
    ----------
    probability
        How likely it is, against the other rules of the same state; greater than 0.
    becomes
        Node type of the node after it has grown.
    children
        The streets that it draws; none where the node only changes its type.
    min_distances
        How far the node must be from the nearest other node of a state, in the grammar's unit.
    """

    probability: float
    becomes: str
    children: tuple[Child, ...] = ()
    min_distances: Mapping[State, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Grammar:
    """A set of production rules.

    Attributes
    ----------
    name
        What it is called.
    rules
        The rules of each state; a state without rules never grows.
    text
        What it makes, in a sentence.
    credit
        Whom it is owed to, in a sentence.
    """

    name: str
    rules: Mapping[State, tuple[Rule, ...]]
    text: str = ""
    credit: str = ""

    @property
    def start(self) -> State:
        """The state in which growth begins where there is no road yet."""
        return State(MAIN, START)

    @property
    def leaf(self) -> State:
        """The state of a loose end from which growth goes on: the highest leaf with rules."""
        leaves = (State(road, LEAF) for road in ROAD_TYPES)
        return next((leaf for leaf in leaves if leaf in self.rules), self.start)

    @property
    def longest(self) -> float:
        """Greatest length of a street, in the grammar's unit; 0 where none is drawn."""
        lengths = [c.length[1] for rules in self.rules.values() for r in rules for c in r.children]
        return max(lengths, default=0.0)


def degrees(angle: float) -> float:
    """Return an angle of a grammar, radians, as a planner reads it, degrees."""
    return round(math.degrees(angle), 9)
