"""Parts of layouts made anew: the rest stays to the last bit, the land is tiled as before."""

from __future__ import annotations

import geopandas as gpd
import networkx as nx
import numpy as np
import pandas as pd
import pytest
import shapely
from platwright.errors import CancelledError, InputError
from platwright.parcels.rules import ParcelRules
from platwright.parcels.split import Elements, KeyArea, SplitRules, lay_out_sites, site_layers
from platwright.parcels.split.redo import Around, Asked, covered, redo_parcels
from platwright.progress import Silent
from platwright.site import Site
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Point, Polygon, box

UTM = CRS.from_epsg(25832)
X, Y = 500000.0, 5200000.0
RULES = ParcelRules()
QUICK = SplitRules(tries=2)
LAND = Polygon([(X, Y), (X + 380, Y + 20), (X + 360, Y + 260), (X + 20, Y + 250)])


@pytest.fixture(scope="module")
def layers():
    site = Site(
        name="Test site", feature=7, polygon=LAND, crs=UTM, source_crs=UTM,
        street_frontage=MultiLineString([LineString(LAND.exterior)]),
    )  # fmt: skip
    school = KeyArea(box(X + 170, Y + 90, X + 240, Y + 150), "school", around=True)
    done = lay_out_sites([site], RULES, QUICK, elements=lambda _: Elements([school]))
    found = site_layers(done, UTM, turning=9.0)
    # one more field, one row without a value, labels that are no positions
    parcels = found["parcels"]
    parcels["owner"] = [f"owner {k}" if k % 3 else None for k in range(len(parcels))]
    parcels.index = 100 + 3 * np.arange(len(parcels))
    return {"parcels": parcels, "streets": found["streets"]}


def disc(layers, radius=60.0, at=(90.0, 60.0)):
    """Labels of the parcels near a place."""
    spot = Point(X + at[0], Y + at[1]).buffer(radius)
    inside = layers["parcels"].geometry.centroid.within(spot)
    return layers["parcels"].index[inside & (layers["parcels"]["land_use"] != "school")].tolist()


def unchanged(before: pd.DataFrame, after: pd.DataFrame, labels) -> None:
    """Same geometry and values, bit by bit."""
    assert list(before.geometry.loc[labels].to_wkb()) == list(after.geometry.loc[labels].to_wkb())
    for name in before.columns.drop("geometry"):
        for one, other in zip(before.loc[labels, name], after.loc[labels, name]):
            assert one == other or (pd.isna(one) and pd.isna(other)), (name, one, other)


def tiles(before, after, gone) -> None:
    """The new features tile the land of those that are gone and overlap nothing."""
    new = after[after["change"] != "kept"]
    land = shapely.union_all(before.geometry.loc[gone].to_numpy())
    made = shapely.union_all(new.geometry.to_numpy())
    assert shapely.is_valid(new.geometry.to_numpy()).all()
    assert new.geometry.area.sum() == pytest.approx(land.area, rel=1e-6)
    assert made.symmetric_difference(land).area < 1e-6 * land.area
    overlaps(after)


def overlaps(after) -> None:
    shapes = after.geometry.to_numpy()
    a, b = shapely.STRtree(shapes).query(shapes, "intersects")
    pairs = a < b
    assert shapely.area(shapely.intersection(shapes[a[pairs]], shapes[b[pairs]])).max() < 1e-3


def has_access(parcels, streets, *, edge=LAND) -> None:
    """Every parcel lies along a street of the layer, a lane, or the edge of the site."""
    ways = [
        line.buffer(max(width, 2 * (turning if turning == turning and turning else 0)) / 2 + 0.1)
        for line, width, turning in zip(
            streets.geometry, streets["width_m"], pd.to_numeric(streets["turning_m"])
        )
    ]
    lanes = parcels.geometry[parcels["land_use"].isin(["lane", "street"])].buffer(0.1)
    open_ = shapely.union_all([*ways, *lanes, edge.exterior.buffer(0.1)])
    for shape in parcels.geometry[parcels["land_use"] == "parcel"]:
        assert shape.exterior.intersection(open_).length >= RULES.min_frontage - 0.5


def connected(streets, *, edge=LAND) -> None:
    """From every street one gets to the edge of the site."""
    graph = nx.Graph()
    lines = streets.geometry.to_numpy()
    for k, line in enumerate(lines):
        graph.add_node(k)
        if line.distance(edge.exterior) < 0.01:
            graph.add_edge(k, "out")
    for a, b in zip(*shapely.STRtree(lines).query(lines, "dwithin", 0.01)):
        graph.add_edge(int(a), int(b))
    assert nx.is_connected(graph)


