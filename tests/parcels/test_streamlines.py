"""Streamlines and the pieces they make, against geometry by shapely."""

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
    line_layer,
    outline,
    propose,
    score,
    shares,
    split,
    streamlines,
)
from shapely.affinity import rotate, translate
from shapely.geometry import LineString, Point, Polygon, box

RECTANGLE = box(0, 0, 300, 225)
DISC = Point(0, 0).buffer(100, quad_segs=24)
RING = DISC.difference(Point(0, 0).buffer(40, quad_segs=24))


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


def set_up(shape, **wishes):
    field = cross_field(shape)
    lines = streamlines(field)
    return field, lines, score(field, lines, Region.of(shape), **wishes)


def end_points(lines):
    return np.stack([lines.points[lines.first[:-1]], lines.points[lines.first[1:] - 1]], axis=1)


# -- lines -----------------------------------------------------------------------------------


@settings(max_examples=5)
@given(blobs(), st.integers(0, 5))
def test_lines_lead_from_boundary_to_boundary_inside(shape, seed):
    lines = streamlines(cross_field(shape), seed=seed)
    assert len(lines) > 20
    edges = outline(shape)
    number = edges.first[lines.ring] + lines.edge
    assert (edges.ring[number] == lines.ring).all()
    assert ((lines.t >= 0) & (lines.t <= 1)).all()
    place = edges.start[number] + lines.t[..., None] * (edges.end - edges.start)[number]
    assert np.abs(place - end_points(lines)).max() < 1e-6
    drawn = lines.geometry()
    assert np.allclose(shapely.length(drawn), lines.length)
    assert shapely.is_simple(drawn).all()
    # simplified by 0.3 m, a line may cut a vertex of the boundary where it ends
    outside = shapely.length(shapely.difference(drawn, shape.buffer(0.3)))
    assert outside.max() == 0


def test_lines_of_a_rectangle_are_straight_with_two_vertices():
    lines = streamlines(cross_field(rotate(RECTANGLE, 20)))
    assert (np.diff(lines.first) == 2).all()
    assert set(np.round(lines.length, 6)) == {300.0, 225.0}


def test_lines_of_an_annulus_are_its_radii():
    # circles never end, so only radii come from boundary to boundary
    lines = streamlines(cross_field(RING, size=8.0))
    assert len(lines) > 20
    both = end_points(lines)
    angle = np.arctan2(both[..., 1], both[..., 0])
    assert np.abs(np.exp(1j * angle[:, 0]) - np.exp(1j * angle[:, 1])).max() < np.radians(4)
    assert np.allclose(lines.length, 60, atol=0.6)
    assert (lines.ring[:, 0] != lines.ring[:, 1]).all()


@settings(max_examples=4)
@given(blobs(holes=1))
def test_lines_are_tangent_to_the_field(shape):
    field = cross_field(shape)
    drawn = streamlines(field).geometry()
    for line in drawn[::5]:
        at = np.linspace(0.15, 0.85, 9) * line.length
        a, b, middle = (
            shapely.get_coordinates(shapely.line_interpolate_point(line, at + s))
            for s in (-6, 6, 0)
        )
        if len(field.singularities):
            clear = shapely.distance(
                shapely.points(middle), shapely.MultiPoint(field.singularities)
            )
            a, b, middle = a[clear > 45], b[clear > 45], middle[clear > 45]
        # at the triangles themselves, not at the raster that was traced
        z = crosses_by_triangles(field, middle)
        way = (b - a) @ [1, 1j]
        off = np.degrees(np.angle((way / np.abs(way)) ** 4 * z.conj())) / 4
        assert np.abs(off).max(initial=0) < 6


def crosses_by_triangles(field, points):
    mesh = field.mesh
    tree = shapely.STRtree(shapely.polygons(mesh.points[mesh.triangles]))
    found = tree.nearest(shapely.points(points))
    corner = mesh.points[mesh.triangles[found]]
    system = np.concatenate([corner.transpose(0, 2, 1), np.ones((len(points), 1, 3))], axis=1)
    right = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    weight = np.linalg.solve(system, right[..., None])[..., 0]
    z = (weight * field.cross[mesh.triangles[found]]).sum(axis=1)
    return z / np.abs(z)


def test_lines_keep_apart():
    lines = streamlines(cross_field(RECTANGLE), depth=30)
    both = end_points(lines)
    upright = np.abs(both[:, 0, 0] - both[:, 1, 0]) < 1
    for values in (both[upright, 0, 0], both[~upright, 0, 1]):
        gaps = np.diff(np.sort(values))
        assert gaps.min() > 0.3 * 30 - 1e-6
        # and no room is left for two more
        assert gaps.max() < 6 * 0.3 * 30


def test_lines_do_not_pass_slits():
    slit = Polygon([(0, 0), (300, 0), (300, 149.9), (100, 149.9), (100, 150.1), (300, 150.1),
                    (300, 300), (0, 300)])  # fmt: skip
    drawn = streamlines(cross_field(slit)).geometry()
    assert len(drawn) > 20
    assert not shapely.crosses(drawn, LineString([(101, 150), (300, 150)])).any()


def test_own_seeds_come_first():
    field = cross_field(RECTANGLE)
    drawn = streamlines(field, first=np.array([[75.0, 75.0], [225.0, 150.0]])).geometry()
    for x in (75.0, 225.0):
        assert any(line.equals_exact(LineString([(x, 0), (x, 225)]), 1e-6)
                   or line.equals_exact(LineString([(x, 225), (x, 0)]), 1e-6)
                   for line in drawn)  # fmt: skip


