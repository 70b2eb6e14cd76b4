"""Plans of paths, checked by their geometry alone."""

from __future__ import annotations

import time

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.paths import ExitCheck, plan_paths
from platwright.buildings.rules import LayoutRules
from platwright.buildings.shape import footprints
from platwright.buildings.types import BuildingType, Placements
from platwright.buildings.zone import ControlLine
from platwright.errors import CancelledError
from platwright.progress import Silent
from shapely.geometry import LineString, Polygon, box

from .paths_setup import (
    TYPES,
    check_plan,
    in_rows,
    make_placed,
    make_zone,
    overlap,
    small_town,
    with_paths,
)

#: Plans of whole zones take their time.
pytestmark = pytest.mark.slow

RULES = LayoutRules()


@pytest.mark.parametrize(("paths", "direction"), [(1, 0), (1, 1), (2, 0), (2, 1), (3, 1)])
def test_a_small_town_is_connected(paths, direction):
    zone, placed = small_town(paths, direction)
    plan = plan_paths(zone, TYPES, RULES, (), placed)
    assert plan.reached.all()
    check_plan(zone, TYPES, placed, plan)
    assert overlap(plan) < 1.0
    assert ((plan.roomy >= 0) & (plan.roomy <= 2)).all()
    exits = {(p.patch, p.exit.coords[0]) for p in plan.paths if p.exit is not None}
    # Shares of one exit add up to one.
    assert plan.exits.sum() <= len(exits) + 1e-9
    assert plan.exits.sum() == pytest.approx(round(plan.exits.sum()))


def test_patterns_differ_as_they_should():
    zone, placed = small_town()
    circle, straight, ending = (
        plan_paths(with_paths(zone, k), TYPES, RULES, (), placed) for k in (1, 2, 3)
    )
    assert ending.exits.sum() < straight.exits.sum(), "branches share one way out"
    assert straight.length_m.mean() < ending.length_m.mean(), "direct ways are shorter"
    assert rings(circle) > rings(straight)
    assert rings(ending) == 0, "branches end at buildings"


def rings(plan) -> int:
    """Count independent loops."""
    graph = nx.MultiGraph()
    for path in plan.paths:
        graph.add_edge(path.line.coords[0], path.line.coords[-1])
    return graph.number_of_edges() - graph.number_of_nodes() + nx.number_connected_components(graph)


def test_a_row_has_one_path_along_its_entrances():
    # Three slabs that touch, entrances in the north, the street in the west.
    zone = make_zone(box(0, 0, 120, 60), access=[[LineString([(0, 0), (0, 60)])]])
    placed = make_placed([(0, 30 + 18 * k, 20, 180, 0) for k in range(3)])
    plan = plan_paths(zone, TYPES, RULES, (), placed)
    check_plan(zone, TYPES, placed, plan)
    # 5 m before the façade at y = 25, from the street straight along the row.
    assert plan.length_m == pytest.approx([35.0, 53.0, 71.0])
    assert plan.turns.tolist() == [1, 1, 1]
    assert plan.exits == pytest.approx([1 / 3] * 3)
    kinds = sorted(p.kind for p in plan.paths)
    assert kinds == ["entrance", "entrance", "entrance", "group", "group", "shared"]
    out = [p for p in plan.paths if p.exit is not None]
    assert len(out) == 1
    assert (out[0].exit.x, out[0].exit.y) == pytest.approx((0.0, 30.0))
    assert out[0].buildings == (0, 1, 2)


def test_an_entrance_at_the_street_leads_straight_out():
    zone = make_zone(box(0, 0, 80, 60))
    placed = make_placed([(2, 40, 11, 180, 0)])
    plan = plan_paths(zone, TYPES, RULES, (), placed)
    assert plan.length_m == pytest.approx([5.0])
    assert plan.turns.tolist() == [0]
    assert len(plan.paths) == 1


