"""Diagnoses of problems without a design, against trying every set of edges."""

import dataclasses
import itertools
import math
import time

import numpy as np
import pytest
from clock import allowed
from platwright.errors import InfeasibleError
from platwright.mesh.grids import fan, grid
from platwright.network.checks.validation import design_cost
from platwright.network.evaluate import Evaluator
from platwright.network.examples import PAPER_MESHES, paper_problem
from platwright.network.problem import Clause, Pattern
from platwright.network.requirements.links import Link
from platwright.network.requirements.twoways import TwoWays
from platwright.network.solve import solve
from platwright.network.why.conflicts import find_conflicts
from platwright.network.why.groups import broken_groups, hard_groups, regroup
from platwright.network.why.reasons import find_reasons
from platwright.network.why.whynot import diagnose
from platwright.progress import Silent

INF = math.inf
MESHES = [
    lambda: grid(2, 2),
    lambda: grid(3, 2),
    lambda: grid(3, 2, keep=lambda i, j: (i, j) not in ((0, 0), (2, 1))),
    lambda: grid(4, 1),
    lambda: fan(3),
    lambda: fan(5),
]


def random_problem(seed, most=8):
    """Make a small problem with many hard rules, often too many."""
    rng = np.random.default_rng(seed)

    def pick(*values):
        return values[int(rng.integers(len(values)))]

    rules = {
        "coverage": pick(1, 1, 2),
        "cover_penalty": pick(INF, INF, 2.0),
        "weight_distance": pick(0.0, 1.0),
        "dead_ends": pick(INF, INF, 1.0),
        "branches": pick(0.0, 0.0, INF),
        "zigzags": pick(0.0, 2.0, INF),
        "too_close": pick(INF, INF, 0.0),
        "t_junctions": pick(0.0, 1.0, INF),
    }
    problem = paper_problem(pick(*MESHES)(), pick("boundary", "one sink", "inner"), **rules)
    edges = len(problem.candidate)
    candidate = problem.candidate.copy()
    candidate[rng.integers(edges, size=int(rng.integers(3)))] = False
    able = rng.permutation(np.flatnonzero(candidate))
    candidate[able[most:]] = False
    required = np.zeros(edges, dtype=bool)
    required[rng.integers(edges, size=int(pick(0, 1, 2, 3)))] = True
    required &= ~problem.existing
    if rng.random() < 0.8:
        required &= candidate
    clauses, patterns = [], []
    for kind in ("one", "", "one")[: int(rng.integers(4))]:
        some = tuple(rng.integers(edges, size=int(rng.integers(3))).tolist())
        clauses.append(Clause(some, pick(INF, INF, 1.0), kind))
    if rng.random() < 0.4:
        on, off = rng.integers(edges, size=1), rng.integers(edges, size=int(rng.integers(2)))
        if not set(on.tolist()) & set(off.tolist()):
            patterns.append(Pattern(tuple(on.tolist()), tuple(off.tolist()), INF, "drawn"))
    return dataclasses.replace(
        problem,
        candidate=candidate,
        required=required,
        clauses=tuple(clauses),
        patterns=tuple(patterns),
        requirements=(TwoWays(),) if rng.random() < 0.3 else (),
    )


class Table:
    """For every set of edges the groups that it breaks, one group at a time."""

    def __init__(self, small, problem):
        self.groups = hard_groups(problem)
        judges = {key: Evaluator(regroup(problem, {key})) for key in self.groups}
        self.designs, self.broken = [], []
        bare = Evaluator(regroup(problem, ()))
        for active in small.subsets(problem):
            if math.isfinite(bare.objective(active)):
                self.designs.append(active)
                bad = {k for k, own in judges.items() if math.isinf(own.objective(active))}
                self.broken.append(frozenset(bad))

    def possible(self, kept):
        """Tell whether a set of edges meets all of these groups."""
        return any(not bad & frozenset(kept) for bad in self.broken)

    def conflicts(self):
        """List the smallest sets of groups that cannot be met."""
        found = []
        for size in range(1, len(self.groups) + 1):
            for some in map(frozenset, itertools.combinations(self.groups, size)):
                if not any(one <= some for one in found) and not self.possible(some):
                    found.append(some)
        return found


