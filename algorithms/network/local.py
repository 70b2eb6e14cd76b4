"""Local features of a network as data on the mesh (CND section 4.3).

Every local rule becomes *terms*: a cost that is due once when at least one of several
alternatives holds, an alternative being "these edges are chosen and those are not".
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Optional

from ..mesh.quadmesh import QuadMesh
from .problem import NetworkProblem

#: Edges that must be chosen and edges that must not be.
Alternative = tuple[tuple[int, ...], tuple[int, ...]]


@dataclass(frozen=True)
class Term:
    """A cost due once when any of the alternatives holds; infinite forbids them all.

    Attributes
    ----------
    kind
        What the term stands for, for example "zigzag".
    weight
        Cost, greater than 0.
    alternatives
        Pairs (on, off) of edge indices.
    source
        Index of the clause that the term comes from, or -1.
    """

    kind: str
    weight: float
    alternatives: tuple[Alternative, ...]
    source: int = -1

    @property
    def hard(self) -> bool:
        """Whether the term forbids."""
        return math.isinf(self.weight)


def zigzag_triples(mesh: QuadMesh) -> list[tuple[int, int, int]]:
    """List the zigzags of a mesh: three edges with two opposite turns over the middle one.

    Parameters
    ----------
    mesh
        The candidate mesh.

    Returns
    -------
    list of tuple
        For each inner edge between faces A and B, A's other edge at one end, the edge, B's
        other edge at the other end; and the mirror image. Each once, outer edges ascending.

    Examples
    --------
    >>> from ..mesh.grids import grid
    >>> len(zigzag_triples(grid(2, 1)))
    2
    """
    found: set[tuple[int, int, int]] = set()
    sides = mesh.face_edges.tolist()
    for half, twin in enumerate(mesh.twins.tolist()):
        if twin < half:  # on the boundary (-1), or already seen from the other face
            continue
        (f, k), (g, j) = divmod(half, 4), divmod(twin, 4)
        middle = sides[f][k]
        for step in (-1, 1):
            first, last = sides[f][(k + step) % 4], sides[g][(j + step) % 4]
            if first != last:
                found.add((min(first, last), middle, max(first, last)))
    return sorted(found)


def close_pairs(mesh: QuadMesh) -> list[tuple[int, int]]:
    """List the pairs of opposite edges of the quads, ascending, each once."""
    pairs = mesh.opposite_pairs().tolist()
    return sorted({(min(a, b), max(a, b)) for a, b in pairs if a != b})


def t_junctions(mesh: QuadMesh) -> list[tuple[tuple[int, ...], int]]:
    """List the T-junctions: three edges of a valence-4 vertex on, the fourth off (CND eq. 13)."""
    return [
        (tuple(e for e in around if e != missing), missing)
        for around in (edges.tolist() for edges in mesh.vertex_edges)
        if len(around) == 4
        for missing in around
    ]


def rule_terms(problem: NetworkProblem) -> Iterator[Term]:
    """Yield a term for every place where a local rule, pattern or clause may cost something.

    Rules with weight 0 yield nothing. Alternatives are given in terms of all mesh edges; see
    `fold` for what existing and barred edges make of them.
    """
    mesh = problem.mesh
    if problem.zigzags > 0:
        for triple in zigzag_triples(mesh):
            yield from _among_candidates(problem, "zigzag", problem.zigzags, triple)
    if problem.too_close > 0:
        for pair in close_pairs(mesh):
            yield from _among_candidates(problem, "too close", problem.too_close, pair)
    yield from _vertex_terms(problem)
    for pattern in problem.patterns:
        if pattern.weight > 0:
            alternative = (tuple(pattern.on), tuple(pattern.off))
            yield Term(pattern.kind or "pattern", pattern.weight, (alternative,))
    for index, clause in enumerate(problem.clauses):
        if clause.penalty > 0:
            alternative = ((), tuple(clause.edges))
            yield Term(clause.kind or "clause", clause.penalty, (alternative,), index)


def _among_candidates(
    problem: NetworkProblem, kind: str, weight: float, edges: tuple[int, ...]
) -> Iterator[Term]:
    """Yield the term "all of `edges` chosen"; existing edges are exempt."""
    if all(problem.candidate[e] for e in edges):
        yield Term(kind, weight, ((edges, ()),))


def _vertex_terms(problem: NetworkProblem) -> Iterator[Term]:
    """Yield dead ends, branches and T-junctions at vertices without existing streets."""
    mesh = problem.mesh
    for v, around in enumerate(edges.tolist() for edges in mesh.vertex_edges):
        if any(problem.existing[e] for e in around):
            continue
        mine = [e for e in around if problem.candidate[e]]
        if problem.t_junctions > 0 and len(around) == 4 and len(mine) >= 3:
            threes = tuple(
                (three, tuple(e for e in mine if e not in three))
                for three in itertools.combinations(mine, 3)
            )
            yield Term("T-junction", problem.t_junctions, threes)
        if problem.sinks[v]:
            continue
        if problem.dead_ends > 0:
            for e in mine:
                others = tuple(g for g in mine if g != e)
                yield Term("dead end", problem.dead_ends, (((e,), others),))
        if problem.branches > 0 and len(mine) >= 3:
            triples = tuple((three, ()) for three in itertools.combinations(mine, 3))
            yield Term("branch", problem.branches, triples)


def fold(term: Term, problem: NetworkProblem, usable: list[bool]) -> Optional[Term]:
    """Remove from a term what is decided: existing edges are on, unusable ones are off.

    Parameters
    ----------
    term
        As `rule_terms` yields it.
    problem
        Tells the existing edges.
    usable
        For each edge, whether it may be chosen.

    Returns
    -------
    Term or None
        The term over usable edges only, or None if it can never be due. An alternative
        without any edge left means that it always is.
    """
    kept: list[Alternative] = []
    for on, off in term.alternatives:
        if any(not usable[e] and not problem.existing[e] for e in on):
            continue
        if any(problem.existing[e] for e in off):
            continue
        left_on = tuple(sorted({e for e in on if usable[e]}))
        left_off = tuple(sorted({e for e in off if usable[e]}))
        if not set(left_on) & set(left_off):
            kept.append((left_on, left_off))
    return Term(term.kind, term.weight, tuple(kept), term.source) if kept else None
