"""Streets across blocks, worked out by hand, and held to what a planner would demand."""

from __future__ import annotations

import math

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.measure import validate_network
from platwright.network.specification import Specification
from platwright.site import AccessPoint, BoundaryStreet
from platwright.streets import design_streets, plan_layers
from platwright.streets.blocks import Block, block_size
from platwright.streets.cross_streets import Surroundings, cross_streets, cut
from shapely.geometry import LineString, Point, Polygon, box

from .conftest import make_site

SPEC = Specification()
NOTHING = shapely.Polygon()


def block(polygon: Polygon) -> Block:
    return Block(polygon, *block_size(polygon))


def around(
    streets: shapely.Geometry,
    *,
    ends: list[tuple[float, float]] | None = None,
    arrivals: tuple[AccessPoint, ...] = (),
    blocked: shapely.Geometry = NOTHING,
) -> Surroundings:
    return Surroundings(streets, np.array(ends or []).reshape(-1, 2), arrivals, blocked)


def pieces(polygon: Polygon, streets: list[LineString]) -> list[Polygon]:
    parts = [polygon]
    for line in streets:
        parts = [p for part in parts for p in cut(part, line)]
    return parts


def test_a_long_block_is_cut_into_as_few_equal_pieces_as_need_be():
    long = box(0, 0, 400, 60)
    found = cross_streets([block(long)], SPEC, around(long.exterior))
    assert len(found) == 2  # 400 m in pieces of at most 150 m
    lengths = sorted(block_size(p)[1] for p in pieces(long, [c.line for c in found]))
    assert lengths == pytest.approx([400 / 3] * 3, abs=12)
    for street in found:
        (x0, y0), (x1, y1) = street.line.coords
        assert x0 == pytest.approx(x1, abs=0.01)
        assert {round(y0), round(y1)} == {0, 60}


def test_a_block_as_long_as_asked_is_left_alone():
    asked = box(0, 0, 150, 72)
    assert cross_streets([block(asked)], SPEC, around(asked.exterior)) == []


def test_no_street_ends_at_a_side_without_one():
    long = box(0, 0, 400, 60)
    south = LineString([(0, 0), (400, 0)])
    assert cross_streets([block(long)], SPEC, around(south)) == []


def test_a_cross_street_goes_on_into_the_street_opposite():
    long = box(0, 0, 280, 60)
    found = cross_streets([block(long)], SPEC, around(long.exterior, ends=[(131.0, 0.0)]))
    assert len(found) == 1
    assert min(math.dist(xy, (131, 0)) for xy in found[0].line.coords) < 0.01


def test_an_arriving_street_goes_on_through_a_block():
    wide = box(0, 0, 150, 70)
    point = AccessPoint((75.0, 0.0), (75.0, -8.0), (0.1, 0.995), "Mill Lane")
    found = cross_streets([block(wide)], SPEC, around(wide.exterior, arrivals=(point,)))
    assert [c.arrival for c in found] == [point]
    assert found[0].line.coords[0] == pytest.approx((75, 0), abs=0.01)


def test_an_arriving_street_does_not_go_on_where_it_would_leave_a_thin_block():
    square = box(0, 0, 72, 72)
    point = AccessPoint((36.0, 0.0), (36.0, -8.0), (0.0, 1.0), "Mill Lane")
    assert cross_streets([block(square)], SPEC, around(square.exterior, arrivals=(point,))) == []


def test_with_a_weight_of_nothing_no_street_is_continued():
    wide = box(0, 0, 150, 70)
    point = AccessPoint((75.0, 0.0), (75.0, -8.0), (0.0, 1.0), "Mill Lane")
    spec = Specification(weight_continue=0.0)
    assert cross_streets([block(wide)], spec, around(wide.exterior, arrivals=(point,))) == []


def test_cross_streets_keep_off_obstacles():
    long = box(0, 0, 280, 60)
    house = box(120, 20, 160, 40)
    found = cross_streets([block(long)], SPEC, around(long.exterior, blocked=house))
    assert found
    assert all(c.line.distance(house) >= 4 for c in found)


POND = box(100, 15, 180, 45)


