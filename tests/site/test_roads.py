import geopandas as gpd
import numpy as np
import pytest
from platwright.errors import InputError
from platwright.progress import Silent
from platwright.site.roadnetwork import build_network
from platwright.site.roads import RoadLayer
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Point, box


class Listener(Silent):
    def __init__(self):
        self.said = []

    def info(self, text):
        self.said.append(text)


def network(*lines):
    array = np.array(lines, dtype=object)
    return build_network(array, np.array([f"n{k}" for k in range(len(lines))], dtype=object),
                         np.array([""] * len(lines), dtype=object))  # fmt: skip


def test_a_crossing_cuts_two_lines_into_four_with_their_names():
    net = network(LineString([(-50, 0), (50, 0)]), LineString([(0, -30), (0, 30)]))
    assert sorted((n, x.length) for n, x in zip(net.names, net.lines)) == [
        ("n0", 50), ("n0", 50), ("n1", 30), ("n1", 30),
    ]  # fmt: skip
    assert sorted(net.degree) == [1, 1, 1, 1, 4]
    at = net.nodes[np.argmax(net.degree)]
    assert at.tolist() == [0, 0]


def test_pieces_in_a_row_are_one_line():
    net = network(LineString([(0, 0), (10, 0)]), LineString([(20, 5), (10, 0)]))
    assert len(net.lines) == 1
    assert sorted(net.degree) == [1, 1]


def test_order_and_direction_of_the_input_do_not_matter():
    a, b = LineString([(-50, 0), (50, 0)]), LineString([(0, -30), (0, 30)])
    one, two = network(a, b), network(b.reverse(), a.reverse())
    assert [x.wkt for x in one.lines] == [x.wkt for x in two.lines]


def test_what_is_no_street_is_left_out_and_counted():
    frame = gpd.GeoDataFrame(
        {
            "HIGHWAY": ["residential", "footway", "Steps", None, "motorway", "service", "primary"],
            "Name": ["A", "B", "C", "D", "E", "F", "G"],
            "tunnel": [None, None, None, "no", None, None, "yes"],
        },
        geometry=[LineString([(k * 10, 0), (k * 10, 5)]) for k in range(7)],
        crs=25832,
    )
    heard = Listener()
    net = RoadLayer(frame, "roads", heard).near(box(0, 0, 60, 5), CRS.from_epsg(25832))
    assert sorted(net.names) == ["A", "D", "F"]
    assert len(heard.said) == 1
    assert "Layer 'roads': 3 paths" in heard.said[0]
    assert "1 tunnels" in heard.said[0]


def test_only_near_roads_and_any_geometry():
    frame = gpd.GeoDataFrame(
        geometry=[
            MultiLineString([[(0, 0, 7), (9, 0, 7)], [(0, 5), (9, 5)]]),
            LineString([(0, 400), (9, 400)]),
            Point(0, 0),
            None,
            LineString(),
        ],
        crs=25832,
    )
    net = RoadLayer(frame, "roads", Silent()).near(box(0, 0, 10, 10), CRS.from_epsg(25832))
    assert len(net.lines) == 2
    assert not any(x.has_z for x in net.lines)


def test_missing_crs():
    with pytest.raises(InputError, match="Layer 'ways'"):
        RoadLayer(gpd.GeoDataFrame(geometry=[LineString([(0, 0), (1, 1)])]), "ways", Silent())


def test_a_merged_line_knows_where_its_name_changes():
    net = network(LineString([(0, 0), (10, 0)]), LineString([(40, 0), (25, 3), (10, 0)]))
    (line,) = net.lines
    long = LineString([(10, 0), (25, 3), (40, 0)]).length
    assert [(s.name, s.end - s.start) for s in net.sections[0]] == [
        ("n0", pytest.approx(10)), ("n1", pytest.approx(long)),
    ]  # fmt: skip
    assert net.sections[0][-1].end == line.length
    assert net.at(0, 4).name == "n0"
    assert net.at(0, 11).name == "n1"
    assert net.names.tolist() == ["n1"], "the name of its longer part"


def test_pieces_of_one_name_are_one_section():
    lines = np.array([LineString([(k, 0), (k + 1, 0)]) for k in range(4)], dtype=object)
    net = build_network(lines, np.array(["a", "a", "b", "b"], dtype=object),
                        np.array(["x", "y", "y", "y"], dtype=object))  # fmt: skip
    assert [(s.name, s.kind, s.start) for s in net.sections[0]] == [
        ("a", "x", 0), ("a", "y", 1), ("b", "y", 2),
    ]  # fmt: skip


def test_a_loop_keeps_the_junction_of_its_stem():
    ring = LineString([(30, 0), (50, 0), (50, 40), (0, 40), (0, 0), (30, 0)])
    net = network(ring, LineString([(30, 0), (30, -20)]))
    assert sorted(net.degree) == [1, 3]
    assert net.nodes[np.argmax(net.degree)].tolist() == [30, 0]


def test_a_ring_without_junctions_starts_where_the_name_changes():
    net = network(
        LineString([(-5, 0), (50, 0), (50, 40)]), LineString([(50, 40), (-5, 40), (-5, 0)])
    )
    assert [s.name for s in net.sections[0]] in (["n0", "n1"], ["n1", "n0"])
    middle = network(
        LineString([(0, 0), (10, -9), (20, 0)]), LineString([(20, 0), (20, 40), (0, 40), (0, 0)])
    )
    assert sorted(s.name for s in middle.sections[0]) == ["n0", "n1"]
    assert middle.sections[0][-1].end == middle.lines[0].length


def test_of_two_lines_on_one_another_the_named_one_counts():
    a = LineString([(0, 0), (10, 0)])
    for names in (["", "Mill"], ["Mill", ""]):
        twice, blank = np.array([a, a.reverse()], dtype=object), np.array(["", ""], dtype=object)
        net = build_network(twice, np.array(names, dtype=object), blank)
        assert net.names.tolist() == ["Mill"]
