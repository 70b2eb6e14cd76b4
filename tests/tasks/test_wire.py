"""What travels between processes comes back exactly, and nothing else is made of it."""

from __future__ import annotations

import dataclasses
import datetime
import json
import math
import struct

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from geopandas.testing import assert_geodataframe_equal
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from platwright.network.level_settings import LevelSettings
from platwright.network.specification import Specification
from platwright.site.types import AccessPoint, BoundaryStreet, Site
from platwright.streets import Preferences, Wishes, Zone
from platwright.tasks.wire import from_text, to_text
from pyproj import CRS
from shapely.geometry import LineString, Point, Polygon

PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: (
        st.lists(inner)
        | st.lists(inner).map(tuple)
        | st.dictionaries(st.text() | st.integers(), inner)
    ),
    max_leaves=20,
)


@given(PLAIN)
def test_plain_data_comes_back_as_it_was(value):
    text = to_text(value)
    assert "\n" not in text
    back = from_text(text)
    assert back == value
    assert repr(back) == repr(value)


@given(st.floats())
def test_numbers_come_back_bit_for_bit(value):
    back = from_text(to_text(value))
    assert (
        math.isnan(back) if math.isnan(value) else struct.pack("d", back) == struct.pack("d", value)
    )


@given(hnp.arrays(hnp.boolean_dtypes() | hnp.integer_dtypes() | hnp.floating_dtypes(sizes=(32, 64)),
                  hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4)))  # fmt: skip
def test_arrays_come_back_bit_for_bit(value):
    back = from_text(to_text(value))
    assert (back.dtype, back.shape) == (value.dtype, value.shape)
    assert back.tobytes() == value.tobytes()
    back[...] = 0  # and may be changed


@given(st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 2), min_size=2, max_size=6))
def test_shapes_come_back_exactly(points):
    for shape in (LineString(points), shapely.MultiPoint(points), Point(points[0]), Polygon()):
        back = from_text(to_text(shape))
        assert shapely.to_wkb(back) == shapely.to_wkb(shape)


def site():
    """Return a site with something of everything."""
    line = LineString([(0.1, 0), (100 / 3, 0)])
    return Site(
        name="Yard", feature=7, polygon=shapely.box(0, 0, 100 / 3, 50), crs=CRS.from_epsg(32635),
        source_crs=CRS.from_epsg(4326), street_frontage=shapely.MultiLineString([line]),
        boundary_streets=[BoundaryStreet(line, "Main", "primary")],
        access_points=(AccessPoint((1.0, 2.0), (1.0, -2.0), (0.0, 1.0)),),
        obstacles=[shapely.box(1, 1, 2, 2)],
    )  # fmt: skip


def test_sites_specifications_and_wishes_come_back():
    spec = Specification(
        level_settings={2: LevelSettings(weight_length=3.0)}, dead_ends=math.inf, coverage=2.0
    )
    assert from_text(to_text(spec)) == spec
    back = from_text(to_text(site()))
    assert (back.crs, back.source_crs) == (site().crs, site().source_crs)
    assert back.crs.to_epsg() == 32635
    for name in (f.name for f in dataclasses.fields(Site)):
        assert to_text(getattr(back, name)) == to_text(getattr(site(), name))
    assert back.polygon.equals(site().polygon)
    assert back.boundary_streets == list(site().boundary_streets)
    heights = np.array([[0.0, 1.0]])
    wishes = Wishes(
        sinks=[(1.0, 2.0)], preferences=Preferences(density=(Zone(Point(0, 0), 80.0, 3),)),
        given={2: [LineString([(0, 0), (1, 1)])]},
    )  # fmt: skip
    again = from_text(to_text((wishes, heights)))
    assert again[0] == wishes
    assert isinstance(again[0].preferences, Preferences)


def test_what_was_one_thing_is_one_thing():
    one = site()
    first, second, other = from_text(to_text([one, one, site()]))
    assert first is second
    assert first is not other


def test_layers_come_back():
    frame = gpd.GeoDataFrame(
        {
            "street_id": np.array([3, 4], dtype=np.int64),
            "length_m": [0.1, math.nan],
            "name": ["Høy", None],
            "oneway": [True, False],
            "mixed": [1, "one"],
        },
        geometry=[LineString([(0, 0), (1, 1 / 3)]), None],
        crs="EPSG:32635",
        index=[10, 20],
    )
    back = from_text(to_text(frame))
    assert_geodataframe_equal(back, frame)
    empty = from_text(to_text(frame.iloc[:0]))
    assert list(empty.columns) == list(frame.columns)
    assert empty.crs == frame.crs
    table = pd.DataFrame({"a": [1, 2], "b": ["x", "y"]})
    pd.testing.assert_frame_equal(from_text(to_text(table)), table)


def test_what_is_not_known_is_refused():
    for value in (object(), {1, 2}, lambda: None, json):
        with pytest.raises(TypeError, match="cannot be handed"):
            to_text([value])


@pytest.mark.parametrize(
    "name",
    ["os:system", ".tasks.local:subprocess.Popen", ".tasks.wire:to_text", "..os:system",
     ".errors:InputError"],
)  # fmt: skip
def test_only_dataclasses_of_the_library_are_made(name):
    text = json.dumps({"object": [name, {}]})
    with pytest.raises(TypeError, match="no dataclass"):
        from_text(text)


DATES = (
    st.dates() | st.times() | st.datetimes()
    | st.datetimes().map(pd.Timestamp) | st.just(pd.NaT)
)  # fmt: skip


@given(DATES)
def test_dates_and_times_come_back_as_they_were(value):
    back = from_text(to_text(value))
    assert type(back) is type(value)
    assert back is value if value is pd.NaT else back == value


def test_layers_with_dates_and_a_named_index_come_back():
    frame = gpd.GeoDataFrame(
        {
            "built": [datetime.date(1999, 5, 1), None],
            "seen": pd.to_datetime(["2020-02-29 12:00:01.5", None]),
        },
        geometry=[Point(1, 2), Point(3, 4)],
        index=pd.Index([7, 9], name="fid"),
        crs=32632,
    )
    back = from_text(to_text(frame))
    assert_geodataframe_equal(back, frame)
    assert type(back["built"].iloc[0]) is datetime.date
    assert back.index.name == "fid"
