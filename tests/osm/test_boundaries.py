"""From names, ids and points to areas: against the local server and from its file."""

from __future__ import annotations

import pytest
import shapely
from platwright.errors import InputError
from platwright.osm import ATTRIBUTION, OsmSettings, boundaries, files
from platwright.osm.candidates import COLUMNS, Candidate, nearest_first

PORTIER = (7.4325, 43.7415)  # in the land reclamation L'Anse du Portier


@pytest.fixture(params=["services", "file"])
def find(request, settings, extract, listener):
    """Look places up, once through the services and once in the file they play from."""

    def look(place=None, **more):
        if request.param == "file":
            return boundaries(place, source=extract, progress=listener, **more)
        return boundaries(place, settings=settings(), progress=listener, **more)

    return look


def test_a_name_in_another_spelling(find, listener):
    found = find("larvotto")
    assert tuple(found.columns) == (*COLUMNS, "geometry")
    assert found.crs == "EPSG:4326"
    first = found.iloc[0]
    assert (first["name"], first["osm_id"], first["kind"]) == (
        "Larvotto", "R5986437", "administrative",
    )  # fmt: skip
    assert first["admin_level"] == 10
    assert first["area_ha"] == pytest.approx(23.5, abs=0.1)
    assert first["match"] == "name in another spelling"
    assert list(found["rank"]) == list(range(1, len(found) + 1))
    assert any("R5986437" in text and "level 10" in text for text in listener.said)


def test_where_the_data_is_from_goes_along(find):
    origin = find("Larvotto").attrs["osm"]
    assert origin["attribution"] == ATTRIBUTION
    assert "ODbL" in origin["licence"]
    assert origin["date"] == "2023-12-26"
    assert origin["source"]


@pytest.mark.parametrize("place", ["W686693023", "https://www.openstreetmap.org/way/686693023"])
def test_an_id(find, place):
    (row,) = find(place).itertuples()
    assert (row.name, row.match, row.kind) == ("L'Anse du Portier", "OSM id", "construction")
    assert row.area_ha == pytest.approx(6.6, abs=0.1)
    assert row.geometry.intersects(shapely.Point(PORTIER))


def test_an_id_without_a_name_of_which_nominatim_knows_nothing(find):
    (row,) = find("way/1034851198").itertuples()
    assert (row.name, row.kind) == (None, "residential")
    assert row.display_name == "residential W1034851198"


def test_an_id_that_does_not_exist(find):
    with pytest.raises(InputError, match="Check the number"):
        find("R123")


def test_a_point_gives_what_encloses_it_the_smallest_first(find, listener):
    found = find(point=PORTIER)
    assert list(found["osm_id"]) == ["W686693023", "R5986438", "W1034851198"]
    assert found["area_ha"].is_monotonic_increasing
    assert set(found["match"]) == {"encloses the point"}
    assert found["display_name"].iloc[0] == "L'Anse du Portier, Monte-Carlo"
    assert found.intersects(shapely.Point(PORTIER)).all()
    assert any("look whether it is the one you mean" in text for text in listener.warnings)


def test_a_point_in_the_sea(find):
    with pytest.raises(InputError, match="No area is known that encloses the point"):
        find(point=(7.6, 43.70))


def test_longitudes_beyond_the_180th_meridian_go_round(find):
    once = find(point=PORTIER)
    round_the_world = find(point=(PORTIER[0] + 360.0, PORTIER[1]))
    assert list(once["osm_id"]) == list(round_the_world["osm_id"])


def test_a_name_that_is_nowhere(find):
    with pytest.raises(InputError, match=r"'Nowhere at all'.*(spelling|another file)"):
        find("Nowhere at all")


def test_the_town_after_a_comma(find):
    found = find("Place du Casino, Monte-Carlo")
    assert found["name"].iloc[0] == "Place du Casino"
    assert "Monte-Carlo" in found["display_name"].iloc[0]


