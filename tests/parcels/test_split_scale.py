"""What lets the splitter do large sites: neighbours at hand, streets looked at only when needed."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError
from platwright.parcels.edges import EdgeKind
from platwright.parcels.field.crosses import cross_field, default_size
from platwright.parcels.field.streamlines import streamlines
from platwright.parcels.roadmesh import (
    GivenStreet,
    Ground,
    MeshEdge,
    StreetMesh,
    begin_mesh,
    region_blocks,
)
from platwright.parcels.roadmesh.land import region_land
from platwright.parcels.rules import ParcelRules
from platwright.parcels.split.backtrack import Backtracker
from platwright.parcels.split.cells import costs_of, fill_regions
from platwright.parcels.split.junctions import junctions_of
from platwright.parcels.split.moving import optimised
from platwright.parcels.split.proposals import Proposal
from platwright.parcels.split.rules import SplitRules
from platwright.parcels.split.search import Splitter
from platwright.progress import Silent
from shapely.geometry import LineString, MultiLineString, Polygon, box

STREET = MeshEdge(EdgeKind.STREET, 0, 15.0)
ORGANIC = Polygon([(0, 0), (260, -20), (420, 60), (400, 260), (210, 330), (30, 250)])


def begun(polygon: Polygon) -> StreetMesh:
    return begin_mesh(Ground(polygon, MultiLineString([LineString(polygon.exterior)])))[0]


def split_at(mesh: StreetMesh, region: int, t: float) -> list[int]:
    """Split a region straight through the middles of two edges of its ring, far from each other."""
    ring = mesh.regions[region].rings[0]
    at = int(t * len(ring)) % len(ring)
    pairs = [(ring[k % len(ring)], ring[(k + 1) % len(ring)]) for k in (at, at + len(ring) // 2)]
    places = [(mesh.xy[a] + mesh.xy[b]) / 2 for a, b in pairs]
    if not mesh.polygon(region).contains(shapely.Point(sum(places) / 2)):
        return []  # both are on the same side
    ends = [mesh.insert(a, b, (x, y)) for (a, b), (x, y) in zip(pairs, places)]
    return mesh.split(region, [ends], [STREET])


def around(mesh: StreetMesh, v: int) -> set[int]:
    return {b if a == v else a for a, b in mesh.edges if v in (a, b)}


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 0.99), st.floats(0, 0.99)), min_size=1, max_size=12))
def test_a_mesh_knows_the_neighbours_of_its_vertices(choices):
    mesh = begun(box(0, 0, 300, 200))
    for which, t in choices:
        numbers = sorted(mesh.regions)
        split_at(mesh, numbers[int(which * len(numbers))], t)
    before = mesh.copy()
    (region, parts) = mesh.families(2)[0]
    mesh.merge(region, parts)
    for own in (before, mesh):
        for v in range(len(own.xy)):
            assert sorted(own.neighbours(v)) == sorted(around(own, v))
        for number in own.regions:
            places, ways = junctions_of(own, number)
            ring = {v for r in own.regions[number].rings for v in r}
            edges = {tuple(sorted(half)) for half in own.regions[number].edges()}
            expected = sorted(
                (*own.xy[v], *((own.xy[v] - own.xy[w]) / np.hypot(*(own.xy[v] - own.xy[w]))))
                for v in ring
                for w in around(own, v)
                if own.edge(v, w).street >= 0 and tuple(sorted((v, w))) not in edges
            )
            found = sorted(map(tuple, np.hstack([places, ways]).tolist()))
            assert np.array(found).reshape(-1) == pytest.approx(np.array(expected).reshape(-1))


def test_blind_ends_are_looked_for_once():
    site = box(0, 0, 200, 300)
    open_sides = MultiLineString([LineString([(0, 0), (200, 0)])])
    mesh, _ = begin_mesh(Ground(site, open_sides))
    (region,) = mesh.regions
    ring = mesh.regions[region].rings[0]
    a, b, c, d = sorted(ring, key=lambda v: (mesh.xy[v][1], mesh.xy[v][0]))
    ends = [mesh.insert(a, b, (100.0, 0.0)), mesh.insert(c, d, (100.0, 300.0))]
    mesh.split(region, [ends], [STREET])
    blocks = region_blocks(mesh, 9.0)
    for number, own in blocks.items():
        alone = region_land(mesh, number, 9.0)
        assert [block.polygon.wkb for block in own] == [part.wkb for part in alone]
    # half the street and half of the turning circle outside it are no land
    assert sum(b.polygon.area for own in blocks.values() for b in own) < 200 * 300 - 15 * 300 - 20


def test_streets_of_second_thoughts_keep_numbers_of_their_own(monkeypatch):
    """The first way was better, though the second had fewer streets: its numbers are taken."""
    mesh = begun(box(0, 0, 300, 200))
    splitter = Splitter(mesh, ParcelRules(), SplitRules())
    offered = [Proposal((LineString([(0, 0), (1, 1)]),) * n, float(n)) for n in (2, 1)]
    monkeypatch.setattr(splitter, "_sound", lambda *_, **__: iter(offered))

    def attempt(region, samples, proposal):
        number, splitter._next = splitter._next, splitter._next + len(proposal.lines)
        top = splitter._mesh
        for k in range(len(proposal.lines)):
            a, b = next(iter(top.regions[region].edges()))
            top.set_edge(a, b, MeshEdge(EdgeKind.STREET, number + k, 15.0))
        return {region: 1000.0 * number + 1000.0}

    monkeypatch.setattr(splitter, "_try", attempt)
    made = splitter.run().mesh
    assert splitter._next > max(edge.street for edge in made.edges.values())
    assert max(edge.street for edge in made.edges.values()) == 1  # the first way was kept


def test_streets_are_looked_at_only_until_one_will_do(monkeypatch):
    splitter = Splitter(begun(box(0, 0, 400, 300)), ParcelRules(), SplitRules())
    looked, tried = [], []
    judge, attempt = splitter._judge, splitter._try

    def judged(region, samples, lines, *, across):
        worse = judge(region, samples, lines, across=across)
        looked.append((across, worse is not None))
        return worse

    def counted(*given):
        tried.append(given)
        return attempt(*given)

    monkeypatch.setattr(splitter, "_judge", judged)
    monkeypatch.setattr(splitter, "_try", counted)
    assert splitter.run().unserved == {}
    good = sum(well for across, well in looked if not across)
    assert 0 < good <= len(tried)


def test_costs_of_many_regions_are_those_of_each():
    rules = ParcelRules()
    mesh = Splitter(begun(ORGANIC), rules, SplitRules()).run().mesh
    cells = fill_regions(mesh, sorted(mesh.regions), rules, refine=False)
    assert len(cells) > 3
    for region, cell in cells.items():
        area = mesh.polygon(region).area
        assert cell.cost == pytest.approx(costs_of([area], [cell.plots], rules)[0], rel=1e-9)
        green = sum(
            p.polygon.area for row in cell.plots for p in row if p.use in ("green", "court")
        )
        land = green + sum(p.polygon.area for row in cell.plots for p in row if p.use == "parcel")
        least = (12.0 * green + 10.0 * (area - land)) / 540.0
        assert cell.cost >= least - 1e-9
    assert costs_of([1080.0], [[]], rules) == [20.0]
    assert costs_of([], [], rules) == []


def test_moved_streets_and_second_thoughts_never_cost_more():
    rules, split = ParcelRules(), SplitRules()
    splitter = Splitter(begun(ORGANIC), rules, split)
    mesh = splitter.run().mesh
    cells = fill_regions(mesh, sorted(mesh.regions), rules, refine=False)

    def total(own):
        return sum(cell.cost for cell in own.values())

    start = total(cells)
    second = Backtracker(splitter, mesh, cells)
    second.run(6, Silent())
    middle = total(second.cells)
    moved, kept = optimised(second.mesh, second.cells, rules, split, 0, Silent())
    assert total(kept) <= middle <= start
    # what is kept of earlier rounds is what the streets that were kept would give
    again = fill_regions(moved, sorted(moved.regions), rules, turning=9.0, refine=False)
    for region, cell in kept.items():
        assert cell.cost == pytest.approx(again[region].cost, abs=1e-6)


def test_short_lines_are_found_without_the_long_ones():
    field = cross_field(box(0, 0, 420, 75))
    every, short = streamlines(field), streamlines(field, longest=120.0)
    ends = {tuple(np.round(short.line(k)[[0, -1]].ravel(), 6)) for k in range(len(short))}
    across = [k for k in range(len(every)) if every.length[k] < 120]
    assert len(across) > 10
    assert len(every) > len(across)
    assert {tuple(np.round(every.line(k)[[0, -1]].ravel(), 6)) for k in across} <= ends
    assert short.length.max() < 2 * 120 + 8 * 12


def test_triangles_grow_with_the_widest_regions_only():
    assert default_size(0.0) == default_size(9_000.0) == 5.0
    assert default_size(40_000.0) == 10.0
    assert default_size(1e6) == default_size(2.5e6) == 16.0
    assert default_size(9e6) == 30.0


class Stop(Silent):
    """Cancels at the n-th question, and counts."""

    def __init__(self, at: int) -> None:
        self.at, self.asked = at, 0

    def cancelled(self) -> bool:
        self.asked += 1
        return self.asked >= self.at


def test_splitting_asks_at_every_street_that_it_looks_at(monkeypatch):
    told = Stop(10**9)
    splitter = Splitter(begun(ORGANIC), ParcelRules(), SplitRules(), progress=told)
    looked = []
    judge = splitter._judge
    monkeypatch.setattr(
        splitter, "_judge", lambda *a, **k: looked.append(told.asked) or judge(*a, **k)
    )
    splitter.run()
    assert len(set(looked)) == len(looked) > 2
    for at in (1, 2, looked[-1]):
        with pytest.raises(CancelledError):
            Splitter(begun(ORGANIC), ParcelRules(), SplitRules(), progress=Stop(at)).run()


def test_edges_belong_to_the_nearest_of_given_streets_that_part_slowly():
    site = box(0, 0, 400, 300)
    lines = [
        LineString([(-5, 100), (405, 100)]),
        LineString([(60, 99.98), (200, 100.05), (300, 305)]),
    ]
    mesh, _ = begin_mesh(
        Ground(site, MultiLineString([LineString(site.exterior)]),
               streets=[GivenStreet(line, 12.0) for line in lines])
    )  # fmt: skip
    for number, line in enumerate(lines):
        own = [key for key, edge in mesh.edges.items() if edge.street == number]
        assert own
        for a, b in own:
            assert (
                LineString(mesh.xy[[a, b]]).hausdorff_distance(
                    line.intersection(LineString(mesh.xy[[a, b]]).buffer(1e-6))
                )
                < 0.01
            )
