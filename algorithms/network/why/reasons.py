"""Reasons without a search: what can be seen to be impossible, place by place."""

from __future__ import annotations

import dataclasses
import math
from collections import defaultdict
from dataclasses import dataclass
from typing import Optional

import numpy as np

from ..local import Term, fold, rule_terms
from ..oneway.bridges import design_bridges
from ..problem import BoolArray, NetworkProblem
from ..requirements.twoways import TwoWays
from ..structure import sink_distance, structure
from .groups import RULES

#: Required edges in contradiction that are looked for at most.
CLASHES = 50

#: Why a place has no possible street: key -> what is said of it.
CAUSES = {
    "nothing": "no street may be built there",
    "cut off": "obstacles cut it off from every sink",
    "dead end": "only a dead end leads there, and dead ends are forbidden",
    "single way": "only a single way leads there, and two ways are demanded",
}
#: Groups of rules that are the cause of it; the first two have none but the places themselves.
_RULES_OF = {"dead end": "dead_ends", "single way": "requirement:two ways"}

#: What kinds of terms are called in texts, and their groups.
_TERMS = {
    "zigzag": "zigzags",
    "too close": "too_close",
    "dead end": "dead_ends",
    "branch": "branches",
    "T-junction": "t_junctions",
}


@dataclass(frozen=True)
class Reason:
    """Something in a place that makes every design impossible.

    Attributes
    ----------
    kind
        "no sink", "uncoverable" (a vertex), "impossible required" (an edge), "clash" (required
        edges and rules), "always broken" (a rule), or the kind of a requirement that cannot be
        met.
    text
        What is wrong, for a planner.
    edges, vertices
        Mesh edges and vertices concerned.
    rules
        Groups of rules that take part (`groups.hard_groups`). Of "uncoverable" and the like the
        first is the rule that cannot be met.
    """

    kind: str
    text: str
    edges: tuple[int, ...] = ()
    vertices: tuple[int, ...] = ()
    rules: tuple[str, ...] = ()


def stock_designs(problem: NetworkProblem) -> list[BoolArray]:
    """Return designs that satisfy many rules without a search: nothing, and all that may be.

    Parameters
    ----------
    problem
        The problem.

    Returns
    -------
    list of BoolArray
        Shape (e,) each. All edges have a way to a sink.
    """
    causes = _Causes(problem)
    return [np.zeros_like(problem.candidate), *(left for _, left in causes.stages[1:])]


def usable_edges(problem: NetworkProblem) -> BoolArray:
    """Return the edges that sinks, dead ends and two ways leave to any valid design.

    Parameters
    ----------
    problem
        The problem.

    Returns
    -------
    BoolArray
        Shape (e,).
    """
    return _Causes(problem).usable


def find_reasons(problem: NetworkProblem) -> list[Reason]:
    """List what is impossible for reasons that need no search.

    Parameters
    ----------
    problem
        The problem. Soft rules are no reasons.

    Returns
    -------
    list of Reason
        None of them does not mean that the problem has a design.
    """
    if not problem.sinks.any():
        text = "There is no sink, so that nothing has a way out."
        return [Reason("no sink", text)]
    causes = _Causes(problem)
    found = _uncoverable(problem, causes) + _impossible(problem, causes)
    return found + _clashes(problem, causes)


class _Causes:
    """Why edges cannot be streets of any design.

    Attributes
    ----------
    open
        Shape (e,). Edges that may be built on and reach a sink.
    usable
        Shape (e,). Those of them that the rules on dead ends and two ways leave.
    """

    def __init__(self, problem: NetworkProblem) -> None:
        self.problem = problem
        loose = dataclasses.replace(problem, dead_ends=0.0)
        #: What is left after each cause, in order.
        self.stages: list[tuple[str, BoolArray]] = [("nothing", problem.candidate)]
        self.open = np.array(structure(loose).usable, dtype=bool)
        self.stages.append(("cut off", self.open))
        if math.isinf(problem.dead_ends):
            self.stages.append(("dead end", np.array(structure(problem).usable, dtype=bool)))
        if any(isinstance(r, TwoWays) and r.hard for r in problem.requirements):
            left = self.open & ~design_bridges(problem, self.open)
            reach = sink_distance(problem, left)
            left &= np.isfinite(reach[problem.mesh.edges]).all(axis=1)
            self.stages.append(("single way", left))
        self.usable = self.stages[-1][1]

    def of(self, edges: list[int]) -> str:
        """Return the cause that takes the last of some edges away."""
        for cause, left in self.stages:
            if not left[edges].any():
                return cause
        return ""


def _uncoverable(problem: NetworkProblem, causes: _Causes) -> list[Reason]:
    """List vertices that no street can cover."""
    if not math.isinf(problem.cover_penalty):
        return []
    around = problem.mesh.vertex_edges
    street = np.zeros(len(around), dtype=bool)
    street[problem.mesh.edges[problem.existing].ravel()] = True
    found = []
    for v, ball in problem.cover.items():
        if street[list(ball)].any():
            continue
        cause = causes.of(sorted({e for u in ball for e in around[u].tolist()}))
        if cause:
            text = f"Vertex {v} has no possible street within the coverage range: {CAUSES[cause]}."
            rules = ("coverage", *(_RULES_OF[c] for c in (cause,) if c in _RULES_OF))
            found.append(Reason("uncoverable", text, (), (v,), rules))
    return found


