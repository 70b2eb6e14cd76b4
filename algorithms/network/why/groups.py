"""The hard rules of a problem in groups that a planner can give up, and what is left then."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection
from typing import Any

import numpy as np

from ..checks.facts import Violation
from ..checks.validation import check_design
from ..problem import BoolArray, Clause, NetworkProblem

#: Cost of a violation where a group may be broken.
SOFT = 1.0

#: What each local rule is called in texts.
RULES = {
    "dead_ends": "no dead ends",
    "branches": "no branches",
    "zigzags": "no zigzags",
    "too_close": "no streets too close to each other",
    "t_junctions": "no T-junctions",
}

#: Kind of a violation (`validation.check_design`) -> group, for kinds that are no names of
#: clauses, patterns or requirements.
_KINDS = {
    "uncovered": "coverage",
    "dead end": "dead_ends",
    "branch": "branches",
    "zigzag": "zigzags",
    "too close": "too_close",
    "T-junction": "t_junctions",
    "required": "required",
}


def hard_groups(problem: NetworkProblem) -> dict[str, str]:
    """List the groups of hard rules that a problem has.

    Connection to the sinks and forbidden places are no groups: they cannot be given up.

    Parameters
    ----------
    problem
        The problem.

    Returns
    -------
    dict
        Key -> text for a planner. Keys are "coverage", the names of the local rules as fields
        of `NetworkProblem`, "required", and "clause:", "pattern:" and "requirement:", each
        followed by a kind.
    """
    found: dict[str, str] = {}
    if problem.cover and math.isinf(problem.cover_penalty):
        reach = problem.cover_radius
        found["coverage"] = "coverage" if reach is None else f"coverage within {reach} edges"
    for name, text in RULES.items():
        if math.isinf(getattr(problem, name)):
            found[name] = text
    if problem.required.any():
        found["required"] = "required streets"
    for clause in problem.clauses:
        if math.isinf(clause.penalty):
            found[f"clause:{clause.kind}"] = clause.kind or "clauses"
    for pattern in problem.patterns:
        if math.isinf(pattern.weight):
            found[f"pattern:{pattern.kind}"] = pattern.kind or "patterns"
    for requirement in problem.requirements:
        if requirement.hard:
            found[f"requirement:{requirement.kind}"] = requirement.kind
    return found


def regroup(
    problem: NetworkProblem, kept: Collection[str], soft: Collection[str] = ()
) -> NetworkProblem:
    """Return a problem of some groups of hard rules alone; nothing else costs anything.

    Parameters
    ----------
    problem
        The problem.
    kept
        Groups that stay hard.
    soft
        Groups of which every violation costs 1. All other rules are left out.

    Returns
    -------
    NetworkProblem
    """

    def weight(key: str) -> float:
        return math.inf if key in kept else SOFT if key in soft else 0.0

    def wanted(key: str, penalty: float) -> bool:
        return math.isinf(penalty) and weight(key) > 0

    clauses = [
        dataclasses.replace(c, penalty=weight(f"clause:{c.kind}"))
        for c in problem.clauses
        if wanted(f"clause:{c.kind}", c.penalty)
    ]
    if "required" in soft:
        clauses += _wishes(problem)
    fields: dict[str, Any] = {
        name: weight(name) if math.isinf(getattr(problem, name)) else 0.0 for name in RULES
    }
    covers = wanted("coverage", problem.cover_penalty)
    none = np.zeros_like(problem.required)
    return dataclasses.replace(
        problem,
        weight_length=0.0,
        weight_distance=0.0,
        cover=problem.cover if covers else {},
        cover_penalty=weight("coverage") if covers else 0.0,
        required=problem.required if "required" in kept else none,
        clauses=tuple(clauses),
        patterns=tuple(
            dataclasses.replace(p, weight=weight(f"pattern:{p.kind}"))
            for p in problem.patterns
            if wanted(f"pattern:{p.kind}", p.weight)
        ),
        requirements=tuple(
            dataclasses.replace(r, penalty=weight(f"requirement:{r.kind}"))  # type: ignore[type-var]
            for r in problem.requirements
            if wanted(f"requirement:{r.kind}", r.penalty)
        ),
        **fields,
    )


def _wishes(problem: NetworkProblem) -> list[Clause]:
    """Return required edges as clauses; those that cannot be chosen are never met."""
    able = problem.candidate & ~problem.existing
    return [
        Clause((e,) if able[e] else (), SOFT, "required street")
        for e in np.flatnonzero(problem.required).tolist()
    ]


def broken_groups(
    problem: NetworkProblem, active: BoolArray
) -> tuple[frozenset[str], tuple[Violation, ...]]:
    """Return the groups of hard rules that a design breaks, and where it does.

    Parameters
    ----------
    problem
        The problem with all its rules.
    active
        Shape (e,). A design.

    Returns
    -------
    frozenset of str
        Keys as `hard_groups` has them.
    tuple of Violation
        All violations of hard rules.
    """
    places = tuple(v for v in check_design(problem, active) if v.hard)
    groups = hard_groups(problem)
    found = set()
    for place in places:
        key = _KINDS.get(place.kind)
        if key in groups:
            found.add(key)
        for table in ("clause", "pattern", "requirement"):
            named = {f"{table}:{place.kind}"}
            if place.kind == table:
                named.add(f"{table}:")
            found |= named & groups.keys()
    return frozenset(found), places
