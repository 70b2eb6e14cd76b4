"""Layers of QuickOSM and of GDAL's OSM driver as existing roads and obstacles."""

from __future__ import annotations

import geopandas as gpd
import pytest
import shapely
from platwright.site import prepare_sites
from platwright.site.osmlines import hstore, in_tunnel, is_osm, no_street

#: Metres around a place of its own, so that the scale is true.
CRS = "+proj=tmerc +lat_0=47 +lon_0=9 +datum=WGS84 +units=m +type=crs"
SITE = gpd.GeoDataFrame(geometry=[shapely.box(0, 0, 200, 100)], crs=CRS)
#: A street along the south edge, a stream along the north, a track west, a tunnel east.
LINES = [
    shapely.LineString([(-50, -5), (250, -5)]),
    shapely.LineString([(-50, 105), (250, 105)]),
    shapely.LineString([(-5, -50), (-5, 150)]),
    shapely.LineString([(205, -50), (205, 150)]),
]


class Heard:
    def __init__(self) -> None:
        self.said: list[str] = []

    def stage(self, text, fraction): ...

    def search(self, state): ...

    def info(self, text):
        self.said.append(text)

    def warn(self, text):
        self.said.append(text)

    def cancelled(self):
        return False


def gdal() -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(
        {
            "osm_id": ["1", "2", "3", "4"],
            "name": ["South Street", "Brook", None, "Under"],
            "highway": ["residential", None, None, "residential"],
            "waterway": [None, "stream", None, None],
            "railway": [None, None, "rail", None],
            "z_order": [3, 0, 0, -7],
            "other_tags": ['"maxspeed"=>"30"', None, None, '"layer"=>"-1","tunnel"=>"yes"'],
        },
        geometry=LINES,
        crs=CRS,
    )


def quickosm() -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(
        {
            "full_id": ["w1", "w2", "w3", "w4"],
            "osm_id": ["1", "2", "3", "4"],
            "osm_type": ["way"] * 4,
            "highway": ["residential", "", "", "residential"],
            "waterway": ["", "stream", "", ""],
            "railway": ["", "", "rail", ""],
            "tunnel": [None, None, None, "yes"],
            "name": ["South Street", "Brook", None, "Under"],
        },
        geometry=LINES,
        crs=CRS,
    )


@pytest.mark.parametrize("roads", [gdal(), quickosm()], ids=["gdal", "quickosm"])
@pytest.mark.parametrize("crs", [CRS, "EPSG:4326"])
def test_only_streets_become_boundary_streets(roads, crs):
    heard = Heard()
    found = prepare_sites(SITE, roads.to_crs(crs), progress=heard).sites[0]
    assert {street.name for street in found.boundary_streets} == {"South Street"}
    assert {street.kind for street in found.boundary_streets} == {"residential"}
    assert any("2 lines of OpenStreetMap that are no streets" in text for text in heard.said)
    assert any("1 tunnels are not counted" in text for text in heard.said)


def test_a_square_drawn_as_an_area_is_no_street():
    roads = gdal()
    roads["other_tags"] = ['"area"=>"yes"', None, None, None]
    assert no_street(roads).tolist() == [True, True, True, False]
    assert not in_tunnel(roads).any()


@pytest.mark.parametrize("kind", ["proposed", "abandoned", "razed", "planned", "services", "no"])
def test_what_is_not_built_or_gone_is_no_street(kind):
    roads = quickosm()
    roads.loc[0, "highway"] = kind
    assert not {s.name for s in prepare_sites(SITE, roads).sites[0].boundary_streets}


def test_layers_of_others_are_left_alone():
    """A road layer with classes but without OpenStreetMap's ids keeps roads without a class."""
    plain = gdal()[["name", "highway", "geometry"]]
    assert not is_osm(plain)
    found = prepare_sites(SITE, plain).sites[0]
    assert {street.name for street in found.boundary_streets} == {
        "South Street", "Brook", "", "Under",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "tags"),
    [
        ('"a"=>"b"', {"a": "b"}),
        ('"a"=>"b","c"=>"d, e"', {"a": "b", "c": "d, e"}),
        (r'"a"=>"say \"no\""', {"a": 'say "no"'}),
        ('"a"=>"x=>y"', {"a": "x=>y"}),
        ("", {}),
        ("nonsense", {}),
        (None, {}),
        (float("nan"), {}),
    ],
)
def test_hstore(text, tags):
    assert hstore(text) == tags


def test_areas_of_gdal_as_obstacles():
    areas = gpd.GeoDataFrame(
        {
            "osm_id": [None, "7"],
            "osm_way_id": ["5", None],
            "natural": ["water", None],
            "leisure": [None, "park"],
            "other_tags": ['"water"=>"pond"', None],
        },
        geometry=[
            shapely.box(20, 20, 60, 60),
            shapely.MultiPolygon([shapely.box(100, 20, 140, 60), shapely.box(150, 20, 190, 60)]),
        ],
        crs=CRS,
    )
    found = prepare_sites(SITE, quickosm(), areas.to_crs(4326)).sites[0]
    assert len(found.obstacles) == 3
    assert sum(o.area for o in found.obstacles) == pytest.approx(3 * 1600, rel=1e-3)


def test_lines_of_gdal_itself(root):
    """The shipped extract through GDAL's driver: no stream and no footway along the site."""
    pyogrio = pytest.importorskip("pyogrio")
    path = root / "data" / "osm" / "monaco.osm.pbf"
    if "OSM" not in pyogrio.list_drivers():
        pytest.skip("this GDAL reads no OpenStreetMap files")
    lines = pyogrio.read_dataframe(path, layer="lines")
    areas = pyogrio.read_dataframe(path, layer="multipolygons", on_invalid="ignore")
    site = areas[areas["osm_way_id"] == "686693023"]
    found = prepare_sites(site, lines, areas[areas["natural"] == "water"]).sites[0]
    assert is_osm(lines)
    kinds = {street.kind for street in found.boundary_streets}
    assert kinds
    assert "" not in kinds
    assert found.access_points