def test_the_limit(find, listener):
    found = find(point=PORTIER, limit=1)
    assert list(found["osm_id"]) == ["W686693023"]
    assert any("3 areas were found; the first 1" in text for text in listener.warnings)


@pytest.mark.parametrize(
    ("question", "text"),
    [
        ({}, "neither a place nor a point"),
        ({"place": "   "}, "neither a place nor a point"),
        ({"place": "x" * 301}, "301 characters"),
        ({"point": (7.4, 95.0)}, "not on the globe"),
        ({"point": (float("nan"), 43.0)}, "not on the globe"),
        ({"place": "Monaco", "limit": 0}, "at least 1"),
        ({"place": "https://www.openstreetmap.org/about"}, "names nothing"),
    ],
)
def test_questions_without_sense(find, question, text):
    with pytest.raises(InputError, match=text):
        find(**question)


def test_towns_of_the_same_name_are_all_listed(settings, listener):
    found = boundaries("Twinbrook", settings=settings(), progress=listener)
    assert list(found["display_name"]) == ["Twinbrook, County 2", "Twinbrook, County 1"]
    (warning,) = listener.warnings
    assert "2 areas are listed for 'Twinbrook'" in warning
    assert "R9000011" in warning


def test_a_point_beside_a_name_brings_the_nearest_first(settings):
    found = boundaries("Twinbrook", point=(20.9, 41.0), settings=settings())
    assert list(found["display_name"]) == ["Twinbrook, County 1", "Twinbrook, County 2"]


def test_a_city_that_is_its_own_district_is_one(settings):
    (row,) = boundaries("Stadtkreis", settings=settings()).itertuples()
    assert (row.osm_id, row.same_as) == ("R9000020", "R9000021")


def test_a_whole_state_is_told(settings, listener):
    boundaries("Testland", settings=settings(), progress=listener)
    (warning,) = listener.warnings
    assert "a whole state of 71,155,501 ha: for streets and buildings choose" in warning


def test_the_180th_meridian_is_told(settings, listener):
    boundaries("Datelinia", settings=settings(), progress=listener)
    assert any("both sides of the 180th meridian" in text for text in listener.warnings)


@pytest.mark.parametrize("place", ["Pointville", "N9000030"])
def test_a_place_that_is_a_point_is_said_to_be_one(settings, listener, place):
    found = boundaries(place, settings=settings(), progress=listener)
    assert list(found["osm_id"]) == ["R5986438", "W686693023", "W1034851198"]
    assert set(found["match"]) == {"encloses Pointville"}
    assert "is a point in OpenStreetMap (Pointville, N9000030)" in listener.warnings[0]


VILLAGE = """<osm version="0.6">
 <node id="1" lat="50.00" lon="10.00"/><node id="2" lat="50.00" lon="10.02"/>
 <node id="3" lat="50.01" lon="10.02"/><node id="4" lat="50.01" lon="10.00"/>
 <node id="5" lat="50.005" lon="10.01">
  <tag k="place" v="hamlet"/><tag k="name" v="Kleindorf"/></node>
 <way id="6"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="1"/>
  <tag k="boundary" v="administrative"/><tag k="admin_level" v="8"/>
  <tag k="name" v="Großdorf"/><tag k="name:cs" v="Velká Ves"/></way>
</osm>"""


@pytest.fixture
def village(tmp_path):
    path = tmp_path / "village.osm"
    path.write_text(VILLAGE, encoding="utf-8")
    return path


def test_a_place_that_is_a_point_in_the_file(village, listener):
    (row,) = boundaries("kleindorf", source=village, progress=listener).itertuples()
    assert (row.name, row.match, row.admin_level) == ("Großdorf", "encloses Kleindorf", 8)
    assert "'kleindorf' is a point in village.osm (Kleindorf, N5)" in listener.warnings[0]
    with pytest.raises(InputError, match="a point, which is no area"):
        boundaries("node/5", source=village)


