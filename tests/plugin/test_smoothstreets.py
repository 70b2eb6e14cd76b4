"""Smooth streets, through real QGIS: the layer comes back whole, in its CRS, gentler."""

from __future__ import annotations

import math
import sysconfig

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import (  # noqa: E402
    FailedError,
    Listener,
    RefusedError,
    X,
    Y,
    box,
    layer,
    line,
    point,
    roads,
    site,
)

#: Three by three blocks whose junctions are not quite where they should be.
PLACES = {
    (i, j): (80 * i + (3 * i + 7 * j) % 13 - 6, 80 * j + (5 * i + 11 * j) % 13 - 6)
    for i in range(4)
    for j in range(4)
}
PAIRS = [(a, b) for a in PLACES for b in ((a[0] + 1, a[1]), (a[0], a[1] + 1)) if b in PLACES]
CROOKED = [line(PLACES[a], PLACES[b]) for a, b in PAIRS]


def crooked(**options):
    return layer(
        CROOKED,
        kind="LineString",
        name="my streets",
        fields="field=name:string(20)&field=lanes:integer&field=opened:date&field=width:double",
        values=[[f"street {k}", k, None, 0.1 * k] for k in range(len(CROOKED))],
        **options,
    )


def places(run_or_rows, tolerance=6):
    """Where lines end, rounded, with how many end there."""
    found = {}
    for row in run_or_rows:
        shape = row["geometry"]
        points = list(shape.vertices())
        for p in (points[0], points[-1]):
            key = (round(p.x(), tolerance), round(p.y(), tolerance))
            found[key] = found.get(key, 0) + 1
    return sorted(found.values())


@pytest.fixture(scope="module")
def smooth(toolbox):
    return toolbox.run("smoothstreets", INPUT=crooked())


def test_junctions_become_square_and_the_numbers_tell(smooth):
    told = smooth.results
    assert told["ANGLE_AFTER"] < 0.5 * told["ANGLE_BEFORE"]
    assert told["ANGLE_P90_AFTER"] < told["ANGLE_P90_BEFORE"]
    assert told["ANGLE_BEFORE"] < told["ANGLE_P90_BEFORE"]
    assert told["BENDS_AFTER"] <= told["BENDS_BEFORE"] + 4
    assert 0 < told["LARGEST_MOVE"] <= 20.01
    assert told["LENGTH_BEFORE"] == pytest.approx(24 * 80, rel=0.05)
    assert told["LENGTH_AFTER"] == pytest.approx(told["LENGTH_BEFORE"], rel=0.03)
    assert told["SHORTEST_AFTER"] > 0.6 * told["SHORTEST_BEFORE"]
    assert told["HELD_BACK"] == 0
    assert smooth.rows("PROBLEMS") == []


def test_every_feature_keeps_its_fields_and_its_neighbours(smooth):
    made = smooth.layers["STREETS"]
    names = [f.name() for f in made.fields()]
    assert names == ["name", "lanes", "opened", "width", "moved_m"]
    given = crooked()
    for name in names[:-1]:
        assert made.fields().field(name).type() == given.fields().field(name).type()
    rows = smooth.rows("STREETS")
    assert [r["name"] for r in rows] == [f"street {k}" for k in range(24)]
    assert [r["lanes"] for r in rows] == list(range(24))
    assert [r["width"] for r in rows] == pytest.approx([0.1 * k for k in range(24)])
    before = [{"geometry": f.geometry()} for f in given.getFeatures()]
    assert places(rows) == places(before)
    assert max(r["moved_m"] for r in rows) == pytest.approx(smooth.results["LARGEST_MOVE"])
    assert made.wkbType() == given.wkbType()
    assert made.crs() == given.crs()


def test_figures_are_said_in_the_log(smooth):
    assert any("further than" in text for text in smooth.said.infos)
    assert any(text.startswith("Mean deviation of junction corners") for text in smooth.said.infos)


