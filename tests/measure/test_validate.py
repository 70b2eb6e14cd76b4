from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
from platwright.errors import CancelledError, InputError
from platwright.measure import validate_network
from platwright.progress import Silent
from shapely.geometry import LineString, MultiLineString, Point, Polygon, box

# A plane in metres, true to scale around its origin.
CRS = "+proj=tmerc +lat_0=60 +lon_0=25 +k=1 +datum=WGS84 +units=m +type=crs"
H = 40.0
EVERYTHING = {
    "zigzags": np.inf,
    "too_close": np.inf,
    "t_junctions": np.inf,
    "branches": np.inf,
    "lollipops": np.inf,
}


def layer(*shapes, **columns):
    return gpd.GeoDataFrame(columns, geometry=list(shapes), crs=CRS)


def line(*points):
    return LineString(points)


def kinds(streets, **options):
    report = validate_network(streets, edge_length=H, **options)
    assert report.violations == (report.problems["severity"] == "error").sum()
    assert report.numbers["VIOLATIONS"] == report.violations
    return sorted(report.problems["kind"])


SITE = layer(box(0, 0, 240, 160))


def cross(**columns):
    """Two streets that cross in the middle of the site, properly cut."""
    return layer(
        line((120, 0), (120, 80)),
        line((120, 80), (120, 160)),
        line((0, 80), (120, 80)),
        line((120, 80), (240, 80)),
        **columns,
    )


def test_a_good_network_has_no_problem():
    report = validate_network(
        cross(), site=SITE, edge_length=H, coverage_m=90, **{**EVERYTHING, "branches": 0}
    )
    assert report.problems.empty
    assert report.problems.crs == SITE.crs
    assert report.numbers["TOTAL_LENGTH"] == pytest.approx(400)
    assert report.numbers["MAX_DISTANCE"] == pytest.approx(100)
    # Arms of 80, 80, 120, 120 m; the long ones are nearer to their own end up to 100 m.
    mean = (2 * 80 * 40 + 2 * (100**2 / 2 + 20 * 90)) / 400
    assert report.numbers["MEAN_DISTANCE"] == pytest.approx(mean)
    assert report.numbers["BRANCH"] == 1


def test_each_rule_has_a_weight():
    assert kinds(cross(), site=SITE, branches=np.inf) == ["branch"]
    report = validate_network(cross(), site=SITE, edge_length=H, branches=2.0)
    assert report.problems["severity"].tolist() == ["warning"]
    assert report.violations == 0


def test_dead_end():
    stub = layer(line((120, 0), (120, 100)))
    report = validate_network(stub, site=SITE, edge_length=H)
    assert report.problems["kind"].tolist() == ["dead end"]
    assert report.problems["feature"].tolist() == ["0"]
    assert report.problems.geometry.iloc[0].equals(Point(120, 100))
    assert kinds(stub, site=SITE, dead_ends=0.0) == []
    assert kinds(layer(line((120, 0), (120, 100)), level=[4]), site=SITE) == []


def test_island():
    ring = layer(line((120, 0), (120, 160)), line((40, 40), (80, 40), (80, 80), (40, 40)))
    report = validate_network(ring, site=SITE, edge_length=H)
    assert report.problems["kind"].tolist() == ["island"]
    assert report.problems["feature"].tolist() == ["1"]
    assert "137 m" in report.problems["text"].iloc[0]


def test_without_sinks_the_largest_part_is_the_network():
    parts = layer(line((0, 0), (100, 0)), line((0, 50), (90, 50)))
    report = validate_network(parts, edge_length=H, dead_ends=0)
    assert report.problems["feature"].tolist() == ["1"]


def test_crossing_and_overlap():
    assert kinds(layer(line((120, 0), (120, 160)), line((0, 80), (240, 80))), site=SITE) == [
        "crossing"
    ]
    doubled = layer(line((120, 0), (120, 160)), line((120, 0), (120, 160)))
    assert "overlap" in kinds(doubled, site=SITE)


def test_existing_streets_may_cross_each_other():
    bridge = layer(
        line((120, 0), (120, 160)), line((0, 80), (240, 80)), status=["existing", "existing"]
    )
    assert kinds(bridge, site=SITE) == []
    assert kinds(bridge.assign(status=["existing", "new"]), site=SITE) == ["crossing"]


def test_zigzag_of_bends():
    zigzag = layer(line((0, 80), (120, 80), (120, 120), (240, 120)))
    assert kinds(zigzag, site=SITE) == []
    assert kinds(zigzag, site=SITE, zigzags=np.inf) == ["zigzag"]
    apart = layer(line((0, 40), (120, 40), (120, 120), (240, 120)))
    assert kinds(apart, site=SITE, zigzags=np.inf) == []
    same_way = layer(line((80, 0), (80, 80), (120, 80), (120, 0)))
    assert kinds(same_way, site=SITE, zigzags=np.inf) == []


