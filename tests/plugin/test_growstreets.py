"""Streets that grow from a grammar, through real QGIS."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
import sysconfig
import time

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

import test_binary as binary  # noqa: E402
from qgis.core import QgsCoordinateReferenceSystem, QgsGeometry, QgsVectorLayer  # noqa: E402
from support import (  # noqa: E402
    METRES,
    Listener,
    RefusedError,
    X,
    Y,
    box,
    complaints_of,
    layer,
    line,
    point,
    site,
)

# Its fixtures serve here, too.
environment = binary.environment
qgis_process = binary.qgis_process

KINDS = ("organic", "grid", "hex", "line", "radial", "suburb")
#: Streets that fill the field with the grid.
SMALL = {"SCALE": 40, "GRAMMAR": "grid"}


def ground(width=500, height=400):
    return layer([box(0, 0, width, height)], name="field")


def ring(width=500, height=400):
    corners = [(0, 0), (width, 0), (width, height), (0, height), (0, 0)]
    sides = [line(a, b) for a, b in itertools.pairwise(corners)]
    inward = line((width / 2, -100), (width / 2, 0))
    return layer(
        [*sides, inward], kind="LineString", name="around",
        fields="field=name:string(20)&field=highway:string(20)",
        values=[["South", "residential"], ["East", "tertiary"], ["North", "residential"],
                ["West", "residential"], ["Mill Lane", "secondary"]],
    )  # fmt: skip


def grown(run):
    return [row for row in run.rows("STREETS") if row["iteration"] > 0]


def existing(run):
    return [row for row in run.rows("STREETS") if row["status"] == "existing"]


def length(rows):
    return sum(row["geometry"].length() for row in rows)


def union(rows):
    return QgsGeometry.unaryUnion([row["geometry"] for row in rows])


def shapes(run, key):
    return [row["geometry"].asWkb() for row in run.rows(key)]


def ends(row):
    points = row["geometry"].asPolyline()
    return points[0], points[-1]


complaint = complaints_of("growstreets")


@pytest.fixture(scope="module")
def made(toolbox):
    return toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), **SMALL)


def test_streets_grow_into_the_site_and_meet_in_junctions(made):
    rows = made.rows("STREETS")
    assert len(grown(made)) > 40
    inside = QgsGeometry.fromWkt(box(-0.01, -0.01, 500.02, 400.02))
    assert all(inside.contains(row["geometry"]) for row in grown(made))
    # Two streets have no more in common than their ends.
    for one, other in itertools.combinations(rows, 2):
        if not one["geometry"].boundingBox().intersects(other["geometry"].boundingBox()):
            continue
        common = one["geometry"].intersection(other["geometry"])
        if common.isNull() or common.isEmpty():
            continue
        assert common.length() < 0.01, (one["street_id"], other["street_id"])
        for vertex in common.vertices():
            gap = min(
                end.distance(vertex.x(), vertex.y()) for row in (one, other) for end in ends(row)
            )
            assert gap < 0.01, (one["street_id"], other["street_id"])


def test_fields_say_what_they_are(made):
    levels = {"main": 1, "large": 2, "small": 3}
    for row in grown(made):
        assert row["status"] == "new"
        assert row["level"] == levels[row["road_type"]]
        assert row["length_m"] == pytest.approx(row["geometry"].length(), rel=1e-3)
        assert row["speed_kmh"] > 0
        assert row["start_state"]
    assert {row["name"] for row in existing(made)} >= {"South", "East", "North", "West"}
    # As many streets end in a node as it says.
    count = {}
    for row in made.rows("STREETS"):
        for end in ends(row):
            place = (round(end.x(), 2), round(end.y(), 2))
            count[place] = count.get(place, 0) + 1
    nodes = made.rows("NODES")
    for row in nodes:
        at = row["geometry"].asPoint()
        assert row["degree"] == count[round(at.x(), 2), round(at.y(), 2)]
    assert len(nodes) == len(count)


def test_existing_roads_stay_where_they_are(made):
    before = union([{"geometry": f.geometry()} for f in ring().getFeatures()])
    inside = before.intersection(QgsGeometry.fromWkt(box(-1, -1, 502, 402)))
    after = union(existing(made))
    assert after.length() >= inside.length() - 2
    assert after.difference(before.buffer(0.01, 4)).length() < 0.1


def test_roads_and_blocks_are_those_of_the_streets(made):
    per_road = {}
    for row in grown(made):
        per_road.setdefault(row["road"], []).append(row)
    for row in made.rows("ROADS_MERGED"):
        own = per_road.pop(row["road"])
        assert row["segments"] == len(own)
        assert row["length_m"] == pytest.approx(length(own), rel=1e-3)
        assert row["first_iteration"] == min(s["iteration"] for s in own)
    assert not per_road
    blocks = made.rows("BLOCKS")
    assert sum(row["area_m2"] for row in blocks) == pytest.approx(500 * 400, rel=0.01)
    assert union(blocks).area() == pytest.approx(500 * 400, rel=0.01)


def test_numbers_tell_of_the_layers(made):
    told = made.results
    assert told["SEGMENTS"] == len(grown(made))
    assert told["TOTAL_LENGTH"] == pytest.approx(length(grown(made)), rel=1e-3)
    assert told["POPULATION_REACHED"] == pytest.approx(1.5415 * told["TOTAL_LENGTH"])
    assert told["BLOCK_COUNT"] == len(made.rows("BLOCKS"))
    assert told["ROAD_COUNT"] == len(made.rows("ROADS_MERGED"))
    assert told["DEAD_ENDS_LEFT"] == sum(row["kind"] == "dead end" for row in made.rows("NODES"))
    assert told["STOPPED"]
    steps = made.rows("STEPS")
    assert told["ITERATIONS_DONE"] == len(steps) < 100
    assert [row["iteration"] for row in steps] == list(range(1, len(steps) + 1))
    assert steps[-1]["segments"] == len(grown(made))
    assert steps[-1]["length_m"] == pytest.approx(told["TOTAL_LENGTH"], rel=1e-3)


def test_steps_are_made_on_request(toolbox):
    tool = toolbox.tool("growstreets")
    assert tool.parameterDefinition("STEPS").createByDefault() is False
    made = [p.name() for p in tool.destinationParameterDefinitions() if p.createByDefault()]
    # Nodes and roads lie over the streets, which they would hide.
    assert made == ["STREETS", "BLOCKS", "PROBLEMS"]


def test_the_choices_are_the_grammars_that_come_along(toolbox, package):
    shipped = package("algorithms.growth.grammars.shipped").GRAMMARS
    assert set(toolbox.tool("growstreets").parameterDefinition("GRAMMAR").options()) == set(shipped)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_streets_fills_the_site(toolbox, kind):
    run = toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), GRAMMAR=kind, SCALE=25)
    # Streets reach into every quarter of the site.
    for x, y in itertools.product((0, 250), (0, 200)):
        quarter = QgsGeometry.fromWkt(box(x, y, 250, 200))
        assert union(grown(run)).intersection(quarter).length() > 150, (kind, x, y)


# Time


def moments(run, key="STREETS"):
    return [row["appeared"] for row in run.rows(key)]


def test_each_iteration_has_a_day(made):
    from qgis.PyQt.QtCore import QDate, QTime

    for key in ("STREETS", "NODES", "BLOCKS"):
        for row in made.rows(key):
            assert row["appeared"].date() == QDate(2000, 1, 1).addDays(row["iteration"])
            assert row["appeared"].time() == QTime(0, 0)
    for row in made.rows("ROADS_MERGED"):
        assert row["appeared"].date() == QDate(2000, 1, 1).addDays(row["first_iteration"])


def day(number):
    """Return the range of time of a day, from 1 January 2000 on, as the controller asks for it."""
    from qgis.core import QgsDateTimeRange
    from qgis.PyQt.QtCore import QDate, QDateTime, QTime

    begin = QDateTime(QDate(2000, 1, 1).addDays(number), QTime(0, 0))
    return QgsDateTimeRange(begin, begin.addDays(1), True, False)


def shown(played, number):
    """Return the iterations of what is shown on a day."""
    from qgis.core import QgsFeatureRequest, QgsVectorLayerTemporalContext

    context = QgsVectorLayerTemporalContext()
    context.setLayer(played)
    settings = played.temporalProperties()
    assert settings.isActive()
    asked = settings.createFilterString(context, day(number))
    assert asked
    request = QgsFeatureRequest().setFilterExpression(asked)
    return sorted(feature["iteration"] for feature in played.getFeatures(request))


def kinds_of(package):
    kinds = package("plugin.growth_fields")
    return {"STREETS": kinds.STREETS, "NODES": kinds.NODES, "BLOCKS": kinds.BLOCKS}


@pytest.mark.parametrize("key", ["STREETS", "NODES", "BLOCKS"])
def test_the_layers_play_in_the_temporal_controller(made, package, key):
    played = made.layers[key]
    package("plugin.styles").apply(played, kinds_of(package)[key])
    every = sorted(row["iteration"] for row in made.rows(key))
    for number in (0, 1, 3, max(every), max(every) + 5):
        assert shown(played, number) == [k for k in every if k <= number]


def ink(played, number):
    """Return how many pixels of a map of a day are not empty."""
    from qgis.core import QgsMapRendererSequentialJob, QgsMapSettings
    from qgis.PyQt.QtCore import QSize
    from qgis.PyQt.QtGui import QColor

    settings = QgsMapSettings()
    settings.setLayers([played])
    settings.setDestinationCrs(played.crs())
    settings.setOutputSize(QSize(250, 200))
    settings.setExtent(played.extent())
    settings.setBackgroundColor(QColor("#ffffff"))
    if number is not None:
        settings.setIsTemporal(True)
        settings.setTemporalRange(day(number))
    job = QgsMapRendererSequentialJob(settings)
    job.start()
    job.waitForFinished()
    picture = job.renderedImage()
    white = QColor("#ffffff").rgb()
    return sum(picture.pixel(x, y) != white for x in range(250) for y in range(200))


def test_maps_of_later_days_have_more_streets(made, package):
    played = made.layers["STREETS"]
    package("plugin.styles").apply(played, kinds_of(package)["STREETS"])
    last = made.results["ITERATIONS_DONE"]
    drawn = [ink(played, number) for number in (0, 2, 4, last)]
    assert 0 < drawn[0] < drawn[1] < drawn[2] <= drawn[3]
    # Without the controller everything is there.
    assert ink(played, None) == drawn[3]


def test_a_geopackage_keeps_how_it_plays(toolbox, tmp_path):
    path = tmp_path / "streets.gpkg"
    toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), STREETS=str(path), **SMALL)
    stored = QgsVectorLayer(str(path), "stored", "ogr")
    assert stored.renderer().type() == "categorizedSymbol"
    # The window of QGIS does so once more when it has opened a file.
    assert stored.loadDefaultStyle()[1]
    every = sorted(feature["iteration"] for feature in stored.getFeatures())
    assert shown(stored, 3) == [k for k in every if k <= 3]
    assert len(every) > len(shown(stored, 3)) > 0


def test_a_file_that_processing_loads_plays(toolbox, package, tmp_path):
    from types import SimpleNamespace

    from qgis.core import QgsProcessingContext, QgsProcessingFeedback

    path = tmp_path / "streets.gpkg"
    toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), STREETS=str(path), **SMALL)
    loaded = QgsVectorLayer(str(path), "loaded", "ogr")
    processor = package("plugin.styles").post_processor(
        "platwright:growstreets", "STREETS", kinds_of(package)["STREETS"],
        SimpleNamespace(attach=lambda _: None), stored=True,
    )  # fmt: skip
    processor.postProcessLayer(loaded, QgsProcessingContext(), QgsProcessingFeedback())
    assert loaded.renderer().type() == "categorizedSymbol"
    assert set(shown(loaded, 2)) <= {0, 1, 2}


def test_other_layers_do_not_play(made, package):
    fields = package("plugin.fields")
    plain = site()
    package("plugin.styles").apply(plain, fields.SITE)
    assert not plain.temporalProperties().isActive()
    # a format without moments has made a text of it
    text = layer([point(0, 0)], kind="Point", fields="field=appeared:string(30)")
    package("plugin.temporal").play(text, kinds_of(package)["NODES"])
    assert not text.temporalProperties().isActive()


_ELSEWHERE = """
import sys
from qgis.core import QgsApplication, QgsVectorLayer
application = QgsApplication([], False)
application.initQgis()
stored = QgsVectorLayer(sys.argv[1], "stored", "ogr")
print({f["appeared"].toString("yyyy-MM-dd HH:mm") for f in stored.getFeatures() if
       f["iteration"] == 1})
