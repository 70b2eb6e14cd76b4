"""Shadows on the ground, against shadows that are drawn otherwise."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.rules import SunRule
from platwright.buildings.shape import footprints
from platwright.buildings.sun import shadow_polygons, shadow_rectangles
from platwright.buildings.sun.shadows import cast_shadows
from platwright.buildings.sun.track import SunSteps, sun_steps
from platwright.buildings.types import Placements
from shapely import affinity
from shapely.geometry import Point, box

from .sun_checks import KINDS, hidden, noaa_sun, outline, placed, scattered, zone_at


def steps_of(*suns: tuple[float, float]) -> SunSteps:
    """Return instants from (azimuth, altitude) on the grid."""
    azimuth, altitude = np.radians(np.array(suns, dtype=float)).T
    towards = np.column_stack([np.sin(azimuth), np.cos(azimuth)])
    return SunSteps(np.arange(float(len(suns))), np.ones(len(suns)), towards, np.tan(altitude))


def test_the_rectangle_lies_behind_as_long_as_the_facade():
    # A house of 20 x 12 x 18 m that looks south, east and north.
    south, east, north = shadow_rectangles(
        KINDS, placed((0, 0, 0, 180), (0, 100, 0, 90), (0, 200, 0, 0)), 1.5
    )
    assert south.symmetric_difference(box(-10, 6, 10, 33)).area < 1e-9
    assert east.symmetric_difference(box(67, -10, 94, 10)).area < 1e-9
    assert north.symmetric_difference(box(190, -33, 210, -6)).area < 1e-9
    assert all(shape.exterior.is_ccw for shape in (south, east, north))


@settings(max_examples=30)
@given(st.floats(0, 360), st.floats(0.1, 3))
def test_turned_rectangles_border_on_the_house(facing, coefficient):
    house = placed((0, 50, 70, facing))
    (shadow,), (ground,) = shadow_rectangles(KINDS, house, coefficient), footprints(KINDS, house)
    assert shadow.area == pytest.approx(20 * 18 * coefficient)
    assert shadow.intersection(ground).area < 1e-6
    assert shadow.intersection(ground.buffer(1e-6)).length == pytest.approx(40, abs=0.01)
    away = np.array(shadow.centroid.coords[0]) - house.xy[0]
    assert math.degrees(math.atan2(*away)) % 360 == pytest.approx((facing + 180) % 360, abs=1e-6)


def test_no_building_has_no_shadow():
    none = Placements.empty()
    assert len(shadow_rectangles(KINDS, none, 1.0)) == 0
    assert len(shadow_polygons(zone_at(50), KINDS, none, SunRule(hours=1))) == 0


def test_the_coefficient_rule_needs_no_sun():
    houses = placed((0, 0, 0, 180), (1, 50, 0, 200))
    drawn = shadow_polygons(zone_at(89.0), KINDS, houses, SunRule(coefficient=2))
    assert shapely.equals(drawn, shadow_rectangles(KINDS, houses, 2)).all()


def test_one_sun_from_the_south_throws_a_box_to_the_north():
    (shadow,) = cast_shadows(KINDS, placed((0, 5, 7, 180)), steps_of((180, 45)))
    assert shadow.symmetric_difference(box(-5, 13, 15, 31)).area < 1e-9
    (shadow,) = cast_shadows(
        KINDS, placed((0, 0, 0, 90)), steps_of((90, math.degrees(math.atan(2))))
    )
    # The house stands across: 12 m from west to east, 20 from south to north.
    assert shadow.symmetric_difference(box(-15, -10, -6, 10)).area < 1e-6


@settings(max_examples=25)
@given(
    st.floats(0, 360), st.integers(0, 2), st.floats(60, 170), st.floats(5, 100), st.floats(6, 60)
)
def test_a_sweep_is_the_union_of_many_shadows(facing, kind, start, swing, altitude):
    one = placed((kind, 10, 20, facing))
    suns = [(start, altitude), (start + swing, altitude + 15)]
    (swept,) = cast_shadows(KINDS, one, steps_of(*suns))
    tips = [
        -KINDS[kind].height_m / math.tan(math.radians(h))
        * np.array([math.sin(math.radians(a)), math.cos(math.radians(a))])
        for a, h in suns
    ]  # fmt: skip
    ground = outline(KINDS, one, 0)
    drawn = []
    for t in np.linspace(0, 1, 161):
        tip = tips[0] * (1 - t) + tips[1] * t
        # A straight sweep of a convex ground is the hull of its two ends.
        drawn.append(shapely.union_all([ground, affinity.translate(ground, *tip)]).convex_hull)
    wanted = shapely.union_all(drawn).difference(ground)
    assert swept.buffer(1e-6).covers(wanted.buffer(-1e-5))
    assert swept.area == pytest.approx(wanted.area, rel=0.01)
    # On a grid: where edges differ by the last digit, GEOS may take the inside for the outside.
    assert shapely.intersection(swept, ground, grid_size=1e-6).area < 1e-3


def test_ground_is_in_the_shadow_just_where_rays_to_the_sun_are_blocked():
    rule = SunRule(hours=2, month=3, day=20, start=8, end=16, step_minutes=20)
    zone, house = zone_at(48.0, convergence=1.5), placed((1, 100, 100, 160))
    (shadow,) = shadow_polygons(zone, KINDS, house, rule)
    ground = outline(KINDS, house, 0)
    suns = [noaa_sun(zone.latitude, zone.longitude, rule, h) for h in np.linspace(8, 16, 25)]
    rng = np.random.default_rng(3)
    dark = 0
    for x, y in rng.uniform(0, 250, (600, 2)):
        spot = Point(x, y)
        if ground.buffer(0.5).covers(spot) or shadow.boundary.distance(spot) < 0.5:
            continue
        shaded = any(hidden(spot, a - 1.5, h, 0.0, [(ground, 45.0)]) for a, h in suns)
        dark += shaded
        # Between two instants the shadow passes ground that neither shades.
        assert shadow.covers(spot) or not shaded
        if shadow.covers(spot) and not shaded:
            assert (
                min(
                    shapely.LineString(
                        [spot, _toward(spot, a - 1.5, 45 / math.tan(math.radians(h)))]
                    ).distance(ground)
                    for a, h in suns
                )
                < 12
            )
    assert dark > 40


def _toward(spot: Point, azimuth: float, length: float) -> tuple[float, float]:
    a = math.radians(azimuth)
    return spot.x + length * math.sin(a), spot.y + length * math.cos(a)


def test_in_the_polar_night_there_is_no_shadow():
    shadows = shadow_polygons(zone_at(75.0), KINDS, scattered(5, 1), SunRule(hours=1))
    assert all(shape.is_empty and shape.geom_type == "Polygon" for shape in shadows)


def test_alike_buildings_have_alike_shadows_in_their_own_places():
    houses = scattered(60, 4, faces=(180.0, 200.0, 90.0))
    rule = SunRule(hours=2)
    zone = zone_at(52.5)
    together = shadow_polygons(zone, KINDS, houses, rule)
    for at in (0, 17, 59):
        (alone,) = shadow_polygons(zone, KINDS, houses.take([at]), rule)
        assert alone.symmetric_difference(together[at]).area < 1e-6 * alone.area
    assert shapely.is_valid(together).all()
    begun = time.process_time()
    cast_shadows(KINDS, scattered(200, 5, faces=(180.0, 175.0, 90.0)), sun_steps(zone, rule))
    assert time.process_time() - begun < 0.5
