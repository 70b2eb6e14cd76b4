"""Layers to floors: storeys, exits, obstacles, corridors, CRS, and what is refused."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
import shapely
from platwright.errors import CancelledError, InputError
from platwright.progress import Silent
from platwright.rooms.floors import LayerNames, floors_of, floors_of_mesh
from shapely.affinity import translate
from shapely.geometry import LineString, MultiPolygon, Point, Polygon, box

CRS = 32632
X, Y = 372000.0, 4843000.0
PLAN = box(X, Y, X + 60, Y + 20)  # 15 x 5 squares of 4 m


def layer(*shapes, crs=CRS, **columns):
    return gpd.GeoDataFrame(columns, geometry=list(shapes), crs=crs)


def at(x, y):
    return Point(X + x, Y + y)


def rect(x0, y0, x1, y1):
    return box(X + x0, Y + y0, X + x1, Y + y1)


def places(floor, chosen):
    return {tuple(np.round(p - (X, Y), 6)) for p in floor.mesh.vertices[chosen]}


def test_plain_rectangle_gets_an_exit_in_its_longest_side():
    (floor,) = floors_of(layer(PLAN))
    assert (floor.storey, floor.feature) == (0, 0)
    assert len(floor.mesh.faces) == 75
    assert floor.floor.all()
    assert not floor.required.any()
    (place,) = places(floor, floor.sinks)
    assert place[1] in (0.0, 20.0)
    assert abs(place[0] - 30.0) <= 2.0 + 1e-6
    assert "No exit is given" in floor.remarks[0].text
    # the outer wall is the polygon's boundary
    walls = floor.mesh.vertices[floor.mesh.edges[floor.outer]]
    assert shapely.length(shapely.linestrings(walls)).sum() == pytest.approx(PLAN.length)


def test_upper_storeys_without_exits_use_the_largest_shaft_that_all_share():
    shafts = layer(rect(28, 8, 36, 12), rect(0, 0, 4, 4), rect(0, 8, 20, 20), floor=[None, None, 2])
    floors = floors_of(layer(PLAN), obstacles=shafts, storeys=3)
    assert {y for _, y in places(floors[0], floors[0].sinks)} <= {0.0, 20.0}
    lift = {(x, y) for x in (28.0, 32.0, 36.0) for y in (8.0, 12.0)}
    for upper in floors[1:]:
        assert places(upper, upper.sinks) == lift
        assert any("largest shaft" in own.action for own in upper.remarks)
    # without shafts there is only the wall
    for plain in floors_of(layer(PLAN), storeys=2):
        assert {y for _, y in places(plain, plain.sinks)} <= {0.0, 20.0}


def test_storeys_share_one_mesh_and_differ_in_what_stands_on_them():
    lifts = layer(rect(28, 8, 36, 12), rect(0, 0, 12, 8), floor=[None, 2])
    exits = layer(at(32, 10), at(0.5, 9), floor=[np.nan, 0])
    floors = floors_of(layer(PLAN), sinks=exits, obstacles=lifts, storeys=3)
    assert [f.storey for f in floors] == [0, 1, 2]
    assert all(f.mesh is floors[0].mesh for f in floors)
    assert [int((~f.floor).sum()) for f in floors] == [2, 2, 8]
    lift = {(x, y) for x in (28.0, 32.0, 36.0) for y in (8.0, 12.0)}
    assert places(floors[1], floors[1].sinks) == lift
    assert places(floors[0], floors[0].sinks) == lift | {(0.0, 8.0)}


def test_storeys_are_those_that_the_layers_name():
    exits = layer(at(0, 8), at(60, 8), floor=["-1", "4"])
    floors = floors_of(layer(PLAN), sinks=exits)
    assert [f.storey for f in floors] == [-1, 4]
    assert [places(f, f.sinks) for f in floors] == [{(0.0, 8.0)}, {(60.0, 8.0)}]


def test_footprint_of_one_storey_only():
    plans = layer(PLAN, rect(0, 0, 40, 20), floor=[0, 1])
    floors = floors_of(plans)
    assert [(f.storey, f.feature, len(f.mesh.faces)) for f in floors] == [(0, 0, 75), (1, 1, 50)]


def test_two_buildings_get_their_own_exits():
    plans = layer(PLAN, translate(PLAN, 0, 50))
    floors = floors_of(plans, sinks=layer(at(0, 8), at(60, 58)))
    assert [places(f, f.sinks) for f in floors] == [{(0.0, 8.0)}, {(60.0, 58.0)}]


def test_obstacle_takes_faces_of_which_it_covers_more_than_half():
    obstacles = layer(rect(0, 0, 6.1, 4), rect(20, 0, 21, 1), rect(200, 0, 210, 9))
    (floor,) = floors_of(layer(PLAN), obstacles=obstacles)
    assert int((~floor.floor).sum()) == 2
    texts = [r.text for r in floor.remarks]
    assert any("feature 1 covers no square" in t for t in texts)
    assert any("feature 2 lies on no floor" in t for t in texts)


def test_obstacle_that_cuts_the_floor_is_told():
    (floor,) = floors_of(layer(PLAN), obstacles=layer(rect(20, -1, 24, 21)))
    assert any("into 2 pieces" in remark.text for remark in floor.remarks)


def test_forced_corridor_follows_the_nearest_edges():
    lines = layer(LineString([(X + 1, Y + 8.9), (X + 41, Y + 8.9), (X + 40.5, Y + 19)]))
    (floor,) = floors_of(layer(PLAN), corridors=lines)
    ends = np.round(floor.mesh.vertices[floor.mesh.edges[floor.required]] - (X, Y), 6)
    wanted = {((4.0 * k, 8.0), (4.0 * k + 4, 8.0)) for k in range(10)}
    wanted |= {((40.0, 4.0 * k), (40.0, 4.0 * k + 4)) for k in range(2, 5)}
    assert {tuple(sorted(map(tuple, e))) for e in ends.tolist()} == wanted


def test_degrees_and_feet_give_the_same_floor():
    (metric,) = floors_of(layer(PLAN), sinks=layer(at(8, 0)))
    (degrees,) = floors_of(layer(PLAN).to_crs(4326), sinks=layer(at(8, 0)).to_crs(3857))
    assert degrees.crs.to_epsg() == CRS
    assert degrees.source_crs.to_epsg() == 4326
    assert len(degrees.mesh.faces) == len(metric.mesh.faces)
    assert degrees.polygon.area == pytest.approx(1200.0, abs=0.2)
    assert np.allclose(degrees.mesh.lengths, 4.0, atol=0.01)
    back = degrees.mesh.vertices[degrees.sinks]
    assert np.allclose(back, [[X + 8, Y]], atol=0.01)


def test_inputs_are_left_as_they_are():
    frames = {
        "footprints": layer(PLAN, floor=[None]),
        "sinks": layer(at(0, 8)),
        "obstacles": layer(Polygon([(X, Y), (X + 8, Y + 8), (X + 8, Y), (X, Y + 8)])),
        "corridors": layer(LineString([(X, Y + 8), (X + 20, Y + 8)])),
    }
    before = {name: frame.copy(deep=True) for name, frame in frames.items()}
    floors_of(frames["footprints"], **{k: v for k, v in frames.items() if k != "footprints"})
    for name, frame in frames.items():
        assert frame.geometry.geom_equals_exact(before[name].geometry, 0).all()
        assert frame.equals(before[name])


def test_spike_is_repaired_with_a_remark():
    spiked = Polygon(
        [(X, Y), (X + 60, Y), (X + 60, Y + 20), (X + 30, Y + 20), (X + 30, Y + 40),
         (X + 30, Y + 20), (X, Y + 20)]
    )  # fmt: skip
    (floor,) = floors_of(layer(spiked))
    assert floor.polygon.area == pytest.approx(1200.0)
    assert any("feature 0: invalid" in r.text and "made valid" in r.action for r in floor.remarks)


def test_feature_ids_and_layer_names_are_those_of_the_layer():
    plans = layer(PLAN).set_index(np.array([4711]))
    plans.index.name = "fid"
    (floor,) = floors_of(plans)
    assert floor.feature == 4711
    tiny = gpd.GeoDataFrame(geometry=[rect(0, 0, 5, 5)], index=[9], crs=CRS)
    with pytest.raises(InputError, match="Layer 'Houses', feature 9: "):
        floors_of(tiny, names=LayerNames(footprints="Houses"))


BOW = Polygon([(X, Y), (X + 40, Y + 40), (X + 40, Y), (X, Y + 40)])


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"footprints": layer(MultiPolygon([PLAN, translate(PLAN, 0, 50)]))}, "has 2 parts"),
        ({"footprints": layer(BOW)}, "crosses itself, so that it encloses 2 pieces"),
        ({"footprints": layer(PLAN, crs=None)}, "no coordinate reference system"),
        ({"footprints": layer(Polygon())}, "no shapes"),
        ({"footprints": layer(LineString([(X, Y), (X + 60, Y)]))}, "no polygon with an area"),
        ({"module": 0}, "module is 0"),
        ({"storeys": 0}, "number of storeys is 0"),
        ({"sinks": layer(at(70, 8))}, "'Exits', feature 0: It lies 10.0 m outside"),
        ({"sinks": layer(rect(0, 0, 1, 1))}, "'Exits', feature 0: It is a Polygon, not a point"),
        ({"sinks": layer(at(0, 8), floor=[5]), "storeys": 2}, "There is no storey 5"),
        ({"sinks": layer(at(0, 8), floor=["first"])}, "'floor' is 'first', not a whole number"),
        ({"sinks": layer(at(0, 8), floor=[0.5])}, "not a whole number"),
        ({"obstacles": layer(PLAN.buffer(1))}, "obstacles cover the whole floor"),
        ({"corridors": layer(LineString([(X, Y + 90), (X + 9, Y + 90)]))}, "outside all footprin"),
        ({"corridors": layer(LineString([(X + 9, Y + 6), (X + 9.3, Y + 6)]))}, "too short"),
    ],
)
def test_unusable_layers_are_refused(given, says):
    with pytest.raises(InputError, match=says):
        floors_of(**{"footprints": layer(PLAN), **given})


def test_mesh_layer_instead_of_a_footprint():
    cells = [rect(4 * i, 4 * j, 4 * i + 4, 4 * j + 4) for i in range(6) for j in range(3)]
    (floor,) = floors_of_mesh(layer(*cells), sinks=layer(at(0, 4)), obstacles=layer(cells[7]))
    assert len(floor.mesh.faces) == 18
    assert int(floor.floor.sum()) == 17
    assert floor.polygon.area == pytest.approx(18 * 16.0)
    assert places(floor, floor.sinks) == {(0.0, 4.0)}
    (degrees,) = floors_of_mesh(layer(*cells).to_crs(4326))
    assert len(degrees.mesh.faces) == 18


def test_mesh_layer_in_pieces_is_refused():
    cells = [rect(0, 0, 4, 4), rect(4, 0, 8, 4), rect(12, 0, 16, 4)]
    with pytest.raises(InputError, match="in 2 pieces; the smallest \\(1 faces\\)"):
        floors_of_mesh(layer(*cells))


def test_mesh_layer_whose_faces_overlap_is_refused():
    cells = [rect(0, 0, 4, 4), rect(4, 0, 8, 4), rect(8, 0, 12, 4), rect(8.5, 0, 3, 9)]
    with pytest.raises(InputError):
        floors_of_mesh(layer(*cells))


def test_cancelled_run_stops():
    class Impatient(Silent):
        def cancelled(self):
            return True

    with pytest.raises(CancelledError):
        floors_of(layer(PLAN), progress=Impatient())
