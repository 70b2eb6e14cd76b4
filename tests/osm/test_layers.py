"""Streets, intersections, buildings, land use and obstacles around a polygon."""

from __future__ import annotations

import time

import geopandas as gpd
import numpy as np
import pytest
import shapely
from clock import allowed
from platwright.errors import CancelledError, InputError, ServiceError
from platwright.osm import files, ground, osm_layers
from platwright.osm.classes import COLUMNS
from platwright.osm.layers import LAYERS, with_enclosing
from platwright.osm.sea import sea
from platwright.progress import Silent

pytest.importorskip("osmnx")

UTM = "EPSG:32632"
#: A degree of latitude and of longitude at 50° north, metres.
LAT, LON = 111_200.0, 71_700.0


@pytest.fixture(scope="module")
def site(extract):
    """The land reclamation L'Anse du Portier."""
    found = files.read_boundaries(extract).set_index("osm_id")
    return found.geometry["W686693023"]


class Town:
    """Writes small .osm files; places are metres east and north of 7° east, 50° north."""

    def __init__(self) -> None:
        self.nodes: list[str] = []
        self.ways: list[str] = []
        self.places: dict[tuple[float, float], int] = {}

    def node(self, x: float, y: float) -> int:
        if (x, y) not in self.places:
            self.places[x, y] = number = len(self.places) + 1
            self.nodes.append(f'<node id="{number}" lon="{7 + x / LON}" lat="{50 + y / LAT}"/>')
        return self.places[x, y]

    def way(self, points: list[tuple[float, float]], **tags: str) -> Town:
        refs = "".join(f'<nd ref="{self.node(*p)}"/>' for p in points)
        words = "".join(f'<tag k="{k.replace("__", ":")}" v="{v}"/>' for k, v in tags.items())
        self.ways.append(f'<way id="{len(self.ways) + 1}">{refs}{words}</way>')
        return self

    def box(self, x: float, y: float, wide: float, high: float, **tags: str) -> Town:
        a, b = x + wide, y + high
        return self.way([(x, y), (a, y), (a, b), (x, b), (x, y)], **tags)

    def write(self, path):
        path.write_text(f'<osm version="0.6">{"".join(self.nodes)}{"".join(self.ways)}</osm>')
        return path


def square(x: float, y: float, width: float, height: float) -> shapely.Polygon:
    return shapely.box(7 + x / LON, 50 + y / LAT, 7 + (x + width) / LON, 50 + (y + height) / LAT)


SITE = square(0, 0, 200, 200)


@pytest.fixture
def cross(tmp_path):
    """Two streets that cross in the middle of the site, the southern arm of two ways."""
    town = Town()
    town.way([(-400, 100), (100, 100), (600, 100)], highway="secondary", name="High Street",
             maxspeed="30 mph", lanes="2;3")  # fmt: skip
    town.way([(100, 100), (100, 600)], highway="residential", oneway="yes")
    town.way([(100, 100), (100, 50)], highway="residential", name="Mill Lane")
    town.way([(100, 50), (100, -600)], highway="residential", name="Mill Lane")
    town.way([], highway="residential", name="Nowhere")
    return town.write(tmp_path / "cross.osm")


def test_streets_and_their_fields(cross):
    found = osm_layers(SITE, source=cross, reach=80)
    streets = found["streets"].set_index("osm_id")
    assert list(found) == list(LAYERS)
    assert len(streets) == 4, "from the junction to each side"
    assert list(streets.columns) == [
        "highway", "level", "speed_kmh", "lanes", "oneway", "name", "length_m", "bridge", "tunnel",
        "geometry",
    ]  # fmt: skip
    high = streets.loc["W1"].iloc[0]
    assert (high["highway"], high["level"], high["name"]) == ("secondary", 2, "High Street")
    assert (high["speed_kmh"], high["lanes"], high["oneway"]) == (48, 2, False)
    # Half the site and the reach: 100 + 80 m, to the accuracy of the degrees above.
    assert streets["length_m"].to_numpy() == pytest.approx(180, abs=1)
    mill = streets.loc["W3;W4"]
    assert (mill["level"], mill["name"]) == (3, "Mill Lane"), "two ways are one street"
    up = streets.loc["W2"]
    assert up["oneway"]
    assert up["geometry"].coords[0][1] < up["geometry"].coords[-1][1], "as the traffic goes"
    points = found["intersections"]
    assert points[["osm_id", "street_count", "kind"]].to_numpy().tolist() == [["N2", 4, "junction"]]


