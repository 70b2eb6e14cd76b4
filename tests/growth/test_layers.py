"""Layers of growths made by hand: what each field says, by numbers worked out beforehand."""

from __future__ import annotations

from dataclasses import replace

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from platwright.growth.layers import COLUMNS, growth_layers
from platwright.growth.layers.moments import FIRST_MOMENT, STEP_DAYS
from platwright.growth.layers.prune import without_dead_ends
from platwright.growth.types import Start, Step
from pyproj import CRS

from .hand_made import (
    ORIGIN,
    UTM,
    Edge,
    given_street,
    lattice,
    make_growth,
    make_real,
    no_problems,
    rules,
)


def moved(geometry):
    """Take a geometry to where the hand-made growths lie."""
    return shapely.transform(geometry, lambda xy: xy + ORIGIN)


def place(x, y):
    """Take a position to where the hand-made growths lie."""
    return (float(ORIGIN[0] + x), float(ORIGIN[1] + y))


@pytest.fixture(scope="module")
def town():
    """An existing street over a bend, and grown streets that join it and end at the edge.

    The existing street runs (0,0) - (100,0) - (200,0) - (200,100); it bends at (200,0), and a
    main road grows from (100,0) upwards: (100,60), (100,160), (100,200) at the edge; from
    (100,60) a small road goes to (160,60).
    """
    xy = [(0, 0), (200, 0), (200, 100), (100, 0), (100, 60), (100, 160), (100, 200), (160, 60)]
    edges = [
        Edge(0, 3, street=0),
        Edge(3, 1, street=0),
        Edge(1, 2, street=0),
        Edge(3, 4, road=1, kind="m", step=1),
        Edge(4, 5, road=1, kind="m", step=2),
        Edge(5, 6, road=1, kind="l", step=3),
        Edge(4, 7, road=2, kind="s", step=3),
    ]
    growth = make_growth(
        xy,
        edges,
        bends=np.array([0, 1, 0, 0, 0, 0, 0, 0], dtype=bool),
        road_type=np.array(["", "", "", "m", "m", "m", "l", "s"]),
        node_type=np.array(["", "", "", "T", "B", "T", "BOUNDARY", "L"]),
        born=np.array([0, 0, 0, 0, 1, 2, 3, 3]),
        incoming_road=np.array([0, 0, 0, 0, 1, 1, 1, 2]),
    )
    street = given_street([(0, 0), (100, 0), (200, 0), (200, 100)], "Old Road", level=1)
    real = make_real(growth, shapely.box(-10, -10, 210, 200), (street,), given=3)
    return growth, real, growth_layers(growth, real, rules())


def test_layers_have_their_fields_and_crs(town):
    _, _, layers = town
    assert list(layers) == list(COLUMNS)
    for key, frame in layers.items():
        assert isinstance(frame, gpd.GeoDataFrame)
        assert [*COLUMNS[key], "geometry"] == list(frame.columns), key
        assert frame.crs == UTM


def test_grown_streets_are_as_they_grew_and_existing_ones_run_between_junctions(town):
    streets = town[2]["streets"]
    assert streets["street_id"].tolist() == [1, 2, 3, 4, 5, 6]
    assert streets["status"].tolist() == ["new"] * 4 + ["existing"] * 2
    assert streets["length_m"].tolist() == [60, 100, 40, 60, 100, 200]
    assert streets["level"].tolist() == [1, 1, 2, 3, 1, 1]
    assert streets["level_name"].tolist() == [
        "major", "major", "collector", "local", "major", "major",
    ]  # fmt: skip
    assert streets["speed_kmh"].tolist() == [65, 65, 50, 30, 65, 65]
    assert streets["road"].tolist()[:4] == [1, 1, 1, 2]
    assert streets["road"].isna().tolist() == [False] * 4 + [True] * 2
    assert streets["road_type"].tolist() == ["main", "main", "large", "small", "", ""]
    assert streets["iteration"].tolist() == [1, 2, 3, 3, 0, 0]
    assert streets["name"].tolist() == [""] * 4 + ["Old Road"] * 2
    # over the bend, in the street's direction
    over = shapely.LineString([(100, 0), (200, 0), (200, 100)])
    assert streets.geometry.iloc[5].equals_exact(moved(over), 1e-9)


