"""When growth stops, what it says, and what it cannot begin."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from platwright.errors import CancelledError, InputError
from platwright.growth.grammar import Child, Grammar, Rule, State
from platwright.growth.grow import grow
from platwright.growth.rules import GrowthRules
from platwright.growth.types import Ground, Start
from platwright.progress import Silent

from .growth_checks import AHEAD, CENTRE, FOUR, SITE, START, faults, open_ground, site_ground

FORWARD = Child((0.0, 0.0), (1.0, 1.0), State("m", "L"))


class Ear(Silent):
    """Keeps what it is told; cancels after some questions."""

    def __init__(self, questions=10**9):
        self.questions, self.warnings, self.stages = questions, [], []

    def warn(self, text):
        self.warnings.append(text)

    def stage(self, text, fraction):
        self.stages.append((text, fraction))

    def cancelled(self):
        self.questions -= 1
        return self.questions < 0


@pytest.mark.parametrize("name", FOUR)
def test_a_number_of_streets(name):
    growth = grow(open_ground(), GrowthRules(FOUR[name], max_segments=500))
    # a street that splits another makes two
    assert growth.grown.sum() in (500, 501)
    assert growth.stopped == "500 streets were reached"


@pytest.mark.parametrize("name", FOUR)
def test_a_length(name):
    growth = grow(open_ground(), GrowthRules(FOUR[name], max_length=20_000))
    longest = FOUR[name].longest * 100
    assert 20_000 <= growth.lengths.sum() < 20_000 + longest + 80
    assert growth.stopped == "20,000 m of streets were reached"


def test_a_population():
    growth = grow(open_ground(), GrowthRules(FOUR["grid"], population=5000))
    # 100 m of street stand for 154.15 people: 32.4 streets of 100 m
    assert growth.lengths.sum() == pytest.approx(3300)
    assert growth.steps[-1].population == pytest.approx(5086.95)
    assert growth.stopped == "streets for 5,000 people were reached"


def test_iterations():
    growth = grow(open_ground(), GrowthRules(FOUR["hex"], iterations=7))
    assert growth.stopped == "7 iterations were done"
    assert [step.iteration for step in growth.steps] == list(range(1, 8))
    assert growth.step.max() == 7
    for step in growth.steps:
        # splits only add to the number of streets that an iteration has seen
        assert step.segments <= (growth.step <= step.iteration).sum()
        assert step.population == pytest.approx(1.5415 * step.length)
    last = growth.steps[-1]
    assert last.segments == growth.grown.sum() == len(growth.ends)
    assert last.length == pytest.approx(growth.lengths.sum())
    assert last.nodes == len(growth.xy)
    assert last.growing == np.isin(growth.node_type, ["L"]).sum()


def test_the_first_limit_counts():
    rules = GrowthRules(FOUR["grid"], iterations=30, max_segments=50, max_length=1e6)
    assert grow(open_ground(), rules).stopped == "50 streets were reached"


def test_nothing_left():
    once = Grammar("once", {START: (Rule(1, "K", (FORWARD,)),)})
    growth = grow(open_ground(), GrowthRules(once, max_segments=100))
    assert growth.stopped == "nothing is left that grows"
    assert growth.grown.sum() == 1


def test_idle():
    waits = {State("m", "L"): (Rule(1, "L"),), START: (Rule(1, "K", (FORWARD,)),)}
    growth = grow(open_ground(), GrowthRules(Grammar("idle", waits), max_segments=100))
    assert growth.stopped == "nothing was built in 50 iterations"
    assert len(growth.steps) == 51


def test_cancelled_keeps_what_there_is():
    growth = grow(open_ground(), GrowthRules(FOUR["organic"], max_segments=10**6), Ear(60))
    assert growth.stopped == "it was cancelled"
    assert growth.grown.sum() > 100
    assert faults(growth) == []


def test_cancelled_at_once():
    with pytest.raises(CancelledError):
        grow(open_ground(), GrowthRules(FOUR["organic"], max_segments=100), Ear(0))


def test_progress_never_falls():
    ear = Ear()
    grow(open_ground(), GrowthRules(FOUR["grid"], max_segments=20_000), ear)
    fractions = [fraction for _, fraction in ear.stages]
    assert fractions == sorted(fractions)
    assert len(fractions) >= 2
    assert fractions[0] >= 0
    assert fractions[-1] <= 1
    assert "streets" in ear.stages[-1][0]
    assert "km" in ear.stages[-1][0]


def test_no_start():
    with pytest.raises(InputError, match="no place where growth begins"):
        grow(Ground(()), GrowthRules(FOUR["grid"], iterations=1))


def test_a_start_outside():
    ground = Ground((Start((12.0, 34.0), AHEAD, START),), SITE)
    with pytest.raises(InputError, match=r"start at \(12.0, 34.0\) lies outside .* Move it inside"):
        grow(ground, GrowthRules(FOUR["grid"], iterations=1))


def test_some_starts_outside():
    starts = (Start((12.0, 34.0), AHEAD, START), Start(CENTRE, AHEAD, START))
    ear = Ear()
    growth = grow(Ground(starts, SITE), GrowthRules(FOUR["grid"], iterations=3), ear)
    assert tuple(growth.xy[0]) == CENTRE
    assert any("(12.0, 34.0)" in text and "other 1" in text for text in ear.warnings)


def test_a_domain_smaller_than_a_street():
    ear = Ear()
    tiny = shapely.Point(CENTRE).buffer(10)
    ground = Ground((Start(CENTRE, AHEAD, START),), tiny)
    with pytest.raises(InputError, match="No street could be built"):
        grow(ground, GrowthRules(FOUR["organic"], max_segments=10), ear)
    assert any("Choose a smaller scale" in text for text in ear.warnings)


def test_a_start_in_a_state_without_rules():
    done = State("m", "K")
    with pytest.raises(InputError, match="No street could be built: nothing is left that grows"):
        grow(
            Ground((Start((0.0, 0.0), AHEAD, done),)), GrowthRules(FOUR["organic"], max_segments=10)
        )


def test_all_nodes_still_wait():
    waits = Grammar("idle", {START: (Rule(1, "Start"),)})
    with pytest.raises(InputError, match=r"1 iteration was done\. Give more iterations"):
        grow(open_ground(), GrowthRules(waits, iterations=1))


def test_multipolygons():
    far = shapely.Point(CENTRE[0] + 9000, CENTRE[1]).buffer(500)
    both = shapely.MultiPolygon([SITE, far])
    starts = (Start(CENTRE, AHEAD, START), Start((CENTRE[0] + 9000, CENTRE[1]), AHEAD, START))
    growth = grow(Ground(starts, both), GrowthRules(FOUR["grid"], max_segments=9999))
    assert growth.stopped == "nothing is left that grows"
    grown = shapely.union_all(shapely.linestrings(growth.xy[growth.ends]))
    assert both.buffer(1e-6).covers(grown)
    for part in both.geoms:
        assert part.intersects(grown)
    alone = grow(site_ground(), GrowthRules(FOUR["grid"], max_segments=9999))
    assert growth.grown.sum() > alone.grown.sum()


@pytest.mark.parametrize(
    "wrong", [{"seed": -1}, {"seed": 1.5}, {"iterations": 2.5}, {"max_segments": float("inf")}]
)
def test_numbers_that_are_counted_are_whole(wrong):
    with pytest.raises(InputError, match="Give a whole number that is not negative"):
        GrowthRules(FOUR["grid"], **{"iterations": 3, **wrong})


@pytest.mark.parametrize("radius", [0, 0.005, -1, float("nan")])
def test_an_intersect_radius_of_nothing_is_refused(radius):
    with pytest.raises(InputError, match=r"intersect radius \(nearness of junctions\).*0\.01"):
        GrowthRules(FOUR["grid"], iterations=1, intersect_radius=radius)
