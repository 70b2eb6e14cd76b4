import time

import geopandas as gpd
import numpy as np
import pytest
import shapely
from clock import allowed
from platwright.errors import CancelledError, InputError
from platwright.progress import Silent
from platwright.site import prepare_sites, site_layers
from shapely.geometry import LineString, Point, Polygon, box


class Listener(Silent):
    def __init__(self, stop=False):
        self.said = []
        self.stop = stop

    def info(self, text):
        self.said.append(text)

    def cancelled(self):
        return self.stop


def test_the_scene(scene):
    prepared = prepare_sites(scene.site_frame(), scene.road_frame())
    (site,) = prepared.sites
    assert site.name == "Mill Field"
    assert site.polygon.area == pytest.approx(20_000)
    assert site.crs.to_epsg() == 25832
    assert site.street_frontage.length == pytest.approx(200, abs=6)
    assert {(s.name, s.kind) for s in site.boundary_streets} == {("South Street", "tertiary")}
    points = {p.name: scene.local(Point(p.xy)).coords[0] for p in site.access_points}
    assert points == {"Mill Lane": pytest.approx((60, 0)), "East Lane": pytest.approx((200, 50))}
    assert site.inner_streets == ()
    assert len(prepared.problems) == 0


def test_layers_of_the_scene(scene):
    obstacle = scene.frame([box(150, 60, 250, 80), box(10, 90, 13, 130)])
    layers = site_layers(prepare_sites(scene.site_frame(), scene.road_frame(), obstacle))
    assert list(layers) == [
        "site", "boundary_streets", "access_points", "site_obstacles", "problems",
    ]  # fmt: skip
    row = layers["site"].iloc[0]
    assert (row["site_id"], row["name"]) == (1, "Mill Field")
    assert (row["area_m2"], row["area_ha"], row["perimeter_m"]) == pytest.approx((20_000, 2, 600))
    assert layers["boundary_streets"]["length_m"].sum() == pytest.approx(200, abs=6)
    bearings = layers["access_points"].set_index("name")["bearing_deg"]
    assert bearings["Mill Lane"] == pytest.approx(0, abs=1e-6)
    assert bearings["East Lane"] == pytest.approx(270)
    assert layers["site_obstacles"]["area_m2"].tolist() == pytest.approx([50 * 20, 3 * 10])
    assert all(layer.crs == scene.site_frame().crs for layer in layers.values())


def test_inner_roads_kept_or_not(scene):
    scene.roads.append((LineString([(150, -10), (150, 40), (170, 40)]), "Yard Way", "service"))
    kept = prepare_sites(scene.site_frame(), scene.road_frame(), inner_roads="keep").sites[0]
    (inner,) = kept.inner_streets
    assert inner.name == "Yard Way"
    assert inner.line.length == pytest.approx(40 + 20)
    ignored = prepare_sites(scene.site_frame(), scene.road_frame()).sites[0]
    assert ignored.inner_streets == ()
    # without inner roads the frontage is the same
    assert ignored.street_frontage.equals(kept.street_frontage)


def test_street_into_an_obstacle_is_no_access_point(scene):
    pond = scene.frame([box(50, 5, 70, 30)])
    prepared = prepare_sites(scene.site_frame(), scene.road_frame(), pond)
    assert [p.name for p in prepared.sites[0].access_points] == ["East Lane"]
    assert "Mill Lane arrives at an obstacle" in prepared.problems["problem"][0]


@pytest.mark.parametrize("crs", [4326, 3857, 2263, 3035, 25833])
def test_other_crs_give_the_same_site(scene, crs):
    here = prepare_sites(scene.site_frame(), scene.road_frame()).sites[0]
    prepared = prepare_sites(scene.site_frame().to_crs(crs), scene.road_frame().to_crs(4258))
    (site,) = prepared.sites
    assert site.area_ha == pytest.approx(2, rel=3e-3)
    assert site.street_frontage.length == pytest.approx(here.street_frontage.length, abs=3)
    assert {p.name for p in site.access_points} == {"Mill Lane", "East Lane"}
    layers = site_layers(prepared)
    assert all(layer.crs.to_epsg() == crs for layer in layers.values())
    back = layers["site"].to_crs(25832).geometry[0]
    assert shapely.hausdorff_distance(back, here.polygon) < 0.02