def test_streets_say_the_states_of_their_ends(town):
    streets = town[2]["streets"]
    assert streets["start_state"].tolist() == [
        "main twig", "main branch", "main twig", "main branch", "", "main twig",
    ]  # fmt: skip
    assert streets["end_state"].tolist() == [
        "main branch", "main twig", "large edge", "small leaf", "main twig", "",
    ]  # fmt: skip


def test_the_way_out_leads_to_the_existing_street(town):
    streets = town[2]["streets"]
    # not to the edge of the domain, which is nearer for some
    assert streets["dist_start_m"].tolist()[:4] == [0, 60, 160, 60]
    assert streets["dist_end_m"].tolist()[:4] == [60, 160, 200, 120]
    assert streets["dist_to_sink_m"].tolist()[:4] == [30, 110, 180, 90]
    assert streets["direction"].tolist() == [-1, -1, -1, -1, 0, 0]
    assert streets[["dist_start_m", "dist_end_m", "dist_to_sink_m"]].iloc[4:].isna().all(axis=None)


def test_nodes_are_where_streets_meet_or_end(town):
    nodes = town[2]["nodes"]
    # seven of the eight: the bend of the existing street is none
    assert nodes["node_id"].tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert nodes["kind"].tolist() == [
        "dead end", "dead end", "join", "junction", "bend", "at the edge", "dead end",
    ]  # fmt: skip
    assert nodes["degree"].tolist() == [1, 1, 3, 3, 2, 1, 1]
    assert nodes["state"].tolist()[2:4] == ["main twig", "main branch"]
    assert nodes["node_type"].tolist()[5] == "edge"
    assert nodes["road_type"].tolist()[5] == "large"
    assert nodes["iteration"].tolist() == [0, 0, 0, 1, 2, 3, 3]
    assert nodes["road"].isna().tolist() == [True] * 3 + [False] * 4
    assert nodes["road"].tolist()[3:] == [1, 1, 1, 2]


def test_roads_are_merged_in_their_order(town):
    roads = town[2]["roads"]
    assert roads["road"].tolist() == [1, 2]
    # 160 m main and 40 m large
    assert roads["road_type"].tolist() == ["main", "small"]
    assert roads["level"].tolist() == [1, 3]
    assert roads["segments"].tolist() == [3, 1]
    assert roads["length_m"].tolist() == [200, 60]
    assert roads["first_iteration"].tolist() == [1, 3]
    assert roads["last_iteration"].tolist() == [3, 3]
    # (100,0) and (100,60) along the first, (100,60) along the second
    assert roads["junctions"].tolist() == [2, 1]
    whole = shapely.MultiLineString([[(100, 0), (100, 60), (100, 160), (100, 200)]])
    assert roads.geometry.iloc[0].equals_exact(moved(whole), 1e-9)


def test_a_road_that_forks_has_parts():
    growth = make_growth(
        [(0, 0), (100, 0), (200, 50), (200, -50)],
        [Edge(0, 1, kind="m"), Edge(1, 2, kind="s", step=2), Edge(1, 3, kind="s", step=2)],
    )
    roads = growth_layers(growth, make_real(growth), rules())["roads"]
    assert len(roads) == 1
    assert len(roads.geometry.iloc[0].geoms) == 3
    # 100 m main against 2 x 112 m small
    assert roads["road_type"].tolist() == ["small"]


def test_moments_are_days_from_the_first_and_everything_stays(town):
    layers = town[2]
    first, day = pd.Timestamp(FIRST_MOMENT), pd.Timedelta(days=STEP_DAYS)
    for key in ("streets", "nodes", "blocks"):
        frame = layers[key]
        assert (frame["appeared"] == first + frame["iteration"] * day).all()
        assert (frame["until"] == first + 4 * day).all()
    roads = layers["roads"]
    assert (roads["appeared"] == first + roads["first_iteration"] * day).all()
    assert layers["streets"]["appeared"].iloc[4] == first


def test_steps_are_a_table(town):
    steps = town[2]["steps"]
    assert steps["iteration"].tolist() == [1, 2, 3]
    assert steps["length_m"].tolist() == [100.0, 200.0, 300.0]
    assert steps["seconds"].tolist() == pytest.approx([0.1, 0.2, 0.3])
    assert steps.geometry.isna().all()


