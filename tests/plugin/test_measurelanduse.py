"""Measure land use, on two blocks and a park by hand, through real QGIS."""

from __future__ import annotations

import shutil

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import FailedError, Listener, RefusedError, box, layer, line  # noqa: E402

#: Ground of 100 x 100 m: streets 10 m wide cross in the middle and leave four quarters of 45 m.
SITE = box(0, 0, 100, 100)


def land(uses=("residential", "residential", "School", "green", "PARKS"), **options):
    """Two parcels in one quarter, one use in each of the others."""
    shapes = [
        box(0, 0, 45, 20), box(0, 20, 45, 25), box(55, 0, 45, 45), box(0, 55, 45, 45),
        box(55, 55, 45, 45),
    ]  # fmt: skip
    values = [[use] for use in uses]
    given = {"fields": "field=use:string(20)", "values": values, "name": "land", **options}
    return layer(shapes, **given)


def streets():
    """A cross, one arm of which ends blind inside, and another leaves the site."""
    return layer(
        [line((50, 50), (50, 130)), line((50, 50), (-5, 50)), line((50, 50), (50, 20)),
         line((50, 50), (100, 50))],
        kind="LineString", name="streets",
    )  # fmt: skip


def measure(toolbox, made=None, **given):
    return toolbox.run("measurelanduse", INPUT=made or land(), **given)


def shares(run):
    return {row["land_use"]: row["share_pct"] for row in run.rows("OUTPUT")}


def test_shares_blocks_and_streets(toolbox):
    run = measure(toolbox, SITE=layer([SITE]), STREETS=streets())
    assert not run.layers["OUTPUT"].isSpatial()
    assert shares(run) == pytest.approx(
        {"streets": 19.0, "parcels": 20.25, "parks": 40.5, "other": 20.25, "all": 100.0}
    )
    counts = {row["land_use"]: row["polygons"] for row in run.rows("OUTPUT")}
    assert counts == {"streets": 0, "parcels": 2, "parks": 2, "other": 1, "all": 5}
    numbers = run.results
    assert numbers["GROUND_HA"] == pytest.approx(1)
    for key, use in (
        ("STREETS_PCT", "streets"),
        ("PARCELS_PCT", "parcels"),
        ("PARKS_PCT", "parks"),
    ):
        assert numbers[key] == pytest.approx(shares(run)[use])
    assert (numbers["BLOCKS"], numbers["BLOCKS_KM2"]) == pytest.approx((4, 400))
    for key in ("BLOCK_MAX", "BLOCK_MEAN", "BLOCK_MIN"):
        assert numbers[key] == pytest.approx(180)
    # 50 + 50 + 30 + 50 m inside, and what lies within 1 m of the edge
    assert numbers["STREET_KM_KM2"] == pytest.approx((0.18 + 0.002) / 0.01)
    assert (numbers["INTERSECTIONS"], numbers["INTERSECTIONS_KM2"]) == pytest.approx((1, 100))
    assert (numbers["DEAD_ENDS"], numbers["DEAD_ENDS_KM2"]) == pytest.approx((1, 100))
    assert (numbers["PARCELS"], numbers["PARCELS_KM2"]) == pytest.approx((2, 200))


def test_what_was_not_given_is_not_told(toolbox):
    run = measure(toolbox)
    for key in ("STREET_KM_KM2", "INTERSECTIONS", "DEAD_ENDS"):
        assert run.results[key] is None
    # the streets of 10 m between are filled: 100 x 100 m
    assert run.results["GROUND_HA"] == pytest.approx(1)
    assert shares(run)["streets"] == pytest.approx(19)


def test_streets_may_be_polygons_of_the_layer(toolbox):
    run = measure(toolbox, land(("road", "lot", "lot", "lot", "lot")))
    assert shares(run)["streets"] == pytest.approx(19 + 9)
    assert run.results["BLOCKS"] == 4


def test_blocks_may_be_given_and_are_cut_to_the_site(toolbox):
    drawn = layer([box(0, 0, 100, 60), box(0, 60, 100, 60)], name="blocks")
    run = measure(toolbox, BLOCKS=drawn, SITE=layer([SITE]))
    assert run.results["BLOCKS"] == 2
    assert run.results["BLOCK_MAX"] == pytest.approx(320)
    assert run.results["BLOCK_MIN"] == pytest.approx(280)


