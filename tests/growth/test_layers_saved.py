"""Layers of growths survive a file, are the same each time, and are made fast."""

from __future__ import annotations

import time

import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from clock import allowed
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError
from platwright.growth.layers import growth_layers
from platwright.progress import Silent

from .hand_made import Edge, given_street, lattice, make_growth, make_real, rules

KEYS = ("streets", "nodes", "roads", "blocks", "steps")


@pytest.fixture(scope="module")
def layers():
    growth = lattice(5, 4, seed=2)
    real = make_real(growth, shapely.box(-50, -50, 450, 350))
    return growth_layers(growth, real, rules())


@pytest.mark.parametrize("key", KEYS)
def test_a_geopackage_keeps_fields_types_and_moments(layers, key, tmp_path):
    frame = layers[key]
    path = tmp_path / "grown.gpkg"
    frame.to_file(path, layer=key, engine="pyogrio")
    back = pyogrio.read_dataframe(path, layer=key)
    assert list(back.columns) == list(frame.columns)
    for name in back.columns.drop("geometry"):
        assert back[name].dtype.kind == frame[name].dtype.kind, name
        if frame[name].dtype.kind == "M":
            assert (pd.to_datetime(back[name]) == frame[name]).all()
        elif frame[name].dtype.kind == "f":
            np.testing.assert_array_equal(back[name], frame[name])
        else:
            assert back[name].tolist() == frame[name].tolist()
    if key == "steps":
        assert back.geometry.isna().all()
    else:
        assert shapely.equals_exact(back.geometry.to_numpy(), frame.geometry.to_numpy()).all()
        assert back.crs == frame.crs


def test_the_same_growth_gives_the_same_bytes():
    growth = lattice(8, 8, seed=5)
    real = make_real(growth, shapely.box(-40, -40, 740, 740))
    one, other = (growth_layers(growth, real, rules()) for _ in range(2))
    for key in KEYS:
        same = [frame[key].geometry.to_wkb().tolist() for frame in (one, other)]
        assert same[0] == same[1]
        plain = [frame[key].drop(columns="geometry").to_csv() for frame in (one, other)]
        assert plain[0] == plain[1]


@settings(max_examples=25)
@given(st.integers(2, 6), st.integers(2, 6), st.integers(0, 10_000))
def test_lengths_add_up(columns, rows, seed):
    growth = lattice(columns, rows, seed=seed)
    made = growth_layers(growth, make_real(growth), rules())
    streets, roads = made["streets"], made["roads"]
    assert streets["length_m"].sum() == pytest.approx(growth.lengths.sum())
    assert roads["length_m"].sum() == pytest.approx(growth.lengths.sum())
    assert roads["segments"].sum() == len(growth.ends)
    assert roads["length_m"].to_numpy() == pytest.approx(roads.geometry.length.to_numpy())
    by_road = streets.groupby("road")["length_m"].sum()
    assert by_road.to_numpy() == pytest.approx(roads["length_m"].to_numpy())
    nodes = made["nodes"]
    assert nodes["degree"].sum() == 2 * len(streets)
    # every junction of the roads is one of the nodes, and lies on them
    lines = roads.set_index("road").geometry
    for road, count in zip(roads["road"], roads["junctions"]):
        on = nodes.geometry.distance(lines[road]) < 1e-6
        assert (nodes.loc[on, "degree"] >= 3).sum() == count
    # Euler: faces inside = edges - nodes + 1
    assert len(made["blocks"]) == len(growth.ends) - len(growth.xy) + 1


def test_a_long_existing_street_is_one_line():
    count = 3000
    xy = np.column_stack([np.arange(count) * 10.0, np.sin(np.arange(count) / 20) * 100])
    edges = [Edge(k, k + 1, street=0) for k in range(count - 1)]
    bends = np.ones(count, dtype=bool)
    bends[[0, -1]] = False
    growth = make_growth(xy, edges, bends=bends)
    real = make_real(growth, streets=(given_street(xy),), given=count)
    streets = growth_layers(growth, real, rules())["streets"]
    assert len(streets) == 1
    assert shapely.equals_exact(streets.geometry.iloc[0], real.streets[0].line)


class CancelledAfter(Silent):
    """A caller who cancels so many seconds after the work began."""

    def __init__(self, seconds):
        self.when = time.monotonic() + seconds
        self.asked = None

    def cancelled(self):
        late = time.monotonic() >= self.when
        if late and self.asked is None:
            self.asked = time.monotonic()
        return late


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0.0, 1.5, 3.0])
def test_cancelling_large_layers_takes_a_second(seconds):
    growth = lattice(160, 160, seed=1)
    real = make_real(growth, shapely.box(-60, -60, 15960, 15960))
    caller = CancelledAfter(seconds)
    with pytest.raises(CancelledError):
        growth_layers(growth, real, rules(), caller)
    # a busy machine may be late
    assert time.monotonic() - caller.when < allowed(3.0)


@pytest.mark.slow
def test_100_000_streets_take_seconds():
    growth = lattice(225, 225, seed=1)
    assert len(growth.ends) > 100_000
    real = make_real(growth, shapely.box(-60, -60, 22460, 22460))
    begin = time.process_time()
    made = growth_layers(growth, real, rules())
    assert time.process_time() - begin < 20.0
    assert len(made["blocks"]) == 224 * 224 + 1