@pytest.mark.parametrize("reach", [0.0, 40.0, 400.0])
def test_layers_reach_as_far_as_asked(cross, reach):
    streets = osm_layers(SITE, source=cross, reach=reach)["streets"]
    assert streets["length_m"].to_numpy() == pytest.approx(100 + reach, abs=1.5)


def test_networks_differ(tmp_path):
    town = Town()
    kinds = ["residential", "footway", "cycleway", "motorway", "service", "construction"]
    for k, kind in enumerate(kinds):
        town.way([(-300, 30 * k), (500, 30 * k)], highway=kind)
    path = town.write(tmp_path / "a.osm")
    found = {
        network: set(osm_layers(SITE, network_type=network, source=path)["streets"]["highway"])
        for network in ("drive", "walk", "bike", "all")
    }
    assert found["drive"] == {"residential", "motorway"}
    assert found["walk"] == {"residential", "footway", "service"}
    assert found["bike"] == {"residential", "cycleway", "service"}
    assert found["all"] == set(kinds) - {"construction"}


def test_tunnels_and_bridges_are_streets_of_their_own(tmp_path):
    town = Town()
    town.way([(-300, 100), (50, 100)], highway="primary")
    town.way([(50, 100), (100, 100)], highway="primary", tunnel="yes", layer="-1")
    town.way([(100, 100), (500, 100)], highway="primary", bridge="viaduct")
    found = osm_layers(SITE, source=town.write(tmp_path / "a.osm"))
    streets = found["streets"].set_index("osm_id")
    assert streets["tunnel"].to_dict() == {"W1": None, "W2": "yes", "W3": None}
    assert streets["bridge"].to_dict() == {"W1": None, "W2": None, "W3": "viaduct"}
    assert len(found["intersections"]) == 0, "where a tunnel begins is no intersection"


def test_buildings_land_use_and_obstacles(tmp_path):
    town = Town()
    town.box(10, 10, 20, 10, building="house", height="12 m", building__levels="3")
    town.box(50, 10, 20, 10, building="yes", building__levels="4", name="Town hall")
    town.box(90, 10, 20, 10, building="roof")
    town.box(150, 150, 20, 20, building="yes", layer="-1")
    town.box(-500, -500, 2000, 2000, landuse="residential")
    town.box(100, 100, 50, 50, leisure="park", name="Green")
    town.box(100, 160, 4, 4, leisure="playground")
    town.way([(-300, 80), (500, 80)], railway="rail", service="yard")
    town.way([(-300, 60), (500, 60)], waterway="river", tunnel="culvert")
    town.way([(-300, 190), (500, 190)], highway="motorway")
    found = osm_layers(SITE, source=town.write(tmp_path / "a.osm"), reach=50)

    buildings = found["buildings"].set_index("osm_id")
    assert list(buildings.index) == ["W1", "W2"], "neither roofs nor what is below ground"
    assert buildings["height_m"].tolist() == [12, 12]
    assert buildings["height_from"].tolist() == ["height", "levels"]
    assert buildings["levels"].tolist() == [3, 4]

    use = found["landuse"]
    assert use[["theme", "kind"]].to_numpy().tolist() == [
        ["housing", "residential"], ["green", "park"], ["green", "playground"],
    ]  # fmt: skip
    # Cut to the site and 50 m around it, with round corners.
    area = use.to_crs(UTM).area
    assert area[0] == pytest.approx(200**2 + 4 * 50 * 200 + np.pi * 50**2, rel=0.01)

    bars = found["obstacles"].set_index("kind")
    assert sorted(bars.index) == ["green", "motorway", "rail"], "no culvert, nothing tiny"
    assert bars["name"]["green"] == "Green"
    area = bars.to_crs(UTM).area
    assert area["green"] == pytest.approx(2500, rel=0.01)
    assert area["rail"] == pytest.approx(8 * 300, rel=0.01), "a track is 8 m wide"
    assert area["motorway"] == pytest.approx(20 * 300, rel=0.02)
    assert set(bars.geom_type) <= {"Polygon", "MultiPolygon"}