def impossible_problems(small, seeds):
    """Yield the problems of some seeds that have no design, with their tables."""
    for seed in seeds:
        problem = random_problem(seed)
        if problem.sinks.any():
            table = Table(small, problem)
            if not table.possible(table.groups):
                yield problem, table


def check_diagnosis(problem, table, found):
    """Compare a diagnosis with the table."""
    assert found.complete
    assert found.groups == table.groups
    conflicts = table.conflicts()
    assert {frozenset(c.groups) for c in found.conflicts} == set(conflicts)
    assert all(c.minimal for c in found.conflicts)
    cures = {frozenset(c.groups) for c in found.cures}
    assert len(cures) == len(found.cures)
    every = frozenset(table.groups)
    for cure in cures:
        assert table.possible(every - cure)
        assert not any(table.possible(every - cure | {key}) for key in cure)
    # the smallest sets that meet every conflict, by trying all
    sets = [
        frozenset(some)
        for size in range(1, len(every) + 1)
        for some in itertools.combinations(every, size)
        if all(one & frozenset(some) for one in conflicts)
    ]
    assert cures == {s for s in sets if not any(other < s for other in sets)}
    for cure in found.cures:
        check_cure(problem, table, cure)


def check_cure(problem, table, cure):
    """The design of a cure breaks nothing else, and no design breaks it less often."""
    rest = frozenset(table.groups) - frozenset(cure.groups)
    assert math.isfinite(design_cost(regroup(problem, rest), cure.active))
    groups, places = broken_groups(problem, cure.active)
    assert groups <= frozenset(cure.groups)
    assert places == cure.violations
    assert cure.count == len(places) >= 1
    if cure.least:
        counts = [
            len(broken_groups(problem, active)[1])
            for active, bad in zip(table.designs, table.broken)
            if not bad & rest
        ]
        assert cure.count == min(counts)


@pytest.mark.parametrize(
    "block", [0, *(pytest.param(b, marks=pytest.mark.slow) for b in range(1, 6))]
)
def test_diagnoses_are_all_there_is(small, block):
    number = 0
    for problem, table in impossible_problems(small, range(20 * block, 20 * block + 20)):
        found = diagnose(problem, seconds=60.0)
        check_diagnosis(problem, table, found)
        assert all(cure.least for cure in found.cures[:6])
        number += 1
    assert number > 2


def test_highs_finds_the_same(small):
    for problem, table in impossible_problems(small, range(1000, 1007)):
        check_diagnosis(problem, table, diagnose(problem, by_cp=False, seconds=60.0))


@pytest.mark.parametrize(
    "block", [0, *(pytest.param(b, marks=pytest.mark.slow) for b in range(1, 4))]
)
def test_reasons_are_true(small, block):
    kinds = set()
    for seed in range(2000 + 100 * block, 2100 + 100 * block):
        problem = random_problem(seed, most=7)
        for reason in find_reasons(problem):
            kinds.add(reason.kind)
            rules = set(reason.rules) - {"required", "coverage"}
            part = dataclasses.replace(
                problem,
                required=np.isin(np.arange(len(problem.required)), reason.edges),
                cover={v: ball for v, ball in problem.cover.items() if v in reason.vertices},
            )
            if "coverage" in reason.rules:
                part.required[:] = False
                kept = rules | {"coverage"}
            else:
                kept = rules | {"required"}
            judge = Evaluator(regroup(part, kept))
            assert all(math.isinf(judge.objective(a)) for a in small.subsets(problem))
            assert set(reason.rules) <= hard_groups(problem).keys()
    assert {"uncoverable", "impossible required", "clash"} <= kinds