def test_parcels_are_cut_anew_and_the_rest_stays(layers):
    before, gone = layers["parcels"], disc(layers)
    assert len(gone) > 5
    wide = ParcelRules(width=24.0)
    done = redo_parcels(before, gone, Asked(rules=wide), Around(streets=layers["streets"]))
    after = done.parcels
    kept = [label for label in before.index if label not in gone]
    unchanged(before, after, kept)
    assert (after.loc[kept, "change"] == "kept").all()
    tiles(before, after, gone)
    has_access(after, layers["streets"])
    unchanged(layers["streets"], done.streets, layers["streets"].index)
    new = after[after["change"] == "new"]
    assert done.made == len(new)
    assert done.chosen == len(gone)
    lots = new[new["land_use"] == "parcel"]
    assert len(lots) < len(gone)
    # ids go on, what names the site is taken over, all measures are there
    assert after["parcel_id"].is_unique
    assert set(new["feature"]) == {"7"}
    assert set(new["variation"]) == {1}
    assert lots["area_m2"].astype(float).to_numpy() == pytest.approx(lots.area.to_numpy())
    assert (lots["p_angle"].astype(float) < 15).mean() > 0.8
    assert new["owner"].isna().all()


def test_the_input_is_not_modified(layers):
    before = layers["parcels"].copy(deep=True)
    streets = layers["streets"].copy(deep=True)
    asked = Asked("streets", RULES, QUICK, seed=2)
    redo_parcels(layers["parcels"], disc(layers), asked, Around(streets=layers["streets"]))
    pd.testing.assert_frame_equal(before, layers["parcels"])
    pd.testing.assert_frame_equal(streets, layers["streets"])


def test_the_same_seed_gives_the_same(layers):
    runs = [
        redo_parcels(
            layers["parcels"],
            disc(layers),
            Asked("streets", RULES, QUICK, seed=seed),
            Around(streets=layers["streets"]),
        )
        for seed in (4, 4)
    ]
    assert list(runs[0].parcels.geometry.to_wkb()) == list(runs[1].parcels.geometry.to_wkb())
    assert list(runs[0].streets.geometry.to_wkb()) == list(runs[1].streets.geometry.to_wkb())


@pytest.mark.parametrize("radius", [90.0, 130.0])
def test_streets_are_laid_anew(layers, radius):
    before, streets = layers["parcels"], layers["streets"]
    gone = disc(layers, radius, (300.0, 150.0))
    asked = Asked("streets", RULES, QUICK, seed=11)
    done = redo_parcels(before, gone, asked, Around(streets=streets))
    after, lines = done.parcels, done.streets
    kept = [label for label in before.index if label not in gone]
    unchanged(before, after, kept)
    stay = lines.index[lines["change"] == "kept"]
    unchanged(streets, lines, stay)
    assert set(stay) <= set(streets.index)
    overlaps(after)
    has_access(after, lines)
    connected(lines)
    # nothing new lies outside the old plots and the streets that are gone
    lost = streets.geometry.drop(stay)
    land = shapely.union_all(
        [*before.geometry.loc[gone], *lost.buffer(8.0), *streets.geometry.loc[stay].buffer(0.01)]
    )
    new = after.geometry[after["change"] == "new"].to_numpy()
    assert shapely.union_all(new).difference(land).area < 1.0
    made = lines[lines["change"] == "new"]
    assert lines["street_id"].is_unique
    assert made["dist_to_sink_m"].isna().all()
    # no street runs over a plot
    plots = after.geometry[~after["land_use"].isin(["lane", "street"])].to_numpy()
    for line in made.geometry:
        assert shapely.length(shapely.intersection(plots, line)).max() < 0.05


def test_streets_along_which_parcels_stay_are_kept():
    south = [box(X + 20 * k, Y, X + 20 * (k + 1), Y + 30) for k in range(6)]
    north = [box(X + 20 * k, Y + 45, X + 20 * (k + 1), Y + 75) for k in range(6)]
    frame = gpd.GeoDataFrame(geometry=[*south, *north], crs=UTM)
    lines = [
        LineString([(X, Y + 37.5), (X + 120, Y + 37.5)]),
        LineString([(X + 120, Y + 37.5), (X + 130, Y + 37.5)]),
    ]
    streets = gpd.GeoDataFrame(
        {"width_m": [15.0, 15.0], "status": ["new", "connector"]}, geometry=lines, crs=UTM
    )
    asked = Asked("streets", RULES, QUICK)
    # one parcel in the middle stays, and so does its street
    some = redo_parcels(frame, [k for k in range(12) if k != 3], asked, Around(streets=streets))
    assert set(some.streets.loc[[0, 1], "change"]) == {"kept"}
    # nobody is left: the street goes, and the piece that carried it on goes with it
    every = redo_parcels(frame, list(range(12)), asked, Around(streets=streets))
    assert {0, 1}.isdisjoint(every.streets.index)
    assert shapely.union_all(every.parcels.geometry.to_numpy()).area > 0.7 * 120 * 75


