"""Which rules contradict each other, where no design satisfies them all."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .problem import NetworkProblem
from .structure import structure

#: Cost that stands for "may be broken" in a trial.
SOFT = 1.0

#: What each local rule is called in the text.
RULES = {
    "dead_ends": "no dead ends",
    "branches": "no branches",
    "zigzags": "no zigzags",
    "too_close": "no streets too close to each other",
    "t_junctions": "no T-junctions",
}


def relaxations(problem: NetworkProblem) -> dict[str, NetworkProblem]:
    """Return, per hard rule, the problem in which that rule alone may be broken.

    Parameters
    ----------
    problem
        The problem.

    Returns
    -------
    dict
        Keys name the rules for a planner.
    """
    found: dict[str, NetworkProblem] = {}
    if problem.cover and math.isinf(problem.cover_penalty):
        reach = problem.cover_radius
        text = "coverage" if reach is None else f"coverage within {reach} edges"
        found[text] = dataclasses.replace(problem, cover_penalty=SOFT)
    for name, text in RULES.items():
        if math.isinf(getattr(problem, name)):
            allowed: dict[str, Any] = {name: 0.0}
            found[text] = dataclasses.replace(problem, **allowed)
    if problem.required.any():
        found["required streets"] = dataclasses.replace(
            problem, required=np.zeros_like(problem.required)
        )
    for kind in sorted({c.kind for c in problem.clauses if math.isinf(c.penalty)}):
        clauses = [
            dataclasses.replace(c, penalty=SOFT) if c.kind == kind else c for c in problem.clauses
        ]
        found[kind or "clauses"] = dataclasses.replace(problem, clauses=clauses)
    for kind in sorted({r.kind for r in problem.requirements if r.hard}):
        rest = [r for r in problem.requirements if r.kind != kind]
        found[kind] = dataclasses.replace(problem, requirements=tuple(rest))
    for kind in sorted({p.kind for p in problem.patterns if math.isinf(p.weight)}):
        patterns = [
            dataclasses.replace(p, weight=SOFT) if p.kind == kind else p for p in problem.patterns
        ]
        found[kind or "patterns"] = dataclasses.replace(problem, patterns=patterns)
    return found


def explain(
    problem: NetworkProblem,
    feasible: Callable[[NetworkProblem], bool],
    passed: Callable[[], bool],
) -> str:
    """Say why no design exists: which rules, given up one at a time, make one possible.

    Parameters
    ----------
    problem
        A problem without a valid design.
    feasible
        Tells whether a problem has a valid design.
    passed
        Tells that time is up.

    Returns
    -------
    str
        Sentences for the planner.
    """
    reasons = structure(problem).conflicts
    text = "No street network satisfies all rules at once"
    text += f": {'; '.join(reasons)}." if reasons else "."
    if not problem.sinks.any():
        return f"{text} There is no sink, so that nothing has a way out. Add access points."
    trials = relaxations(problem)
    cures = []
    for rule, relaxed in trials.items():
        if passed():
            break
        if feasible(relaxed):
            cures.append(rule)
    if cures:
        rest = [rule for rule in trials if rule not in cures]
        against = f" (the other rules, {', '.join(rest)}, may stay)" if rest else ""
        return (
            f"{text} Rules in conflict: {', '.join(cures)}. Any one of these given up makes a "
            f"network possible{against}. Give it a cost instead of forbidding."
        )
    return (
        f"{text} Giving up one rule alone does not help. In force are: "
        f"{', '.join(trials) or 'connection to the sinks only'}. Check the sinks, the obstacles "
        "and the forbidden streets first."
    )
