"""Real and broken layers of the test data folder; skipped where it is absent."""

import warnings

import geopandas as gpd
import pytest
import shapely
from platwright.errors import InputError
from platwright.site import prepare_sites, site_layers


def read(path, layer=None):
    if not path.exists() and ".zip/" not in str(path):
        pytest.skip(f"{path.name} is absent")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # M is dropped by the reader
        name = f"/vsizip/{path}" if ".zip" in str(path) else path
        return gpd.read_file(name, layer=layer)


def check(prepared, polygons, *rest):
    """Hold what every prepared layer must keep, and give its actions."""
    for site in prepared.sites:
        assert site.polygon.is_valid
        assert site.polygon.exterior.is_ccw
        assert not site.polygon.has_z
    for k, a in enumerate(prepared.sites[:50]):
        assert all(a.polygon.intersection(b.polygon).area < 1e-6 for b in prepared.sites[:k])
    layers = site_layers(prepared)
    assert all(layer.crs == polygons.crs for layer in layers.values())
    again = prepare_sites(layers["site"], *rest)
    assert len(again.sites) == len(prepared.sites)
    pairs = zip(prepared.sites, again.sites)
    assert all(a.polygon.equals_exact(b.polygon, 1e-9) for a, b in pairs)
    return set(prepared.problems["action"])


BAD = [
    ("cambridge_invalid_parcels", "parcels", 23, "made valid"),
    ("cambridge_multipart_parcels", "parcels", 7, "split into its parts"),
    ("cambridge_slivers", "slivers_and_neighbours", 39, "closed"),
    ("derived_bowtie_spike", "site", 1, "made valid"),
    ("derived_empty_null_zeroarea", "site", 1, "skipped"),
    ("derived_near_duplicate_vertices", "site", 1, "removed"),
    ("flanders_parcels_one_empty", "parcels", 20, "skipped"),
    ("fr_zoning_z_one_empty", "zoning2", 1, "heights dropped"),
    ("curvepolygon", "curvepolygon", 1, None),
    ("derived_far_crs", "site_zone_prefixed_easting", 1, None),
    ("derived_far_crs", "plots_negative_krovak", 33, "filled"),
]


@pytest.mark.parametrize(("file", "layer", "sites", "action"), BAD)
def test_bad_polygons(shared_data, file, layer, sites, action):
    polygons = read(shared_data / "bad" / f"{file}.gpkg", layer)
    prepared = prepare_sites(polygons)
    actions = check(prepared, polygons)
    assert len(prepared.sites) == sites
    if action is not None:
        assert action in actions


def test_bad_buildings_keep_their_area(shared_data):
    polygons = read(shared_data / "bad" / "flanders_invalid_buildings.gpkg")
    prepared = prepare_sites(polygons)
    assert "made valid" in check(prepared, polygons)
    true = shapely.union_all(shapely.make_valid(polygons.geometry.to_numpy())).area
    assert sum(s.polygon.area for s in prepared.sites) == pytest.approx(true, rel=0.01)


def test_empty_null_and_flat_are_each_named(shared_data):
    polygons = read(shared_data / "bad" / "derived_empty_null_zeroarea.gpkg")
    problems = prepare_sites(polygons).problems
    skipped = problems[problems["action"] == "skipped"]
    assert skipped["feature"].tolist() == ["1", "2", "3"]
    assert (skipped["severity"] == "error").all()


@pytest.mark.parametrize("layer", ["streets_metres", "streets_us_feet"])
def test_site_in_degrees_streets_in_metres_or_feet(shared_data, layer):
    path = shared_data / "bad" / "derived_mixed_crs.gpkg"
    polygons, streets = read(path, "site_degrees"), read(path, layer)
    prepared = prepare_sites(polygons, streets)
    check(prepared, polygons, streets)
    (site,) = prepared.sites
    assert site.area_ha == pytest.approx(10.97, abs=0.02)
    assert site.street_frontage.length == pytest.approx(1305, abs=15)
    assert len(site.access_points) == 7