def in_crs(made, authid):
    """Return a copy of a layer in another CRS."""
    from qgis.core import (
        QgsCoordinateReferenceSystem,
        QgsCoordinateTransform,
        QgsProject,
    )

    turn = QgsCoordinateTransform(
        made.crs(), QgsCoordinateReferenceSystem(authid), QgsProject.instance()
    )
    shapes = [feature.geometry() for feature in made.getFeatures()]
    for shape in shapes:
        shape.transform(turn)
    return layer(shapes, kind="LineString", crs=authid, name=made.name())


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:3857"])
def test_degrees_are_smoothed_in_metres_and_come_back(toolbox, smooth, crs):
    run = toolbox.run("smoothstreets", INPUT=in_crs(crooked(), crs), MAX_MOVE=6)
    assert run.layers["STREETS"].crs().authid() == crs
    assert 1 < run.results["LARGEST_MOVE"] <= 6.01
    assert run.results["LENGTH_BEFORE"] == pytest.approx(smooth.results["LENGTH_BEFORE"], rel=2e-3)
    assert run.results["ANGLE_AFTER"] < 0.5 * run.results["ANGLE_BEFORE"]
    back = in_crs(run.layers["STREETS"], "EPSG:3067")
    moved = [
        new.geometry().hausdorffDistance(old.geometry())
        for new, old in zip(back.getFeatures(), crooked().getFeatures())
    ]
    assert 1 < max(moved) <= 6.05
    assert places(run.rows("STREETS"), 12) == places(smooth.rows("STREETS"))