def test_buildings_that_stand_askew_are_left_at_right_angles():
    zone = make_zone(box(0, 0, 150, 120))
    placed = make_placed(in_rows(box(0, 0, 150, 120), 0, facing=205.0))
    plan = plan_paths(zone, TYPES, RULES, (), placed)
    check_plan(zone, TYPES, placed, plan)
    assert plan.reached.all()
    shapes = footprints(TYPES, placed)
    for path in plan.paths:
        if path.kind != "entrance":
            continue
        a, b = np.array(path.line.coords[:2])
        side = shapely.shortest_line(shapes[path.buildings[0]], path.line)
        assert side.length < 1e-6
        along = (b - a) / np.hypot(*(b - a))
        facing = np.radians(205.0)
        turn = abs(along @ np.array([np.sin(facing), np.cos(facing)]))
        assert min(turn, abs(1 - turn)) < 1e-3


def test_what_is_walled_in_is_not_reached():
    wall = BuildingType("wall", 78.0, 10.0, 12.0, 4, entrance="same")
    zone = make_zone(box(0, 0, 80, 60), access=[[LineString([(0, 0), (80, 0)])]])
    types = (*TYPES, wall)
    placed = make_placed([(3, 40, 20, 180, 0), (0, 40, 40, 180, 0)])
    plan = plan_paths(zone, types, RULES, (), placed)
    assert plan.reached.tolist() == [True, False]
    assert plan.length_m[1] == 0
    assert plan.exits.tolist() == [1.0, 0.0]
    check_plan(zone, types, placed, plan)


@pytest.mark.parametrize("shift", [0.0, 0.1, 0.2, 0.3])
def test_a_passage_hardly_wider_than_a_path_is_found(shift):
    # Two walls side by side, 3.1 m apart, are all between an entrance and the street.
    wall = BuildingType("wall", 35.0, 12.0, 15.0, 5, entrance="same")
    zone = make_zone(box(0, 0, 75, 70), access=[[LineString([(0, 0), (75, 0)])]])
    types = (*TYPES, wall)
    placed = make_placed(
        [(3, 18.1 + shift, 12, 180, 0), (3, 56.2 + shift, 12, 180, 0), (0, 37, 50, 180, 0)]
    )
    plan = plan_paths(zone, types, RULES, (), placed)
    assert plan.reached.all()
    check_plan(zone, types, placed, plan)


def test_paths_do_not_cut_the_corner_of_a_street():
    # A spike of street space reaches into the patch between two columns of nodes.
    ground = Polygon([(0, 0), (120, 0), (120, 80), (60.6, 80), (60.3, 33), (60.0, 80), (0, 80)])
    zone = make_zone(ground, paths=1)
    placed = make_placed([(0, 30, 30, 180, 0), (0, 90, 30, 180, 0)])
    plan = plan_paths(zone, TYPES, RULES, (), placed)
    check_plan(zone, TYPES, placed, plan)


def test_no_buildings_no_paths():
    zone = make_zone(box(0, 0, 80, 60))
    plan = plan_paths(zone, TYPES, RULES, (), Placements.empty())
    assert plan.paths == ()
    assert plan.reached.shape == plan.length_m.shape == (0,)


def test_paths_go_round_a_pond():
    ground = Polygon(box(0, 0, 140, 90).exterior, [box(15, 15, 30, 80).exterior])
    zone = make_zone(ground, access=[[LineString([(0, 0), (0, 90)])]])
    placed = make_placed([(0, 80, 40, 180, 0), (1, 110, 60, 180, 0)])
    plan = plan_paths(zone, TYPES, RULES, (), placed)
    assert plan.reached.all()
    check_plan(zone, TYPES, placed, plan)
    assert (plan.length_m > 80).all()


