"""The report of a layer of streets: values by hand, and those of osmnx."""

from __future__ import annotations

import math

import geopandas as gpd
import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError
from platwright.measure.streets import StreetOptions, measure_streets
from platwright.progress import Silent
from shapely import affinity
from shapely.geometry import LineString, MultiLineString, Point, box

CRS = 32633


def frame(shapes, crs=CRS, index=None, **columns):
    """Return a layer, its origin where the grid's north is true north."""
    moved = [s if s is None else affinity.translate(s, 500_000, 6_000_000) for s in shapes]
    made = gpd.GeoDataFrame(columns, geometry=moved, crs=CRS, index=index)
    return made if crs == CRS else made.to_crs(crs)


def line(*points):
    return LineString(points)


CROSS = [line((0, 0), (100, 0)), line((0, 0), (0, 100)), line((0, 0), (-100, 0)),
         line((0, 0), (0, -100))]  # fmt: skip
#: Four blocks of a hectare; each line runs through, with a vertex where it meets another.
GRID = [line(*((100 * k, 100 * j) for k in range(3))) for j in range(3)] + [
    line(*((100 * j, 100 * k) for k in range(3))) for j in range(3)
]
NEVER_NAN = ("length_km", "segments", "intersections", "dead_ends", "blocks", "natural_count")


def test_figures_of_a_cross_by_hand():
    found = measure_streets(frame(CROSS), options=StreetOptions(width=10.0)).figures
    # the alpha shape is the square between the four tips
    expected = {
        "area_km2": 0.02, "length_km": 0.4, "street_km_km2": 20, "segments": 4,
        "segment_mean": 100, "intersections": 1, "intersections_km2": 50, "three_way": 0,
        "four_way": 1, "five_way": 0, "t_pct": 0, "y_pct": 0, "x_pct": 100, "dead_ends": 4,
        "dead_ends_km2": 200, "dead_ends_pct": 80, "blocks": 0, "entropy": math.log(4), "order": 1,
        "entropy_length": math.log(4), "order_length": 1, "sinuosity": 1,
        # of ten pairs four are around the corner
        "circuity": (6 + 4 * math.sqrt(2)) / 10,
        # two strips of 200 x 10 m, their middle once, their tips cut by the square
        "roads_pct": 100 * (4000 - 100 - 4 * 25) / 20000,
        "natural_count": 2, "natural_max": 200, "ht_index": 1, "livability": 2,
        # all six pairs of tips pass the middle
        "betweenness_max": 1, "betweenness_mean": 0.2,
        # from the middle 100 m; from a tip 100 m and three times 200 m
        "closeness_mean": (10 + 4 * 4 / 0.7) / 5,
        "components": 1, "largest_pct": 100, "meshedness": 0, "beta": 4 / 5, "gamma": 4 / 9,
        "crossings": 0,
    }  # fmt: skip
    for name, value in expected.items():
        assert getattr(found, name) == pytest.approx(value, rel=1e-6, abs=1e-9), name
    for name in ("block_mean_ha", "block_median_ha", "block_max_ha"):
        assert math.isnan(getattr(found, name))
    assert set(expected) | {"block_mean_ha", "block_median_ha", "block_max_ha"} == set(
        found.as_dict()
    )