def test_the_solver_hands_the_diagnosis_on(small):
    number = 0
    for problem, table in impossible_problems(small, range(3000, 3020)):
        with pytest.raises(InfeasibleError) as caught:
            solve(problem, time_limit=30)
        found = caught.value.diagnosis
        check_diagnosis(problem, table, found)
        assert str(caught.value) == found.text
        for key in found.cures[0].groups:
            assert found.groups[key] in found.text
        number += 1
    assert number > 2


@pytest.mark.slow
def test_what_is_not_proven_is_not_claimed(small):
    impossible = possible = 0
    for seed in range(4000, 4024):
        problem = random_problem(seed)
        table = Table(small, problem)
        found = diagnose(problem, seconds=60.0, proven=False)
        if table.possible(table.groups):
            possible += 1
            assert not found.proven
            assert not found.conflicts
            (cure,) = (c for c in found.cures if not c.groups)
            assert (cure.count, cure.violations) == (0, ())
            assert not any(table.broken[i] for i, a in enumerate(table.designs)
                           if (a == cure.active).all())  # fmt: skip
            assert "was found" in found.text
        else:
            impossible += 1
            assert found.proven or not found.conflicts
            for conflict in found.conflicts:
                assert not table.possible(conflict.groups)
            for cure in found.cures:
                assert table.possible(set(table.groups) - set(cure.groups))
    assert possible > 2
    assert impossible > 2


def clashing(size, scenario="boundary"):
    """Require two streets side by side in a paper problem."""
    problem = paper_problem(PAPER_MESHES[size](), scenario)
    a, b = next(
        pair for pair in problem.mesh.opposite_pairs().tolist() if problem.candidate[pair].all()
    )
    problem.required[[a, b]] = True
    return problem, {a, b}


def test_required_streets_that_are_too_close_are_named():
    problem, pair = clashing(660)
    start = time.monotonic()
    with pytest.raises(InfeasibleError) as caught:
        solve(problem, time_limit=30)
    assert time.monotonic() - start < allowed(12.0)
    found = caught.value.diagnosis
    (reason,) = found.reasons
    assert set(reason.edges) == pair
    assert reason.rules == ("required", "too_close")
    assert [c.groups for c in found.conflicts] == [("too_close", "required")]
    assert "Rules in conflict: no streets too close to each other, required streets" in found.text


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["boundary", "inner"])
def test_what_cures_cost_at_the_size_of_the_paper(scenario):
    problem, pair = clashing(660, scenario)
    found = diagnose(problem, seconds=60.0)  # a second or two, without anything beside
    assert found.complete
    assert {c.groups for c in found.cures} == {("too_close",), ("required",)}
    assert all(c.count == 1 and c.least for c in found.cures)
    for cure in found.cures:
        (place,) = cure.violations
        assert set(place.edges) <= pair


def test_a_vertex_behind_obstacles_is_named_at_the_size_of_the_paper():
    problem = paper_problem(PAPER_MESHES[660](), "inner", coverage=1)
    mesh = problem.mesh
    centre = int(np.argmin(((mesh.vertices - mesh.vertices.mean(axis=0)) ** 2).sum(axis=1)))
    island = set(problem.cover[centre])
    touching = np.isin(mesh.edges, sorted(island))
    problem.candidate[touching.any(axis=1) & ~touching.all(axis=1)] = False
    start = time.monotonic()
    found = diagnose(problem)
    assert time.monotonic() - start < allowed(12.0)
    lost = [r for r in found.reasons if r.kind == "uncoverable"]
    assert [r.vertices for r in lost] == [(centre,)]
    assert "obstacles cut it off" in lost[0].text
    assert ("coverage",) in [c.groups for c in found.conflicts]
    for cure in found.cures:
        assert "coverage" in cure.groups
        assert math.isfinite(
            design_cost(regroup(problem, found.groups.keys() - set(cure.groups)), cure.active)
        )