def test_the_shape_the_strength_and_the_arcs_are_heard(toolbox):
    stairs = [(30 * (k // 2 + k % 2), 30 * (k // 2)) for k in range(21)]
    ground = layer([line(*stairs)], kind="LineString")
    counts = {}
    for shape in ("curved", "straight"):
        run = toolbox.run(
            "smoothstreets", INPUT=ground, SHAPE=shape, STRENGTH=100, MAX_MOVE=20, FILLET_RADIUS=0
        )
        assert run.results["BENDS_BEFORE"] == 19
        assert run.results["BENDS_AFTER"] <= 4
        counts[shape] = sum(1 for _ in run.rows("STREETS")[0]["geometry"].vertices())
    assert counts["straight"] < counts["curved"]
    corner = layer([line((0, 0), (200, 0), (200, 200))], kind="LineString")
    for radius in (0, 10, 30):
        run = toolbox.run("smoothstreets", INPUT=corner, FILLET_RADIUS=radius)
        shape = run.rows("STREETS")[0]["geometry"]
        from qgis.core import QgsGeometry

        gap = shape.distance(QgsGeometry.fromWkt(point(200, 0)))
        assert gap == pytest.approx(radius * (math.sqrt(2) - 1), abs=1.5)
    small = toolbox.run("smoothstreets", INPUT=corner, FILLET_RADIUS=30, FILLET_ANGLE=120)
    assert small.results["BENDS_AFTER"] == 1
    assert sum(1 for _ in small.rows("STREETS")[0]["geometry"].vertices()) < 12


def test_junctions_can_be_left_at_their_angles(toolbox):
    leaning = layer(
        [line((-150, 0), (0, 0)), line((0, 0), (150, 0)), line((0, 0), (40, 100))],
        kind="LineString",
    )
    square = toolbox.run("smoothstreets", INPUT=leaning)
    assert square.results["ANGLE_AFTER"] < 0.4 * square.results["ANGLE_BEFORE"]
    left = toolbox.run("smoothstreets", INPUT=leaning, SQUARE_JUNCTIONS=False)
    assert left.results["LARGEST_MOVE"] < 0.05
    assert any("No street had to move" in text for text in left.said.infos)


def test_streets_keep_off_obstacles_and_stay_in_the_site(toolbox):
    bowed = layer([line((0, 100), (150, 118), (300, 100))], kind="LineString")
    free = toolbox.run("smoothstreets", INPUT=bowed, MAX_MOVE=20)
    wall = layer([box(140, 90, 20, 20)])
    held = toolbox.run("smoothstreets", INPUT=bowed, MAX_MOVE=20, OBSTACLES=wall, SITE=site())
    (shape,) = (r["geometry"] for r in free.rows("STREETS"))
    (kept,) = (r["geometry"] for r in held.rows("STREETS"))
    (ground,) = (f.geometry() for f in wall.getFeatures())
    assert shape.distance(ground) < 5
    assert kept.distance(ground) >= 5.9
    assert held.results["HELD_BACK"] == 1
    told = held.rows("PROBLEMS")
    assert [t["severity"] for t in told] == ["info"]
    assert told[0]["action"] == "moved less than it would"
    assert told[0]["feature"] == "1"


def test_existing_streets_fixed_points_and_the_edge_of_the_site(toolbox):
    streets = layer(
        [line((120, 0), (150, 100), (150, 200)), line((150, 100), (300, 110)),
         line((0, 60), (60, 75), (134, 46))],
        kind="LineString",
        fields="field=status:string(20)",
        values=[["new"], ["existing"], ["new"]],
    )  # fmt: skip
    asked = {"INPUT": streets, "SITE": site(), "MAX_MOVE": 20}
    run = toolbox.run("smoothstreets", **asked)
    first, second, _ = (r["geometry"] for r in run.rows("STREETS"))
    foot = first.vertexAt(0)
    assert foot.y() == pytest.approx(Y, abs=1e-6)
    assert 2 < foot.x() - X - 120 < 25
    assert second.asWkt(3) == next(
        f.geometry().asWkt(3) for f in streets.getFeatures() if f["status"] == "existing"
    )
    pinned = toolbox.run(
        "smoothstreets", **asked, FIXED_POINTS=layer([point(120, 1)], kind="Point")
    )
    foot = pinned.rows("STREETS")[0]["geometry"].vertexAt(0)
    assert (foot.x() - X, foot.y() - Y) == pytest.approx((120, 0))
    still = toolbox.run("smoothstreets", **asked, SLIDING_ENDS=False)
    foot = still.rows("STREETS")[0]["geometry"].vertexAt(0)
    assert (foot.x() - X, foot.y() - Y) == pytest.approx((120, 0))


def test_parts_stay_together_and_numbers_of_rows_are_new(toolbox, tmp_path):
    """A layer of a GeoPackage has a field fid; multi-part lines are one feature each."""
    from qgis.core import QgsVectorLayer

    both = f"MULTILINESTRING({line((0, 0), (60, 8), (120, 0))[10:]},{line((0, 90), (50, 99))[10:]})"
    single = "MULTI" + CROOKED[0].replace("(", "((").replace(")", "))")
    shapes = layer(
        [both, single], kind="MultiLineString", fields="field=fid:integer", values=[[7], [7]]
    )
    path = tmp_path / "made.gpkg"
    run = toolbox.run("smoothstreets", INPUT=shapes, STREETS=str(path))
    rows = run.rows("STREETS")
    assert len(rows) == 2
    assert rows[0]["geometry"].isMultipart()
    assert rows[0]["geometry"].constGet().numGeometries() == 2
    assert rows[0]["moved_m"] > 0.5
    made = QgsVectorLayer(str(path), "made", "ogr")
    assert made.featureCount() == 2
    # What was smoothed can be smoothed again: its own field is not doubled.
    again = toolbox.run("smoothstreets", INPUT=made)
    assert [f.name() for f in again.layers["STREETS"].fields()].count("moved_m") == 1


def test_only_selected_features_are_read(toolbox):
    from qgis.core import QgsProcessingFeatureSourceDefinition, QgsProject

    streets = crooked()
    QgsProject.instance().addMapLayer(streets)
    try:
        streets.selectByIds([f.id() for f in streets.getFeatures()][:9])
        chosen = QgsProcessingFeatureSourceDefinition(streets.id(), True)
        run = toolbox.run("smoothstreets", INPUT=chosen)
    finally:
        QgsProject.instance().removeMapLayer(streets.id())
    assert {r["name"] for r in run.rows("STREETS")} == {f"street {k}" for k in range(9)}


def test_in_a_process_of_its_own_it_gives_the_same(toolbox, smooth, monkeypatch):
    monkeypatch.setenv("PLATWRIGHT_WORKER", "always")
    monkeypatch.setenv("PLATWRIGHT_DEPS", sysconfig.get_paths()["purelib"])
    there = toolbox.run("smoothstreets", INPUT=crooked())
    assert any("a process of its own" in text for text in there.said.warnings)
    names = [f.name() for f in there.layers["STREETS"].fields()]
    assert names == ["name", "lanes", "opened", "width", "moved_m"]
    for one, other in zip(smooth.rows("STREETS"), there.rows("STREETS")):
        assert one["geometry"].asWkt(6) == other["geometry"].asWkt(6)
        assert [one[name] for name in names[:3]] == [other[name] for name in names[:3]]
        assert [one[name] for name in names[3:]] == pytest.approx([other[n] for n in names[3:]])


def test_a_design_is_smoothed(toolbox):
    design = toolbox.run("designstreets", INPUT=site(), ROADS=roads(), RULES="as in the paper",
                         TIME_LIMIT=3, EDGE_LENGTH=40)  # fmt: skip
    run = toolbox.run("smoothstreets", INPUT=design.layers["STREETS"], SITE=site())
    assert run.results["BENDS_AFTER"] <= run.results["BENDS_BEFORE"]
    made = run.layers["STREETS"]
    assert [f.name() for f in made.fields()] == [
        *(f.name() for f in design.layers["STREETS"].fields()), "moved_m",
    ]  # fmt: skip
    for old, new in zip(design.rows("STREETS"), run.rows("STREETS")):
        assert {k: new[k] for k in ("street_id", "level", "status", "name")} == {
            k: old[k] for k in ("street_id", "level", "status", "name")
        }
        assert new["length_m"] == pytest.approx(new["geometry"].length(), abs=0.1)
        if old["status"] == "existing":
            assert new["geometry"].asWkt(6) == old["geometry"].asWkt(6)
    check = toolbox.run("validatenetwork", INPUT=made, SITE=site())
    kinds = {p["kind"] for p in check.rows("PROBLEMS")}
    assert not kinds & {"crossing", "overlap", "outside", "island"}


# Bad input


def complaint(toolbox, **parameters):
    with pytest.raises((RefusedError, FailedError)) as caught:
        toolbox.run("smoothstreets", **parameters)
    text = str(caught.value)
    for stray in ("Traceback", 'File "', "something went wrong", "NoneType", "Error:"):
        assert stray not in text
    return text


def test_layers_that_cannot_be_used_are_refused(toolbox):
    text = complaint(toolbox, INPUT=crooked(crs=""))
    assert "'my streets'" in text
    assert "coordinate reference system" in text
    empty = layer([], kind="LineString", name="bare")
    assert "no features" in complaint(toolbox, INPUT=empty)
    nothing = layer([None, "LINESTRING EMPTY"], kind="LineString", name="nothing")
    assert "no lines" in complaint(toolbox, INPUT=nothing)
    away = layer([box(9000, 0, 50, 50)], name="elsewhere")
    assert "No street lies in the site" in complaint(toolbox, INPUT=crooked(), SITE=away)
    assert "'elsewhere'" in complaint(toolbox, INPUT=crooked(), SITE=away)
    hollow = layer([None], name="hollow")
    assert "no polygon" in complaint(toolbox, INPUT=crooked(), SITE=hollow)


def test_points_are_no_streets(toolbox):
    spots = layer([point(0, 0)], kind="Point", name="spots")
    assert "not a line" in complaint(toolbox, INPUT=spots)


@pytest.mark.parametrize(
    ("key", "value"),
    [("MAX_MOVE", 0), ("STRENGTH", 101), ("FILLET_RADIUS", -1), ("FILLET_ANGLE", 170)],
)
def test_numbers_out_of_range_are_refused(toolbox, key, value):
    with pytest.raises(RefusedError):
        toolbox.run("smoothstreets", INPUT=crooked(), **{key: value})


def test_odd_lines_are_kept_and_told(toolbox):
    shapes = [
        *CROOKED,
        None,
        line((10, 10), (90, 90), (10, 90), (90, 10)),
        line((500, 5), (500, 5)),
    ]
    odd = layer(shapes, kind="LineString")
    run = toolbox.run("smoothstreets", INPUT=odd)
    rows = run.rows("STREETS")
    assert len(rows) == len(shapes)
    assert rows[24]["geometry"].isNull()
    told = {p["feature"]: p["problem"] for p in run.rows("PROBLEMS") if p["severity"] == "warning"}
    assert told["25"] == "geometry is NULL"
    assert told["26"] == "crosses itself"
    assert told["27"] == "has no length"
    assert run.results["ANGLE_AFTER"] < run.results["ANGLE_BEFORE"]


def test_an_empty_layer_of_obstacles_is_none(toolbox):
    run = toolbox.run("smoothstreets", INPUT=crooked(), OBSTACLES=layer([], name="free ground"))
    assert any("has no features" in text for text in run.said.infos)


def test_a_cancelled_run_writes_nothing(toolbox):
    watch = Listener(cancel_at="Preparing the streets")
    run = toolbox.run("smoothstreets", INPUT=crooked(), listener=watch)
    assert run.layers == {}
    assert any("Cancelled before" in text for text in watch.warnings)


def test_the_layer_is_styled_by_how_far_streets_moved(package):
    kind = package("plugin.fields").SMOOTHED_STREETS
    made = layer(CROOKED[:3], kind="LineString", fields="field=moved_m:double",
                 values=[[0.0], [3.0], [44.0]])  # fmt: skip
    package("plugin.styles").apply(made, kind)
    ranges = made.renderer().ranges()
    assert ranges[0].label() == "stayed (under 0.5 m)"
    for value in (0.0, 0.7, 3.0, 7.0, 44.0):
        assert sum(r.lowerValue() <= value < r.upperValue() for r in ranges) == 1
