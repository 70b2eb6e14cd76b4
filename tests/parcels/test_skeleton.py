"""Straight skeletons, and the strips and parcels made of their faces."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.parcels.halving import skeleton_blocks
from platwright.parcels.halving.skeleton import skeleton_block
from platwright.parcels.halving.wavefront import SkeletonError, face_rings, straight_skeleton
from platwright.parcels.rules import ParcelRules
from platwright.parcels.types import Block
from shapely.geometry import MultiLineString, Point, Polygon, box

RULES = ParcelRules()
PENTAGON = Polygon([(20, 0), (125, -9), (153, 67), (78, 130), (0, 78)])
L_SHAPE = Polygon([(0, 0), (100, 0), (100, 40), (40, 40), (40, 100), (0, 100)])


def rings_of(polygon):
    rings = []
    for number, ring in enumerate([polygon.exterior, *polygon.interiors]):
        xy = np.array(ring.coords)[:-1]
        rings.append(xy if shapely.is_ccw(ring) == (number == 0) else xy[::-1])
    return rings


def faces_of(polygon, until=math.inf):
    """Faces of the skeleton as polygons, with the edge that each belongs to."""
    rings = rings_of(polygon)
    after, start = [], 0
    for ring in rings:
        after += [start + (i + 1) % len(ring) for i in range(len(ring))]
        start += len(ring)
    skeleton = straight_skeleton(rings, until)
    edges = [
        shapely.LineString([ring[i], ring[(i + 1) % len(ring)]])
        for ring in rings
        for i in range(len(ring))
    ]
    faces = [
        Polygon([skeleton.nodes[node] for node in ring]) for ring in face_rings(skeleton, after)
    ]
    return skeleton, list(zip(edges, faces))


@st.composite
def stars(draw):
    count = draw(st.integers(3, 16))
    radii = draw(st.lists(st.floats(20, 140), min_size=count, max_size=count))
    angles = 2 * math.pi * (np.arange(count) + draw(st.floats(0, 1))) / count
    return Polygon(np.stack([np.cos(angles), np.sin(angles)], axis=1) * np.array(radii)[:, None])


def test_the_skeleton_of_a_rectangle():
    skeleton, faces = faces_of(box(0, 0, 100, 60))
    assert np.array(sorted(skeleton.nodes[4:])) == pytest.approx(np.array([(30, 30), (70, 30)]))
    assert sorted(face.area for _, face in faces) == pytest.approx([900, 900, 2100, 2100])
    assert skeleton.reach == pytest.approx(30)


def test_the_skeleton_of_a_reflex_corner():
    # the bisector of the inner corner (40, 40) runs to (20, 20) and meets that of (0, 0)
    skeleton, faces = faces_of(L_SHAPE)
    nodes = {(round(x, 6), round(y, 6)) for x, y in skeleton.nodes[6:]}
    assert nodes == {(20.0, 20.0), (80.0, 20.0), (20.0, 80.0)}
    assert sum(face.area for _, face in faces) == pytest.approx(L_SHAPE.area)


@given(stars())
@settings(max_examples=120)
def test_one_face_per_edge_that_tiles_the_outline(shape):
    _, faces = faces_of(shape)
    assert all(face.is_valid and face.distance(edge) < 1e-9 for edge, face in faces)
    assert sum(face.area for _, face in faces) == pytest.approx(shape.area, rel=1e-7)
    for (_, one), (_, two) in itertools.combinations(faces, 2):
        assert one.intersection(two).area < 1e-6


@given(stars())
@settings(max_examples=30)
def test_in_convex_outlines_every_place_belongs_to_the_nearest_edge(shape):
    hull = shape.convex_hull
    _, faces = faces_of(hull)
    for edge, face in faces:
        for place in shapely.get_parts(face.buffer(-0.5).segmentize(5).boundary.normalize()):
            for x, y in place.coords:
                here = Point(x, y)
                assert edge.distance(here) <= min(e.distance(here) for e, _ in faces) + 1e-6


def test_a_hole_and_a_stop():
    shape = box(0, 0, 90, 90).difference(box(30, 30, 60, 60))
    skeleton, faces = faces_of(shape)
    assert sum(face.area for _, face in faces) == pytest.approx(shape.area)
    assert skeleton.reach == pytest.approx(15)
    skeleton, faces = faces_of(box(0, 0, 90, 90), until=20)
    assert skeleton.reach == 20
    assert sum(face.area for _, face in faces) == pytest.approx(90 * 90 - 50 * 50)
    assert len(skeleton.front) == 4


def test_a_rectangle_becomes_two_rows_of_eleven():
    # 200 x 60: the short sides lose their corners to the long ones; 6000 / 540 = 11.1
    (plots,) = skeleton_blocks([Block(box(0, 0, 200, 60))], RULES)
    assert len(plots) == 22
    assert [plot.polygon.area for plot in plots] == pytest.approx([12000 / 22] * 22)
    assert {plot.use for plot in plots} == {"parcel"}


def test_slightly_deep_gives_deeper_parcels_and_deep_a_court():
    # half of 80 m is below 1.45 x 30 m; half of 100 m is above
    (near, far) = skeleton_blocks([Block(box(0, 0, 200, 80)), Block(box(0, 0, 200, 100))], RULES)
    assert {plot.use for plot in near} == {"parcel"}
    courts = [plot.polygon for plot in far if plot.use == "court"]
    assert [court.bounds for court in courts] == [pytest.approx((30, 30, 170, 70))]


def test_a_closed_long_side_leaves_one_row():
    shape = box(0, 0, 180, 30)
    closed = MultiLineString([[(180, 0), (180, 30), (0, 30), (0, 0)]])
    plots = skeleton_block(Block(shape, closed), RULES)
    assert [plot.polygon.area for plot in plots] == pytest.approx([540.0] * 10)
    assert all(plot.polygon.bounds[1] == 0 and plot.polygon.bounds[3] == 30 for plot in plots)


@given(stars(), st.booleans())
@settings(max_examples=60)
def test_any_outline_is_tiled_with_access(shape, half_closed):
    xy = np.array(shape.exterior.coords)
    closed = MultiLineString([xy[: len(xy) // 2 + 1]] if half_closed and len(xy) > 3 else [])
    block = Block(shape, closed)
    (plots,) = skeleton_blocks([block], RULES)
    pieces = [plot.polygon for plot in plots]
    assert all(piece.is_valid for piece in pieces)
    assert sum(piece.area for piece in pieces) == pytest.approx(shape.area, rel=1e-6)
    assert shapely.union_all(pieces).symmetric_difference(shape).area < 1e-6 * shape.area
    rim = shape.boundary.difference(closed.buffer(0.02)).buffer(0.01)
    assert all(
        plot.polygon.boundary.intersection(rim).length >= 0.98 * RULES.min_frontage
        for plot in plots
        if plot.use == "parcel"
    )


def test_what_has_no_skeleton_is_halved_and_told():
    # far more corners than the skeleton takes
    angles = np.linspace(0, 2 * math.pi, 601)[:-1]
    radius = np.where(np.arange(600) % 2, 150, 110)
    gear = Polygon(np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=1))
    with pytest.raises(SkeletonError, match="too many"):
        skeleton_block(Block(gear), RULES)
    (plots,) = skeleton_blocks([Block(gear)], RULES)
    assert sum(plot.polygon.area for plot in plots) == pytest.approx(gear.area, rel=1e-6)
    assert {plot.use for plot in plots} == {"parcel"}
