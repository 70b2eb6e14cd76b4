"""Growth from streets that are there: they stay where they are, and are joined."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from platwright.growth.grammar import Child, Grammar, Rule, State
from platwright.growth.grow import grow
from platwright.growth.rules import GrowthRules
from platwright.growth.types import Ground, Start

from .growth_checks import AHEAD, FOUR, START, a_ground, lines_of

STREET = {
    "nodes": np.array([(-400.0, 100.0), (3.0, 104.0), (5.0, 104.5), (400.0, 120.0)]),
    "ends": np.array([(0, 1), (1, 2), (2, 3)]),
    "street": np.array([7, 7, 7]),
    "bends": np.array([False, True, True, False]),
}


@pytest.mark.parametrize("published", [False, True])
@pytest.mark.parametrize("kind", ["streets", "both", "edge"])
@pytest.mark.parametrize("name", FOUR)
def test_streets_that_are_there_stay(name, kind, published):
    ground = a_ground(kind, FOUR[name])
    rules = GrowthRules(FOUR[name], scale=60.0, max_segments=600, as_published=published)
    growth = grow(ground, rules)
    count = len(ground.nodes)
    assert (growth.xy[:count] == ground.nodes).all()
    before = shapely.linestrings(ground.nodes[ground.ends])
    lines = lines_of(growth)
    for street in np.unique(ground.street):
        old = shapely.union_all(before[ground.street == street])
        new = lines[growth.street == street]
        assert sum(shapely.length(new)) == pytest.approx(old.length, rel=1e-12)
        assert shapely.hausdorff_distance(old, shapely.union_all(new)) < 1e-6
        # every new node on it lies on it but for rounding
        on = np.unique(growth.ends[growth.street == street])
        assert shapely.distance(old, shapely.points(growth.xy[on])).max() < 1e-8
    if published:
        assert (growth.street >= 0).sum() == len(ground.street)
    else:
        assert (growth.street >= 0).sum() > len(ground.street)
    # bends are exactly the bends of before at which nothing has joined
    still = np.zeros(len(growth.xy), dtype=bool)
    still[:count] = ground.bends & (growth.degrees[:count] == 2)
    if not published:
        assert (growth.bends == still).all()


def one_street(xy, length, state=START, **more):
    """Grow one street straight ahead."""
    child = Child((0.0, 0.0), (length, length), State("m", "L"))
    grammar = Grammar("one", {START: (Rule(1, "K", (child,)),)})
    ground = Ground((Start(xy, AHEAD, state),), **STREET)
    return grow(ground, GrowthRules(grammar, iterations=1, **more))


def test_a_crossing_near_a_bend_lands_on_it():
    # two metres beside the bend, and two bends two metres apart: no sliver
    growth = one_street((2.0, 0.0), 3.0)
    assert growth.ends[growth.grown].tolist() == [[4, 1]]
    assert not growth.bends[1]
    assert growth.bends[2]
    assert (growth.street == 7).sum() == 3
    # it grows on across, like any crossing
    assert growth.node_type[1] == "L"


def test_bends_do_not_draw_streets_to_them():
    # the end is 60 m from the bend, within the radius, but far off any junction
    growth = one_street((45.0, 0.0), 3.0)
    assert growth.xy[-1][0] == pytest.approx(45)
    assert growth.degrees[-1] == 3
    assert growth.bends[1]
    assert growth.bends[2]


def test_junctions_draw_streets_to_them():
    growth = one_street((-370.0, 0.0), 1.0)
    assert growth.ends[growth.grown].tolist() == [[4, 0]]


def test_a_start_on_a_street_becomes_its_node():
    growth = one_street((-200.0, 100 + 4 * 200 / 403), 1.0)
    assert growth.degrees[4] == 3
    assert (growth.street == 7).sum() == 4


def test_two_starts_in_one_place():
    child = Child((0.0, 0.0), (1.0, 1.0), State("m", "L"))
    grammar = Grammar("one", {START: (Rule(1, "K", (child,)),)})
    starts = (Start((0.0, 0.0), AHEAD, START), Start((0.0, 0.0), (1.0, 0.0), START))
    growth = grow(Ground(starts), GrowthRules(grammar, iterations=1))
    assert growth.xy == pytest.approx(np.array([(0, 0), (0, 100)]))


def test_new_roads_begin_where_the_old_end():
    growth = one_street((45.0, 0.0), 3.0)
    assert growth.road.tolist() == [0, 0, 0, 1, 0] or set(growth.road) == {0, 1}
    assert (growth.road[growth.grown] == 1).all()
    assert (growth.step[growth.grown] == 1).all()
    assert (growth.step[~growth.grown] == 0).all()
    assert (growth.edge_type[~growth.grown] == "").all()
    assert (growth.road_type[:4] == "").all()


def test_no_street_beside_a_given_one_that_bends_away_and_comes_back():
    # the ends of a given street are joined by a new one only if there is room between them
    ends = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    street, bends = np.array([0, 0, 0, 1]), np.array([False, True, True, False, False])
    leaf = State("s", "L")
    rule = Rule(1.0, "K", (Child((0.0, 0.0), (1.0, 1.0), State("s", "K")),))
    rules = GrowthRules(Grammar("ahead", {leaf: (rule,)}), scale=60, iterations=3)
    starts = (Start((0.0, 0.0), (1.0, 0.0), leaf, 0), Start((0.0, -300.0), (1.0, 0.0), leaf))
    for depth, built in ((8.0, 1), (30.0, 2)):
        nodes = np.array([(0, 0), (4, depth), (64, depth), (68, 0), (68, -60)], dtype=float)
        growth = grow(Ground(starts, None, nodes, ends, street, bends), rules)
        assert growth.grown.sum() == built
        assert growth.left_out == 2 - built
