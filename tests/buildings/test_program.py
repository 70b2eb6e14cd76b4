"""The program that chooses columns, against trying all choices."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.place.candidates import Raster
from platwright.buildings.place.checks import fits
from platwright.buildings.place.conflicts import cliques_of
from platwright.buildings.place.groups import groups_of
from platwright.buildings.place.limits import Limits
from platwright.buildings.place.outlines import rows_of
from platwright.buildings.place.program import Effort, Limit, Program, Wish, solve_program
from platwright.buildings.place.relax import relax, restricted, worth_a_look
from platwright.buildings.place.score import score
from platwright.buildings.place.sunshine import Sunshine
from platwright.buildings.rules import LayoutRules
from platwright.buildings.types import FACILITY, BuildingType
from shapely.geometry import box

from .program_setup import MULTISTOREY, plain_zone, rows
from .test_columns import maker_of


def small(pitch: float = 30.0, far: float = 1.2, density: float = 0.3):
    """Two rows with few places, and the program of choosing among them."""
    zone = plain_zone(box(0, 0, 62, 75))
    types = MULTISTOREY[1:4:2]
    rules = LayoutRules(far=far, density=density, green=0.1, far_limit=1.3 * far)
    lines = rows(zone, pitch)
    maker = maker_of(zone, types, rules, lines)
    columns = maker.columns(range(len(lines)), Raster(30.0))
    numbers = columns.numbers(1, 2)
    total = numbers.sum(axis=1)
    worth = maker.worth
    program = Program(
        columns.built + worth.way * columns.way,
        cliques_of(rows_of(columns, types, Sunshine(zone, types, rules)), lines, rules.gap_m),
        [Wish(1.0, total @ gain, worth.missing / 2) for gain in (worth.far, worth.density)],
        Limits(zone, types, rules, np.zeros((1, 2), dtype=np.int64)).rows(
            numbers, np.zeros((1, 2), dtype=np.int64)
        ),
        np.zeros(len(columns), dtype=bool),
    )
    return zone, types, rules, lines, columns, program


def best_by_trying(zone, types, rules, columns) -> float:
    """The objective of the best valid choice of groups of one type, by the judge and the score."""
    w, needed = rules.weights, ways_needed(zone, types, rules)
    alone = [columns.take(np.array([k])).buildings(types)[0] for k in range(len(columns))]
    fit = np.array(
        [
            [not fits(zone, types, rules, one.join(two)) and unmixed(types, one.join(two))
             for two in alone]
            for one in alone
        ]
    )  # fmt: skip
    best = [float(w[0] / sum(w))]

    def grow(placed, way: float, left: np.ndarray) -> None:
        for k in left:
            more = alone[k] if placed is None else placed.join(alone[k])
            if fits(zone, types, rules, more):
                continue  # too much in all
            walk = way + columns.way[k]
            found = score(zone, types, rules, more, None)
            straight = found.ways
            best[0] = min(best[0], found.total + w[2] / sum(w) * (walk / needed - straight))
            grow(more, walk, left[(left > k) & fit[k, left]])

    grow(None, 0.0, np.arange(len(columns)))
    return best[0]


def unmixed(types, placed) -> bool:
    """Whether every group is of one type."""
    group = groups_of(types, placed)
    return all(len(set(placed.type[group == g].tolist())) == 1 for g in set(group.tolist()))


def ways_needed(zone, types, rules) -> float:
    """How many mean residences the wished floor area takes."""
    return max(1.0, rules.far * zone.polygon.area / np.mean([t.floor_area_m2 for t in types]))


@pytest.mark.slow
@pytest.mark.parametrize(("pitch", "far"), [(30.0, 1.2), (22.0, 0.9), (16.0, 2.0)])
def test_the_optimum_is_the_best_of_all_choices(pitch, far):
    zone, types, rules, _, columns, program = small(pitch, far)
    best = best_by_trying(zone, types, rules, columns)
    assert best < program.value(program.hint) - 0.1
    answer = solve_program(program, Effort(60.0))
    assert answer.optimal
    assert program.allows(answer.chosen)
    assert program.value(answer.chosen) == pytest.approx(best, rel=2e-4)
    assert answer.bound <= best + 1e-6
    placed, _ = columns.take(answer.chosen).buildings(types)
    assert fits(zone, types, rules, placed) == []


@st.composite
def programs(draw):
    """Random programs that can be tried out."""
    n = draw(st.integers(1, 9))
    numbers = st.floats(0.01, 1.0, allow_nan=False)
    cost = np.array(draw(st.lists(numbers, min_size=n, max_size=n)))
    gains = [np.array(draw(st.lists(numbers, min_size=n, max_size=n))) for _ in range(2)]
    cliques = (
        [
            np.array(sorted(c))
            for c in draw(
                st.lists(st.sets(st.integers(0, n - 1), min_size=2, max_size=4), max_size=4)
            )
            if n > 1
        ]
        if n > 1
        else []
    )
    weight = np.array(draw(st.lists(st.floats(-1.0, 1.0), min_size=n, max_size=n)))
    wishes = [Wish(draw(st.floats(0.0, 3.0)), gain, draw(st.floats(0.1, 2.0))) for gain in gains]
    limit = Limit(np.arange(n), weight, draw(st.floats(0.0, 1.5)))
    return Program(cost, cliques, wishes, [limit], np.zeros(n, dtype=bool))


def tried(program: Program) -> float:
    """The least cost of all choices."""
    n = len(program.cost)
    choices = ((np.arange(2**n)[:, None] >> np.arange(n)) & 1).astype(bool)
    return min(program.value(x) for x in choices if program.allows(x))


@settings(max_examples=60)
@given(programs())
def test_the_least_cost_is_found(program):
    best = tried(program)
    answer = solve_program(program, Effort(10.0))
    assert program.allows(answer.chosen)
    assert program.value(answer.chosen) == pytest.approx(best, rel=2e-4, abs=1e-6)


@settings(max_examples=60)
@given(programs())
def test_the_relaxation_is_a_bound_and_sorts_out_only_what_cannot_help(program):
    best = tried(program)
    found = relax(program)
    assert found.bound <= best + 1e-6
    keep, bound = worth_a_look(program, 1000)
    assert bound == found.bound
    if best < program.value(program.hint) - 1e-6:
        assert keep.any()
        assert tried(restricted(program, keep)) == pytest.approx(best)
    else:
        assert not keep.any() or tried(restricted(program, keep)) >= best - 1e-6


def test_a_restricted_program_keeps_what_is_between_its_columns():
    cliques = [np.array([0, 1, 2]), np.array([2, 3])]
    limit = Limit(np.array([1, 3]), np.array([2.0, 5.0]), 6.0)
    program = Program(
        np.array([1.0, 2.0, 3.0, 4.0]), cliques, [Wish(1.0, np.arange(4.0), 1.0)], [limit],
        np.array([False, True, False, True]),
    )  # fmt: skip
    part = restricted(program, np.array([False, True, True, True]))
    assert part.cost.tolist() == [2.0, 3.0, 4.0]
    assert [clique.tolist() for clique in part.cliques] == [[0, 1], [1, 2]]
    assert part.limits[0].columns.tolist() == [0, 2]
    assert part.hint.tolist() == [True, False, True]
    assert not part.allows(part.hint)  # 2 + 5 > 6
    assert not part.allows(np.array([True, True, False]))
    assert part.allows(np.array([False, False, True]))


def test_a_stopped_run_is_no_error():
    *_, program = small()
    answer = solve_program(program, Effort(60.0), lambda: True)
    assert answer.chosen is None or program.allows(answer.chosen)


def test_the_same_nodes_give_the_same_answer():
    *_, program = small(16.0, 2.0)
    one, two = (solve_program(program, Effort(1e9, 1)) for _ in range(2))
    assert one.chosen is not None
    assert program.allows(one.chosen)
    assert (one.chosen == two.chosen).all()


def test_no_columns_leave_everything_missing():
    none = np.zeros(0)
    program = Program(none, [], [Wish(2.0, none, 0.5)], [], none.astype(bool))
    answer = solve_program(program, Effort(1.0))
    assert answer.optimal
    assert answer.bound == 1.0


def numbers(*each) -> np.ndarray:
    """Columns that are one building of each type, in a single patch."""
    return np.array(each).astype(np.int64).reshape(len(each), 1, -1)


def allowed(types, chosen, *, standing=None, rules=None, zone=None) -> bool:
    """Whether so many buildings of each type keep to the limits."""
    zone = zone or plain_zone(box(0, 0, 400, 250))
    rules = rules or LayoutRules(far=5.0, density=0.6, green=0.1)
    k = len(types)
    stand = np.zeros((1, k), dtype=np.int64) if standing is None else np.array([standing])
    limits = Limits(zone, types, rules, stand)
    # a second column, so that no row is left out for having no columns
    found = limits.rows(numbers(chosen, np.ones(k)), np.zeros((1, k), dtype=np.int64))
    none = np.zeros(0)
    return Program(none, [], [], found, none).allows(np.array([True, False]))


def homes(*shares) -> tuple[BuildingType, ...]:
    return tuple(
        BuildingType(f"h{k}", 20.0, 10.0, 9.0, 3, share=share) for k, share in enumerate(shares)
    )


def test_shares_hold_within_a_tenth_and_one_building():
    types = homes(0.5, 0.5)
    assert allowed(types, (10, 10))
    assert allowed(types, (1, 0))
    assert allowed(types, (12, 8))  # 20 * 0.5 * 1.1 + 1
    assert not allowed(types, (13, 7))
    assert not allowed(types, (7, 13))
    # a type without a wish takes the rest
    assert allowed(homes(0.2, None), (4, 16))
    assert not allowed(homes(0.2, None), (7, 13))
    assert not allowed(homes(0.2, None), (2, 22))


def test_a_plan_that_is_off_already_may_stay_so():
    types = homes(0.5, 0.5)
    assert allowed(types, (16, 4), standing=(16, 4))
    assert not allowed(types, (18, 2), standing=(16, 4))


def test_counts_and_facilities():
    types = (
        BuildingType("h", 20.0, 10.0, 9.0, 3, count=5),
        BuildingType("f", 20.0, 10.0, 9.0, 3, use=FACILITY),
        BuildingType("g", 20.0, 10.0, 9.0, 3, use=FACILITY, count=3),
    )
    assert allowed(types, (5, 1, 3))
    assert not allowed(types, (6, 1, 3))
    assert not allowed(types, (5, 2, 3))
    assert not allowed(types, (5, 1, 4))
    assert not allowed(types, (5, 0, 3), standing=(5, 1, 3))  # what a patch has is not lost
    assert allowed(types, (4, 1, 3), standing=(5, 1, 3))


def test_far_and_density_are_never_exceeded():
    zone = plain_zone(box(0, 0, 100, 100))
    types = homes(None)
    tight = LayoutRules(far=0.17, density=0.5, green=0.1)
    assert allowed(types, (2,), rules=tight, zone=zone)  # 1200 of 1785 m2
    assert not allowed(types, (3,), rules=tight, zone=zone)
    tight = LayoutRules(far=5.0, density=0.055, green=0.1)
    assert allowed(types, (2,), rules=tight, zone=zone)  # 400 of 577 m2
    assert not allowed(types, (3,), rules=tight, zone=zone)