def test_mixed_layers_each_with_its_own_crs(scene):
    pond = scene.frame([box(150, 60, 190, 80)]).to_crs(3857)
    roads = scene.road_frame().to_crs(2263)
    (site,) = prepare_sites(scene.site_frame().to_crs(4326), roads, pond).sites
    assert site.obstacles[0].area == pytest.approx(800, rel=3e-3)
    assert len(site.access_points) == 2


def test_no_road_layer(scene):
    heard = Listener()
    ring = Polygon(box(0, 0, 200, 100).exterior, [box(50, 40, 150, 60).exterior])
    (site,) = prepare_sites(scene.frame([ring]), progress=heard).sites
    assert site.street_frontage.length == pytest.approx(600)
    assert site.access_points == ()
    assert any("No road layer" in text for text in heard.said)


def test_roads_that_do_not_reach_the_site(scene):
    roads = scene.frame([LineString([(0, -80), (200, -80)])])
    prepared = prepare_sites(scene.site_frame(), roads, road_layer="ways")
    assert prepared.sites[0].street_frontage.is_empty
    (row,) = prepared.problems.itertuples()
    assert (row.layer, row.feature, row.severity) == ("Site", "0", "warning")
    assert "nearest is 80 m away" in row.problem
    assert "larger snap distance" in row.action
    far = prepare_sites(scene.site_frame(), scene.frame([LineString([(0, 900), (9, 900)])]))
    assert "comes near the site" in far.problems["problem"][0]


def test_several_sites_keep_their_order_and_ids(scene):
    shapes = [box(500, 0, 600, 100), box(0, 0, 50, 50), box(50, 0, 100, 50)]
    frame = scene.frame(shapes, name=["B", "A1", "A2"])
    frame.index = [12, 3, 4]
    sites = prepare_sites(frame).sites
    assert [(s.site_id, s.name, s.feature) for s in sites] == [(1, "B", 12), (2, "Site 2", 3)]
    assert [s.area_ha for s in sites] == pytest.approx([1, 0.5])


def test_sites_in_different_zones_are_each_true(scene):
    frame = gpd.GeoDataFrame(
        geometry=[box(9.5, 47.1, 9.502, 47.101), box(24.9, 60.1, 24.902, 60.101)], crs=4326
    )
    sites = prepare_sites(frame).sites
    assert [s.crs.to_epsg() for s in sites] == [32632, 32635]
    geodesic = [abs(frame.crs.get_geod().geometry_area_perimeter(g)[0]) for g in frame.geometry]
    assert [s.polygon.area for s in sites] == pytest.approx(geodesic, rel=2.1e-3)


def test_too_large_for_any_plane():
    frame = gpd.GeoDataFrame(geometry=[box(-20, 40, 20, 60)], crs=4326)
    prepared = prepare_sites(frame)
    assert prepared.problems["severity"].tolist() == ["warning"]
    assert "lengths are wrong by up to" in prepared.problems["problem"][0]


def test_tiny_site(scene):
    (site,) = prepare_sites(scene.frame([box(0, 0, 2, 1.5)]), scene.road_frame()).sites
    assert site.polygon.area == pytest.approx(3)


@pytest.mark.parametrize("frame", ["none", "unusable", "line"])
def test_nothing_to_design(scene, frame):
    shapes = {"none": [], "unusable": [None, Polygon()], "line": [LineString([(0, 0), (5, 5)])]}
    with pytest.raises(InputError, match="Layer 'parcels'"):
        prepare_sites(scene.frame(shapes[frame]), polygon_layer="parcels")


