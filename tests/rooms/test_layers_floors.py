"""Layers of floor plans, their figures, and whether the check finds what is wrong."""

from __future__ import annotations

import dataclasses
import math

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.mesh.grids import grid
from platwright.rooms.layers.checks import faults
from platwright.rooms.layers.collect import COLUMNS, StoreyPlan, floor_layers
from platwright.rooms.layers.figures import dead_ends, floor_figures
from shapely.affinity import translate
from shapely.geometry import box

from .layer_examples import (
    HALL,
    MESHES,
    ROOM,
    SMALL,
    floor_plan,
    hand,
    moved,
    outline,
    random_plan,
    vertex,
    walk,
)

CRS = "EPSG:3067"
FAR = np.array([391_000.123, 6_671_000.377])


def layers_of(problem, plan, width=2.0, **more):
    return floor_layers([StoreyPlan(problem, plan, outline(problem), 0)], CRS, width, **more)


@pytest.fixture
def layers():
    return layers_of(*hand())


def test_fields_are_as_described(layers):
    assert set(layers) == set(COLUMNS)
    for name, columns in COLUMNS.items():
        assert [c for c in layers[name].columns if c != "geometry"] == list(columns)
        assert layers[name].crs == CRS
    assert len(layers["obstacles"]) == 0


def test_a_ring_of_corridor_by_hand(layers):
    """24 m by 20 m, ring of 16 m by 12 m along centre lines, 2 m wide, 4 m to the way out."""
    rooms = layers["rooms"].set_index("room_id")
    assert len(rooms) == 13
    assert rooms["template"].value_counts().to_dict() == {"room": 11, "hall": 2}
    assert sorted(rooms.loc[rooms["template"] == "room", "count_index"]) == list(range(1, 12))
    assert set(rooms["colour"]) == {ROOM.colour, HALL.colour}
    # ring 2 * (18 + 10) * 2 m2, and 3 m by 2 m to the wall
    assert layers["corridors"]["area_m2"].tolist() == pytest.approx([118])
    # the middle room of the upper row loses 1 m of its depth
    assert rooms.loc[8, "area_m2"] == pytest.approx(24)
    assert rooms.loc[8, "net_width_m"] == pytest.approx(3, abs=1e-3)
    # halls are 8 m by 8 m; the corridor takes 1 m from two sides
    assert rooms.loc[10, "area_m2"] == pytest.approx(49)
    # the left hall's door faces that of the room below, 0.75 m from that room's corner at 11 m
    assert rooms.loc[10, "distance_m"] == pytest.approx(4 + 1 + 0.75)
    assert rooms.loc[5, "distance_m"] == pytest.approx(4 + 1 + 0.75)
    assert rooms.loc[10, "door_side"] == "S"
    figures = floor_figures(layers)
    assert figures["corridor_m"] == 60
    assert figures["gross_m2"] == pytest.approx(480)
    assert figures["corridor_share"] == pytest.approx(118 / 480)
    assert figures["net_to_gross"] == pytest.approx(362 / 480)
    assert figures["rooms_room"] == 11
    assert figures["dead_ends"] == figures["dead_end_m"] == 0
    away = rooms["distance_m"]
    assert figures["mean_egress_m"] == pytest.approx(away.mean())
    assert figures["max_egress_m"] == pytest.approx(away.max())
    assert {k[8:] for k in figures if k.startswith("floor_0_")} <= set(figures)
    assert faults(layers, box(0, 0, 24, 20), (ROOM, HALL, SMALL)) == []