def test_merging_makes_one_of_those_that_touch(layers):
    before = layers["parcels"]
    lots = before[(before["land_use"] == "parcel") & (before["block_id"] == 1)]
    first = lots.index[0]
    shared = shapely.intersection(
        lots.geometry.boundary.to_numpy(), lots.geometry.loc[first].boundary
    )
    beside = lots.index[shapely.length(shared) > 5][:2].tolist()
    far = before.index[before["block_id"] == before["block_id"].max()][0]
    gone = [*dict.fromkeys([first, *beside]), far]
    done = redo_parcels(before, gone, Asked("merge"), Around(streets=layers["streets"]))
    after = done.parcels
    unchanged(before, after, [label for label in before.index if label not in gone])
    tiles(before, after, gone)
    new = after[after["change"] == "merged"]
    assert len(new) == 2
    assert set(new["land_use"]) <= set(before["land_use"])
    assert new["area_m2"].astype(float).max() == pytest.approx(
        before.geometry.loc[gone[:-1]].area.sum()
    )
    park = redo_parcels(before, gone, Asked("merge", use="park")).parcels
    assert set(park.loc[park["change"] == "merged", "land_use"]) == {"park"}


def test_a_use_is_assigned_and_nothing_else(layers):
    before, chosen = layers["parcels"], disc(layers, 30.0)
    done = redo_parcels(before, chosen, Asked("use", use="park"))
    after = done.parcels
    assert list(after.index) == list(before.index)
    assert list(after.geometry.to_wkb()) == list(before.geometry.to_wkb())
    assert set(after.loc[chosen, "land_use"]) == {"park"}
    assert set(after.loc[chosen, "change"]) == {"use"}
    unchanged(before, after, before.index.difference(chosen))
    same = before.columns.difference(
        ["land_use", "p_angle", "p_area", "undesirable", "corner", "access", "frontage_m",
         "depth_m", "width_m"]
    )  # fmt: skip
    unchanged(before[same], after[[*same, "change"]], chosen)
    assert after.loc[chosen, "p_angle"].isna().all()
    assert (done.chosen, done.made) == (len(chosen), 0)
    # and back again: the measures are as they were
    back = redo_parcels(
        after.drop(columns="change"), chosen, Asked("use", use="parcel"),
        Around(streets=layers["streets"]),
    ).parcels  # fmt: skip
    lots = [label for label in chosen if before.loc[label, "land_use"] == "parcel"]
    assert back.loc[lots, "p_angle"].astype(float).to_numpy() == pytest.approx(
        before.loc[lots, "p_angle"].astype(float).to_numpy()
    )
    assert back.loc[lots, "frontage_m"].astype(float).to_numpy() == pytest.approx(
        before.loc[lots, "frontage_m"].astype(float).to_numpy(), abs=0.2
    )


def test_an_area_picks_what_it_covers_by_more_than_half(layers):
    parcels = gpd.GeoDataFrame(
        {"a": [1, 2, 3, 4]},
        geometry=[box(0, 0, 10, 10), box(10, 0, 20, 10), box(20, 0, 30, 10), None],
        index=[7, 5, 9, 1], crs=UTM,
    )  # fmt: skip
    parcels.geometry = parcels.geometry.translate(X, Y)
    area = gpd.GeoDataFrame(geometry=[box(X, Y, X + 16, Y + 10), None], crs=UTM)
    assert covered(parcels, area) == [7, 5]
    # two areas that cover a parcel together, in another CRS
    halves = gpd.GeoDataFrame(
        geometry=[box(X + 20, Y, X + 24, Y + 10), box(X + 23, Y, X + 27, Y + 10)], crs=UTM
    )
    assert covered(parcels, halves.to_crs(4326)) == [9]


def test_degrees_are_worked_on_in_metres(layers):
    before = layers["parcels"].to_crs(4326)
    gone = disc(layers)
    done = redo_parcels(before, gone, Asked(), Around(streets=layers["streets"]))
    unchanged(before, done.parcels, before.index.difference(gone))
    new = done.parcels[done.parcels["change"] == "new"].to_crs(UTM)
    land = shapely.union_all(layers["parcels"].geometry.loc[gone].to_numpy())
    assert new.area.sum() == pytest.approx(land.area, rel=1e-6)