def test_fields_of_a_cross_by_hand():
    names = ["a", "b", "c", "d"]
    layer = frame(CROSS, index=[7, 3, 11, 5], name=names, LENGTH_M=[1.0] * 4)
    report = measure_streets(layer)
    streets = report.streets
    assert streets.index.tolist() == [7, 3, 11, 5]
    assert streets["name"].tolist() == names
    assert "LENGTH_M" not in streets.columns
    assert list(layer.columns) == ["name", "LENGTH_M", "geometry"]
    assert streets["length_m"].tolist() == pytest.approx([100] * 4)
    assert streets["sinuosity"].tolist() == pytest.approx([1] * 4)
    assert streets["bearing_deg"].tolist() == pytest.approx([90, 0, 90, 0], abs=0.01)
    assert streets["natural_id"].tolist() in ([1, 2, 1, 2], [2, 1, 2, 1])
    assert streets["natural_m"].tolist() == pytest.approx([200] * 4)
    assert streets["connectivity"].tolist() == [1] * 4
    # each street: the way of a tip to the four others, of ten pairs
    assert streets["betweenness"].tolist() == pytest.approx([0.4] * 4)
    assert streets["closeness"].tolist() == pytest.approx([(10 + 4 / 0.7) / 2] * 4)
    assert streets["degree_start"].tolist() == [4] * 4
    assert streets["degree_end"].tolist() == [1] * 4
    assert streets["dead_end"].tolist() == [True] * 4
    nodes = report.nodes.sort_values("degree")
    assert nodes["kind"].tolist() == ["dead end"] * 4 + ["X"]
    assert nodes["betweenness"].tolist() == pytest.approx([0, 0, 0, 0, 1])
    assert nodes["deviation_deg"].tolist()[-1] == pytest.approx(0, abs=1e-6)
    assert sorted(report.natural["length_m"]) == pytest.approx([200, 200])
    assert report.natural["segments"].tolist() == [2, 2]
    assert (report.sources, report.connected) == (5, 5)
    for made in (streets, report.natural, report.nodes, report.problems):
        assert made.crs == layer.crs


def test_lines_that_run_through_junctions():
    """Corners are no junctions; a feature has the most of its pieces."""
    report = measure_streets(frame(GRID))
    found = report.figures
    assert (found.segments, found.intersections) == (8, 5)
    assert (found.three_way, found.four_way, found.dead_ends) == (4, 1, 0)
    assert (found.t_pct, found.x_pct) == (80, 20)
    assert (found.blocks, found.block_mean_ha, found.block_max_ha) == pytest.approx((4, 1, 1))
    # eight segments, five nodes, one part
    assert (found.meshedness, found.beta) == pytest.approx((4 / 5, 8 / 5))
    assert found.natural_count == 6
    # around corners 200 m for 141 m, else straight
    assert found.sinuosity == pytest.approx(1200 / (4 * 100 * math.sqrt(2) + 400))
    graph = nx.Graph()
    sides = [(0, 1), (1, 2), (2, 3), (3, 0)]
    graph.add_weighted_edges_from([(a, b, 200.0) for a, b in sides])
    graph.add_weighted_edges_from([(k, 4, 100.0) for k in range(4)])
    share = nx.edge_betweenness_centrality(graph, weight="weight")
    around, spoke = share[0, 1], share[0, 4]
    # the lines in the middle are two spokes, the others half of two corners each
    expected = [around, spoke, around] * 2
    assert report.streets["betweenness"].tolist() == pytest.approx(expected)
    assert report.streets["degree_start"].tolist() == [2, 3, 2] * 2
    assert not report.streets["dead_end"].any()
    assert report.nodes["degree"].tolist().count(3) == 4
    assert len(report.nodes) == 5


def test_with_a_site_what_lies_in_it_counts():
    """The left half of the grid, the middle street on its edge."""
    found = measure_streets(frame(GRID), site=frame([box(-20, -20, 100, 220)])).figures
    assert found.area_km2 == pytest.approx(0.0288)
    # three lines of 100 m and two of 200 m
    assert found.length_km == pytest.approx(0.7)
    assert found.blocks == 2
    # the middle street has three junctions, and the left one one
    assert (found.intersections, found.four_way) == (4, 1)
    # degrees are those of the whole layer: nothing is cut open
    assert found.dead_ends == 0
    whole = measure_streets(frame(GRID))
    assert found.betweenness_max == pytest.approx(whole.figures.betweenness_max)
    assert whole.figures.area_km2 == pytest.approx(0.04)


