"""Head/tail breaks, living structure, and the metrics of CitySprout, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.measure.headtail import head_tail_breaks, ht_index, ht_levels
from platwright.measure.living import likeness, living_structure, living_v1, living_v2

ZIPF = [1 / k for k in range(1, 11)]
sizes = st.lists(st.integers(1, 60), min_size=0, max_size=60)


def test_the_ten_numbers_of_jiang():
    # Mean of all ten 0.2929: head 1, 1/2, 1/3. Mean of these 0.6111: head 1.
    breaks = head_tail_breaks(ZIPF)
    assert breaks == pytest.approx([sum(ZIPF) / 10, (1 + 1 / 2 + 1 / 3) / 3])
    assert ht_index(ZIPF) == 3
    assert ht_levels(ZIPF, breaks).tolist() == [3, 2, 2, 1, 1, 1, 1, 1, 1, 1]


def test_without_a_minority_of_large_ones_there_is_one_class():
    assert ht_index([5, 5, 5, 5]) == 1
    assert ht_index([0.1] * 7) == 1
    assert ht_index([1, 2, 3, 4]) == 1
    assert ht_index([3]) == 1
    assert ht_index([]) == 0
    assert ht_levels([5, 5], []).tolist() == [1, 1]


def test_a_head_of_just_the_share_is_a_minority():
    assert ht_index([1, 1, 1, 9, 9]) == 2
    assert ht_index([1, 1, 1, 9, 9], share=0.39) == 1


def test_relaxed_breaks_look_at_the_mean_share():
    # Shares of the heads: 1/10 of all... here 2/10, then 1/2: strict stops, mean 0.35 goes on.
    values = [1] * 8 + [20, 40]
    assert ht_index(values) == 2
    assert ht_index(values, relaxed=True) == 3


def test_a_share_out_of_bounds_is_refused():
    with pytest.raises(InputError, match="share"):
        head_tail_breaks([1, 2], share=1.0)


@given(sizes, st.randoms(use_true_random=False))
def test_classes_do_not_depend_on_order_or_scale(values, random):
    breaks = head_tail_breaks(values)
    assert (np.diff(breaks) > 0).all()
    mixed = list(values)
    random.shuffle(mixed)
    assert head_tail_breaks(mixed) == pytest.approx(breaks)
    assert head_tail_breaks([3.7 * v for v in values]) == pytest.approx(3.7 * breaks)
    level = ht_levels(values, breaks)
    counts = [int((level >= k).sum()) for k in range(1, len(breaks) + 2)]
    for more, fewer in zip(counts, counts[1:]):
        assert 0 < fewer <= 0.4 * more


@given(sizes)
def test_living_structure_is_what_a_plain_recursion_gives(values):
    def parts(own):
        mean = sum(own) / len(own)
        head, tail = [v for v in own if v > mean], [v for v in own if v <= mean]
        if not head or len(head) > 0.4 * len(own):
            return 1, 1
        (a, deep), (b, other) = parts(head), parts(tail)
        return 1 + a + b, 1 + max(deep, other)

    found = living_structure(values)
    assert found.substructures == len(values)
    assert found.livability == len(values) * ht_index(values)
    assert (found.parts, found.depth) == (parts(values) if values else (0, 0))


def test_living_structure_of_the_ten_numbers():
    found = living_structure(ZIPF)
    assert (found.substructures, found.hierarchy, found.livability) == (10, 3, 30)
    # All; 3 and 7 of them; 1 and 2 of the three: five parts on three levels, 15.
    assert (found.parts, found.depth, found.recursive_livability) == (5, 3, 15)
    assert found.levels.max() == found.hierarchy


def test_rank_likeness_by_hand():
    # Four roads ranked 1 3 2 4; 0 meets 1 at two nodes and 2 at one, 3 meets none.
    pairs = np.array([[0, 1], [0, 1], [0, 2]])
    score = [10.0, 30.0, 20.0, 40.0]
    near, far = math.exp(-1 / 3), math.exp(-2 / 3)
    own = likeness(pairs, score)
    assert own[:3] == pytest.approx([(2 * far + near) / 3, far, near])
    assert np.isnan(own[3])
    assert living_v2(pairs, score) == pytest.approx(((2 * far + near) / 3 + far + near) / 3)
    assert living_v2(pairs, score, 0.0) == 1.0
    assert living_v2(pairs, score, 5.0) < living_v2(pairs, score)


def test_near_ranks_by_hand():
    # A star: road 0 has the highest rank of 12 and meets all others.
    pairs = np.array([[0, k] for k in range(1, 12)])
    score = np.arange(12)[::-1]
    assert living_v1(pairs, score, reach=5) == pytest.approx(2 * 5 / 12)
    assert living_v1(pairs, score, reach=11) == pytest.approx(2 * 11 / 12)
    assert living_v1(np.vstack([pairs, pairs]), score) == living_v1(pairs, score)


def test_equal_scores_share_a_rank():
    pairs = np.array([[0, 1], [1, 2]])
    assert likeness(pairs, [5, 5, 5]).tolist() == [1, 1, 1]


def test_roads_that_do_not_meet_have_no_metric():
    none = np.zeros((0, 2), dtype=int)
    assert math.isnan(living_v2(none, [1, 2]))
    assert living_v1(none, [1, 2]) == 0.0
    assert math.isnan(living_v1(none, []))
    empty = living_structure([])
    assert (empty.livability, empty.recursive_livability) == (0, 0)


@given(st.integers(0, 10_000))
def test_metrics_do_not_depend_on_the_order_of_roads(seed):
    rng = np.random.default_rng(seed)
    score = rng.integers(0, 20, 15).astype(float)
    pairs = rng.integers(0, 15, (30, 2))
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    order = rng.permutation(15)
    back = np.argsort(order)
    other = back[pairs][:, ::-1]
    assert living_v2(other, score[order]) == pytest.approx(living_v2(pairs, score))
    assert living_v1(other, score[order]) == pytest.approx(living_v1(pairs, score))
    assert living_v2(pairs, 9 * score) == pytest.approx(living_v2(pairs, score))
