"""Local rules, structure, chords and the checker on meshes with answers known by hand."""

import dataclasses
import math

import numpy as np
import pytest
from platwright.mesh.grids import fan, grid
from platwright.network.checks.validation import check_design
from platwright.network.cp.model import whole, whole_scale
from platwright.network.evaluate import evaluate
from platwright.network.examples import hop_ball, paper_problem
from platwright.network.local import close_pairs, fold, rule_terms, t_junctions, zigzag_triples
from platwright.network.problem import Clause, Pattern
from platwright.network.search.chords import chord_start, chords
from platwright.network.structure import structure

INF = math.inf


def edges_of(mesh, *pairs):
    """Return a mask of edges given by their end points."""
    active = np.zeros(len(mesh.edges), dtype=bool)
    for u, v in pairs:
        active[mesh.edge_between(u, v)] = True
    return active


def test_counts_of_local_features():
    mesh = grid(3, 3)
    inner = int((~mesh.boundary_edges).sum())
    assert len(zigzag_triples(mesh)) == 2 * inner
    assert len(close_pairs(mesh)) == 2 * len(mesh.faces)
    assert len(t_junctions(mesh)) == 4 * 4
    assert len(t_junctions(fan(5))) == 0


def test_the_zigzag_of_a_domino():
    mesh = grid(2, 1)  # vertices 0 1 2 / 3 4 5, the inner edge is 1-4
    first = edges_of(mesh, (0, 1), (1, 4), (4, 5)).nonzero()[0]
    second = edges_of(mesh, (1, 2), (1, 4), (3, 4)).nonzero()[0]
    middle = mesh.edge_between(1, 4)
    expected = {frozenset(first.tolist()), frozenset(second.tolist())}
    assert {frozenset(t) for t in zigzag_triples(mesh)} == expected
    assert {t[1] for t in zigzag_triples(mesh)} == {middle}


def test_existing_and_barred_edges_fold_terms():
    problem = paper_problem(grid(3, 3))
    a, b, c = np.flatnonzero(problem.candidate)[:3].tolist()
    old = int(np.flatnonzero(problem.existing)[0])
    patterns = (Pattern((a, old), (b,), 2.0), Pattern((a,), (old,), 2.0), Pattern((c,), (), 2.0))
    problem = dataclasses.replace(
        problem, patterns=patterns, zigzags=0.0, too_close=0.0, dead_ends=0.0
    )
    usable = problem.candidate.tolist()
    usable[c] = False
    folded = [fold(term, problem, usable) for term in rule_terms(problem)]
    assert folded[0].alternatives == (((a,), (b,)),)
    assert folded[1] is None
    assert folded[2] is None


def test_structure_drops_what_leads_nowhere():
    mesh = grid(4, 4)
    problem = paper_problem(mesh)
    # vertex 12 is the centre; bar all its edges but one
    around = mesh.vertex_edges[12].tolist()
    problem.candidate[around[1:]] = False
    assert not structure(problem).usable[around[0]]
    assert structure(problem, strip=False).usable[around[0]]
    allowed = dataclasses.replace(problem, dead_ends=1.0)
    assert structure(allowed).usable[around[0]]


def test_streets_without_a_sink_are_contracted():
    mesh = grid(4, 4)
    problem = paper_problem(mesh, "inner")
    problem.sinks[:] = False
    problem.sinks[0] = True
    pair = edges_of(mesh, (12, 13), (13, 18), (0, 1))
    problem.existing[pair] = True
    problem.candidate[pair] = False
    index = structure(problem)
    assert index.node[12] == index.node[13] == index.node[18] == 12
    assert index.node[0] == index.node[1] == -1
    assert not index.root[12]
    assert index.root[1]


def test_chords_of_a_grid_are_its_lines():
    index = structure(paper_problem(grid(6, 5)))
    lines = chords(index)
    assert sorted(map(len, lines)) == [5] * 5 + [6] * 4
    active = chord_start(index)
    assert evaluate(index.problem, active).valid


def test_chords_need_sinks_at_their_ends():
    index = structure(paper_problem(grid(6, 5), "one sink"))
    assert chords(index) == []
    assert chord_start(index) is None
    # two of the four inner sinks on one line are such ends
    between = chords(structure(paper_problem(grid(8, 8), "inner")))
    assert between
    assert all(len(line) == 4 for line in between)


def test_checker_finds_every_kind():
    mesh = grid(5, 5)  # rows of six vertices
    rules = {"branches": 1.0, "t_junctions": 1.0, "zigzags": 1.0, "coverage": 1}
    problem = paper_problem(mesh, "one sink", **rules)
    top = int(problem.sinks.argmax())
    assert mesh.vertices[top].tolist() == [2.0, 5.0]
    pairs = [(top, top - 6), (26, 20), (20, 14), (14, 15), (15, 21), (21, 20), (26, 25)]
    active = edges_of(mesh, *pairs, (7, 8))
    kinds = {v.kind for v in check_design(problem, active)}
    local = {"too close", "dead end", "branch", "T-junction", "zigzag"}
    assert kinds == local | {"island", "uncovered"}
    straight = edges_of(mesh, (top, 26), (26, 20), (20, 14))
    assert "zigzag" not in {v.kind for v in check_design(problem, straight)}
    barred = edges_of(mesh, (0, 1))
    assert "barred" in {v.kind for v in check_design(problem, barred)}
    problem.required[mesh.edge_between(7, 8)] = True
    nothing = np.zeros_like(barred)
    assert "required" in {v.kind for v in check_design(problem, nothing)}


def test_checker_reports_soft_wishes_as_soft():
    mesh = grid(4, 4)
    a, b = np.flatnonzero(paper_problem(mesh).candidate)[:2].tolist()
    problem = dataclasses.replace(
        paper_problem(mesh, cover_penalty=2.0),
        clauses=(Clause((a,), 3.0, "block length"),),
        patterns=(Pattern((), (b,), 1.0, "continuation"),),
    )
    nothing = np.zeros(len(mesh.edges), dtype=bool)
    found = check_design(problem, nothing)
    assert {v.kind for v in found} == {"block length", "continuation"}
    assert not any(v.hard for v in found)
    assert evaluate(problem, nothing).objective == 4.0
    assert evaluate(problem, nothing).broken_clauses == (0,)


def test_distance_counts_each_active_vertex_once():
    mesh = grid(4, 1)  # 0..4 below, 5..9 above
    problem = paper_problem(mesh, "inner", weight_distance=2.0, weight_length=1.0, dead_ends=0.0)
    problem.sinks[:] = False
    problem.sinks[0] = True
    found = evaluate(problem, edges_of(mesh, (0, 1), (1, 2), (2, 3)))
    assert (found.length, found.distance_sum) == (3.0, 2.0 * (1 + 2 + 3))
    assert found.distance[3] == 3.0
    assert math.isinf(found.distance[4])


def test_hop_ball_of_a_corner():
    assert hop_ball(grid(3, 3), 0, 2) == (0, 1, 2, 4, 5, 8)


@pytest.mark.parametrize(("values", "scale"), [([1, 2], 1), ([0.25], 4), ([0.05], 20)])
def test_whole_scale(values, scale):
    assert whole_scale(values) == scale
    assert all(whole(v, scale) == pytest.approx(v * scale) for v in values)
