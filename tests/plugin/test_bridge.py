"""The bridge between QGIS features and GeoDataFrames, its progress and its fields."""

from __future__ import annotations

import sys

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import METRES, Listener, box, layer, line, point  # noqa: E402


@pytest.fixture
def read(package, provider):
    """Read a layer as a tool does."""
    from qgis.core import (
        QgsProcessingContext,
        QgsProcessingParameterFeatureSource,
        QgsProcessingParameters,
        QgsProject,
    )

    bridge, progress = package("plugin.bridge"), package("plugin.progress")
    package("plugin.deps").load()

    def read(made, listener=None):
        context = QgsProcessingContext()
        context.setProject(QgsProject.instance())
        source = QgsProcessingParameters.parameterAsSource(
            QgsProcessingParameterFeatureSource("INPUT"), {"INPUT": made}, context
        )
        return bridge.read_source(source, progress.FeedbackProgress(listener or Listener()))

    return read


def test_attributes_ids_and_crs_arrive(read):
    made = layer(
        [box(0, 0, 10, 10), box(20, 0, 10, 10)],
        fields="field=name:string&field=n:integer&field=x:double",
        values=[["a", 1, 1.5], [None, None, None]],
    )
    frame = read(made)
    assert frame["name"].tolist() == ["a", None]
    assert frame["n"].iloc[0] == 1
    assert frame["x"].iloc[0] == 1.5
    assert frame["x"].isna().tolist() == [False, True]
    assert frame.index.tolist() == [f.id() for f in made.getFeatures()]
    assert frame.crs.to_string() == METRES
    assert frame.area.tolist() == [100, 100]


def test_a_crs_without_authority_arrives_as_text(read):
    from qgis.core import QgsCoordinateReferenceSystem

    made = layer([box(0, 0, 10, 10)])
    own = QgsCoordinateReferenceSystem.fromProj("+proj=tmerc +lat_0=60 +lon_0=25 +units=m")
    made.setCrs(own)
    frame = read(made)
    assert frame.crs.is_projected
    assert "Transverse Mercator" in frame.crs.to_wkt()


def test_a_curve_type_without_curves_arrives_too(read):
    ring = "(0 0,10 0,10 10,0 10,0 0)"
    frame = read(layer([f"CURVEPOLYGON({ring})"], kind="CurvePolygon"))
    assert frame.area.tolist() == [100]


def test_null_empty_and_missing_rows(read):
    frame = read(layer([None, box(0, 0, 1, 1)]))
    assert frame.geometry.isna().tolist() == [True, False]
    assert len(read(layer([]))) == 0


def test_a_column_called_geometry_does_not_replace_the_geometry(read):
    frame = read(layer([box(0, 0, 1, 1)], fields="field=geometry:string", values=[["mine"]]))
    assert frame["geometry_field"].tolist() == ["mine"]
    assert frame.geometry.iloc[0].area == 1


def test_a_filter_and_a_limit_of_processing_count(read):
    from qgis.core import QgsProcessingFeatureSourceDefinition, QgsProject

    made = layer(
        [box(0, 0, 1, 1), box(5, 0, 1, 1), box(9, 0, 1, 1)],
        fields="field=n:integer",
        values=[[1], [2], [3]],
    )
    QgsProject.instance().addMapLayer(made)
    try:
        limited = QgsProcessingFeatureSourceDefinition(made.id(), False, 2)
        assert len(read(limited)) == 2
        made.setSubsetString("n > 1")
        assert read(made.id())["n"].tolist() == [2, 3]
    finally:
        QgsProject.instance().removeMapLayer(made.id())


def test_reading_stops_on_cancel(read, package):
    listener = Listener()
    listener.cancel()
    with pytest.raises(package("plugin.bridge").CancelledWhileReadingError):
        read(layer([box(0, 0, 1, 1)]), listener)


def written(package, frame, key="PROBLEMS"):
    """Write a frame into a memory layer and return its features."""
    from qgis.core import QgsCoordinateReferenceSystem, QgsProcessingContext, QgsProcessingUtils

    kind = getattr(package("plugin.fields"), key)
    context = QgsProcessingContext()
    sink, place = QgsProcessingUtils.createFeatureSink(
        "memory:", context, kind.qgs_fields(), kind.wkb, QgsCoordinateReferenceSystem(METRES)
    )
    package("plugin.bridge").write_frame(frame, kind.qgs_fields(), kind.kinds, sink, kind.wkb)
    del sink
    made = context.takeResultLayer(place)
    return [(f.attributes(), f.geometry().asWkt(1)) for f in made.getFeatures()]


def frame_of(shapes, **columns):
    import geopandas
    import shapely

    return geopandas.GeoDataFrame(
        columns, geometry=[None if s is None else shapely.from_wkt(s) for s in shapes], crs=METRES
    )


def test_every_geometry_becomes_a_point_in_a_point_layer(package, provider):
    package("plugin.deps").load()
    shapes = [point(1, 2), line((0, 0), (10, 0)), box(0, 0, 4, 4), None, "POINT EMPTY"]
    found = written(package, frame_of(shapes, problem=list("abcde")))
    assert found[0][1] == "Point (500001 6700002)"
    assert found[1][1] == "Point (500005 6700000)"
    assert found[2][1] == "Point (500002 6700002)"
    assert found[3][1] == found[4][1] == ""


