"""Floor plans through real QGIS; geometry is judged by QGIS itself."""

from __future__ import annotations

import time

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from qgis.core import QgsGeometry, QgsPointXY  # noqa: E402
from support import Listener, X, Y, box, complaints_of, layer  # noqa: E402

#: A few seconds are enough for a small floor.
QUICK = {"TIME_LIMIT": 3, "MODULE": 4, "TEMPLATE_SET": "basic"}
AREA = 56.0 * 20.0


def house(width=56, height=20):
    return layer([box(0, 0, width, height)], name="house")


def points(*places, kind="Point", **more):
    geometries = [QgsGeometry.fromPointXY(QgsPointXY(X + x, Y + y)) for x, y in places]
    return layer(geometries, kind=kind, name="doors", **more)


def shaft():
    return layer([box(24, 8, 8, 4)], name="lift")


complaint = complaints_of("designfloor")


@pytest.fixture(scope="module")
def made(toolbox):
    return toolbox.run(
        "designfloor", INPUT=house(), SINKS=points((28, 0)), OBSTACLES=shaft(), STOREYS=2, **QUICK
    )


def of(rows, storey):
    return [row for row in rows if row["floor"] == storey]


def test_rooms_corridors_and_shafts_cover_each_storey(made):
    for storey in (0, 1):
        rows = [
            row for key in ("ROOMS", "CORRIDORS", "SHAFTS") for row in of(made.rows(key), storey)
        ]
        shapes = [row["geometry"] for row in rows]
        assert sum(shape.area() for shape in shapes) == pytest.approx(AREA, rel=1e-6)
        assert QgsGeometry.unaryUnion(shapes).area() == pytest.approx(AREA, rel=1e-6)
        assert all(shape.isGeosValid() for shape in shapes)


def test_every_room_has_one_door_at_a_corridor(made):
    rooms = {row["room_id"]: row["geometry"] for row in made.rows("ROOMS")}
    corridors = {row["corridor_id"]: row["geometry"] for row in made.rows("CORRIDORS")}
    doors = made.rows("DOORS")
    assert sorted(row["room_id"] for row in doors) == sorted(rooms)
    for row in doors:
        assert row["geometry"].distance(rooms[row["room_id"]]) < 0.05
        assert row["geometry"].distance(corridors[row["corridor_id"]]) < 0.05
        assert row["distance_m"] >= 0.0


def test_each_storey_has_one_corridor_that_comes_to_the_exit(made):
    exit_ = QgsGeometry.fromPointXY(QgsPointXY(X + 28, Y))
    for storey in (0, 1):
        rows = of(made.rows("CORRIDORS"), storey)
        lines = [row["geometry"] for row in of(made.rows("CORRIDOR_LINES"), storey)]
        assert len(rows) == 1
        assert min(line.distance(exit_) for line in lines) < 0.5
        assert QgsGeometry.unaryUnion(lines).area() == 0.0


def test_numbers_are_those_of_the_layers(made):
    rooms, doors = made.rows("ROOMS"), made.rows("DOORS")
    assert made.results["ROOM_COUNT"] == len(rooms)
    area = sum(row["geometry"].area() for row in rooms)
    assert made.results["NET_TO_GROSS"] == pytest.approx(100 * area / (2 * AREA), rel=1e-3)
    assert made.results["MAX_EGRESS"] == pytest.approx(max(row["distance_m"] for row in doors))
    length = sum(row["geometry"].length() for row in made.rows("CORRIDOR_LINES"))
    assert made.results["CORRIDOR_LENGTH"] == pytest.approx(length, rel=1e-3)
    assert made.results["BOUND"] <= made.results["OBJECTIVE"] + 1e-9


def test_the_shaft_is_at_the_same_place_on_each_storey(made):
    one, other = (of(made.rows("SHAFTS"), storey) for storey in (0, 1))
    assert len(one) == len(other)
    for mine, its in zip(one, other):
        # corners may be counted from another one, and have more between them
        assert mine["geometry"].symDifference(its["geometry"]).area() < 1e-3
        assert mine["geometry"].area() == pytest.approx(its["geometry"].area())


def test_forbidden_dead_ends_are_none(toolbox):
    made = toolbox.run("designfloor", INPUT=house(56, 28), DEAD_ENDS="forbid", **QUICK)
    ends: dict[str, int] = {}
    for row in made.rows("CORRIDOR_LINES"):
        line = row["geometry"].asPolyline()
        for point in (line[0], line[-1]):
            key = f"{point.x():.2f} {point.y():.2f}"
            ends[key] = ends.get(key, 0) + 1
    # the exit alone may be an end
    assert sum(1 for count in ends.values() if count == 1) <= 1