def test_missing_crs_of_each_layer(scene):
    bare = scene.road_frame().set_crs(None, allow_override=True)
    with pytest.raises(InputError, match="Layer 'ways': has no coordinate reference"):
        prepare_sites(scene.site_frame(), bare, road_layer="ways")
    with pytest.raises(InputError, match="Layer 'ponds': has no coordinate reference"):
        prepare_sites(scene.site_frame(), None, scene.frame([box(0, 0, 1, 1)], crs=None),
                      obstacle_layer="ponds")  # fmt: skip


@pytest.mark.parametrize(("key", "value"), [("snap_distance", 0), ("inner_roads", "x")])
def test_parameters_out_of_bounds(scene, key, value):
    with pytest.raises(InputError):
        prepare_sites(scene.site_frame(), **{key: value})


def test_cancel(scene):
    with pytest.raises(CancelledError):
        prepare_sites(scene.site_frame(), progress=Listener(stop=True))


def test_obstacles_are_repaired_clipped_and_small_ones_named(scene):
    bow = Polygon([(20, 20), (40, 40), (40, 20), (20, 40)])
    prepared = prepare_sites(
        scene.site_frame(),
        None,
        scene.frame([bow, box(100, 50, 104, 54), box(300, 0, 400, 9), Point(5, 5), None]),
    )
    (site,) = prepared.sites
    assert sum(o.area for o in site.obstacles) == pytest.approx(2 * 100)
    small = prepared.problems[prepared.problems["action"] == "left out as too small"]
    assert small["feature"].tolist() == ["1"]


def test_prepared_again_is_the_same(scene):
    scene.roads.append((LineString([(210, -100), (195, 200)]), "Slanted", ""))
    for crs in (25832, 4326):
        once = prepare_sites(scene.site_frame().to_crs(crs), scene.road_frame())
        twice = prepare_sites(site_layers(once)["site"], scene.road_frame())
        a, b = once.sites[0], twice.sites[0]
        assert a.polygon.equals_exact(b.polygon, 1e-9)
        assert a.street_frontage.equals(b.street_frontage)
        assert a.access_points == b.access_points
        assert a.name == b.name


def test_many_roads_and_obstacles_take_seconds(scene):
    rng = np.random.default_rng(1)
    start = rng.random((100_000, 2)) * 10_000 - 5_000
    origin = np.array([500_000, 5_400_000])
    step = rng.normal(size=(100_000, 2)) * 40
    lines = shapely.linestrings(np.stack([start, start + step], axis=1) + origin)
    roads = gpd.GeoDataFrame(geometry=lines, crs=25832)
    round_ponds = shapely.buffer(shapely.points(start + origin), 6, quad_segs=2)
    ponds = gpd.GeoDataFrame(geometry=round_ponds, crs=25832)
    (site,) = prepare_sites(scene.site_frame(), roads, ponds).sites
    near = int(np.sum(np.all((start > 0) & (start < [200, 100]), axis=1)))
    assert len(site.obstacles) >= near > 5


def test_kept_inner_streets_are_in_the_layer_and_come_back_from_it(scene):
    scene.roads.append((LineString([(150, -10), (150, 40), (170, 40)]), "Yard Way", "service"))
    layers = site_layers(prepare_sites(scene.site_frame(), scene.road_frame(), inner_roads="keep"))
    streets = layers["boundary_streets"]
    inside = streets[streets["place"] == "inside"]
    assert inside[["name", "kind"]].to_numpy().tolist() == [["Yard Way", "service"]]
    assert inside["length_m"].iloc[0] == pytest.approx(60)
    assert set(streets["place"]) == {"edge", "inside"}
    for mode in ("keep", "ignore"):
        again = prepare_sites(layers["site"], streets, inner_roads=mode)
        (back,) = again.sites[0].inner_streets
        assert (back.name, back.kind) == ("Yard Way", "service")
        assert back.line.length == pytest.approx(60)
        once_more = site_layers(again)["boundary_streets"]
        assert (once_more["place"] == "inside").sum() == 1
        assert once_more["length_m"].sum() == pytest.approx(streets["length_m"].sum(), abs=1)


