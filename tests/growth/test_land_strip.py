"""The strip between a site and the roads along its edge: streets cross it, and nothing else."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
import shapely
from platwright.growth.grammars.shipped import shipped_grammar
from platwright.growth.land.ground import ground_of_sites
from platwright.growth.layers.ways import node_kinds
from platwright.growth.onward import grow_on
from platwright.growth.rules import GrowthRules
from platwright.site import prepare_sites
from shapely.geometry import LineString, Point, Polygon, box

from .ground_checks import check_ground
from .growth_checks import faults

UTM = "EPSG:25832"
X, Y = 500_000.0, 5_200_000.0
SITE = Polygon(
    [(0, 0), (400, 0), (400, 240), (250, 240), (250, 180), (180, 180), (180, 240), (0, 240)]
)
ROADS = [
    LineString([(-60, -26), (460, -26)]),
    LineString([(-14, -80), (-14, 300)]),
    LineString([(150, -90), (150, -26)]),
    LineString([(300, -90), (310, -26)]),
]  # fmt: skip
HOUSES = [
    box(30, -20, 120, -4),
    box(190, -22, 290, 6),
    box(-10, 60, -4, 130),
    box(330, -24, 392, -2),
]


def frame(shapes):
    moved = [shapely.affinity.translate(s, X, Y) for s in shapes]
    return gpd.GeoDataFrame(geometry=moved, crs=UTM)


def ground(grammar, houses, scale, polygon=SITE, roads=ROADS, **options):
    barred = frame(houses) if houses else None
    sites = prepare_sites(frame([polygon]), frame(roads), barred).sites
    return ground_of_sites(sites, grammar, obstacles=barred, scale=scale, **options)


def grown_lines(growth):
    lines = shapely.linestrings(growth.xy[growth.ends[growth.grown]] - (X, Y))
    return np.atleast_1d(lines)


def along_edges(real):
    """New streets along edges, moved to the coordinates of this file."""
    return [shapely.affinity.translate(s.line, -X, -Y) for s in real.streets if s.edge]


@pytest.mark.parametrize("houses", [[], HOUSES], ids=["bare", "houses"])
@pytest.mark.parametrize("scale", [25, 50])
@pytest.mark.parametrize("name", ["organic", "grid", "suburb"])
def test_streets_only_cross_the_strip_beside_the_site(name, scale, houses):
    grammar = shipped_grammar(name)
    real = ground(grammar, houses, scale)
    check_ground(real, None)
    joined = 0
    for seed in (1, 2, 3):
        rules = GrowthRules(grammar, scale=scale, seed=seed, iterations=60)
        growth = grow_on(real, rules, 8000.0)
        assert faults(growth) == []
        lines = grown_lines(growth)
        assert len(lines) > 10
        # nothing runs through a house, wherever it stands
        inside = shapely.intersection(shapely.union_all(lines), shapely.union_all(houses))
        assert inside.length < 0.01
        for line in lines:
            outside = shapely.get_parts(line.difference(SITE.buffer(1.2, join_style="mitre")))
            for part in outside[shapely.length(outside) > 0.01]:
                ends = [Point(part.coords[0]), Point(part.coords[-1])]
                gaps = [min(road.distance(end) for road in ROADS) for end in ends]
                # it comes from the site, and ends at a road, at 30 degrees at least
                assert min(gaps) < 0.05, line
                assert SITE.distance(ends[int(np.argmax(gaps))]) < 1.8, line
                assert part.length <= 2 * SITE.distance(ends[int(np.argmin(gaps))]) + 1, line
                joined += 1
    assert joined >= 3


def test_what_stands_beside_the_site_is_no_ground():
    real = ground(shipped_grammar("grid"), HOUSES, 50)
    bare = ground(shipped_grammar("grid"), [], 50)
    domain = shapely.affinity.translate(real.ground.domain, -X, -Y)
    assert domain.intersection(shapely.union_all(HOUSES)).area < 0.01
    lost = bare.ground.domain.area - real.ground.domain.area
    # the last house cuts off a piece of 2 m at the road at most
    assert lost == pytest.approx(sum(house.area for house in HOUSES), rel=0.2)
    # the outline keeps them, so that their sides are no ways out
    assert real.outline.area == pytest.approx(bare.outline.area, abs=1)


def test_ground_cut_off_from_the_site_is_left_out():
    # a wall all along the edge: behind it, at the road, no street may begin
    wall = box(-100, -12, 500, -2)
    real = ground(shipped_grammar("grid"), [wall], 50, roads=ROADS[:1])
    domain = shapely.affinity.translate(real.ground.domain, -X, -Y)
    assert domain.distance(Point(200, 100)) == 0
    assert not domain.intersects(box(0, -25, 400, -13))


def test_an_end_at_the_edge_of_the_site_before_an_obstacle_is_a_dead_end():
    wall = box(-100, -12, 500, -2)
    real = ground(shipped_grammar("grid"), [wall], 50, roads=ROADS[:1])
    growth = grow_on(real, GrowthRules(shipped_grammar("grid"), scale=50, iterations=60), 8000.0)
    xy = growth.xy - (X, Y)
    south = (xy[:, 1] < 3) & (growth.degrees == 1)
    assert south.sum() >= 2
    assert set(node_kinds(growth, real)[south]) == {"dead end"}


def test_small_things_beside_the_site_do_not_count():
    real = ground(shipped_grammar("grid"), [box(50, -12, 54.9, -7.1)], 50)
    bare = ground(shipped_grammar("grid"), [], 50)
    assert real.ground.domain.equals(bare.ground.domain)


@pytest.mark.parametrize("beside", [True, False])
def test_a_street_around_an_obstacle_is_not_tied_through_another(beside):
    # the street along the depot ends at the west edge; straight on to the road stands a house
    depot, house = box(0, 60, 120, 101), box(-9, 52, -3, 63)
    site, road = box(0, 0, 300, 100), LineString([(-14, -100), (-14, 200)])
    houses = [depot, house] if beside else [depot]
    real = ground(
        shipped_grammar("grid"), houses, 50, site, [road], obstacle_edge="join", edge="stop"
    )
    check_ground(real, None)
    (line,) = along_edges(real)
    assert line.intersection(shapely.union_all(shapely.buffer(houses, -0.05))).length == 0
    ends = [Point(line.coords[0]), Point(line.coords[-1])]
    at_road = [end for end in ends if road.distance(end) < 1e-6]
    assert len(at_road) == 1
    # without a house it leads straight over
    assert (at_road[0].y == pytest.approx(60, abs=0.01)) is not beside


def test_a_street_around_an_obstacle_is_not_tied_through_that_obstacle():
    # a hall with a court that opens to the north; its back stands between the court and the road
    hall = box(60, 0, 200, 60).difference(box(90, 20, 170, 60))
    site, road = box(0, 0, 300, 150), LineString([(-50, -8), (350, -8)])
    real = ground(shipped_grammar("grid"), [hall], 50, site, [road], obstacle_edge="join")
    lines = shapely.union_all(along_edges(real))
    assert lines.length > 200
    assert lines.intersection(hall.buffer(-0.05)).length == 0