def test_structure_lines_are_followed():
    zone = make_zone(box(0, 0, 160, 120), access=[[LineString([(0, 0), (160, 0)])]], paths=3)
    placed = make_placed([(1, 40, 90, 180, 0), (1, 120, 90, 180, 0), (1, 40, 50, 180, 0)])
    spine = ControlLine((80, 0), (80, 120), 180.0, 0, leaf=False)
    plain = plan_paths(zone, TYPES, RULES, (), placed)
    led = plan_paths(zone, TYPES, RULES, (spine,), placed)
    strip = LineString([(80, 0), (80, 120)]).buffer(2.0)

    def along(plan) -> float:
        return sum(p.line.intersection(strip).length for p in plan.paths)

    assert along(led) > along(plain)
    assert along(led) > 60
    check_plan(zone, TYPES, placed, led)


def test_the_same_input_gives_the_same_plan():
    zone, placed = small_town(1)
    one, two = (plan_paths(zone, TYPES, RULES, (), placed) for _ in range(2))
    assert [p.line.wkb for p in one.paths] == [p.line.wkb for p in two.paths]
    assert [p.buildings for p in one.paths] == [p.buildings for p in two.paths]
    assert np.array_equal(one.roomy, two.roomy)


class Impatient(Silent):
    """Cancels when it is asked for the k-th time."""

    def __init__(self, k: int) -> None:
        self.left = k
        self.asked: list[float] = []

    def cancelled(self) -> bool:
        self.asked.append(time.process_time())
        self.left -= 1
        return self.left < 0


def test_a_plan_can_be_cancelled_at_any_moment():
    zone, placed = small_town(1)
    patient = Impatient(10**6)
    plan_paths(zone, TYPES, RULES, (), placed, patient)
    assert np.diff(patient.asked).max() < 1.0
    for k in (0, 3, len(patient.asked) - 1):
        with pytest.raises(CancelledError):
            plan_paths(zone, TYPES, RULES, (), placed, Impatient(k))


def test_a_plan_is_quick():
    zone, placed = small_town()
    begun = time.process_time()
    plan_paths(zone, TYPES, RULES, (), placed)
    # A third of a second on an idle machine.
    assert time.process_time() - begun < 2.0


@st.composite
def scattered(draw):
    """Buildings that stand anywhere in a bent patch, at any angle, none closer than 6 m."""
    ground = draw(
        st.sampled_from(
            [
                box(0, 0, 110, 80),
                Polygon([(0, 0), (120, 10), (110, 90), (60, 70), (10, 100)]),
                Polygon([(0, 0), (120, 0), (120, 40), (50, 40), (50, 110), (0, 110)]),
            ]
        )
    )
    coords = list(ground.exterior.coords)
    sides = [LineString(coords[k : k + 2]) for k in range(len(coords) - 1)]
    street = draw(st.sampled_from([sides, sides[:1], sides[1:3]]))
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    square = draw(st.booleans())
    rows, taken = [], []
    for _ in range(40):
        x, y = rng.uniform(0, 120, 2)
        facing = float(rng.choice([0, 90, 180, 270]) if square else rng.uniform(0, 360))
        row = (int(rng.integers(3)), x, y, facing, 0)
        shape = footprints(TYPES, make_placed([row]))[0]
        if ground.buffer(-5).covers(shape) and all(shape.distance(t) >= 6 for t in taken):
            rows.append(row)
            taken.append(shape)
    zone = make_zone(ground, access=[street], paths=draw(st.integers(1, 3)),
                     direction=draw(st.integers(0, 1)))  # fmt: skip
    return zone, make_placed(rows)


@pytest.mark.slow
@settings(max_examples=80, deadline=None)
@given(scattered())
def test_any_placement_is_connected_where_the_quick_check_says_so(case):
    zone, placed = case
    plan = plan_paths(zone, TYPES, RULES, (), placed)
    check_plan(zone, TYPES, placed, plan)
    quick = ExitCheck(zone, TYPES, RULES).reached(placed)
    assert not (quick & ~plan.reached).any()
