"""What makes runs the same: searches that end by their work, their bounds, and seeds."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
from platwright.errors import InputError
from platwright.network.examples import PAPER_MESHES, paper_problem
from platwright.network.solve import solve
from platwright.network.specification import Specification
from platwright.progress import Silent


class Slow(Silent):
    """Takes its time to hear of news, as on a busy machine."""

    def search(self, state):
        time.sleep(0.15 if state.incumbent else 0.0)


def test_a_search_that_ends_by_its_work_has_the_same_bound_however_slow():
    problem = paper_problem(PAPER_MESHES[312]())
    found = [
        solve(problem, time_limit=600.0, iterations=6, threads=threads, progress=progress)
        for threads, progress in ((1, None), (2, Slow()), (1, Slow()))
    ]
    for other in found[1:]:
        np.testing.assert_array_equal(found[0].active, other.active)
        assert (found[0].objective, found[0].bound) == (other.objective, other.bound)
    assert 0 < found[0].bound <= found[0].objective


def test_more_work_is_never_worse():
    problem = paper_problem(PAPER_MESHES[312]())
    few, many = (
        solve(problem, time_limit=600.0, iterations=n, threads=1).objective for n in (2, 30)
    )
    assert many <= few


def test_effort_is_part_of_what_is_asked():
    spec = Specification(effort=12.5)
    assert Specification.from_json(spec.to_json()) == spec
    assert dataclasses.replace(spec, effort=None) == Specification()
    with pytest.raises(InputError, match="effort"):
        Specification(effort=0.0)
