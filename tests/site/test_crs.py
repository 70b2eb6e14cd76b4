import geopandas as gpd
import numpy as np
import pytest
from platwright.errors import InputError
from platwright.site.crs import distortion, is_metric, layer_crs, working_crs
from pyproj import CRS


def test_missing_crs_names_layer_and_way_out():
    with pytest.raises(InputError, match=r"Layer 'parcels'.*Set Layer CRS"):
        layer_crs(gpd.GeoDataFrame(geometry=[]), "parcels")


def test_height_part_of_a_compound_crs_is_left_off():
    frame = gpd.GeoDataFrame(geometry=[], crs="EPSG:25832+7837")
    assert layer_crs(frame, "x").to_epsg() == 25832


@pytest.mark.parametrize(
    ("code", "metric"), [(25832, True), (2263, False), (4326, False), (3857, True)]
)
def test_metric(code, metric):
    assert is_metric(CRS.from_epsg(code)) is metric


def test_distortion_on_the_central_meridian_of_utm():
    # k0 = 0.9996 on the central meridian, x = 500 km
    bounds = np.array([499_900.0, 5_400_000.0, 500_100.0, 5_400_200.0])
    assert distortion(CRS.from_epsg(25832), bounds) == pytest.approx(4e-4, rel=1e-3)


def test_web_mercator_in_prague_is_one_and_a_half_times_too_long():
    bounds = np.array([1_600_000.0, 6_460_000.0, 1_600_100.0, 6_460_100.0])
    assert distortion(CRS.from_epsg(3857), bounds) == pytest.approx(0.56, abs=0.01)


@pytest.mark.parametrize(
    ("code", "bounds", "expected"),
    [
        (25832, (500_000, 5_400_000, 500_200, 5_400_100), 25832),
        (4326, (9.5, 47.1, 9.51, 47.11), 32632),
        (4326, (-70.66, -33.45, -70.65, -33.44), 32719),
        (3857, (1_600_000, 6_460_000, 1_600_100, 6_460_100), 32633),
        (2263, (1_000_000, 200_000, 1_001_000, 201_000), 32618),
    ],
)
def test_working_crs(code, bounds, expected):
    crs = working_crs(CRS.from_epsg(code), np.array(bounds, dtype=float), "x")
    assert crs.to_epsg() == expected


def test_local_projection_where_no_zone_is_true():
    # the edge of a UTM zone at the equator: scale 1.00098 is accepted, at the pole there is none
    crs = working_crs(CRS.from_epsg(4326), np.array([10.0, 85.0, 10.1, 85.01]), "x")
    assert crs.coordinate_operation.method_name == "Transverse Mercator"
    assert is_metric(crs)


def test_coordinates_that_do_not_fit_the_crs_are_refused():
    with pytest.raises(InputError, match="do not fit the layer's CRS"):
        working_crs(CRS.from_epsg(4326), np.array([5e5, 5.4e6, 5.1e5, 5.5e6]), "x")
