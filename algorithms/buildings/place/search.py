"""A plan, and how parts of it are planned anew."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ...progress import Deadline
from ..rules import LayoutRules
from ..types import BuildingType, Floats, Ints, Placements
from ..zone import ControlLine, Zone
from .candidates import Maker, Raster
from .columns import Bools, Columns, columns_of
from .conflicts import cliques_of
from .ground import buildable
from .groups import WALL, groups_of
from .limits import Limits
from .outlines import at_odds, pairs_between, rows_of
from .program import Effort, Limit, Program, Wish, solve_program
from .relax import restricted, worth_a_look
from .score import group_cost
from .stretches import stretches_of
from .sunshine import Sunshine
from .ways import Ways
from .worth import Worth

#: Times that a window is solved again after something it could not know was found wrong.
AGAIN = 3
#: Only what is better by more than this is better.
BETTER = 1e-7
#: Ways are at least and at most so many times as long as they are reckoned first.
FACTORS = (0.5, 3.0)
#: Cost of a way for who has none (W is in 100 m), and how far around a building that is walled in
#: something has to give way, metres.
NO_WAY, WALLED_IN = 20.0, 40.0


class Search:
    """A plan and how it is improved.

    Parameters
    ----------
    zone, types, rules, lines
        What is asked.
    start
        A valid plan.
    deadline
        When to stop.

    Attributes
    ----------
    now
        The best plan; the ways of its columns are planned, not reckoned.
    value
        Its objective.
    """

    def __init__(
        self,
        zone: Zone,
        types: Sequence[BuildingType],
        rules: LayoutRules,
        lines: Sequence[ControlLine],
        start: Placements,
        deadline: Deadline,
    ) -> None:
        self.zone, self.types, self.rules, self.lines = zone, types, rules, lines
        self.deadline = deadline
        # groups that are told apart by the program must not touch
        self.gap_m = max(rules.gap_m, 2 * WALL)
        self.worth = Worth.of(zone, types, rules)
        self.ways = Ways(zone, types, rules, lines)
        self.sun = Sunshine(zone, types, rules)
        ground = buildable(zone, rules)
        self.maker = Maker(types, lines, self.worth, stretches_of(types, lines, ground, self.ways))
        self.now = self._with_ways(self._columns_of(start), np.arange(len(zone.patches)))
        self.limits = Limits(zone, types, rules, self._standing(self.now))
        self.value = self._value(self.now)
        self._learn(self.now)

    def placed(self) -> Placements:
        """Return the plan."""
        return self.now.buildings(self.types)[0]

    def plan_anew(self, lines: Sequence[int], raster: Raster, effort: Effort, most: int) -> bool:
        """Plan some lines anew while all else stands; tell whether that made the plan better.

        The program reckons with ways as the crow would walk. What it chooses is taken only if the
        objective is better with ways that are planned; if not, it is told what they cost.

        Parameters
        ----------
        lines, raster
            Which lines, and places on them.
        effort, most
            How long a solver may work, and with how many columns at most.
        """
        outside = np.zeros(len(self.now), dtype=bool)
        outside[self.now.owner[~np.isin(self.now.line, lines)]] = True
        fixed, free = self.now.take(outside), self.now.take(~outside)
        fresh = self.maker.columns(lines, self._edges(raster, lines))
        fresh = fresh.take(~self._blocked(fresh, fixed))
        columns = free.join(fresh)
        if not len(columns):
            return False
        program = self._program(columns, fixed, np.arange(len(columns)) < len(free))
        before = program.value(program.hint)
        keep, _ = worth_a_look(program, most, self.deadline.left)
        if not keep.any():
            return False
        columns, program = columns.take(keep), restricted(program, keep)
        patches = np.unique(columns.patch)
        for _ in range(AGAIN):
            if self.deadline.passed():
                return False
            answer = solve_program(program, effort, self.deadline.passed)
            if answer.chosen is None or program.value(answer.chosen) > before - BETTER:
                return False
            chosen = np.flatnonzero(answer.chosen)
            plan = fixed.join(columns.take(chosen))
            cuts = self._wrong(plan, len(fixed), chosen)
            if cuts:
                program.cuts += cuts
                continue
            plan = self._with_ways(plan, patches)
            if self._value(plan) < self.value - BETTER:
                self.now, self.value = plan, self._value(plan)
                self._learn(plan)
                return True
            self._learn(plan)
            program.cost[chosen] = self._cost(plan)[len(fixed) :]
        return False

    def _columns_of(self, placed: Placements) -> Columns:
        """Make columns of the groups of a plan."""
        group = groups_of(self.types, placed)
        built = self.worth.gable * group_cost(self.types, self.rules, placed, group)
        turned = self.worth.turn * self.worth.turned(placed.type, placed.facing)
        built = built + np.bincount(group, turned, len(built))
        return columns_of(placed, group, built, np.zeros(len(placed)))

    def _with_ways(self, plan: Columns, patches: Ints) -> Columns:
        """Plan the ways of some patches and return the plan with what they cost."""
        placed, owner = plan.buildings(self.types)
        here = np.isin(placed.patch, patches)
        cost, reached = self.ways.planned(placed.take(here))
        cost = np.where(reached, cost, NO_WAY)
        own = np.isin(plan.patches(), patches)
        way = np.where(own, np.bincount(owner[here], cost, len(plan)), plan.way)
        return dataclasses.replace(plan, way=way)

    def _learn(self, plan: Columns) -> None:
        """Let ways be reckoned as they came out in a plan, by lines."""
        row = np.bincount(plan.owner, plan.count, len(plan))
        placed, owner = plan.buildings(self.types)
        if not len(placed):
            return
        reckoned, found = self.ways.reckon(placed), (plan.way / row)[owner]
        own = found < NO_WAY / 2
        if not own.any():
            return
        factor = found[own].sum() / max(reckoned[own].sum(), 1e-9)
        self.maker.factor = float(np.clip(factor, *FACTORS))
        off = np.clip(found - self.maker.factor * reckoned, -reckoned, 1.0)[own]
        number = np.bincount(placed.line[own], minlength=len(self.lines))
        mean = np.bincount(placed.line[own], off, len(self.lines)) / np.maximum(1, number)
        some = number > 0
        self.maker.further[some] = (self.maker.further[some] + mean[some]) / 2

    def _cost(self, columns: Columns) -> Floats:
        """Return what columns cost, shape (n,)."""
        cost: Floats = columns.built + self.worth.way * columns.way
        return cost

    def _value(self, plan: Columns) -> float:
        """Return the objective of a plan."""
        left = self.worth.remainder(np.repeat(plan.type, plan.count))
        return float(self._cost(plan).sum()) + left

    def _standing(self, columns: Columns) -> Ints:
        """Count buildings by patch and type."""
        total: Ints = columns.numbers(len(self.zone.patches), len(self.types)).sum(axis=0)
        return total

    def _edges(self, raster: Raster, lines: Sequence[int]) -> Raster:
        """Add the edges of what stands, and those a gap away, to a raster."""
        edges: dict[int, list[float]] = {}
        half, gap = self.now.half_lengths(self.types), self.gap_m
        for row in np.flatnonzero(np.isin(self.now.line, lines)):
            number = int(self.now.line[row])
            line = self.lines[number]
            if not line.along:
                continue
            start = np.array(line.start)
            at = float((self.now.xy[row] - start) @ (np.array(line.end) - start)) / line.length
            low, high = at - half[row], at + half[row]
            edges.setdefault(number, []).extend([low, high, low - gap, high + gap])
        known = {n: np.unique(np.round(e, 6)) for n, e in edges.items()}
        return Raster(raster.step, raster.phase, known)

    def _blocked(self, fresh: Columns, fixed: Columns) -> Bools:
        """Tell which columns are in the way of what stands."""
        blocked = np.zeros(len(fresh), dtype=bool)
        # frames of rows are numbered by direction, so both are drawn together
        both = rows_of(fresh.join(fixed), self.types, self.sun)
        new = both.owner < len(fresh)
        mine = both.take(new)
        gap = self.gap_m
        pairs = pairs_between(mine, both.take(~new), gap, shade=self.sun.exact)
        blocked[mine.owner[pairs[:, 0]]] = True
        blocked[at_odds(mine, gap)] = True
        left = np.flatnonzero(~blocked)
        if not self.sun.exact and len(left):
            placed, owner = fresh.take(left).buildings(self.types)
            dark = self.sun.darkened(placed, fixed.buildings(self.types)[0])
            blocked[left[owner[dark]]] = True
        return blocked

    def _program(self, columns: Columns, fixed: Columns, hint: Bools) -> Program:
        """Write the program of a window."""
        rows = rows_of(columns, self.types, self.sun)
        numbers = columns.numbers(len(self.zone.patches), len(self.types))
        total = numbers.sum(axis=1)
        stands = np.repeat(fixed.type, fixed.count)
        price = self.worth.missing / 2
        wishes = [
            Wish(max(0.0, 1.0 - float(gain[stands].sum())), total @ gain, price)
            for gain in (self.worth.far, self.worth.density)
        ]
        return Program(
            self._cost(columns),
            cliques_of(rows, self.lines, self.gap_m),
            [wish for wish in wishes if price > 0],
            self.limits.rows(numbers, self._standing(fixed)),
            hint,
        )

    def _wrong(self, plan: Columns, fixed: int, chosen: Ints) -> list[Limit]:
        """Return cuts for what a program does not know, columns as in the program.

        Where a building has no way out, not all around it may be chosen; where one is in the
        shade of several together, not all of them.
        """
        placed, owner = plan.buildings(self.types)
        sets = [
            np.flatnonzero(np.hypot(*(placed.xy - placed.xy[b]).T) < WALLED_IN)
            for b in np.flatnonzero(~self.ways.reached(placed))
        ]
        if not self.sun.exact:
            dark = np.flatnonzero(self.sun.in_shade(placed))
            sets += [self.sun.blockers(placed, int(b)) for b in dark]
        cuts = []
        for together in sets:
            new = np.unique(owner[together])
            new = chosen[new[new >= fixed] - fixed]
            if len(new):
                cuts.append(Limit(new, np.ones(len(new)), len(new) - 1.0))
        return cuts
