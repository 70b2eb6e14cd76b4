"""The ground that traffic comes from, and layers that stand for it."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.site.repair import Problems
from platwright.traffic.demand import DemandLayers, DemandRules, read_demand
from platwright.traffic.ground import even_samples
from platwright.traffic.network import read_network
from platwright.traffic.run import TrafficOptions, read_traffic, report_traffic
from platwright.traffic.types import INTERIOR_BOUNDARY
from shapely.geometry import MultiPolygon, Point, box
from trafficworld import grid, layer, sites

OUT = DemandRules(shares={INTERIOR_BOUNDARY: 1.0})
SITE = sites(box(0, 0, 1000, 500))
STREET = layer([[(0, 250), (1000, 250)]])
GATES = sites(Point(0, 250), Point(1000, 250))


def demand_of(problems=None, **given):
    network, _ = read_network(STREET)
    layers = DemandLayers(**{"site": SITE, "gates": GATES, **given})
    return read_demand(network, layers, OUT, problems)


def test_buildings_outside_the_site_are_none_of_its_traffic():
    houses = sites(Point(100, 300), Point(900, 200), Point(3000, 250), flats=[1, 3, 96])
    problems = Problems()
    demand = demand_of(problems, weights=houses, weight_field="flats")
    assert demand.places.weight[~demand.places.gates].tolist() == [0.25, 0.75]
    (told,) = problems.to_frame(SITE.crs)["problem"]
    assert told.startswith("1 of 3 features")
    with pytest.raises(InputError, match="inside the site"):
        demand_of(weights=houses.iloc[2:], weight_field="flats")
    # Without a site nothing is outside of it.
    network, _ = read_network(grid(10, 10))
    away = sites(Point(500, 520), Point(1040, 510), flats=[1, 1])
    given = DemandLayers(weights=away, weight_field="flats")
    assert (read_demand(network, given).places.weight > 0).sum() == 2


def test_a_weight_without_end_is_refused():
    houses = sites(Point(100, 300), Point(900, 200), flats=[1, np.inf])
    with pytest.raises(InputError, match=r"feature 1.*finite"):
        demand_of(weights=houses, weight_field="flats", names={"weights": "Houses"})


def test_a_site_layer_without_a_polygon_is_no_site():
    for empty in (SITE.iloc[:0], sites(box(0, 0, 1, 1)).assign(geometry=[None])):
        with pytest.raises(InputError, match=r"Sites.*has no polygon"):
            read_demand(read_network(grid(3, 3))[0], DemandLayers(site=empty.set_crs(
                32633, allow_override=True), names={"site": "Sites"}))  # fmt: skip


def test_junctions_of_which_none_is_an_exit_are_told_so():
    with pytest.raises(InputError, match="is_sink"):
        demand_of(gates=GATES.assign(is_sink=False))


@settings(max_examples=20, deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(0, 9), st.integers(0, 9), st.integers(10, 90), st.integers(10, 90)),
        min_size=1, max_size=5,
    )
)  # fmt: skip
def test_samples_are_even_over_every_part_of_the_ground(corners):
    shapes = [box(i * 100, j * 100, i * 100 + w, j * 100 + h) for i, j, w, h in corners]
    ground = shapely.union_all(shapes)
    points = even_samples(ground)
    assert len(np.unique(points, axis=0)) == len(points)
    assert shapely.contains_xy(ground, *points.T).all()
    cell = ground.area / 20_000
    for part in shapely.get_parts(ground):
        count = shapely.contains_xy(part, *points.T).sum()
        # A grid misses the area by the cells that its edge cuts, at most.
        assert abs(count * cell - part.area) <= 1.5 * part.length * np.sqrt(cell)


def test_sites_far_apart_take_no_more_memory_than_one():
    ground = MultiPolygon([box(0, 0, 300, 300), box(2e4, 2e4, 20_300, 20_300)])
    tracemalloc.start()
    points = even_samples(ground)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(points) == pytest.approx(20_000, rel=0.02)
    assert (points[:, 0] < 1000).sum() == pytest.approx(10_000, rel=0.02)
    assert most < 20e6


def test_an_unknown_method_is_refused_after_reading_too():
    traffic = read_traffic(STREET, DemandLayers(site=SITE))
    with pytest.raises(InputError, match="no method"):
        report_traffic(traffic, TrafficOptions(method="guess"))
