"""Starts for any sinks, windows in parallel, and runs that do not depend on timing."""

import dataclasses
import itertools
import math
import threading
import time

import numpy as np
import pytest
from clock import allowed
from platwright.mesh.grids import fan, grid
from platwright.network.checks.validation import check_design
from platwright.network.cp.sat import CpOptions
from platwright.network.evaluate import Evaluator
from platwright.network.examples import PAPER_MESHES, cut_grid, paper_problem
from platwright.network.incumbent import Incumbent
from platwright.network.search import cp_strategy
from platwright.network.search.parallel import Course, Crew
from platwright.network.search.starts import Lines, chains, connected, first_design, prune
from platwright.network.search.window_search import WindowSearch
from platwright.network.search.windows import Windows, solve_window
from platwright.network.solve import solve
from platwright.network.structure import structure
from platwright.progress import Deadline, Silent

INF = math.inf
SETTINGS = {
    "boundary": ("boundary", {}),
    "one sink": ("one sink", {}),
    "inner": ("inner", {}),
    "distance": ("one sink", {"weight_length": 0.0, "weight_distance": 1.0}),
    "dead ends": ("one sink", {"dead_ends": 0.0}),
    "no zigzags": ("inner", {"zigzags": INF}),
    "T weight": ("boundary", {"t_junctions": 10.0}),
    "no branches": ("boundary", {"branches": INF}),
}


def valid(problem, active):
    """Tell whether the independent checker finds no broken hard rule."""
    return not [v for v in check_design(problem, active) if v.hard]


def started(problem):
    """Return a run after its first design."""
    run = Incumbent(Evaluator(problem), Deadline(60.0))
    first_design(run, structure(problem))
    return run


@pytest.mark.parametrize("size", [312, 662])
@pytest.mark.parametrize("name", sorted(SETTINGS))
def test_every_sink_setting_has_a_start_without_search(name, size):
    scenario, rules = SETTINGS[name]
    problem = paper_problem(PAPER_MESHES[size](), scenario, **rules)
    run = started(problem)
    assert run.best is not None
    assert valid(problem, run.best)


def test_three_gaps_in_the_wall_and_irregular_meshes_have_starts():
    mesh = PAPER_MESHES[662]()
    rim = np.flatnonzero(mesh.boundary_vertices & (mesh.valences == 3))
    walls = paper_problem(mesh, "one sink", exits=rim[[3, 20, 40]].tolist())
    assert int(walls.sinks.sum()) == 3
    for problem in (walls, paper_problem(fan(5, 6), "one sink"), paper_problem(fan(3, 6))):
        run = started(problem)
        assert run.best is not None
        assert valid(problem, run.best)


def test_paper_meshes_have_the_paper_s_numbers_of_edges():
    sizes = {name: len(make().edges) for name, make in PAPER_MESHES.items() if name != 660}
    assert all(name == size for name, size in sizes.items())
    assert len(cut_grid(3, 3, ((1, 1), (0, 0), (0, 0), (0, 0))).faces) == 8


def test_lines_of_a_grid_lie_at_even_distances():
    mesh = grid(12, 10)
    lines = Lines(structure(paper_problem(mesh, "inner")))
    assert sorted(map(len, lines.lines)) == [10] * 13 + [12] * 11
    assert not lines.crooked
    assert sorted(len(lines.beside[a]) for a in range(24)) == [1] * 4 + [2] * 20
    active = lines.every(4)
    upright = mesh.vertices[mesh.edges[active]][:, :, 0]
    columns = sorted(set(upright[upright[:, 0] == upright[:, 1]][:, 0].tolist()))
    # the sinks of the left half lie on the third column
    assert set(np.diff(columns)) <= {4.0, 2.0, 3.0}
    assert 3.0 in columns


def test_what_leads_nowhere_is_cut_off():
    mesh = grid(6, 6)
    problem = paper_problem(mesh, "one sink")
    index = structure(problem)
    active = np.zeros(len(mesh.edges), dtype=bool)
    ring = [(23, 24), (24, 25), (25, 32), (31, 32), (30, 31), (23, 30)]
    stub, island = [(24, 17)], [(8, 9), (9, 16), (15, 16), (8, 15)]
    top = int(problem.sinks.argmax())
    way = [(top, top - 7), (top - 7, top - 14)]
    assert top - 14 == 31
    for u, v in (*ring, *stub, *island, *way):
        e = mesh.edge_between(u, v)
        active[e] = True
    kept = connected(index, active)
    left = {tuple(sorted(pair)) for pair in mesh.edges[kept].tolist()}
    # (top, top - 7) is barred on this mesh only if the wall says so
    assert left == {tuple(sorted(p)) for p in (*ring, *way)}
    assert sorted(map(len, chains(index, kept))) == [2, 6]


def test_pruning_makes_designs_cheaper_and_keeps_them_valid():
    problem = paper_problem(grid(12, 12), "one sink")
    index, evaluator = structure(problem), Evaluator(problem)
    dense = Lines(index).every(2)
    assert valid(problem, dense)
    less = prune(index, evaluator, dense)
    assert valid(problem, less)
    assert evaluator.objective(less) < 0.8 * evaluator.objective(dense)
    # nothing that is left can be spared
    for chain in chains(index, less):
        tried = less.copy()
        tried[chain] = False
        assert evaluator.objective(connected(index, tried)) >= evaluator.objective(less) - 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["boundary", "inner"])