def test_an_obstacle_that_is_the_site_is_told(tmp_path, listener):
    town = Town().box(-50, -50, 300, 300, leisure="park", name="Common")
    osm_layers(SITE, source=town.write(tmp_path / "a.osm"), progress=listener)
    assert any("green cover 100 % of the polygon" in text for text in listener.warnings)
    assert any("no streets for 'drive'" in text for text in listener.warnings)


def test_the_shipped_extract(extract, site, listener):
    found = osm_layers(site, source=extract, progress=listener)
    assert {name: len(frame) > 5 for name, frame in found.items()} == dict.fromkeys(LAYERS, True)
    reach = gpd.GeoSeries([site], crs=4326).to_crs(UTM).buffer(80.5).iloc[0]
    for name, frame in found.items():
        assert frame.crs.to_epsg() == 4326
        assert frame.is_valid.all(), name
        assert not frame.geometry.is_empty.any()
        assert frame["osm_id"].dropna().str.fullmatch(r"[NWR]\d+(;[NWR]\d+)*").all()
        assert frame.attrs["osm"]["attribution"] == "© OpenStreetMap contributors"
        assert frame.attrs["osm"]["date"] == "2023-12-26"
        assert frame.attrs["osm"]["source"] == "monaco.osm.pbf"
        near = frame.to_crs(UTM)
        assert (near.within(reach) if name != "buildings" else near.intersects(reach)).all(), name
    assert set(found["streets"]["level"]) == {1, 2, 3}
    assert {"sea", "green", "water"} == set(found["obstacles"]["kind"])
    land = found["obstacles"].query("kind == 'sea'").geometry.iloc[0]
    # The harbour basin is drawn into the way of the site; the rest of the site is land.
    assert shapely.intersection(land, site).area < 0.1 * site.area
    assert listener.stages[0] == "Reading monaco.osm.pbf"


@pytest.mark.parametrize("network", ["drive", pytest.param("walk", marks=pytest.mark.slow)])
def test_the_server_gives_the_same_as_the_file(extract, site, settings, network):
    online = osm_layers(site, network_type=network, settings=settings(timeout=20.0))
    local = osm_layers(site, network_type=network, source=extract)
    for name in LAYERS:
        a, b = (frame.set_index("osm_id").sort_index() for frame in (online[name], local[name]))
        assert len(a) > 5
        assert list(a.columns) == list(b.columns)
        assert a.index.equals(b.index), name
        ours = shapely.union_all(a.geometry.to_numpy())
        theirs = shapely.union_all(b.geometry.to_numpy())
        assert shapely.symmetric_difference(ours, theirs).length < 1e-6
        assert online[name].attrs["osm"]["date"] == "2023-12-26"


def test_areas_in_whose_midst_the_polygon_lies():
    """Overpass gives them only where it is asked which areas contain a point."""

    class Asked:
        def __init__(self) -> None:
            self.queries = []

        def overpass(self, query):
            self.queries.append(query)
            tags = [{"leisure": "park", "name": "Common"}, {"landuse": "forest"}, {"amenity": "x"}]
            kinds = ["relation", "way", "way"]
            elements = [
                {"type": kind, "id": k, "tags": own}
                for k, (kind, own) in enumerate(zip(kinds, tags))
            ]
            return {"elements": elements}

    asked = Asked()
    columns = {"osm_id": ["W1"], **{key: [None] for key in COLUMNS}, "landuse": ["forest"]}
    known = gpd.GeoDataFrame(columns, geometry=[square(0, 0, 50, 50)], crs=4326)
    for before in (known, known.iloc[:0]):
        found = with_enclosing(before, SITE, asked).set_index("osm_id")
        assert found.geometry["R0"] == SITE
        assert found["name"]["R0"] == "Common"
        assert sorted(found.index) == ["R0", "W1"]
    assert found.geometry["W1"] == SITE, "not found before, so it encloses the site"
    assert "is_in(50.0008" in asked.queries[0]
    two = shapely.union_all([SITE, square(900, 0, 50, 50)])
    assert len(with_enclosing(known, two, asked)) == 3