def test_zigzag_over_a_junction():
    staggered = layer(
        line((0, 80), (100, 80)),
        line((100, 80), (140, 80)),
        line((140, 80), (240, 80)),
        line((100, 80), (100, 160)),
        line((140, 80), (140, 0)),
    )
    report = validate_network(staggered, site=SITE, edge_length=H, zigzags=np.inf)
    assert report.problems["feature"].tolist() == ["1"]
    facing = staggered.copy()
    facing.geometry = [*staggered.geometry[:4], line((140, 80), (140, 160))]
    assert kinds(facing, site=SITE, zigzags=np.inf) == []


def test_zigzag_of_a_smoothed_street():
    arc = np.radians(np.arange(0, 91, 10))
    down = [(100 + 15 * np.sin(a), 65 + 15 * np.cos(a)) for a in arc]
    up = [(130 - 15 * np.sin(a), 45 - 15 * np.cos(a)) for a in arc[::-1]]
    smooth = layer(line((0, 80), *down, *up, (240, 30)))
    assert kinds(smooth, site=SITE, zigzags=np.inf) == ["zigzag"]


def test_too_close():
    pair = layer(line((100, 0), (100, 160)), line((120, 0), (120, 160)))
    report = validate_network(pair, site=SITE, edge_length=H, too_close=np.inf)
    assert report.problems["kind"].tolist() == ["too close"]
    assert set(report.problems["feature"].iloc[0].split(", ")) == {"0", "1"}
    apart = layer(line((100, 0), (100, 160)), line((126, 0), (126, 160)))
    assert kinds(apart, site=SITE, too_close=np.inf) == []
    short = layer(line((100, 0), (100, 160)), line((200, 0), (115, 60), (115, 74), (200, 160)))
    assert kinds(short, site=SITE, too_close=np.inf) == []


def test_a_hairpin_is_too_close_to_itself():
    hairpin = layer(line((100, 0), (100, 120), (118, 120), (118, 0)))
    assert kinds(hairpin, site=SITE, too_close=np.inf) == ["too close"]


def test_t_junction():
    tee = layer(line((0, 80), (120, 80)), line((120, 80), (240, 80)), line((120, 80), (120, 0)))
    assert kinds(tee, site=SITE, t_junctions=np.inf) == ["t-junction"]
    assert kinds(cross(), site=SITE, t_junctions=np.inf) == []
    existing = tee.assign(status=["existing", "existing", "new"])
    assert kinds(existing, site=SITE, t_junctions=np.inf, branches=np.inf) == []


def test_lollipop():
    stem = line((120, 0), (120, 60))
    ring = line((120, 60), (160, 100), (120, 140), (80, 100), (120, 60))
    assert kinds(layer(stem, ring), site=SITE) == []
    assert kinds(layer(stem, ring), site=SITE, lollipops=np.inf) == ["lollipop"]
    twice = layer(stem, ring, line((120, 140), (120, 160)))
    assert kinds(twice, site=SITE, lollipops=np.inf) == []


def test_coverage():
    report = validate_network(
        layer(line((40, 0), (40, 160))), site=SITE, edge_length=H, coverage_m=100
    )
    assert report.problems["kind"].tolist() == ["coverage"]
    assert report.numbers["UNCOVERED_AREA"] == pytest.approx(100 * 160, rel=0.1)
    assert report.problems.geometry.iloc[0].bounds[0] > 130
    assert "1.6" in report.problems["text"].iloc[0]


def test_frontage_and_obstacles_need_no_cover():
    spine = layer(line((40, 0), (40, 160)))
    beside = layer(line((255, -50), (255, 200)))
    assert "coverage" not in kinds(spine, site=SITE, boundary_streets=beside, coverage_m=105)
    lake = layer(box(138, -10, 250, 170))
    assert kinds(spine, site=SITE, obstacles=lake, coverage_m=100) == []


def test_obstacle():
    lake = layer(box(100, 60, 140, 100))
    report = validate_network(
        layer(line((120, 0), (120, 160)), line((60, 0), (60, 160))),
        site=SITE,
        obstacles=lake,
        edge_length=H,
    )
    assert report.problems["kind"].tolist() == ["obstacle"]
    assert report.problems["feature"].tolist() == ["0"]
    assert report.problems.geometry.iloc[0].length == pytest.approx(40)
    grazing = layer(line((100, 0), (100.5, 160)))
    assert kinds(grazing, site=SITE, obstacles=layer(box(100.4, 0, 140, 100))) == []


def test_streets_stay_inside_but_connectors_may_leave():
    beyond = layer(line((120, 0), (120, 160)), line((120, 160), (120, 175)))
    road = layer(line((0, 175), (240, 175)), line((0, -10), (240, -10)))
    assert kinds(beyond, site=SITE, boundary_streets=road) == ["outside"]
    connector = beyond.assign(status=["new", "connector"])
    assert kinds(connector, site=SITE, boundary_streets=road) == []
    assert kinds(layer(line((120, -0.9), (120, 160.9))), site=SITE) == []