@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_same_seed_and_iterations_give_the_same_design(scenario, weight, monkeypatch):
    problem = paper_problem(grid(10, 9), scenario, weight_distance=weight)
    found = []
    for threads, pause in ((1, 0.0), (2, 0.02)):
        monkeypatch.setattr(cp_strategy, "THREADS", threads)
        # another timing must not make another design
        progress = Slow(pause)
        found.append(solve(problem, time_limit=200, seed=3, iterations=5, progress=progress))
    np.testing.assert_array_equal(found[0].active, found[1].active)
    assert valid(problem, found[0].active)


class Slow(Silent):
    """Takes its time to hear of news."""

    def __init__(self, pause):
        self.pause = pause

    def search(self, state):
        time.sleep(self.pause if state.incumbent else 0.0)


def test_results_do_not_depend_on_the_number_of_threads():
    problem = paper_problem(grid(12, 12), "one sink")
    evaluator, index = Evaluator(problem), structure(problem)
    start = started(problem).best
    ends = []
    for threads in (1, 3):
        run = Incumbent(evaluator, Deadline(200.0))
        search = WindowSearch(Windows(index), evaluator, start.copy(), seed=2)
        with Crew(search.windows, threads) as crew:
            course = Course(search, crew)
            for _ in range(6):
                assert course.step(run, run.enough)
        ends.append(search.active)
        assert search.value == pytest.approx(evaluator.objective(search.active))
    np.testing.assert_array_equal(*ends)
    assert evaluator.objective(ends[0]) < evaluator.objective(start)


def test_windows_with_least_distances_are_valid_and_exact_in_what_they_count():
    problem = paper_problem(grid(6, 6), "one sink", weight_length=1.0, weight_distance=1.0)
    index, evaluator = structure(problem), Evaluator(problem)
    far = np.array(index.reach)

    def counted(active):
        ends = np.unique(problem.mesh.edges[active])
        off = ~problem.sinks[ends] & ~np.array(index.street)[ends]
        return float(active.sum()) + float(far[ends[off]].sum())

    windows, rng = Windows(index), np.random.default_rng(3)
    active, least = started(problem).best, []
    for _ in range(12):
        free = windows.around(int(rng.integers(len(problem.sinks))), 2)
        free = sorted(rng.permutation(free)[:9].tolist())
        found, _ = solve_window(windows, free, active, CpOptions(30), distances="least")
        assert valid(problem, found)
        options = []
        for bits in itertools.product((False, True), repeat=len(free)):
            option = active.copy()
            option[free] = bits
            if math.isfinite(evaluator.objective(option)):
                options.append(counted(option))
        assert counted(found) == pytest.approx(min(options))
        least.append(counted(active) - counted(found))
        active = found
    assert max(least) > 0


def test_a_crew_that_stops_leaves_no_work_behind():
    problem = paper_problem(PAPER_MESHES[662](), "inner", weight_distance=1.0, weight_length=0.0)
    run = started(problem)
    search = WindowSearch(
        Windows(structure(problem)), run.evaluator, run.best, radius=9, effort=9.0
    )
    with Crew(search.windows, 2) as crew:
        course = Course(search, crew)
        began = time.monotonic()
        # windows may be solved before the stop; those drawn after them are under way then
        while course.step(run, lambda: time.monotonic() > began + 0.3):
            assert time.monotonic() < began + 5.0
    end = time.monotonic()
    while any(t.name.startswith("window") and t.is_alive() for t in threading.enumerate()):
        time.sleep(0.02)
        # generous, for busy machines
        assert time.monotonic() < end + 5.0


class Impatient(Silent):
    """Cancels some seconds after the first design."""

    def __init__(self, after):
        self.after = after
        self.end = math.inf

    def search(self, state):
        if state.incumbent is not None:
            self.end = min(self.end, time.monotonic() + self.after)

    def cancelled(self):
        return time.monotonic() > self.end


@pytest.mark.parametrize("after", [0.0, 0.4, 2.5])
def test_cancelling_takes_less_than_a_second_and_keeps_the_design(after):
    problem = paper_problem(grid(24, 24), "inner", weight_distance=1.0)
    progress = Impatient(after)
    design = solve(problem, time_limit=60.0, progress=progress)
    # generous, for busy machines: half a second is usual
    assert time.monotonic() - progress.end < allowed(2.0)
    assert design.stopped == "cancelled"
    assert valid(problem, design.active)


def test_faint_distances_are_settled_in_the_end():
    problem = paper_problem(grid(6, 6), weight_distance=1e-4)
    exact = solve(problem, time_limit=30.0)
    assert exact.stopped == "optimal"
    plain = dataclasses.replace(problem, weight_distance=0.0)
    assert exact.objective == pytest.approx(
        Evaluator(plain).objective(exact.active)
        + Evaluator(problem).evaluate(exact.active).distance_sum
    )
