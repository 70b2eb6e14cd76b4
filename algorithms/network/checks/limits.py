"""Are limits on exits, length, distance and junctions kept? Written on its own, with networkx.

Only the data of the requirements are read: what they mean is worked out again here.
"""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

import networkx as nx

from ..problem import NetworkProblem
from ..requirements.budget import LeastLength, LengthBudget
from ..requirements.exits import ExitCount
from ..requirements.reach import MaxDistance
from ..requirements.spacing import JunctionSpacing
from .facts import Facts, Violation


def check_exits(
    requirement: ExitCount,
    problem: NetworkProblem,  # noqa: ARG001
    facts: Facts,
) -> list[Violation]:
    """Check the number of places where new streets leave."""
    used = tuple(sorted(facts.lively.intersection(requirement.options)))
    text = (
        f"New streets leave at {len(used)} places; between {requirement.least} and "
        f"{requirement.most} were asked for."
    )
    wrong = max(len(used) - requirement.most, requirement.least - len(used), 0)
    one = Violation(requirement.kind, text, (), used, math.isinf(requirement.penalty))
    return [one] * wrong


def check_budget(
    requirement: LengthBudget,
    problem: NetworkProblem,  # noqa: ARG001
    facts: Facts,
) -> list[Violation]:
    """Check the total length of new streets, in whole millimetres."""
    total = sum(_whole(requirement.lengths[e], 1000) for e in facts.chosen)
    over = total - _whole(requirement.most, 1000)
    text = (
        f"New streets are {total / 1000:.3f} m long; at most {requirement.most:g} m were asked for."
    )
    one = Violation(
        requirement.kind, text, tuple(sorted(facts.chosen)), (), math.isinf(requirement.penalty)
    )
    units = Fraction(over, _whole(requirement.unit, 1000))
    return [one] * max(0, math.ceil(units))


def check_least_length(
    requirement: LeastLength,
    problem: NetworkProblem,  # noqa: ARG001
    facts: Facts,
) -> list[Violation]:
    """Check that new streets are long enough, in whole millimetres."""
    total = sum(_whole(requirement.lengths[e], 1000) for e in facts.chosen)
    short = _whole(requirement.least, 1000) - total
    text = (
        f"New streets are {total / 1000:.3f} m long; at least {requirement.least:g} m were "
        "asked for."
    )
    one = Violation(
        requirement.kind, text, tuple(sorted(facts.chosen)), (), math.isinf(requirement.penalty)
    )
    return [one] * max(0, math.ceil(Fraction(short, _whole(requirement.unit, 1000))))


def check_distance(
    requirement: MaxDistance, problem: NetworkProblem, facts: Facts
) -> list[Violation]:
    """Check the way from every new vertex to a sink, in millionths of a unit of length."""
    streets = nx.Graph()
    streets.add_nodes_from(facts.sinks)
    for e in facts.on:
        streets.add_edge(*facts.ends[e], length=max(1, _whole(problem.length[e], 1_000_000)))
    far: dict[int, int] = {}
    if facts.sinks:
        far = nx.multi_source_dijkstra_path_length(streets, facts.sinks, weight="length")
    top = _whole(requirement.most, 1_000_000)
    found = []
    for v in sorted(facts.lively - facts.sinks - facts.old):
        if v in far and far[v] <= top:
            continue
        way = f"{far[v] / 1e6:g}" if v in far else "without a way"
        text = (
            f"Vertex {v} is {way} from the nearest sink; at most {requirement.most:g} is allowed."
        )
        found.append(Violation(requirement.kind, text, (), (v,), math.isinf(requirement.penalty)))
    return found


def check_spacing(
    requirement: JunctionSpacing,
    problem: NetworkProblem,  # noqa: ARG001
    facts: Facts,
) -> list[Violation]:
    """Check the way along streets between any two junctions."""
    old = set(_near_junctions(requirement, facts, facts.existing))
    found = []
    for u, v in sorted(set(_near_junctions(requirement, facts, facts.on)) - old):
        text = (
            f"The junctions at vertices {u} and {v} are less than {requirement.spacing:g} m apart."
        )
        found.append(Violation(requirement.kind, text, (), (u, v), math.isinf(requirement.penalty)))
    return found


def _near_junctions(
    requirement: JunctionSpacing, facts: Facts, streets: set[int]
) -> list[tuple[int, int]]:
    """List the pairs of junctions that are nearer to each other than the spacing."""
    network = nx.MultiGraph()
    for e in streets:
        network.add_edge(*facts.ends[e], length=_whole(requirement.lengths[e], 1000))
    junctions = sorted(v for v, degree in network.degree() if degree >= 3)
    top = _whole(requirement.spacing, 1000)
    found = []
    for u, v in itertools.combinations(junctions, 2):
        if nx.has_path(network, u, v):
            way = nx.shortest_path_length(network, u, v, weight="length")
            if way < top:
                found.append((u, v))
    return found


def _whole(value: float, parts: int) -> int:
    """Round to the nearest whole number of 1/parts."""
    return round(float(value) * parts)
