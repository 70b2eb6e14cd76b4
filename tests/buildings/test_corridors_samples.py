"""The sample library, its retrieval, and how samples come out in zones."""

from __future__ import annotations

import dataclasses
import math

import networkx as nx
import numpy as np
import pytest
import shapely
from platwright.buildings.corridors.adapt import Edge, adapt, pruned
from platwright.buildings.corridors.outline import outline_of
from platwright.buildings.corridors.refine import sample_corridors
from platwright.buildings.corridors.register import places_of, register
from platwright.buildings.corridors.retrieve import alike, fit_sample
from platwright.buildings.corridors.runs import rounded_bends
from platwright.buildings.corridors.samples import library
from platwright.buildings.corridors.turning import turning_fits
from platwright.buildings.corridors.ways import Ways
from platwright.errors import CancelledError
from platwright.levels import CUL_DE_SAC
from platwright.parcels.streetspace import StreetWidths
from platwright.progress import Silent
from platwright.site import AccessPoint, Site
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Point, Polygon

UTM = CRS.from_epsg(32633)
SAMPLES = library()
BY_NAME = {own.name: own for own in SAMPLES}


def site_of(ring, *, frontage=None, gates=(), obstacles=()) -> Site:
    """A site with streets all round, or along a part of its edge."""
    polygon = Polygon(ring)
    front = MultiLineString([polygon.exterior.coords]) if frontage is None else frontage
    points = tuple(AccessPoint(tuple(xy), tuple(xy), (1.0, 0.0)) for xy in gates)
    return Site(
        "Zone", 1, polygon, UTM, UTM, street_frontage=front, access_points=points,
        obstacles=tuple(obstacles),
    )  # fmt: skip


def moved(points, degrees: float, scale: float) -> np.ndarray:
    angle = math.radians(degrees)
    matrix = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return scale * np.asarray(points) @ matrix.T + np.array([460_000.0, 5_550_000.0])


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda own: own.name)
def test_a_sample_is_a_sound_plan(sample):
    polygon = Polygon(sample.ring)
    assert polygon.is_valid
    assert polygon.exterior.is_ccw
    assert abs(polygon.area / 1e4 - sample.area_ha) < 1e-9
    entries, inner = sample.nodes[: sample.entries], sample.nodes[sample.entries :]
    assert len(entries) >= 1
    assert shapely.distance(polygon.exterior, shapely.points(entries)).max() < 0.3
    if len(inner):
        assert polygon.buffer(-15.0).covers(shapely.multipoints(inner))
    graph = nx.Graph()
    lines = []
    for street in sample.streets:
        assert street.level in (2, 3, 4)
        graph.add_edges_from(zip(street.nodes[:-1], street.nodes[1:]))
        lines.append(LineString(sample.nodes[list(street.nodes)]))
        assert lines[-1].within(polygon.buffer(0.3))
    assert sorted(graph.nodes) == list(range(len(sample.nodes)))
    for part in nx.connected_components(graph):
        assert min(part) < sample.entries, "a street that no entry leads to"
    for at, line in enumerate(lines):
        for other in lines[:at]:
            meet = shapely.get_coordinates(line.intersection(other))
            for xy in meet:
                assert np.hypot(*(sample.nodes - xy).T).min() < 0.3, "a crossing without a node"
    dead = {n for n in graph.nodes if graph.degree(n) == 1 and n >= sample.entries}
    for street in sample.streets:
        if dead & set(street.nodes) and sample.name != "lane":
            assert street.level == CUL_DE_SAC
    parts = shapely.get_parts(polygon.difference(shapely.union_all(lines).buffer(6.0)))
    parts = parts[shapely.area(parts) > 300.0]
    inside = [
        int(np.flatnonzero(shapely.contains(parts, Point(at)))[0]) for at, _ in sample.patches
    ]
    assert len(set(inside)) == len(inside), "two patterns for one patch"
    assert any(choice.facilities for _, choice in sample.patches)


