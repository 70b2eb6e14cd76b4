"""The street mesh: planar whatever is done to it, and true to what was given."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.parcels.edges import EdgeKind
from platwright.parcels.roadmesh import (
    GivenStreet,
    Ground,
    MeshEdge,
    StreetMesh,
    begin_mesh,
    region_blocks,
    street_lines,
)
from platwright.parcels.roadmesh.ranks import natural_streets, street_levels, ways_out
from platwright.parcels.roadmesh.streets import dead_ends
from platwright.parcels.split.cutting import cut, fit_ends
from platwright.parcels.split.ground import parts
from platwright.parcels.split.junctions import junctions_of
from shapely.geometry import LineString, MultiLineString, Polygon, box


def ground(polygon: Polygon, **more: object) -> Ground:
    """A site with streets along its whole outer edge."""
    front = more.pop("frontage", MultiLineString([LineString(polygon.exterior)]))
    return Ground(polygon, front, **more)  # type: ignore[arg-type]


def polygons(mesh: StreetMesh) -> list[Polygon]:
    return [mesh.polygon(r) for r in sorted(mesh.regions)]


def check_planar(mesh: StreetMesh, site: Polygon) -> None:
    """The regions are valid, tile the site, and every edge has the regions that it says."""
    found = polygons(mesh)
    assert all(p.is_valid for p in found)
    assert sum(p.area for p in found) == pytest.approx(site.area, rel=1e-9)
    assert shapely.union_all(found).symmetric_difference(site).area < 1e-6 * site.area
    for number, region in mesh.regions.items():
        for a, b in region.edges():
            assert mesh.left_of(a, b) == number
            assert mesh.edge(a, b) is mesh.edge(b, a)
    halves = {half for region in mesh.regions.values() for half in region.edges()}
    assert {tuple(sorted(half)) for half in halves} == set(mesh.edges)


def test_a_site_begins_as_one_region_with_its_frontage():
    site = box(0, 0, 200, 100)
    front = MultiLineString([LineString([(0, 0), (200, 0)])])
    mesh, problems = begin_mesh(ground(site, frontage=front))
    assert problems == []
    (region,) = mesh.regions
    kinds = {
        tuple(sorted((tuple(mesh.xy[a]), tuple(mesh.xy[b])))): mesh.edge(a, b).kind
        for a, b in mesh.regions[region].edges()
    }
    assert kinds[((0.0, 0.0), (200.0, 0.0))] == EdgeKind.FRONTAGE
    assert sorted(kinds.values()) == [EdgeKind.FRONTAGE] + [EdgeKind.CLOSED] * 3
    check_planar(mesh, site)


def test_given_streets_cut_the_site_and_are_drawn_on_to_its_edge():
    site = box(0, 0, 200, 100)
    street = GivenStreet(LineString([(100, 10), (100, 90)]), 20.0, "High Street")
    cross = GivenStreet(LineString([(100, 50), (180, 50)]), 12.0)
    mesh, problems = begin_mesh(ground(site, streets=[street, cross]))
    assert problems == []
    assert len(mesh.regions) == 3
    check_planar(mesh, site)
    lines = street_lines(mesh)
    assert {s.street for s in lines} == {0, 1}
    assert sum(s.line.length for s in lines if s.street == 0) == pytest.approx(100)
    assert sum(s.line.length for s in lines if s.street == 1) == pytest.approx(100)
    blocks = [b.polygon for many in region_blocks(mesh).values() for b in many]
    # 90 x 100 left of High Street; 90 x (50 - 6) above and below the other
    assert sorted(p.area for p in blocks) == pytest.approx([90 * 44, 90 * 44, 90 * 100])


def test_a_given_street_that_bounds_nothing_is_told():
    site = box(0, 0, 200, 100)
    outside = GivenStreet(LineString([(300, 0), (300, 90)]), 12.0)
    inner = GivenStreet(LineString([(60, 50), (100, 50)]), 12.0)
    mesh, problems = begin_mesh(ground(site, streets=[outside, inner]))
    assert len(mesh.regions) == 1
    texts = [text for _, text in problems]
    assert any("outside the site" in text for text in texts)
    assert any("end in the open" in text for text in texts)


def test_a_cut_inserts_its_ends_in_the_neighbours_too():
    site = box(0, 0, 200, 100)
    mesh, _ = begin_mesh(ground(site))
    west, east = sorted(
        cut(mesh, 1, [LineString([(100, 0), (100, 100)])], 0, 10.0),
        key=lambda r: mesh.polygon(r).centroid.x,
    )
    cut(mesh, east, [LineString([(100, 40), (200, 40)])], 1, 10.0)
    check_planar(mesh, site)
    assert len(mesh.regions) == 3
    assert len(mesh.regions[west].rings[0]) == 5
    lines = street_lines(mesh)
    assert sorted(s.line.length for s in lines) == pytest.approx([40, 60, 100])


def test_ends_near_a_junction_make_a_crossing():
    site = box(0, 0, 200, 100)
    mesh, _ = begin_mesh(ground(site))
    halves = cut(mesh, 1, [LineString([(100, 0), (100, 100)])], 0, 10.0)
    west, east = sorted(halves, key=lambda r: mesh.polygon(r).centroid.x)
    cut(mesh, east, [LineString([(100, 40), (200, 40)])], 1, 10.0)
    line = fit_ends(
        mesh, west, LineString([(0, 42.5), (50, 42.5), (100, 42.5)]), junctions_of(mesh, west)
    )
    assert line.coords[-1] == (100.0, 40.0)
    # the drift is spread over the street, so that it has no kink at its end
    assert line.coords[1] == pytest.approx((50.0, 42.5))
    cut(mesh, west, [line], 2, 10.0)
    check_planar(mesh, site)
    assert len(mesh.regions) == 4


def test_two_chains_cut_a_ring_in_two():
    site = Polygon(box(0, 0, 300, 300).exterior, [box(100, 100, 200, 200).exterior])
    mesh, _ = begin_mesh(ground(site))
    (outer, hole) = mesh.regions[1].rings
    place = {tuple(mesh.xy[v]): v for v in (*outer, *hole)}
    chains = [
        (place[(0.0, 0.0)], place[(100.0, 100.0)]),
        (place[(300.0, 300.0)], place[(200.0, 200.0)]),
    ]
    halves = mesh.split(1, chains, [MeshEdge(EdgeKind.STREET, 0, 10.0)] * 2)
    assert len(halves) == 2
    check_planar(mesh, site)
    assert [mesh.polygon(p).area for p in halves] == pytest.approx([40000, 40000])


def test_a_hole_goes_to_the_part_around_it():
    site = Polygon(box(0, 0, 300, 100).exterior, [box(200, 40, 220, 60).exterior])
    mesh, _ = begin_mesh(ground(site))
    cut(mesh, 1, [LineString([(100, 0), (100, 100)])], 0, 10.0)
    check_planar(mesh, site)
    assert sorted(len(mesh.regions[r].rings) for r in mesh.regions) == [1, 2]
    blocks = [b for many in region_blocks(mesh).values() for b in many]
    closed = sorted(b.closed.length for b in blocks)
    assert closed == pytest.approx([0.0, 80.0])


def test_blind_streets_get_a_turning_circle_and_the_lowest_level():
    site = box(0, 0, 200, 100)
    front = MultiLineString([LineString([(0, 0), (200, 0)])])
    mesh, _ = begin_mesh(ground(site, frontage=front))
    cut(mesh, 1, [LineString([(100, 0), (100, 100)])], 0, 10.0)
    lines = street_lines(mesh)
    (blind,) = dead_ends(mesh)
    assert tuple(mesh.xy[blind]) == (100.0, 100.0)
    assert street_levels(mesh, lines, [blind]).tolist() == [4]
    assert np.sort(ways_out(mesh, lines)[0]).tolist() == [0.0, 100.0]
    plain = sum(b.polygon.area for many in region_blocks(mesh).values() for b in many)
    round_end = sum(b.polygon.area for many in region_blocks(mesh, 9.0).values() for b in many)
    assert plain == pytest.approx(190 * 100)
    # what the circle of 9 m adds to a street of 10 m: less than its area, more than nothing
    assert 50 < plain - round_end < np.pi * 81


def test_long_streets_that_lead_through_are_collectors():
    site = box(0, 0, 400, 200)
    mesh, _ = begin_mesh(ground(site))
    halves = cut(mesh, 1, [LineString([(0, 100), (400, 100)])], 0, 12.0)
    far = 0 if mesh.polygon(halves[0]).bounds[1] < 50 else 200
    cut(mesh, halves[0], [LineString([(200, 100), (200, far)])], 1, 12.0)
    lines = street_lines(mesh)
    natural = natural_streets(lines)
    levels = street_levels(mesh, lines, [])
    long = {n for n, s in zip(natural, lines) if s.street == 0}
    assert len(long) == 1
    assert {lv for lv, s in zip(levels, lines) if s.street == 0} == {2}
    assert {lv for lv, s in zip(levels, lines) if s.street == 1} == {3}


@settings(max_examples=25)
@given(st.lists(st.tuples(st.floats(0.1, 0.9), st.floats(0.1, 0.9), st.booleans()), max_size=8))
def test_any_row_of_cuts_leaves_a_planar_mesh(cuts):
    site = box(0, 0, 400, 300)
    mesh, _ = begin_mesh(ground(site))
    for number, (first, second, upright) in enumerate(cuts):
        region = max(mesh.regions, key=lambda r: mesh.polygon(r).area)
        x0, y0, x1, y1 = mesh.polygon(region).bounds
        share = np.array([first, second])
        x, y = x0 + (x1 - x0) * share, y0 + (y1 - y0) * share
        upright_ends = [(x[0], y0 - 1), (x[1], y1 + 1)]
        ends = upright_ends if upright else [(x0 - 1, y[0]), (x1 + 1, y[1])]
        inside = shapely.intersection(LineString(ends), mesh.polygon(region))
        if inside.geom_type != "LineString" or inside.length < 20:
            continue
        line = fit_ends(mesh, region, inside, junctions_of(mesh, region))
        if parts(mesh.polygon(region), [line]) is None:
            continue
        cut(mesh, region, [line], number, 10.0)
        check_planar(mesh, site)
    blocks = [b.polygon for many in region_blocks(mesh).values() for b in many]
    assert all(b.is_valid for b in blocks)
    # no block reaches into the space of a street
    space = shapely.union_all([s.line.buffer(s.width / 2 - 1e-6) for s in street_lines(mesh)])
    assert sum(b.intersection(space).area for b in blocks) < 1e-3
