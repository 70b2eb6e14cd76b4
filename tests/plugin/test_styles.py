"""How results look: further styles, heights, whose style counts, groups, names in a batch."""

from __future__ import annotations

import contextlib
import sqlite3
from types import SimpleNamespace

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import box, layer, roads, site  # noqa: E402


@pytest.fixture
def styles(package):
    return package("plugin.styles")


@pytest.fixture
def fields(package):
    return package("plugin.fields")


def streets(distances, status="new"):
    return layer(
        ["LINESTRING(0 0, 1 1)"] * len(distances),
        kind="LineString",
        fields="field=status:string(20)&field=level:integer&field=dist_to_sink_m:double",
        values=[[status, 3, distance] for distance in distances],
    )


def test_distances_are_shown_in_round_classes_that_span_the_layer(styles, fields):
    for distances, step in (([3.0, 100.0], 25), ([640.0], 200), ([None], 10), ([0.0, 5.0], 10)):
        made = streets(distances)
        styles.offer_others(made, fields.STREETS)
        made.styleManager().setCurrentStyle("Distance to the exit")
        renderer = made.renderer()
        assert renderer.type() == "graduatedSymbol"
        ranges = renderer.ranges()
        assert [r.label() for r in ranges[:2]] == ["existing", f"0 to {step} m"]
        for distance in distances:
            value = -1 if distance is None else distance
            assert any(r.lowerValue() <= value <= r.upperValue() for r in ranges), distance


def test_further_styles_leave_the_present_one_alone(styles, fields):
    made = streets([10.0])
    styles.apply(made, fields.STREETS)
    before = made.renderer().dump()
    styles.offer_others(made, fields.STREETS)
    assert made.renderer().dump() == before
    assert set(made.styleManager().styles()) >= {"Distance to the exit"}


def test_every_further_style_fits_its_layer(package, styles):
    renderers = package("plugin.renderers")
    assert set(renderers.OTHERS) <= set(renderers.RENDERERS)
    assert set(renderers.TITLES) == set(renderers.OTHERS)


def test_buildings_have_heights_in_three_dimensions(styles, fields):
    three = pytest.importorskip("qgis._3d")
    made = layer([box(0, 0, 10, 10)], fields="field=height_m:double", values=[[12.0]])
    styles.apply(made, fields.BUILDINGS)
    assert isinstance(made.renderer3D(), three.QgsVectorLayer3DRenderer)
    flat = layer([box(0, 0, 10, 10)])
    styles.apply(flat, fields.SITE)
    assert flat.renderer3D() is None


def stored(path):
    with contextlib.closing(sqlite3.connect(path)) as base:
        rows = base.execute(
            "SELECT f_table_name, styleName, useAsDefault, description FROM layer_styles"
        ).fetchall()
    return {(table, name): (bool(first), text) for table, name, first, text in rows}


def test_a_geopackage_keeps_all_styles(toolbox, tmp_path):
    path = tmp_path / "streets.gpkg"
    toolbox.run("designstreets", INPUT=site(), ROADS=roads(), TIME_LIMIT=1, STREETS=str(path))
    assert {key: first for key, (first, _) in stored(path).items()} == {
        ("streets", "streets"): True,
        ("streets", "streets, Distance to the exit"): False,
    }


def test_a_geopackage_needs_no_other_file_to_be_read(toolbox, tmp_path):
    """In the journal mode of QGIS ("WAL") it would not open from a read-only folder or share."""
    from qgis.core import QgsProcessingContext, QgsProcessingFeedback

    both, one = tmp_path / "both.gpkg", tmp_path / "one.gpkg"
    asked = {
        "INPUT": site(),
        "ROADS": roads(),
        "TIME_LIMIT": 1,
        "STREETS": f"ogr:dbname='{both}' table=\"streets\" (geom)",
        "JUNCTIONS": f"ogr:dbname='{both}' table=\"junctions\" (geom)",
        "BLOCKS": str(one),
    }
    # Nothing is read back here, since the next to close a file would set it right.
    tool = toolbox.tool("designstreets")
    assert tool.run(asked, QgsProcessingContext(), QgsProcessingFeedback())[1]
    for path in (both, one):
        versions = path.read_bytes()[18:20]
        assert versions == b"\x01\x01", path
    assert sorted(p.name for p in tmp_path.iterdir()) == ["both.gpkg", "one.gpkg"]


