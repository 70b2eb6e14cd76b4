"""Layers of parcels: figures by hand on a block of 40 m x 30 m, and land in two CRSs."""

from __future__ import annotations

import math

import geopandas as gpd
import numpy as np
import pytest
import shapely
from platwright.errors import CancelledError, InputError
from platwright.parcels.blocks import blocks_from_streets
from platwright.parcels.fill.result import FillProblem
from platwright.parcels.land import Place
from platwright.parcels.layers import COLUMNS, block_problems, parcel_layers, parcel_numbers
from platwright.parcels.types import Block, Plot
from platwright.progress import Silent
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Point, Polygon, box

METRES = CRS("EPSG:3067")
X, Y = 500000.0, 6700000.0


def at(shape):
    return shapely.transform(shape, lambda xy: xy + np.array([X, Y]))


#: A street in the south and in the west; closed in the north and in the east.
BLOCK = Block(
    at(box(0, 0, 40, 30)), MultiLineString([at(LineString([(40, 0), (40, 30), (0, 30)]))])
)
CORNER, SLANTED, GREEN = (
    box(0, 0, 16, 30),
    Polygon([(16, 0), (36, 0), (32, 30), (16, 30)]),
    Polygon([(36, 0), (40, 0), (40, 30), (32, 30)]),
)
PLOTS = [
    Plot(at(CORNER), template="drawn"),
    Plot(at(SLANTED)),
    Plot(at(GREEN), "green", "pointed corner"),
]
HERE = Place(METRES, 3, "17")


@pytest.fixture(scope="module")
def layers():
    return parcel_layers([BLOCK], [PLOTS], [HERE], METRES, space=[(at(box(0, -6, 40, 0)), HERE)])


def test_figures_of_parcels(layers):
    made = layers["parcels"]
    assert list(made.columns) == [*COLUMNS["parcels"], "geometry"]
    corner, slanted, green = made.to_dict("records")
    assert [row["parcel_id"] for row in (corner, slanted, green)] == [1, 2, 3]
    assert corner["area_m2"] == pytest.approx(480)
    assert corner["frontage_m"] == pytest.approx(46, abs=0.2)
    # of two fronts the shorter one counts
    assert corner["depth_m"] == pytest.approx(30)
    assert corner["width_m"] == pytest.approx(16)
    assert (corner["p_angle"], corner["p_area"]) == pytest.approx((0, 1))
    assert (corner["corner"], corner["access"], corner["undesirable"]) == (True, True, False)
    assert (corner["template"], slanted["template"]) == ("drawn", "")
    assert slanted["area_m2"] == pytest.approx(540)
    assert slanted["frontage_m"] == pytest.approx(20, abs=0.2)
    assert slanted["depth_m"] == pytest.approx(30)
    assert slanted["width_m"] == pytest.approx(18)
    off = math.degrees(math.atan2(4, 30))
    assert slanted["p_angle"] == pytest.approx(off / 2)
    assert slanted["p_area"] == pytest.approx(600 / 540)
    assert (slanted["corner"], slanted["access"], slanted["undesirable"]) == (False, True, False)
    for row in (corner, slanted, green):
        assert (row["block_id"], row["site_id"], row["feature"]) == (1, 3, "17")


def test_what_is_no_parcel_has_no_figures(layers):
    green = layers["parcels"].to_dict("records")[2]
    assert (green["land_use"], green["note"]) == ("green", "pointed corner")
    assert green["area_m2"] == pytest.approx(180)
    for name in ("frontage_m", "depth_m", "width_m", "p_angle", "p_area"):
        assert green[name] is None or math.isnan(green[name])
    for name in ("undesirable", "corner", "access"):
        assert green[name] is None


def test_blocks_street_space_and_numbers(layers):
    (block,) = layers["parcel_blocks"].to_dict("records")
    assert block["open_m"] == pytest.approx(70, abs=0.2)
    assert (block["parcels"], block["perimeter_m"]) == (2, 140)
    assert block["green_m2"] == pytest.approx(180)
    (space,) = layers["street_space"].to_dict("records")
    assert (space["site_id"], space["area_m2"]) == (3, 240)
    told = parcel_numbers(layers["parcels"])
    assert told["PARCELS"] == 2
    assert told["MEAN_P_AREA"] == pytest.approx((1 + 600 / 540) / 2)
    assert (told["UNDESIRABLE"], told["WITH_ACCESS"]) == (0, 100)
    assert told["GREEN"] == pytest.approx(15)