sys.stdout.flush()
import os
os._exit(0)
"""


def test_a_day_is_the_same_day_in_any_time_zone(toolbox, tmp_path, environment):
    path = tmp_path / "streets.gpkg"
    toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), STREETS=str(path), **SMALL)
    for zone in ("Pacific/Auckland", "America/Los_Angeles"):
        done = subprocess.run(
            [sys.executable, "-c", _ELSEWHERE, str(path)], env={**environment, "TZ": zone},
            capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert "{'2000-01-02 00:00'}" in done.stdout, done.stdout + done.stderr


# What is asked for


def test_growth_goes_on_from_loose_ends_and_over_open_ground(toolbox):
    lane = layer([line((0, 0), (200, 0))], kind="LineString", name="lane")
    run = toolbox.run("growstreets", ROADS=lane, MAX_LENGTH=3000, **SMALL)
    assert 3000 <= run.results["TOTAL_LENGTH"] < 3300
    assert "length" in run.results["STOPPED"] or "m of" in run.results["STOPPED"]
    # All of it hangs together with the lane.
    whole = QgsGeometry.unaryUnion([r["geometry"].buffer(0.05, 2) for r in run.rows("STREETS")])
    assert not whole.isMultipart() or len(whole.asGeometryCollection()) == 1
    assert run.layers["STREETS"].crs().authid() == METRES


def test_growth_begins_at_the_points_that_are_given(toolbox):
    points = layer([point(100, 100), point(400, 300)], kind="Point", name="centres")
    run = toolbox.run("growstreets", INPUT=ground(), START_POINTS=points, **SMALL)
    starts = [row["geometry"].asPoint() for row in run.rows("NODES") if row["iteration"] == 0]
    for x, y in ((100, 100), (400, 300)):
        assert min(at.distance(X + x, Y + y) for at in starts) < 0.01
    first = [row for row in grown(run) if row["iteration"] == 1]
    for row in first:
        gap = min(end.distance(X + x, Y + y) for end in ends(row)
                  for x, y in ((100, 100), (400, 300)))  # fmt: skip
        assert gap < 0.01


def test_points_alone_are_ground_enough(toolbox):
    points = layer([point(0, 0)], kind="Point", name="centre")
    run = toolbox.run("growstreets", START_POINTS=points, MAX_SEGMENTS=30, GRAMMAR="grid")
    assert run.layers["STREETS"].crs().authid() == METRES
    assert 30 <= run.results["SEGMENTS"] <= 40
    where = union(grown(run)).boundingBox()
    assert where.contains(QgsGeometry.fromWkt(point(0, 0)).asPoint())


def test_nothing_but_a_crs_will_do(toolbox):
    crs = QgsCoordinateReferenceSystem("EPSG:25832")
    run = toolbox.run("growstreets", CRS=crs, ITERATIONS=4, GRAMMAR="line", DIRECTION=90)
    assert run.layers["STREETS"].crs().authid() == "EPSG:25832"
    assert run.results["ITERATIONS_DONE"] == 4
    box_of = union(grown(run)).boundingBox()
    assert box_of.width() > box_of.height()
    north = toolbox.run("growstreets", CRS=crs, ITERATIONS=4, GRAMMAR="line", DIRECTION=0)
    box_of = union(grown(north)).boundingBox()
    assert box_of.height() > box_of.width()


def test_the_crs_is_that_of_the_project_unless_told_otherwise(toolbox):
    from qgis.core import QgsProject

    project = QgsProject.instance()
    before = project.crs()
    try:
        project.setCrs(QgsCoordinateReferenceSystem("EPSG:3879"))
        run = toolbox.run("growstreets", ITERATIONS=2)
        assert run.layers["STREETS"].crs().authid() == "EPSG:3879"
        project.setCrs(QgsCoordinateReferenceSystem("EPSG:4326"))
        text = complaint(toolbox, ITERATIONS=2)
        assert "not in metres" in text
        assert "Coordinate reference system" in text
    finally:
        project.setCrs(before)


@pytest.mark.parametrize(
    ("limit", "value", "told"),
    [("ITERATIONS", 3, "ITERATIONS_DONE"), ("MAX_SEGMENTS", 25, "SEGMENTS"),
     ("MAX_LENGTH", 1500, "TOTAL_LENGTH"), ("POPULATION", 2000, "POPULATION_REACHED")],
)  # fmt: skip
def test_each_limit_stops_it(toolbox, limit, value, told):
    run = toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), **{limit: value}, **SMALL)
    assert value <= run.results[told] <= 1.2 * value
    free = toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), **SMALL)
    assert free.results["TOTAL_LENGTH"] > run.results["TOTAL_LENGTH"]


def test_obstacles_and_holes_stay_free(toolbox):
    pond = layer([box(180, 120, 120, 120)], name="pond")
    for edge in ("stop", "join"):
        run = toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), OBSTACLES=pond,
                          OBSTACLE_EDGE=edge, **SMALL)  # fmt: skip
        inner = QgsGeometry.fromWkt(box(180.1, 120.1, 119.8, 119.8))
        assert union(run.rows("STREETS")).intersection(inner).length() < 0.1
        corners = [(180, 120), (300, 120), (300, 240), (180, 240), (180, 120)]
        shore = QgsGeometry.fromWkt(line(*corners))
        along = union(run.rows("STREETS")).intersection(shore.buffer(0.1, 4)).length()
        assert (along > 470) == (edge == "join"), along


def test_obstacles_beside_the_site_stay_free(toolbox):
    # the site ends 20 m before the roads; houses stand between
    site = layer([box(20, 20, 460, 360)], name="field")
    houses = [box(40 + 60 * k, 4, 40, 12) for k in range(7)]
    for snap in (30, 60):
        run = toolbox.run("growstreets", INPUT=site, ROADS=ring(), SNAP_DISTANCE=snap,
                          OBSTACLES=layer(houses, name="houses"), **SMALL)  # fmt: skip
        assert len(grown(run)) > 20
        for house in houses:
            assert union(grown(run)).intersection(QgsGeometry.fromWkt(house)).length() < 0.1
        lines = [row["geometry"] for row in grown(run)]
        outside = [one.difference(QgsGeometry.fromWkt(box(18.9, 18.9, 462.2, 362.2)))
                   for one in lines]  # fmt: skip
        assert sum(one.length() > 0.1 for one in outside) > 0
        assert max(one.length() for one in outside) < 41


def test_dead_ends_go_where_they_are_not_wanted(toolbox):
    kept, gone = (
        toolbox.run(
            "growstreets", INPUT=ground(), ROADS=ring(), DEAD_ENDS=word, ITERATIONS=4, **SMALL
        )
        for word in ("keep", "remove")
    )
    assert kept.results["DEAD_ENDS_LEFT"] > 0
    assert gone.results["DEAD_ENDS_LEFT"] == 0
    assert gone.results["TOTAL_LENGTH"] < kept.results["TOTAL_LENGTH"]


def test_growth_begins_anew_in_blocks_that_are_too_large(toolbox):
    asked = {"INPUT": ground(), "ROADS": ring(), "GRAMMAR": "organic", "SCALE": 45}
    bare = toolbox.run("growstreets", LARGEST_BLOCK=0, **asked)
    full = toolbox.run("growstreets", LARGEST_BLOCK=1, **asked)
    most = [max(row["geometry"].area() for row in run.rows("BLOCKS")) for run in (bare, full)]
    assert most[0] > 30000
    assert most[1] < 15000
    # It went on from what had grown.
    union_of = union(full.rows("STREETS")).buffer(0.05, 4)
    assert all(union_of.contains(row["geometry"]) for row in grown(bare))
    steps = full.rows("STEPS")
    assert [row["iteration"] for row in steps] == list(range(1, len(steps) + 1))
    assert [row["segments"] for row in steps] == sorted(row["segments"] for row in steps)
    assert steps[-1]["segments"] == full.results["SEGMENTS"] == len(grown(full))
    assert steps[-1]["length_m"] == pytest.approx(full.results["TOTAL_LENGTH"], rel=1e-3)


def test_dead_ends_of_existing_streets_do_not_count(toolbox):
    stub = [line((0, 200), (60, 200)), line((500, 20), (470, 20))]
    given = layer([*[f.geometry() for f in ring().getFeatures()], *stub], kind="LineString")
    asked = {"ITERATIONS": 3, "DEAD_ENDS": "remove", **SMALL}
    run = toolbox.run("growstreets", INPUT=ground(), ROADS=given, **asked)
    left = [row for row in run.rows("NODES") if row["kind"] == "dead end"]
    ending = {(round(p.x(), 2), round(p.y(), 2)) for row in grown(run) for p in ends(row)}
    places = {(round(p.x(), 2), round(p.y(), 2)) for p in (r["geometry"].asPoint() for r in left)}
    assert places
    assert not places & ending
    assert run.results["DEAD_ENDS_LEFT"] == 0


def test_as_published_leaves_touches_without_a_junction(toolbox):
    crs = QgsCoordinateReferenceSystem(METRES)
    asked = {"CRS": crs, "MAX_SEGMENTS": 2000, "GRAMMAR": "line", "SCALE": 100}

    def touching(run):
        """Count nodes that lie on a street without being an end of it."""
        from qgis.core import QgsSpatialIndex

        streets = {f.id(): f.geometry() for f in run.layers["STREETS"].getFeatures()}
        index = QgsSpatialIndex(run.layers["STREETS"].getFeatures())
        found = 0
        for row in run.rows("NODES"):
            node = row["geometry"]
            for near in index.intersects(node.boundingBox().buffered(0.02)):
                points = streets[near].asPolyline()
                gap = min(end.distance(node.asPoint()) for end in (points[0], points[-1]))
                found += streets[near].distance(node) < 0.01 and gap > 0.02
        return found

    assert touching(toolbox.run("growstreets", AS_PUBLISHED=True, **asked)) > 0
    assert touching(toolbox.run("growstreets", **asked)) == 0


@pytest.fixture
def own_grammar(package, tmp_path):
    """Write the grammar of the grid as a file of one's own, with a change or without."""

    def write(change=None):
        text = package("algorithms.growth.grammars.file").grammar_text(
            package("algorithms.growth.grammars.shipped").shipped_grammar("grid")
        )
        data = json.loads(text)
        if change is not None:
            change(data)
        path = tmp_path / "own.json"
        path.write_text(json.dumps(data), encoding="utf-8")
        return str(path)

    return write


