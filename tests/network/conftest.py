"""Small meshes and random questions about them, shared by the tests of the network room."""

from __future__ import annotations

import dataclasses
import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import strategies as st
from platwright.mesh.grids import fan, grid
from platwright.network.evaluate import Evaluator
from platwright.network.examples import paper_problem
from platwright.network.problem import Clause, Pattern

INF = math.inf

#: Meshes with at most 17 edges, among them inner vertices of valence 3 and 5.
TINY = {
    "2x2": lambda: grid(2, 2),
    "3x2": lambda: grid(3, 2),
    "L": lambda: grid(3, 2, keep=lambda i, j: (i, j) not in ((0, 0), (2, 1))),
    "strip": lambda: grid(4, 1),
    "three": lambda: fan(3),
    "five": lambda: fan(5),
}


def draw_rules(data) -> dict:
    """Draw weights of all rules, soft and hard."""

    def pick(*values):
        return data.draw(st.sampled_from(values))

    return {
        "coverage": pick(1, 2),
        "cover_penalty": pick(INF, INF, 3.0),
        "weight_length": pick(1.0, 0.0, 0.5),
        "weight_distance": pick(0.0, 0.0, 1.0, 0.25),
        "dead_ends": pick(INF, INF, 0.0, 1.5),
        "branches": pick(0.0, 0.0, 2.0, INF),
        "zigzags": pick(0.0, 5.0, INF),
        "too_close": pick(INF, INF, 0.0, 1.0),
        "t_junctions": pick(0.0, 1.5, INF),
    }


def vary(problem, data, most: int):
    """Add obstacles, required edges, more sinks, patterns and clauses; bound the size."""
    edges = len(problem.mesh.edges)
    some = st.lists(st.integers(0, edges - 1), max_size=3)
    candidate = problem.candidate.copy()
    candidate[data.draw(some)] = False
    able = np.flatnonzero(candidate)
    candidate[able[most:]] = False
    able = able[:most]
    sinks = problem.sinks.copy()
    sinks[data.draw(st.lists(st.integers(0, len(sinks) - 1), max_size=2))] = True
    required = problem.required.copy()
    if len(able) and data.draw(st.integers(0, 3)) == 0:
        required[able[data.draw(st.integers(0, len(able) - 1))]] = True
    weight = st.sampled_from([0.5, 2.0, INF])
    patterns, clauses = [], []
    if data.draw(st.booleans()):
        on, off = tuple(data.draw(some)), tuple(data.draw(some))
        if not set(on) & set(off):
            patterns.append(Pattern(on, off, data.draw(weight), "drawn pattern"))
    if data.draw(st.booleans()):
        clauses.append(Clause(tuple(data.draw(some)), data.draw(weight), "drawn clause"))
    return dataclasses.replace(
        problem,
        candidate=candidate,
        sinks=sinks,
        required=required,
        patterns=tuple(patterns),
        clauses=(*problem.clauses, *clauses),
    )


def draw_problem(data, most: int = 11):
    """Draw a problem on a tiny mesh with at most `most` candidate edges."""
    mesh = TINY[data.draw(st.sampled_from(sorted(TINY)))]()
    scenario = data.draw(st.sampled_from(["boundary", "one sink", "inner", "far sink"]))
    if scenario == "far sink":
        rng = np.random.default_rng(data.draw(st.integers(0, 9999)))
        rules = draw_rules(data)
        weight = data.draw(st.sampled_from([0.5, 1.0, 4.0]))
        return vary(far_sink(mesh, rng, **{**rules, "weight_distance": weight}), data, most)
    return vary(paper_problem(mesh, scenario, **draw_rules(data)), data, most)


def far_sink(mesh, rng, **rules):
    """Make the boundary an existing street with a single sink; clauses call for streets."""
    problem = paper_problem(mesh, "boundary", **rules)
    sinks = np.zeros(len(mesh.vertices), dtype=bool)
    sinks[rng.choice(np.flatnonzero(mesh.boundary_vertices))] = True
    able = np.flatnonzero(problem.candidate)
    clauses = tuple(
        Clause(tuple(rng.choice(able, 2).tolist()), float(rng.choice([0.3, 2.0, INF])))
        for _ in range(3)
    )
    return dataclasses.replace(problem, sinks=sinks, clauses=clauses)


def draw_mesh(data):
    """Draw a mesh of some 30 to 150 edges: a grid with cells cut away, or a fan."""
    if data.draw(st.booleans()):
        return fan(data.draw(st.sampled_from([3, 5, 6])), data.draw(st.integers(2, 3)))
    nx, ny = data.draw(st.integers(4, 8)), data.draw(st.integers(4, 8))
    cx, cy = data.draw(st.integers(0, 3)), data.draw(st.integers(0, 3))
    return grid(nx, ny, keep=lambda i, j: not (i < cx and j < cy))


def subsets(problem):
    """Yield every set of candidate edges."""
    able = np.flatnonzero(problem.candidate)
    for bits in itertools.product((False, True), repeat=len(able)):
        active = np.zeros(len(problem.candidate), dtype=bool)
        active[able] = bits
        yield active


def brute_force(problem) -> float:
    """Return the least objective of all sets of candidate edges, infinite if none is valid."""
    evaluator = Evaluator(problem)
    return min(evaluator.objective(active) for active in subsets(problem))


@pytest.fixture(scope="session")
def small():
    """Functions that draw and solve small problems."""
    return SimpleNamespace(
        draw_problem=draw_problem,
        draw_rules=draw_rules,
        draw_mesh=draw_mesh,
        far_sink=far_sink,
        vary=vary,
        subsets=subsets,
        brute_force=brute_force,
    )
