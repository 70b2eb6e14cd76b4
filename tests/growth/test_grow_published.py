"""Growth as published agrees with what CitySprout gives, as far as chance allows."""

from __future__ import annotations

import numpy as np
import pytest
from platwright.growth.grow import grow
from platwright.growth.rules import GrowthRules

from .growth_checks import FOUR, faults, open_ground

#: CitySprout at seed 42: nodes at 501, 2001, 5001 and 10,001 streets; roads, iterations, length
#: (hm) and dead ends at 10,001.
THEIRS = {
    "organic": (422, 1577, 3860, 7461, 6159, 63, 11283, 354),
    "grid": (341, 1258, 3047, 5994, 4701, 56, 10001, 123),
    "hex": (420, 1400, 3253, 6245, 4418, 56, 10325, 185),
    "line": (397, 1377, 3349, 6642, 5235, 230, 10747, 38),
}
#: How far the mean of ten seeds may be off, per cent. Theirs is one seed: iterations of Line
#: have two modes (whether its side roads come in time to hold the small ones), and Hex begins
#: sparser there than any of 40 seeds here, for a reason that we have not found.
PER_CENT = {
    "organic": (3, 3, 4, 3, 3, 12, 3, 15),
    "grid": (4, 3, 2, 1, 3, 2, 0.1, 10),
    "hex": (12, 8, 6, 4, 8, 8, 2, 15),
    "line": (8, 3, 2, 2, 5, 25, 4, 100),
}


def figures(name, seed):
    """Return our figures of one seed."""
    nodes = []
    for segments in (500, 2000, 5000, 10_000):
        rules = GrowthRules(FOUR[name], max_segments=segments, seed=seed, as_published=True)
        growth = grow(open_ground(), rules)
        assert len(growth.ends) == segments + 1
        nodes.append(len(growth.xy))
    roads = len(np.unique(growth.road))
    ends = (growth.degrees == 1).sum()
    return [*nodes, roads, len(growth.steps), growth.lengths.sum() / 100, ends]


@pytest.mark.slow
@pytest.mark.parametrize("name", FOUR)
def test_counts_are_those_of_citysprout(name):
    ours = np.mean([figures(name, seed) for seed in range(10)], axis=0)
    off = 100 * np.abs(ours - THEIRS[name]) / THEIRS[name]
    assert (off <= PER_CENT[name]).all(), f"{ours.round(1)}: {off.round(1)} per cent off"


@pytest.mark.parametrize("name", FOUR)
def test_counts_of_small_ones_are_those_of_citysprout(name):
    rules = [GrowthRules(FOUR[name], max_segments=500, seed=s, as_published=True) for s in range(5)]
    nodes = np.mean([len(grow(open_ground(), r).xy) for r in rules])
    assert abs(nodes / THEIRS[name][0] - 1) <= PER_CENT[name][0] / 100


def test_line_is_not_planar_as_published():
    # what the peers' figures show: overlapping streets and ends on unsplit ones
    published = GrowthRules(FOUR["line"], max_segments=3000, as_published=True)
    assert len(faults(grow(open_ground(), published))) > 100
    assert faults(grow(open_ground(), GrowthRules(FOUR["line"], max_segments=3000))) == []


def test_one_street_between_two_nodes():
    growth = grow(open_ground(), GrowthRules(FOUR["grid"], max_segments=2000, as_published=True))
    pairs = {tuple(sorted(pair)) for pair in growth.ends.tolist()}
    assert len(pairs) == len(growth.ends)