def test_a_grammar_of_ones_own_is_followed(toolbox, made, own_grammar):
    path = own_grammar()
    other = {**SMALL, "GRAMMAR": "hex", "GRAMMAR_FILE": path}
    run = toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), **other)
    assert shapes(run, "STREETS") == shapes(made, "STREETS")


def test_what_is_odd_about_a_grammar_is_told(toolbox, own_grammar):
    def never_used(data):
        data["rules"]["sT"] = data["rules"]["mStart"]

    other = {**SMALL, "GRAMMAR_FILE": own_grammar(never_used)}
    run = toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), **other)
    assert any("sT" in text and "never used" in text for text in run.said.warnings)


def test_without_roads_it_tells_where_streets_begin(toolbox):
    run = toolbox.run("growstreets", INPUT=ground(), **SMALL)
    (told,) = [text for text in run.said.infos if "road layer" in text]
    assert "middle of each site" in told
    assert "edge" not in told


def test_a_faulty_grammar_is_refused_before_the_run(toolbox, own_grammar, tmp_path):
    with pytest.raises(RefusedError) as caught:
        toolbox.run("growstreets", GRAMMAR_FILE=str(tmp_path / "none.json"), INPUT=ground())
    assert "none.json" in str(caught.value)
    broken = tmp_path / "broken.json"
    broken.write_text("{", encoding="utf-8")
    text = complaint(toolbox, GRAMMAR_FILE=str(broken), INPUT=ground())
    assert "broken.json" in text

    def spoil(data):
        rules = next(iter(data["rules"].values()))
        rules[0]["occurProb"] = -1

    text = complaint(toolbox, GRAMMAR_FILE=own_grammar(spoil), INPUT=ground())
    assert "occurProb" in text
    assert "rule" in text