def test_inner_streets_change_their_name_and_do_not_repeat_the_edge(scene):
    scene.roads += [
        (LineString([(150, -10), (150, 40)]), "Yard Way", "service"),
        (LineString([(150, 40), (150, 90)]), "Back Yard", "service"),
        (LineString([(-50, 96), (250, 96)]), "North Street", ""),
    ]
    (site,) = prepare_sites(scene.site_frame(), scene.road_frame(), inner_roads="keep").sites
    found = sorted((s.name, round(s.line.length)) for s in site.inner_streets)
    assert found == [("Back Yard", 50), ("Yard Way", 40)]
    assert "North Street" in {s.name for s in site.boundary_streets}


class Impatient(Listener):
    """Cancels at once and remembers how long it was not asked."""

    def __init__(self, after):
        super().__init__()
        self.end = time.monotonic() + after
        self.last = time.monotonic()
        self.gaps = []

    def cancelled(self):
        now = time.monotonic()
        self.gaps.append(now - self.last)
        self.last = now
        return now > self.end


@pytest.mark.slow
@pytest.mark.parametrize("width", [30.0, 29.4, 27.0])
def test_cancel_is_answered_within_a_second(width):
    n = 316
    x, y = (c.ravel() for c in np.meshgrid(np.arange(n) * 30.0, np.arange(n) * 40.0))
    x, y = x + 500_000, y + 5_400_000
    shapes = shapely.segmentize(shapely.box(x, y, x + width, y + width + 10), 12.0)
    frame = gpd.GeoDataFrame(geometry=shapes, crs=25832)
    for after in (0.5, 2.0, 5.0):
        caller = Impatient(after)
        with pytest.raises(CancelledError):
            prepare_sites(frame, progress=caller)
        # a second on a quiet machine; other tests run beside this one
        assert max(caller.gaps) < 3.0
        assert time.monotonic() - caller.end < allowed(3.0)


def test_a_site_of_a_prepared_layer_keeps_its_number_when_it_is_prepared_alone(scene):
    both = scene.frame([box(0, 0, 100, 100), box(300, 0, 400, 100)])
    ground = site_layers(prepare_sites(both, scene.road_frame()))["site"]
    assert ground["site_id"].tolist() == [1, 2]
    (second,) = prepare_sites(ground[ground["site_id"] == 2], scene.road_frame()).sites
    assert (second.site_id, second.name) == (2, ground["name"].iloc[1])


@pytest.mark.parametrize("given", [[7, 7], [2, None], ["a", "b"], [0, -1], [1.5, 2.5]])
def test_numbers_that_are_no_site_numbers_are_not_taken_over(scene, given):
    both = scene.frame([box(0, 0, 100, 100), box(300, 0, 400, 100)]).assign(site_id=given)
    assert [s.site_id for s in prepare_sites(both).sites] == [1, 2]


def test_a_prepared_site_keeps_its_snap_distance(scene):
    wide = [LineString([(-100, -45), (300, -45)])]
    roads = scene.frame(wide, name=["Far Street"])
    first = prepare_sites(scene.site_frame(), roads, snap_distance=60)
    (again,) = prepare_sites(site_layers(first)["site"], roads).sites
    assert again.snap_distance == 60
    assert again.street_frontage.length == pytest.approx(first.sites[0].street_frontage.length)
    (smaller,) = prepare_sites(site_layers(first)["site"], roads, snap_distance=70).sites
    assert smaller.snap_distance == 70
    (raw,) = prepare_sites(scene.site_frame(), roads).sites
    assert raw.street_frontage.is_empty