@pytest.mark.parametrize(
    ("broken", "text"),
    [("html", "web page"), ("504", "too busy"), ("truncated", "broke off"), ("hang", "no answer")],
)
def test_a_broken_server_is_a_sentence(site, settings, broken, text):
    with pytest.raises(ServiceError, match=text):
        osm_layers(site, settings=settings(broken, timeout=0.6 if broken == "hang" else 1.5))


def test_nothing_there(settings, extract, tmp_path):
    ocean = shapely.box(-30.0, 10.0, -29.999, 10.001)
    with pytest.raises(InputError, match="OpenStreetMap has nothing in the polygon"):
        osm_layers(ocean, settings=settings())
    with pytest.raises(InputError, match=r"monaco\.osm\.pbf has nothing inside the polygon"):
        osm_layers(ocean, source=extract)
    (tmp_path / "a.osm").write_text('<osm version="0.6"></osm>')
    with pytest.raises(InputError, match="neither streets nor areas"):
        osm_layers(SITE, source=tmp_path / "a.osm")


def test_a_file_in_the_wrong_order(tmp_path):
    way = '<way id="3"><nd ref="1"/><nd ref="2"/><tag k="highway" v="residential"/></way>'
    nodes = '<node id="1" lat="50" lon="7"/><node id="2" lat="50.001" lon="7"/>'
    (tmp_path / "a.osm").write_text(f'<osm version="0.6">{way}{nodes}</osm>')
    with pytest.raises(InputError, match="osmium sort"):
        osm_layers(SITE, source=tmp_path / "a.osm")


def test_a_way_that_the_file_has_in_part(tmp_path):
    """As at the edge of an extract: the stretch that is there counts."""
    path = (
        Town()
        .way([(-300, 100), (100, 100), (500, 100)], highway="residential")
        .write(tmp_path / "a.osm")
    )
    path.write_text(path.read_text().replace('<nd ref="3"/>', '<nd ref="99"/>'))
    streets = osm_layers(SITE, source=path, reach=0)["streets"]
    assert streets["length_m"].tolist() == [pytest.approx(100, abs=1)]


def jagged(middle: tuple[float, float], radius: float, points: int) -> shapely.Polygon:
    """An outline as of a town: many points, none of them in line; radius in degrees."""
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    away = radius * (1 + 0.05 * np.random.default_rng(1).standard_normal(points))
    return shapely.Polygon(np.c_[away * np.cos(angle), away * np.sin(angle)] + middle)


def test_however_many_points_the_polygon_has_the_question_is_short(settings, server, extract):
    """Overpass takes no question of more than a megabyte; osmnx writes the outline 180 times."""
    town = jagged((7.4325, 43.7415), 0.003, 3000)
    before = len(server.log)
    online = osm_layers(town, settings=settings(timeout=20.0), reach=10.0)
    sizes = [int(headers["Content-Length"]) for _, headers in server.log[before:]]
    assert max(sizes) < 250_000
    local = osm_layers(town, source=extract, reach=10.0)
    for name in LAYERS:
        assert len(online[name]) > 5
        assert sorted(online[name]["osm_id"].dropna()) == sorted(local[name]["osm_id"].dropna())


@pytest.mark.parametrize("points", [4, 50, 3000])
@pytest.mark.parametrize("radius", [0.0005, 0.05])
def test_the_outline_that_is_asked_for_holds_the_polygon(points, radius):
    polygon = ground.check_polygon(jagged((14.4, 50.0), radius, points), Silent())
    crs = ground.local_crs(polygon)
    outline = ground.outline(polygon, crs)
    assert shapely.covers(outline, polygon)
    assert shapely.get_num_coordinates(outline) <= ground.MOST_CORNERS
    assert outline.area < 1.5 * polygon.area
    two = shapely.union_all([polygon, shapely.affinity.translate(polygon, 5 * radius)])
    hull = ground.outline(two, crs)
    assert hull.geom_type == "Polygon", "osmnx asks for all ground between, too"
    assert shapely.covers(hull, two)