def test_what_cannot_be_used_is_refused_with_the_way_out(toolbox):
    assert "'my site'" in complaint(toolbox, INPUT=site(crs=""))
    assert "'empty'" in complaint(toolbox, INPUT=layer([], name="empty"))
    assert "'hollow'" in complaint(toolbox, INPUT=layer([None], name="hollow"))
    degrees = QgsCoordinateReferenceSystem("EPSG:4326")
    assert "not in metres" in complaint(toolbox, CRS=degrees)
    pond = layer([box(0, 0, 10, 10)], name="pond")
    assert "Obstacles" in complaint(toolbox, ROADS=ring(), OBSTACLES=pond)
    # what is missing is a site and no CRS
    assert "Obstacles" in complaint(toolbox, OBSTACLES=pond)
    far = layer([point(5000, 5000)], kind="Point", name="far")
    assert "outside" in complaint(toolbox, INPUT=ground(), START_POINTS=far)
    with pytest.raises(RefusedError):
        toolbox.run("growstreets", INPUT=ground(), ITERATIONS=0)
    with pytest.raises(RefusedError):
        toolbox.run("growstreets", INPUT=ground(), GRAMMAR="baroque")


def test_any_crs_and_odd_roads(toolbox, made):
    from test_parcelblocks import in_crs

    run = toolbox.run(
        "growstreets",
        INPUT=in_crs(ground(), "EPSG:4326", "Polygon"),
        ROADS=in_crs(ring(), "EPSG:3857", "LineString"),
        **SMALL,
    )
    assert run.layers["STREETS"].crs().authid() == "EPSG:4326"
    assert run.results["TOTAL_LENGTH"] == pytest.approx(made.results["TOTAL_LENGTH"], rel=0.25)
    crossing = layer(
        [line((-50, 200), (550, 200)), line((250, -50), (250, 450)), None, line((0, 0), (0, 0))],
        kind="LineString", name="crossing",
    )  # fmt: skip
    odd = toolbox.run("growstreets", INPUT=ground(), ROADS=crossing, **SMALL)
    assert len(grown(odd)) > 20
    cross = [
        row
        for row in odd.rows("NODES")
        if row["geometry"].distance(QgsGeometry.fromWkt(point(250, 200))) < 0.05
    ]
    assert [row["degree"] for row in cross] == [4]


