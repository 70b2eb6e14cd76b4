import geopandas as gpd
import numpy as np
import pytest
from platwright.errors import InputError
from platwright.progress import Silent
from platwright.site.roads import RoadLayer, build_network
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