def test_edges_without_a_road_give_no_access():
    blocks = gpd.GeoDataFrame(geometry=[box(X, Y, X + 120, Y + 60)], crs=UTM)
    road = gpd.GeoDataFrame(geometry=[LineString([(X - 50, Y - 8), (X + 170, Y - 8)])], crs=UTM)
    free = redo_parcels(blocks, [0], Asked()).parcels
    held = redo_parcels(blocks, [0], Asked(), Around(site=blocks, roads=road)).parcels
    south = box(X, Y - 1, X + 120, Y + 0.1)
    for shape, use in zip(held.geometry, held["land_use"]):
        assert use != "parcel" or shape.exterior.intersection(south).length > 5
    reach = [shape.exterior.intersection(south).length > 5 for shape in free.geometry]
    assert not all(reach)


def test_a_lane_that_others_need_stays():
    lane = box(X, Y + 30, X + 60, Y + 36)
    south = box(X, Y, X + 60, Y + 30)
    north = box(X, Y + 36, X + 60, Y + 66)
    frame = gpd.GeoDataFrame(
        {"land_use": ["parcel", "lane", "parcel"]}, geometry=[south, lane, north], crs=UTM
    )
    done = redo_parcels(frame, [0, 1], Asked())
    unchanged(frame, done.parcels, [1, 2])
    assert len(done.problems) == 1
    assert "gives access" in done.problems["problem"].iloc[0]
    with pytest.raises(InputError, match="Only lanes"):
        redo_parcels(frame, [1], Asked())


def test_variations_are_told_apart(layers):
    twice = pd.concat([layers["parcels"], layers["parcels"].assign(variation=2)])
    twice.index = np.arange(len(twice))
    first = layers["parcels"]
    chosen = list(range(3))
    done = redo_parcels(twice, chosen, Asked("merge")).parcels
    unchanged(twice, done, twice.index.difference(chosen))
    assert set(done.loc[done["change"] == "merged", "variation"]) == {1}
    with pytest.raises(InputError, match="2 variations"):
        redo_parcels(twice, [0, len(first)], Asked())


def test_streets_of_other_variations_have_no_say(layers):
    before, streets = layers["parcels"], layers["streets"].assign(variation=1)
    other = streets.assign(variation=2, geometry=streets.geometry.translate(11.0, 4.0))
    other["street_id"] += 100
    both = gpd.GeoDataFrame(pd.concat([streets, other], ignore_index=True), crs=UTM)
    gone = disc(layers, 130.0, (300.0, 150.0))
    asked = Asked("streets", RULES, QUICK, seed=11)
    alone = redo_parcels(before, gone, asked, Around(streets=streets))
    done = redo_parcels(before, gone, asked, Around(streets=both))
    assert list(done.parcels.geometry.to_wkb()) == list(alone.parcels.geometry.to_wkb())
    kept = done.streets[done.streets["change"] == "kept"]
    assert (kept["variation"] == 2).sum() == len(other)
    new = done.streets[done.streets["change"] == "new"]
    assert set(new["variation"]) <= {1}
    assert set(new["site_id"]) <= {1}


def test_odd_features_are_told_or_stay():
    bow = Polygon([(X, Y), (X + 40, Y + 40), (X + 40, Y), (X, Y + 40)])
    frame = gpd.GeoDataFrame(
        geometry=[box(X + 50, Y, X + 150, Y + 60), None, bow, Polygon()], crs=UTM
    )
    done = redo_parcels(frame, [0, 1, 3], Asked())
    assert set(done.problems["problem"]) == {"it has no area"}
    assert done.parcels.geometry.loc[2].equals_exact(bow, 0)
    assert done.parcels.geometry.loc[1] is None
    alone = redo_parcels(frame, [2], Asked("merge")).parcels
    assert alone.geometry[alone["change"] == "merged"].area.sum() == pytest.approx(800)


def test_what_cannot_be_done_is_said(layers):
    with pytest.raises(InputError, match="Nothing is chosen"):
        redo_parcels(layers["parcels"], [], Asked())
    with pytest.raises(InputError, match="no layer of streets"):
        redo_parcels(layers["parcels"], disc(layers), Asked("streets"))
    with pytest.raises(InputError, match="No use"):
        Asked("use")
    with pytest.raises(InputError, match="cannot be done"):
        Asked("burn")
    with pytest.raises(InputError, match="coordinate reference"):
        redo_parcels(gpd.GeoDataFrame(geometry=[LAND]), [0], Asked())


class Stopped(Silent):
    def cancelled(self) -> bool:
        return True


@pytest.mark.parametrize("action", ["parcels", "streets"])
def test_cancelling_raises(layers, action):
    with pytest.raises(CancelledError):
        redo_parcels(
            layers["parcels"], disc(layers, 130.0), Asked(action, RULES, QUICK),
            Around(streets=layers["streets"]), progress=Stopped(),
        )  # fmt: skip
