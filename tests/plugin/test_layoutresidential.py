"""Residential zones through real QGIS; geometry is judged by QGIS itself."""

from __future__ import annotations

import json
import math

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from qgis.core import QgsGeometry  # noqa: E402
from support import Listener, X, Y, box, complaints_of, layer, line  # noqa: E402

#: A few seconds are enough for a small zone.
QUICK = {"TIME_LIMIT": 2, "FAR": 0.8}


def ground(width=220, height=180):
    return layer([box(0, 0, width, height)], name="field")


def around(width=220, height=180):
    return layer(
        [line((-50, 0), (width + 50, 0)), line((0, height), (width, height))],
        kind="LineString", name="around", fields="field=name:string(20)&field=highway:string(20)",
        values=[["South", "residential"], ["North", "tertiary"]],
    )  # fmt: skip


def corridors():
    return layer([line((110, 0), (110, 180))], kind="LineString", name="corridor")


def table(rows, fields="field=name:string(20)&field=length:double&field=width:double"
          "&field=storeys:integer"):  # fmt: skip
    return layer([None] * len(rows), kind="NoGeometry", name="houses", fields=fields, values=rows)


def union(rows):
    return QgsGeometry.unaryUnion([row["geometry"] for row in rows])


complaint = complaints_of("layoutresidential")


@pytest.fixture(scope="module")
def made(toolbox):
    return toolbox.run(
        "layoutresidential", INPUT=ground(), ROADS=around(), CORRIDORS=corridors(), **QUICK
    )


def test_buildings_stand_apart_within_their_patches(made):
    rows = made.rows("BUILDINGS")
    assert len(rows) > 15
    for at, one in enumerate(rows):
        for other in rows[at + 1 :]:
            common = one["geometry"].intersection(other["geometry"])
            assert common.isEmpty() or common.area() < 0.01
            if one["group"] != other["group"]:
                assert one["geometry"].distance(other["geometry"]) > 5.95
    patches = {row["patch_id"]: row["geometry"] for row in made.rows("PATCHES_USED")}
    for row in rows:
        inner = patches[row["patch_id"]].buffer(-4.9, 8)
        assert inner.contains(row["geometry"]), row["building_id"]


def test_no_residence_stands_in_a_shadow(made):
    shadows = {row["building_id"]: row["geometry"] for row in made.rows("SHADOWS")}
    homes = [row for row in made.rows("BUILDINGS") if row["use"] == "residence"]
    assert homes
    assert made.results["SHADED"] == 0
    for row in homes:
        middle = row["geometry"].buffer(-4.0, 4)
        for own, shadow in shadows.items():
            if own != row["building_id"]:
                assert shadow.intersection(middle).area() < 0.5, (own, row["building_id"])


def test_every_building_is_reached_by_paths(made):
    paths = union(made.rows("PATHS"))
    assert all(row["way_m"] is not None for row in made.rows("BUILDINGS"))
    for row in made.rows("BUILDINGS"):
        assert row["geometry"].distance(paths) < 2.0, row["building_id"]
    space = union(made.rows("PATCHES_USED"))
    exits = [row for row in made.rows("PATHS") if row["exit"]]
    rim = QgsGeometry(space.constGet().boundary())
    assert exits
    assert all(row["geometry"].distance(rim) < 0.05 for row in exits)
    blocked = QgsGeometry.unaryUnion(
        [row["geometry"].buffer(-0.3, 4) for row in made.rows("BUILDINGS")]
    )
    assert paths.intersection(blocked).length() < 0.1


def test_numbers_are_those_of_the_layers(made):
    rows, told = made.rows("BUILDINGS"), made.results
    area = 220 * 180
    floor = sum(row["geometry"].area() * row["storeys"] for row in rows)
    assert told["FAR_REACHED"] == pytest.approx(floor / area, rel=0.01)
    built = union(rows).area()
    assert told["DENSITY_REACHED"] == pytest.approx(built / area, rel=0.01)
    green = union(made.rows("GREEN"))
    assert told["GREEN_REACHED"] == pytest.approx(green.area() / area, rel=0.01)
    assert told["BUILDING_COUNT"] == len(rows)
    assert told["DWELLINGS"] == sum(row["dwellings"] for row in rows)
    assert told["PARKING_PLACES"] == sum(row["places"] for row in made.rows("PARKING_BAYS"))
    hours = [row["sun_hours"] for row in rows if row["use"] == "residence"]
    assert told["LEAST_SUN"] == pytest.approx(min(hours), abs=1e-6)
    assert told["FAR_REACHED"] == pytest.approx(0.8, rel=0.1)


