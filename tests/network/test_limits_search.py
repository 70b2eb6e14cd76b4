"""Windows, starts and whole runs keep limits on exits, length, distance and junctions."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from platwright.errors import InputError
from platwright.mesh.grids import grid
from platwright.network.checks.validation import check_design
from platwright.network.cp.sat import CpOptions
from platwright.network.evaluate import Evaluator
from platwright.network.examples import paper_problem
from platwright.network.incumbent import Incumbent
from platwright.network.partition import patches, point_to_point
from platwright.network.requirements.budget import LengthBudget
from platwright.network.requirements.exits import ExitCount
from platwright.network.requirements.reach import MaxDistance
from platwright.network.requirements.spacing import junction_spacing
from platwright.network.search import windows
from platwright.network.search.chords import chord_start
from platwright.network.search.repair import repair, repaired_starts
from platwright.network.search.starts import first_design
from platwright.network.solve import solve
from platwright.network.structure import sink_distance, structure
from platwright.progress import Deadline

INF = math.inf
LIMITS = ("exits", "budget", "distance", "spacing")


def any_problem(rng):
    """Return a problem in which nearly everything is allowed, lengths varied now and then."""
    mesh = grid(int(rng.integers(3, 6)), int(rng.integers(3, 6)))
    scenario = ("one sink", "inner", "boundary")[int(rng.integers(3))]
    rules = {"dead_ends": 0.0, "too_close": 0.0, "zigzags": 0.0, "cover_penalty": 3.0}
    problem = paper_problem(mesh, scenario, coverage=int(rng.integers(1, 3)), **rules)
    if scenario == "boundary":
        sinks = np.zeros_like(problem.sinks)
        sinks[rng.choice(np.flatnonzero(mesh.boundary_vertices))] = True
        problem = dataclasses.replace(problem, sinks=sinks)
    if rng.random() < 0.5:
        length = rng.uniform(0.6, 1.5, len(mesh.edges))
        problem = dataclasses.replace(problem, length=length)
    return problem


def grown(problem, rng):
    """Return a random connected design."""
    edges = problem.mesh.edges
    active = np.zeros(len(edges), dtype=bool)
    lively = {*np.flatnonzero(problem.sinks).tolist(), *edges[problem.existing].ravel().tolist()}
    for _ in range(int(rng.integers(8, 26))):
        free = np.flatnonzero(problem.candidate & ~active)
        able = [e for e in free.tolist() if lively.intersection(edges[e].tolist())]
        if not able:
            break
        e = int(rng.choice(able))
        active[e] = True
        lively |= set(edges[e].tolist())
    return active


def limit_of(problem, active, kind, rng):
    """Return a requirement that the design just keeps, or a soft one that it breaks."""
    hard = rng.random() < 0.5
    penalty = INF if hard else 2.0
    metres = 20.0 * problem.length
    if kind == "exits":
        return ExitCount(tuple(np.flatnonzero(problem.sinks).tolist()), 1, 1, 2.0)
    if kind == "budget":
        most = float(metres[active].sum()) * (1.0 if hard else 0.7)
        return LengthBudget(metres, most, 13.0, penalty)
    if kind == "distance":
        distance = sink_distance(problem, active)[problem.mesh.edges[active]]
        share = 1.0 if hard else rng.uniform(0.4, 1.0)
        return MaxDistance(share * float(distance[np.isfinite(distance)].max()) + 1e-5, penalty)
    return junction_spacing(problem, metres, float(rng.choice([20.5, 30.0, 41.0, 61.0])), 2.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", LIMITS)
def test_windows_of_larger_designs_are_exact(kind, monkeypatch):
    """What lies beyond a window and leaves through it is judged rightly."""
    monkeypatch.setattr(windows, "ROUNDS", 200)
    mattered = 0
    for seed in range(24):
        rng = np.random.default_rng(seed)
        problem = any_problem(rng)
        active = grown(problem, rng)
        wanted = limit_of(problem, active, kind, rng)
        problem = dataclasses.replace(problem, requirements=(wanted,))
        evaluator = Evaluator(problem)
        view = windows.Windows(structure(problem))
        free = view.around(int(rng.integers(len(problem.sinks))), 2)
        free = sorted(rng.permutation(free)[:9].tolist())
        if not free or math.isinf(evaluator.objective(active)):
            continue
        options = []
        for bits in itertools.product((False, True), repeat=len(free)):
            option = active.copy()
            option[free] = bits
            options.append(evaluator.evaluate(option))
        best = min(found.objective for found in options)
        found, _ = windows.solve_window(view, free, active, CpOptions(30))
        assert evaluator.objective(found) == pytest.approx(best)
        # without the requirement another choice would have been better
        least = min(
            x.length + x.distance_sum + 3.0 * len(x.uncovered) for x in options if not x.islands
        )
        mattered += least < best - 1e-9
    assert mattered >= 3


def limited_problem(kind, size=8):
    """Return a problem of some 100 edges with a hard limit that plain designs break."""
    problem = paper_problem(grid(size, size), "boundary")
    metres = np.full(len(problem.mesh.edges), 20.0)
    options = tuple(np.flatnonzero(problem.sinks).tolist())
    wanted = {
        "exits": ExitCount(options, 2),
        "budget": LengthBudget(metres, 160.0, 20.0),
        "distance": MaxDistance(3.0),
        "spacing": junction_spacing(problem, metres, 60.5),
    }[kind]
    return dataclasses.replace(problem, requirements=(wanted,))


@pytest.mark.slow
@pytest.mark.parametrize("kind", LIMITS)
@pytest.mark.parametrize("solver", ["cpsat", "highs"])
def test_a_run_keeps_hard_limits(kind, solver):
    problem = limited_problem(kind)
    design = solve(problem, time_limit=20 if solver == "highs" else 6, solver=solver)
    assert not [v for v in check_design(problem, design.active) if v.hard]
    assert design.bound <= design.objective


@pytest.mark.parametrize("kind", ["exits", "budget", "distance"])
def test_a_start_without_limits_is_repaired(kind):
    problem = limited_problem(kind, 8 if kind == "distance" else 12)
    evaluator = Evaluator(problem)
    plain = dataclasses.replace(problem, requirements=())
    start = chord_start(structure(plain), 5.0)
    assert math.isfinite(Evaluator(plain).objective(start))
    if kind == "budget":
        metres = np.full(len(problem.mesh.edges), 20.0)
        spent = 20.0 * float(start.sum())
        limit = LengthBudget(metres, spent - 20.0, 20.0)
        evaluator = Evaluator(dataclasses.replace(problem, requirements=(limit,)))
    assert math.isinf(evaluator.objective(start))
    run = Incumbent(evaluator, Deadline(60.0))
    assert repair(run, start, 1)
    assert not [v for v in check_design(evaluator.problem, run.best) if v.hard]
    again = Incumbent(evaluator, Deadline(60.0))
    repaired_starts(again, structure(evaluator.problem), 1)
    assert again.best is not None
    assert not [v for v in check_design(evaluator.problem, again.best) if v.hard]
    third = Incumbent(evaluator, Deadline(60.0))
    repaired_starts(third, structure(evaluator.problem), 1)
    assert np.array_equal(third.best, again.best)


@pytest.mark.parametrize("sinks", ["boundary", "inner"])
def test_links_are_mended_at_once(sinks):
    plain = paper_problem(grid(10, 10), sinks, weight_length=0.0, weight_distance=1.0)
    links = tuple(point_to_point(plain, patches(plain.mesh, 16.0), tolerance=2.0))
    problem = dataclasses.replace(plain, requirements=links)
    evaluator = Evaluator(problem)
    run = Incumbent(evaluator, Deadline(60.0))
    found = repaired_starts(run, structure(problem), 1)
    assert run.best is not None
    for active in [*found, run.best]:
        assert not [v for v in check_design(problem, active) if v.hard]
    # what they started from does not keep the links
    bare = Incumbent(Evaluator(plain), Deadline(60.0))
    assert any(
        not math.isfinite(evaluator.objective(a)) for a in first_design(bare, structure(plain))
    )


def test_repair_gives_up_on_what_cannot_be():
    problem = limited_problem("exits", 5)
    broken = np.zeros(len(problem.mesh.edges), dtype=bool)
    broken[np.flatnonzero(problem.candidate)[:1]] = True
    run = Incumbent(Evaluator(problem), Deadline(20.0))
    # a dead end is no requirement: nothing to start from
    assert not repair(run, broken, 1)
    assert run.best is None


def test_requirements_are_checked_before_any_work():
    with pytest.raises(InputError, match="places"):
        ExitCount((), 1)
