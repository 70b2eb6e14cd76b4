"""Measure design, on a small site by hand."""

from __future__ import annotations

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import RefusedError, box, layer, line, point, roads, site  # noqa: E402


def cross():
    """Two streets that cross in the middle of the site of 300 by 200 m."""
    return layer(
        [
            line((150, 0), (150, 100)), line((150, 100), (150, 200)),
            line((0, 100), (150, 100)), line((150, 100), (300, 100)),
        ],
        kind="LineString", name="cross",
    )  # fmt: skip


def measure(toolbox, **given):
    return toolbox.run(
        "measuredesign",
        **{"INPUT": cross(), "SITE": site(), "BOUNDARY_STREETS": roads(), **given},
    )


def test_one_row_and_the_same_numbers(toolbox, package):
    run = measure(toolbox, BLOCK_WIDTH=100)
    (row,) = run.rows("FIGURES")
    assert row["design"] == "cross"
    assert row["site_area_ha"] == pytest.approx(6.0)
    assert row["length_m"] == pytest.approx(200 + 300)
    assert row["density_mha"] == pytest.approx((200 + 300) / 6.0)
    assert (row["blocks"], row["crossings"], row["t_junctions"], row["bends"]) == (4, 1, 0, 0)
    assert row["block_area_ha"] == pytest.approx(1.5)
    assert (row["block_width_m"], row["block_length_m"]) == pytest.approx((100, 150))
    assert (row["wide_enough_pct"], row["too_thin_pct"]) == (100, 0)
    assert row["rectangular_pct"] == pytest.approx(100)
    assert (row["violations"], row["warnings"]) == (0, 0)
    for field in package("plugin.fields").FIGURES.fields:
        if field.kind != "text":
            assert run.results[field.name.upper()] == pytest.approx(row[field.name]), field.name


def test_the_table_has_no_geometry_and_no_style(toolbox, tmp_path):
    path = tmp_path / "figures.gpkg"
    run = measure(toolbox, NAME="plan A", FIGURES=str(path))
    assert not run.layers["FIGURES"].isSpatial()
    (row,) = run.rows("FIGURES")
    assert row["design"] == "plan A"
    import contextlib
    import sqlite3

    with contextlib.closing(sqlite3.connect(path)) as base:
        tables = {name for (name,) in base.execute("SELECT name FROM sqlite_master")}
    assert "figures" in tables
    assert "layer_styles" not in tables


def test_existing_streets_that_go_on_are_counted(toolbox):
    arriving = layer(
        [point(150, 0), point(40, 0)], kind="Point", fields="field=bearing_deg:double",
        values=[[0.0], [0.0]],
    )  # fmt: skip
    (row,) = measure(toolbox, ACCESS_POINTS=arriving).rows("FIGURES")
    assert (row["continued"], row["arriving"]) == (1, 2)


def test_obstacles_are_no_blocks(toolbox):
    (row,) = measure(toolbox, OBSTACLES=layer([box(0, 0, 145, 95)])).rows("FIGURES")
    assert row["blocks"] == 3


def test_a_broken_rule_is_counted(toolbox):
    stub = layer([line((150, 0), (150, 100))], kind="LineString", name="stub")
    (row,) = measure(toolbox, INPUT=stub).rows("FIGURES")
    assert row["violations"] == 1


def test_an_empty_layer_of_obstacles_is_left_out(toolbox):
    run = measure(toolbox, OBSTACLES=layer([], name="none here"))
    assert any("'none here' has no features" in text for text in run.said.infos)
    assert run.rows("FIGURES")[0]["blocks"] == 4


def test_a_selection_of_nothing_is_a_mistake(toolbox):
    from qgis.core import QgsProcessingFeatureSourceDefinition, QgsProject

    there = layer([box(0, 0, 10, 10)], name="there")
    QgsProject.instance().addMapLayer(there)
    try:
        chosen = QgsProcessingFeatureSourceDefinition(there.id(), True)
        with pytest.raises(RefusedError, match="none is selected"):
            measure(toolbox, OBSTACLES=chosen)
    finally:
        QgsProject.instance().removeMapLayer(there.id())


def test_a_site_without_features_is_refused(toolbox):
    with pytest.raises(RefusedError, match="no features"):
        measure(toolbox, SITE=layer([], name="void"))
