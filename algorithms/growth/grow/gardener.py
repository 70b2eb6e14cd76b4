"""Growth of streets from a grammar (CS section 1), on real ground.

Each iteration visits the nodes that there were at its beginning, in the order of their numbers.
A node follows a rule of its state, changes its type, and draws the streets of the rule; how they
are built is told in `planar` and, for comparison, in `published`.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from ...errors import CancelledError, InputError
from ...progress import Progress, Silent
from ..bends import bends_of
from ..grammar import ROAD_TYPES
from ..rules import GrowthRules
from ..types import Ground, Growth
from .begin import begin
from .builder import THERE, Builder, tolerance_of
from .choose import NO_STATE, STATES, Chooser, Draw
from .columns import Columns, cell_side
from .crossing import Crossing
from .planar import PlanarBuilder
from .published import PublishedBuilder
from .stops import CANCELLED, Limits
from .walls import Walls

#: Progress is told, and cancellation asked for, every so many nodes.
ASK = 100


def grow(ground: Ground, rules: GrowthRules, progress: Progress | None = None) -> Growth:
    """Grow streets into a ground until a limit is reached (CS section 1, steps 1-7).

    The same ground, rules and seed give the same growth. Streets that are there are split where
    grown streets join them, and never moved.

    Parameters
    ----------
    ground
        Where streets may grow, and from where.
    rules
        Grammar, scale, limits, and how near streets may come to each other.
    progress
        Told of iterations, asked for cancellation; a cancelled growth returns what has grown.

    Raises
    ------
    InputError
        If there is no start, all starts lie outside of the domain, or no street can be built.
    CancelledError
        If it was cancelled before anything had grown.
    """
    return Gardener(ground, rules, progress or Silent()).run()


class Gardener:
    """One growth while it goes on. Parameters as for `grow`.

    Attributes
    ----------
    columns
        What has grown.
    builder
        Builds the streets, and counts those that are not built.
    """

    def __init__(self, ground: Ground, rules: GrowthRules, progress: Progress) -> None:
        self.ground, self.rules, self.progress = ground, rules, progress
        tolerance = tolerance_of(rules)
        lengths = [
            sum(child.length) / 2 * rules.scale
            for options in rules.grammar.rules.values()
            for rule in options
            for child in rule.children
        ]
        there = np.hypot(*(ground.nodes[ground.ends[:, 1]] - ground.nodes[ground.ends[:, 0]]).T)
        cell = cell_side(lengths, rules.radius, float(there.sum()))
        self.columns = columns = Columns(ground, cell, tolerance)
        walls = Walls(ground.domain, cell, tolerance)
        self.chooser = Chooser(
            rules.grammar, rules.scale, rules.seed, (columns.x, columns.y, columns.state)
        )
        kind = PublishedBuilder if rules.as_published else PlanarBuilder
        self.builder: Builder = kind(rules, columns, walls, self.chooser)
        if isinstance(self.builder, PlanarBuilder) and ground.strip is not None:
            self.builder.crossing = Crossing(ground.strip, ground.domain, self.builder.clearance)
        self.limits = Limits(rules, columns, len(ground.nodes), progress)

    def run(self) -> Growth:
        """Grow until a limit is reached."""
        begin(self.ground, self.rules, self.builder, self.progress)
        growing = self.alive(self.builder.fresh)
        cancelled = False
        why = self.limits.over(len(growing))
        while not why:
            growing, cancelled = self.iterate(growing)
            self.limits.step(len(growing))
            why = CANCELLED if cancelled else self.limits.over(len(growing))
        if not self.columns.grown:
            self.nothing(why, cancelled=cancelled)
        return self.growth(why)

    def iterate(self, growing: list[int]) -> tuple[list[int], bool]:
        """Let nodes grow, in their order; return those that may grow next, and if cancelled."""
        builder, limits, chooser = self.builder, self.limits, self.chooser
        step = len(limits.steps) + 1
        state, change, choose, draw = self.columns.state, chooser.change, chooser.choose, self.draw
        # a rule that draws nothing does nothing at all in CitySprout
        published = self.rules.as_published
        builder.fresh = []
        for place, node in enumerate(growing):
            if place % ASK == 0 and limits.ask():
                return growing, True
            choice = choose(node)
            if choice is None:
                continue
            if choice.draws or not published:
                change(node, state[node], choice.becomes)
            for child in choice.draws:
                draw(node, child, step)
                if limits.full():
                    return self.alive(growing + builder.fresh), False
        return self.alive(growing + builder.fresh), False

    def draw(self, node: int, child: Draw, step: int) -> None:
        """Draw one street from a node, at a random angle and length (CS figure 1)."""
        random, columns = self.chooser.random, self.columns
        turn, length = child.turn, child.length
        if child.turn_span:
            turn += child.turn_span * random()
        if child.mirrored and random() < 0.5:
            turn = -turn
        if child.length_span:
            length += child.length_span * random()
        (wx, wy), c, s = columns.way_in[node], cos(turn), sin(turn)
        x, y = columns.x[node], columns.y[node]
        end = (x + length * (wx * c - wy * s), y + length * (wx * s + wy * c))
        self.builder.build(node, child, end, step)

    def alive(self, nodes: list[int]) -> list[int]:
        """Return those nodes whose state has rules, in their order."""
        table, state = self.chooser.table, self.columns.state
        return sorted(node for node in nodes if state[node] in table)

    def nothing(self, why: str, *, cancelled: bool) -> None:
        """Say that there is no street at all."""
        if cancelled:
            msg = "The growth was cancelled before a street was built."
            raise CancelledError(msg)
        waiting = not self.builder.left and why != "nothing is left that grows"
        raise InputError(
            f"No street could be built: {why}.",
            "Give more iterations, as all nodes still wait."
            if waiting
            else "Move the starts to where there is room, choose a smaller scale, or look at the "
            "grammar's rules for the states of the starts.",
        )

    def growth(self, why: str) -> Growth:
        """Return what has grown."""
        columns = self.columns
        roads = np.array(["", *ROAD_TYPES])
        states = [*STATES, None]
        codes = np.array(columns.state, dtype=np.int64)
        codes[codes == NO_STATE] = len(STATES)
        ends = np.column_stack([columns.a, columns.b]).astype(np.int64)
        street = np.array(columns.street, dtype=np.int64)
        left = self.builder.left
        return Growth(
            xy=np.column_stack([columns.x, columns.y]).astype(float),
            road_type=np.array([s.road if s else "" for s in states])[codes],
            node_type=np.array([s.node if s else "" for s in states])[codes],
            born=np.array(columns.born, dtype=np.int64),
            incoming_road=np.array(columns.road_in, dtype=np.int64),
            incoming=np.array(columns.way_in, dtype=float).reshape(-1, 2),
            # also starts from which nothing grew
            bends=bends_of(len(columns.x), ends, street),
            ends=ends,
            road=np.array(columns.road, dtype=np.int64),
            edge_type=roads[np.array(columns.kind, dtype=np.int64) + 1],
            step=np.array(columns.step, dtype=np.int64),
            street=street,
            steps=tuple(self.limits.steps),
            stopped=why,
            left_out=sum(count for reason, count in left.items() if reason != THERE),
        )
