"""The paper's stochastic search: valid designs, seeds, its bookkeeping against the evaluator."""

from __future__ import annotations

import dataclasses
import math
import time

import numpy as np
import pytest
from clock import allowed
from platwright.errors import CancelledError, InfeasibleError, InputError
from platwright.mesh.grids import grid
from platwright.network.checks.validation import check_design
from platwright.network.evaluate import Evaluator, evaluate
from platwright.network.examples import paper_problem
from platwright.network.search.annealing import HARD, _Steps, anneal
from platwright.network.solve import solve
from platwright.progress import Silent

RULES = {
    "paper": {},
    "distance": {"weight_length": 0.5, "weight_distance": 1.0},
    "all": {"dead_ends": 3.0, "branches": 1.5, "t_junctions": 0.5, "too_close": 4.0},
}


def problem(rules="paper", size=6, scenario="boundary"):
    return paper_problem(grid(size, size), scenario, coverage=1, **RULES[rules])


@pytest.mark.parametrize("rules", sorted(RULES))
@pytest.mark.parametrize("scenario", ["boundary", "inner"])
def test_designs_keep_every_hard_rule_and_are_no_better_than_proven(rules, scenario):
    asked = problem(rules, 5, scenario)
    design = anneal(asked, time_limit=20, passes=8)
    assert not [one.text for one in check_design(asked, design.active) if one.hard]
    assert design.objective == evaluate(asked, design.active).objective
    exact = solve(asked, time_limit=20)
    assert design.objective >= exact.bound - 1e-6
    values = [value for _, value in design.history]
    assert values == sorted(values, reverse=True)
    assert values[-1] == design.objective
    # the first network that keeps all rules is not the last
    assert len(design.history) > 1 or design.objective == exact.objective


def test_the_same_seed_gives_the_same_design():
    asked = problem()
    first, again = (anneal(asked, time_limit=60, seed=5, passes=2) for _ in range(2))
    assert np.array_equal(first.active, again.active)
    others = {anneal(asked, time_limit=60, seed=s, passes=1).active.tobytes() for s in range(5)}
    assert len(others) > 1


@pytest.mark.parametrize("rules", sorted(RULES))
def test_what_each_operation_costs_is_what_the_evaluator_says(rules):
    """With hard rules as prices, so that every network has one."""
    asked = problem(rules, 4)
    soft = {name: HARD for name in ("dead_ends", "too_close") if math.isinf(getattr(asked, name))}
    priced = Evaluator(dataclasses.replace(asked, **soft))
    steps = _Steps(asked, Evaluator(asked))
    rng = np.random.default_rng(1)
    active = steps.candidate.copy()
    for _ in range(12):
        assert steps.value(active) == pytest.approx(priced.objective(active))
        numbers, values = steps.offers(active)
        tried = 0
        for number, value in zip(numbers.tolist(), values.tolist()):
            if not steps._connected(active, number):
                continue
            after = active.copy()
            after[list(steps.edges[number])] = bool(steps.adds[number])
            assert value == pytest.approx(priced.objective(after))
            tried += 1
        offered = set(numbers.tolist())
        # what is not offered breaks something that was kept, or changes what is not there
        for number in rng.choice(len(steps.edges), 30).tolist():
            after = active.copy()
            after[list(steps.edges[number])] = bool(steps.adds[number])
            changed = (after != active).sum() == len(steps.edges[number])
            worse = steps.broken(after) > steps.broken(active)
            if changed and not worse and math.isfinite(priced.objective(after)):
                assert number in offered
        found = steps.pick(active, (numbers, values), int(rng.integers(8)))
        if found is None:
            break
        active[list(steps.edges[found[0]])] = bool(steps.adds[found[0]])
    assert tried or found is None


class Hasty(Silent):
    """Cancels after some seconds, or once there is a design."""

    def __init__(self, seconds=math.inf):
        self.end, self.found = time.monotonic() + seconds, False

    def search(self, _):
        self.found = True

    def cancelled(self):
        return self.found or time.monotonic() > self.end


def test_cancel_keeps_the_best_or_says_that_there_is_none():
    asked = problem(size=12)
    began = time.monotonic()
    design = anneal(asked, time_limit=60, progress=Hasty())
    assert design.stopped == "cancelled"
    assert time.monotonic() - began < allowed(20)
    with pytest.raises(CancelledError):
        anneal(asked, time_limit=60, progress=Hasty(0.0))


def test_time_is_kept_and_nothing_found_is_told():
    began = time.monotonic()
    with pytest.raises(InfeasibleError, match="found no valid network in"):
        anneal(problem(size=20), time_limit=0.05)
    assert time.monotonic() - began < allowed(5)


def test_requirements_of_the_whole_are_refused():
    asked = dataclasses.replace(problem(), requirements=(object(),))
    with pytest.raises(InputError, match="no requirements of the network as a whole"):
        anneal(asked, time_limit=1)


def test_it_is_a_method_of_solve():
    asked = problem(size=4)
    design = solve(asked, time_limit=1, seed=3, method="annealing")
    assert not [one.text for one in check_design(asked, design.active) if one.hard]
    with pytest.raises(InputError, match=r"no method luck\. Choose program or annealing"):
        solve(asked, time_limit=1, method="luck")