def test_streets_that_end_at_the_edge_of_the_site_are_no_dead_ends():
    site = frame([box(-100, -50, 100, 100)])
    found = measure_streets(frame(CROSS), site=site).figures
    # the tips to the west, east and north lie on the edge; the one to the south lies outside
    assert (found.dead_ends, found.intersections) == (0, 1)
    assert found.length_km == pytest.approx(0.35)
    wide = frame([box(-150, -150, 150, 150)])
    assert measure_streets(frame(CROSS), site=wide).figures.dead_ends == 4


def test_a_site_without_streets_has_empty_figures():
    report = measure_streets(frame(CROSS), site=frame([box(5000, 0, 5100, 100)]))
    found = report.figures
    assert (found.segments, found.intersections, found.blocks, found.length_km) == (0, 0, 0, 0)
    assert found.street_km_km2 == 0
    assert math.isnan(found.segment_mean)
    assert "none of the streets" in report.problems["problem"].tolist()[0]
    assert report.streets["length_m"].notna().all()


def test_one_line():
    report = measure_streets(frame([line((0, 0), (60, 80))]))
    found = report.figures
    assert (found.segments, found.dead_ends, found.intersections) == (1, 2, 0)
    assert found.length_km == pytest.approx(0.1)
    # no ground: nothing per square kilometre
    assert math.isnan(found.street_km_km2)
    assert math.isnan(found.dead_ends_km2)
    assert math.isnan(found.meshedness)
    assert found.closeness_mean == pytest.approx(10)
    row = report.streets.iloc[0]
    assert row["bearing_deg"] == pytest.approx(math.degrees(math.atan2(60, 80)), abs=0.01)
    assert row["dead_end"]


def test_blocks_between_streets_that_meet_but_nearly():
    """Ends that miss their junction by up to 0.4 m still enclose blocks."""
    random = np.random.default_rng(5)
    corners = [(0, 0), (100, 0), (200, 0), (200, 100), (100, 100), (0, 100)]
    sides = [*((k, (k + 1) % 6) for k in range(6)), (1, 4)]
    moved = [[np.add(corners[k], random.uniform(-0.15, 0.15, 2)) for k in pair] for pair in sides]
    found = measure_streets(frame([line(*pair) for pair in moved])).figures
    assert (found.blocks, found.intersections) == (2, 2)
    assert found.block_mean_ha == pytest.approx(1, rel=0.01)


def test_a_ring_alone():
    ring = line((0, 0), (100, 0), (100, 100), (0, 100), (0, 0))
    report = measure_streets(frame([ring]))
    assert report.figures.blocks == 1
    assert report.figures.block_mean_ha == pytest.approx(1)
    assert (report.figures.intersections, report.figures.dead_ends) == (0, 0)
    row = report.streets.iloc[0]
    assert row["length_m"] == pytest.approx(400)
    assert math.isnan(row["sinuosity"])
    assert math.isnan(row["bearing_deg"])
    assert not row["dead_end"]
    assert len(report.nodes) == 0


def test_every_feature_is_kept_whatever_it_is():
    shapes = [
        *CROSS,
        None,
        LineString(),
        Point(3, 3),
        MultiLineString([[(100, 0), (150, 0)], [(150, 30), (150, 100)]]),
        LineString([(0, 100, 7), (0, 160, 9)]),
        line((0, 0), (100, 0)),
        line((100, 0), (0, 0)),
        line((500, 500), (500.2, 500)),
        shapely.GeometryCollection([Point(0, 0), line((-100, 0), (-100, 50))]),
    ]
    report = measure_streets(frame(shapes, index=list(range(10, 23))))
    made = report.streets
    assert made.index.tolist() == list(range(10, 23))
    assert made["length_m"].isna().tolist() == [k in (14, 15, 16) for k in range(10, 23)]
    for column in ("natural_id", "betweenness", "degree_start"):
        assert made.index[made[column].isna()].tolist() == [14, 15, 16, 21], column
    said = dict(zip(report.problems["feature"], report.problems["problem"]))
    assert said["14"] == "geometry is NULL"
    assert said["15"] == "geometry is EMPTY"
    assert said["16"] == "geometry is a Point, not a line"
    assert said["19"] == said["20"] == "is drawn on the whole length of street 10"
    assert "shorter than 0.5 m" in said["21"]
    # what is drawn twice is measured once, and both have its values
    same = made.loc[[10, 19, 20]].drop(columns="geometry")
    assert same.nunique(dropna=False).max() == 1
    assert made.loc[17, "length_m"] == pytest.approx(120)
    assert made.loc[17, "bearing_deg"] == pytest.approx(0, abs=0.01)
    # 400 + 120 + 60 + 50
    assert report.figures.length_km == pytest.approx(0.63)


