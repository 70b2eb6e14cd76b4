"""Triangulations and cross fields, against hand-made values and laws of topology."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.parcels.field import (
    Region,
    cross_field,
    field_layers,
    outline,
    propose,
    triangulate,
)
from shapely.affinity import rotate, translate
from shapely.geometry import LineString, Point, Polygon, box

KINDS = ("smooth", "distance")
DISC = Point(0, 0).buffer(100, quad_segs=24)
RECTANGLE = box(0, 0, 240, 120)


@st.composite
def blobs(draw, holes=2):
    """Smooth star shapes far from the origin, with round holes."""
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    radius = np.full(48, 150.0)
    for wave in (1, 2, 3):
        size = draw(st.floats(0, 20 / wave))
        radius += size * np.cos(wave * angle + draw(st.floats(0, 6)))
    shape = Polygon(np.c_[radius * np.cos(angle), radius * np.sin(angle)])
    places = draw(st.permutations([(-60, 0), (60, 0), (0, 60), (0, -60)]))
    count = draw(st.integers(0, holes))
    for x, y in places[:count]:
        shape = shape.difference(Point(x, y).buffer(draw(st.floats(12, 22)), quad_segs=8))
    return translate(shape, 500_000, 4_600_000)


@st.composite
def ragged(draw):
    """Random simple polygons with corners of any angle."""
    count = draw(st.integers(3, 14))
    angle = np.sort(draw(st.lists(st.floats(0, 6.28), min_size=count, max_size=count)))
    radius = draw(st.lists(st.floats(5, 220), min_size=count, max_size=count))
    shape = Polygon(np.c_[radius * np.cos(angle), radius * np.sin(angle)]).buffer(0)
    return max(shapely.get_parts(shape), key=lambda part: part.area, default=shape)


def boundary_turns(field):
    """Quarters that the crosses turn along the rings, the land on the left."""
    mesh, total = field.mesh, 0.0
    rings = shapely.get_rings(field.polygon)
    for number, ring in enumerate(rings):
        on = mesh.outline.ring[mesh.edge] == number
        a, b = field.cross[mesh.pieces[on]].T
        turn = np.angle(b / a).sum() / (2 * np.pi)
        ccw = shapely.is_ccw(ring)
        total += turn if ccw == (number == 0) else -turn
    return total


# -- triangulation ---------------------------------------------------------------------------


@settings(max_examples=8)
@given(blobs(), st.floats(8, 25))
def test_triangles_tile_the_region_and_hold_every_boundary_piece(shape, size):
    mesh = triangulate(shape, size)
    assert mesh.conforming
    faces = shapely.polygons(mesh.points[mesh.triangles])
    assert shapely.area(faces).sum() == pytest.approx(shape.area, rel=1e-9)
    assert shapely.is_ccw(shapely.get_exterior_ring(faces)).all()
    sides = {frozenset(pair) for t in mesh.triangles for pair in (t[:2], t[1:], t[::2])}
    assert all(frozenset(piece) in sides for piece in mesh.pieces)
    edges = mesh.outline
    lines = shapely.linestrings(np.stack([edges.start, edges.end], axis=1))[mesh.edge]
    for end in (0, 1):
        off = shapely.distance(lines, shapely.points(mesh.points[mesh.pieces[:, end]]))
        assert off.max() < 1e-6


def test_triangles_of_a_region_with_a_slit_do_not_cross_it():
    slit = Polygon([(0, 0), (200, 0), (200, 99.9), (40, 99.9), (40, 100.1), (200, 100.1),
                    (200, 200), (0, 200)])  # fmt: skip
    mesh = triangulate(slit, 15.0)
    assert mesh.conforming
    faces = shapely.polygons(mesh.points[mesh.triangles])
    assert shapely.area(faces).sum() == pytest.approx(slit.area, rel=1e-9)


@pytest.mark.parametrize("width", [1e-3, 1e-6, 1e-9])
def test_hairlines_do_not_breed_points(width):
    # samples on the two sides of the slit are not opposite to each other
    slit = Polygon([(0, 0), (300, 0), (300, 100), (83, 100), (300, 100 + width), (300, 200),
                    (211, 200), (0, 200)])  # fmt: skip
    hair = Polygon([(0, 0), (301, 0), (177, width), (59, width)])
    for shape in (slit, hair):
        assert len(triangulate(shape, 5.0).points) < 8000


def test_edges_keep_their_order_and_rings():
    shape = Polygon(box(0, 0, 50, 40).exterior, [box(10, 10, 20, 20).exterior])
    edges = outline(shape)
    assert edges.ring.tolist() == [0] * 4 + [1] * 4
    assert edges.first.tolist() == [0, 4, 8]
    assert edges.before.tolist() == [3, 0, 1, 2, 7, 4, 5, 6]
    assert np.array_equal(edges.start[edges.after], edges.end)


# -- fields ----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("turn", [0.0, 17.0, 44.0])
def test_a_rectangle_has_its_own_directions_and_no_singularity(kind, turn):
    field = cross_field(rotate(RECTANGLE, turn), kind)
    assert len(field.singularities) == 0
    assert np.allclose(field.cross, np.exp(4j * np.radians(turn)))
    inner = field.mesh.points[field.mesh.inner]
    off = np.degrees(field.direction(inner)) - turn
    assert np.allclose((off + 45) % 90 - 45, 0, atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_a_disc_has_four_quarters(kind):
    field = cross_field(DISC, kind)
    assert field.index.tolist() == [1, 1, 1, 1]


@settings(max_examples=8)
@given(blobs(), st.sampled_from(KINDS))
def test_indices_add_up_to_the_euler_characteristic(shape, kind):
    field = cross_field(shape, kind)
    # Poincaré-Hopf: quarters are four times the indices
    assert field.index.sum() == 4 * (1 - len(shape.interiors))


@settings(max_examples=8)
@given(ragged(), st.sampled_from(KINDS))
def test_indices_are_those_of_the_boundary_where_corners_are_free(shape, kind):
    field = cross_field(shape, kind) if shape.area > 100 else None
    if field is not None and field.mesh.conforming:
        assert field.index.sum() == pytest.approx(boundary_turns(field), abs=1e-6)
        assert np.allclose(np.abs(field.cross), 1)
        assert np.isfinite(field.grid.slope).all()
        assert np.isfinite(field.grid.inside).all()


def test_an_annulus_has_none_and_follows_its_circles():
    ring = DISC.difference(Point(0, 0).buffer(40, quad_segs=24))
    field = cross_field(ring, "smooth", size=8.0)
    assert len(field.singularities) == 0
    place = field.mesh.points[field.mesh.inner]
    off = field.direction(place) - np.arctan2(place[:, 1], place[:, 0])
    off = np.degrees((off + np.pi / 4) % (np.pi / 2) - np.pi / 4)
    assert np.abs(off).max() < 4


@pytest.mark.parametrize("angle", [10.0, 30.0, 45.0, 60.0, 80.0])
def test_the_boundary_is_followed_and_corners_that_disagree_are_free(angle):
    # a parallelogram: corners of `angle` and its supplement
    lean = 100 / np.tan(np.radians(angle))
    shape = Polygon([(0, 0), (200, 0), (200 + lean, 100), (lean, 100)])
    field = cross_field(shape, size=10.0)
    mesh = field.mesh
    corner = shapely.distance(
        shapely.points(mesh.points[: len(mesh.pieces)]), shapely.MultiPoint(shape.exterior.coords)
    ) < 1e-9  # fmt: skip
    way = mesh.points[mesh.pieces[:, 1]] - mesh.points[mesh.pieces[:, 0]]
    z = np.exp(4j * np.arctan2(way[:, 1], way[:, 0]))
    here = mesh.pieces[:, 0]
    assert np.allclose(field.cross[here][~corner], z[~corner])
    if angle in (10.0, 80.0):
        # the mean of both sides
        off = np.degrees(np.angle(field.cross[here][corner] / z[corner])) / 4
        assert np.allclose(np.abs(off), 5.0, atol=0.3)  # pieces are not quite of one length


def test_distance_fields_keep_to_the_nearest_side():
    # sides at 0 and 30 degrees far apart: on the third that is near each, its own direction
    shape = Polygon([(0, 0), (400, 0), (400, 300), (0, 300 - 400 * np.tan(np.radians(30)))])
    points = np.c_[np.full(9, 200.0), np.full(9, 20.0)]
    direction = {kind: np.degrees(cross_field(shape, kind).direction(points))[0] for kind in KINDS}
    assert abs(direction["distance"]) < 2
    assert abs(direction["distance"]) < abs(direction["smooth"])


def test_arcs_drawn_with_many_vertices_are_followed_without_steps():
    angle = np.linspace(0, np.pi / 2, 24)
    outer, inner = 260.0, 140.0
    ring = np.r_[
        np.c_[outer * np.cos(angle), outer * np.sin(angle)],
        np.c_[inner * np.cos(angle), inner * np.sin(angle)][::-1],
    ]
    field = cross_field(Polygon(ring), "distance", size=9.0)
    assert len(field.singularities) == 0
    around = np.linspace(0.2, 1.37, 200)
    points = 245 * np.c_[np.cos(around), np.sin(around)]
    off = np.degrees(field.direction(points) - around)
    off = (off + 45) % 90 - 45
    assert np.abs(off).max() < 2
    # edges turn by 4 degrees: half of it would show as steps
    assert np.abs(np.diff(off)).max() < 0.5


def test_divergence_of_a_known_field():
    # lines along the circles of an annulus do not part; those across do by 1 / radius
    ring = DISC.difference(Point(0, 0).buffer(40, quad_segs=48))
    field = cross_field(ring, size=6.0)
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    out = np.c_[np.cos(angle), np.sin(angle)]
    along = np.c_[-out[:, 1], out[:, 0]]
    assert np.abs(field.divergence(70 * out, along)).max() < 2e-3
    assert np.allclose(field.divergence(70 * out, out), 1 / 70, rtol=0.12)


def test_guides_are_followed_and_forgotten_far_away():
    site = box(0, 0, 600, 600)
    guide = LineString([(120, 100), (220, 200)])
    field = cross_field(site, "guided", guides=[guide])
    near = np.array([[170.0, 150.0]])
    far = np.array([[520.0, 520.0]])
    assert abs(np.degrees(field.direction(near))[0]) > 38
    assert abs(np.degrees(field.direction(far))[0]) < 3
    assert abs(np.degrees(cross_field(site).direction(near))[0]) < 1e-6


def test_guides_that_are_missing_are_asked_for():
    with pytest.raises(InputError, match="Draw at least one line"):
        cross_field(RECTANGLE, "guided")
    with pytest.raises(InputError, match="no area"):
        cross_field(Polygon())


def test_a_field_is_the_same_far_from_the_origin():
    here = cross_field(DISC)
    there = cross_field(translate(DISC, 4_000_000, 5_000_000))
    points = here.mesh.points[here.mesh.inner][::7]
    points = points[np.hypot(*points.T) > 30]
    off = here.direction(points) - there.direction(points + np.array([4e6, 5e6]))
    assert np.abs((off + np.pi / 4) % (np.pi / 2) - np.pi / 4).max() < 0.05


def test_distance_is_exact_at_the_nodes_and_negative_outside():
    shape = Polygon(box(0, 0, 200, 150).exterior, [box(90, 60, 110, 80).exterior])
    field = cross_field(shape)
    x, y = np.meshgrid(np.arange(5, 200, 13.0), np.arange(5, 150, 11.0))
    points = np.c_[x.ravel(), y.ravel()]
    exact = shapely.distance(shapely.points(points), shape.boundary)
    exact = np.where(shapely.contains_xy(shape, *points.T), exact, -exact)
    assert np.abs(field.distance(points) - exact).max() < 0.5 * field.grid.step


def test_layers_show_crosses_and_singularities():
    field = cross_field(DISC)
    crosses, singularities = field_layers(field, "EPSG:32632")
    assert len(crosses) == len(field.mesh.points)
    assert crosses.crs == singularities.crs == "EPSG:32632"
    assert (crosses.geom_type == "MultiLineString").all()
    assert singularities["quarters"].tolist() == [1, 1, 1, 1]
    # the first arm, and the angle said of it
    arm = shapely.get_coordinates(crosses.geometry.iloc[-1])[:2]
    way = arm[1] - arm[0]
    bearing = np.degrees(np.arctan2(way[0], way[1])) % 90
    assert crosses["angle"].iloc[-1] == pytest.approx(bearing)
    flat, none = field_layers(cross_field(RECTANGLE), None)
    assert len(none) == 0
    assert (flat["angle"] % 90 == 0).all()


@pytest.mark.parametrize(
    "shape",
    [
        box(0, 0, 1, 1),
        box(0, 0, 400, 0.5),
        box(0, 0, 3000, 20),
        Polygon([(0, 0), (500, 0), (0, 1e-6)]),
        Polygon([(0, 0), (100, 0), (100, 100), (100, 0.0), (120, 0), (120, 150), (0, 150)]).buffer(
            0
        ),
        Point(0, 0).buffer(150, quad_segs=600),
        Polygon(DISC.exterior, [Point(0, 40).buffer(60).exterior]),
    ],
)
@pytest.mark.parametrize("kind", KINDS)
def test_odd_regions_get_a_field_and_no_exception(shape, kind):
    shape = max(shapely.get_parts(shape), key=lambda part: part.area)
    field = cross_field(shape, kind)
    assert np.isfinite(field.cross).all()
    result = propose(Region.of(shape), kind=kind)
    assert all(np.isfinite(result.lines.points).ravel())