@settings(max_examples=2)
@given(blobs(), st.integers(0, 99))
def test_the_same_seed_gives_the_same_lines_and_scores(shape, seed):
    first, second = (propose(Region.of(shape), seed=seed) for _ in range(2))
    assert first.lines.points.tobytes() == second.lines.points.tobytes()
    assert first.scores.quality.tobytes() == second.scores.quality.tobytes()
    assert first.best == second.best
    other = propose(Region.of(shape), seed=seed + 1)
    assert first.lines.points.tobytes() != other.lines.points.tobytes()


# -- pieces ----------------------------------------------------------------------------------


@settings(max_examples=5)
@given(blobs())
def test_pieces_tile_the_region_and_share_the_street(shape):
    result = propose(Region.of(shape))
    assert result.best
    for number, pieces in zip(result.best, result.pieces):
        a, b = pieces
        assert a.is_valid
        assert b.is_valid
        assert a.area + b.area == pytest.approx(shape.area, rel=1e-9)
        assert a.intersection(b).area < 1e-6 * shape.area
        holes = len(a.interiors) + len(b.interiors)
        partner = int(result.scores.partner[number])
        assert holes == len(shape.interiors) - (partner >= 0)
        street = {tuple(xy) for xy in result.lines.line(number)}
        for piece in pieces:
            assert street <= {tuple(xy) for xy in shapely.get_coordinates(piece)}
            # nothing is lost of the old vertices
        old = {tuple(xy) for xy in shapely.get_coordinates(shape)}
        new = {tuple(xy) for piece in pieces for xy in shapely.get_coordinates(piece)}
        assert old <= new


def test_a_hole_is_passed_by_a_street_on_both_sides():
    # the hole is so large that every street across meets it
    site = box(0, 0, 400, 200).difference(box(120, 15, 280, 185))
    _, lines, scores = set_up(site)
    joins = np.flatnonzero((lines.ring[:, 0] != lines.ring[:, 1]) & (scores.partner >= 0))
    assert len(joins)
    done = 0
    for number in joins:
        pieces = split(site, lines, int(number), int(scores.partner[number]))
        if pieces is None:
            continue
        done += 1
        assert sum(piece.area for piece in pieces) == pytest.approx(site.area, rel=1e-9)
        assert all(piece.is_valid and not piece.interiors for piece in pieces)
    assert done > 0.8 * len(joins)
    assert split(site, lines, int(joins[0])) is None


@settings(max_examples=4)
@given(blobs(holes=0))
def test_shares_are_those_of_the_pieces(shape):
    lines = streamlines(cross_field(shape))
    share = shares(lines, shape)
    for number in range(0, len(lines), 7):
        pieces = split(shape, lines, number)
        if pieces is not None:
            areas = [piece.area for piece in pieces]
            assert share[number] == pytest.approx(min(areas) / sum(areas), abs=1e-6)


def test_no_piece_is_too_thin():
    result = propose(Region.of(translate(DISC.buffer(60), 1e6, 5e6)), wanted=12)
    assert result.best
    for pieces in result.pieces:
        for piece in pieces:
            radius = shapely.length(shapely.maximum_inscribed_circle(piece, 0.1))
            assert radius > 0.75 * 30 + 0.25 * 15 - 0.2


@settings(max_examples=8)
@given(ragged())
def test_regions_of_any_shape_get_finite_scores(shape):
    result = propose(Region.of(shape))
    scores = result.scores
    for name in ("div", "db", "ds", "ct", "offset", "angle", "closed", "balance", "quality"):
        assert np.isfinite(getattr(scores, name)).all()
    assert len(scores.reason) == len(result.lines)
    for pieces in result.pieces:
        assert sum(piece.area for piece in pieces) == pytest.approx(shape.area, rel=1e-6)


def test_regions_too_small_for_a_street_get_none():
    for shape in (box(0, 0, 10, 10), box(0, 0, 60, 60), box(0, 0, 900, 6)):
        result = propose(Region.of(shape))
        assert result.best == ()
        assert result.pieces == ()


def test_kinds_and_junctions_have_to_fit():
    with pytest.raises(InputError, match="4 edges"):
        Region(RECTANGLE, np.zeros(3, int))
    with pytest.raises(InputError, match="junctions"):
        Region(RECTANGLE, np.zeros(4, int), np.zeros((2, 2)), np.zeros((1, 2)))


def test_the_layer_shows_all_columns_best_first():
    _, lines, scores = set_up(translate(DISC.buffer(80), 600_000, 5_000_000))
    layer = line_layer(lines, scores, "EPSG:32632")
    assert len(layer) == len(lines)
    assert layer.crs == "EPSG:32632"
    good = layer[layer["rank"] > 0]
    assert good["rank"].tolist() == list(range(1, len(good) + 1))
    assert good["quality"].is_monotonic_increasing
    assert (layer[layer["rank"] == 0]["reason"] != "").all()
    assert np.allclose(layer.length, layer["length"])
    assert layer["line"].iloc[0] == scores.order[0]
    _, none, no_scores = set_up(box(0, 0, 5, 5))
    assert len(line_layer(none, no_scores, "EPSG:32632")) == 0
