"""Lines are cut where they meet, and stay where they are."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.growth.land.pieces import cut_lines, with_points
from shapely.geometry import LineString

from .ground_checks import crossings

# a coarse grid, so that lines cross, touch, overlap and repeat vertices often
XY = st.tuples(st.integers(0, 6), st.integers(0, 6))
LINE = (
    st.lists(XY, min_size=2, max_size=5).map(LineString).filter(lambda line: line.length > 0)
)  # fmt: skip
LINES = st.lists(LINE, min_size=1, max_size=8)


def straight(found, which=slice(None)):
    return shapely.linestrings(found.nodes[found.ends[which]])


def check(lines, found):
    kept = straight(found, found.kept)
    assert crossings(kept) == []
    assert len({tuple(sorted(pair)) for pair in found.ends[found.kept].tolist()}) == len(kept)
    assert shapely.length(kept).min() > 0
    whole, given_ = shapely.multilinestrings(kept), shapely.multilinestrings(lines)
    assert shapely.hausdorff_distance(whole, given_) < 1e-5
    # kept pieces are as long as the lines are when taken once
    assert whole.length == pytest.approx(shapely.union_all(lines).length, abs=1e-5)
    for k, line in enumerate(lines):
        own = found.ends[found.line == k]
        assert (own[1:, 0] == own[:-1, 1]).all()
        assert shapely.length(straight(found, found.line == k)).sum() == pytest.approx(line.length)
        # the vertices are those of the line, to the last bit
        assert set(line.coords) <= set(map(tuple, found.nodes[own].reshape(-1, 2).tolist()))


@given(LINES)
@settings(max_examples=200)
def test_lines_of_all_kinds_become_planar(lines):
    check(lines, cut_lines(lines))


@given(LINES, st.floats(-400, 400), st.floats(0.01, 300))
@settings(max_examples=100)
def test_so_do_lines_with_rounding(lines, angle, size):
    turned = [
        shapely.affinity.translate(
            shapely.affinity.scale(
                shapely.affinity.rotate(line, angle, origin=(0, 0)), size, size, origin=(0, 0)
            ),
            480123.456, 5212345.678,
        )
        for line in lines
    ]  # fmt: skip
    found = cut_lines(turned)
    kept = straight(found, found.kept)
    assert crossings(kept) == []
    new = shapely.multilinestrings(kept)
    assert shapely.hausdorff_distance(new, shapely.multilinestrings(turned)) < 1e-5
    again = cut_lines(turned)
    assert again.nodes.tobytes() == found.nodes.tobytes()
    assert again.ends.tobytes() == found.ends.tobytes()


def test_a_crossing_is_told_and_a_junction_is_not():
    cross = [LineString([(0, 0), (10, 0)]), LineString([(4, -5), (4, 5)])]
    found = cut_lines(cross)
    assert [found.nodes[k].tolist() for *_, k in found.crossings.tolist()] == [[4.0, 0.0]]
    shared = [LineString([(0, 0), (4, 0), (10, 0)]), LineString([(4, -5), (4, 0), (4, 5)])]
    assert len(cut_lines(shared).crossings) == 0
    touch = [LineString([(0, 0), (10, 0)]), LineString([(4, 0), (4, 5)])]
    assert len(cut_lines(touch).crossings) == 0
    # a vertex of one line alone in the middle of another
    passing = [LineString([(0, 0), (10, 0)]), LineString([(4, -5), (4, 0), (4, 5)])]
    assert cut_lines(passing).crossings[:, :2].tolist() == [[0, 1]]


def test_a_line_may_cross_itself():
    found = cut_lines([LineString([(0, 0), (10, 0), (10, 5), (5, 5), (5, -5)])])
    assert found.crossings[:, :2].tolist() == [[0, 0]]
    assert len(found.ends) == 6


def test_of_lines_on_top_of_each_other_the_better_one_stays():
    lines = [LineString([(0, 0), (10, 0)]), LineString([(4, 0), (20, 0)])]
    found = cut_lines(lines, np.array([1, 0]))
    left = found.ends[found.kept & (found.line == 0)]
    assert [sorted(pair) for pair in found.nodes[left][:, :, 0].tolist()] == [[0.0, 4.0]]
    assert shapely.length(straight(found, found.kept & (found.line == 1))).sum() == 16
    assert len(found.crossings) == 0


def test_points_cut_pieces():
    found = cut_lines([LineString([(0, 0), (10, 0)])])
    xy = np.array([[7.0, 0.0], [2.0, 0.0], [7.0, 0.0]])
    nodes, ends, number, at = with_points(
        found.nodes, found.ends, found.line, np.zeros(3, dtype=np.int64), xy
    )
    assert nodes[at].tolist() == xy.tolist()
    assert at[0] == at[2]
    assert nodes[ends][:, :, 0].tolist() == [[0, 2], [2, 7], [7, 10]]
    assert number.tolist() == [0, 0, 0]


def test_no_lines_have_no_pieces():
    found = cut_lines([])
    assert found.nodes.shape == (0, 2)
    assert found.ends.shape == (0, 2)
    assert len(found.crossings) == 0