def test_the_library_suits_zones_of_every_size():
    areas = sorted(own.area_ha for own in SAMPLES)
    assert len(SAMPLES) >= 16
    assert areas[0] < 4.0
    assert areas[-1] > 40.0
    assert all(b / a < 2.0 for a, b in zip(areas, areas[1:]))


@pytest.mark.parametrize("name", ["L", "wedge", "U zone", "Z zone", "winding street", "spine"])
@pytest.mark.parametrize("mirror", [False, True])
def test_a_copy_is_found_and_its_corridors_are_those_of_the_sample(name, mirror):
    sample = BY_NAME[name].mirrored() if mirror else BY_NAME[name]
    ring = moved(sample.ring, 37.0, 1.07)
    nodes = moved(sample.nodes, 37.0, 1.07)
    site = site_of(ring, gates=nodes[: sample.entries])
    outline = outline_of(site)
    found = alike(outline, site.area_ha, SAMPLES)
    assert found[0].sample.name == name
    assert found[0].form < 0.02
    assert found[0].entries < 0.005
    adapted = adapt(found[0].sample, outline, found[0].registration, site, Ways(site, 12.0))
    assert adapted.lost == pytest.approx(0.0, abs=1e-9)
    assert adapted.bent == pytest.approx(0.0, abs=1e-9)
    away = np.hypot(*np.moveaxis(adapted.nodes[:, None] - nodes[None], 2, 0))
    assert away.min(axis=1).max() < 1.0
    assert away.min(axis=0).max() < 1.0


def test_registered_boundaries_carry_corners_onto_corners():
    sample = BY_NAME["L"]
    # the same L with one arm half as long again
    ring = sample.ring.copy()
    ring[ring[:, 0] > 300.0, 0] += 195.0
    outline = outline_of(site_of(moved(ring, 0.0, 1.0)))
    shift = turning_fits(outline.ring, sample.ring, 1)[0][1]
    registration = register(sample, outline, shift)
    own, there = registration.rings(sample, outline)
    assert own.shape == there.shape
    assert Polygon(own).symmetric_difference(Polygon(sample.ring)).area < 1.0
    assert Polygon(there).symmetric_difference(Polygon(outline.ring)).area < 1.0
    for corner, target in zip(sample.ring, moved(ring, 0.0, 1.0)):
        at = np.argmin(np.hypot(*(own - corner).T))
        assert np.hypot(*(own[at] - corner)) < 0.01
        assert np.hypot(*(there[at] - target)) < 0.5


def test_places_of_points_on_a_ring():
    ring = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 50.0], [0.0, 50.0]])
    points = np.array([[50.0, 0.0], [100.0, 25.0], [0.0, 25.0], [40.0, 60.0]])
    assert np.allclose(places_of(ring, points), [50 / 300, 125 / 300, 275 / 300, 210 / 300])


def test_entries_go_where_streets_arrive():
    ring = moved([[0, 0], [330, 0], [330, 320], [0, 320]], 0.0, 1.0)
    gate = moved([[190.0, 0.0]], 0.0, 1.0)
    site = site_of(ring, gates=gate)
    fitted = fit_sample(site, [], StreetWidths(), samples=[BY_NAME["cross"]])
    ends = np.vstack([shapely.get_coordinates(c.line)[[0, -1]] for c in fitted.corridors])
    assert np.hypot(*(ends - gate[0]).T).min() < 0.01


def test_entries_lie_only_where_there_is_a_street():
    ring = moved([[0, 0], [330, 0], [330, 320], [0, 320]], 0.0, 1.0)
    south = MultiLineString([LineString(ring[:2])])
    site = site_of(ring, frontage=south)
    corridors, _, fitted = sample_corridors(site, [], StreetWidths())
    assert fitted is not None
    polygon = site.polygon
    for own in corridors:
        for xy in (own.line.coords[0], own.line.coords[-1]):
            if polygon.exterior.distance(Point(xy)) < 0.5:
                assert south.distance(Point(xy)) < 0.5


