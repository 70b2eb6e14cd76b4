"""How floor plans look: one storey at a time, names of rooms, doors that stand open."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from qgis.core import QgsExpression, QgsExpressionContext, QgsFeature, QgsGeometry  # noqa: E402
from support import box, layer  # noqa: E402

FIELDS = "field=floor:integer&field=template:string(30)&field=area_m2:double&field=colour:string(7)"


@pytest.fixture
def styles(package):
    return package("plugin.styles")


@pytest.fixture
def kinds(package):
    return package("plugin.room_fields")


def rooms(*storeys):
    return layer(
        [box(10 * at, 0, 8, 6) for at in range(len(storeys))],
        fields=FIELDS,
        values=[[storey, "office", 47.6, "#336699"] for storey in storeys],
    )


def ticked(made):
    rules = made.renderer().rootRule().children()
    return {rule.label(): rule.active() for rule in rules}


def test_the_lowest_storey_is_shown_and_others_by_a_tick(styles, kinds):
    made = rooms(1, 0, 0, 2)
    styles.apply(made, kinds.ROOMS)
    assert ticked(made) == {"storey 0": True, "storey 1": False, "storey 2": False}


def test_a_single_storey_has_the_plain_style(styles, kinds):
    made = rooms(3, 3)
    styles.apply(made, kinds.ROOMS)
    assert made.renderer().type() == "singleSymbol"


def test_rooms_are_named_with_their_area(styles, kinds):
    made = rooms(0)
    styles.apply(made, kinds.ROOMS)
    assert made.labelsEnabled()
    context = QgsExpressionContext()
    context.setFields(made.fields())
    context.setFeature(next(made.getFeatures()))
    text = QgsExpression(made.labeling().settings().fieldName).evaluate(context)
    assert text == "office\n48 m²"


def test_walls_are_as_thick_as_on_the_ground(styles, kinds, package):
    made = rooms(0)
    styles.apply(made, kinds.ROOMS)
    wall = made.renderer().symbol().symbolLayer(0)
    assert wall.strokeWidthUnit() == package("plugin.compat").METRES_ON_GROUND
    assert 0.1 <= wall.strokeWidth() <= 0.4


@pytest.mark.parametrize("turn", [0.0, 0.6, 2.5, 4.0])
def test_doors_open_into_the_room_to_their_left(styles, kinds, turn):
    """The leaf is as long as the opening, at a right angle to it, on its left; so is the swing."""
    width, x, y = 0.9, 500.0, 300.0
    away = (x + width * math.cos(turn), y + width * math.sin(turn))
    made = layer(
        [f"LINESTRING({x} {y}, {away[0]} {away[1]})"], kind="LineString",
        fields="field=floor:integer", values=[[0]],
    )  # fmt: skip
    styles.apply(made, kinds.FLOOR_DOORS)
    drawn = made.renderer().symbol().symbolLayer(1)
    context = QgsExpressionContext()
    feature = QgsFeature()
    feature.setGeometry(next(made.getFeatures()).geometry())
    context.setFeature(feature)
    expression = QgsExpression(drawn.geometryExpression())
    shape = expression.evaluate(context)
    assert not expression.hasEvalError(), expression.evalErrorString()
    assert isinstance(shape, QgsGeometry)
    places = [(p.x(), p.y()) for p in shape.vertices()]
    tip = (x - width * math.sin(turn), y + width * math.cos(turn))
    assert places[0] == pytest.approx((x, y))
    assert places[1] == pytest.approx(tip)
    assert places[-1] == pytest.approx(away)
    assert all(math.dist(place, (x, y)) == pytest.approx(width) for place in places[1:])


def test_names_of_styles_fit_into_a_geopackage(package):
    """The table of styles has room for 30 characters."""
    others = package("plugin.renderers").OTHERS
    for kind in ("floor_rooms", "level_blocks"):
        assert others[kind]
        assert all(len(f"{kind}, {title}") <= 30 for title in others[kind])
