"""Game levels through real QGIS; what is written is judged by QGIS and by a reader of Tiled."""

from __future__ import annotations

import time

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from pytiled_parser import parse_map  # noqa: E402
from qgis.core import QgsGeometry, QgsPointXY  # noqa: E402
from support import Listener, X, Y, box, complaints_of, layer  # noqa: E402

#: A few seconds are enough for a small level.
QUICK = {"TIME_LIMIT": 3, "MODULE": 5}


def outline(width=50, height=40):
    return layer([box(0, 0, width, height)], name="castle")


def points(*places):
    geometries = [QgsGeometry.fromPointXY(QgsPointXY(X + x, Y + y)) for x, y in places]
    return layer(geometries, kind="Point", name="gates")


complaint = complaints_of("designgamelevel")


@pytest.fixture(scope="module")
def made(toolbox):
    return toolbox.run(
        "designgamelevel", INPUT=outline(), LEVEL_TYPE="linear",
        SINKS=points((0, 10), (50, 30)), **QUICK,
    )  # fmt: skip


def test_blocks_fill_the_outline_without_overlap(made):
    rows = made.rows("BLOCKS")
    assert sum(row["geometry"].area() for row in rows) == pytest.approx(2000.0, rel=1e-6)
    union = QgsGeometry.unaryUnion([row["geometry"] for row in rows])
    assert union.area() == pytest.approx(2000.0, rel=1e-6)
    assert made.results["BLOCK_COUNT"] == len(rows)
    assert {row["colour"][0] for row in rows} == {"#"}


def test_a_linear_route_is_one_line_through_every_block(made):
    rows, route = made.rows("BLOCKS"), made.rows("ROUTE")
    for row in rows:
        inside = row["geometry"].buffer(-0.5, 4)
        assert any(inside.intersects(own["geometry"]) for own in route)
    length = sum(own["geometry"].length() for own in route)
    assert made.results["ROUTE_LENGTH"] == pytest.approx(length, rel=1e-3)
    assert len(made.rows("DOORS")) == len(rows) - 1
    assert sorted(row["order"] for row in rows) == list(range(1, len(rows) + 1))
    assert {row["role"] for row in made.rows("START_GOAL")} == {"start", "goal"}


def test_the_table_is_the_graph_of_the_level(made):
    pairs = {(row["block_a"], row["block_b"]) for row in made.rows("ADJACENCY")}
    assert len(pairs) == len(made.rows("DOORS"))
    blocks = {row["block_id"] for row in made.rows("BLOCKS")}
    assert {block for pair in pairs for block in pair} == blocks


@pytest.mark.parametrize("ending", ["tmx", "tmj"])
def test_the_map_for_tiled_holds_the_same_blocks(toolbox, tmp_path, ending):
    path = tmp_path / f"the castle & its caves.{ending}"
    made = toolbox.run("designgamelevel", INPUT=outline(), TILED_FILE=str(path), **QUICK)
    assert made.results["TILED_FILE"] == str(path)
    level = parse_map(path)
    assert {own.name for own in level.layers} >= {"floor", "walls", "doors", "objects"}
    (objects,) = [own for own in level.layers if own.name == "objects"]
    kinds = [(own.class_ or "") for own in objects.tiled_objects]
    assert kinds.count("block") == len(made.rows("BLOCKS"))
    (tiles,) = level.tilesets.values()
    assert tiles.image.is_file() or (tmp_path / tiles.image).is_file()


def test_a_process_of_its_own_writes_the_same_files(toolbox, tmp_path, monkeypatch):
    monkeypatch.setenv("PLATWRIGHT_WORKER", "always")
    path = tmp_path / "cave.tmj"
    made = toolbox.run("designgamelevel", INPUT=outline(), TILED_FILE=str(path), **QUICK)
    assert made.rows("BLOCKS")
    assert {own.name for own in tmp_path.iterdir()} == {"cave.tmj", "cave_tiles.png"}
    assert {own.name for own in parse_map(path).layers} >= {"floor", "walls"}


def test_what_cannot_be_filled_is_told_with_its_cells(toolbox, tmp_path):
    file = tmp_path / "shapes.json"
    file.write_text('{"templates": [{"name": "big", "cells": ["###", "###", "###"]}]}')
    listener = Listener()
    begin = time.monotonic()
    made = toolbox.run(
        "designgamelevel", listener=listener, INPUT=outline(), TEMPLATE_FILE=str(file), **QUICK
    )
    assert time.monotonic() - begin < 20
    assert made.rows("BLOCKS") == []
    rows = made.rows("PROBLEMS")
    assert rows
    assert {row["severity"] for row in rows} == {"error"}
    assert any("cells" in row["problem"] for row in rows)