@pytest.mark.parametrize("kind", ["square", "pond", "strip", "notch", "island"])
def test_corridors_stay_in_the_zone_and_hang_together(kind):
    obstacles = []
    shape = Polygon(moved([[0, 0], [360, 0], [360, 330], [0, 330]], 20.0, 1.0))
    if kind == "pond":
        obstacles = [Point(moved([[180, 165]], 20.0, 1.0)[0]).buffer(45.0)]
    if kind == "strip":
        shape = Polygon(moved([[0, 0], [700, 0], [700, 110], [0, 110]], 20.0, 1.0))
    if kind == "notch":
        slot = Polygon(moved([[150, -1], [162, -1], [162, 200], [150, 200]], 20.0, 1.0))
        shape = shape.difference(slot)
    if kind == "island":
        shape = shape.difference(Point(moved([[120, 165]], 20.0, 1.0)[0]).buffer(35.0))
    site = dataclasses.replace(site_of(shape.exterior.coords, obstacles=obstacles), polygon=shape)
    corridors, _, _ = sample_corridors(site, [], StreetWidths())
    assert corridors
    ground = shape.difference(shapely.union_all(obstacles))
    space = shapely.union_all([own.line.buffer(0.1) for own in corridors])
    for own in corridors:
        assert own.line.is_simple
        assert own.line.difference(ground.buffer(0.5)).length < 0.5
        for hole in [*obstacles, *(Polygon(ring) for ring in shape.interiors)]:
            assert own.line.distance(hole) > own.width_m / 2
    for part in shapely.get_parts(space):
        assert part.distance(shape.exterior) < 0.5, "a corridor that nobody can reach"


def test_the_same_zone_gets_the_same_corridors():
    site = site_of(moved(BY_NAME["wedge"].ring, 10.0, 1.2))
    first = sample_corridors(site, [], StreetWidths())[0]
    second = sample_corridors(site, [], StreetWidths())[0]
    assert [a.line.equals(b.line) for a, b in zip(first, second)] == [True] * len(first)
    assert len(first) == len(second) > 0


def test_fitting_can_be_cancelled():
    class Stop(Silent):
        def cancelled(self) -> bool:
            return True

    with pytest.raises(CancelledError):
        sample_corridors(site_of(moved(BY_NAME["cross"].ring, 0, 1)), [], StreetWidths(), Stop())


def test_what_no_entry_leads_to_is_given_up():
    def edge(a: int, b: int, size: float = 50.0) -> Edge:
        return Edge(0, a, b, np.array([[0.0, 0.0], [size, 0.0]]))

    kept = pruned([edge(0, 2), edge(2, 3), edge(4, 5), edge(3, 6, 10.0)], 2)
    assert {(own.start, own.end) for own in kept} == {(0, 2), (2, 3)}


def test_a_way_leads_round_a_pond():
    pond = Point(moved([[100, 60]], 0, 1)[0]).buffer(25.0)
    site = site_of(moved([[0, 0], [200, 0], [200, 120], [0, 120]], 0, 1), obstacles=[pond])
    start, end = moved([[30, 60], [170, 60]], 0, 1)
    way = LineString(Ways(site, 12.0).way(start, end, []))
    assert way.distance(pond) > 9.0
    assert 140.0 < way.length < 175.0
    assert Point(way.coords[0]).distance(Point(start)) < 1e-6


def test_bends_are_arcs_that_touch_both_sides():
    corner = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 100.0]])
    everywhere = Point(0, 0).buffer(500.0)
    bend = rounded_bends(corner, np.zeros(3, dtype=bool), 30.0, everywhere)
    arc = bend[1:-1]
    assert np.allclose(np.hypot(*(arc - [70.0, 30.0]).T), 30.0)
    assert np.allclose(arc[[0, -1]], [[70.0, 0.0], [100.0, 30.0]])
    held = rounded_bends(corner, np.array([False, True, False]), 30.0, everywhere)
    assert np.array_equal(held, corner)
    right = rounded_bends(corner * [1.0, -1.0], np.zeros(3, dtype=bool), 30.0, everywhere)
    assert np.allclose(right, bend * [1.0, -1.0])