def test_lanes_give_frontage_and_closed_edges_do_not():
    lane = Plot(at(box(0, 14, 40, 16)), "lane")
    rows = [Plot(at(box(0, 0, 40, 14))), lane, Plot(at(box(0, 16, 40, 30)))]
    shut = Block(BLOCK.polygon, MultiLineString([BLOCK.polygon.exterior.coords]))
    made = parcel_layers([shut], [rows], [HERE], METRES)["parcels"]
    assert made["frontage_m"].tolist()[::2] == pytest.approx([40, 40], abs=0.2)
    alone = parcel_layers([shut], [[Plot(shut.polygon)]], [HERE], METRES)["parcels"]
    (row,) = alone.to_dict("records")
    assert (row["frontage_m"], row["access"], row["corner"]) == (0, False, False)
    # without a front the depth is the long side
    assert (row["depth_m"], row["width_m"]) == pytest.approx((40, 30))


def test_no_corner_where_a_parcel_lies_between_two_parallel_streets():
    through = Block(at(box(0, 0, 20, 60)))
    made = parcel_layers([through], [[Plot(through.polygon)]], [HERE], METRES)["parcels"]
    assert made["corner"].tolist() == [True]
    sides = MultiLineString([[(0, 0), (0, 60)], [(20, 0), (20, 60)]])
    made = parcel_layers(
        [Block(through.polygon, at(sides))], [[Plot(through.polygon)]], [HERE], METRES
    )["parcels"]
    assert made["frontage_m"].tolist() == pytest.approx([40], abs=0.2)
    assert made["corner"].tolist() == [False]


def test_measures_are_in_metres_and_shapes_in_the_crs_of_the_input(tmp_path):
    """Land in two working CRSs comes back in degrees, and through a file."""
    other = Place(CRS("EPSG:32635"), 4, "18")
    blocks = [BLOCK, Block(BLOCK.polygon, BLOCK.closed, 2)]
    made = parcel_layers(blocks, [PLOTS, PLOTS], [other, HERE], CRS("EPSG:4326"))
    frame = made["parcels"]
    assert frame.crs == "EPSG:4326"
    assert frame["parcel_id"].tolist() == [1, 2, 3, 4, 5, 6]
    assert frame["block_id"].tolist() == [1, 1, 1, 2, 2, 2]
    assert frame["site_id"].tolist() == [4, 4, 4, 3, 3, 3]
    assert frame["area_m2"].tolist() == pytest.approx([480, 540, 180] * 2)
    back = frame.to_crs(METRES).geometry.area
    assert back.tolist()[3:] == pytest.approx([480, 540, 180], rel=1e-6)
    path = tmp_path / "parcels.gpkg"
    frame.to_file(path)
    again = gpd.read_file(path)
    assert again.crs == "EPSG:4326"
    assert again["land_use"].tolist() == frame["land_use"].tolist()
    assert again.geometry.geom_equals_exact(frame.geometry, 1e-12).all()


def test_problems_of_blocks_name_the_feature():
    told = FillProblem(1, Point(X, Y), "Too deep.", "Left as a court.")
    made = block_problems([told], [BLOCK], [HERE], "my blocks", CRS("EPSG:4326"))
    (row,) = made.to_dict("records")
    assert (row["layer"], row["feature"], row["severity"]) == ("my blocks", "17", "warning")
    assert (row["problem"], row["action"]) == ("Block 1: Too deep.", "Left as a court.")
    assert abs(row["geometry"].x - 27) < 1e-6
    assert len(block_problems([], [BLOCK], [HERE], "my blocks", METRES)) == 0


def test_nothing_gives_empty_layers_with_their_fields():
    made = parcel_layers([], [], [], METRES)
    for name, frame in made.items():
        assert list(frame.columns) == [*COLUMNS[name], "geometry"]
        assert len(frame) == 0
        assert frame.crs == METRES
    told = parcel_numbers(made["parcels"])
    assert told["PARCELS"] == 0
    assert math.isnan(told["MEAN_P_ANGLE"])


def test_lists_must_fit_and_a_cancelled_run_stops():
    with pytest.raises(InputError, match="1 blocks, 0 lists"):
        parcel_layers([BLOCK], [], [HERE], METRES)

    class Stop(Silent):
        def cancelled(self):
            return True

    with pytest.raises(CancelledError):
        parcel_layers([BLOCK], [PLOTS], [HERE], METRES, progress=Stop())


def test_thin_land_goes_into_the_layer_as_greens():
    site = gpd.GeoDataFrame(geometry=[at(box(0, 0, 200, 120))], crs=METRES)
    near = gpd.GeoDataFrame(geometry=[at(LineString([(-8, 9), (208, 9)]))], crs=METRES)
    made = blocks_from_streets(site, near)
    plots = made.with_thin([[Plot(block.polygon)] for block in made.blocks])
    frame = parcel_layers(made.all_blocks, plots, made.all_places, METRES)["parcels"]
    assert frame["land_use"].tolist() == ["parcel", "green"]
    assert frame["note"].tolist() == ["", "narrower than 4 m"]
    assert frame["block_id"].tolist() == [1, 2]