def test_several_outlines_are_refused_by_name(toolbox):
    two = layer([box(0, 0, 40, 40), box(50, 0, 40, 40)], name="keeps")
    text = complaint(toolbox, INPUT=two, **QUICK)
    assert "keeps" in text
    assert "Select one" in text


def test_too_many_places_for_a_ring_are_refused(toolbox):
    text = complaint(
        toolbox, INPUT=outline(), LEVEL_TYPE="circular", SINKS=points((0, 10), (50, 30)), **QUICK
    )
    assert "circular" in text
    assert "branching" in text


def test_shapes_as_layer_and_file_are_refused(toolbox, tmp_path):
    file = tmp_path / "shapes.json"
    file.write_text("{}")
    drawn = layer([box(0, 0, 2, 2)], name="drawn")
    text = complaint(toolbox, INPUT=outline(), TEMPLATES=drawn, TEMPLATE_FILE=str(file), **QUICK)
    assert "Leave one" in text


def test_drawn_shapes_are_the_only_ones(toolbox):
    drawn = layer(
        [box(200, 0, 2, 2), box(204, 0, 4, 2)], name="drawn",
        fields="field=name:string(20)", values=[["square"], ["oblong"]],
    )  # fmt: skip
    made = toolbox.run("designgamelevel", INPUT=outline(), TEMPLATES=drawn, **QUICK)
    assert {row["template"] for row in made.rows("BLOCKS")} <= {"square", "oblong"}


def test_a_cancelled_run_keeps_the_best_level(toolbox):
    listener = Listener(cancel_at="Best design")
    begin = time.monotonic()
    made = toolbox.run(
        "designgamelevel", listener=listener, INPUT=outline(100, 80), MODULE=5, TIME_LIMIT=60
    )
    assert time.monotonic() - begin < 40
    assert made.rows("BLOCKS")


def test_shipped_sets_are_those_of_the_library(package):
    from platwright.rooms.shapes import template_sets

    assert set(package("plugin.tools.roominputs").SETS) == set(template_sets())


def test_another_ending_of_the_map_is_refused_before_any_work(toolbox, tmp_path):
    said = complaint(toolbox, INPUT=outline(), TILED_FILE=str(tmp_path / "map.json"))
    assert "map.json" in said
    assert ".tmj" in said


def test_start_and_goal_may_be_one_multipoint(toolbox):
    both = QgsGeometry.fromMultiPointXY([QgsPointXY(X + 5, Y + 5), QgsPointXY(X + 45, Y + 35)])
    given = layer([both], kind="MultiPoint", name="gates")
    made = toolbox.run(
        "designgamelevel", INPUT=outline(), SINKS=given, LEVEL_TYPE="linear", **QUICK
    )
    assert not any("was moved" in row["problem"] for row in made.rows("PROBLEMS"))
    assert {row["role"] for row in made.rows("START_GOAL")} == {"start", "goal"}
    assert not any("No place is given" in row["problem"] for row in made.rows("PROBLEMS"))


def test_the_route_is_as_long_as_asked_and_has_as_many_treasure_rooms(toolbox):
    made = toolbox.run(
        "designgamelevel", INPUT=outline(), MIN_LENGTH=200, MAX_LENGTH=225, TREASURE_ROOMS=3,
        **QUICK,
    )  # fmt: skip
    length = sum(own["geometry"].length() for own in made.rows("ROUTE"))
    assert 199.9 <= length <= 225.1
    assert [row["role"] for row in made.rows("BLOCKS")].count("treasure") == 3
    assert made.results["TREASURES"] == 3
    places: dict[int, set] = {}
    for door in made.rows("DOORS"):
        at = door["geometry"].asPoint()
        for block in (door["block_a"], door["block_b"]):
            places.setdefault(block, set()).add((round(at.x(), 3), round(at.y(), 3)))
    for row in made.rows("BLOCKS"):
        if row["role"] == "treasure":
            assert len(places[row["block_id"]]) == 1


def test_a_route_that_is_longer_than_the_outline_is_told(toolbox):
    made = toolbox.run("designgamelevel", INPUT=outline(), MIN_LENGTH=5000, **QUICK)
    assert made.rows("BLOCKS") == []
    (row,) = [row for row in made.rows("PROBLEMS") if row["severity"] == "error"]
    assert "5000 m" in row["problem"]
    assert "shorter route" in row["action"]


def test_wishes_that_contradict_are_refused(toolbox):
    text = complaint(toolbox, INPUT=outline(), MIN_LENGTH=90, MAX_LENGTH=80, **QUICK)
    assert "at least 90 m and at most 80 m" in text
    text = complaint(toolbox, INPUT=outline(), LEVEL_TYPE="linear", TREASURE_ROOMS=2, **QUICK)
    assert "branching" in text