def _impossible(problem: NetworkProblem, causes: _Causes) -> list[Reason]:
    """List required edges that cannot be part of any network."""
    found = []
    for e in np.flatnonzero(problem.required).tolist():
        cause = "nothing" if problem.existing[e] else causes.of([e])
        if cause:
            text = (
                f"Required edge {e} cannot be part of any network with access to a sink: "
                f"{CAUSES[cause]}."
            )
            rules = ("required", *(_RULES_OF[c] for c in (cause,) if c in _RULES_OF))
            ends = tuple(problem.mesh.edges[e].tolist())
            found.append(Reason("impossible required", text, (e,), ends, rules))
    return found


def _clashes(problem: NetworkProblem, causes: _Causes) -> list[Reason]:
    """List required edges that contradict each other or a local rule, pattern or clause."""
    # what rules leave no way to is found by following these rules
    able: list[bool] = causes.open.tolist()
    terms = [
        term
        for raw in rule_terms(problem)
        if raw.hard and (term := fold(raw, problem, able)) is not None
    ]
    rules = _Propagation(terms, _group_of(problem))
    required = np.flatnonzero(problem.required & causes.usable).tolist()
    found: list[Reason] = []
    while len(found) < CLASHES:
        clash = rules.refute(required)
        if clash is None:
            break
        edges, groups = clash
        for e in list(edges):
            # fewer edges may do
            less = rules.refute([g for g in edges if g != e])
            if less is not None:
                edges, groups = less
        found.append(_clash(problem, edges, groups))
        if not edges:
            break
        required.remove(edges[-1])
    return found


def _clash(problem: NetworkProblem, edges: list[int], groups: set[str]) -> Reason:
    """Return the reason for a contradiction."""
    names = ", ".join(f"'{_name(key)}'" for key in sorted(groups))
    ends = tuple(sorted({v for e in edges for v in problem.mesh.edges[e].tolist()}))
    if not edges:
        text = f"The rules {names} cannot be met, whatever is chosen."
        return Reason("always broken", text, (), (), tuple(sorted(groups)))
    listed = ", ".join(str(e) for e in edges)
    if len(edges) == 1:
        text = f"Required edge {listed} contradicts {names}."
    else:
        text = f"Required edges {listed} together contradict {names}."
    return Reason("clash", text, tuple(edges), ends, ("required", *sorted(groups)))


def _name(key: str) -> str:
    """Return what a group is called in texts."""
    return RULES.get(key, key.partition(":")[2] or key.rstrip(":"))


def _group_of(problem: NetworkProblem) -> dict[str, str]:
    """Return the group of each kind of hard term."""
    found = dict(_TERMS)
    for pattern in problem.patterns:
        if math.isinf(pattern.weight):
            found[pattern.kind or "pattern"] = f"pattern:{pattern.kind}"
    for clause in problem.clauses:
        if math.isinf(clause.penalty):
            found[clause.kind or "clause"] = f"clause:{clause.kind}"
    return found


class _Propagation:
    """Unit propagation over hard local rules, with the reasons of what follows."""

    def __init__(self, terms: list[Term], group: dict[str, str]) -> None:
        #: Each rule: pairs (edge, whether it is on) of which one must hold, and its group.
        self.rules: list[tuple[list[tuple[int, bool]], str]] = []
        self.at: dict[tuple[int, bool], list[int]] = defaultdict(list)
        for term in terms:
            for on, off in term.alternatives:
                literals = [(e, False) for e in on] + [(e, True) for e in off]
                for e, value in literals:
                    self.at[e, not value].append(len(self.rules))
                self.rules.append((literals, group.get(term.kind, term.kind)))
        self.units = [i for i, (literals, _) in enumerate(self.rules) if len(literals) < 2]

    def refute(self, required: list[int]) -> Optional[tuple[list[int], set[str]]]:
        """Show that some edges cannot all be on.

        Returns
        -------
        tuple or None
            The edges and groups that the contradiction needs; None if none is found.
        """
        value: dict[int, bool] = dict.fromkeys(required, True)
        because: dict[int, int] = {}
        queue = list(self.units)
        queue += [i for e in required for i in self.at[e, True]]
        for i in queue:
            literals, _ = self.rules[i]
            open_ones = [a for a in literals if value.get(a[0]) is None]
            if len(open_ones) > 1 or any(value.get(e) is v for e, v in literals):
                continue
            if not open_ones:
                return self._trace(i, because, set(required))
            ((e, v),) = open_ones
            value[e], because[e] = v, i
            queue += self.at[e, v]
        return None

    def _trace(
        self, last: int, because: dict[int, int], required: set[int]
    ) -> tuple[list[int], set[str]]:
        """Follow a contradiction back to required edges."""
        edges: set[int] = set()
        groups: set[str] = set()
        seen: set[int] = {last}
        stack = [last]
        while stack:
            literals, group = self.rules[stack.pop()]
            groups.add(group)
            for e, _ in literals:
                i = because.get(e)
                if i is None:
                    edges |= {e} & required
                elif i not in seen:
                    seen.add(i)
                    stack.append(i)
        return sorted(edges), groups