def test_an_edge_without_a_road_is_no_sink():
    road = layer(line((-100, -20), (400, -20)))
    through = layer(line((120, 0), (120, 160)))
    assert kinds(through, site=SITE, boundary_streets=road) == ["dead end"]
    beside_rail = layer(line((60, 160), (180, 160)))
    assert kinds(beside_rail, site=SITE, boundary_streets=road) == [
        "dead end",
        "dead end",
        "island",
    ]


def test_given_sinks():
    through = layer(line((120, 0), (120, 160)))
    assert kinds(through, site=SITE, sinks=layer(Point(120, 8))) == ["dead end"]
    assert kinds(through, site=SITE, sinks=layer(Point(120, 0), Point(120, 160))) == []
    far = layer(Point(20, 20))
    assert kinds(through, site=SITE, sinks=far) == ["dead end", "dead end", "island"]


def test_recorded_distances():
    assert kinds(cross(dist_to_sink_m=[0, 80, 50.0, 100]), site=SITE) == []
    report = validate_network(cross(dist_to_sink_m=[0, 80, 150.0, None]), site=SITE, edge_length=H)
    assert report.problems["kind"].tolist() == ["distance"]
    assert report.problems["feature"].tolist() == ["2"]


def test_required_and_forbidden_lines():
    wish = layer(line((110, 0), (110, 160)))
    assert kinds(cross(), site=SITE, required=wish) == []
    wish = layer(line((60, 0), (60, 160)))
    assert kinds(cross(), site=SITE, required=wish) == ["required", "required"]
    wall = layer(line((60, 60), (60, 100)))
    report = validate_network(cross(), site=SITE, forbidden=wall, edge_length=H)
    assert report.problems[["kind", "feature"]].to_numpy().tolist() == [["forbidden", "2"]]


def test_short_streets_are_a_warning():
    short = layer(line((0, 80), (120, 80)), line((120, 80), (240, 80)), line((120, 80), (120, 84)))
    report = validate_network(short, site=SITE, edge_length=H, dead_ends=0, min_length=10)
    assert report.problems[["kind", "severity"]].to_numpy().tolist() == [["short", "warning"]]


def test_bad_geometry_is_reported_and_the_rest_checked():
    streets = gpd.GeoDataFrame(
        geometry=[
            None,
            LineString(),
            MultiLineString([[(120, 0), (120, 80)], [(120, 80), (120, 160)]]),
            LineString([(60, 0, 5), (60, 160, 7)]),
        ],
        index=["a", "b", "c", "d"],
        crs=CRS,
    )
    report = validate_network(streets, site=SITE, edge_length=H)
    assert report.problems["kind"].tolist() == ["no geometry", "no geometry"]
    assert report.problems["feature"].tolist() == ["a", "b"]
    assert report.numbers["TOTAL_LENGTH"] == pytest.approx(320)


def test_layers_in_other_crs_are_measured_in_metres():
    streets = cross().to_crs(4326)
    report = validate_network(streets, site=SITE.to_crs(3857), edge_length=H)
    assert report.problems.empty
    assert report.problems.crs == streets.crs
    assert report.numbers["TOTAL_LENGTH"] == pytest.approx(400, rel=2e-3)
    stub = layer(line((120, 0), (120, 100))).to_crs(4326)
    assert kinds(stub, site=SITE) == ["dead end"]


def test_errors_say_what_to_do():
    bare = gpd.GeoDataFrame(geometry=[line((0, 0), (1, 1))])
    with pytest.raises(InputError, match=r"Layer .Streets..*CRS"):
        validate_network(bare)
    with pytest.raises(InputError, match="feature 0: is a Polygon, not a line"):
        validate_network(SITE)
    with pytest.raises(InputError, match="edge_length must be greater than 0"):
        validate_network(cross(), edge_length=0)


def test_stages_are_told_and_cancelling_stops():
    class Caller(Silent):
        def __init__(self, patience):
            self.patience = patience
            self.stages = []

        def stage(self, text, fraction):
            assert text
            self.stages.append(fraction)

        def cancelled(self):
            return len(self.stages) >= self.patience

    patient = Caller(99)
    assert validate_network(cross(), site=SITE, progress=patient).problems.empty
    assert patient.stages == sorted(patient.stages)
    assert len(patient.stages) == 6
    for patience in range(6):
        with pytest.raises(CancelledError, match="Cancelled before"):
            validate_network(cross(), site=SITE, progress=Caller(patience))


def test_no_streets_leave_everything_uncovered():
    empty = gpd.GeoDataFrame(geometry=[], crs=CRS)
    report = validate_network(empty, site=SITE, coverage_m=50)
    assert report.problems["kind"].tolist() == ["coverage"]
    assert report.numbers["TOTAL_LENGTH"] == 0


def test_a_site_with_a_hole():
    shape = Polygon(box(0, 0, 240, 160).exterior, [box(100, 60, 140, 100).exterior])
    streets = layer(line((60, 0), (60, 160)), line((120, 0), (120, 160)))
    assert kinds(streets, site=layer(shape)) == ["outside"]
