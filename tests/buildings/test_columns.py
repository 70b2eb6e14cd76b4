"""Columns of the program: where they stand, what they cost, which exclude each other."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.place.candidates import Maker, Raster
from platwright.buildings.place.checks import fits
from platwright.buildings.place.columns import Columns, columns_of
from platwright.buildings.place.conflicts import cliques_of
from platwright.buildings.place.ground import buildable
from platwright.buildings.place.groups import groups_of
from platwright.buildings.place.outlines import at_odds, pairs_between, rows_of
from platwright.buildings.place.score import score
from platwright.buildings.place.stretches import stretches_of
from platwright.buildings.place.sunshine import Sunshine
from platwright.buildings.place.ways import Ways
from platwright.buildings.place.worth import Worth
from platwright.buildings.rules import LayoutRules, SunRule
from platwright.buildings.shape import footprints
from platwright.buildings.types import FACILITY, BuildingType
from platwright.buildings.zone import ControlLine
from shapely.geometry import Polygon, box

from .program_setup import MULTISTOREY, plain_zone, rows

#: Plans of whole zones take their time.
pytestmark = pytest.mark.slow

#: Limits that no pair of buildings comes near.
LOOSE = LayoutRules(far=20.0, density=0.6, green=0.1)


def maker_of(zone, types, rules, lines) -> Maker:
    ways = Ways(zone, types, rules, lines)
    stretches = stretches_of(types, lines, buildable(zone, rules), ways)
    return Maker(types, lines, Worth.of(zone, types, rules), stretches)


def excluded(columns: Columns, zone, types, rules, lines) -> np.ndarray:
    """Which columns exclude each other by cliques, shape (n, n)."""
    drawn = rows_of(columns, types, Sunshine(zone, types, rules))
    found = np.zeros((len(columns), len(columns)), dtype=bool)
    for clique in cliques_of(drawn, lines, rules.gap_m):
        assert len(set(clique.tolist())) == len(clique) > 1
        found[np.ix_(clique, clique)] = True
    np.fill_diagonal(found, False)
    return found


def by_the_judge(columns: Columns, zone, types, rules) -> np.ndarray:
    """Which columns cannot stand together by `fits`, or would become one group, (n, n)."""
    found = np.zeros((len(columns), len(columns)), dtype=bool)
    for a, b in itertools.combinations(range(len(columns)), 2):
        placed, owner = columns.take(np.array([a, b])).buildings(types)
        group = groups_of(types, placed)
        joined = bool(set(group[owner == 0].tolist()) & set(group[owner == 1].tolist()))
        found[a, b] = found[b, a] = joined or bool(fits(zone, types, rules, placed))
    return found


def test_single_places_on_a_line_are_those_inside_the_setback():
    zone = plain_zone(box(0, 0, 100, 60))
    types = (BuildingType("slab", 20.0, 10.0, 12.0, 4),)
    lines = (ControlLine((0.0, 30.0), (100.0, 30.0), 180.0, 0),)
    found = maker_of(zone, types, LOOSE, lines).stretches
    # 5 m of setback and half the façade on both sides
    assert found.low == pytest.approx([15.0], abs=0.01)
    assert found.high == pytest.approx([85.0], abs=0.01)


def test_an_obstacle_in_the_line_splits_it():
    ground = box(0, 0, 140, 60).difference(box(68, 20, 72, 40))
    zone = plain_zone(Polygon(ground.exterior, ground.interiors))
    types = (BuildingType("slab", 20.0, 10.0, 12.0, 4),)
    lines = (ControlLine((0.0, 30.0), (140.0, 30.0), 180.0, 0),)
    found = maker_of(zone, types, LOOSE, lines).stretches
    assert found.low == pytest.approx([15.0, 87.0], abs=0.01)
    assert found.high == pytest.approx([53.0, 125.0], abs=0.01)


def test_groups_border_upon_each_other_and_are_no_longer_than_allowed():
    zone = plain_zone(box(0, 0, 130, 60))
    lines = rows(zone, 60.0, first=30.0)
    columns = maker_of(zone, MULTISTOREY, LOOSE, lines).columns([0], Raster(5.0))
    assert set(columns.numbers(1, 6).sum(axis=(0, 1)).nonzero()[0]) == {0, 1, 2, 3}
    length = 2 * columns.half_lengths(MULTISTOREY)
    assert length.max() <= LOOSE.group_m + 1e-6
    assert {(0, 5), (1, 3), (2, 3), (3, 3)} <= set(zip(columns.type, columns.count))
    for k in range(len(columns)):
        placed, owner = columns.take(np.array([k])).buildings(MULTISTOREY)
        assert len(placed) == columns.count[k]
        assert not owner.any()
        assert fits(zone, MULTISTOREY, LOOSE, placed) == []
        assert set(groups_of(MULTISTOREY, placed)) == {0}
        assert placed.xy[:, 1] == pytest.approx(30.0)


def test_what_columns_cost_is_what_the_score_says():
    zone = plain_zone(box(0, 0, 130, 60))
    lines = rows(zone, 60.0, first=30.0, facing=220.0)
    types = MULTISTOREY[:2]
    towers = maker_of(zone, types, LOOSE, lines).columns([0], Raster(9.0))
    straight = maker_of(zone, types, LOOSE, rows(zone, 60.0, first=30.0)).columns([0], Raster(9.0))
    assert set(towers.count) == {1}
    assert straight.count.max() == 5
    ways = Ways(zone, types, LOOSE, lines)
    for columns in (towers, straight):
        for k in range(0, len(columns), 7):
            placed, _ = columns.take(np.array([k])).buildings(types)
            found = score(zone, types, LOOSE, placed, None)
            built = found.grouping / 12 + LOOSE.pattern_penalty * found.pattern
            assert columns.built[k] == pytest.approx(built)
            # reckoned every few metres and in between by straight lines
            assert columns.way[k] == pytest.approx(ways.reckon(placed).sum(), abs=0.08)


def test_groups_that_stand_become_columns():
    zone = plain_zone(box(0, 0, 130, 60))
    columns = maker_of(zone, MULTISTOREY, LOOSE, rows(zone, 60.0, first=30.0)).columns(
        [0], Raster(5.0)
    )
    two = np.flatnonzero((columns.type == 1) & (columns.count == 2))
    plan = columns.take(np.array([two[0], two[-1]]))
    placed, _ = plan.buildings(MULTISTOREY)
    again = columns_of(placed, groups_of(MULTISTOREY, placed), np.array([1.0, 2.0]), np.ones(4))
    assert len(again) == 2
    assert again.way.tolist() == [2.0, 2.0]
    back, owner = again.buildings(MULTISTOREY)
    assert back.xy == pytest.approx(placed.xy)
    assert owner.tolist() == [0, 0, 1, 1]


@pytest.mark.parametrize("pitch", [13.0, 20.0, 27.5])
@pytest.mark.parametrize("gap", [6.0, 0.1])
def test_cliques_hold_exactly_the_pairs_that_cannot_stand_together(pitch, gap):
    zone = plain_zone(box(0, 0, 75, 90))
    rules = LayoutRules(far=20.0, density=0.6, green=0.1, gap_m=gap, setback_m=3.0)
    types = (*MULTISTOREY[:2], MULTISTOREY[3], MULTISTOREY[5])
    lines = (
        *rows(zone, pitch),
        ControlLine((0.0, 20.0), (75.0, 20.0), 180.0, 0, use=FACILITY),
    )
    columns = maker_of(zone, types, rules, lines).columns(range(len(lines)), Raster(13.0))
    rng = np.random.default_rng(7)
    columns = columns.take(np.sort(rng.permutation(len(columns))[:40]))
    found = excluded(columns, zone, types, rules, lines)
    judged = by_the_judge(columns, zone, types, rules)
    assert judged.sum() > 50
    assert (found == judged).all()


def doubtful(columns: Columns, types, gap: float) -> np.ndarray:
    """Which columns are apart by the gap within the 2 cm that the judge forgives, (n, n)."""
    placed, owner = columns.buildings(types)
    shape = np.array(
        [shapely.union_all(footprints(types, placed)[owner == k]) for k in range(len(columns))]
    )
    return np.abs(shapely.distance(shape[:, None], shape[None, :]) - gap + 0.01) < 0.0115


@settings(max_examples=6)
@given(
    turns=st.lists(st.floats(0.0, 359.0), min_size=2, max_size=3),
    spots=st.lists(st.tuples(st.floats(25, 65), st.floats(25, 65)), min_size=3, max_size=3),
    along=st.booleans(),
)
def test_cliques_are_right_for_lines_in_any_direction(turns, spots, along):
    zone = plain_zone(box(0, 0, 90, 90))
    rules = LayoutRules(far=20.0, density=0.6, green=0.1, setback_m=3.0)
    types = MULTISTOREY[:2]
    lines = []
    for turn, (x, y) in zip(turns, spots):
        way = np.array([np.cos(np.radians(turn)), -np.sin(np.radians(turn))]) * 20.0
        lines.append(
            ControlLine(
                (x - way[0], y - way[1]), (x + way[0], y + way[1]), turn if along else 180.0, 0
            )
        )
    columns = maker_of(zone, types, rules, lines).columns(range(len(lines)), Raster(11.0))
    columns = columns.take(np.arange(0, len(columns), max(1, len(columns) // 20)))
    found = excluded(columns, zone, types, rules, lines)
    judged = by_the_judge(columns, zone, types, rules)
    clear = ~doubtful(columns, types, rules.gap_m)
    assert (found == judged)[clear].all()


def test_towers_keep_the_distance_of_their_line():
    zone = plain_zone(box(0, 0, 200, 60))
    types = (BuildingType("tower", 12.0, 12.0, 30.0, 10),)
    lines = (ControlLine((0.0, 30.0), (200.0, 30.0), 180.0, 0, spacing_m=40.0),)
    columns = maker_of(zone, types, LOOSE, lines).columns([0], Raster(4.0))
    columns = columns.take(np.flatnonzero(columns.count == 1))
    found = excluded(columns, zone, types, LOOSE, lines)
    apart = np.abs(columns.xy[:, None, 0] - columns.xy[None, :, 0])
    assert (found == (apart < 40.0 - 1e-3))[~np.eye(len(columns), dtype=bool)].all()


def test_a_place_and_its_mirror_are_one_column():
    zone = plain_zone(box(0, 0, 170, 60))
    types = (BuildingType("slab", 20.0, 10.0, 12.0, 4),)
    lines = (
        ControlLine((80.0, 30.0), (5.0, 30.0), 180.0, 0, mirror=1),
        ControlLine((90.0, 30.0), (165.0, 30.0), 180.0, 0, mirror=0),
    )
    maker = maker_of(zone, types, LOOSE, lines)
    columns = maker.columns([0, 1], Raster(5.0))
    assert np.bincount(columns.owner).tolist() == [2] * len(columns)
    centre = columns.xy[:, 0].reshape(-1, 2)
    assert centre.sum(axis=1) == pytest.approx(170.0)
    # the two nearest to the axis would stand 10 m apart or closer
    drawn = rows_of(columns, types, Sunshine(zone, types, LOOSE))
    inner = np.abs(centre[:, 0] - centre[:, 1]) - 2 * columns.half_lengths(types)[::2]
    assert set(at_odds(drawn, 12.0).tolist()) == set(np.flatnonzero(inner < 12.0 - 1e-3).tolist())
    assert set(at_odds(drawn, 6.0).tolist()) == set(np.flatnonzero(inner < 6.0 - 1e-3).tolist())


def test_a_place_whose_mirror_has_no_room_stands_alone():
    zone = plain_zone(box(0, 0, 130, 60))
    types = (BuildingType("slab", 20.0, 10.0, 12.0, 4),)
    lines = (
        ControlLine((80.0, 30.0), (5.0, 30.0), 180.0, 0, mirror=1),
        ControlLine((90.0, 30.0), (165.0, 30.0), 180.0, 0, mirror=0),
    )
    columns = maker_of(zone, types, LOOSE, lines).columns([0, 1], Raster(5.0))
    rows_each = np.bincount(columns.owner)
    west = columns.xy[np.flatnonzero(np.append(True, np.diff(columns.owner) > 0)), 0]
    assert set(rows_each) == {1, 2}
    assert west[rows_each == 1].max() < 65.0


def test_hours_keep_rows_as_far_apart_as_an_endless_row_would_have_to_be():
    zone = plain_zone(box(0, 0, 300, 300))
    types = (BuildingType("slab", 20.0, 10.0, 18.0, 6),)
    rules = LayoutRules(far=5.0, sun=SunRule(hours=2.0))
    sun = Sunshine(zone, types, rules)
    reach = float(sun.reach(np.array([0]), np.array([180.0]))[0])
    lines = [
        ControlLine((0.0, 40.0), (300.0, 40.0), 180.0, 0),
        ControlLine((0.0, 40.0 + reach + 0.5), (300.0, 40.0 + reach + 0.5), 180.0, 0),
        ControlLine((0.0, 40.0 + reach - 2.0), (300.0, 40.0 + reach - 2.0), 180.0, 0),
    ]
    columns = maker_of(zone, types, rules, lines).columns([0, 1, 2], Raster(20.0))
    one = columns.take(np.flatnonzero((columns.line == 0) & (columns.count == 1)))
    for line, shaded in ((1, False), (2, True)):
        behind = columns.take(np.flatnonzero((columns.line == line) & (columns.count == 1)))
        middle = behind.take(np.argmin(np.abs(behind.xy[:, 0] - 150.0))[None])
        together = rows_of(one.join(middle), types, sun)
        last = len(one)
        pairs = pairs_between(
            together.take(np.arange(last)), together.take(np.array([last])), rules.gap_m
        )
        assert bool(len(pairs)) == shaded
        # a row without gaps, which is what the spacing is for
        wall = one.xy[np.abs(one.xy[:, 0] - 150.0) < 200][:1]
        dense = np.arange(-500.0, 801.0, 20.0)
        wall = np.column_stack([dense, np.full(len(dense), wall[0, 1])])
        placed, _ = middle.buildings(types)
        row = placed.take(np.zeros(len(wall), dtype=int))
        row.xy[:] = wall
        dark = sun.in_shade(row.join(placed))[-1]
        assert bool(dark) == shaded
