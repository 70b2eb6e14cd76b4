"""Measure streets, on a grid and a lane by hand, through real QGIS."""

from __future__ import annotations

import contextlib
import shutil
import sqlite3

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from qgis.core import NULL  # noqa: E402
from support import FailedError, Listener, RefusedError, X, Y, box, layer, line  # noqa: E402

#: Four blocks of a hectare; each street runs through, with a vertex where it meets another.
GRID = [line(*((100 * k, 100 * j) for k in range(3))) for j in range(3)] + [
    line(*((100 * j, 100 * k) for k in range(3))) for j in range(3)
]
#: A lane of 60 m that ends blind, from the middle of the north side.
LANE = line((100, 200), (100, 260))


def streets(shapes=None, **options):
    shapes = shapes or [*GRID, LANE]
    given = {
        "kind": "LineString", "name": "streets",
        "fields": "field=name:string(20)&field=lanes:integer",
        "values": [[f"street {k}", k] for k in range(len(shapes))], **options,
    }  # fmt: skip
    return layer(shapes, **given)


def measure(toolbox, made=None, **given):
    return toolbox.run("measurestreets", INPUT=made or streets(), **given)


def test_fields_layers_and_numbers(toolbox):
    run = measure(toolbox)
    rows = run.rows("OUTPUT")
    assert [row["name"] for row in rows] == [f"street {k}" for k in range(7)]
    assert [row["lanes"] for row in rows] == list(range(7))
    assert [row["length_m"] for row in rows] == pytest.approx([200] * 6 + [60])
    assert [row["dead_end"] for row in rows] == [False] * 6 + [True]
    assert [row["degree_start"] for row in rows] == [2, 3, 2, 2, 3, 2, 4]
    assert [row["degree_end"] for row in rows] == [2, 3, 2, 2, 4, 2, 1]
    assert [row["bearing_deg"] for row in rows] == pytest.approx([90] * 3 + [0] * 4, abs=0.01)
    assert [row["sinuosity"] for row in rows] == pytest.approx([1] * 7)
    # the lane goes on from the street in the middle
    assert rows[4]["natural_id"] == rows[6]["natural_id"] == 1
    assert rows[6]["natural_m"] == pytest.approx(260)
    assert {row["connectivity"] for row in rows} == {3}
    assert all(0 < row["betweenness"] < 1 for row in rows)
    assert all(row["closeness"] > 0 for row in rows)

    natural = run.rows("NATURAL_STREETS")
    assert [row["length_m"] for row in natural] == pytest.approx([260] + [200] * 5)
    assert [row["natural_id"] for row in natural] == list(range(1, 7))
    assert natural[0]["geometry"].length() == pytest.approx(260)
    junctions = run.rows("JUNCTIONS")
    kinds = sorted(row["kind"] for row in junctions)
    assert kinds == ["T", "T", "T", "X", "X", "dead end"]
    assert run.rows("PROBLEMS") == []
    (blind,) = (row for row in junctions if row["kind"] == "dead end")
    assert blind["geometry"].asPoint().x() == pytest.approx(X + 100)
    assert blind["geometry"].asPoint().y() == pytest.approx(Y + 260)
    assert blind["deviation_deg"] == NULL
    assert blind["betweenness"] == pytest.approx(0)

    numbers = run.results
    assert numbers["LENGTH_KM"] == pytest.approx(1.26)
    assert (numbers["SEGMENTS"], numbers["INTERSECTIONS"], numbers["DEAD_ENDS"]) == (9, 5, 1)
    assert (numbers["T_PCT"], numbers["X_PCT"], numbers["Y_PCT"]) == pytest.approx((60, 40, 0))
    assert (numbers["BLOCKS"], numbers["BLOCK_MEDIAN_HA"]) == pytest.approx((4, 1))
    assert numbers["NATURAL_COUNT"] == 6
    assert numbers["MESHEDNESS"] == pytest.approx((9 - 6 + 1) / (2 * 6 - 5))
    assert (numbers["COMPONENTS"], numbers["LARGEST_PCT"]) == (1, 100)
    # the triangle over the north side belongs to the ground
    assert numbers["AREA_KM2"] == pytest.approx(0.04 + 0.006)
    assert numbers["INTERSECTIONS_KM2"] == pytest.approx(5 / 0.046)


def test_numbers_are_those_of_the_site(toolbox):
    run = measure(toolbox, SITE=layer([box(-20, -20, 240, 240)]))
    assert run.results["AREA_KM2"] == pytest.approx(0.24**2)
    assert run.results["LENGTH_KM"] == pytest.approx(1.22)
    # the lane ends outside
    assert run.results["DEAD_ENDS"] == 0
    assert run.rows("OUTPUT")[6]["dead_end"] is True


