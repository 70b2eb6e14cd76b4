"""The exact objective of a set of chosen edges, and its parts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Optional

import numpy as np
from scipy.sparse import csr_matrix

from .problem import BoolArray, FloatArray, IntArray, NetworkProblem
from .requirements.base import View
from .structure import sink_distance, structure


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What a set of chosen edges costs, by part.

    Attributes
    ----------
    objective
        The sum of all parts; infinite if a hard rule is broken.
    length, distance_sum
        Length term and distance term (CND section 4.1), weighted.
    penalties
        Cost per kind of rule that is broken ("uncovered" for coverage), only where not 0.
    counts
        How often each of these is broken.
    distance
        Shape (n,). Distance to a sink in units of `NetworkProblem.length`, infinite where a
        vertex is not on the network.
    uncovered
        Vertices left without coverage.
    broken_clauses
        Indices of clauses that do not hold.
    islands
        Number of chosen edges without a way to a sink.
    missing
        Number of required edges that are not chosen.
    barred
        Number of chosen edges that are not candidates.
    """

    objective: float
    length: float
    distance_sum: float
    penalties: dict[str, float]
    counts: dict[str, int]
    distance: FloatArray
    uncovered: tuple[int, ...] = ()
    broken_clauses: tuple[int, ...] = ()
    islands: int = 0
    missing: int = 0
    barred: int = 0

    @property
    def valid(self) -> bool:
        """Whether no hard rule is broken."""
        return math.isfinite(self.objective)


@dataclass(eq=False)
class Evaluator:
    """Evaluates many designs of one problem; building it costs more than one evaluation.

    Attributes
    ----------
    problem
        The problem.
    check
        Called often while it is built; may raise an error to end that.
    """

    problem: NetworkProblem
    check: Optional[Callable[[], None]] = None
    _kinds: list[str] = field(init=False)
    _sources: IntArray = field(init=False)
    _weights: FloatArray = field(init=False)
    _starts: IntArray = field(init=False)
    _needed: IntArray = field(init=False)
    _matrix: csr_matrix = field(init=False)
    _cost: FloatArray = field(init=False)
    _street: BoolArray = field(init=False)
    _cover: list[tuple[int, tuple[int, ...]]] = field(init=False)

    def __post_init__(self) -> None:
        """Write all terms as rows of one sparse matrix."""
        index = structure(self.problem, strip=False, check=self.check)
        self._cover = index.cover
        self._cost = np.array(index.cost)
        self._street = np.array(index.street, dtype=bool)
        terms = index.terms
        self._kinds = [term.kind for term in terms]
        self._sources = np.array([term.source for term in terms], dtype=np.int64)
        self._weights = np.array([term.weight for term in terms], dtype=float)
        rows: list[int] = []
        columns: list[int] = []
        values: list[int] = []
        needed: list[int] = []
        starts: list[int] = []
        # an edge that must be off outweighs all edges that must be on
        big = len(index.ends) + 1
        for term in terms:
            starts.append(len(needed))
            for on, off in term.alternatives:
                columns += on + off
                values += [1] * len(on) + [-big] * len(off)
                rows += [len(needed)] * (len(on) + len(off))
                needed.append(len(on))
        self._starts = np.array(starts, dtype=np.int64)
        self._needed = np.array(needed, dtype=np.int64)
        self._matrix = csr_matrix(
            (values, (rows, columns)), shape=(len(needed), len(index.ends)), dtype=np.int64
        )

    def objective(self, active: BoolArray) -> float:
        """Return the objective alone; see `evaluate`."""
        return self.evaluate(active).objective

    def evaluate(self, active: BoolArray) -> Evaluation:
        """Return the exact objective of the chosen edges and its parts.

        Parameters
        ----------
        active
            Shape (e,). Chosen edges.

        Returns
        -------
        Evaluation
        """
        problem = self.problem
        edges = problem.mesh.edges
        touched = np.zeros(len(problem.mesh.vertices), dtype=bool)
        touched[edges[active].ravel()] = True
        distance = sink_distance(problem, active)
        lost = active & ~np.isfinite(distance[edges]).all(axis=1)
        counted = touched & ~problem.sinks & ~self._street
        length = float(self._cost[active].sum())
        far = float(distance[counted].sum()) if problem.weight_distance > 0 else 0.0
        distance_sum = problem.weight_distance * far
        penalties, counts, broken = self._broken(active)
        uncovered = self._uncovered(touched)
        if uncovered:
            counts["uncovered"] = len(uncovered)
            penalties["uncovered"] = problem.cover_penalty * len(uncovered)
        view = View(problem, active)
        for requirement in problem.requirements:
            count = requirement.violations(view)
            if count:
                counts[requirement.kind] = counts.get(requirement.kind, 0) + count
                cost = requirement.penalty * count
                penalties[requirement.kind] = penalties.get(requirement.kind, 0.0) + cost
        islands = int(lost.sum())
        missing = int((problem.required & ~active).sum())
        barred = int((active & ~problem.candidate).sum())
        total = length + distance_sum + math.fsum(penalties.values())
        if islands or missing or barred:
            total = math.inf
        distance = np.where(touched | self._street | problem.sinks, distance, np.inf)
        return Evaluation(
            objective=total,
            length=length,
            distance_sum=distance_sum,
            penalties=penalties,
            counts=counts,
            distance=distance,
            uncovered=uncovered,
            broken_clauses=broken,
            islands=islands,
            missing=missing,
            barred=barred,
        )

    def _broken(
        self, active: BoolArray
    ) -> tuple[dict[str, float], dict[str, int], tuple[int, ...]]:
        """Return cost per kind, count per kind and the clauses that do not hold."""
        penalties: dict[str, float] = {}
        counts: dict[str, int] = {}
        if not self._kinds:
            return penalties, counts, ()
        met = self._matrix @ active.astype(np.int64) == self._needed
        due = np.flatnonzero(np.logical_or.reduceat(met, self._starts))
        for i in due.tolist():
            kind = self._kinds[i]
            penalties[kind] = penalties.get(kind, 0.0) + float(self._weights[i])
            counts[kind] = counts.get(kind, 0) + 1
        broken = self._sources[due]
        return penalties, counts, tuple(broken[broken >= 0].tolist())

    def _uncovered(self, touched: BoolArray) -> tuple[int, ...]:
        """Return the vertices of which no covering vertex is active."""
        on = touched.tolist()
        return tuple(v for v, ball in self._cover if not any(on[u] for u in ball))


def evaluate(problem: NetworkProblem, active: BoolArray) -> Evaluation:
    """Evaluate one design; see `Evaluator.evaluate`."""
    return Evaluator(problem).evaluate(active)
