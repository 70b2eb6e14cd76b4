"""From a site and layers to a zone: what takes which ground, who reaches what, what is told."""

from __future__ import annotations

import dataclasses
import math

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.corridors import zone_of_site
from platwright.buildings.rules import LayoutRules
from platwright.buildings.tables.patches import PatchChoice
from platwright.errors import InputError
from platwright.parcels.streetspace import StreetWidths, levels_of
from platwright.site import Site, prepare_sites
from pyproj import CRS, Proj
from shapely.geometry import LineString, MultiLineString, Point, Polygon, box

#: Plans of whole zones take their time.
pytestmark = pytest.mark.slow

UTM = CRS.from_epsg(32633)
X, Y = 460_000.0, 5_550_000.0
RULES = LayoutRules()
#: Corners of street space reach so many half widths from the junction, and a little more.
CORNER = 2.6


def layer(shapes, crs=UTM, **columns) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(columns, geometry=list(shapes), crs=crs)


def street(*points) -> LineString:
    return LineString([(X + x, Y + y) for x, y in points])


def area(x0, y0, x1, y1) -> Polygon:
    return box(X + x0, Y + y0, X + x1, Y + y1)


def prepared(shape, roads=None, obstacles=None, **kwargs) -> Site:
    (site,) = prepare_sites(layer([shape]), roads, obstacles, **kwargs).sites
    return site


ZONE = area(0, 0, 300, 200)
AROUND = layer(
    [street((-100, -8), (400, -8)), street((-8, -100), (-8, 300))],
    name=["South Road", "West Road"],
    highway=["residential", "residential"],
)


def check_tiling(zone, told=()) -> None:
    """Patches, streets, obstacles and bits that are told of cover the zone, and nothing twice."""
    patches = [patch.polygon for patch in zone.patches]
    together = shapely.union_all(patches)
    assert abs(together.area - sum(p.area for p in patches)) < 0.01 * max(1, len(patches))
    assert together.difference(zone.polygon).area < 0.01
    ground = shapely.union_all(list(zone.obstacles))
    assert together.intersection(ground).area < 0.1
    inner = [own for own in zone.corridors if not own.edge]
    tips = [xy for own in inner for xy in (own.line.coords[0], own.line.coords[-1])]
    ends = shapely.union_all([Point(xy).buffer(16.0) for xy in tips])
    for own in inner:
        assert together.intersection(own.line).length < 0.01
        # half a width is free beside every street, away from junctions and ends
        middle = own.line.buffer(own.width_m / 2 - 0.1, cap_style="flat", join_style="bevel")
        assert together.intersection(middle.difference(ends)).area < 0.1
    small = shapely.union_all([own.place for own in told if "too small" in own.problem])
    rest = zone.polygon.difference(shapely.union_all([together, ground, small]))
    streets = shapely.union_all(
        [own.line.buffer(1.3 * own.width_m, cap_style="square") for own in zone.corridors]
    )
    assert rest.difference(streets).area < 1.0 + 0.5 * len(patches)


def check_access(zone, site) -> None:
    """Access lies on the ring of its patch and beside a street."""
    lines = shapely.union_all(
        [own.line.buffer(own.width_m / 2 * CORNER) for own in zone.corridors if not own.edge]
        + [site.street_frontage.buffer(0.2)]
        + [own.line.buffer(own.width_m / 2 + 2.5) for own in zone.corridors if own.edge]
    )
    for patch in zone.patches:
        ring = shapely.boundary(patch.polygon)
        assert patch.access.difference(ring.buffer(0.01)).length < 0.01
        assert patch.access.difference(lines).length < 0.01
        assert patch.polygon.exterior.is_ccw
        assert patch.polygon.is_valid