def test_points_of_the_same_name_in_the_file(village, listener):
    far = '<node id="7" lat="51.0" lon="10.5"><tag k="place" v="hamlet"/>'
    far += '<tag k="name" v="Kleindorf"/></node>'
    text = village.read_text(encoding="utf-8").replace('<node id="5"', f'{far}<node id="5"')
    village.write_text(text.replace('id="7"', 'id="4711"'), encoding="utf-8")
    for name in ("Kleindorf", "Kleindorf, Großdorf"):
        listener.warnings.clear()
        (row,) = boundaries(name, source=village, progress=listener).itertuples()
        assert (row.name, row.match) == ("Großdorf", "encloses Kleindorf")
        assert "N5" in listener.warnings[0]
    # The first name alone leaves open which is meant.
    boundaries("Kleindorf", source=village, progress=listener)
    assert any("1 more of that name: N4711 at 10.50000,51.00000" in w for w in listener.warnings)


def test_a_point_of_the_name_and_an_area_of_a_similar_one(village, listener):
    text = village.read_text(encoding="utf-8").replace("Kleindorf", "Groß")
    village.write_text(text, encoding="utf-8")
    found = boundaries("Groß", source=village, progress=listener)
    assert list(found["match"]) == ["beginning of the name"]  # which encloses the point, too
    assert "are listed after those whose name is similar" in listener.warnings[0]


def test_a_better_known_point_beside_an_area_of_the_name(settings, listener):
    found = boundaries("Halfway", settings=settings(), progress=listener)
    assert list(found["osm_id"]) == ["R9000041", "R5986438", "W686693023", "W1034851198"]
    assert "The best match for 'Halfway' is a point" in listener.warnings[0]


def test_points_of_the_name_behind_the_areas_are_told(settings, listener):
    found = boundaries("Upper Twinbrook", settings=settings(), progress=listener)
    assert list(found["osm_id"]) == ["R9000050"]
    assert any("N9000051" in text and "not listed" in text for text in listener.said)


def test_what_is_known_is_kept_where_the_surroundings_cannot_be_asked(
    settings, server, listener, monkeypatch
):
    monkeypatch.setattr(
        server.nominatim, "reverse", lambda _: {"unexpected": "answer"}, raising=True
    )
    half = settings(overpass_url=server.addresses("500")["overpass_url"])
    found = boundaries("Halfway", settings=half, progress=listener)
    assert list(found["osm_id"]) == ["R9000041"]
    assert any("What encloses it is not listed" in text for text in listener.warnings)


def test_a_name_of_another_language_in_the_file(village):
    (row,) = boundaries("velka ves", source=village).itertuples()
    assert (row.name, row.match) == ("Großdorf", "other name: Velká Ves")


def test_a_street_is_no_area(settings, listener, server):
    street = next(
        number
        for number, (_, tags) in server.overpass.extract.ways.items()
        if tags.get("highway") == "residential"
        and ("way", number) not in server.overpass.extract.areas
    )
    found = boundaries(f"W{street}", settings=settings(), progress=listener)
    assert len(found)
    assert f"'W{street}' is a line in OpenStreetMap" in listener.warnings[0]


def test_without_overpass_levels_are_estimated_and_nominatim_gives_the_address(
    settings, server, listener
):
    broken = server.addresses("504")["overpass_url"]
    half = settings(overpass_url=broken, timeout=3.0)
    named = boundaries("Larvotto", settings=half, progress=listener)
    assert named["admin_level"].iloc[0] == 10
    assert any("estimated from the ranks of Nominatim" in text for text in listener.said)
    around = boundaries(point=PORTIER, settings=half, progress=listener)
    assert list(around["osm_id"]) == ["R5986438"]
    assert any("Nominatim is asked instead" in text for text in listener.warnings)


