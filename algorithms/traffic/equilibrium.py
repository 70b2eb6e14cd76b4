"""Traffic in equilibrium: nobody has a quicker way left (Wardrop's first principle).

Streets slow down with their traffic by the curve of the Bureau of Public Roads (BPR). The flows
minimise Beckmann's sum of integrals, found by the biconjugate Frank-Wolfe method of M. Mitradjieva
and P. O. Lindberg, The Stiff Is Moving, Transportation Science 47 (2013), 280-293.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import CancelledError, InputError
from ..progress import Deadline, Progress, Silent
from .assign import WORK, Assignment, Loads, load, result
from .sections import Sections, cut_at_places
from .types import Demand, FloatArray, TrafficNetwork

#: Largest share of an earlier target in a direction; 1 would stand still.
_MOST = 0.99
#: Shares of earlier targets below this are none, and steps beyond this begin anew.
_TINY, _FULL = 1e-12, 1 - 1e-9
#: Halvings of the step: exact to machine precision.
_HALVINGS = 60


@dataclass(frozen=True)
class EquilibriumRules:
    """How streets slow down, and when to stop.

    Attributes
    ----------
    alpha, beta
        A full street takes 1 + `alpha` times as long as a free one, and the delay grows with the
        power `beta` of its flow (BPR: 0.15 and 4).
    gap
        Stop where all together would save this share of their time by changing to the quickest
        ways.
    rounds
        Most assignments.
    seconds
        Most time.
    """

    alpha: float = 0.15
    beta: float = 4.0
    gap: float = 1e-4
    rounds: int = 500
    seconds: float = 120.0

    def check(self) -> None:
        """Raise `InputError` where a number is out of range."""
        if not (0 <= self.alpha < math.inf and 1 <= self.beta <= 20):
            raise InputError(
                "Of the curve of delays alpha must be 0 or more, beta 1 to 20.",
                "Take 0.15 and 4 where nothing else is known.",
            )
        if not (0 < self.gap < 1 and self.rounds >= 1 and self.seconds > 0):
            raise InputError(
                "The gap must lie between 0 and 1, rounds and seconds must be positive.",
                "Give other numbers.",
            )


class _Curve:
    """Times of links by their flow (BPR), and how they rise; shapes (k,)."""

    def __init__(self, sections: Sections, rules: EquilibriumRules) -> None:
        self.free, self.capacity = sections.free_time, sections.capacity
        self.alpha, self.beta = rules.alpha, rules.beta

    def time(self, flow: FloatArray) -> FloatArray:
        return np.asarray(self.free * (1 + self.alpha * (flow / self.capacity) ** self.beta))

    def slope(self, flow: FloatArray) -> FloatArray:
        rise = self.free * self.alpha * self.beta / self.capacity
        return np.asarray(rise * (flow / self.capacity) ** (self.beta - 1))


def equilibrium(
    network: TrafficNetwork,
    demand: Demand,
    rules: EquilibriumRules | None = None,
    progress: Progress | None = None,
) -> Assignment:
    """Spread trips so that nobody has a quicker way left.

    Parameters
    ----------
    network
        The streets.
    demand
        The trips.
    rules
        The curve and when to stop; None for the defaults.
    progress
        Told how near it is. After a cancel the best flows so far are given.

    Raises
    ------
    InputError
        If a rule is out of range.
    CancelledError
        If the caller cancels before anything is known.
    """
    rules, progress = rules or EquilibriumRules(), progress or Silent()
    rules.check()
    sections = cut_at_places(network, demand.places)
    curve = _Curve(sections, rules)
    search = _Search(sections, demand, curve, rules, progress)
    loads, gap, rounds = search.run()
    return result(network, sections, loads, curve.time(loads.flow.sum(axis=0)), gap, rounds)


class _Search:
    """Biconjugate Frank-Wolfe on flows of all kinds, shape (c, k)."""

    def __init__(
        self,
        sections: Sections,
        demand: Demand,
        curve: _Curve,
        rules: EquilibriumRules,
        progress: Progress,
    ) -> None:
        self.sections, self.demand, self.curve = sections, demand, curve
        self.rules, self.progress = rules, progress
        self.targets: list[FloatArray] = []  # the last two, the newest first
        self.step = 0.0

    def run(self) -> tuple[Loads, float, int]:
        """Return the best flows, their gap, and the number of assignments."""
        deadline = Deadline(self.rules.seconds)
        first = load(self.sections, self.demand, self.sections.free_time, self.progress)
        flow, best, least, rounds = first.flow, first.flow, math.inf, 1
        while True:
            try:
                cost = self.curve.time(flow.sum(axis=0))
                target = load(self.sections, self.demand, cost, self.progress)
            except CancelledError:
                if math.isinf(least):
                    raise
                self.progress.warn(f"Cancelled while {WORK}: the best flows so far are kept.")
                break
            rounds += 1
            spent = float(cost @ flow.sum(axis=0))
            gap = max(0.0, (spent - target.least) / spent) if spent > 0 else 0.0
            self._tell(min(gap, least))
            if gap < least:
                best, least = flow, gap
            if gap <= self.rules.gap or rounds >= self.rules.rounds or deadline.passed():
                break
            flow = self._move(flow, target.flow, cost)
        return replace(first, flow=best), least, rounds

    def _tell(self, gap: float) -> None:
        done = math.log(max(gap, self.rules.gap)) / math.log(self.rules.gap)
        self.progress.stage("Seeking the equilibrium", min(1.0, max(0.0, done)))

    def _move(self, flow: FloatArray, target: FloatArray, cost: FloatArray) -> FloatArray:
        """Go towards a mix of the new target and the last two as far as it pays."""
        mixed = self._mixed(flow, target)
        total = flow.sum(axis=0)
        way = (mixed - flow).sum(axis=0)
        if float(cost @ way) >= 0:
            # Rounding has spoilt the mix: the plain target always leads down.
            self.targets, mixed = [], target
            way = (mixed - flow).sum(axis=0)
        self.step = self._length(total, way)
        self.targets = [] if self.step > _FULL else [mixed, *self.targets][:2]
        return np.maximum(flow + self.step * (mixed - flow), 0.0)

    def _mixed(self, flow: FloatArray, target: FloatArray) -> FloatArray:
        """Mix targets so that the directions are conjugate (Mitradjieva and Lindberg, 3.2)."""
        if not self.targets:
            return target
        total = flow.sum(axis=0)
        slope = self.curve.slope(total)
        now = target.sum(axis=0) - total
        last = self.targets[0].sum(axis=0) - total
        if len(self.targets) == 1:
            share = _share(last @ (slope * now), last @ (slope * (now - last)))
            return np.asarray(share * self.targets[0] + (1 - share) * target)
        one, two = self.targets
        older = self.step * (one.sum(axis=0) - total) + (1 - self.step) * (two.sum(axis=0) - total)
        if self.step >= _FULL:
            return target
        down = older @ (slope * (two - one).sum(axis=0))
        mu = max(0.0, -float(older @ (slope * now)) / down) if abs(down) > _TINY else 0.0
        size = last @ (slope * last)
        nu = 0.0
        if size > _TINY:
            nu = -float(last @ (slope * now)) / size + mu * self.step / (1 - self.step)
        nu = max(0.0, nu)
        weight = 1 / (1 + mu + nu)
        return np.asarray(weight * (target + nu * one + mu * two))

    def _length(self, total: FloatArray, way: FloatArray) -> float:
        """Share of the way at which the objective is least: where its slope changes sign."""
        low, high = 0.0, 1.0
        if float(self.curve.time(np.maximum(total + way, 0.0)) @ way) <= 0:
            return 1.0
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            time = self.curve.time(np.maximum(total + middle * way, 0.0))
            low, high = (middle, high) if float(time @ way) < 0 else (low, middle)
        return low


def _share(above: float, below: float) -> float:
    """Share of the last target in a conjugate direction, 0 to just below 1."""
    if abs(below) <= _TINY:
        return 0.0
    share = float(above / below)
    return min(_MOST, share) if share > 0 else 0.0
