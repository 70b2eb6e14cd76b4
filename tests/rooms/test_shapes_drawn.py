"""Templates drawn as polygons."""

from __future__ import annotations

import re

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.rooms.shapes import drawn_templates, drawn_unit
from platwright.rooms.types import Template
from shapely import affinity
from shapely.geometry import LineString, MultiPolygon, Point, Polygon

from .shape_oracle import pinched, polyominoes

LINE = frozenset({(0, 0), (1, 0), (2, 0)})
CORNER = frozenset({(0, 0), (1, 0), (0, 1)})
RING = frozenset((x, y) for x in range(3) for y in range(3)) - {(1, 1)}


def drawn(cells, unit=1.0, x=0.0, y=0.0):
    """Draw squares as one polygon."""
    boxes = [
        shapely.box(x + a * unit, y + b * unit, x + (a + 1) * unit, y + (b + 1) * unit)
        for a, b in cells
    ]
    return shapely.union_all(boxes, grid_size=1e-6 * unit)


def layer(*shapes, **fields):
    return gpd.GeoDataFrame(fields, geometry=list(shapes))


def wobbly(shape, amount, seed):
    """Move every corner by at most so much in x and in y."""
    random = np.random.default_rng(seed)
    rings = [shapely.get_coordinates(ring) for ring in (shape.exterior, *shape.interiors)]
    outline, *holes = (_moved(ring, amount, random) for ring in rings)
    return Polygon(outline, holes)


def _moved(ring, amount, random):
    points = ring[:-1] + random.uniform(-amount, amount, (len(ring) - 1, 2))
    return np.vstack([points, points[:1]])


@settings(max_examples=80)
@given(
    st.lists(polyominoes(), min_size=1, max_size=4),
    st.floats(0.01, 500),
    st.floats(-1e5, 1e5),
    st.integers(0, 1000),
)
def test_squares_are_found_again(shapes, unit, shift, seed):
    assume(not any(pinched(cells) for cells in shapes))
    # One square and one line of three make the unit plain.
    shapes = [LINE, frozenset({(0, 0)}), *shapes]
    polygons = [
        wobbly(drawn(cells, unit, shift + 9.3 * unit * i, -shift), 0.02 * unit, seed + i)
        for i, cells in enumerate(shapes)
    ]
    table = layer(*polygons)
    assert drawn_unit(table) == pytest.approx(unit, rel=0.05)
    assert [t.cells for t in drawn_templates(table)] == shapes
    assert [t.cells for t in drawn_templates(table, unit=unit)] == shapes


def test_extra_vertices_pieces_and_holes_do_no_harm():
    ring = shapely.segmentize(drawn(RING, 4, 3, 3), 0.7)
    pieces = MultiPolygon([shapely.box(20, 0, 24, 4), shapely.box(24, 0, 28, 4)])
    table = layer(ring, pieces, shapely.force_3d(drawn(CORNER, 4)))
    found = [t.cells for t in drawn_templates(table)]
    assert found == [RING, frozenset({(0, 0), (1, 0)}), CORNER]


def test_fields_are_used():
    table = layer(
        drawn(CORNER), drawn(LINE), drawn(LINE, 1, 9),
        Name=["ward", None, ""], MIN=[2, None, np.nan], max=["4", None, None],
        min_share=[0.1, np.nan, np.nan], max_share=["0,5", None, None],
        color=["#8fb8de", None, None], use=["patients", None, None],
        rotate=["0, 180", False, 90.0], mirror=["no", 1, None],
    )  # fmt: skip
    assert drawn_templates(table) == (
        Template("ward", CORNER, (0, 2), False, 2, 4, 0.1, 0.5, "#8fb8de", "patients"),
        Template("shape 2", LINE, (0,)),
        Template("shape 3", LINE, (1,)),
    )


def test_colour_goes_before_color():
    table = layer(drawn(LINE), color=["#000000"], colour=["#ffffff"])
    assert drawn_templates(table)[0].colour == "#ffffff"


def test_the_unit_may_be_told():
    block = shapely.box(0, 0, 8, 8)
    one, four = 1, 4
    assert drawn_unit(layer(block)) == pytest.approx(8)
    assert len(drawn_templates(layer(block))[0].cells) == one
    assert len(drawn_templates(layer(block), unit=4)[0].cells) == four
    assert len(drawn_templates(layer(block, unit=[4]))[0].cells) == four
    mixed = layer(block, shapely.box(0, 0, 6, 3), unit=[4, 3])
    assert [len(t.cells) for t in drawn_templates(mixed)] == [4, 2]
    partly = layer(block, block, unit=[4, None])
    assert [len(t.cells) for t in drawn_templates(partly)] == [4, 4]