def test_a_road_that_arrives_is_frontage_enough(toolbox):
    """Streets grow from its end; where there is none they begin in the middle of the site."""
    lane = layer([line((0, -50), (0, 0))], kind="LineString", name="lane")
    far = layer([line((0, -5000), (0, -4000))], kind="LineString", name="far")
    for roads in (lane, far):
        run = toolbox.run("growstreets", INPUT=ground(), ROADS=roads, **SMALL)
        assert grown(run)
        said = [row["problem"] + row["action"] for row in run.rows("PROBLEMS")]
        assert not any("sink" in text or "frontage" in text for text in said), said
        assert any("else in the middle of the site" in text for text in said), said


def test_roads_inside_stay_unless_told_otherwise(toolbox):
    across = layer([line((-50, 180), (550, 220))], kind="LineString", name="across")
    kept = toolbox.run("growstreets", INPUT=ground(), ROADS=across, **SMALL)
    inner = QgsGeometry.fromWkt(box(10, 10, 480, 380))
    assert union(existing(kept)).intersection(inner).length() > 400
    left = toolbox.run("growstreets", INPUT=ground(), ROADS=across, INNER_ROADS="ignore", **SMALL)
    assert union(existing(left)).intersection(inner).length() < 1 if existing(left) else True


def test_the_same_seed_gives_the_same(toolbox, made):
    asked = {"INPUT": ground(), "ROADS": ring(), **SMALL}
    again = toolbox.run("growstreets", **asked)
    assert shapes(made, "STREETS") == shapes(again, "STREETS")
    assert shapes(made, "BLOCKS") == shapes(again, "BLOCKS")
    other = toolbox.run("growstreets", SEED=7, **asked)
    assert shapes(made, "STREETS") != shapes(other, "STREETS")