def test_without_an_existing_street_the_way_out_leads_over_the_edge():
    growth = make_growth(
        [(0, 0), (0, 40), (0, 100), (30, 40)], [Edge(0, 1), Edge(1, 2), Edge(3, 1)]
    )
    growth.node_type[2] = "BOUNDARY"
    streets = growth_layers(growth, make_real(growth, shapely.box(-50, -50, 50, 100)), rules())[
        "streets"
    ]
    assert streets["dist_start_m"].tolist() == [100, 60, 90]
    assert streets["dist_end_m"].tolist() == [60, 0, 60]
    assert streets["direction"].tolist() == [1, 1, 1]


def test_the_shore_of_a_pond_is_no_way_out():
    growth = make_growth([(0, 0), (0, 40)], [Edge(0, 1)])
    growth.node_type[1] = "BOUNDARY"
    land = shapely.box(-50, -50, 50, 100).difference(shapely.box(-20, 40, 20, 60))
    streets = growth_layers(growth, make_real(growth, land), rules())["streets"]
    assert streets["dist_to_sink_m"].isna().all()
    assert streets["direction"].tolist() == [0]


def test_a_street_along_the_edge_that_was_asked_for_is_new_and_leads_out():
    xy = [(0, 0), (100, 0), (100, 100), (0, 100), (50, 0), (50, 60)]
    edges = [
        Edge(0, 4, street=0),
        Edge(4, 1, street=0),
        Edge(1, 2, street=0),
        Edge(2, 3, street=0),
        Edge(3, 0, street=0),
        Edge(4, 5),
    ]
    growth = make_growth(xy, edges, bends=np.array([1, 1, 1, 1, 0, 0], dtype=bool))
    ring = given_street([(0, 0), (100, 0), (100, 100), (0, 100), (0, 0)], edge=True, level=3)
    real = make_real(growth, shapely.box(0, 0, 100, 100), (ring,), given=4)
    layers = growth_layers(growth, real, rules())
    streets = layers["streets"]
    assert streets["status"].tolist() == ["new", "new"]
    assert streets["length_m"].tolist() == [60, 400]
    assert streets["level"].tolist() == [3, 3]
    assert streets["dist_to_sink_m"].tolist() == [30, 0]
    assert streets.geometry.iloc[1].coords[0] == place(50, 0)
    assert layers["nodes"]["kind"].tolist() == ["at the edge", "dead end"]
    # the street closes the block, its blind street does not cut it
    assert layers["blocks"]["enclosed"].tolist() == ["streets"]
    assert layers["blocks"]["sides"].tolist() == [1]


def test_a_street_that_lies_on_another_one_makes_no_way_longer():
    # as published that may be
    growth = make_growth([(0, 0), (100, 0), (0, 0)], [Edge(0, 1, street=0), Edge(1, 2), Edge(2, 1)])
    real = make_real(growth, streets=(given_street([(0, 0), (100, 0)]),), given=2)
    streets = growth_layers(growth, real, rules(as_published=True))["streets"]
    assert streets["dist_end_m"].tolist()[:2] == [100, 0]


def test_problems_tell_what_was_asked_for_and_what_was_left_out():
    steps = (Step(1, 1, 1, 40.0, 61.66, 1, 0.1),)
    growth = make_growth(
        [(0, 0), (0, 40)], [Edge(0, 1)], steps=steps, left_out=7, stopped="nothing is left"
    )
    own = no_problems(UTM)
    own.loc[0] = ["roads", "12", "too short", "left out", "info", shapely.Point(ORIGIN)]
    real = make_real(growth, problems=own.set_crs(UTM))
    problems = growth_layers(growth, real, rules(iterations=20, max_length=500.0))["problems"]
    assert problems["layer"].tolist() == ["roads", "streets", "streets"]
    assert problems["problem"].iloc[1] == (
        "Growth ended with 1 of 20 iterations and 40 of 500 m of streets, because nothing is left."
    )
    assert problems["problem"].iloc[2].startswith("7 streets were not built")
    assert problems["severity"].tolist() == ["info", "warning", "info"]
    assert "nearness of junctions" in problems["action"].iloc[2]
    # iterations alone are no wish for a size: then nothing is missing
    problems = growth_layers(growth, real, rules(iterations=20))["problems"]
    assert problems["layer"].tolist() == ["roads"]
    stopped = replace(growth, stopped="it was cancelled")
    problems = growth_layers(stopped, real, rules(iterations=20))["problems"]
    assert problems["severity"].tolist() == ["info", "info", "info"]