def test_streets_that_cross_without_a_junction_are_told_of():
    layer = frame([line((-50, 0), (50, 0)), line((0, -50), (0, 50)), line((10, 0), (50, 0))])
    report = measure_streets(layer)
    assert report.figures.crossings == 1
    said = sorted(report.problems["problem"])
    assert said == ["crosses street 1 without a junction", "runs on top of street 2 for 40 m"]
    assert (report.problems.to_crs(CRS).geometry.distance(layer.union_all()) < 1e-6).all()
    assert report.figures.four_way == 0


@pytest.mark.parametrize("crs", [4326, 3857, 2263])
def test_metres_whatever_the_crs(crs):
    """Degrees, a projection that stretches, and feet."""
    layer = frame(GRID, crs=crs) if crs != 2263 else None
    if layer is None:
        shapes = [affinity.translate(s, 985_000, 200_000) for s in GRID]
        layer = gpd.GeoDataFrame(geometry=shapes, crs=crs)
    report = measure_streets(layer)
    scale = 1.0 if crs != 2263 else 0.3048006
    assert report.streets["length_m"].tolist() == pytest.approx([200 * scale] * 6, rel=2e-3)
    assert report.figures.length_km == pytest.approx(1.2 * scale, rel=2e-3)
    assert report.figures.intersections == 5
    assert report.natural.crs == report.nodes.crs == layer.crs
    shapes = layer.geometry.to_numpy()
    assert all(shapely.distance(shapes, p).min() < 1e-3 for p in report.nodes.geometry)


def test_widths_come_from_a_field_or_a_level_or_a_number():
    site = frame([box(-100, -100, 100, 100)])

    def share(*, options=None, **columns):
        found = measure_streets(frame(CROSS, **columns), site=site, options=options)
        return found.figures.roads_pct

    def cross(width):
        return 100 * (400 * width - width**2) / 40000

    assert share() == pytest.approx(cross(12), rel=1e-6)
    assert share(level=[1] * 4) == pytest.approx(cross(20), rel=1e-6)
    assert share(width_m=[8.0] * 4, level=[1] * 4) == pytest.approx(cross(8), rel=1e-6)
    own = StreetOptions(width_field="wide", width=10.0)
    assert share(options=own, wide=["6", "6", "6", "6"]) == pytest.approx(cross(6), rel=1e-6)
    assert share(options=own, wide=[None, 0.0, -3.0, math.nan]) == pytest.approx(cross(10))
    with pytest.raises(InputError, match="no field 'wide'"):
        share(options=own)


def test_centrality_may_be_left_out():
    report = measure_streets(frame(GRID), options=StreetOptions(centrality=False))
    assert report.streets[["betweenness", "closeness"]].isna().all(axis=None)
    assert report.nodes["closeness"].isna().all()
    assert math.isnan(report.figures.betweenness_mean)
    assert report.figures.segments == 8
    assert (report.sources, report.connected) == (0, 0)


