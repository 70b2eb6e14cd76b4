"""Room for straight rows, against rectangles that are laid on the ground one by one."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.lines.room import Room
from shapely import affinity
from shapely.geometry import MultiPolygon, Point, box

from .lines_setup import box_of, grounds

SIZES = st.tuples(st.floats(4.0, 30.0), st.floats(4.0, 18.0))


@settings(max_examples=60)
@given(shape=grounds(), facing=st.floats(0.0, 359.0), size=SIZES, at=st.floats(0.0, 1.0))
def test_spans_are_where_buildings_fit(shape, facing, size, at):
    room = Room(shape, facing)
    low_u, low_v, high_u, high_v = room.bounds
    v = low_v + at * (high_v - low_v)
    spans = room.spans(v, *size)
    grown, shrunk = shape.buffer(1e-3), shape.buffer(-1e-3)
    for u in np.linspace(low_u, high_u, 60):
        there = box_of(room.world(np.array([[u, v]]))[0], facing, *size)
        said = any(a + size[0] / 2 <= u <= b - size[0] / 2 for a, b in spans)
        if said:
            assert grown.covers(there)
        elif shrunk.covers(there):
            # only at the very end of a span
            ends = (np.abs(np.array(spans).ravel() - u) - size[0] / 2) if len(spans) else [1.0]
            assert np.min(np.abs(ends)) < 0.01


@settings(max_examples=40)
@given(shape=grounds(), facing=st.floats(0.0, 359.0), size=SIZES)
def test_centres_are_where_buildings_stand(shape, facing, size):
    free = Room(shape, facing).centres(*size)
    grown, shrunk = shape.buffer(1e-3), shape.buffer(-1e-3)
    x0, y0, x1, y1 = shape.bounds
    for x in np.linspace(x0, x1, 12):
        for y in np.linspace(y0, y1, 12):
            there = box_of((x, y), facing, *size)
            if free.covers(Point(x, y)):
                assert grown.covers(there)
            elif shrunk.covers(there):
                assert free.distance(Point(x, y)) < 0.01


def test_the_outermost_rows_touch_the_edge():
    ground = MultiPolygon([box(0, 0, 50, 40), box(60, 10, 70, 80)])
    room = Room(ground, 180.0, (0.0, 0.0))
    assert room.outermost(20.0, 10.0) == pytest.approx(5.0)
    assert room.outermost(20.0, 10.0, back=True) == pytest.approx(35.0)
    assert room.outermost(8.0, 10.0, back=True) == pytest.approx(75.0)
    assert room.outermost(60.0, 10.0) is None
    assert room.outermost(20.0, 90.0) is None


def test_the_first_row_in_a_tip_is_as_wide_as_a_building():
    """A triangle of 100 m with its tip in the south: 20 m wide at 20 m."""
    room = Room(shapely.Polygon([(0, 0), (50, 100), (-50, 100)]), 180.0, (0.0, 0.0))
    assert room.outermost(20.0, 10.0) == pytest.approx(25.0, abs=1e-4)
    assert len(room.spans(24.99, 20.0, 10.0)) == 0
    assert len(room.spans(25.01, 20.0, 10.0)) == 1


def test_frames_turn_there_and_back():
    shape = affinity.translate(box(0, 0, 30, 20), 460_000, 5_550_000)
    room = Room(shape, 203.0)
    xy = shapely.get_coordinates(shape)
    assert np.allclose(room.world(room.local(xy)), xy, atol=1e-8)
    # v grows away from the balconies
    out = box_of(xy[0], 203.0, 2.0, 2.0)
    front = shapely.get_coordinates(out)[:2].mean(axis=0)
    assert room.local(front[None])[0, 1] == pytest.approx(room.local(xy[:1])[0, 1] - 1.0)


def test_rooms_of_no_ground_are_empty():
    room = Room(shapely.Polygon(), 180.0)
    assert room.empty
    assert room.outermost(5.0, 5.0) is None
    assert room.standing(np.array([[5.0, 5.0]])).is_empty