def test_a_given_street_cuts_the_zone_at_its_own_width():
    site = prepared(ZONE, AROUND)
    lines = layer(
        [
            street((150, -50), (150, 250)),
            street((150, 100), (260, 100)),
            street((900, 0), (990, 0)),
        ],
        level=[2, None, 3],
        width_m=[None, 9.0, None],
        name=["Mill Street", None, "far away"],
    )
    zone, told = zone_of_site(site, corridors=lines)
    inner = [own for own in zone.corridors if not own.edge]
    assert [(own.level, own.width_m, own.name) for own in inner] == [
        (2, 16.0, "Mill Street"), (3, 9.0, ""),
    ]  # fmt: skip
    assert sorted({own.name for own in zone.corridors if own.edge}) == ["South Road", "West Road"]
    west, east = sorted((p.polygon for p in zone.patches), key=lambda p: p.centroid.x)
    assert math.isclose(west.area, 142 * 200, rel_tol=1e-6)
    assert math.isclose(east.area, 142 * 200 - (110 - 8) * 9, rel_tol=1e-6)
    assert not told
    check_tiling(zone)
    check_access(zone, site)
    # along Mill Street, the roads around, and the short street, but not at the zone's other edges
    along = {p.polygon.centroid.x < X + 150: p.access.length for p in zone.patches}
    assert math.isclose(along[True], 142 + 200 + 200, abs_tol=3.0)
    assert math.isclose(along[False], 200 + 142 + 2 * 102, abs_tol=6.0 + 9.0)


def test_widths_of_the_planner_count():
    site = prepared(ZONE, AROUND)
    lines = layer([street((150, -50), (150, 250))], level=[2])
    zone, _ = zone_of_site(site, corridors=lines, widths=StreetWidths(collector=22.0, local=10.0))
    assert [own.width_m for own in zone.corridors if not own.edge] == [22.0]
    assert math.isclose(sum(p.polygon.area for p in zone.patches), 278 * 200, rel_tol=1e-6)


@pytest.mark.parametrize(("away", "taken"), [(0.0, 6.0), (8.0, 0.0)])
def test_a_street_along_the_edge_takes_land_only_where_the_edge_is_its_centre_line(away, taken):
    roads = layer([street((-50, -away), (350, -away))], highway=["residential"])
    site = prepared(ZONE, roads)
    zone, _ = zone_of_site(site, samples=False)
    (patch,) = zone.patches
    assert math.isclose(patch.polygon.area, 300 * (200 - taken), rel_tol=1e-4)
    assert math.isclose(patch.access.length, 300.0, abs_tol=4.0)
    assert {own.edge for own in zone.corridors} == {True}


def test_a_layer_of_corridors_serves_as_roads_where_there_are_none():
    site = prepared(ZONE)
    lines = layer(
        [street((150, -8), (150, 208)), street((-20, -8), (150, -8)), street((150, -8), (320, -8))],
        level=[3, 2, 2],
        status=["new", "existing", "existing"],
        name=["", "South Road", "South Road"],
    )
    zone, _ = zone_of_site(site, corridors=lines)
    assert {(own.name, own.level) for own in zone.corridors if own.edge} == {("South Road", 2)}
    assert len(zone.patches) == 2
    north = LineString([(X, Y + 200), (X + 300, Y + 200)])
    for patch in zone.patches:
        assert patch.access.intersection(north.buffer(0.01)).length < 1.0
        assert math.isclose(patch.access.length, 144 + 200, abs_tol=3.0)


def test_layers_may_have_other_coordinates():
    site = prepared(ZONE, AROUND)
    lines = layer([street((150, -50), (150, 250))], level=[3])
    choices = layer([area(-10, -10, 150, 210)], pattern=["dotted"])
    plain, _ = zone_of_site(site, corridors=lines, patches=choices)
    other, _ = zone_of_site(site, corridors=lines.to_crs(4326), patches=choices.to_crs(3857))
    assert len(plain.patches) == len(other.patches) == 2
    for a, b in zip(plain.patches, other.patches):
        assert a.polygon.symmetric_difference(b.polygon).area < 0.5
        assert (a.residences, a.feature) == (b.residences, b.feature)