def test_what_lies_between_does_not_overlap(made):
    parts = [union(made.rows(key)) for key in ("BUILDINGS", "GREEN", "PARKING_BAYS")]
    for at, one in enumerate(parts):
        for other in parts[at + 1 :]:
            assert one.intersection(other).area() < 1.0
    assert made.rows("TREES")


def test_the_same_seed_gives_the_same_plan(toolbox):
    def plan():
        run = toolbox.run(
            "layoutresidential", INPUT=ground(), ROADS=around(), METHOD="staged", **QUICK
        )
        return sorted(row["geometry"].asWkt(3) for row in run.rows("BUILDINGS"))

    assert plan() == plan()


@pytest.mark.parametrize("pattern", ["rows", "centric", "enclosed", "symmetrical", "dotted"])
def test_each_pattern_has_buildings(toolbox, pattern):
    run = toolbox.run(
        "layoutresidential", INPUT=ground(), ROADS=around(), PATTERN=pattern, METHOD="staged",
        **QUICK,
    )  # fmt: skip
    assert len(run.rows("BUILDINGS")) >= 6
    assert {row["residences"] for row in run.rows("PATCHES_USED")} == {pattern}


def test_a_table_of_ones_own(toolbox):
    rows = [["Long house", 30.0, 11.0, 4], ["Point house", 18.0, 18.0, 6]]
    run = toolbox.run(
        "layoutresidential", INPUT=ground(), ROADS=around(), BUILDING_TYPES=table(rows), **QUICK
    )
    found = {row["type"]: row for row in run.rows("BUILDINGS")}
    assert set(found) <= {"Long house", "Point house"}
    for name, length, width, storeys in rows:
        if name in found:
            assert found[name]["geometry"].area() == pytest.approx(length * width, rel=0.01)
            assert found[name]["storeys"] == storeys
            assert found[name]["height_m"] == pytest.approx(3 * storeys)


def test_hours_of_sun_in_place_of_spacing(toolbox):
    run = toolbox.run(
        "layoutresidential", INPUT=ground(), ROADS=around(), SUN_HOURS=1.0, SUN_MONTH=3,
        SUN_DAY=20, **QUICK,
    )  # fmt: skip
    homes = [row for row in run.rows("BUILDINGS") if row["use"] == "residence"]
    assert homes
    assert min(row["sun_hours"] for row in homes) >= 1.0 - 1e-6


def test_files_for_3d(toolbox, tmp_path):
    city, scene = tmp_path / "zone.city.json", tmp_path / "zone.glb"
    run = toolbox.run(
        "layoutresidential", INPUT=ground(), ROADS=around(), METHOD="staged",
        CITYJSON_FILE=str(city), GLTF_FILE=str(scene), **QUICK,
    )  # fmt: skip
    found = json.loads(city.read_text())
    assert found["type"] == "CityJSON"
    solids = [own for own in found["CityObjects"].values() if own["type"] == "Building"]
    assert len(solids) == len(run.rows("BUILDINGS"))
    assert scene.read_bytes()[:4] == b"glTF"


def test_styles_and_heights(made, package, tmp_path):
    shown = made.layers["BUILDINGS"]
    styles, kinds = package("plugin.styles"), package("plugin.building_fields")
    styles.apply(shown, kinds.BUILDINGS)
    assert shown.renderer().type() == "categorizedSymbol"
    styles.offer_others(shown, kinds.BUILDINGS)
    assert {"Hours of sun", "2.5D"} <= set(shown.styleManager().styles())
    solid = package("plugin.solids").solid_renderer(kinds.BUILDINGS)
    if solid is not None:
        assert shown.renderer3D() is not None


def test_a_cancelled_run_keeps_its_plan(toolbox):
    said = Listener(cancel_at="Best design")
    run = toolbox.run(
        "layoutresidential", INPUT=ground(), ROADS=around(), CORRIDORS=corridors(), FAR=0.8,
        TIME_LIMIT=60, listener=said,
    )  # fmt: skip
    assert run.rows("BUILDINGS")
    assert all(row["way_m"] is not None for row in run.rows("BUILDINGS"))


def test_cancelled_before_the_patches_of_a_zone_the_zones_before_it_are_kept(
    toolbox, package, monkeypatch
):
    corridors_, errors = package("algorithms.buildings.corridors"), package("algorithms.errors")
    whole = corridors_.zone_of_site

    def cancelled_at_the_second(site, *given, **more):
        if site.site_id == 2:
            raise errors.CancelledError("Cancelled.")
        return whole(site, *given, **more)

    monkeypatch.setattr(corridors_, "zone_of_site", cancelled_at_the_second)
    two = layer([box(0, 0, 150, 120), box(400, 0, 150, 120)], name="fields")
    run = toolbox.run("layoutresidential", INPUT=two, METHOD="staged", **QUICK)
    assert {row["site_id"] for row in run.rows("BUILDINGS")} == {1}