def own_colour(path, name="planner's"):
    """Store a style of the planner's as the default of a file, as the layer dialog does."""
    from qgis.core import QgsLineSymbol, QgsSingleSymbolRenderer, QgsVectorLayer

    made = QgsVectorLayer(str(path), "own", "ogr")
    symbol = QgsLineSymbol.createSimple({"line_color": "#123456"})
    made.setRenderer(QgsSingleSymbolRenderer(symbol))
    if path.suffix == ".gpkg":
        made.saveStyleToDatabase(name, "mine", True, "")
    else:
        made.saveDefaultStyle()


@pytest.mark.parametrize("ending", [".gpkg", ".shp", ".geojson"])
def test_the_planners_own_default_of_a_file_stays(toolbox, tmp_path, ending):
    from qgis.core import QgsVectorLayer

    path = tmp_path / f"edges{ending}"
    for _ in range(2):
        toolbox.run("candidatemesh", INPUT=site(), EDGES=str(path))
        made = QgsVectorLayer(str(path), "made", "ogr")
        assert made.renderer().type() == "categorizedSymbol"
        del made
    own_colour(path)
    for _ in range(2):
        toolbox.run("candidatemesh", INPUT=site(), EDGES=str(path))
        made = QgsVectorLayer(str(path), "made", "ogr")
        assert made.renderer().type() == "singleSymbol"
        assert made.renderer().symbol().color().name() == "#123456"
        del made
    if ending == ".gpkg":
        assert stored(path)["edges", "planner's"] == (True, "mine")
        assert stored(path)["edges", "edges"][0] is False


def test_a_style_that_was_made_for_another_kind_of_layer_goes(toolbox, tmp_path):
    from qgis.core import QgsVectorLayer

    path = tmp_path / "result.geojson"
    toolbox.run("candidatemesh", INPUT=site(), FACES=str(path))
    toolbox.run("preparesite", INPUT=site(), SITE=str(path))
    made = QgsVectorLayer(str(path), "made", "ogr")
    assert made.renderer().symbol().color().name() == "#a0b060"


def processed(styles, fields, made, *, stored=False, source="", project=None):
    """Let the post-processor have a layer, as Processing does in its main thread."""
    from qgis.core import QgsProcessingContext, QgsProcessingFeedback, QgsProject

    context = QgsProcessingContext()
    context.setProject(project or QgsProject.instance())
    record = SimpleNamespace(attach=lambda _: None)
    processor = styles.post_processor(
        "platwright:designstreets", "STREETS", fields.STREETS, record, source=source, stored=stored
    )
    processor.postProcessLayer(made, context, QgsProcessingFeedback())
    return made


def test_a_new_layer_gets_our_style_with_a_name(styles, fields):
    made = processed(styles, fields, streets([10.0]))
    assert made.renderer().type() == "categorizedSymbol"
    assert set(made.styleManager().styles()) == {"Level", "Distance to the exit"}
    assert made.styleManager().currentStyle() == "Level"


def test_the_planners_style_for_an_output_counts(styles, fields, monkeypatch):
    from processing.gui.RenderingStyles import RenderingStyles

    monkeypatch.setitem(RenderingStyles.styles, "platwright:designstreets", {"STREETS": "mine.qml"})
    assert processed(styles, fields, streets([10.0])).renderer().type() == "singleSymbol"


