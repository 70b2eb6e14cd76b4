"""Where the ground ends: notches, obstacles at the edge, motorways, roads that stop short."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
import shapely
from platwright.growth.grammars.shipped import shipped_grammar
from platwright.growth.grow import grow
from platwright.growth.land.ground import ground_of_roads, ground_of_sites
from platwright.growth.layers.outward import on_outer_edge
from platwright.growth.layers.prune import without_dead_ends
from platwright.growth.layers.ways import node_kinds
from platwright.growth.rules import GrowthRules
from platwright.site import prepare_sites
from shapely.geometry import LineString, Point, Polygon, box

from .ground_checks import check_ground

UTM = "EPSG:25832"
GRID = shipped_grammar("grid")
X, Y = 500_000.0, 5_200_000.0


def frame(shapes, **columns):
    moved = [shapely.affinity.translate(s, X, Y) for s in shapes]
    return gpd.GeoDataFrame(columns, geometry=moved, crs=UTM)


def sites_of(polygon, roads, obstacles=(), **options):
    roads = roads if isinstance(roads, gpd.GeoDataFrame) else frame(roads)
    barred = frame(obstacles) if obstacles else None
    return prepare_sites(frame([polygon]), roads, barred, **options).sites


def grown(real, scale=20):
    return grow(real.ground, GrowthRules(GRID, scale=scale, iterations=60))


def outside(real):
    lines = shapely.union_all([s.line for s in real.streets])
    return lines.difference(real.ground.domain.buffer(1e-6)).length


@pytest.mark.parametrize("obstacle", [False, True])
def test_ground_behind_a_street_that_leads_on_belongs_to_the_domain(obstacle):
    # the street begins 12 m behind the corner of the site, to which the new street leads on
    site = Polygon([(0, 0), (200, 0), (200, 100), (0, 100)])
    barred = [box(-1, -1, 6, 3)] if obstacle else []
    real = ground_of_sites(
        sites_of(site, [LineString([(12, -14), (260, -14)])], barred), GRID, edge="join", scale=20
    )
    check_ground(real, None)
    assert sum(s.edge for s in real.streets) >= 1
    faces = shapely.get_parts(
        shapely.polygonize([*shapely.linestrings(real.ground.nodes[real.ground.ends])])
    )
    assert len(faces) == 1
    free = faces[0] if not obstacle else faces[0].difference(frame(barred).union_all())
    # within the streets there is nothing that is not ground
    assert free.difference(real.ground.domain).area < 1e-3
    assert outside(real) < 0.5


def test_an_inner_street_that_leads_on_runs_in_the_domain():
    # the site ends 9 m before the street; beside the inner street an access lane leaves a gap
    roads = [LineString([(-50, -9), (250, -9)]), LineString([(100, -9), (100, 60)])]
    real = ground_of_sites(
        sites_of(box(0, 0, 200, 100), roads, inner_roads="keep"), GRID, edge="join", scale=20
    )
    check_ground(real, None)
    inner = shapely.union_all([s.line for s in real.streets if not s.edge])
    assert inner.distance(Point(X + 100, Y + 60)) < 1e-6
    assert LineString([(X + 100, Y - 9), (X + 100, Y + 60)]).difference(
        real.ground.domain.buffer(1e-6)
    ).is_empty  # fmt: skip


def test_an_obstacle_across_the_edge_is_no_way_out():
    # the wood lies across the north edge: half of what was edge is its side now
    wood = box(40, 60, 160, 150)
    road = LineString([(-50, -8), (250, -8)])
    real = ground_of_sites(sites_of(box(0, 0, 200, 100), [road], [wood]), GRID, scale=20)
    growth = grown(real)
    out = on_outer_edge(growth, real)
    xy = growth.xy - (X, Y)
    at_wood = (np.abs(shapely.distance(shapely.points(xy), wood.boundary)) < 0.06) & (
        growth.node_type == "BOUNDARY"
    )
    assert at_wood.sum() >= 3
    corner = np.abs(xy[:, 1] - 100) < 0.1
    assert not out[at_wood & ~corner].any()
    assert out[(growth.node_type == "BOUNDARY") & ~at_wood].any()
    kinds = node_kinds(growth, real)
    assert set(kinds[at_wood & ~corner & (growth.degrees == 1)]) == {"dead end"}
    assert (kinds[(growth.node_type == "BOUNDARY") & ~at_wood] == "at the edge").any()
    left = without_dead_ends(growth, real)
    ends = left.xy[left.degrees == 1] - (X, Y)
    at_side = shapely.distance(shapely.points(ends), wood.boundary) < 0.06
    assert (np.abs(ends[at_side][:, 1] - 100) < 0.1).all()
    # a street at the edge proper stays
    assert (np.abs(ends[~at_side][:, 1] - 100) < 0.1).any()


def test_the_outline_is_the_ground_without_obstacles_taken_away():
    wood = [box(40, 60, 160, 150), box(20, 20, 40, 40)]
    road = LineString([(-50, -8), (250, -8)])
    real = ground_of_sites(sites_of(box(0, 0, 200, 100), [road], wood), GRID, scale=20)
    assert real.outline.difference(real.ground.domain).area == pytest.approx(120 * 40 + 400)
    assert real.ground.domain.difference(real.outline).area < 1e-6
    assert real.outline.geom_type == "Polygon"
    assert not real.outline.interiors


def test_a_road_that_stops_short_of_the_edge_goes_on_inside_the_ground():
    # an alley runs beside a part of the edge, 22 m away; the street crosses its end and stops 6 m
    # before the edge: growth begins where the street reaches the ground, not at the alley
    roads = [
        LineString([(100, 122), (150, 122)]),
        LineString([(150, 300), (150, 122)]),
        LineString([(150, 122), (151, 106)]),
    ]
    real = ground_of_sites(sites_of(box(0, 0, 300, 100), roads), GRID, scale=20)
    check_ground(real, None)
    (start,) = real.ground.starts
    assert np.hypot(*np.subtract(start.xy, (X + 151, Y + 100))) < 2
    assert grown(real).grown.sum() > 10


def with_motorway(**columns):
    lines = [
        LineString([(-50, -8), (450, -8)]),
        LineString([(-50, 308), (450, 308)]),
        LineString([(200, -500), (200, 800)]),
    ]
    kinds = ["residential", "residential", "motorway"]
    return frame(lines, highway=kinds, **columns)


@pytest.mark.parametrize("edge", ["stop", "join"])
def test_no_street_crosses_a_motorway(edge):
    roads = with_motorway()
    sites = sites_of(box(0, 0, 400, 300), roads)
    real = ground_of_sites(sites, GRID, edge=edge, scale=20, roads=roads)
    check_ground(real, None)
    growth = grown(real)
    assert growth.grown.sum() > 20
    lines = shapely.linestrings(growth.xy[growth.ends[growth.grown]])
    assert shapely.distance(lines, LineString([(X + 200, Y - 9), (X + 200, Y + 309)])).min() > 9.8
    # both sides have streets
    assert (growth.xy[:, 0] < X + 180).any()
    assert (growth.xy[:, 0] > X + 220).any()
    told = real.problems[real.problems["problem"].astype(str).str.contains("motorway")]
    assert told["severity"].tolist() == ["info"]
    assert "end" in told["action"].iloc[0]
    # and its sides are no ways out
    out = on_outer_edge(growth, real)
    beside = np.abs(np.abs(growth.xy[:, 0] - X - 200) - 10) < 0.01
    assert not out[beside].any()
    blind = node_kinds(growth, real)[beside & (growth.degrees == 1)]
    assert edge == "join" or len(blind) > 2
    assert set(blind) <= {"dead end"}


@pytest.mark.parametrize("hidden", ["tunnel", "other_tags"])
def test_streets_cross_a_motorway_in_a_tunnel(hidden):
    value = "yes" if hidden == "tunnel" else '"tunnel"=>"yes"'
    columns = {hidden: ["", "", value], "osm_id": ["1", "2", "3"]}
    roads = with_motorway(**columns)
    sites = sites_of(box(0, 0, 400, 300), roads)
    real = ground_of_sites(sites, GRID, scale=20, roads=roads)
    bare = ground_of_sites(sites, GRID, scale=20)
    assert real.ground.domain.equals(bare.ground.domain)
    assert not real.problems["problem"].astype(str).str.contains("motorway").any()


def test_tracks_of_a_layer_of_openstreetmap_are_a_barrier():
    roads = with_motorway(railway=["", "", "rail"], osm_id=["1", "2", "3"])
    roads.loc[2, "highway"] = ""
    sites = sites_of(box(0, 0, 400, 300), roads)
    real = ground_of_sites(sites, GRID, scale=20, roads=roads.to_crs(4326))
    assert not real.ground.domain.intersects(Point(X + 203.8, Y + 100))
    assert real.ground.domain.intersects(Point(X + 204.5, Y + 100))
    assert real.problems["problem"].astype(str).str.contains("railway").any()


def test_roads_without_a_site_tell_of_motorways():
    real = ground_of_roads(with_motorway(), GRID, scale=20)
    told = real.problems[real.problems["problem"].astype(str).str.contains("motorway")]
    assert len(told) == 1
    assert "may cross" in told["problem"].iloc[0] + told["action"].iloc[0]


def test_a_motorway_beside_the_ground_takes_nothing_of_it():
    roads = with_motorway()
    roads.loc[2, "geometry"] = shapely.affinity.translate(
        LineString([(405, -500), (405, 800)]), X, Y
    )
    sites = sites_of(box(0, 0, 400, 300), roads)
    real = ground_of_sites(sites, GRID, scale=20, roads=roads)
    assert real.ground.domain.equals(ground_of_sites(sites, GRID, scale=20).ground.domain)
    assert len(real.problems) == 0
