"""Designs with limits on the whole network, judged from their layers alone."""

from __future__ import annotations

import itertools

import geopandas as gpd
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.errors import InfeasibleError
from platwright.measure import validate_network
from platwright.network.specification import Specification
from platwright.site import BoundaryStreet, Site
from platwright.streets import design_streets, plan_layers
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Point, Polygon, box

UTM = CRS.from_epsg(25832)
#: Sites by name: polygon, and how far outside its edge the centre lines of the roads lie.
SITES = {
    "rectangle": (box(0, 0, 432, 360), 0.0),
    "angle": (Polygon([(0, 0), (432, 0), (432, 216), (216, 216), (216, 432), (0, 432)]), 8.0),
    "slanted": (Polygon([(0, 0), (460, 60), (400, 380), (-40, 300)]), 8.0),
    "obstacle": (box(0, 0, 432, 432), 0.0),
}
OBSTACLE = Point(230, 230).buffer(60)
#: Wishes by name; each must hold for every design that is returned.
WISHES = {
    "exits": {"exits": 3},
    "budget": {"length_budget": 1500.0},
    "way out": {"max_distance": 200.0},
    "spacing": {"junction_spacing": 55.0},
    "one-way": {"one_way": "all"},
    "exits and way out": {"exits": 4, "max_distance": 400.0},
    "one-way within a way out": {"one_way": "all", "max_distance": 600.0},
    "straight": {"coverage": 90.0, "coverage_unit": "straight"},
}


def the_site(name):
    polygon, off = SITES[name]
    road = LineString(polygon.buffer(off, join_style="mitre").exterior)
    corners = list(road.coords)
    streets = tuple(
        BoundaryStreet(LineString(pair), f"Street {k}")
        for k, pair in enumerate(itertools.pairwise(corners))
    )
    return Site(
        name=name,
        feature=1,
        polygon=shapely.geometry.polygon.orient(polygon),
        crs=UTM,
        source_crs=UTM,
        street_frontage=MultiLineString([LineString(polygon.exterior)]),
        boundary_streets=streets,
        access_points=(),
        obstacles=(OBSTACLE,) if name == "obstacle" else (),
        inner_streets=(),
    )


def verdict(site, spec):
    """Design, and return the new streets and the errors that the checker finds."""
    plan = design_streets([site], spec)
    streets = plan_layers(plan)["streets"].set_index("street_id", drop=False)

    def frame(*shapes):
        return gpd.GeoDataFrame(geometry=list(shapes), crs=UTM)

    longest = float(plan.plans[0].network.ground.mesh.lengths.max())
    edge = plan.plans[0].network.ground.mesh.edge_length
    paper = spec.rules == "paper"
    reach = spec.coverage if spec.coverage_unit == "straight" else edge
    report = validate_network(
        streets,
        site=frame(site.polygon),
        obstacles=frame(*site.obstacles),
        boundary_streets=frame(*(street.line for street in site.boundary_streets)),
        coverage_m=reach + longest * 0.5**0.5 if paper else None,
        exits_most=spec.exits,
        length_budget_m=spec.length_budget,
        max_distance_m=spec.max_distance,
        junction_spacing_m=spec.junction_spacing,
        functions=float("inf") if paper else 1.0,
        edge_length=edge,
    )
    rows = report.problems[report.problems["severity"] == "error"]
    if plan.plans[0].uncovered:
        # places that limits leave without a street are named one by one
        named = plan_layers(plan)["problems"]["problem"].str.contains("No street comes near")
        assert named.sum() == len(plan.plans[0].uncovered)
        rows = rows[rows["kind"] != "coverage"]
    found = [f"{r.kind}: {r.text} ({r.feature}) {r.geometry.wkt[:80]}" for r in rows.itertuples()]
    return streets[streets["status"] == "new"], found


#: Wish, site and number of levels: each wish alone, or two together.
CASES = [
    ("exits", "rectangle", 1),
    ("exits", "angle", 2),
    ("budget", "obstacle", 1),
    ("budget", "slanted", 2),
    ("way out", "angle", 1),
    ("way out", "obstacle", 2),
    ("spacing", "slanted", 1),
    ("spacing", "rectangle", 2),
    ("one-way", "obstacle", 1),
    ("one-way", "slanted", 2),
    ("exits and way out", "angle", 1),
    ("one-way within a way out", "rectangle", 1),
    ("straight", "angle", 1),
]


@pytest.mark.slow
@pytest.mark.parametrize(("wish", "name", "levels"), CASES)
def test_designs_keep_what_they_were_asked(wish, name, levels):
    spec = Specification(
        rules="paper", block_width=108.0, levels=levels, time_limit=6.0, **WISHES[wish]
    )
    new, found = verdict(the_site(name), spec)
    assert len(new)
    assert not found
    if "one_way" in WISHES[wish]:
        assert new["oneway"].astype(bool).any()


@pytest.mark.slow
@settings(deadline=None, max_examples=6, suppress_health_check=list(HealthCheck))
@given(
    name=st.sampled_from(sorted(SITES)),
    rules=st.sampled_from(["paper", "planner"]),
    levels=st.sampled_from([1, 2]),
    wishes=st.fixed_dictionaries(
        {},
        optional={
            "exits": st.integers(2, 6),
            "length_budget": st.floats(1200.0, 3000.0),
            "max_distance": st.floats(250.0, 700.0),
            "junction_spacing": st.floats(20.0, 80.0),
            "one_way": st.sampled_from(["local", "all"]),
        },
    ),
)
def test_designs_for_random_specifications_keep_them(name, rules, levels, wishes):
    """Whatever is returned has no error; that nothing is found in so little time may be."""
    spec = Specification(rules=rules, block_width=108.0, levels=levels, time_limit=4.0, **wishes)
    try:
        _, found = verdict(the_site(name), spec)
    except InfeasibleError:
        return
    assert not found
