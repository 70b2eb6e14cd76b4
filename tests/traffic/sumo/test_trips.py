"""Trips drawn from a demand: exact totals, every pair as often as expected."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.traffic.sumo import SimulationOptions
from platwright.traffic.sumo.trips import draw
from platwright.traffic.types import BOUNDARY_INTERIOR, INTERIOR_BOUNDARY, KINDS, Demand

ROWS = st.lists(st.floats(0.0, 20.0), min_size=9, max_size=9)


@given(cells=ROWS, seed=st.integers(0, 1000), minutes=st.integers(0, 60))
def test_every_pair_has_its_demand_rounded_down_or_up(make_demand, cells, seed, minutes):
    matrix = np.asarray(cells).reshape(3, 3)
    if matrix.sum() < 1.0:
        matrix[0, 1] += 1.0
    places = make_demand({}, [(0, 1.0), (0, 2.0), (0, 3.0)]).places
    options = SimulationOptions(seed=seed, warm_up=minutes)
    trips = draw(Demand(places, {INTERIOR_BOUNDARY: matrix}), options)
    hours = 1.0 + minutes / 60.0
    expected = matrix * hours
    drawn = np.zeros((3, 3))
    np.add.at(drawn, (trips.origin, trips.destination), 1)
    assert len(trips.kind) == np.floor(expected.sum() + 0.5)
    # the total is rounded, so that a step is a little more or less than one trip
    step = expected.sum() / len(trips.kind)
    assert (np.abs(drawn - expected / step) < 1.0 + 1e-9).all()
    assert set(trips.kind) == {KINDS.index(INTERIOR_BOUNDARY)}
    assert (np.diff(trips.depart) >= 0).all()
    assert trips.depart.min() >= 0
    assert trips.depart.max() < 3600.0 * hours


def test_departures_are_spread_over_all_the_time(make_demand):
    demand = make_demand({(0, 1): 4000.0}, [(0, 1.0), (0, 2.0)])
    depart = draw(demand, SimulationOptions(warm_up=0.0, seed=3)).depart
    quarters, _ = np.histogram(depart, bins=4, range=(0.0, 3600.0))
    # a binomial count of mean 1000 has a standard deviation of 27
    assert (np.abs(quarters - 1000) < 140).all()
    gaps = np.diff(depart)
    # as in a Poisson process, the standard deviation of gaps is about their mean
    assert 0.8 < gaps.std() / gaps.mean() < 1.5


def test_the_seed_decides(make_demand):
    demand = make_demand({(0, 1): 50.0, (1, 0): 50.0}, [(0, 1.0), (0, 2.0)])
    one, same, other = (draw(demand, SimulationOptions(seed=seed)) for seed in (1, 1, 2))
    assert np.array_equal(one.depart, same.depart)
    assert not np.array_equal(one.depart, other.depart)


@pytest.mark.parametrize(
    ("number", "words"),
    [(0.0, "less than one trip"), (-1.0, "below 0"), (np.nan, "below 0"), (1e6, "at most")],
)
def test_a_demand_that_cannot_be_simulated_is_told(make_demand, number, words):
    demand = make_demand({(0, 1): number}, [(0, 1.0), (0, 2.0)], kind=BOUNDARY_INTERIOR)
    with pytest.raises(InputError, match=words):
        draw(demand, SimulationOptions())


@pytest.mark.parametrize(
    "wrong",
    [{"hours": 0.0}, {"routes": "best"}, {"seed": -1}, {"patience": 0.0}, {"iterations": 0}],
)
def test_options_out_of_range_are_told(wrong):
    with pytest.raises(InputError, match=r"Choose|Give a value"):
        SimulationOptions(**wrong)
