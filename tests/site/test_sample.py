"""The sample site that is shipped with the project."""

import geopandas as gpd
import pytest
from platwright.site import access_points_from_layer, prepare_sites, site_layers


@pytest.fixture(scope="module")
def sample(root):
    path = root / "data" / "helsinki" / "helsinki_yard.gpkg"
    return {name: gpd.read_file(path, layer=name) for name in ("site", "streets", "obstacles")}


@pytest.fixture(scope="module")
def prepared(sample):
    return prepare_sites(sample["site"], sample["streets"], sample["obstacles"])


def test_small_and_with_its_notice(root):
    folder = root / "data" / "helsinki"
    assert (folder / "helsinki_yard.gpkg").stat().st_size < 500_000
    notice = (folder / "NOTICE.md").read_text(encoding="utf-8")
    assert "OpenStreetMap contributors" in notice
    assert "ODbL" in notice


def test_layers(sample):
    assert {layer.crs.to_epsg() for layer in sample.values()} == {3067}
    assert sample["site"].geometry.is_valid.all()
    assert sample["site"].area.sum() == pytest.approx(114_268, rel=0.005)  # way 25542370
    assert "Helsingin päärautatieasema" in set(sample["obstacles"]["name"])
    assert {"station", "building", "park"} <= set(sample["obstacles"]["kind"])


def test_site(prepared):
    (site,) = prepared.sites
    assert site.name == "Helsinki rail yard"
    assert site.crs.to_epsg() == 3067
    # the lake side and the backs of the houses in the west are no streets
    assert 0.35 < site.street_frontage.length / site.polygon.length < 0.65
    names = {s.name for s in site.boundary_streets}
    assert "Kaisaniemen puistokuja" in names
    assert 2 <= len(site.access_points) <= 6


def test_station_stays(prepared):
    (site,) = prepared.sites
    assert site.obstacle_union.area == pytest.approx(16_000, rel=0.1)
    assert all(site.polygon.buffer(0.01).contains(o) for o in site.obstacles)


def test_no_access_point_leads_into_the_station(prepared):
    (site,) = prepared.sites
    from shapely.geometry import Point

    for point in site.access_points:
        (x, y), (dx, dy) = point.xy, point.direction
        assert not site.obstacle_union.contains(Point(x + 15 * dx, y + 15 * dy))


def test_access_points_go_round(prepared):
    (site,) = prepared.sites
    layer = site_layers(prepared)["access_points"]
    back = access_points_from_layer(layer, site)
    assert [p.name for p in back] == [p.name for p in site.access_points]
    for a, b in zip(back, site.access_points):
        assert a.xy == pytest.approx(b.xy, abs=1e-6)
        assert a.direction == pytest.approx(b.direction, abs=1e-6)


def test_prepared_again_is_the_same(prepared, sample):
    again = prepare_sites(site_layers(prepared)["site"], sample["streets"], sample["obstacles"])
    assert again.sites[0].polygon.equals_exact(prepared.sites[0].polygon, 0)
    assert again.sites[0].access_points == prepared.sites[0].access_points