def test_inputs_are_not_modified(toolbox):
    given = [ground(), ring()]
    before = [[f.geometry().asWkb() for f in one.getFeatures()] for one in given]
    toolbox.run("growstreets", INPUT=given[0], ROADS=given[1], **SMALL)
    assert [[f.geometry().asWkb() for f in one.getFeatures()] for one in given] == before


def test_cancelling_keeps_what_has_grown(toolbox):
    from threading import Timer

    class Watch(Listener):
        """Notes when growth has stopped."""

        collecting = 0.0

        def setProgressText(self, text):  # noqa: N802
            super().setProgressText(text)
            if text == "Collecting the layers":
                self.collecting = time.monotonic()

    watch, pressed = Watch(), []

    def press():
        pressed.append(time.monotonic())
        watch.cancel()

    Timer(1.5, press).start()
    crs = QgsCoordinateReferenceSystem(METRES)
    run = toolbox.run("growstreets", CRS=crs, ITERATIONS=100_000, listener=watch)
    assert watch.collecting - pressed[0] < 1.0
    assert any("what had grown by then" in text for text in watch.warnings)
    assert len(grown(run)) > 50
    assert run.results["ITERATIONS_DONE"] < 100_000


def test_in_a_process_of_its_own_it_gives_the_same(toolbox, made, monkeypatch):
    monkeypatch.setenv("PLATWRIGHT_WORKER", "always")
    monkeypatch.setenv("PLATWRIGHT_DEPS", sysconfig.get_paths()["purelib"])
    there = toolbox.run("growstreets", INPUT=ground(), ROADS=ring(), **SMALL)
    assert any("a process of its own" in text for text in there.said.warnings)
    for one, other in zip(made.rows("STREETS"), there.rows("STREETS")):
        assert one["geometry"].asWkt(6) == other["geometry"].asWkt(6)
        assert one["appeared"] == other["appeared"]
    assert there.results["STOPPED"] == made.results["STOPPED"]
    crs = QgsCoordinateReferenceSystem("EPSG:25832")
    open_ground = toolbox.run("growstreets", CRS=crs, ITERATIONS=2)
    assert open_ground.layers["STREETS"].crs().authid() == "EPSG:25832"