def test_obstacles_and_ponds_are_kept_out():
    pond = Point(X + 60, Y + 60).buffer(30.0)
    hole = Point(X + 230, Y + 120).buffer(25.0)
    site = prepared(ZONE.difference(hole), AROUND, layer([pond]))
    lines = layer([street((150, -50), (150, 250))], level=[3])
    zone, told = zone_of_site(site, corridors=lines)
    check_tiling(zone, told)
    check_access(zone, site)
    for patch in zone.patches:
        assert patch.polygon.intersection(pond).area < 0.1
        assert patch.polygon.intersection(hole).area < 0.1
        assert patch.access.distance(pond) > 1.0
    assert len(zone.obstacles) == 1


def test_motorways_take_ground_and_give_no_access():
    site = prepared(ZONE)
    site = dataclasses.replace(site, street_frontage=MultiLineString([street((0, 0), (0, 200))]))
    lines = layer([street((150, -50), (150, 250))], highway=["motorway"])
    zone, told = zone_of_site(site, corridors=lines, samples=False)
    west, east = sorted(zone.patches, key=lambda p: p.polygon.centroid.x)
    assert not west.access.is_empty
    assert east.access.is_empty
    assert any("No corridor can be reached" in own.problem for own in told)
    assert math.isclose(east.polygon.area, 140 * 200, rel_tol=1e-6)


def test_patches_of_a_layer_choose_for_themselves():
    site = prepared(ZONE, AROUND)
    lines = layer([street((150, -50), (150, 250))], level=[3])
    choices = layer(
        [area(-20, -20, 100, 220), area(80, -20, 149, 220), area(2000, 0, 2100, 100)],
        pattern=["enclosed", "5", "rows"],
        facing=["SE", None, None],
    )
    choices.index = [7, 9, 11]
    zone, told = zone_of_site(
        site, corridors=lines, patches=choices, choice=PatchChoice(residences=4)
    )
    by_feature = {patch.feature: patch for patch in zone.patches}
    assert set(by_feature) == {7, 9, None}
    assert by_feature[7].residences == 3
    # asked from true north, kept from grid north
    assert by_feature[7].facing_deg == pytest.approx(135.0 - zone.convergence_deg)
    assert by_feature[9].residences == 5
    assert by_feature[None].residences == 4
    # the first counts where two overlap
    assert math.isclose(by_feature[7].polygon.area, 100 * 200, rel_tol=1e-6)
    assert math.isclose(by_feature[9].polygon.area, 44 * 200, rel_tol=1e-6)
    check_tiling(zone, told)
    check_access(zone, site)


def test_slivers_beside_drawn_patches_join_their_neighbours():
    site = prepared(ZONE, AROUND)
    choices = layer([area(1, -5, 150, 205), area(150, -5, 299.5, 205)], pattern=["rows", "dotted"])
    zone, told = zone_of_site(site, samples=False, patches=choices)
    assert sorted(patch.residences for patch in zone.patches) == [1, 5]
    assert math.isclose(sum(p.polygon.area for p in zone.patches), ZONE.area, rel_tol=1e-9)
    assert not told


def test_patches_without_a_crs_or_with_a_wrong_word_are_refused():
    site = prepared(ZONE, AROUND)
    with pytest.raises(InputError, match="coordinate reference system"):
        zone_of_site(site, patches=layer([ZONE], crs=None))
    with pytest.raises(InputError, match=r"Layer 'Plan', feature 0.*zigzag"):
        zone_of_site(
            site,
            samples=False,
            patches=layer([ZONE], pattern=["zigzag"]),
            patch_layer="Plan",
        )


def test_what_no_street_reaches_is_told_and_stays_empty():
    site = dataclasses.replace(prepared(ZONE), street_frontage=MultiLineString())
    zone, told = zone_of_site(site, samples=False)
    (patch,) = zone.patches
    assert patch.access.is_empty
    assert (patch.residences, patch.facilities) == (0, 0)
    assert [own.severity for own in told] == ["error", "warning"]
    assert "no street runs along its edge" in told[0].problem
    assert "give a layer of roads" in told[0].action
    # with samples corridors begin anywhere on the edge, and that is told
    helped, told = zone_of_site(site)
    assert helped.corridors
    assert [own.severity for own in told] == ["warning"]
    assert all(not own.access.is_empty for own in helped.patches)