def test_parts_become_features_where_the_layer_has_single_lines(package, provider):
    package("plugin.deps").load()
    both = "MULTILINESTRING((0 0,1 0),(5 0,9 0))"
    found = written(package, frame_of([both], name=["x"], length_m=[5.0]), "STREETS")
    assert [shape for _, shape in found] == ["LineString (0 0, 1 0)", "LineString (5 0, 9 0)"]


def test_values_are_cast_and_nan_becomes_null(package, provider):
    import numpy as np
    from qgis.core import NULL

    package("plugin.deps").load()
    frame = frame_of(
        [point(0, 0), point(1, 1)],
        junction_id=np.array([1, 2]),
        valence=[3.0, float("nan")],
        is_sink=np.array([True, False]),
        dist_to_sink_m=[float("inf"), 2],
        kind=["crossing", None],
    )
    (first, _), (second, _) = written(package, frame, "JUNCTIONS")
    assert first == [1, NULL, 3, True, NULL, "crossing"]
    assert second == [2, NULL, NULL, False, 2.0, NULL]


def test_moments_have_no_time_zone_and_none_becomes_null(package, provider):
    import datetime

    import pandas
    from qgis.PyQt.QtCore import QDate, QDateTime, Qt, QTime

    bridge, compat = package("plugin.bridge"), package("plugin.compat")
    column = pandas.Series(["2000-01-31T06:30:15", None], dtype="datetime64[ms]")
    first, second = bridge._cast(column.tolist(), "date and time")
    assert first == QDateTime(QDate(2000, 1, 31), QTime(6, 30, 15))
    assert first.timeSpec() == Qt.TimeSpec.LocalTime
    assert second is None
    field = compat.make_field("appeared", "date and time")
    assert field.isDateOrTime()
    assert bridge._plain(first) == datetime.datetime(2000, 1, 31, 6, 30, 15)


def test_search_lines_are_rationed_but_the_last_one_is_told(package):
    state = package("algorithms.progress").SearchState
    listener = Listener()
    progress = package("plugin.progress").FeedbackProgress(listener, 0.2, 0.6)
    for k in range(50):
        progress.search(state(100.0 - k, 40.0, 0.1 * k))
    progress.stage("Next", 0.5)
    assert listener.infos == [
        "Best design 100.0, bound 40.0, gap 60.0 %, after 0.0 s",
        "Best design 51.0, bound 40.0, gap 21.6 %, after 4.9 s",
    ]
    assert listener.stages == ["Next"]
    assert listener.progress() == pytest.approx(40)


def test_a_search_without_a_design_is_told_so(package):
    state = package("algorithms.progress").SearchState
    assert package("plugin.progress").describe_search(state(None, 3.0, 1.0)) == (
        "No design yet, bound 3.0, after 1.0 s"
    )


def test_every_style_fits_its_layer(package, provider):
    from qgis.core import QgsExpression, QgsVectorLayer

    styles, fields = package("plugin.styles"), package("plugin.fields")
    rooms = (
        "building", "city", "explore", "growth", "parcel", "room", "simulation", "street",
        "traffic",
    )  # fmt: skip
    modules = tuple(f"plugin.{own}_fields" for own in rooms)
    every = list(vars(fields).values())
    for name in modules:
        every += vars(package(name)).values()
    kinds = [k for k in every if isinstance(k, fields.LayerKind)]
    tables = [k for k in kinds if not k.style]
    assert all(k.geometry == "NoGeometry" for k in tables)
    kinds = [k for k in kinds if k.style]
    assert {k.style for k in kinds} == set(styles.RENDERERS)
    for kind in kinds:
        made = QgsVectorLayer(f"{kind.geometry}?crs={METRES}", kind.title, "memory")
        made.dataProvider().addAttributes(list(kind.qgs_fields()))
        made.updateFields()
        styles.apply(made, kind)
        names = {f.name for f in kind.fields}
        renderer = made.renderer()
        if renderer.type() != "singleSymbol":
            expression = QgsExpression(renderer.classAttribute())
            assert not expression.hasParserError()
            # features of another layer have its fields, too
            assert kind.like or set(expression.referencedColumns()) <= names


def test_missing_packages_and_old_ones_are_named(package, tmp_path, monkeypatch):
    deps = package("plugin.deps")
    monkeypatch.setitem(deps.PACKAGES, "nosuchthing", deps.guard.Package("nosuch-thing", "1.2"))
    assert deps.missing(["nosuchthing"]) == ["nosuch-thing (version 1.2 or newer)"]
    (tmp_path / "nosuchthing.py").write_text("")
    (tmp_path / "nosuch_thing-1.1.dist-info").mkdir()
    (tmp_path / "nosuch_thing-1.1.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: nosuch-thing\nVersion: 1.1\n"
    )
    monkeypatch.setenv(deps.ENVIRONMENT_VARIABLE, str(tmp_path))
    assert deps.missing(["nosuchthing"]) == ["nosuch-thing (version 1.2 or newer, found 1.1)"]
    with pytest.raises(deps.DependencyError, match=r"found 1\.1"):
        deps.load(["nosuchthing"])
    assert str(tmp_path) not in sys.path


def test_a_package_that_fails_to_load_is_named(package, tmp_path, monkeypatch):
    deps = package("plugin.deps")
    monkeypatch.setitem(deps.PACKAGES, "brokenthing", deps.guard.Package("broken-thing", "0"))
    (tmp_path / "brokenthing.py").write_text("raise ImportError('no libfoo')")
    monkeypatch.setenv(deps.ENVIRONMENT_VARIABLE, str(tmp_path))
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(deps.DependencyError, match="no libfoo"):
        deps.load(["brokenthing"])