def test_a_pond_is_not_crossed():
    long = box(0, 0, 280, 60).difference(POND)
    found = cross_streets([block(long)], SPEC, around(LineString(long.exterior)))
    assert all(not c.line.intersects(POND) for c in found)


def test_streets_lead_to_the_street_around_a_pond_from_both_sides():
    long = box(0, 0, 280, 60).difference(POND)
    found = cross_streets([block(long)], SPEC, around(long.boundary))
    assert len(found) == 2
    assert all(c.line.touches(POND) and c.line.length == pytest.approx(15) for c in found)


def test_a_street_that_ends_blind_in_the_block_is_not_crossed():
    long = box(0, 0, 280, 60)
    blind = LineString([(0, 30), (270, 30)])
    found = cross_streets([block(long)], SPEC, around(shapely.union(long.exterior, blind)))
    assert all(not c.line.crosses(blind) for c in found)


@settings(max_examples=60, deadline=None)
@given(
    length=st.floats(160, 900),
    width=st.floats(20, 120),
    lean=st.floats(-0.4, 0.4),
    taper=st.floats(0.5, 1.0),
    turn=st.floats(0, 360),
    wall=st.booleans(),
)
def test_cross_streets_run_from_street_to_street(length, width, lean, taper, turn, wall):
    outline = Polygon(
        [(0, 0), (length, 0), (length + lean * width, taper * width), (lean * width, width)]
    )
    outline = shapely.affinity.rotate(outline, turn, origin=(0, 0))
    corners = shapely.get_coordinates(outline)
    streets = LineString(corners[:4]) if wall else LineString(outline.exterior)
    found = cross_streets([block(outline)], SPEC, around(streets))
    for street in found:
        assert outline.buffer(0.2).covers(street.line)
    built = [streets]
    for street in found:
        for xy in street.line.coords:
            assert min(Point(xy).distance(s) for s in built) < 0.15
        built.append(street.line)
    parts = pieces(outline, [c.line for c in found])
    assert len(parts) == len(found) + 1
    assert sum(p.area for p in parts) == pytest.approx(outline.area)


ARM = Polygon(
    [(0, 0), (300, 0), (300, 220), (260, 220), (260, 640), (225, 640), (225, 220), (0, 220)]
)


def ringed(polygon: Polygon, **given: object):
    """A site whose edge is the centre line of a street all round."""
    ring = LineString(polygon.exterior)
    return make_site(polygon, streets=(BoundaryStreet(ring, "Ring Street"),), **given)


@pytest.mark.parametrize("sinks", ["streets", "access"])
def test_a_narrow_arm_gets_cross_streets_with_distances(sinks):
    points = tuple(
        AccessPoint(xy, xy, way, f"Street {i}")
        for i, (xy, way) in enumerate([((0.0, 110.0), (1.0, 0.0)), ((150.0, 0.0), (0.0, 1.0))])
    )
    plan = design_streets([ringed(ARM, access=points)], Specification(sink_mode=sinks))
    own = plan.plans[0]
    in_arm = [c for c in own.cross_streets if c.line.centroid.y > 230]
    assert len(in_arm) >= 2
    assert max(b.length for b in own.blocks) <= 1.02 * SPEC.block_length
    assert all(math.isfinite(s.dist_start) and math.isfinite(s.dist_end) for s in own.segments)
    if sinks == "access":
        ends = [s for s in own.segments if s.line.centroid.y > 300]
        assert all(s.distance > 150 for s in ends)  # back along the arm to either access point


def test_cross_streets_pass_the_independent_check():
    plan = design_streets([ringed(ARM)], SPEC)
    layers = plan_layers(plan)
    assert plan.plans[0].cross_streets
    site = plan.plans[0].site
    frame = gpd.GeoDataFrame(geometry=[site.polygon], crs=site.crs)
    roads = gpd.GeoDataFrame(geometry=[s.line for s in site.boundary_streets], crs=site.crs)
    report = validate_network(layers["streets"], site=frame, boundary_streets=roads)
    errors = report.problems[report.problems["severity"] == "error"]
    assert errors.empty, list(errors["text"])


def test_a_square_block_a_little_too_long_is_not_halved():
    spec = Specification(block_width=80.0, block_length=80.0)
    square = box(0, 0, 100, 75)
    assert cross_streets([block(square)], spec, around(square.exterior)) == []