def test_a_layer_without_a_street_in_the_zone_is_told():
    site = prepared(ZONE, AROUND)
    lines = layer([street((900, 0), (990, 0))], level=[3])
    zone, told = zone_of_site(site, corridors=lines, corridor_layer="Lanes", samples=False)
    assert "No line of the layer 'Lanes' lies within the zone." in [own.problem for own in told]
    assert len(zone.patches) == 1


def test_what_is_no_line_is_told():
    site = prepared(ZONE, AROUND)
    lines = layer([street((150, -50), (150, 250)), Point(X + 50, Y + 50)], level=[3, 3])
    zone, told = zone_of_site(site, corridors=lines, corridor_layer="Lanes")
    assert len(zone.patches) == 2
    assert any("Layer 'Lanes', feature 1" in own.problem for own in told)


@pytest.mark.parametrize(
    ("size", "wants"), [((100, 110), False), ((400, 70), False), ((330, 320), True)]
)
def test_small_and_narrow_zones_need_no_corridors(size, wants):
    zone, told = zone_of_site(prepared(area(0, 0, *size), AROUND))
    assert any(not own.edge for own in zone.corridors) is wants
    assert len(zone.patches) == 1 or wants
    assert not told


def test_a_very_large_zone_gets_the_advice_to_design_streets():
    zone, told = zone_of_site(prepared(area(0, 0, 640, 520)))
    assert any("33 ha" in own.problem for own in told)
    assert len(zone.patches) >= 8
    assert max(p.polygon.area for p in zone.patches) < 4.5e4
    check_tiling(zone, told)


def test_patterns_of_the_sample_are_used_unless_the_planner_chooses():
    site = prepared(area(0, 0, 430, 370))
    planned, _ = zone_of_site(site)
    assert any(patch.facilities for patch in planned.patches)
    assert not all(patch.facilities for patch in planned.patches)
    chosen, _ = zone_of_site(site, choice=PatchChoice(residences=3, facilities=0))
    assert {(own.residences, own.facilities) for own in chosen.patches} == {(3, 0)}


@given(
    st.lists(st.tuples(st.integers(20, 280), st.integers(20, 180)), min_size=2, max_size=5),
    st.integers(0, 359),
)
@settings(max_examples=25)
def test_any_streets_tile_any_zone(points, degrees):
    """Streets anyhow across a turned zone: nothing overlaps, nothing is lost."""
    turned = shapely.affinity.rotate(ZONE, degrees, origin=(X, Y))
    site = prepared(turned)
    shapes = []
    for (x, y), (u, v) in zip(points, points[1:]):
        if math.hypot(u - x, v - y) > 30:
            way = street((x - 2 * (u - x), y - 2 * (v - y)), (x + 3 * (u - x), y + 3 * (v - y)))
            shapes.append(shapely.affinity.rotate(way, degrees, origin=(X, Y)))
    if not shapes:
        return
    lines = layer(shapes, level=[3] * len(shapes))
    zone, told = zone_of_site(site, corridors=lines)
    check_tiling(zone, told)
    check_access(zone, site)
    space = shapely.union_all([line.buffer(6.0, cap_style="flat") for line in shapes])
    left = turned.difference(space).area
    got = sum(p.polygon.area for p in zone.patches) + sum(
        own.place.area for own in told if "too small" in own.problem
    )
    # corners at junctions are pointed, and bits of less than a square metre are rounding
    assert got <= left + 1.0
    assert got >= left - 120.0 * len(shapes) ** 2


