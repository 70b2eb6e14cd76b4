"""Figures of street patterns, worked out by hand."""

from __future__ import annotations

import math

import geopandas as gpd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.measure.pattern import measure_pattern, pattern_grain
from shapely import affinity
from shapely.geometry import LineString, box

# A plane in metres, true to scale around its origin.
CRS = "+proj=tmerc +lat_0=60 +lon_0=25 +k=1 +datum=WGS84 +units=m +type=crs"
SITE = box(0, 0, 200, 300)


def layer(*shapes, **columns):
    return gpd.GeoDataFrame(columns, geometry=list(shapes), crs=CRS)


def edge_of(site=SITE):
    return [LineString(side) for side in zip(site.exterior.coords, site.exterior.coords[1:])]


def measured(*streets, around=(), width=100.0, length=150.0, site=SITE, **columns):
    return measure_pattern(
        layer(*streets, **columns),
        layer(site),
        layer(*edge_of(site), *around),
        block_width=width,
        block_length=length,
    )


def test_a_cross():
    found = measured(
        LineString([(0, 150), (100, 150), (200, 150)]),
        LineString([(100, 0), (100, 150), (100, 300)]),
    )
    assert found.length_per_hectare == pytest.approx(500 / 6)
    assert (found.t_junctions, found.crossings) == (0, 1)
    assert (found.bends_per_km, found.dead_ends_per_km, found.turning_per_km) == (0, 0, 0)
    assert (found.odd_corners, found.offsets) == (0, 0)
    assert (found.blocks, found.good, found.thin, found.deep) == (4, 1, 0, 0)
    assert found.width_off == pytest.approx(0, abs=1e-9)
    assert found.length_off == pytest.approx(0, abs=1e-9)
    assert found.rectangularity == pytest.approx(1)
    # halves of 100 m and of 150 m, from 0 up to their whole length at the crossing: but from the
    # long arms the way out leads through the short ones for those beyond 125 m
    short = 2 * 100 * 50
    arm = 125 * 62.5 + 25 * (125 + 100) / 2
    assert found.way_out == pytest.approx((short + 2 * arm) / 500)


def test_bends_blind_ends_and_t_junctions():
    found = measured(
        LineString([(0, 100), (80, 100), (80, 200), (200, 200)]),
        LineString([(140, 200), (140, 240)]),
    )
    km = (80 + 100 + 120 + 40) / 1000
    assert found.bends_per_km == pytest.approx(2 / km)
    assert found.turning_per_km == pytest.approx(180 / km)
    assert found.dead_ends_per_km == pytest.approx(1 / km)
    assert (found.t_junctions, found.crossings) == (1, 0)


def test_turning_counts_at_junctions_too():
    # a street that turns by 10 degrees where another one crosses it
    rise = 100 * math.tan(math.radians(10))
    found = measured(
        LineString([(0, 150), (100, 150)]),
        LineString([(100, 150), (200, 150 + rise)]),
        LineString([(100, 0), (100, 150)]),
        LineString([(100, 150), (100, 300)]),
    )
    km = (100 + math.hypot(100, rise) + 300) / 1000
    assert found.turning_per_km * km == pytest.approx(10, abs=0.01)
    assert found.bends_per_km == 0


def test_odd_corners():
    # at the edge a street leans by 30 degrees: both corners there are odd, those at its other
    # end and those between existing streets do not count as such
    found = measured(LineString([(100, 0), (100, 60), (100 + 90 * math.tan(math.pi / 6), 150)]),
                     LineString([(0, 150), (200, 150)]))  # fmt: skip
    # nodes: (100, 0) square: 2 corners; the junction on the second street: 30 degrees off: 2 of 3
    # corners; its two ends: 4 square corners. The straight side of each T is a corner, too.
    assert found.odd_corners == pytest.approx(2 / (2 + 3 + 4))


def test_offset_junctions():
    streets = [LineString([(0, 150), (200, 150)]), LineString([(100, 0), (100, 150)])]
    assert measured(*streets, LineString([(140, 150), (140, 300)])).offsets == 0
    near = measured(*streets, LineString([(120, 150), (120, 300)]))
    # of six junctions, four of which are at the edge, two lie 20 m apart
    assert near.offsets == pytest.approx(2 / 6)


def test_continued_streets():
    arriving = [LineString([(100, 0), (100, -80)]), LineString([(200, 150), (280, 150)])]
    found = measured(LineString([(100, 0), (100, 300)]), around=arriving)
    assert (found.continued, found.arriving) == (0.5, 2)
    beside = measured(LineString([(104, 0), (104, 300)]), around=arriving)
    assert (beside.continued, beside.arriving) == (0, 2)
    # one that goes on along the edge does not arrive
    along = measured(LineString([(100, 0), (100, 300)]), around=[LineString([(0, 0), (-80, 0)])])
    assert along.arriving == 0


def test_existing_streets_and_those_on_the_edge_are_none_of_the_site():
    spine = LineString([(100, 0), (100, 300)])
    alone = measured(spine)
    both = measured(spine, LineString([(0, 0), (200, 0)]), LineString([(0, 150), (100, 150)]),
                    status=["new", "new", "existing"])  # fmt: skip
    assert both == alone


def test_block_sizes_against_what_was_asked():
    found = measured(LineString([(40, 0), (40, 300)]), width=80.0, length=300.0)
    # 40 and 160 m wide: half and double
    assert found.width_off == pytest.approx(math.log(2))
    assert (found.good, found.thin, found.deep) == (0, 0.5, 0.5)


def test_the_grain_is_by_area():
    streets, site, edge = layer(LineString([(40, 0), (40, 300)])), layer(SITE), layer(*edge_of())
    grain = pattern_grain(streets, site, edge)
    # four fifths of the ground lie in the wide block
    assert (grain.width, grain.length, grain.longest) == pytest.approx((160, 300, 300))
    with pytest.raises(InputError, match="no block"):
        pattern_grain(streets, layer(box(0, 0, 5, 5)), edge)


def test_without_streets():
    found = measured()
    assert (found.length_per_hectare, found.way_out, found.blocks) == (0, 0, 1)
    assert found.continued == 1
    with pytest.raises(InputError, match="0 by 150 m"):
        measured(width=0.0)


@settings(max_examples=15)
@given(st.floats(0, 360), st.floats(-50, 50))
def test_figures_do_not_depend_on_where_and_how_a_place_lies(angle, shift):
    shapes = [
        LineString([(0, 150), (90, 150), (200, 160)]),
        LineString([(90, 150), (90, 300)]),
        LineString([(60, 0), (60, 150)]),
    ]
    around = [LineString([(60, 0), (62, -90)]), *edge_of()]

    def moved(parts):
        return [
            affinity.translate(affinity.rotate(part, angle, origin=(0, 0)), shift, -shift)
            for part in parts
        ]

    size = {"block_width": 90.0, "block_length": 150.0}
    here = measure_pattern(layer(*shapes), layer(SITE), layer(*around), **size)
    there = measure_pattern(
        layer(*moved(shapes)), layer(*moved([SITE])), layer(*moved(around)), **size
    )
    # blocks are noded on a grid of a centimetre
    assert there.as_dict() == pytest.approx(here.as_dict(), rel=1e-5, abs=1e-3)
