"""Figures of zones from layers that somebody drew."""

from __future__ import annotations

import math

import geopandas as gpd
import pytest
from platwright.errors import InputError
from platwright.measure.zone_figures import zone_figures
from shapely.geometry import LineString, Polygon, box

UTM = "EPSG:32633"
X, Y = 500_000.0, 5_500_000.0


def at(*bounds):
    return box(X + bounds[0], Y + bounds[1], X + bounds[2], Y + bounds[3])


def frame(shapes, **fields):
    return gpd.GeoDataFrame(fields, geometry=list(shapes), crs=UTM)


def drawn(**more):
    zone = frame([at(0, 0, 100, 100)])
    # the second house overlaps the first by 10 m x 10 m
    buildings = frame(
        [at(10, 10, 30, 20), at(20, 10, 40, 20), at(60, 60, 80, 90)],
        use=["residence", "residence", "facility"], storeys=[5, 5, 2], dwellings=[10, None, 0],
        sun_hours=[2.0, 4.0, 0.0], shaded=[False, True, False], way_m=[10.0, None, 30.0],
    )  # fmt: skip
    return {"zone": zone, "buildings": buildings, **more}


def test_figures_of_a_drawing_worked_out_by_hand():
    found = zone_figures(
        drawn(
            corridors=frame([LineString([(X + 50, Y - 20), (X + 50, Y + 100)])], width_m=[10.0]),
            # 2 m of its 20 m length run through a building
            paths=frame([LineString([(X + 20, Y + 18), (X + 20, Y + 38)])], width_m=[3.0]),
            parking=frame([at(56, 0, 61, 20)], places=[8]),
            green=frame([at(0, 50, 20, 100), at(90, 90, 120, 100)]),
        )
    )
    assert found.zone_ha == pytest.approx(1.0)
    assert found.far == pytest.approx((200 * 5 + 200 * 5 + 600 * 2) / 10_000)
    # what overlaps is built on once
    assert found.density == pytest.approx((300 + 600) / 10_000)
    assert (found.residence_pct, found.facility_pct) == (pytest.approx(3.0), pytest.approx(6.0))
    # streets, paths and greens count inside the zone
    assert found.street_pct == pytest.approx(10.0)
    assert found.path_pct == pytest.approx(100 * 18 * 3 / 10_000)
    assert found.parking_pct == pytest.approx(1.0)
    assert found.green == pytest.approx((1000 + 100) / 10_000)
    assert (found.buildings, found.dwellings, found.parking_places) == (3, 10, 8)
    assert found.parking_per_dwelling == pytest.approx(0.8)
    assert (found.mean_sun, found.least_sun, found.shaded) == (3.0, 2.0, 1)
    assert (found.mean_way, found.longest_way) == (20.0, 30.0)
    assert found.as_dict()["dwellings_ha"] == pytest.approx(10.0)


def test_layers_that_are_not_there_count_as_nothing():
    found = zone_figures(drawn())
    assert (found.green, found.path_pct, found.parking_pct, found.parking_places) == (0, 0, 0, 0)


def test_buildings_without_some_fields_are_measured_all_the_same():
    layers = drawn()
    layers["buildings"] = layers["buildings"][["use", "geometry"]]
    found = zone_figures(layers)
    assert found.density == pytest.approx(0.09)
    assert found.far == pytest.approx(0.1)
    assert math.isnan(found.mean_sun)


def test_degrees_are_measured_in_metres():
    layers = {name: layer.to_crs(4326) for name, layer in drawn().items()}
    assert zone_figures(layers).zone_ha == pytest.approx(1.0, rel=1e-3)


def test_invalid_outlines_are_made_valid():
    layers = drawn()
    bow = [(X, Y), (X + 20, Y + 20), (X + 20, Y), (X, Y + 20)]
    layers["green"] = gpd.GeoDataFrame(geometry=[Polygon(bow)], crs=UTM)
    assert zone_figures(layers).green == pytest.approx(200 / 10_000)


@pytest.mark.parametrize("name", ["zone", "buildings"])
def test_a_missing_layer_is_named(name):
    layers = drawn()
    del layers[name]
    with pytest.raises(InputError, match=name):
        zone_figures(layers)


def test_an_empty_layer_of_zones_is_refused():
    layers = drawn()
    layers["zone"] = layers["zone"].iloc[:0]
    with pytest.raises(InputError, match="no zone"):
        zone_figures(layers)


def test_what_has_no_outline_has_no_area():
    layers = drawn()
    layers["buildings"].loc[2, "geometry"] = None
    found = zone_figures(layers)
    assert found.far == pytest.approx((200 * 5 + 200 * 5) / 10_000)
    assert found.facility_pct == 0.0


def test_buildings_without_a_use_or_a_crs_are_refused():
    layers = drawn()
    with pytest.raises(InputError, match="use") as caught:
        zone_figures({**layers, "buildings": layers["buildings"].drop(columns="use")})
    assert caught.value.layer == "buildings"
    bare = layers["buildings"].set_crs(None, allow_override=True)
    with pytest.raises(InputError, match="CRS") as caught:
        zone_figures({**layers, "buildings": bare})
    assert caught.value.layer == "buildings"