def test_the_recorded_answer_of_nominatim_works_offline(shared_data, listener):
    offline = OsmSettings(cache_folder=shared_data / "osmnx_cache", only_cache=True)
    found = boundaries("Monaco", settings=offline, progress=listener)
    assert list(found["osm_id"]) == ["R1124039", "R2220322"]
    assert list(found["admin_level"]) == [2, 8]
    # The state reaches out to sea: the first hit is thirty-five times the land.
    assert found["area_ha"].iloc[0] > 30 * found["area_ha"].iloc[1]
    assert any("whole state" in text for text in listener.warnings)
    assert found.attrs["osm"]["date"]


def test_a_whole_town_from_a_large_file(shared_data):
    found = boundaries("Vaduz", source=shared_data / "osm" / "liechtenstein.osm.pbf")
    first = found.iloc[0]
    assert (first["name"], first["admin_level"]) == ("Vaduz", 8)
    assert first["area_ha"] == pytest.approx(1730, rel=0.01)  # 17.3 km2


def at(x: float, y: float, name: str) -> Candidate:
    return Candidate(name, name, shapely.box(x - 0.01, y - 0.01, x + 0.01, y + 0.01))


def test_nearest_is_by_metres_and_round_the_globe():
    # A degree of longitude at 60 degrees north is half one of latitude: 17 against 22 km.
    areas = [at(10.0, 60.2, "north"), at(10.3, 60.0, "east")]
    assert [a.name for a in nearest_first(areas, (10.0, 60.0))] == ["east", "north"]
    areas = [at(170.0, 0.0, "west"), at(-179.5, 0.0, "beyond the meridian")]
    assert [a.name for a in nearest_first(areas, (179.5, 0.0))] == ["beyond the meridian", "west"]
    assert [a.name for a in nearest_first(areas, (-170.0, 0.0))] == ["beyond the meridian", "west"]


def test_a_file_is_read_no_more_often_than_needed(village, monkeypatch):
    read = []
    walk = files.walk

    def counted(*given, **more):
        read.append(given)
        return walk(*given, **more)

    monkeypatch.setattr(files, "walk", counted)
    boundaries("kleindorf", source=village)
    assert len(read) == 1
    boundaries(point=(10.01, 50.005), source=village)
    assert len(read) == 3


def test_the_progress_of_a_file_never_goes_back(extract, listener):
    told = []
    listener.stage = lambda _, fraction: told.append(fraction)
    for question in ({"place": "Larvotto"}, {"place": "W686693023"}, {"point": PORTIER}):
        told.clear()
        boundaries(source=extract, progress=listener, **question)
        assert told == sorted(told)
    # The last one reads the file twice.
    assert told[0] == 0.0
    assert {0.45, 0.9} <= set(told)


@pytest.mark.parametrize("broken", ["", "once"])
def test_the_password_of_a_server_is_not_shown(settings, server, listener, broken):
    secret = {
        name: url.replace("//", "//me:secret@") for name, url in server.addresses(broken).items()
    }
    with pytest.raises(InputError) as caught:
        boundaries("Nowhere at all", settings=settings(**secret), progress=listener)
    assert not any("secret" in text for text in (str(caught.value), *listener.said))


ETYMOLOGY = """<osm version="0.6">
 <node id="1" lat="50.00" lon="10.00"/><node id="2" lat="50.00" lon="10.02"/>
 <node id="3" lat="50.01" lon="10.02"/>
 <way id="6"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="1"/>
  <tag k="leisure" v="park"/><tag k="name" v="Rose Garden"/>
  <tag k="name:etymology" v="Rosa Luxemburg"/><tag k="alt_name:zh-Hant" v="玫瑰園"/></way>
</osm>"""


def test_after_whom_a_park_is_named_is_no_name(tmp_path):
    (tmp_path / "park.osm").write_text(ETYMOLOGY, encoding="utf-8")
    with pytest.raises(InputError, match="no area called"):
        boundaries("Rosa Luxemburg", source=tmp_path / "park.osm")
    (row,) = boundaries("玫瑰園", source=tmp_path / "park.osm").itertuples()
    assert row.match == "other name: 玫瑰園"