def test_next_to_the_180th_meridian(settings, cross, server):
    """What lies around the polygon would be beyond it, on the other side of the map."""
    taveuni = shapely.box(179.990, -16.80, 179.9995, -16.79)
    before = len(server.log)
    for given in ({"settings": settings()}, {"source": cross}):
        with pytest.raises(InputError, match="antimeridian"):
            osm_layers(taveuni, **given)
    # Far enough for the layers, but not for what osmnx asks for.
    close = shapely.box(179.980, -16.80, 179.9945, -16.79)
    with pytest.raises(InputError, match="antimeridian"):
        osm_layers(close, settings=settings())
    assert len(server.log) == before


WRONG = {
    "empty": (shapely.Polygon(), "is empty"),
    "a line": (shapely.Polygon([(7, 50), (7.001, 50), (7, 50)]), "has no area"),
    "a country": (shapely.box(6, 47, 10, 50), "at most 1,000 km2"),
    "across the meridian": (shapely.box(-179.999, 0, 179.999, 0.01), "antimeridian"),
    "beyond the meridian": (shapely.box(179.99, 0, 180.01, 0.01), "antimeridian"),
    "in metres": (shapely.box(385000, 6672000, 385100, 6672100), "not in degrees"),
    "at the pole": (shapely.box(0, 89.5, 0.01, 89.6), "pole"),
    "infinite": (shapely.Polygon([(7, 50), (np.inf, 50), (7, 51)]), "no usable coordinates"),
}


@pytest.mark.parametrize("case", WRONG)
def test_polygons_that_cannot_be_used(case, settings, server):
    before = len(server.log)
    polygon, text = WRONG[case]
    with pytest.raises(InputError, match=text):
        osm_layers(polygon, settings=settings())
    assert len(server.log) == before, "refused before any request"


def test_parts_that_lie_far_apart(settings):
    apart = shapely.union_all(
        [shapely.box(x, y, x + 0.001, y + 0.001) for x, y in ((7, 43), (9, 45), (7, 45))]
    )
    with pytest.raises(InputError, match="between its parts"):
        osm_layers(apart, settings=settings())


def test_a_bow_tie_is_repaired_and_told(cross, listener):
    x, y = 200 / LON, 200 / LAT
    tie = shapely.Polygon([(7, 50), (7 + x, 50 + y), (7 + x, 50), (7, 50 + y)])
    found = osm_layers(tie, source=cross, progress=listener)
    assert len(found["streets"]) == 4
    assert any("crosses itself" in text for text in listener.said)


def test_wrong_words(cross):
    with pytest.raises(InputError, match="no network type 'rail'"):
        osm_layers(SITE, network_type="rail", source=cross)
    with pytest.raises(InputError, match="reach is -1 m"):
        osm_layers(SITE, source=cross, reach=-1)


def test_cancel_while_a_server_keeps_silent(site, settings, listener):
    listener = type(listener)(seconds=0.2)
    with pytest.raises(CancelledError):
        osm_layers(site, settings=settings("hang", timeout=30.0), progress=listener)
    assert time.monotonic() - listener.cancelled_at < allowed(1.0)


@pytest.mark.parametrize("word", ["Reading", "Simplifying", "Sorting"])
def test_cancel(extract, site, word, listener):

    with pytest.raises(CancelledError):
        osm_layers(site, source=extract, progress=type(listener)(word=word))


def test_inputs_stay_as_they_are(cross):
    before = shapely.to_wkb(SITE)
    osm_layers(SITE, source=cross)
    assert shapely.to_wkb(SITE) == before