def test_what_is_not_there_is_not_told(toolbox):
    run = measure(toolbox, streets([LANE]), CENTRALITY=False)
    for key in ("BLOCK_MEAN_HA", "STREET_KM_KM2", "MESHEDNESS", "BETWEENNESS_MAX", "T_PCT"):
        assert run.results[key] is None, key
    (row,) = run.rows("OUTPUT")
    assert row["betweenness"] == row["closeness"] == NULL


def test_options_reach_the_library(toolbox):
    wide = measure(toolbox, WIDTH=20.0, SITE=layer([box(-20, -20, 240, 240)]))
    narrow = measure(toolbox, WIDTH=5.0, SITE=layer([box(-20, -20, 240, 240)]))
    assert wide.results["ROADS_PCT"] > 3 * narrow.results["ROADS_PCT"]
    by_field = measure(toolbox, WIDTH_FIELD="lanes", WIDTH=5.0)
    assert by_field.results["ROADS_PCT"] < wide.results["ROADS_PCT"]
    # a kink of 30 degrees
    bent = streets([line((0, 0), (100, 0)), line((100, 0), (187, 50))])
    assert measure(toolbox, bent).results["NATURAL_COUNT"] == 1
    assert measure(toolbox, bent, MAX_TURN=20.0).results["NATURAL_COUNT"] == 2


def test_a_sample_is_told_of(toolbox):
    lanes = [line((10 * k, 0), (10 * k + 10, 0)) for k in range(40)]
    lanes += [line((10 * k, 0), (10 * k, 9)) for k in range(1, 40)]
    run = measure(toolbox, streets(lanes), EXACT=20, SOURCES=30, SEED=4)
    assert any("estimated from 30 of 80" in text for text in run.said.infos)
    again = measure(toolbox, streets(lanes), EXACT=20, SOURCES=30, SEED=4)
    assert run.results["BETWEENNESS_MAX"] == again.results["BETWEENNESS_MAX"]
    exact = measure(toolbox, streets(lanes))
    assert not any("estimated" in text for text in exact.said.infos)
    assert exact.results["BETWEENNESS_MAX"] != run.results["BETWEENNESS_MAX"]


def test_every_feature_is_kept_whatever_it_is(toolbox):
    shapes = [*GRID, None, GRID[0], line((500, 0), (500, 0))]
    run = measure(toolbox, streets(shapes))
    rows = run.rows("OUTPUT")
    assert [row["lanes"] for row in rows] == list(range(9))
    assert rows[0]["betweenness"] == rows[7]["betweenness"]
    assert rows[6]["geometry"].isNull() or rows[6]["geometry"].isEmpty()
    said = {row["problem"] for row in run.rows("PROBLEMS")}
    assert "geometry is NULL" in said
    assert any("whole length of street" in text for text in said)
    assert run.results["LENGTH_KM"] == pytest.approx(1.2)


def test_features_of_several_parts_and_heights(toolbox):
    parts = f"MULTILINESTRINGZ(({X} {Y} 5,{X + 100} {Y} 5),({X + 100} {Y} 5,{X + 100} {Y + 80} 9))"
    made = layer([parts], kind="MultiLineStringZ", name="parts")
    run = measure(toolbox, made)
    (row,) = run.rows("OUTPUT")
    assert row["length_m"] == pytest.approx(180)
    assert run.results["SEGMENTS"] == 1


def test_bridges_are_listed(toolbox):
    run = measure(toolbox, streets([line((0, -50), (0, 50)), line((-50, 0), (50, 0))]))
    (row,) = run.rows("PROBLEMS")
    assert "without a junction" in row["problem"]
    assert row["severity"] == "info"
    assert row["geometry"].asPoint().x() == pytest.approx(X)
    assert run.results["CROSSINGS"] == 1


def test_inputs_in_degrees_are_measured_in_metres(toolbox):
    from test_bad_input import in_crs

    run = measure(
        toolbox, in_crs(streets(), "EPSG:4326"),
        SITE=in_crs(layer([box(-20, -20, 240, 240)]), "EPSG:3857"),
    )  # fmt: skip
    assert run.results["LENGTH_KM"] == pytest.approx(1.22, rel=0.003)
    assert run.layers["JUNCTIONS"].crs().authid() == "EPSG:4326"
    assert run.rows("OUTPUT")[6]["length_m"] == pytest.approx(60, rel=0.003)


@pytest.mark.parametrize(
    ("made", "more", "text"),
    [
        (lambda: streets(crs=""), dict, "coordinate reference system"),
        (lambda: layer([], kind="LineString", name="void"), dict, "no features"),
        (lambda: layer([None], kind="LineString", name="nothing"), dict, "no lines"),
        (lambda: layer([box(0, 0, 9, 9)]), dict, "geometry|line"),
        (streets, lambda: {"WIDTH_FIELD": "zone"}, "zone"),
        (streets, lambda: {"MAX_TURN": 200.0}, "MAX_TURN|turn"),
    ],
)
def test_what_cannot_be_measured_is_refused_in_words(toolbox, made, more, text):
    with pytest.raises((RefusedError, FailedError), match=text) as caught:
        measure(toolbox, made(), **more())
    assert "something went wrong" not in str(caught.value)