def test_what_lies_outside_the_site_does_not_count(toolbox):
    run = measure(toolbox, SITE=layer([box(0, 0, 45, 22)]))
    assert run.results["PARCELS"] == 2
    assert shares(run)["parcels"] == pytest.approx(100)
    assert shares(run)["streets"] == pytest.approx(0, abs=1e-6)


def test_words_that_are_not_known_are_listed(toolbox):
    run = measure(toolbox, land(("lot", "R-2", "R-2", None, "park")))
    said = [(row["problem"], row["severity"]) for row in run.rows("PROBLEMS")]
    assert sorted(said) == [
        ("1 polygons: no use", "warning"),
        ("2 polygons: use 'r 2' is not known", "warning"),
    ]
    counts = {row["land_use"]: row["polygons"] for row in run.rows("OUTPUT")}
    assert (counts["other"], counts["parcels"], counts["parks"]) == (3, 1, 1)


def test_without_a_use_all_are_parcels(toolbox):
    made = land(fields="field=number:integer", values=[[k] for k in range(5)])
    run = measure(toolbox, made)
    assert run.results["PARCELS"] == 5
    assert any("all polygons count as parcels" in text for text in run.said.infos)


def test_the_field_can_be_chosen(toolbox):
    made = land(
        fields="field=use:string(20)&field=zone:string(20)",
        values=[["lot", "park"]] * 5,
    )
    assert measure(toolbox, made).results["PARCELS"] == 5
    assert measure(toolbox, made, USE_FIELD="zone").results["PARKS_PCT"] == pytest.approx(81)


def test_ground_that_is_covered_twice_counts_once(toolbox):
    made = layer(
        [box(0, 0, 100, 100), box(0, 0, 50, 100)], fields="field=use:string(20)",
        values=[["lot"], ["park"]], name="overlaid",
    )  # fmt: skip
    run = measure(toolbox, made)
    assert shares(run) == pytest.approx(
        {"streets": 0, "parcels": 50, "parks": 50, "other": 0, "all": 100}, abs=1e-6
    )
    assert any("overlap on 5000 m2" in row["problem"] for row in run.rows("PROBLEMS"))


def test_inputs_in_degrees_are_measured_in_metres(toolbox):
    from test_bad_input import in_crs

    run = measure(
        toolbox, in_crs(land(), "EPSG:4326"), STREETS=in_crs(streets(), "EPSG:3857"),
        SITE=in_crs(layer([SITE]), "EPSG:4326"),
    )  # fmt: skip
    assert run.results["GROUND_HA"] == pytest.approx(1, rel=0.003)
    assert run.results["STREET_KM_KM2"] == pytest.approx(18.2, rel=0.003)


@pytest.mark.parametrize(
    ("made", "more", "text"),
    [
        (lambda: land(crs=""), dict, "coordinate reference system"),
        (lambda: layer([], name="void"), dict, "no features"),
        (lambda: layer([None], name="nothing"), dict, "no polygons"),
        (land, lambda: {"USE_FIELD": "zone"}, "zone"),
        (land, lambda: {"STREETS": layer([SITE])}, "geometry|line"),
    ],
)
def test_what_cannot_be_measured_is_refused_in_words(toolbox, made, more, text):
    with pytest.raises((RefusedError, FailedError), match=text) as caught:
        measure(toolbox, made(), **more())
    assert "something went wrong" not in str(caught.value)


@pytest.mark.parametrize("stage", ["Reading", "Joining", "Measuring"])
def test_cancel_leaves_nothing(toolbox, stage):
    run = measure(toolbox, listener=Listener(cancel_at=stage))
    assert run.results == {}


def test_real_bad_layers(toolbox, shared_data, tmp_path):
    for name, table in (
        ("cambridge_invalid_parcels", "parcels"),
        ("cambridge_slivers", "slivers_and_neighbours"),
        ("flanders_parcels_one_empty", "parcels"),
        ("curvepolygon", "curvepolygon"),
        ("fr_zoning_z_one_empty", "zoning2"),
        ("derived_empty_null_zeroarea", "site"),
        ("derived_far_crs", "plots_negative_krovak"),
    ):
        path = tmp_path / f"{name}.gpkg"
        shutil.copyfile(shared_data / "bad" / f"{name}.gpkg", path)
        run = measure(toolbox, f"{path}|layername={table}")
        assert shares(run)["all"] == pytest.approx(100), name
        assert run.results["PARCELS_PCT"] > 50, name