@pytest.mark.parametrize(
    ("layer", "site", "text"),
    [
        (lambda: frame(CROSS).set_crs(None, allow_override=True), None, "coordinate reference"),
        (lambda: frame([Point(0, 0)]), None, "no lines"),
        (lambda: frame([None]), None, "no lines"),
        (lambda: frame(CROSS), lambda: frame([Point(0, 0)]), "no polygons"),
    ],
)
def test_what_cannot_be_measured_is_refused_in_words(layer, site, text):
    with pytest.raises(InputError, match=text):
        measure_streets(layer(), site=site and site())


class Cancels(Silent):
    def __init__(self, stage):
        self.wanted, self.seen = stage, False

    def stage(self, text, fraction):  # noqa: ARG002
        self.seen |= text.startswith(self.wanted)

    def cancelled(self):
        return self.seen


@pytest.mark.parametrize("stage", ["Reading", "Joining", "Measuring", "Computing"])
def test_it_can_be_cancelled(stage):
    with pytest.raises(CancelledError):
        measure_streets(frame(GRID), progress=Cancels(stage))


def test_labels_need_not_be_unique_nor_the_column_be_called_geometry():
    layer = frame(CROSS, index=[1, 1, 2, 2]).rename_geometry("shape")
    report = measure_streets(layer)
    assert report.streets.index.tolist() == [1, 1, 2, 2]
    assert report.streets.geometry.name == "shape"
    assert report.streets["degree_start"].tolist() == [4] * 4