def test_a_floor_without_a_plan_is_told_with_its_cells(toolbox, tmp_path):
    file = tmp_path / "shapes.json"
    file.write_text('{"templates": [{"name": "hall", "cells": ["####", "####", "####", "####"]}]}')
    begin = time.monotonic()
    made = toolbox.run("designfloor", INPUT=house(), TEMPLATE_FILE=str(file), **QUICK)
    assert time.monotonic() - begin < 20
    assert made.rows("ROOMS") == []
    rows = made.rows("PROBLEMS")
    assert "error" in {row["severity"] for row in rows}


def test_a_corridor_too_wide_for_the_module_is_refused(toolbox):
    text = complaint(toolbox, INPUT=house(), CORRIDOR_WIDTH=4, **QUICK)
    assert "3.20 m" in text


def test_an_exit_far_from_the_house_is_refused_by_name(toolbox):
    text = complaint(toolbox, INPUT=house(), SINKS=points((500, 0)), **QUICK)
    assert "doors" in text


def test_a_house_of_one_cell_is_refused(toolbox):
    text = complaint(toolbox, INPUT=layer([box(0, 0, 3, 3)], name="shed"), **QUICK)
    assert "shed" in text


def test_two_houses_are_numbered(toolbox):
    two = layer([box(0, 0, 32, 20), box(60, 0, 32, 20)], name="houses")
    made = toolbox.run("designfloor", INPUT=two, **QUICK)
    rows = made.rows("ROOMS")
    assert {row["footprint_id"] for row in rows} == {1, 2}
    assert len({row["room_id"] for row in rows}) == len(rows)


def test_a_cancelled_run_keeps_the_best_plans(toolbox):
    listener = Listener(cancel_at="Best design")
    begin = time.monotonic()
    asked = {**QUICK, "TIME_LIMIT": 60}
    made = toolbox.run("designfloor", listener=listener, INPUT=house(100, 60), STOREYS=3, **asked)
    assert time.monotonic() - begin < 40
    assert {row["floor"] for row in made.rows("ROOMS")} == {0}
    assert any("Cancelled" in text for text in listener.warnings)


def cells(across, down, side=4):
    return layer(
        [box(side * i, side * j, side, side) for j in range(down) for i in range(across)],
        name="cells",
    )


def test_a_mesh_that_is_given_stands_for_footprint_and_module(toolbox):
    asked = {**QUICK, "MODULE": 50}
    made = toolbox.run("designfloor", INPUT=cells(12, 5), MESH=True, STOREYS=2, **asked)
    faces = made.rows("CELLS")
    assert len(faces) == 2 * 60
    assert all(row["geometry"].area() == pytest.approx(16.0) for row in faces)
    for storey in (0, 1):
        rows = [*of(made.rows("ROOMS"), storey), *of(made.rows("CORRIDORS"), storey)]
        assert sum(row["geometry"].area() for row in rows) == pytest.approx(12 * 5 * 16.0)


def test_cells_that_leave_a_gap_are_refused_by_name(toolbox):
    apart = layer([box(0, 0, 4, 4), box(4, 0, 4, 4), box(12, 0, 4, 4)], name="apart")
    text = complaint(toolbox, INPUT=apart, MESH=True, **QUICK)
    assert "apart" in text
    assert "pieces" in text


def test_corridors_wider_than_the_cells_of_a_mesh_are_refused(toolbox):
    text = complaint(toolbox, INPUT=cells(12, 5, side=2), MESH=True, CORRIDOR_WIDTH=1.7, **QUICK)
    assert "1.60 m" in text


def test_no_branches_and_ways_within(toolbox):
    made = toolbox.run(
        "designfloor", INPUT=house(), BRANCHES="forbid", WAYS="to exits and within", PART_SIZE=14,
        **QUICK,
    )  # fmt: skip
    lines = [row["geometry"] for row in made.rows("CORRIDOR_LINES")]
    ends = [
        (round(p.x(), 2), round(p.y(), 2))
        for one in lines
        for p in (one.vertexAt(0), one.vertexAt(one.constGet().nCoordinates() - 1))
    ]
    assert max(ends.count(place) for place in ends) <= 2


def test_no_plan_has_no_objective_and_says_what_may_help(toolbox):
    """Four cells, no dead ends and no forks: there is no plan."""
    asked = {**QUICK, "TEMPLATE_SET": "office", "DEAD_ENDS": "forbid", "BRANCHES": "forbid"}
    made = toolbox.run("designfloor", INPUT=house(8, 8), **asked)
    assert made.rows("ROOMS") == []
    for key in ("OBJECTIVE", "BOUND", "GAP"):
        assert made.results.get(key) is None
    assert made.rows("PROBLEMS")


def test_problems_of_storeys_say_which_storey(toolbox):
    asked = {**QUICK, "TEMPLATE_SET": "office", "DEAD_ENDS": "forbid", "BRANCHES": "forbid"}
    made = toolbox.run("designfloor", INPUT=house(8, 8), STOREYS=2, **asked)
    texts = [row["problem"] for row in made.rows("PROBLEMS") if row["severity"] == "error"]
    assert {text.partition(":")[0] for text in texts} == {"Storey 0", "Storey 1"}
