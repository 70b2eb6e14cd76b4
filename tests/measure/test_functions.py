"""What is asked of a network as a whole: right networks pass, each kind of fault is named."""

from __future__ import annotations

import geopandas as gpd
import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.measure import validate_network
from shapely.geometry import LineString, Point, box

# A plane in metres, true to scale around its origin.
CRS = "+proj=tmerc +lat_0=60 +lon_0=25 +k=1 +datum=WGS84 +units=m +type=crs"
H = 40.0
SITE = box(0, 0, 240, 160)


def layer(*shapes, **columns):
    return gpd.GeoDataFrame(columns, geometry=list(shapes), crs=CRS)


def line(*points):
    return LineString(points)


def checked(streets, site=SITE, **options):
    return validate_network(streets, site=layer(site), edge_length=H, dead_ends=0, **options)


def found(streets, **options):
    """Return (kind, severity, features) of every problem."""
    rows = checked(streets, **options).problems
    return [(r.kind, r.severity, r.feature) for r in rows.itertuples()]


def cross(**columns):
    """Four arms that meet in the middle of the site."""
    middle = (120, 80)
    arms = [line(at, middle) for at in [(120, 0), (240, 80), (120, 160), (0, 80)]]
    return layer(*arms, **columns)


# --- one-way streets ---


def test_one_way_streets_through_the_site_are_sound():
    assert found(cross(oneway=[True, False, False, False])) == []
    assert found(cross(oneway=[True, True, True, False])) == []
    assert found(cross(oneway=["yes", "no", "-1", "no"])) == []


def test_a_place_without_a_way_out_is_named():
    problems = checked(cross(oneway=[True] * 4)).problems
    assert problems["kind"].tolist() == ["one-way"]
    assert problems["feature"].tolist() == ["0, 1, 2, 3"]
    assert problems["text"].iloc[0].startswith("From one junction no way leads out")
    assert problems.geometry.iloc[0].distance(Point(120, 80)) < 1e-6


@pytest.mark.parametrize("word", [-1, "-1", "reverse"])
def test_a_place_without_a_way_in_is_named(word):
    problems = checked(cross(oneway=[word] * 4)).problems
    assert problems["text"].tolist() == [
        "To one junction no way leads in along the one-way streets."
    ]


def test_a_one_way_ring_on_a_two_way_stem_is_sound():
    ring = [line((120, 80), (160, 80)), line((160, 80), (160, 120)), line((160, 120), (120, 80))]
    stem = line((120, 0), (120, 80))
    assert found(layer(stem, *ring, oneway=[False, True, True, True])) == []
    problems = checked(layer(stem, *ring, oneway=[False, True, False, -1])).problems
    assert problems["text"].tolist() == [
        "From 2 junctions no way leads out along the one-way streets."
    ]
    assert problems["feature"].tolist() == ["1, 2, 3"]


def test_existing_streets_are_two_way():
    streets = cross(oneway=[True] * 4, status=["new", "new", "new", "existing"])
    assert found(streets) == []


def test_rules_that_only_price_it_make_it_a_warning():
    assert found(cross(oneway=[True] * 4), functions=5.0) == [("one-way", "warning", "0, 1, 2, 3")]
    assert found(cross(oneway=[True] * 4), functions=0.0) == []


def test_without_exits_all_places_must_lead_to_each_other():
    ring = [line((0, 0), (90, 0)), line((90, 0), (90, 90)), line((90, 90), (0, 0))]
    tail = line((90, 90), (200, 90))
    sound = layer(*ring, tail, oneway=[1, 1, 1, 0])
    assert validate_network(sound, edge_length=H, dead_ends=0).problems.empty
    report = validate_network(sound.assign(oneway=[1, 1, 1, 1]), edge_length=H, dead_ends=0)
    assert report.problems["feature"].tolist() == ["3"]


