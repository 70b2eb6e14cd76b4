"""The stochastic search that CND compares itself with (section 5.4), as a baseline; not to be used.

From the network of all edges, each step lists the operations that leave the network feasible,
ranks them by the objective that they lead to, and does one: the better its rank the likelier,
and more so with each step. Operations delete one edge, two adjacent or three consecutive ones, or
add one. A pass ends where the best operation would make things worse; then another one begins,
until time is up, and the best network of all passes is kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Optional

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from ...errors import CancelledError, InfeasibleError, InputError
from ...progress import Deadline, Progress
from ..evaluate import Evaluator
from ..incumbent import Incumbent
from ..problem import BoolArray, Design, FloatArray, IntArray, NetworkProblem
from ..structure import sink_distance, structure

#: What a broken hard rule counts in the ranking: a network of all edges breaks many.
HARD = 6.0
#: Mean rank of the operation that is done, at first; share of it that is left after each step; and
#: below which the best one is done.
FIRST_RANK, COOLING, FROZEN = 1.5, 0.98, 0.05


def anneal(
    problem: NetworkProblem,
    *,
    time_limit: float,
    seed: int = 1,
    passes: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> Design:
    """Design a network by the paper's stochastic search (CND section 5.4, figure 12).

    Parameters
    ----------
    problem
        What is asked; without requirements of the network as a whole.
    time_limit
        Seconds of wall time.
    seed
        Seed of all choices: with `passes` the same seed gives the same design, as long as the time
        limit is not reached first.
    passes
        Number of passes after which to stop; None for no limit.
    progress
        Told incumbents, asked for cancellation.

    Returns
    -------
    Design
        The best network of all passes that keeps every hard rule, with its history. Nothing is
        proven: the bound is that of the costs nobody can avoid.

    Raises
    ------
    InputError
        Something is required of the network as a whole.
    InfeasibleError
        No pass found a valid network in time, or the network of all edges is none to begin with.
    CancelledError
        The run was cancelled before there was any design.
    """
    if problem.requirements:
        raise InputError(
            "The stochastic search knows no requirements of the network as a whole.",
            "Leave out links, budgets and the like, or use the integer program.",
        )
    deadline = Deadline(time_limit, progress)
    index = structure(problem)
    run = Incumbent(Evaluator(problem), deadline, progress=progress)
    run.raise_bound(index.fixed)
    steps = _Steps(problem, run.evaluator)
    rng = np.random.default_rng(seed)
    done = 0
    while not deadline.passed() and (passes is None or done < passes):
        _anneal_once(steps, run, rng)
        done += 1
    if run.best is None:
        if run.cancelled():
            msg = "The run was cancelled before a first design was found."
            raise CancelledError(msg)
        msg = f"The stochastic search found no valid network in {deadline.elapsed:.0f} s."
        raise InfeasibleError(msg)
    run.report()
    return run.design()


def _anneal_once(steps: _Steps, run: Incumbent, rng: np.random.Generator) -> None:
    """Make one pass from the network of all edges."""
    active = steps.candidate.copy()
    rank = FIRST_RANK
    value = steps.value(active)
    while not run.deadline.passed():
        offers = steps.offers(active)
        # from 0; the mean of the drawn numbers is about `rank`
        wanted = 0 if rank < FROZEN else int(rng.geometric(1.0 / (1.0 + rank))) - 1
        found = steps.pick(active, offers, wanted)
        if found is None:
            return
        chosen, after = found
        if rank < FROZEN and after >= value - 1e-9:
            return
        value = after
        active[list(steps.edges[chosen])] = bool(steps.adds[chosen])
        if steps.broken(active) == 0:
            run.take(active)
            run.report()
        rank *= COOLING


@dataclass(eq=False)
class _Steps:
    """All operations on the networks of a problem, with what each changes.

    Attributes
    ----------
    problem
        The problem.
    evaluator
        Its terms.
    candidate
        Shape (e,). The edges of the first network.
    edges, adds
        Edges of each operation, and whether they are added.
    """

    problem: NetworkProblem
    evaluator: Evaluator
    candidate: BoolArray = field(init=False)
    edges: list[tuple[int, ...]] = field(init=False)
    adds: BoolArray = field(init=False)

    def __post_init__(self) -> None:
        """Write operations, terms and coverage as sparse matrices."""
        problem, judge = self.problem, self.evaluator
        self.candidate = _reachable(problem)
        paths = _paths(problem, self.candidate & ~problem.required)
        singles = [(int(e),) for e in np.flatnonzero(self.candidate)]
        self.edges = [*paths, *singles]
        self.adds = np.arange(len(self.edges)) >= len(paths)
        rows = np.repeat(np.arange(len(self.edges)), [len(one) for one in self.edges])
        columns = np.array([e for one in self.edges for e in one], dtype=np.int64)
        sign = np.where(self.adds, 1, -1)[rows]
        shape = (len(self.edges), len(problem.length))
        self._moves = csr_matrix((sign, (rows, columns)), shape=shape)
        weights = judge._weights
        self._hard = np.isinf(weights)
        self._price = np.where(self._hard, HARD, weights)
        # each operation, the terms that it touches, and all alternatives of these
        self._change = (self._moves @ judge._matrix.T).tocsr()
        self._term = np.repeat(
            np.arange(len(weights)), np.diff([*judge._starts, len(judge._needed)])
        )
        self._single = len(judge._needed) == len(weights)
        ends = np.zeros((len(problem.mesh.vertices), len(problem.length)), dtype=np.int8)
        ends[problem.mesh.edges.T, np.arange(len(problem.length))] = 1
        self._ends = csr_matrix(ends)
        self._lift = (self._moves @ self._ends.T).tocsr()
        keys = [vertex for vertex, _ in judge._cover]
        ball = np.zeros((len(keys), len(problem.mesh.vertices)), dtype=np.int8)
        for row, (_, near) in enumerate(judge._cover):
            ball[row, list(near)] = 1
        self._balls = csr_matrix(ball)
        self._length = self._moves @ np.where(self.candidate, judge._cost, 0.0)

    def value(self, active: BoolArray) -> float:
        """Return what a network costs in the ranking."""
        met = self._met(self.evaluator._matrix @ active.astype(np.int64))
        far = self._far(active)
        return float(self.evaluator._cost[active].sum() + self._price[met].sum() + far)

    def broken(self, active: BoolArray) -> int:
        """Return how many hard rules a network breaks."""
        met = self._met(self.evaluator._matrix @ active.astype(np.int64))
        return int((met & self._hard).sum())

    def offers(self, active: BoolArray) -> tuple[IntArray, FloatArray]:
        """Return the operations that keep what is kept, and what each would cost, best first."""
        state = active.astype(np.int64)
        sums = self._moves @ state
        sizes = np.diff(self._moves.indptr)
        able = np.where(self.adds, sums == 0, sums == -sizes)
        able &= self._covered(active)
        change, hard = self._due(state)
        # hard rules that are kept stay kept: their number may fall, never rise
        able &= hard <= 0
        numbers = np.flatnonzero(able)
        values = self.value(active) + (self._length + change)[numbers]
        if self.problem.weight_distance > 0:
            values += self._farther(active, numbers)
        order = np.lexsort((numbers, values))
        order = order[np.isfinite(values[order])]
        return numbers[order], values[order]

    def pick(
        self, active: BoolArray, offers: tuple[IntArray, FloatArray], wanted: int
    ) -> Optional[tuple[int, float]]:
        """Return the operation of a rank among those that leave no street without a way out."""
        best: Optional[tuple[int, float]] = None
        for number, value in zip(offers[0].tolist(), offers[1].tolist()):
            if not self._connected(active, number):
                continue
            best = (number, value)
            if wanted == 0:
                return best
            wanted -= 1
        return best

    def _met(self, counts: IntArray) -> BoolArray:
        """Return which terms are due."""
        judge = self.evaluator
        if not len(judge._needed):
            return np.zeros(0, dtype=np.bool_)
        return np.asarray(np.logical_or.reduceat(counts == judge._needed, judge._starts))

    def _due(self, state: IntArray) -> tuple[FloatArray, IntArray]:
        """Return by how much each operation changes the price of terms, and the hard ones broken.

        Alternatives of one term exclude each other or not; a term is due once.
        """
        judge, change = self.evaluator, self._change
        now = judge._matrix @ state
        before = (now == judge._needed).astype(np.int64)
        after = (now[change.indices] + change.data) == judge._needed[change.indices]
        shift = csr_matrix(
            (after.astype(np.int64) - before[change.indices], change.indices, change.indptr),
            shape=change.shape,
        )
        count = len(self._price)
        if self._single:
            turned = shift
        else:
            gather = csr_matrix(
                (
                    np.ones(len(self._term), dtype=np.int64),
                    (np.arange(len(self._term)), self._term),
                ),
                shape=(len(self._term), count),
            )
            turned = (shift @ gather).tocsr()
            held = np.bincount(self._term, weights=before, minlength=count)[turned.indices]
            turned.data = (held + turned.data > 0).astype(np.int64) - (held > 0)
        return turned @ self._price, turned @ self._hard.astype(np.int64)

    def _covered(self, active: BoolArray) -> BoolArray:
        """Return which operations leave every place covered that is covered now."""
        degree = self._ends @ active.astype(np.int64)
        lift = self._lift
        gone = (degree[lift.indices] > 0) & (degree[lift.indices] + lift.data == 0)
        lost = csr_matrix((gone.astype(np.int64), lift.indices, lift.indptr), shape=lift.shape)
        less = (lost @ self._balls.T).tocsr()
        kept = self._balls @ (degree > 0).astype(np.int64)
        bare = (less.data > 0) & (less.data >= kept[less.indices])
        worse = csr_matrix((bare.astype(np.int64), less.indices, less.indptr), shape=less.shape)
        worse.eliminate_zeros()
        return np.asarray(np.diff(worse.indptr) == 0, dtype=np.bool_)

    def _after(self, active: BoolArray, number: int) -> BoolArray:
        after = active.copy()
        after[list(self.edges[number])] = bool(self.adds[number])
        return after

    def _connected(self, active: BoolArray, number: int) -> bool:
        """Tell whether every street leads out after an operation."""
        after = self._after(active, number)
        return _leads_out(self.problem, after)

    def _far(self, active: BoolArray) -> float:
        """Return the distance term of a network, infinite where a street leads nowhere."""
        if self.problem.weight_distance == 0:
            return 0.0
        touched = (self._ends @ active.astype(np.int64)) > 0
        counted = touched & ~self.problem.sinks & ~self.evaluator._street
        distance = sink_distance(self.problem, active)[counted]
        return self.problem.weight_distance * float(distance.sum())

    def _farther(self, active: BoolArray, numbers: IntArray) -> FloatArray:
        """Return by how much operations change the distance term."""
        now = self._far(active)
        return np.array([self._far(self._after(active, i)) - now for i in numbers.tolist()])


def _leads_out(problem: NetworkProblem, active: BoolArray) -> bool:
    """Tell whether every chosen edge has a way to a sink."""
    part, out = _parts(problem, active)
    return bool((part[problem.mesh.edges[active, 0]] == out).all())


def _parts(problem: NetworkProblem, active: BoolArray) -> tuple[IntArray, int]:
    """Return the connected part of each vertex, and that of the sinks."""
    count = len(problem.mesh.vertices)
    u, v = problem.mesh.edges[active | problem.existing].T
    sinks = np.flatnonzero(problem.sinks)
    rows, columns = np.concatenate([u, sinks]), np.concatenate([v, np.full(len(sinks), count)])
    graph = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(count + 1, count + 1))
    part = connected_components(graph, directed=False)[1]
    return part, int(part[count])


def _reachable(problem: NetworkProblem) -> BoolArray:
    """Return the candidate edges that lead out when all are chosen."""
    part, out = _parts(problem, problem.candidate)
    leads: BoolArray = part[problem.mesh.edges[:, 0]] == out
    return problem.candidate & leads


def _paths(problem: NetworkProblem, usable: BoolArray) -> list[tuple[int, ...]]:
    """Return all paths of one to three edges, each once, in their order."""
    ends = problem.mesh.edges.tolist()
    around = [[e for e in edges.tolist() if usable[e]] for edges in problem.mesh.vertex_edges]
    found: set[tuple[int, ...]] = set()
    for middle in np.flatnonzero(usable).tolist():
        found.add((middle,))
        u, v = ends[middle]
        left = [e for e in around[u] if e != middle]
        right = [e for e in around[v] if e != middle]
        found |= {tuple(sorted((middle, e))) for e in (*left, *right)}
        found |= {tuple(sorted((a, middle, b))) for a in left for b in right if a != b}
    return sorted(found, key=lambda path: (len(path), path))


def best_at(design: Design, seconds: float) -> float:
    """Return the objective that a search knew after some seconds; infinite if it had none."""
    return min((value for when, value in design.history if when <= seconds), default=math.inf)