# What follows


def test_the_streets_serve_the_tools_behind(toolbox, made):
    streets = made.layers["STREETS"]
    parcels = toolbox.run("parcelblocks", STREETS=streets, SITE=ground())
    lots = [row for row in parcels.rows("PARCELS") if row["land_use"] == "parcel"]
    assert len(lots) > 60
    assert all(row["access"] for row in lots)
    # Widths are those of the levels: 20, 16 and 12 m at first, and so differ.
    smooth = toolbox.run("smoothstreets", INPUT=streets, SITE=ground())
    assert len(smooth.rows("STREETS")) == len(made.rows("STREETS"))
    assert smooth.layers["STREETS"].fields().indexOf("appeared") >= 0
    assert {row["level"] for row in smooth.rows("STREETS")} == {
        row["level"] for row in made.rows("STREETS")
    }
    checked = toolbox.run("validatenetwork", INPUT=streets, SITE=ground())
    kinds = {row["kind"] for row in checked.rows("PROBLEMS")}
    assert not {"crossing without junction", "dangling touch", "overlap"} & kinds
    figures = toolbox.run("measuredesign", INPUT=streets, SITE=ground(), BOUNDARY_STREETS=ring())
    assert figures.results["LENGTH_M"] == pytest.approx(made.results["TOTAL_LENGTH"], rel=0.01)
    assert figures.results["BLOCKS"] == pytest.approx(made.results["BLOCK_COUNT"], abs=2)