def test_sea_lies_to_the_right_of_the_coast():
    window = shapely.box(0, 0, 1, 1)
    coast = shapely.LineString([(-1, 0.5), (2, 0.5)])
    assert shapely.equals(sea([coast], window), shapely.box(0, 0, 1, 0.5))
    assert shapely.equals(sea([coast.reverse()], window), shapely.box(0, 0.5, 1, 1))
    island = shapely.box(0.4, 0.2, 0.6, 0.4, ccw=True).exterior
    assert sea([coast, island], window).area == pytest.approx(0.5 - 0.04)
    half = shapely.LineString([(-1, 0.5), (0.5, 0.5)])
    assert sea([half], window).is_empty, "a coast that ends inside encloses nothing"
    assert sea([], window).is_empty


ODD_KEYS = (
    "highway", "building", "landuse", "natural", "leisure", "railway", "waterway", "maxspeed",
    "lanes", "oneway", "bridge", "tunnel", "layer", "height", "building:levels", "name", "area",
    "width", "junction", "boundary",
)  # fmt: skip
ODD_VALUES = (
    "yes", "no", "residential", "primary", "motorway", "park", "water", "coastline", "rail",
    "river", "30 mph", "50;30", "none", "-1", "", "a;b", "reversible", "1e99", "steps", "wood",
    "cliff", "NaN", "Straße", "\u202e",
)  # fmt: skip


def odd_file(seed: int) -> str:
    """Ways and relations that cross themselves, miss nodes, and are tagged by chance."""
    rng = np.random.default_rng(seed)

    def tags(most: int) -> str:
        pairs = [(rng.choice(ODD_KEYS), rng.choice(ODD_VALUES)) for _ in range(rng.integers(most))]
        return "".join(f'<tag k="{k}" v="{v}"/>' for k, v in dict(pairs).items())

    count = int(rng.integers(2, 20))
    grid = rng.integers(0, 5, (count, 2)) * 5e-4
    nodes = [
        f'<node id="{k}" lon="{7 + x}" lat="{50 + y}"/>' for k, (x, y) in enumerate(grid, start=1)
    ]
    ways = []
    for k in range(1, 15):
        refs = list(rng.integers(1, count + 2, rng.integers(0, 7)))
        refs += refs[:1] if rng.random() < 0.4 else []
        inside = "".join(f'<nd ref="{ref}"/>' for ref in refs)
        ways.append(f'<way id="{k}">{inside}{tags(7)}</way>')
    areas = []
    for k in range(1, 4):
        inside = "".join(
            f'<member type="way" ref="{rng.integers(1, 16)}" role="{role}"/>'
            for role in rng.choice(["outer", "inner", ""], rng.integers(0, 4))
        )
        kind = '<tag k="type" v="multipolygon"/>'
        areas.append(f'<relation id="{k}">{inside}{tags(5)}{kind}</relation>')
    return f'<osm version="0.6">{"".join(nodes + ways + areas)}</osm>'


@pytest.mark.slow
def test_odd_files_give_layers_or_a_sentence(tmp_path):
    path = tmp_path / "odd.osm"
    whole = 0
    for seed in range(60):
        path.write_text(odd_file(seed), encoding="utf-8")
        assert files.read_boundaries(path).is_valid.all()
        try:
            found = osm_layers(SITE, source=path, network_type="all")
        except InputError:
            continue
        whole += 1
        for name, frame in found.items():
            assert frame.is_valid.all(), (seed, name)
            assert not frame.geometry.is_empty.any(), (seed, name)
            flat = {"streets": {"LineString"}, "intersections": {"Point"}}
            assert set(frame.geom_type) <= flat.get(name, {"Polygon", "MultiPolygon"}), (seed, name)
            plain = frame.drop(columns="geometry").to_numpy().ravel()
            assert not any(isinstance(value, (list, tuple, set, dict)) for value in plain)
    assert whole > 30


def test_a_street_of_a_single_place(tmp_path):
    town = Town().way([(100, 100), (100, 100)], highway="residential")
    town.box(10, 10, 20, 20, building="yes")
    found = osm_layers(SITE, source=town.write(tmp_path / "a.osm"))
    assert len(found["streets"]) == 0
    assert len(found["buildings"]) == 1