def test_the_planners_style_for_lines_counts(styles, fields, monkeypatch):
    from processing.core.ProcessingConfig import ProcessingConfig

    def setting(name, *_):
        return "mine.qml" if name == ProcessingConfig.VECTOR_LINE_STYLE else None

    monkeypatch.setattr(ProcessingConfig, "getSetting", staticmethod(setting))
    assert processed(styles, fields, streets([10.0])).renderer().type() == "singleSymbol"


def test_a_style_that_a_model_gave_stays(styles, fields):
    from qgis.core import QgsNullSymbolRenderer

    made = streets([10.0])
    made.setRenderer(QgsNullSymbolRenderer())
    assert processed(styles, fields, made).renderer().type() == "nullSymbol"


def test_a_file_keeps_the_style_that_it_brings(styles, fields):
    assert processed(styles, fields, streets([1.0]), stored=True).renderer().type() == (
        "singleSymbol"
    )


def test_names_that_are_taken_get_the_source_behind_them(styles, fields):
    from qgis.core import QgsProject

    project = QgsProject()
    names = []
    for source in ("north", "south"):
        made = streets([1.0])
        made.setName("Streets")
        project.addMapLayer(made)
        names.append(processed(styles, fields, made, source=source, project=project).name())
    given = streets([1.0])
    given.setName("my own name")
    project.addMapLayer(given)
    names.append(processed(styles, fields, given, source="east", project=project).name())
    assert names == ["Streets", "Streets (south)", "my own name"]


def test_layers_of_a_run_stand_in_a_group(package, fields):
    """As from QGIS 3.32 on, whose details of a layer have these attributes."""
    writer = package("plugin.outputs").Writer
    request = SimpleNamespace(tool=SimpleNamespace(displayName=lambda: "Design streets"))
    made = {
        kind.key: SimpleNamespace(groupName="", layerSortKey=0)
        for kind in (fields.BLOCKS, fields.STREETS, fields.JUNCTIONS)
    }
    several = writer(request, {"A": fields.STREETS, "B": fields.BLOCKS})
    for kind in (fields.BLOCKS, fields.STREETS, fields.JUNCTIONS):
        several._group(made[kind.key], kind, "yard")
    assert {own.groupName for own in made.values()} == {"Design streets: yard"}
    keys = [own.layerSortKey for own in made.values()]
    assert keys == sorted(keys)
    assert len(set(keys)) == len(keys)
    alone = SimpleNamespace(groupName="")
    writer(request, {"A": fields.STREETS})._group(alone, fields.STREETS, "yard")
    assert alone.groupName == ""
    old = SimpleNamespace()
    several._group(old, fields.STREETS, "")
    assert not vars(old)


def test_the_group_reaches_processing(toolbox):
    from qgis.core import (
        QgsProcessingContext,
        QgsProcessingOutputLayerDefinition,
        QgsProject,
    )

    run = toolbox.run(
        "candidatemesh",
        INPUT=site(),
        EDGES=QgsProcessingOutputLayerDefinition("TEMPORARY_OUTPUT", QgsProject.instance()),
        VERTICES=QgsProcessingOutputLayerDefinition("TEMPORARY_OUTPUT", QgsProject.instance()),
    )
    loaded = list(run.context.layersToLoadOnCompletion().values())
    assert len(loaded) == 2
    assert all(details.postProcessor() for details in loaded)
    if not hasattr(QgsProcessingContext.LayerDetails, "groupName"):
        return
    assert {details.groupName for details in loaded} == {"Candidate mesh: my site"}


def test_names_of_stored_styles_fit_a_geopackage(package):
    """GDAL warns of longer ones, and others could not be told apart."""
    styles = package("plugin.styles")
    for style, others in styles.OTHERS.items():
        names = [styles.stored_name(style, title) for title in others]
        assert len(set(names)) == len(names)
        assert all(len(name) <= styles.LONGEST for name in [style, *names]), names