def test_one_way_pieces_of_a_line_that_meets_itself_keep_their_sense():
    """A stem with a loop, drawn in one go and cut where it meets itself."""
    loop = line((120, 0), (120, 60), (160, 100), (80, 100), (120, 60), (0, 60))
    assert found(layer(loop, oneway=[True])) == []
    shut = line((120, 0), (120, 60), (160, 100), (80, 100), (120, 60))
    problems = checked(layer(shut, oneway=[True])).problems
    assert "From" in problems["text"].iloc[0]
    turned = checked(layer(shut, oneway=[-1])).problems
    assert "To" in turned["text"].iloc[0]


def test_distances_follow_the_traffic():
    ends = [(40, 0), (40, 80), (200, 80), (200, 0)]
    arch = layer(*[line(a, b) for a, b in zip(ends, ends[1:])], oneway=[True] * 3)
    report = checked(arch)
    assert report.numbers["MAX_DISTANCE"] == pytest.approx(320)
    assert report.numbers["MEAN_DISTANCE"] == pytest.approx(160)
    assert checked(arch.assign(oneway=False)).numbers["MAX_DISTANCE"] == pytest.approx(160)
    # from the middle of each street to the end of the arch
    assert found(arch.assign(dist_to_sink_m=[280.0, 160.0, 40.0])) == []
    wrong = found(arch.assign(dist_to_sink_m=[40.0, 160.0, 40.0]))
    assert wrong == [("distance", "error", "0")]


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6))
def test_random_directions_agree_with_a_plain_search(seed):
    """On a grid with random directions, against reachability by networkx."""
    random = np.random.default_rng(seed)
    n, h = 4, 80.0
    rows = [((i, j), (i + 1, j)) for i in range(n) for j in range(1, n)]
    columns = [((i, j), (i, j + 1)) for i in range(1, n) for j in range(n)]
    pairs = [pair for pair in rows + columns if random.random() < 0.8]
    if not pairs:
        return
    ways = random.choice([-1, 0, 1], len(pairs)).tolist()
    graph = nx.DiGraph()
    for (a, b), way in zip(pairs, ways):
        a, b = ("out" if {0, n} & set(p) else p for p in (a, b))
        graph.add_nodes_from([a, b, "out"])
        if way >= 0:
            graph.add_edge(a, b)
        if way <= 0:
            graph.add_edge(b, a)
    joined = nx.node_connected_component(graph.to_undirected(), "out")
    stuck = joined - nx.ancestors(graph, "out") - {"out"}
    shut = joined - nx.descendants(graph, "out") - {"out"}
    streets = layer(*[line(*(np.array(pair) * h)) for pair in pairs], oneway=ways)
    rows = checked(streets, site=box(0, 0, n * h, n * h)).problems
    for word, expected in (("From", stuck), ("To", shut)):
        hit = [r.geometry for r in rows.itertuples() if r.text.startswith(f"{word} ")]
        places = {(round(p.x / h), round(p.y / h)) for at in hit for p in at.geoms}
        assert places == expected


# --- exits ---


def test_exits_are_counted_at_the_edge():
    assert found(cross(), exits_most=4) == []
    problems = checked(cross(), exits_most=3).problems
    assert problems["kind"].tolist() == ["exits"]
    assert problems["severity"].tolist() == ["error"]
    assert problems["feature"].tolist() == ["0, 1, 2, 3"]
    assert "in 4 places; 3 are" in problems["text"].iloc[0]
    points = {(round(p.x), round(p.y)) for p in problems.geometry.iloc[0].geoms}
    assert points == {(120, 0), (240, 80), (120, 160), (0, 80)}


def test_a_connector_and_its_ends_are_one_place():
    road = [line((-50, -10), (119.5, -10)), line((119.5, -10), (300, -10))]
    joint = line((120, 0), (119.5, -10))
    streets = layer(
        line((120, 80), (120, 0)),
        line((120, 80), (200, 80)),
        line((200, 80), (200, 0)),
        joint,
        *road,
        status=["new", "new", "new", "connector", "existing", "existing"],
    )
    roads = layer(line((-50, -10), (300, -10)))
    assert found(streets, exits_most=2, boundary_streets=roads) == []
    problems = checked(streets, exits_most=1, boundary_streets=roads).problems
    assert "in 2 places; 1 is" in problems["text"].iloc[0]


