"""From a design that only breaks what is asked of the whole network to one that keeps it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..cp.sat import CpOptions
from ..evaluate import Evaluator
from ..incumbent import Incumbent
from ..problem import BoolArray, NetworkProblem
from ..requirements.base import View
from ..structure import Structure, structure
from .windows import Windows, solve_window

#: Radii of windows, in edges, that are tried in turn where the smaller ones do not help.
RADII = (4, 5, 6, 7)
#: Bounds of the number of windows without improvement before the next radius.
LEAST, MOST = 6.0, 40.0
#: Effort of one window, in CP-SAT's deterministic units.
EFFORT = 0.1


def softened(problem: NetworkProblem, price: float) -> NetworkProblem:
    """Return a problem whose hard requirements cost a price per violation instead.

    Distances do not count in it, since windows with distances take several times as long.
    """
    found = []
    for r in problem.requirements:
        # every requirement is a dataclass, which its base class cannot say
        whole: Any = r
        found.append(dataclasses.replace(whole, penalty=price) if r.hard else r)
    # streets that cost nothing would be built at random
    length = problem.weight_length or 1.0
    return dataclasses.replace(
        problem, requirements=tuple(found), weight_distance=0.0, weight_length=length
    )


def price_of(problem: NetworkProblem, active: BoolArray) -> float:
    """Return a price of violations that outweighs some streets' worth of everything else.

    It is infinite where the design breaks another hard rule.
    """
    plain = dataclasses.replace(softened(problem, 1.0), requirements=())
    found = Evaluator(plain).evaluate(active)
    return max(1.0, 10.0 * found.objective / max(1, int(active.sum())))


def repaired_start(
    run: Incumbent, seed: int, first: Callable[[Incumbent, Structure], object]
) -> bool:
    """Find a first design by leaving requirements aside, then repairing what it breaks.

    Parameters
    ----------
    run
        Takes the design; tells when to stop.
    seed
        Seed of the random choices.
    first
        Finds a first design of the problem without requirements; given a run of its own, which
        is to take it, and the index of that problem.

    Returns
    -------
    bool
        Whether a valid design was found. False proves nothing.
    """
    plain = dataclasses.replace(run.evaluator.problem, requirements=())
    index = structure(plain)
    if index.conflicts:
        return False
    trial = Incumbent(Evaluator(plain), run.deadline, progress=None)
    first(trial, index)
    return trial.best is not None and repair(run, trial.best, seed)


def repair(run: Incumbent, active: BoolArray, seed: int) -> bool:
    """Improve a design window by window until it keeps all hard requirements.

    Violations cost a price meanwhile. CP-SAT alone looks for a first design in the whole
    network at once, which takes longer and finds a worse one where a design without the
    requirements is at hand.

    Parameters
    ----------
    run
        Takes the design; tells when to stop.
    active
        Shape (e,). A design that breaks no hard rule but requirements.
    seed
        Seed of the random choices.

    Returns
    -------
    bool
        Whether a valid design was found. False proves nothing.
    """
    problem = run.evaluator.problem
    price = price_of(problem, active)
    if not math.isfinite(price):
        return False
    soft = softened(problem, price)
    search = _Repair(run, Windows(structure(soft), run.wanted()), Evaluator(soft), active, seed)
    return any(search.mend(radius) for radius in RADII)


class _Repair:
    """A search that ends with the last violation."""

    def __init__(
        self,
        run: Incumbent,
        windows: Windows,
        evaluator: Evaluator,
        active: BoolArray,
        seed: int,
    ) -> None:
        self.run = run
        self.windows = windows
        self.evaluator = evaluator
        self.active = active
        self.value = evaluator.objective(active)
        self.rng = np.random.default_rng(seed)

    def mend(self, radius: int) -> bool:
        """Solve windows of a size until nothing improves; return whether nothing is broken."""
        failures, order = 0, self._centres()
        # about as many as tile half of the mesh; where nothing helps, proofs must have their turn
        patience = min(MOST, max(LEAST, len(self.windows.index.incident) / radius**2))
        while failures < patience:
            if self.run.take(self.active):
                return True
            if self.run.enough():
                return False
            order = order or self._centres()
            better = self._window(self.windows.around(order.pop(), radius))
            order = self._centres() if better else order
            failures = 0 if better else failures + 1
        return self.run.take(self.active)

    def _centres(self) -> list[int]:
        """Return vertices in random order: where something is broken comes last, thus first."""
        problem, index = self.run.evaluator.problem, self.windows.index
        view = View(problem, self.active)
        broken = [r for r in problem.requirements if r.hard and r.violations(view)]
        where = {v for r in broken for v in r.places(view)}
        order = self.rng.permutation(len(index.incident)).tolist()
        near = [v for v in order if v in where]
        return [v for v in order if index.incident[v] and v not in where] + near

    def _window(self, free: list[int]) -> bool:
        """Solve one window; return whether the design is better."""
        if not free:
            return False
        options = CpOptions(
            self.run.deadline.left,
            effort=EFFORT,
            seed=int(self.rng.integers(2**31)),
            linearization=1,
            probing=0,
            symmetry=0,
        )
        found, _ = solve_window(self.windows, free, self.active, options, self.run.enough)
        value = math.inf if found is None else self.evaluator.objective(found)
        better = value < self.value - 1e-9
        if found is not None and value <= self.value + 1e-9:
            self.active, self.value = found, value
        return better