@pytest.mark.parametrize("layer", ["streets_zm", "streets_m"])
def test_measured_and_raised_streets(shared_data, layer):
    polygons = read(shared_data / "sites" / "01_rect_brownfield_baltimore.gpkg", "site")
    streets = read(shared_data / "bad" / "derived_m_zm_streets.gpkg", layer)
    (site,) = prepare_sites(polygons, streets).sites
    assert not any(s.line.has_z for s in site.boundary_streets)
    assert site.street_frontage.length == pytest.approx(268, abs=10)


def test_network_in_pieces(shared_data):
    streets = read(shared_data / "bad" / "momepy_tests_broken_networks.gpkg", "broken_network")
    hull = streets.union_all().convex_hull.buffer(-100)
    polygons = gpd.GeoDataFrame(geometry=[hull], crs=streets.crs)
    prepared = prepare_sites(polygons, streets, inner_roads="keep")
    assert prepared.sites[0].polygon.area == pytest.approx(hull.area, rel=1e-3)
    assert len(prepared.sites[0].inner_streets) > 20


def test_degrees_and_the_wrong_half_of_the_world(shared_data):
    path = shared_data / "bad" / "cea_zug_mixed_crs.zip"
    if not path.exists():
        pytest.skip("cea_zug_mixed_crs.zip is absent")
    site, streets, zone = (read(path / f"{n}.shp") for n in ("site", "streets", "zone"))
    prepared = prepare_sites(site, streets, zone)
    assert prepared.sites[0].crs.to_epsg() == 32632
    assert prepared.sites[0].area_ha == pytest.approx(4.18, abs=0.02)
    assert len(prepared.sites[0].access_points) >= 2
    assert len(prepared.sites[0].obstacles) > 0


def test_missing_prj(shared_data):
    polygons = read(shared_data / "bad" / "zone_urba_no_prj.zip")
    with pytest.raises(InputError, match="Layer 'ZONE_URBA': has no coordinate reference system"):
        prepare_sites(polygons, polygon_layer="ZONE_URBA")


@pytest.mark.parametrize(
    ("file", "layer", "sites"),
    [
        ("cambridge_ma_cambridgeport_grid", "parcels", 114),
        ("fr_25267_plan", "parcels", 25),
        ("bubenec_prague", "plots", 33),
    ],
)
def test_cadastres_dissolve_into_blocks(shared_data, file, layer, sites):
    polygons = read(shared_data / "parcels" / f"{file}.gpkg", layer)
    prepared = prepare_sites(polygons)
    check(prepared, polygons)
    assert len(prepared.sites) == pytest.approx(sites, abs=3)


# share of the boundary that is frontage and number of access points, judged on pictures
SITES = {
    "01_rect_brownfield_baltimore": (0.97, 7),
    "02_organic_triesen_li": (1.0, 5),
    "03_holes_ponds_li": (0.60, 2),
    "04_long_thin_railside_cambridge": (0.97, 11),
    "05_concave_notched_cambridge": (0.94, 8),
    "06_crescent_cambridge": (0.93, 8),
    "07_l_shape_rail_cambridge": (0.98, 17),
    "08_railyard_locust_point_1km": (0.55, 8),
    "09_rail_lands_alewife_1km": (0.945, 16),
    "10_future_zone_au2_fr25267": (0.52, 6),
    "11_park_notch_baltimore": (0.83, 12),
    "12_hole_baths_li": (0.67, 14),
}


@pytest.mark.parametrize("name", sorted(SITES))
def test_real_sites(shared_data, name):
    path = shared_data / "sites" / f"{name}.gpkg"
    polygons, streets = read(path, "site"), read(path, "streets")
    prepared = prepare_sites(polygons, streets, inner_roads="keep")
    check(prepared, polygons, streets)
    (site,) = prepared.sites
    share, points = SITES[name]
    assert site.street_frontage.length / site.polygon.length == pytest.approx(share, abs=0.03)
    assert abs(len(site.access_points) - points) <= 2
    assert site.area_ha == pytest.approx(float(polygons["area_ha"].iloc[0]), rel=0.005)
    away = [site.polygon.boundary.distance(s.line) for s in site.boundary_streets]
    assert max(away) <= site.snap_distance