def test_streets_that_leave_at_one_place_use_one_exit():
    fan = layer(line((120, 0), (60, 80)), line((120, 0), (180, 80)), line((60, 80), (180, 80)))
    assert found(fan, exits_most=1) == []
    apart = layer(line((119.4, 0), (60, 80)), line((120.1, 0), (180, 80)))
    assert [p for p in found(apart, exits_most=1) if p[0] == "exits"] == []


@pytest.mark.parametrize(("y", "exits"), [(80, 1), (20, 2)])
def test_where_a_kept_street_deep_inside_is_met_no_street_leaves(y, exits):
    """Within the snap distance of the edge a street is one at the edge."""
    streets = layer(
        line((0, y), (100, y)),
        line((100, y), (240, y)),
        line((100, y), (100, 160)),
        status=["existing", "existing", "new"],
    )
    assert not [p for p in found(streets, exits_most=exits) if p[0] == "exits"]
    if exits > 1:
        problems = checked(streets, exits_most=1).problems
        assert "in 2 places" in problems["text"].iloc[0]


def test_each_site_has_its_own_exits_and_budget():
    sites = layer(box(0, 0, 240, 160), box(400, 0, 640, 160)).set_index(np.array([7, 9]))
    arms = [line((120, 0), (120, 160)), line((520, 0), (520, 160)), line((600, 0), (600, 160))]
    rules = {"edge_length": H, "site": sites}
    both = validate_network(layer(*arms), exits_most=2, length_budget_m=160, **rules).problems
    assert sorted(both["kind"]) == ["exits", "length budget"]
    assert both["feature"].tolist() == ["1, 2"] * 2
    assert both["text"].str.contains("site 9").all()


# --- metres ---


def test_the_budget_counts_new_streets_only():
    streets = cross(status=["new", "new", "existing", "connector"])
    assert found(streets, length_budget_m=200) == []
    # 3 % are left for courses that are drawn otherwise than they were counted
    assert found(streets, length_budget_m=195) == []
    problems = checked(streets, length_budget_m=190).problems
    assert problems["kind"].tolist() == ["length budget"]
    assert problems["feature"].tolist() == ["0, 1"]
    assert "200 m long, 10 m more" in problems["text"].iloc[0]


def test_ends_that_are_too_far_are_named():
    arch = layer(
        line((40, 0), (40, 120)), line((40, 120), (100, 120)), line((100, 120), (220, 120))
    )
    assert found(arch, max_distance_m=300) == []
    assert found(arch, max_distance_m=179) == [("way out", "error", "2")]
    assert found(arch, max_distance_m=179, functions=1.0) == [("way out", "warning", "2")]
    problems = checked(arch, max_distance_m=150).problems
    assert sorted(problems["feature"]) == ["1, 2", "2"]
    assert "300 m long; 150 m" in problems.set_index("feature")["text"]["2"]


def test_the_way_out_runs_with_the_traffic_and_not_over_connectors():
    ends = [(40, 0), (40, 80), (200, 80), (200, 0)]
    arch = layer(*[line(a, b) for a, b in zip(ends, ends[1:])], oneway=[True] * 3)
    assert found(arch, max_distance_m=239) == []
    assert found(arch, max_distance_m=200) == [("way out", "error", "0, 1")]
    out = layer(line((120, 80), (120, 0)), line((120, 0), (120, -60)), status=["new", "connector"])
    assert found(out, max_distance_m=81) == []


# --- spacing ---


def ladder(*rungs):
    """Two posts from edge to edge and rungs between them at some heights."""
    heights = [0, *rungs, 160]
    posts = [line((x, a), (x, b)) for x in (60, 180) for a, b in zip(heights, heights[1:])]
    return layer(*posts, *[line((60, y), (180, y)) for y in rungs])


