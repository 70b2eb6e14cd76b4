"""Designs side by side: figures against the layers, the same everywhere, reasons, pictures."""

from __future__ import annotations

import base64
import json
import math
import re
import time
import xml.etree.ElementTree as ET

import geopandas as gpd
import numpy as np
import pytest
import shapely
from platwright.errors import InputError
from platwright.explore import explore, grid, page, picture, plot, runs_of, table_of_axes
from platwright.network.specification import Specification
from platwright.progress import Silent
from platwright.site import prepare_sites
from platwright.streets import Wishes
from platwright.tasks import Processes, Serial
from shapely.geometry import LineString

PAPER = Specification(
    rules="paper", levels=1, edge_length=50.0, effort=5.0, time_limit=30.0, weight_length=1.0
)


#: An L of 500 by 400 m with a street along its west side only.
CORNERS = [(0, 0), (500, 0), (500, 200), (300, 200), (300, 400), (0, 400)]
GROUND = shapely.Polygon([(500000 + x, y) for x, y in CORNERS])


@pytest.fixture(scope="module")
def prepared():
    """That site."""
    west = LineString([(500000, -50), (500000, 450)])
    return prepare_sites(
        gpd.GeoDataFrame(geometry=[GROUND], crs=32635),
        roads=gpd.GeoDataFrame(geometry=[west], crs=32635),
    )


@pytest.fixture(scope="module")
def runs():
    """Two weights of the way out, and something that cannot be."""
    rows = [
        {"weight_distance": 0},
        {"weight_distance": 0.5},
        {"edge_length": 2, "name": "too fine"},
    ]
    return runs_of(PAPER, rows)


@pytest.fixture(scope="module")
def found(prepared, runs):
    """Their designs."""
    return explore(prepared, runs)


def bits(exploration):
    """Return all that was designed as bytes, but for the time that it took."""
    made = []
    for one in exploration.designs:
        layers = {
            key: (shapely.to_wkb(frame.geometry.array).tolist(), frame.drop(columns="geometry"))
            for key, frame in one.layers.items()
        }
        figures = {key: value for key, value in one.figures.items() if key != "seconds"}
        shown = {k: (shapes, repr(rest.to_dict("list"))) for k, (shapes, rest) in layers.items()}
        made.append((one.state, one.reason, one.pareto, repr(figures), shown))
    return made


def test_figures_are_those_of_the_layers(found):
    for one in found.done:
        streets = one.layers["streets"]
        new = streets[streets["status"] == "new"]
        assert one.figures["length_m"] == pytest.approx(new.geometry.length.sum(), rel=1e-3)
        ends = new[["dist_start_m", "dist_end_m"]].to_numpy()
        # the farthest place is an end of a street, or lies on the one that joins two of them
        assert ends.max() - 1 <= one.figures["max_distance_m"] <= ends.max() + 150
        assert 0 < one.figures["mean_distance_m"] < one.figures["max_distance_m"]
        assert one.figures["blocks"] == len(one.layers["blocks"])
        # nothing ends but at another street or at the edge
        assert one.figures["dead_ends"] == 0
        assert one.figures["bound"] <= one.figures["objective"] + 1e-6
        merged = shapely.union_all(new.geometry.array)
        cut = shapely.get_parts(shapely.polygonize([shapely.union(merged, GROUND.exterior)]))
        assert len(cut) == len(one.layers["blocks"])


def test_short_ways_cost_length(found):
    short, near = found.done
    assert near.figures["mean_distance_m"] < short.figures["mean_distance_m"]
    assert short.figures["length_m"] <= near.figures["length_m"]
    assert [one.pareto for one in found.designs] == [True, True, False]


def test_what_cannot_be_designed_says_why_and_takes_nothing_with_it(found):
    lost = found.designs[2]
    assert lost.state == "failed"
    assert lost.run.name == "too fine"
    assert "The site covers 16 ha; streets are designed for up to 1 ha at once" in lost.reason
    assert len(found.done) == 2


def test_processes_give_the_same_bit_for_bit(prepared, runs, found):
    for executor in (Processes(2), Serial()):
        assert bits(explore(prepared, runs, executor=executor)) == bits(found)


def test_the_table_has_a_row_for_each_run(found):
    table = found.table()
    assert found.varied == ["weight_distance", "edge_length"]
    assert table["design"].tolist() == [1, 2, 3]
    assert table["weight_distance"].tolist() == [0.0, 0.5, 0.0]
    assert table["state"].tolist() == ["done", "done", "failed"]
    assert table["length_m"].isna().tolist() == [False, False, True]
    assert json.loads(table["parameters"][1]) == {"weight_distance": 0.5}
    same = table_of_axes(found)
    assert same["parameter_x"].tolist() == ["weight of the way out"] * 3
    assert same["value_x"].tolist() == ["0", "0.5", "0"]
    assert same["value_y"].tolist() == ["50 m", "50 m", "2 m"]
    assert not set(found.varied) & set(same.columns)


def test_the_layer_tells_designs_apart(found):
    layer = found.layer("streets")
    for one in found.done:
        own = layer[layer["design"] == one.run.number]
        assert len(own) == len(one.layers["streets"])
        assert set(own["design_name"]) == {one.run.name}
    assert set(layer["design"]) == {1, 2}