def test_dead_ends_run_to_the_next_branch_or_sink():
    mesh = grid(4, 4, 4.0)
    rooms = [(f,) for f in range(16)]
    # a way in of 8 m, one arm of 4 m, one of 8 m
    edges = walk(mesh, [(8, 0), (8, 8), (4, 8)]) + walk(mesh, [(8, 8), (12, 8), (12, 12)])
    touched = {f for e in edges for f in mesh.edge_faces[e].tolist()}
    rest = tuple(f for f in range(16) if f not in touched)
    assert rest
    problem, plan = floor_plan(
        mesh, [r for r in rooms if r[0] in touched], edges, [vertex(mesh, 8, 0)]
    )
    layers = layers_of(problem, plan)
    assert sorted(dead_ends(layers["corridor_lines"])) == [4, 8]
    figures = floor_figures(layers)
    assert figures["dead_ends"] == 2
    assert figures["dead_end_m"] == 12
    assert figures["longest_dead_end_m"] == 8
    # the others are obstacles, joined where they touch along sides
    assert layers["obstacles"]["area_m2"].sum() == 16 * len(rest)
    assert layers["faces"].loc[layers["faces"]["obstacle"], "face_id"].tolist() == [
        f + 1 for f in rest
    ]
    assert faults(layers, box(0, 0, 16, 16)) == []


def test_storeys_have_numbers_of_their_own():
    problem, plan = hand()
    other = random_plan(grid(6, 5, 4.0), 3)
    shape = outline(problem)
    layers = floor_layers([(problem, plan, shape, 0), (*other, shape, 4)], CRS, 2.0)
    for name, columns in COLUMNS.items():
        assert layers[name][columns[0]].tolist() == list(range(1, len(layers[name]) + 1))
    for name, key in (
        ("doors", "room_id"),
        ("faces", "room_id"),
        ("corridor_lines", "corridor_id"),
    ):
        own = layers["rooms" if key == "room_id" else "corridors"].set_index(key)["floor"]
        assert (own.loc[layers[name][key]].to_numpy() == layers[name]["floor"].to_numpy()).all()
    assert faults(layers, shape) == []
    figures = floor_figures(layers)
    assert figures["rooms"] == figures["floor_0_rooms"] + figures["floor_4_rooms"]
    assert figures["gross_m2"] == pytest.approx(960)
    assert faults(layers, {0: shape, 4: shape}) == []
    assert faults(layers, {0: shape, 4: shape.buffer(1)}) != []


def test_layers_are_given_in_another_crs():
    problem, plan = hand()
    problem = moved(problem, lambda points: points + FAR)
    plain, told = layers_of(problem, plan), layers_of(problem, plan, source_crs="EPSG:4326")
    assert faults(plain, outline(problem)) == []
    for name, layer in told.items():
        assert layer.crs == "EPSG:4326"
        own = plain[name].drop(columns="geometry")
        assert layer.drop(columns="geometry").equals(own)
    every = np.concatenate(
        [told[n].geometry.to_numpy() for n in ("rooms", "corridors", "obstacles")]
    )
    assert shapely.coverage_is_valid(every)
    assert floor_figures(told) == floor_figures(plain)


def test_bad_input_is_refused_with_its_storey():
    problem, plan = hand()
    with pytest.raises(InputError, match="no floor plan"):
        floor_layers([], CRS, 2.0)
    with pytest.raises(InputError, match=r"Storey 7: .*width of [0-9.]+ m would do"):
        floor_layers([(problem, plan, outline(problem), 7)], CRS, 9.0)


@pytest.mark.parametrize("name", sorted(MESHES))
@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10_000), far=st.booleans())
def test_random_plans_have_no_faults(name, seed, far):
    blocked = [seed % 8] if seed % 4 == 0 else []
    problem, plan = random_plan(
        MESHES[name](), seed, blocked=blocked, outer=bool(seed % 2), spare=seed % 3
    )
    if far:
        problem = moved(problem, lambda points: points + FAR)
    layers = layers_of(problem, plan, 1.2)
    assert faults(layers, outline(problem)) == []
    figures = floor_figures(layers)
    blocked_share = layers["obstacles"].area.sum() / outline(problem).area
    shares = figures["net_to_gross"] + figures["corridor_share"]
    assert shares == pytest.approx(1 - blocked_share)
    lengths = np.diff(
        layers["corridor_lines"].get_coordinates().to_numpy().reshape(-1, 2, 2), axis=1
    )
    assert figures["corridor_m"] == pytest.approx(np.hypot(*lengths[:, 0].T).sum())
    assert 0 <= figures["mean_egress_m"] <= figures["max_egress_m"] < math.inf


