"""Streets as a network: speeds, lanes, capacities, directions, islands."""

from __future__ import annotations

import numpy as np
import pytest
from platwright.errors import InputError
from platwright.traffic.network import components, pieces_layer, read_network
from platwright.traffic.speeds import CAPACITIES, PAPER_SPEEDS, StreetRules
from shapely.geometry import LineString
from trafficworld import grid, layer

ROW = [[(0, 0), (100, 0)], [(100, 0), (200, 0)], [(200, 0), (300, 0)], [(300, 0), (400, 0)]]


def test_without_fields_streets_are_local_and_two_way():
    streets, problems = read_network(layer(ROW))
    assert streets.level.tolist() == [3] * 4
    assert streets.speed == pytest.approx([20 * 1609.344 / 3600] * 4)
    assert streets.capacity.tolist() == [CAPACITIES[3]] * 4
    assert streets.lanes.tolist() == [1] * 4
    assert streets.direction.tolist() == [0] * 4
    assert not streets.existing.any()
    assert not len(problems)


def test_speeds_by_level_are_the_papers():
    streets, _ = read_network(layer(ROW, level=[1, 2, 3, 4]))
    assert streets.speed * 3.6 == pytest.approx([64.37, 48.28, 32.19, 32.19], abs=0.01)
    assert [PAPER_SPEEDS[k] for k in (1, 2, 3, 4)] == pytest.approx(streets.speed * 3.6)
    assert streets.lanes.tolist() == [2, 1, 1, 1]
    assert streets.capacity.tolist() == [1800.0, 700.0, 500.0, 300.0]


def test_fields_count_before_levels():
    frame = layer(
        ROW, level=[1, 2, 3, 3], speed_kmh=[30.0, None, 36.0, 0.0],
        maxspeed=["50", "30 mph", "none", ""], lanes=[4, None, "3", 2],
        oneway=["no", "yes", "-1", None], capacity=[None, 1234.0, None, None],
        status=["existing", "given", "new", "connector"],
    )  # fmt: skip
    streets, problems = read_network(frame)
    assert streets.speed * 3.6 == pytest.approx([30, 48.28, 36, 32.19], abs=0.01)
    assert streets.direction.tolist() == [0, 1, -1, 0]
    assert streets.lanes.tolist() == [2, 1, 3, 1]
    assert streets.capacity.tolist() == [1800.0, 1234.0, 1500.0, 500.0]
    assert streets.existing.tolist() == [True, True, False, False]
    texts = problems.to_frame(frame.crs)["problem"].tolist()
    assert any("speed_kmh is 0" in text for text in texts)
    by_level, _ = read_network(frame, rules=StreetRules(own_speeds=False))
    assert by_level.speed * 3.6 == pytest.approx([64.37, 48.28, 32.19, 32.19], abs=0.01)


def test_classes_of_openstreetmap_are_levels():
    frame = layer(ROW, highway=["primary_link", "tertiary", "residential", "service"])
    assert read_network(frame)[0].level.tolist() == [1, 2, 3, 4]


def test_islands_are_told_and_kept():
    frame = layer([[(0, 0), (100, 0)], [(0, 50), (60, 50)]])
    streets, problems = read_network(frame)
    assert len(streets.lines) == 2
    assert len(set(components(streets))) == 2
    rows = problems.to_frame(frame.crs)
    assert rows["feature"].tolist() == ["1"]
    assert "60 m of streets are not connected" in rows["problem"].iloc[0]


def test_one_way_traps_are_told_with_the_ids_of_the_layer():
    frame = layer([[(0, 0), (100, 0)], [(100, 0), (200, 0)]], oneway=["no", "yes"])
    frame.index = [40, 41]
    _, problems = read_network(frame)
    rows = problems.to_frame(frame.crs)
    assert len(rows)
    assert all("41" in text for text in rows["feature"])


def test_streets_are_cut_at_junctions_and_keep_their_fields():
    frame = layer([[(0, 0), (200, 0)], [(100, 0), (100, 80)]], name=["long", "short"])
    before = frame.copy()
    streets, _ = read_network(frame)
    pieces = pieces_layer(streets, frame)
    assert sorted(pieces["name"]) == ["long", "long", "short"]
    assert sorted(pieces.length) == pytest.approx([80, 100, 100])
    assert frame.equals(before)


def test_degrees_give_the_same_network():
    frame = grid(2, 2)
    plane, _ = read_network(frame)
    globe, _ = read_network(frame.to_crs(4326))
    assert globe.length == pytest.approx(plane.length, rel=1e-3)
    assert np.array_equal(globe.ends, plane.ends)
    assert pieces_layer(globe, frame.to_crs(4326)).crs.to_epsg() == 4326


def test_bad_layers_and_rules_are_refused():
    with pytest.raises(InputError, match="CRS"):
        read_network(layer(ROW, crs=None))
    empty = layer(ROW)
    empty.geometry = [LineString()] * 4
    with pytest.raises(InputError):
        read_network(empty)
    with pytest.raises(InputError, match="speed"):
        read_network(layer(ROW), rules=StreetRules(speeds={1: 50, 2: 50, 3: 0, 4: 10}))
    with pytest.raises(InputError, match="capacity"):
        read_network(layer(ROW), rules=StreetRules(capacities={1: 50}))


def test_pieces_keep_the_ids_of_their_features():
    frame = layer([[(0, 0), (100, 0)], [(100, 0), (200, 0)], [(50, 0), (50, 60)]], name=list("abc"))
    frame.index = [7, 3, 9]
    streets, _ = read_network(frame)
    pieces = pieces_layer(streets, frame)
    assert sorted(pieces.index) == [3, 7, 7, 9]
    assert all(frame.loc[k, "name"] == name for k, name in zip(pieces.index, pieces["name"]))