def test_junctions_that_are_too_near_are_named():
    streets = ladder(60, 100)
    assert found(streets, junction_spacing_m=41) == []
    problems = checked(streets, junction_spacing_m=50).problems
    assert problems["kind"].tolist() == ["junction spacing"] * 2
    assert "40 m apart along the streets, less than 50 m" in problems["text"].iloc[0]
    assert {*problems["feature"].iloc[0].split(", ")} == {"0", "1", "2", "6", "7"}
    assert len(found(streets, junction_spacing_m=125)) == 4
    assert found(streets, junction_spacing_m=50, functions=1)[0][1] == "warning"


def test_what_existing_streets_do_alone_is_left_out():
    streets = ladder(60, 100).assign(status="existing")
    assert found(streets, junction_spacing_m=50) == []
    mixed = streets.assign(status=["existing"] * 7 + ["new"])
    assert len(found(mixed, junction_spacing_m=50)) == 2


def test_a_connector_is_no_way_between_two_junctions():
    streets = layer(
        line((120, 80), (120, 0)),
        line((120, 0), (200, 60)),
        line((120, 0), (40, 60)),
        line((120, 0), (120, -10)),
        line((0, -10), (120, -10)),
        line((120, -10), (240, -10)),
        status=["new", "new", "new", "connector", "existing", "existing"],
    )
    assert found(streets, junction_spacing_m=50) == []


# --- coverage ---


def test_each_area_has_its_own_range():
    street = layer(line((0, 80), (240, 80)))
    areas = layer(box(0, 0, 120, 160), box(120, 0, 240, 160), coverage_m=[50.0, 90.0])
    report = checked(street, coverage_areas=areas)
    assert report.problems["kind"].tolist() == ["coverage"] * 2
    assert report.problems["text"].str.contains("of area 0 lie further than 50 m").all()
    assert report.numbers["UNCOVERED_AREA"] == pytest.approx(2 * 30 * 120, rel=0.1)
    assert found(street, coverage_areas=areas.assign(coverage_m=[90.0, None])) == []


def test_the_smallest_range_counts_and_elsewhere_the_usual_one():
    street = layer(line((0, 80), (240, 80)))
    areas = layer(box(0, 0, 120, 160), box(0, 0, 60, 160), coverage_m=[500.0, 50.0])
    report = checked(street, coverage_areas=areas, coverage_m=60.0)
    text = report.problems["text"]
    assert (
        sorted(text.str.extract(r"ha of (.*) lie")[0]) == ["area 1"] * 2 + ["the other ground"] * 2
    )
    expected = 2 * (30 * 60 + 20 * 120)
    assert report.numbers["UNCOVERED_AREA"] == pytest.approx(expected, rel=0.12)


def test_slack_spares_the_edge_of_areas():
    street = layer(line((0, 80), (240, 80)))
    areas = layer(box(0, 0, 120, 160), coverage_m=[50.0])
    report = checked(street, coverage_areas=areas, coverage_slack_m=10.0)
    # beyond 60 m of the street, 10 m inside the area
    assert report.numbers["UNCOVERED_AREA"] == pytest.approx(2 * 10 * 100, rel=0.2)


@pytest.mark.parametrize("value", [0.0, -5.0, float("inf"), "far"])
def test_a_range_that_is_none_is_refused(value):
    areas = layer(SITE, coverage_m=[value])
    with pytest.raises(InputError, match="greater than 0") as caught:
        checked(cross(), coverage_areas=areas)
    assert "Coverage areas" in str(caught.value)
    with pytest.raises(InputError, match="no field 'coverage_m'"):
        checked(cross(), coverage_areas=layer(SITE))


@pytest.mark.parametrize(
    "name", ["exits_most", "length_budget_m", "max_distance_m", "junction_spacing_m"]
)
def test_limits_are_positive(name):
    with pytest.raises(InputError, match=f"{name} must be greater than 0"):
        checked(cross(), **{name: 0})


def test_an_empty_layer_breaks_no_limit():
    nothing = layer(oneway=[])
    options = {"exits_most": 1, "length_budget_m": 1, "max_distance_m": 1, "junction_spacing_m": 1}
    assert found(nothing, **options) == []