def _shift(name, row, by):
    def change(layers):
        shapes = layers[name].geometry.tolist()
        shapes[row] = translate(shapes[row], *by)
        return {**layers, name: layers[name].set_geometry(gpd.GeoSeries(shapes, crs=CRS))}

    return change


def _value(name, column, row, value):
    def change(layers):
        table = layers[name].copy()
        table.loc[row, column] = value
        return {**layers, name: table}

    return change


def _without(name, row):
    return lambda layers: {**layers, name: layers[name].drop(index=row)}


def _line(points):
    """Give the first centre line another course."""

    def change(layers):
        shapes = layers["corridor_lines"].geometry.tolist()
        shapes[0] = shapely.LineString(points)
        return {
            **layers,
            "corridor_lines": layers["corridor_lines"].set_geometry(gpd.GeoSeries(shapes, crs=CRS)),
        }

    return change


def _closed(layers):
    lines = layers["corridor_lines"].assign(
        from_m=lambda t: t["from_m"] + 1, to_m=lambda t: t["to_m"] + 1
    )
    return {**layers, "corridor_lines": lines}


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (_shift("rooms", 3, (0.01, 0)), "do not share their borders"),
        (_shift("rooms", 3, (-0.5, 0)), "overlap"),
        (_shift("rooms", 3, (5, 0)), "outside the footprint"),
        (_without("rooms", 2), "do not name the same rooms"),
        (_without("corridors", 0), "is in no corridor"),
        (_without("doors", 4), "has 0 doors"),
        (_shift("doors", 4, (0, 0.1)), "not in a wall of its room"),
        (_shift("doors", 4, (1.0, 0)), "from a sink"),
        (_value("doors", "room_id", 4, 99), "from or to nowhere"),
        (_value("doors", "width_m", 0, 0.5), "its field says"),
        (_value("doors", "distance_m", 0, 3.0), "from a sink"),
        (_value("rooms", "area_m2", 0, 3.0), "The area of room 1"),
        (_value("rooms", "count_index", 0, 3), "not counted from 1"),
        (_value("rooms", "room_id", 0, 2), "one id"),
        (_value("faces", "room_id", 0, -1), "neither in a room nor an obstacle"),
        (_value("faces", "room_id", 0, 11), "larger than its cells"),
        (_value("corridor_lines", "width_m", 0, 3.0), "narrower than 3 m"),
        (_value("corridor_lines", "from_m", 2, 3.3), "not as far from a sink"),
        (_value("corridor_lines", "length_m", 2, 3.3), "its field says otherwise"),
        (_line([(8, 4), (8, 8)]), "runs inside room 10"),
        (_line([(8, 4), (8, 8)]), "leaves its corridor"),
        (_closed, "No corridor has a way out"),
    ],
)  # fmt: skip
def test_the_check_finds_what_is_wrong(layers, change, text):
    shape = box(0, 0, 24, 20)
    assert faults(layers, shape) == []
    found = faults(change(layers), shape)
    assert any(text in fault for fault in found), found


def test_the_check_finds_wrong_numbers_and_sizes(layers):
    shape = box(0, 0, 24, 20)
    more = dataclasses.replace(HALL, least=3)
    assert any("2 rooms of template 'hall'" in t for t in faults(layers, shape, (ROOM, more)))
    less = dataclasses.replace(HALL, most=1)
    assert any("2 rooms of template 'hall'" in t for t in faults(layers, shape, (ROOM, less)))
    large = dataclasses.replace(HALL, cells=HALL.cells | {(2, 0)})
    assert any("not the size of template 'hall'" in t for t in faults(layers, shape, (ROOM, large)))


def test_two_parts_of_corridor_one_without_a_way_out():
    """The right part of the corridor is cut off from the sink on the left."""
    mesh = grid(4, 2, 4.0)
    edges = walk(mesh, [(0, 4), (8, 4)]) + walk(mesh, [(12, 4), (16, 4)])
    problem, plan = floor_plan(
        mesh, [(0,), (1,), (4,), (5,), (2, 3), (6, 7)], edges, [vertex(mesh, 0, 4)]
    )
    found = faults(layers_of(problem, plan), box(0, 0, 16, 8))
    assert any("leads to no sink" in text for text in found)