def test_dead_ends_that_were_taken_away_are_no_failure_of_the_growth():
    xy = [(0, 0), (100, 0), (100, 100), (0, 100), (200, 0)]
    edges = [Edge(0, 1), Edge(1, 2), Edge(2, 3), Edge(3, 0), Edge(1, 4)]
    growth = make_growth(xy, edges, steps=(Step(1, 5, 5, 500.0, 770.75, 1, 0.1),))
    left = without_dead_ends(growth, make_real(growth))
    assert len(left.ends) == 4
    asked = rules(iterations=None, max_segments=5)
    assert growth_layers(left, make_real(growth), asked)["problems"].empty


def test_a_cancelled_growth_says_so():
    steps = (Step(1, 1, 1, 40.0, 61.66, 1, 0.1),)
    growth = make_growth([(0, 0), (0, 40)], [Edge(0, 1)], steps=steps, stopped="it was cancelled")
    problems = growth_layers(growth, make_real(growth), rules(iterations=20))["problems"]
    assert problems["action"].tolist() == ["left so; run it again to the end"]


def test_growth_that_reached_its_limit_and_hangs_together_has_no_problem(town):
    assert town[2]["problems"].empty


def test_streets_that_no_existing_street_meets_are_told_where_they_begin():
    xy = [(0, 0), (100, 0), (100, 50), (500, 500), (500, 560)]
    growth = make_growth(xy, [Edge(0, 1, street=0), Edge(1, 2), Edge(3, 4)])
    street = given_street([(0, 0), (100, 0)])
    problems = growth_layers(growth, make_real(growth, streets=(street,), given=2), rules())[
        "problems"
    ]
    assert problems["problem"].tolist() == [
        "60 m of streets that grew here are not connected to an existing street."
    ]
    assert problems.geometry.iloc[0].equals(shapely.Point(place(500, 500)))


def test_of_two_growths_without_existing_streets_the_smaller_is_told():
    xy = [(0, 0), (0, 90), (500, 500), (500, 560)]
    growth = make_growth(xy, [Edge(0, 1), Edge(2, 3)])
    problems = growth_layers(growth, make_real(growth), rules())["problems"]
    assert len(problems) == 1
    assert problems["problem"].iloc[0].startswith("60 m of streets")


def test_starts_from_which_nothing_grew_are_told():
    xy = [(0, 0), (100, 0), (0, 50), (300, 300)]
    growth = make_growth(
        xy,
        [Edge(0, 1, street=0), Edge(0, 2)],
        node_type=np.array(["L", "L", "L", "Start"]),
        road_type=np.array(["m", "m", "m", "m"]),
        born=np.array([0, 0, 1, 0]),
    )
    state = rules().grammar.start
    starts = (
        Start(place(0, 0), (0, 1), state, 0),
        Start(place(100, 0), (1, 0), state, 1),
        Start(place(300, 300), (0, 1), state),
    )
    street = given_street([(0, 0), (100, 0)])
    layers = growth_layers(
        growth, make_real(growth, streets=(street,), given=2, starts=starts), rules()
    )
    problems = layers["problems"]
    assert problems["problem"].tolist() == [
        "Nothing grew from this start.",
        "Nothing grew from 1 of 2 ends and junctions of existing streets.",
    ]
    assert problems.geometry.iloc[0].equals(shapely.Point(place(300, 300)))
    # it is shown nevertheless
    assert layers["nodes"]["state"].tolist()[-1] == "main start"


def test_layers_return_to_the_crs_of_the_input():
    wgs84 = CRS.from_epsg(4326)
    growth = lattice(3, 3)
    real = make_real(growth, source_crs=wgs84)
    layers = growth_layers(growth, real, rules())
    plain = growth_layers(growth, make_real(growth), rules())
    for key in ("streets", "nodes", "roads", "blocks"):
        assert layers[key].crs == wgs84
        back = layers[key].to_crs(UTM).geometry
        assert shapely.hausdorff_distance(back, plain[key].geometry).max() < 1e-4
        assert layers[key].drop(columns="geometry").equals(plain[key].drop(columns="geometry"))


@pytest.mark.parametrize("source", [UTM, CRS.from_epsg(4326)])
def test_nothing_grown_makes_empty_layers_with_their_fields(source):
    growth = make_growth(np.zeros((0, 2)), [])
    real = make_real(growth, source_crs=source)
    layers = growth_layers(growth, real, rules())
    for key, frame in layers.items():
        assert [*COLUMNS[key], "geometry"] == list(frame.columns)
        assert key == "problems" or frame.empty
        assert frame.crs == source