def test_a_diagnosis_can_be_cancelled():
    class Cancelled(Silent):
        def __init__(self, after):
            self.end = time.monotonic() + after

        def cancelled(self):
            return time.monotonic() > self.end

    problem = paper_problem(PAPER_MESHES[660](), "inner", coverage=1, branches=INF)
    for after in (0.0, 0.5):
        start = time.monotonic()
        found = diagnose(problem, seconds=60.0, progress=Cancelled(after))
        assert time.monotonic() - start < allowed(after + 3.0)
        assert not found.complete


def test_a_link_that_cannot_be_met_is_named_by_its_ends():
    problem = paper_problem(grid(4, 4), "inner")
    # five vertices by five: from corner to corner it is eight edges
    wishes = (Link(0, 24, 7.5), Link(0, 24, 9.0), Link(0, 4, 9.0))
    problem = dataclasses.replace(problem, requirements=wishes)
    with pytest.raises(InfeasibleError) as caught:
        solve(problem, time_limit=30)
    found = caught.value.diagnosis
    (reason,) = found.reasons
    assert reason.kind == "link"
    assert reason.rules == ("requirement:link",)
    assert {0, 24} <= set(reason.vertices)
    assert [c.groups for c in found.conflicts] == [("requirement:link",)]
    (cure,) = found.cures
    assert (cure.groups, cure.count) == (("requirement:link",), 1)


def test_a_question_without_sinks_and_rules():
    problem = paper_problem(grid(3, 3))
    none = dataclasses.replace(problem, sinks=np.zeros_like(problem.sinks))
    found = diagnose(none)
    assert [r.kind for r in found.reasons] == ["no sink"]
    assert "no sink" in found.text


def test_without_an_answer_nothing_is_claimed():
    # a trial that knows nothing leaves one conflict, not reduced, and no cure
    found = find_conflicts("abc", lambda _: None, lambda _: frozenset(), lambda: False)
    assert found.conflicts == [frozenset("abc")]
    assert found.minimal == [False]
    assert found.cures == []
    assert not found.complete


@pytest.mark.parametrize("most", [*range(12), 999])
def test_what_is_known_when_time_is_up_is_true(most):
    drawn = [frozenset("ab"), frozenset("bcd"), frozenset("e")]
    asked = []

    def trial(kept):
        asked.append(kept)
        return False if any(one <= kept for one in drawn) else np.zeros(1, dtype=bool)

    every = frozenset("abcde")
    found = find_conflicts("abcde", trial, lambda _: every, lambda: len(asked) >= most)
    assert all(any(one <= conflict for one in drawn) for conflict in found.conflicts)
    exact = [c for c, certain in zip(found.conflicts, found.minimal) if certain]
    assert set(exact) <= set(drawn)
    for cure, _ in found.cures:
        assert all(one & cure for one in drawn)
        assert not any(all(one & (cure - {key}) for one in drawn) for key in cure)
    assert not found.complete or (set(exact) == set(drawn) and len(found.cures) == 3)
    assert found.complete or most < 999


@pytest.mark.parametrize("seed", range(200))
def test_conflicts_of_random_contradictions(seed):
    rng = np.random.default_rng(seed)
    keys = "abcdefg"[: int(rng.integers(1, 8))]
    drawn = [
        frozenset(k for k in keys if rng.random() < 0.4) or frozenset(keys[:1])
        for _ in range(int(rng.integers(1, 5)))
    ]
    drawn = [one for one in drawn if not any(other < one for other in drawn)]
    answer = np.zeros(1, dtype=bool)

    def trial(kept):
        return False if any(one <= kept for one in drawn) else answer

    # nothing but what was asked for is met
    every = frozenset(keys)
    found = find_conflicts(keys, trial, lambda _: every, lambda: False)
    assert set(found.conflicts) == set(drawn)
    assert found.complete
    cures = {cure for cure, _ in found.cures}
    assert len(cures) == len(found.cures)
    for size in range(len(keys) + 1):
        for some in map(frozenset, itertools.combinations(keys, size)):
            hits = all(one & some for one in drawn)
            least = hits and not any(all(one & (some - {k}) for one in drawn) for k in some)
            assert (some in cures) == least
