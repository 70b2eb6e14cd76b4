"""From designs that break what is asked of the whole network to designs that keep it."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from ..cp.sat import CpOptions
from ..evaluate import Evaluator
from ..incumbent import Incumbent
from ..problem import BoolArray, NetworkProblem
from ..requirements.base import View
from ..requirements.linkrepair import repair as repair_links
from ..requirements.links import Link
from ..structure import Structure, structure
from .starts import prune, straight_designs
from .windows import Windows, solve_window

#: Radii of windows, in edges, that are tried in turn where the smaller ones do not help.
RADII = (4, 5, 6, 7)
#: Bounds of the number of windows without improvement before the next radius.
LEAST, MOST = 6.0, 40.0
#: Effort of one window, in CP-SAT's deterministic units.
EFFORT = 0.1
#: How far, in edges, a window reaches beyond what repaired links broke, and in how many designs
#: that is tried, those with the fewest broken places first.
REACHES, DESIGNS = (2, 3, 4), 2


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


def has_links(problem: NetworkProblem) -> bool:
    """Tell whether a problem asks for links that must be."""
    return any(isinstance(r, Link) and r.hard for r in problem.requirements)


def repaired_starts(run: Incumbent, index: Structure, seed: int) -> list[BoolArray]:
    """Design without requirements, then mend what that breaks of them.

    Links are mended at once, by ways along the mesh (`requirements.linkrepair`), and what they
    break by a small window. Only where no design is at hand yet windows mend the rest.

    Parameters
    ----------
    run
        Takes the designs; tells when to stop.
    index
        The problem.
    seed
        Seed of the random choices.

    Returns
    -------
    list of BoolArray
        Valid designs, best first; each shape (e,). None proves nothing.
    """
    if run.best is not None or not any(r.hard for r in index.problem.requirements):
        return []
    links = has_links(index.problem)
    plain = dataclasses.replace(index.problem, requirements=())
    bare = structure(plain)
    if bare.conflicts:
        return []
    trial = Incumbent(Evaluator(plain), run.deadline, progress=None)
    pool: list[tuple[float, BoolArray]] = []
    broken: list[BoolArray] = []
    for straight in straight_designs(trial, bare):
        if run.enough():
            break
        less = prune(bare, trial.evaluator, straight, run)
        trial.take(less)
        mended = repair_links(index, less, run.wanted()) if links else less
        value = run.evaluator.objective(mended)
        if math.isfinite(value):
            run.take(mended)
            run.report()
            pool.append((value, mended))
        elif links:
            broken += [mended, repair_links(index, straight, run.wanted())]
    if run.best is None and broken:
        mend_by_window(run, index, broken, seed)
    if run.best is None and trial.best is not None:
        repair(run, trial.best, seed)
    return [active for _, active in sorted(pool, key=lambda entry: entry[0])]


def broken_places(index: Structure, active: BoolArray) -> list[int]:
    """Return the vertices at which a design breaks hard local rules, in order."""
    on = active.tolist()
    found: set[int] = set()
    for term in index.terms:
        for chosen, left in term.alternatives if term.hard else ():
            if all(on[e] for e in chosen) and not any(on[e] for e in left):
                found |= {v for e in (*chosen, *left) for v in index.ends[e]}
    return sorted(found)


def mend_by_window(run: Incumbent, index: Structure, designs: list[BoolArray], seed: int) -> bool:
    """Choose the streets around all broken places of a design anew; return whether that did."""
    windows = Windows(index, run.wanted())
    few = sorted(designs, key=lambda active: len(broken_places(index, active)))[:DESIGNS]
    for reach in REACHES:
        for active in few:
            free = windows.near(broken_places(index, active), reach)
            if run.enough():
                return False
            if not free:
                continue
            options = CpOptions(
                run.deadline.left, EFFORT, seed, linearization=0, probing=0, symmetry=0
            )
            found, _ = solve_window(windows, free, active, options, run.enough, distances="least")
            if found is not None and run.take(found):
                return True
    return False


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
            if not order:
                # no edge is to be decided
                return False
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