@pytest.mark.slow
@given(st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_whatever_is_drawn_is_measured(seed):
    """Crossing, doubled, looping, touching, tiny and missing lines on a grid of 20 m."""
    random = np.random.default_rng(seed)

    def shape():
        points = random.integers(0, 8, (int(random.integers(2, 6)), 2)) * 20.0
        if random.random() < 0.1:
            points = points + random.normal(0, 0.3, points.shape)
        kind = random.random()
        if kind < 0.05:
            return None
        if kind < 0.15:
            return MultiLineString([points, points[::-1] + 40.0])
        return line(*points, points[0]) if kind < 0.25 else line(*points)

    shapes = [shape() for _ in range(int(random.integers(1, 14)))]
    shapes += [shapes[k] for k in random.integers(0, len(shapes), 2)]
    if not any(s is not None and s.length > 0 for s in shapes):
        return
    site = frame([box(30, 30, 110, 130)]) if random.random() < 0.5 else None
    report = measure_streets(frame(shapes), site=site, options=StreetOptions(seed=seed))
    made = report.streets
    lengths = [s.length if s is not None and s.length > 0 else math.nan for s in shapes]
    assert made["length_m"].tolist() == pytest.approx(lengths, nan_ok=True)
    known = made[made["natural_id"].notna()]
    assert set(known["natural_id"]) <= set(report.natural["natural_id"])
    assert known["betweenness"].between(0, 1 + 1e-9).all()
    # nothing can be reached from a ring by itself
    assert (known["closeness"] >= 0).all()
    assert known["sinuosity"].dropna().ge(1).all()
    assert known["bearing_deg"].dropna().between(0, 180, inclusive="left").all()
    assert set(report.nodes["kind"]) <= {"dead end", "T", "Y", "X", "K", "star"}
    assert ((report.nodes["degree"] == 1) == (report.nodes["kind"] == "dead end")).all()
    numbers = report.figures.as_dict()
    assert not any(math.isinf(v) for v in numbers.values())
    assert not any(math.isnan(numbers[name]) for name in NEVER_NAN)
    if site is None:
        assert numbers["segments"] > 0
        assert numbers["natural_count"] == len(report.natural)
        assert numbers["dead_ends"] == (report.nodes["degree"] == 1).sum()
    again = measure_streets(frame(shapes), site=site, options=StreetOptions(seed=seed))
    assert again.streets.equals(made)


@pytest.mark.slow
@given(st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_figures_are_those_of_osmnx(seed):
    """A grid of 6 x 6 with streets taken away and junctions moved, drawn piece by piece."""
    osmnx = pytest.importorskip("osmnx")
    random = np.random.default_rng(seed)
    xy = np.stack(np.meshgrid(np.arange(6), np.arange(6)), axis=-1) * 100.0
    xy += random.uniform(-30, 30, xy.shape)
    pairs = [((j, i), (j, i + 1)) for j in range(6) for i in range(5)]
    pairs += [((i, j), (i + 1, j)) for j in range(6) for i in range(5)]
    pairs = [pair for pair in pairs if random.random() < 0.75] or pairs[:1]
    graph = nx.MultiDiGraph(crs=f"EPSG:{CRS}")
    for a, b in pairs:
        for node in (a, b):
            graph.add_node(node, x=xy[node][0], y=xy[node][1])
        size = float(np.hypot(*(xy[a] - xy[b])))
        graph.add_edge(a, b, length=size, osmid=0)
        graph.add_edge(b, a, length=size, osmid=0)
    part = max(nx.weakly_connected_components(graph), key=len)
    graph = graph.subgraph(part).copy()
    lines = [line(xy[a], xy[b]) for a, b in pairs if a in part]
    simple = osmnx.simplify_graph(graph)
    counts = osmnx.stats.count_streets_per_node(simple)
    nx.set_node_attributes(simple, counts, "street_count")
    told = osmnx.basic_stats(simple, area=4e6)
    found = measure_streets(frame(lines), site=frame([box(-500, -500, 1500, 1500)])).figures
    if told["n"] < 2:  # a ring, for which osmnx keeps a node of its choice
        return
    assert found.area_km2 == pytest.approx(4)
    assert found.length_km == pytest.approx(told["street_length_total"] / 1000, rel=1e-6)
    assert found.segments == told["street_segment_count"]
    assert found.segment_mean == pytest.approx(told["street_length_avg"], rel=1e-6)
    assert found.street_km_km2 == pytest.approx(told["street_density_km"] / 1000, rel=1e-6)
    per_node = told["streets_per_node_counts"]
    assert found.intersections == told["intersection_count"] - per_node.get(2, 0)
    assert found.dead_ends == per_node.get(1, 0)
    assert (found.three_way, found.four_way) == (per_node.get(3, 0), per_node.get(4, 0))
    flat = nx.Graph(osmnx.convert.to_undirected(simple))
    if not any(u == v for u, v in flat.edges) and flat.size() == found.segments:
        near = nx.closeness_centrality(flat, distance="length")
        assert found.closeness_mean == pytest.approx(1000 * np.mean(list(near.values())), rel=1e-4)
        between = nx.betweenness_centrality(flat, weight="length")
        assert found.betweenness_max == pytest.approx(max(between.values()), abs=1e-9)


@pytest.mark.slow
def test_real_towns(shared_data):
    """Nothing is lost, and nothing is infinite."""
    for town in ("vaduz_li", "monaco"):
        layer = gpd.read_file(shared_data / "town" / f"{town}.gpkg", layer="streets")
        report = measure_streets(layer, options=StreetOptions(exact=500, sources=50))
        assert len(report.streets) == len(layer)
        assert list(report.streets.columns)[: len(layer.columns) - 1] == list(layer.columns)[:-1]
        assert report.streets["length_m"].notna().all()
        numbers = report.figures.as_dict()
        assert all(math.isfinite(v) for v in numbers.values()), numbers
        assert (
            numbers["three_way"] + numbers["four_way"] + numbers["five_way"]
            == (numbers["intersections"])
        )
        assert (report.nodes["degree"] == 1).sum() == numbers["dead_ends"]
        assert report.natural["length_m"].sum() / 1000 == pytest.approx(
            numbers["length_km"], rel=1e-3
        )
        assert 1.0 <= numbers["sinuosity"] < 1.5
        assert 0 < numbers["order"] < 1
