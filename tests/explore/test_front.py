"""The Pareto front against its definition."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.explore import pareto_front

#: Few values, so that many are equal; some are infinite.
FIGURES = st.sampled_from([-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, math.inf]) | st.floats(-5, 5)
TABLES = st.integers(1, 3).flatmap(
    lambda width: st.lists(st.tuples(*[FIGURES] * width), min_size=1, max_size=12)
)


def dominates(one, other) -> bool:
    """As good in all, better in one."""
    return all(a <= b for a, b in zip(one, other)) and any(a < b for a, b in zip(one, other))


@given(TABLES)
def test_the_front_is_what_nothing_dominates(rows):
    front = pareto_front(rows)
    assert front.tolist() == [not any(dominates(o, r) for o in rows) for r in rows]
    assert front.any()


@given(TABLES, st.randoms(use_true_random=False))
def test_the_order_of_the_rows_does_not_matter(rows, chance):
    order = list(range(len(rows)))
    chance.shuffle(order)
    assert pareto_front([rows[i] for i in order]).tolist() == pareto_front(rows)[order].tolist()


@given(TABLES)
def test_more_may_be_better(rows):
    turned = [tuple(-value for value in row) for row in rows]
    assert pareto_front(turned, smaller_is_better=False).tolist() == pareto_front(rows).tolist()


@given(TABLES, st.data())
def test_what_is_unknown_is_not_there(rows, data):
    lost = data.draw(st.integers(0, len(rows) - 1))
    holed = [list(row) for row in rows]
    holed[lost][data.draw(st.integers(0, len(rows[0]) - 1))] = math.nan
    front = pareto_front(holed).tolist()
    assert front.pop(lost) is False
    rest = rows[:lost] + rows[lost + 1 :]
    if rest:
        assert front == pareto_front(rest).tolist()


def test_columns_may_differ_in_what_is_better():
    rows = [[1.0, 1.0], [1.0, 2.0], [2.0, 3.0], [2.0, 1.0]]
    assert pareto_front(rows, [True, False]).tolist() == [False, True, True, False]


@pytest.mark.parametrize("shape", [(0, 2), (0, 0)])
def test_no_rows_have_no_front(shape):
    assert len(pareto_front(np.empty(shape))) == 0