def test_through_qgis_process_the_same_seed_gives_the_same_bytes(qgis_process, tmp_path):
    given = tmp_path / "site.geojson"
    corners = [[X, Y], [X + 400, Y], [X + 400, Y + 300], [X, Y + 300], [X, Y]]
    given.write_text(json.dumps({
        "type": "FeatureCollection",
        "crs": {"type": "name", "properties": {"name": METRES}},
        "features": [{"type": "Feature", "properties": {}, "geometry": {
            "type": "Polygon", "coordinates": [corners],
        }}],
    }))  # fmt: skip
    found = []
    for number in (1, 2):
        paths = {key: tmp_path / f"{key}{number}.gpkg" for key in ("STREETS", "NODES", "BLOCKS")}
        said = qgis_process(
            *binary.tool("growstreets", INPUT=given, GRAMMAR="organic", SCALE=30, **paths)
        )
        assert "SEGMENTS" in said
        assert "Growth stopped, because" in said
        found.append({key: content(path) for key, path in paths.items()})
    assert found[0] == found[1]
    assert len(found[0]["STREETS"]) > 20


def content(path):
    """Return all that a layer of a GeoPackage has, byte by byte."""
    import contextlib
    import sqlite3

    with contextlib.closing(sqlite3.connect(path)) as base:
        return base.execute(f"select * from {path.stem}").fetchall()  # noqa: S608