@pytest.mark.parametrize(
    ("epsg", "lon", "lat"),
    [
        (32633, 17.2, 50.0),
        (32633, 13.1, 50.0),
        (32733, 17.0, -33.0),
        (2154, 6.2, 47.3),
        (3857, 9, 9),
    ],
)
def test_convergence_is_the_true_azimuth_of_grid_north(epsg, lon, lat):
    x, y = Proj(CRS.from_epsg(epsg))(lon, lat)
    shape = layer([box(x - 40, y - 40, x + 40, y + 40)], crs=CRS.from_epsg(epsg))
    (site,) = prepare_sites(shape).sites
    zone, _ = zone_of_site(site)
    assert math.isclose(zone.latitude, lat, abs_tol=1e-3)
    assert math.isclose(zone.longitude, lon, abs_tol=1e-3)
    factors = Proj(site.crs).get_factors(zone.longitude, zone.latitude)
    assert math.isclose(abs(zone.convergence_deg), abs(factors.meridian_convergence), abs_tol=1e-3)
    # a step to true north, drawn on the grid, has an azimuth that adds up to nothing
    here = Proj(site.crs)(zone.longitude, zone.latitude)
    there = Proj(site.crs)(zone.longitude, zone.latitude + 1e-3)
    grid = math.degrees(math.atan2(there[0] - here[0], there[1] - here[1]))
    assert abs(grid + zone.convergence_deg) < 0.01


def test_convergence_east_of_the_middle_of_a_utm_zone():
    x, y = Proj(UTM)(17.0, 50.0)
    site = prepared(box(x - 50, y - 50, x + 50, y + 50))
    zone, _ = zone_of_site(site)
    expected = math.degrees(math.atan(math.tan(math.radians(2.0)) * math.sin(math.radians(50.0))))
    assert math.isclose(zone.convergence_deg, expected, abs_tol=0.01)
    assert math.isclose(zone.equator_deg, 180.0 - expected, abs_tol=0.01)


def test_levels_follow_from_the_field_or_the_class():
    frame = gpd.GeoDataFrame(
        {"level": [1, np.nan, 9, 4], "highway": ["", "tertiary_link", "service", "primary"]}
    )
    assert levels_of(frame).tolist() == [1, 2, 4, 4]


@pytest.mark.slow
@pytest.mark.parametrize("number", [f"{k:02d}" for k in range(1, 13)])
def test_real_sites_get_zones(shared_data, number):
    (path,) = (shared_data / "sites").glob(f"{number}_*.gpkg")
    shapes = gpd.read_file(path, layer="site")
    roads = gpd.read_file(path, layer="streets")
    listed = gpd.list_layers(path)["name"].tolist()
    obstacles = gpd.read_file(path, layer="obstacles") if "obstacles" in listed else None
    (site,) = prepare_sites(shapes, roads, obstacles).sites
    zone, told = zone_of_site(site)
    check_tiling(zone, told)
    check_access(zone, site)
    inner = [own for own in zone.corridors if not own.edge]
    assert inner
    assert all(not patch.access.is_empty for patch in zone.patches)
    sizes = np.array([patch.polygon.area for patch in zone.patches]) / 1e4
    assert np.sum(sizes[sizes > 5.5]) < 0.25 * sizes.sum()
    solid = site.polygon.difference(site.obstacle_union)
    for own in inner:
        outside = own.line.difference(solid.buffer(0.5))
        # beyond the edge only to the street there
        assert outside.length < 3.0 * site.snap_distance
        assert own.line.intersection(site.obstacle_union).length < 0.01
    # one network with the streets around
    lines = shapely.union_all([own.line.buffer(0.3) for own in zone.corridors])
    edge = shapely.union_all([own.line for own in zone.corridors if own.edge])
    for part in shapely.get_parts(lines):
        near = part.distance(edge) < 1.0 or part.distance(site.polygon.boundary) < 1.0
        assert near


def test_patches_that_choose_nothing_or_overlap_are_told():
    site = prepared(ZONE, AROUND)
    twice = layer([area(0, 0, 150, 200), area(100, 0, 300, 200)], colour=["red", "blue"])
    _, told = zone_of_site(site, samples=False, patches=twice, patch_layer="mine")
    assert any("'mine' has no field" in own.problem for own in told)
    assert sum("overlaps others by 10000 m2" in own.problem for own in told) == 1