@pytest.mark.parametrize("stage", ["Reading", "Joining", "Measuring", "Computing"])
def test_cancel_leaves_nothing(toolbox, stage):
    run = measure(toolbox, listener=Listener(cancel_at=stage))
    assert run.results == {}


def test_further_styles_fit_what_was_measured(toolbox, package):
    """Every value has its class, in each of the styles that the layers offer."""
    from qgis.core import QgsExpression, QgsExpressionContext, QgsExpressionContextUtils

    styles, kinds = package("plugin.styles"), package("plugin.street_fields")
    run = measure(toolbox)
    for key, kind, titles in (
        ("OUTPUT", kinds.MEASURED_STREETS, {"Betweenness", "Closeness", "Direction", "Dead ends"}),
        ("JUNCTIONS", kinds.MEASURED_JUNCTIONS, {"Kind"}),
        ("NATURAL_STREETS", kinds.NATURAL_STREETS, set()),
    ):
        made = run.layers[key]
        styles.apply(made, kind)
        styles.offer_others(made, kind)
        manager = made.styleManager()
        assert titles <= set(manager.styles())
        for title in manager.styles():
            manager.setCurrentStyle(title)
            renderer = made.renderer()
            expression = QgsExpression(renderer.classAttribute())
            assert not expression.hasParserError(), title
            context = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(made))
            for feature in made.getFeatures():
                context.setFeature(feature)
                value = expression.evaluate(context)
                assert not expression.hasEvalError(), title
                if renderer.type() == "graduatedSymbol":
                    own = [
                        r for r in renderer.ranges() if r.lowerValue() <= value <= r.upperValue()
                    ]
                    assert own, (title, value)
                    assert own[0].label() != "not measured"
                else:
                    # from a file of styles values come back as text
                    own = {str(category.value()) for category in renderer.categories()}
                    assert str(value) in own, (title, value)


def test_a_geopackage_holds_everything_that_was_measured(toolbox, tmp_path):
    """Asking a file for its largest values while its styles are stored leaves it half written."""
    from qgis.core import QgsProcessingContext, QgsProcessingFeedback

    paths = {key: tmp_path / f"{key}.gpkg" for key in ("OUTPUT", "NATURAL_STREETS", "JUNCTIONS")}
    asked = {"INPUT": streets(), **{key: str(path) for key, path in paths.items()}}
    assert toolbox.tool("measurestreets").run(
        asked, QgsProcessingContext(), QgsProcessingFeedback()
    )[1]
    assert sorted(tmp_path.iterdir()) == sorted(paths.values())
    for key, path in paths.items():
        assert path.read_bytes()[18:20] == b"\x01\x01", key
        with contextlib.closing(sqlite3.connect(path)) as base:
            names = [row[0] for row in base.execute("SELECT styleName FROM layer_styles")]
        assert names, key
        # no longer than the column is
        assert max(map(len, names)) <= 30, names


def test_a_shapefile_has_the_styles_that_its_short_names_allow(toolbox, package, tmp_path):
    from qgis.core import QgsExpression, QgsVectorLayer

    styles, kinds = package("plugin.styles"), package("plugin.street_fields")
    path = tmp_path / "measured.shp"
    measure(toolbox, OUTPUT=str(path))
    made = QgsVectorLayer(str(path), "measured", "ogr")
    names = set(made.fields().names())
    assert "betweennes" in names
    styles.offer_others(made, kinds.MEASURED_STREETS)
    manager = made.styleManager()
    assert "Closeness" in manager.styles()
    assert "Betweenness" not in manager.styles()
    for title in manager.styles():
        manager.setCurrentStyle(title)
        value = QgsExpression(made.renderer().classAttribute())
        assert value.referencedColumns() <= names, title


def test_natural_streets_are_made_on_request(toolbox):
    """They would hide the measured streets, which are drawn by the same classes at first."""
    tool = toolbox.tool("measurestreets")
    made = [p.name() for p in tool.destinationParameterDefinitions() if p.createByDefault()]
    assert made == ["OUTPUT", "JUNCTIONS", "PROBLEMS"]


def test_real_streets(toolbox, shared_data, tmp_path):
    for name, table in (("vaduz_li", "streets"),):
        path = tmp_path / f"{name}.gpkg"
        shutil.copyfile(shared_data / "town" / f"{name}.gpkg", path)
        out = tmp_path / "measured.gpkg"
        run = measure(toolbox, f"{path}|layername={table}", OUTPUT=str(out))
        rows = run.rows("OUTPUT")
        assert len(rows) == 508
        assert out.is_file()
        assert all(row["length_m"] > 0 for row in rows)
        numbers = {key: run.results[key] for key in ("ORDER", "CIRCUITY", "ROADS_PCT", "HT_INDEX")}
        assert all(value is not None for value in numbers.values()), numbers