def test_zones_of_a_layer_are_told_apart(toolbox):
    two = layer([box(0, 0, 150, 120), box(400, 0, 150, 120)], name="fields")
    run = toolbox.run("layoutresidential", INPUT=two, METHOD="staged", **QUICK)
    assert {row["site_id"] for row in run.rows("BUILDINGS")} == {1, 2}


def test_a_cancelled_run_says_so(toolbox):
    said = Listener(cancel_at="Best design")
    toolbox.run("layoutresidential", INPUT=ground(), ROADS=around(), TIME_LIMIT=60, listener=said)
    assert any("Cancelled" in text for text in said.warnings)


def test_numbers_of_patterns_are_those_of_the_paper(toolbox, package):
    tool = toolbox.tool("layoutresidential")
    words = tuple(tool.parameterDefinition("PATTERN").options())
    assert words == package("algorithms.buildings.types").BUILDING_PATTERNS


# Bad input


def test_a_zone_that_is_too_small_does_not_stop_the_others(toolbox):
    two = layer([box(0, 0, 150, 120), box(400, 0, 10, 9)], name="fields")
    run = toolbox.run("layoutresidential", INPUT=two, METHOD="staged", **QUICK)
    assert {row["site_id"] for row in run.rows("BUILDINGS")} == {1}
    told = [row for row in run.rows("PROBLEMS") if "smaller than" in row["problem"]]
    assert len(told) == 1
    assert any("fields" in text and "feature" in text for text in run.said.warnings)


def test_a_table_without_a_size(toolbox):
    bad = table([["House", 4]], fields="field=name:string(20)&field=storeys:integer")
    text = complaint(toolbox, INPUT=ground(), BUILDING_TYPES=bad)
    assert "houses" in text
    assert "length" in text


def test_a_house_of_no_length(toolbox):
    text = complaint(
        toolbox,
        INPUT=ground(),
        BUILDING_TYPES=table([["House", 0.0, 10.0, 4]]),
    )
    assert "length" in text


def test_indices_that_contradict_each_other(toolbox):
    text = complaint(toolbox, INPUT=ground(), FAR=5.0, DENSITY=0.1)
    assert "density" in text.lower()


def test_density_and_green_are_more_than_all(toolbox):
    text = complaint(toolbox, INPUT=ground(), DENSITY=0.5, GREEN_RATIO=0.7)
    assert "more than" in text


def test_nothing_to_build(toolbox):
    text = complaint(toolbox, INPUT=ground(), PATTERN="empty", FACILITY_PATTERN="empty")
    assert "empty" in text


def test_a_zone_too_small_for_a_building(toolbox):
    text = complaint(toolbox, INPUT=ground(10, 9))
    assert "smaller than" in text
    assert "field" in text


def test_a_zone_with_no_room_within_its_setback(toolbox):
    run = toolbox.run(
        "layoutresidential", INPUT=ground(20, 18), FAR_LIMIT=20, DENSITY=0.9, GREEN_RATIO=0.05
    )
    assert not run.rows("BUILDINGS")
    assert any("room" in row["problem"] for row in run.rows("PROBLEMS"))


def test_a_self_intersecting_zone_is_repaired_and_told(toolbox):
    corners = [(0, 0), (200, 160), (200, 0), (0, 160), (0, 0)]
    bow = "Polygon ((" + ", ".join(f"{X + x} {Y + y}" for x, y in corners) + "))"
    run = toolbox.run("layoutresidential", INPUT=layer([bow], name="bow"), METHOD="staged", **QUICK)
    assert any("self" in row["problem"].lower() for row in run.rows("PROBLEMS"))


@pytest.mark.parametrize("crs", ["EPSG:32631", "EPSG:32733", "EPSG:3995"])
def test_zones_at_the_equator_in_the_south_and_near_the_pole(toolbox, crs):
    spots = {"EPSG:32631": (500000, 20000), "EPSG:32733": (500000, 6300000),
             "EPSG:3995": (300000, -600000)}  # fmt: skip
    x, y = spots[crs]
    wkt = f"Polygon (({x} {y}, {x + 200} {y}, {x + 200} {y + 150}, {x} {y + 150}, {x} {y}))"
    place = layer([wkt], name="place", crs=crs)
    run = toolbox.run("layoutresidential", INPUT=place, METHOD="staged", **QUICK)
    homes = [row for row in run.rows("BUILDINGS") if row["use"] == "residence"]
    assert homes
    south = crs == "EPSG:32733"
    for row in homes:
        off = abs((row["facing_deg"] - (0 if south else 180) + 180) % 360 - 180)
        assert off < 50, row["facing_deg"]
    assert all(math.isfinite(row["sun_hours"]) for row in homes)