def test_exits_differ_between_runs(prepared):
    rows = [{"sinks": "north"}, {"sinks": "east"}]
    places = {"north": (500150.0, 400.0), "east": (500500.0, 100.0)}
    both = explore(
        prepared, runs_of(PAPER, rows), wishes=lambda _, run: Wishes(sinks=[places[run.sinks]])
    )
    for one in both.designs:
        junctions = one.layers["junctions"]
        out = junctions[junctions["is_sink"]].get_coordinates().to_numpy()
        assert len(out) == 1
        assert np.hypot(*(out[0] - places[one.run.sinks])) < 30
    assert both.varied == ["sinks"]


class Impatient(Silent):
    """Cancels as soon as one design is done."""

    over = False

    def stage(self, text, _):
        self.over = self.over or text.startswith("1 of")

    def cancelled(self):
        return self.over


@pytest.mark.parametrize("executor", [Serial(), Processes(1)])
def test_cancel_keeps_what_is_done(prepared, executor):
    runs = grid(PAPER, {"weight_distance": [0.0, 1.0, 2.0]})
    began = time.monotonic()
    found = explore(prepared, runs, executor=executor, progress=Impatient())
    assert time.monotonic() - began < 20
    assert [one.state for one in found.designs] == ["done", "cancelled", "cancelled"]
    assert "cancelled" in page(found)


def test_nothing_to_do_is_refused(prepared, runs):
    with pytest.raises(InputError, match="nothing to design"):
        explore(prepared, [])
    with pytest.raises(InputError, match="No such figure: beauty"):
        explore(prepared, runs, columns=["beauty"])


def test_the_plot_has_a_point_for_each_design(found):
    drawn = ET.fromstring(plot(found, "svg"))  # noqa: S314 - our own
    text = "".join(drawn.itertext())
    for words in ("length of the new streets (m)", "mean way out of the site (m)"):
        assert words in text
    points = [e for e in drawn.iter() if e.get("id", "").startswith("PathCollection")]
    uses = [len([u for u in e.iter() if u.tag.endswith("use")]) for e in points[:2]]
    assert uses == [0, 2]
    assert plot(found, "svg") == plot(found, "svg")
    assert plot(found, "png").startswith(b"\x89PNG")
    with pytest.raises(InputError, match="kind gif"):
        plot(found, "gif")


def test_the_picture_shows_every_plan(found):
    drawn = ET.fromstring(picture(found, "svg"))  # noqa: S314
    text = " ".join("".join(e.itertext()) for e in drawn.iter() if e.tag.endswith("text"))
    for one in found.designs:
        assert f"{one.run.number}:" in text
    assert "no design" in text
    for one in found.done:
        assert f"d {one.figures['mean_distance_m']:.0f} m" in text
    axes = [e for e in drawn.iter() if re.fullmatch(r"axes_\d+", e.get("id", ""))]
    assert len(axes) == 3
    assert picture(found, "png") == picture(found, "png")


def test_the_page_needs_nothing_from_elsewhere(found):
    text = page(found, "Trade-offs <here>")
    assert "Trade-offs &lt;here&gt;" in text
    assert "<script" not in text
    links = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert len(links) == 2
    assert all(link.startswith("data:image/") for link in links)
    assert base64.b64decode(links[1].partition(",")[2]).startswith(b"\x89PNG")
    rows = re.findall(r"<tr class=\"(\w+)\">", text)
    assert rows == ["front", "front", "failed"]
    assert not re.search(r"https?://", re.sub(r'"data:[^"]*"', "", text))


def test_without_any_design_there_is_no_plot(prepared):
    none = explore(prepared, runs_of(PAPER, [{"edge_length": 2}]))
    assert none.done == []
    assert len(none.layer("streets")) == 0
    assert math.isnan(none.table()["length_m"][0])
    with pytest.raises(InputError, match="no design to draw"):
        plot(none)


def test_names_with_signs_of_formulas_are_drawn_as_they_are(prepared):
    """They come from a file of the planner; a formula that is none stopped the picture."""
    named = runs_of(PAPER, [{"weight_distance": 0, "name": "$^$ for 5 $"}])
    drawn = picture(explore(prepared, named), "svg")
    assert drawn.startswith(b"<?xml")


@pytest.mark.parametrize(("limit", "hurried"), [(0.3, True), (120.0, False)])
def test_a_clock_that_strikes_is_told(limit, hurried):
    """A search that is cut, on whichever level, and one that ends by its work in time."""
    east, north = 500000.0, 0.0
    west = LineString([(east, north - 50), (east, north + 550)])
    field = prepare_sites(
        gpd.GeoDataFrame(geometry=[shapely.box(east, north, east + 600, north + 500)], crs=32635),
        roads=gpd.GeoDataFrame(geometry=[west], crs=32635),
    )
    spec = Specification(levels=2, edge_length=40.0, effort=15.0, time_limit=limit)
    (one,) = explore(field, runs_of(spec, [{"weight_distance": 0.5}])).designs
    assert one.state == "done"
    assert one.hurried is hurried
