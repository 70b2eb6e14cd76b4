"""Does a design meet what was asked of the network as a whole? Written on its own.

Every kind of requirement has a check here that shares nothing with the class it checks but
the data: paths, bridges and lengths are worked out again with networkx.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..problem import NetworkProblem
from ..requirements.base import Requirement
from ..requirements.budget import LeastLength, LengthBudget
from ..requirements.exits import ExitCount
from ..requirements.links import Link
from ..requirements.reach import MaxDistance
from ..requirements.spacing import JunctionSpacing
from ..requirements.twoways import TwoWays
from .facts import Facts, Violation
from .limits import (
    check_budget,
    check_distance,
    check_exits,
    check_least_length,
    check_spacing,
)
from .links import check_link
from .oneway import check_two_ways

#: Type of requirement -> function that lists its violations, one per unit of cost.
CHECKS: dict[type, Callable[[Any, NetworkProblem, Facts], list[Violation]]] = {
    ExitCount: check_exits,
    JunctionSpacing: check_spacing,
    LeastLength: check_least_length,
    LengthBudget: check_budget,
    Link: check_link,
    MaxDistance: check_distance,
    TwoWays: check_two_ways,
}


def check_requirements(problem: NetworkProblem, facts: Facts) -> list[Violation]:
    """List the violations of all requirements.

    Parameters
    ----------
    problem
        What was asked.
    facts
        The design.
    """
    found: list[Violation] = []
    for requirement in problem.requirements:
        found += check_one(requirement, problem, facts)
    return found


def check_one(requirement: Requirement, problem: NetworkProblem, facts: Facts) -> list[Violation]:
    """List the violations of one requirement, one per unit of cost."""
    return CHECKS[type(requirement)](requirement, problem, facts)