@pytest.mark.parametrize("height", [4.5, 4.8])
def test_a_stray_polygon_is_named_and_not_read_as_many_tiny_squares(height):
    table = layer(drawn(LINE, 4), drawn(CORNER, 4), shapely.box(0, 0, 8, height), drawn(RING, 4))
    table.index = [11, 12, 13, 14]
    with pytest.raises(InputError, match=r"not made of whole squares of 4 by 4") as caught:
        drawn_templates(table, "Shapes")
    assert (caught.value.layer, caught.value.feature) == ("Shapes", 13)
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("off", "fine"), [(0.04, True), (0.08, False), (-0.04, True), (-0.08, False)]
)
def test_five_hundredths_of_a_unit_are_tolerated(off, fine):
    # The origin is that of most of the outline, so that a single corner is off by itself.
    corners = [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1 + off), (1, 1 + off), (1, 2), (0, 2)]
    table = layer(Polygon(corners))
    if fine:
        assert len(drawn_templates(table, unit=1)[0].cells) == 5
    else:
        with pytest.raises(InputError, match=r"Layer 'Room templates', feature 0: .*whole squares"):
            drawn_templates(table, unit=1)


SQUARE = shapely.box(0, 0, 1, 1)


@pytest.mark.parametrize(
    ("shape", "says"),
    [
        (affinity.rotate(drawn(LINE), 30), "squares"),
        (Polygon([(0, 0), (2, 0), (0, 2)]), "squares"),
        (drawn(RING).difference(shapely.box(0.3, 0.3, 0.5, 0.5)), "not made of whole squares"),
        (SQUARE.union(shapely.box(1, 0.4, 2.3, 0.5)), "not made of whole squares"),
        (shapely.box(0, 0, 0.3, 0.3), "not made of whole squares"),
        (Point(0, 0).buffer(3), "squares"),
        (Polygon([(0, 0), (2, 2), (2, 0), (0, 2)]), "crosses itself"),
        (drawn({(0, 0), (1, 1)}), "meet only in a corner"),
        (drawn({(0, 0), (2, 0)}), "do not hang together"),
        (LineString([(0, 0), (1, 1)]), "not a polygon"),
        (Polygon(), "no geometry"),
        (None, "no geometry"),
        (Polygon([(0, 0), (1, 1), (2, 2)]), "no area"),
    ],
)
def test_polygons_that_will_not_do_are_named(shape, says):
    table = layer(SQUARE, shape)
    with pytest.raises(InputError, match=re.escape(says)) as caught:
        drawn_templates(table, "Shapes", unit=1)
    assert str(caught.value).startswith("Layer 'Shapes', feature 1: ")
    with pytest.raises(InputError) as alone:
        drawn_templates(layer(shape) if shape is not None else table, "Shapes", unit=1)
    assert alone.value.layer == "Shapes"


def test_a_layer_that_is_turned_is_refused():
    with pytest.raises(InputError, match=r"Layer 'Shapes', feature 0: .*along x and y"):
        drawn_templates(layer(affinity.rotate(drawn(LINE), 30)), "Shapes")


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"min": ["few"]}, "field min is 'few'"),
        ({"max": [1.5]}, "field max is 1.5"),
        ({"min": [3], "max": [2]}, "at least 3 and at most 2"),
        ({"max_share": [40]}, "between 0 and 1"),
        ({"min_share": ["inf"]}, "field min_share is 'inf'"),
        ({"colour": ["blue"]}, "colour is 'blue'"),
        ({"rotate": ["45"]}, "field rotate is '45'"),
        ({"mirror": ["perhaps"]}, "field mirror is 'perhaps'"),
        ({"unit": [-1]}, "unit is -1"),
    ],
)
def test_fields_that_make_no_sense_are_named(fields, says):
    with pytest.raises(InputError, match=re.escape(says)) as caught:
        drawn_templates(layer(SQUARE, **fields), "Shapes")
    assert (caught.value.layer, caught.value.feature) == ("Shapes", 0)


def test_layers_that_make_no_sense_are_named():
    with pytest.raises(InputError, match=r"Layer 'Shapes': It is empty"):
        drawn_templates(layer(), "Shapes")
    with pytest.raises(InputError, match=r"Layer 'Shapes': Two templates are called 'a'"):
        drawn_templates(layer(SQUARE, SQUARE, name=["a", "a"]), "Shapes")
    with pytest.raises(InputError, match="The unit is 0"):
        drawn_templates(layer(SQUARE), unit=0)
