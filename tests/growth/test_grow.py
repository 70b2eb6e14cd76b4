"""Growth stays planar, keeps its distances, and repeats itself."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.growth.grammar import Child, Grammar, Rule, State
from platwright.growth.grow import grow
from platwright.growth.rules import GrowthRules
from platwright.growth.types import Ground, Start

from .growth_checks import (
    CENTRE,
    FOUR,
    GROUNDS,
    SCALES,
    SITE,
    a_ground,
    as_bytes,
    digest,
    faults,
    least_angle,
    lines_of,
    open_ground,
    site_ground,
)

SEEDS = st.integers(0, 2**32 - 1)


def rules_for(name, kind="open", **changes):
    given_rules = {"scale": SCALES[kind], "max_segments": 250, **changes}
    return GrowthRules(FOUR[name], **given_rules)


def check(growth, rules):
    """Assert what holds of every planar growth."""
    assert faults(growth) == []
    assert least_angle(growth) >= max(rules.min_angle, 1.0) - 1e-6
    # nodes keep the radius, but for streets that are cut shorter where they join another
    born = np.flatnonzero(growth.born > 0)
    points = shapely.points(growth.xy[born])
    pairs = shapely.STRtree(points).query(points, "dwithin", 0.999 * rules.radius)
    edges = set(map(tuple, np.sort(growth.ends, axis=1).tolist()))
    near = {tuple(sorted(pair)) for pair in born[pairs.T].tolist() if pair[0] != pair[1]}
    assert near <= edges, "nodes that grew are nearer than the radius, without a street between"
    assert growth.grown.any()
    assert set(growth.edge_type[growth.grown]) <= set("mls")
    assert (growth.road[growth.grown] > 0).all()
    assert (growth.road[~growth.grown] == 0).all()


@pytest.mark.parametrize("name", FOUR)
@settings(max_examples=50)
@given(seed=SEEDS)
def test_planar_on_open_ground(name, seed):
    rules = rules_for(name, seed=seed)
    check(grow(open_ground(), rules), rules)


@pytest.mark.parametrize("kind", GROUNDS[1:])
@pytest.mark.parametrize("name", FOUR)
@settings(max_examples=12)
@given(seed=SEEDS)
def test_planar_on_real_ground(name, kind, seed):
    rules = rules_for(name, kind, seed=seed)
    growth = grow(a_ground(kind, FOUR[name]), rules)
    check(growth, rules)
    if kind not in ("streets", "open"):
        grown = lines_of(growth)[growth.grown]
        assert SITE.buffer(0.02).covers(shapely.union_all(grown))
        edge = growth.xy[growth.node_type == "BOUNDARY"]
        assert shapely.distance(SITE.boundary, shapely.points(edge)).max(initial=0) < 1e-6
        assert (growth.degrees[growth.node_type == "BOUNDARY"] >= 1).all()


@pytest.mark.slow
@pytest.mark.parametrize("kind", GROUNDS)
@pytest.mark.parametrize("name", FOUR)
@settings(max_examples=40)
@given(
    seed=SEEDS,
    radius=st.sampled_from([0.01, 0.05, 0.3, 0.8, 1.5]),
    clearance=st.sampled_from([0.0, 0.1, 0.5, 1.0]),
    angle=st.sampled_from([0.0, 10.0, 30.0, 60.0]),
    scale=st.floats(5, 300),
)
def test_planar_whatever_is_asked(name, kind, seed, radius, clearance, angle, scale):
    rules = GrowthRules(
        FOUR[name],
        scale=scale,
        max_segments=200,
        intersect_radius=radius,
        clearance=clearance,
        min_angle=angle,
        seed=seed,
    )
    ground = a_ground(kind, FOUR[name])
    try:
        growth = grow(ground, rules)
    except InputError:
        # streets shorter than the radius have no room where others are
        assert radius * scale > 100
        return
    assert faults(growth, 1e-5) == []
    assert least_angle(growth) >= max(angle, 1.0) - 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("name", FOUR)
def test_planar_and_large(name):
    rules = rules_for(name, max_segments=20_000)
    check(grow(open_ground(), rules), rules)


@pytest.mark.parametrize("name", FOUR)
def test_same_seed_same_bytes(name):
    rules = rules_for(name, "both")
    ground = a_ground("both", FOUR[name])
    assert as_bytes(grow(ground, rules)) == as_bytes(grow(ground, rules))
    other = grow(ground, rules_for(name, "both", seed=1))
    assert as_bytes(grow(ground, rules)) != as_bytes(other)


def test_same_bytes_in_any_process(root):
    program = (
        "import sys, hashlib; sys.path[:0] = ['tests', 'tests/growth']; import conftest\n"
        "import growth_checks; print(growth_checks.digest())"
    )
    digests = {digest()}
    for hashes in ("0", "77"):
        env = {**os.environ, "PYTHONHASHSEED": hashes}
        done = subprocess.run(
            [sys.executable, "-c", program],
            cwd=root, env=env, capture_output=True, text=True, check=True,
        )  # fmt: skip
        digests.add(done.stdout.strip())
    assert len(digests) == 1


def test_the_first_streets_by_hand():
    growth = grow(open_ground((7.0, 5.0)), rules_for("grid", iterations=1, max_segments=None))
    assert growth.xy == pytest.approx(np.array([(7, 5), (7, 105), (7, -95)]))
    assert growth.ends.tolist() == [[0, 1], [0, 2]]
    assert growth.road.tolist() == [1, 1]  # both go on with the road of the start
    assert growth.node_type.tolist() == ["K", "L", "L"]
    assert growth.road_type.tolist() == ["m"] * 3
    assert growth.born.tolist() == [0, 1, 1]
    assert growth.incoming == pytest.approx(np.array([(0, 1), (0, 1), (0, -1)]), abs=1e-12)
    assert growth.incoming_road.tolist() == [0, 1, 1]
    assert growth.stopped == "1 iteration was done"


def grammar_of(*rules, **others):
    """A grammar of which the start follows the given rules."""
    state = State("m", "Start")
    return Grammar("test", {state: rules, **{State(k[0], k[1:]): v for k, v in others.items()}})


def child(turn, length=1.0, node="K", **more):
    return Child((np.radians(turn),) * 2, (length,) * 2, State("m", node), **more)


def test_check_1_splits_what_it_lands_on():
    # one street of 3 units across the way of another that sets out beside its middle
    ground = Ground(
        (Start((0.0, 0.0), (0.0, 1.0), State("m", "Start")),),
        nodes=np.array([(-200.0, 100.0), (300.0, 100.0)]),
        ends=np.array([(0, 1)]),
        street=np.array([4]),
        bends=np.zeros(2, dtype=bool),
    )
    rules = GrowthRules(grammar_of(Rule(1, "K", (child(0, 3.0),))), iterations=1)
    growth = grow(ground, rules)
    assert growth.xy[3] == pytest.approx((0, 100))
    assert sorted(map(tuple, growth.ends.tolist())) == [(0, 3), (2, 3), (3, 1)]
    assert growth.street.tolist() == [4, 4, -1]
    assert growth.node_type[3] == "K"
    # as published the street is not split
    growth = grow(ground, GrowthRules(rules.grammar, iterations=1, as_published=True))
    assert sorted(map(tuple, growth.ends.tolist())) == [(0, 1), (2, 3)]


def test_check_2_joins_and_is_checked_again():
    # its end comes within the radius of node 0, and the way there crosses a street
    ground = Ground(
        (Start((0.0, 0.0), (0.0, 1.0), State("m", "Start")),),
        nodes=np.array([(60.0, 150.0), (200.0, 150.0), (10.0, 50.0), (400.0, 50.0)]),
        ends=np.array([(0, 1), (2, 3)]),
        street=np.array([0, 1]),
        bends=np.zeros(4, dtype=bool),
    )
    grammar = grammar_of(Rule(1, "K", (child(0, 1.5),)))
    near = GrowthRules(grammar, iterations=1, clearance=0.05)
    growth = grow(ground, near)
    # the way to node 0 crosses the lower street 6.7 m beyond node 2: joined there
    assert growth.ends[growth.grown].tolist() == [[4, 2]]
    published = grow(ground, GrowthRules(grammar, iterations=1, as_published=True))
    assert published.ends[published.grown].tolist() == [[4, 0]]


def test_needles_are_not_built():
    for turn, built in ((25.0, 1), (35.0, 2)):
        grammar = grammar_of(Rule(1, "K", (child(0, 2.0), child(turn, 2.0))))
        growth = grow(open_ground(), GrowthRules(grammar, iterations=1, intersect_radius=0.1))
        assert growth.grown.sum() == built
        assert growth.left_out == 2 - built


def test_an_end_beside_a_street_joins_it():
    ground = Ground(
        (Start((0.0, 0.0), (0.0, 1.0), State("m", "Start")),),
        nodes=np.array([(-300.0, 130.0), (300.0, 130.0)]),
        ends=np.array([(0, 1)]),
        street=np.array([0]),
        bends=np.zeros(2, dtype=bool),
    )
    grammar = grammar_of(Rule(1, "K", (child(0, 1.0),)))
    growth = grow(ground, GrowthRules(grammar, iterations=1))
    assert growth.xy[-1] == pytest.approx((0, 130))
    assert growth.degrees[-1] == 3
    apart = grow(ground, GrowthRules(grammar, iterations=1, clearance=0.2))
    assert apart.xy[-1] == pytest.approx((0, 100))


def test_a_street_that_lies_on_another_marks_it():
    # the second street turns back on the first and divides it
    leaf = Rule(1, "K", (child(180, 2.0, "B"),))
    grammar = grammar_of(Rule(1, "K", (child(0, 5.0, "L"),)), mL=(leaf,))
    growth = grow(open_ground(), GrowthRules(grammar, iterations=5))
    assert growth.xy == pytest.approx(np.array([(0, 0), (0, 500), (0, 300)]))
    assert sorted(map(tuple, growth.ends.tolist())) == [(0, 2), (2, 1)]
    assert growth.node_type.tolist() == ["K", "K", "B"]
    assert growth.incoming[2] == pytest.approx((0, -1))


def test_streets_end_at_walls():
    grammar = grammar_of(Rule(1, "K", tuple(child(t, 9.0) for t in (0, 90, 180, 270))))
    box = shapely.box(-100, -200, 300, 400)
    growth = grow(
        Ground((Start((0.0, 0.0), (0.0, 1.0), State("m", "Start")),), box),
        GrowthRules(grammar, iterations=1),
    )
    assert growth.xy[1:] == pytest.approx(np.array([(0, 400), (-100, 0), (0, -200), (300, 0)]))
    assert growth.node_type[1:].tolist() == ["BOUNDARY"] * 4


def test_a_start_on_the_wall_grows_inwards_only():
    grammar = grammar_of(Rule(1, "K", tuple(child(t, 1.0) for t in (0, 90, 180, 270))))
    box = shapely.box(0, 0, 500, 500)
    growth = grow(
        Ground((Start((0.0, 200.0), (1.0, 0.0), State("m", "Start")),), box),
        GrowthRules(grammar, iterations=1),
    )
    assert growth.xy[1:] == pytest.approx(np.array([(100, 200)]))
    assert growth.left_out == 3


def test_a_street_that_leads_out_is_not_bent_back():
    # the second start lies on the wall, within the radius of the first, and looks out
    ahead = grammar_of(Rule(1, "K", (child(0, 1.0),)))
    starts = tuple(
        Start(xy, way, State("m", "Start"))
        for xy, way in (((60.0, 200.0), (0.0, 1.0)), ((0.0, 200.0), (-1.0, 0.0)))
    )
    growth = grow(Ground(starts, shapely.box(0, 0, 500, 500)), GrowthRules(ahead, iterations=1))
    assert growth.ends.tolist() == [[0, 2]]
    assert growth.left_out == 1


def test_the_site_is_filled():
    growth = grow(site_ground(), rules_for("organic", "site", max_segments=10_000))
    assert growth.stopped == "nothing is left that grows"
    assert growth.steps[-1].segments == growth.grown.sum() > 400
    assert np.ptp(growth.xy[:, 0]) > 0.9 * np.ptp(np.asarray(SITE.exterior.coords)[:, 0])
    assert CENTRE in set(map(tuple, growth.xy))
