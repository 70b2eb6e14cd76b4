"""Junctions that keep a distance from each other along the street."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csr_matrix

from ...errors import InputError
from .base import Requirement
from .units import (
    MILLIMETRES,
    check_lengths,
    check_number,
    check_penalty,
    whole_limit,
    whole_parts,
)

if TYPE_CHECKING:
    from ..cp.model import CpNetwork, Literal
    from ..mip.model import NetworkModel
    from ..problem import BoolArray, FloatArray, IntArray, NetworkProblem
    from .base import View

#: Most ways between two vertices that are looked at; three edges far on a mesh of 20,000 edges.
MOST_WAYS = 300_000


@dataclass(frozen=True)
class _Pair:
    """Two vertices and the ways between them that are too short, as edges."""

    ends: tuple[int, int]
    ways: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False)
class JunctionSpacing(Requirement):
    """Two junctions are at least so many metres apart along the street.

    A junction is a vertex where three or more streets meet, existing ones included. A pair of
    junctions is a violation, once, if a way from one to the other over streets is shorter than
    the spacing; lengths count in whole millimetres. What existing streets alone break is no
    violation. Streets outside the mesh are not known here.

    Attributes
    ----------
    ends
        Shape (e, 2). The vertices of each mesh edge.
    lengths
        Shape (e,). Length of each mesh edge in metres.
    spacing
        Metres.
    penalty
        Cost of each violation; infinite forbids.
    kind
        See `Requirement`.

    Raises
    ------
    InputError
        If a number makes no sense or the spacing is many mesh edges long.
    """

    ends: IntArray
    lengths: FloatArray
    spacing: float
    penalty: float = math.inf
    kind: str = "junction spacing"

    def __post_init__(self) -> None:
        """Check the numbers and list the pairs."""
        check_penalty(self.penalty, "Junction spacing")
        check_lengths(self.lengths, "Junction spacing")
        check_number(self.spacing, "The junction spacing", strict=True)
        if self._pairs is None:
            typical = float(np.median(self.lengths))
            raise InputError(
                f"A junction spacing of {self.spacing:g} m is too much for a mesh of "
                f"{len(self.lengths)} edges of {typical:.3g} m: there are more than {MOST_WAYS} "
                "ways that short.",
                "Ask for a spacing of at most three mesh edges, or take a coarser mesh.",
            )

    def violations(self, view: View) -> int:
        """Return the number of pairs that are too near, but for those that were so before."""
        return len(self._broken(view))

    def _broken(self, view: View) -> set[int]:
        """Return the numbers of the pairs that are violations."""
        existing = view.problem.existing
        return self._near(view.active | existing) - self._near(existing)

    def places(self, view: View) -> Sequence[int]:
        """Return the junctions that are too near to another."""
        return sorted({v for i in self._broken(view) for v in self._pair(i).ends})

    def add_to_cp(self, network: CpNetwork) -> None:
        """Forbid or price two junction literals and a way between them, for each pair."""
        numbers = {i for v in network.vertices for i in self._at_vertex[v]}
        junction: dict[int, Literal] = {}
        off: dict[int, Literal] = {}
        problem = network.index.problem
        for i in sorted(numbers - self._near(problem.existing)):
            pair = self._pair(i)
            for e in {e for way in pair.ways for e in way if e not in off}:
                off[e] = not problem.existing[e] and network.negated(network.literal(e))
            ways = [[off[e] for e in way] for way in pair.ways]
            ways = [way for way in ways if not any(x is True for x in way)]
            if not ways:
                continue
            for v in pair.ends:
                if v not in junction:
                    junction[v] = self._cp_junction(network, v)
            both = [network.negated(junction[v]) for v in pair.ends]
            if any(literal is True for literal in both):
                continue
            due: Literal = False
            if not self.hard:
                due = network.model.new_bool_var("")
                network.cost(due, self.penalty)
            for way in ways:
                network.clause([due, *both, *way])

    def _cp_junction(self, network: CpNetwork, v: int) -> Literal:
        """Return a literal that holds if three or more streets meet."""
        problem = network.index.problem
        known = int(problem.existing[problem.mesh.vertex_edges[v]].sum())
        mine = [network.literal(e) for e in network.index.incident[v]]
        xs = [x for x in mine if not isinstance(x, bool)]
        missing = 3 - known - sum(x is True for x in mine)
        if missing <= 0:
            return True
        if missing > len(xs):
            return False
        if missing == 1 and len(xs) == 1:
            return xs[0]
        literal: Literal = network.model.new_bool_var("")
        for group in itertools.combinations(xs, missing):
            network.clause([literal, *(network.negated(x) for x in group)])
        return literal

    def add_to_mip(self, model: NetworkModel) -> None:
        """Write the same as rows: junctions and pairs are at least what edges make of them."""
        index, linear = model.index, model.linear
        problem = index.problem
        junction = {v: self._mip_junction(model, v) for v in range(len(index.incident))}
        for i in sorted(set(range(len(self._pairs or ()))) - self._near(problem.existing)):
            pair = self._pair(i)
            both = [junction[v] for v in pair.ends]
            if any(j is None for j in both):
                continue
            due = None
            for way in pair.ways:
                if not all(e in model.edge or problem.existing[e] for e in way):
                    continue
                row = [model.edge[e] for e in way if e in model.edge]
                # an edge may be what makes its end a junction
                row += [j for j in both if j is not True and all(j is not x for x in row)]
                if not self.hard and due is None:
                    due = linear.real(1.0, self.penalty)
                parts = [(variable, -1.0) for variable in row]
                if due is not None:
                    parts.append((due, 1.0))
                linear.row(parts, low=1.0 - len(row))

    def _mip_junction(self, model: NetworkModel, v: int) -> Any:
        """Return a variable that is 1 if three or more streets meet; True and None if decided."""
        problem = model.index.problem
        missing = 3 - int(problem.existing[problem.mesh.vertex_edges[v]].sum())
        xs = [model.edge[e] for e in model.index.incident[v]]
        if missing <= 0:
            return True
        if missing > len(xs):
            return None
        if missing == 1 and len(xs) == 1:
            return xs[0]
        variable = model.linear.real(1.0)
        for group in itertools.combinations(xs, missing):
            row = [(variable, 1.0), *((x, -1.0) for x in group)]
            model.linear.row(row, low=1.0 - missing)
        return variable

    @cached_property
    def _pairs(self) -> tuple[_Pair, ...] | None:
        """The pairs of vertices with a way between them that is too short; None: too many."""
        found = short_ways(self.ends, self.lengths, self.spacing)
        if found is None:
            return None
        return tuple(_Pair(pair, tuple(ways)) for pair, ways in sorted(found.items()))

    def _pair(self, i: int) -> _Pair:
        """Return a pair by its number."""
        return (self._pairs or ())[i]

    @cached_property
    def _at_vertex(self) -> dict[int, list[int]]:
        """Numbers of the pairs of which an end or a way touches each vertex."""
        found: dict[int, list[int]] = defaultdict(list)
        ends = self.ends.tolist()
        for i, pair in enumerate(self._pairs or ()):
            for v in {v for way in pair.ways for e in way for v in ends[e]}:
                found[v].append(i)
        return found

    @cached_property
    def _matrix(self) -> tuple[csr_matrix, IntArray, IntArray]:
        """Ways by edges, the length of each way in edges, and the number of its pair."""
        rows: list[int] = []
        columns: list[int] = []
        sizes: list[int] = []
        owner: list[int] = []
        for i, pair in enumerate(self._pairs or ()):
            for way in pair.ways:
                rows += [len(sizes)] * len(way)
                columns += way
                sizes.append(len(way))
                owner.append(i)
        shape = (len(sizes), len(self.lengths))
        matrix = csr_matrix((np.ones(len(rows), dtype=np.int64), (rows, columns)), shape=shape)
        return matrix, np.array(sizes, dtype=np.int64), np.array(owner, dtype=np.int64)

    @cached_property
    def _corners(self) -> IntArray:
        """Shape (pairs, 2). The vertices of each pair."""
        return np.array([pair.ends for pair in self._pairs or ()], dtype=np.int64).reshape(-1, 2)

    def _near(self, streets: BoolArray) -> set[int]:
        """Return the numbers of the pairs of junctions that are too near."""
        matrix, sizes, owner = self._matrix
        degree = np.bincount(self.ends[streets].ravel(), minlength=int(self.ends.max()) + 1)
        able = (degree >= 3)[self._corners].all(axis=1)
        met = (matrix @ streets.astype(np.int64) == sizes) & able[owner]
        return set(owner[met].tolist())


def junction_spacing(
    problem: NetworkProblem, lengths: FloatArray, spacing: float, penalty: float = math.inf
) -> JunctionSpacing:
    """Return a `JunctionSpacing` for the mesh of a problem.

    Parameters
    ----------
    problem
        Tells the mesh.
    lengths, spacing, penalty
        See `JunctionSpacing`.
    """
    return JunctionSpacing(problem.mesh.edges, lengths, spacing, penalty)


def short_ways(
    ends: IntArray, lengths: FloatArray, limit: float
) -> dict[tuple[int, int], list[tuple[int, ...]]] | None:
    """List all ways without a vertex twice that are shorter than a limit.

    Parameters
    ----------
    ends
        Shape (e, 2). The vertices of each edge.
    lengths
        Shape (e,). Metres.
    limit
        Metres.

    Returns
    -------
    dict or None
        (u, v) with u < v -> ways, each as edges from u to v; None if they are more than
        `MOST_WAYS`.

    Examples
    --------
    >>> square = np.array([[0, 1], [1, 2], [2, 3], [0, 3]])
    >>> short_ways(square, np.ones(4), 2.5)[0, 2]
    [(0, 1), (3, 2)]
    """
    steps: list[int] = whole_parts(lengths, MILLIMETRES).tolist()
    top = whole_limit(limit, MILLIMETRES)
    around: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for e, (u, v) in enumerate(ends.tolist()):
        if steps[e] < top:
            around[u].append((e, v))
            around[v].append((e, u))
    found: dict[tuple[int, int], list[tuple[int, ...]]] = defaultdict(list)
    count = 0
    for first in sorted(around):
        stack: list[tuple[int, int, tuple[int, ...], tuple[int, ...]]] = [(first, 0, (), (first,))]
        while stack:
            v, far, way, seen = stack.pop()
            if v > first:
                found[first, v].append(way)
                count += 1
                if count > MOST_WAYS:
                    return None
            for e, w in reversed(around[v]):
                if w not in seen and far + steps[e] < top:
                    stack.append((w, far + steps[e], (*way, e), (*seen, w)))
    return dict(found)
