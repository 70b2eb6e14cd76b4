"""Sub-regions designed apart: the same wherever, what fails is tried again, runs are resumed."""

from __future__ import annotations

import dataclasses
import os
import signal
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from platwright.city import CityFile, CityRules, city_layers, design_city, divide_city
from platwright.city.agreement import settle
from platwright.city.region import task_of
from platwright.errors import CancelledError, InputError
from platwright.network.specification import Specification
from platwright.progress import Silent
from platwright.tasks import Cluster, Processes
from shapely.geometry import LineString, Point

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
import towns  # noqa: E402
from towns import MARK, X, Y, cross_town, ground, lines, plain  # noqa: E402

#: A little search is enough.
QUICK = Specification(effort=8.0)


@pytest.fixture(scope="module")
def city():
    """Four sub-regions."""
    return divide_city(*cross_town())


@pytest.fixture(scope="module")
def plan(city):
    """Their streets, designed here."""
    return design_city(city, QUICK)


def processes(workers=2):
    """Return processes that find the work of these tests, too."""
    return Processes(workers, folders=[str(HERE), *sys.path])


def bytes_of(frame):
    """Return all of a layer but times, to be compared exactly."""
    told = frame.drop(columns=["geometry", "seconds", "attempts"], errors="ignore")
    return told.to_json(), [shapely.to_wkb(g) for g in frame.geometry]


def test_every_sub_region_has_streets_in_it_and_they_meet_at_planned_junctions(city, plan):
    assert plan.count("done") == 4
    streets = city_layers(plan)["streets"]
    places = [Point(xy) for j in city.junctions for xy in j.sides.values()]
    for region in city.regions:
        own = streets[streets["sub_region"] == region.number]
        assert own.length.sum() > 300
        assert all(region.polygon.buffer(0.01).covers(line) for line in own.geometry)
        ends = [Point(xy) for line in own.geometry for xy in (line.coords[0], line.coords[-1])]
        at_road = [p for p in ends if region.frontage.distance(p) < 0.01]
        assert at_road
        assert all(min(p.distance(q) for q in places) < 1e-9 for p in at_road)
    assert plan.agreement.share == 1.0
    assert plan.agreement.count("crossing") >= 2


def test_streets_are_one_network_with_the_roads(plan):
    import networkx as nx

    streets = city_layers(plan)["streets"]
    graph = nx.Graph()
    for line in streets.geometry:
        graph.add_edge(*(tuple(np.round(line.coords[i], 3)) for i in (0, -1)))
    assert nx.is_connected(graph)


def test_the_layers_add_up(city, plan):
    found = city_layers(plan)
    regions, streets = found["sub_regions"], found["streets"]
    assert regions["state"].tolist() == ["done"] * 4
    for row in regions.itertuples():
        own = streets[streets["sub_region"] == row.sub_region]
        assert own.length.sum() == pytest.approx(row.length_m, rel=0.02)
        assert row.bound <= row.objective + 1e-6
        assert row.area_ha == pytest.approx(row.geometry.area / 1e4)
    assert streets["street_id"].tolist() == list(range(1, len(streets) + 1))
    assert set(streets["status"]) == {"new", "existing"}
    old = streets[streets["status"] == "existing"]
    assert old.length.sum() == pytest.approx(800 + 600, abs=0.1)
    assert np.allclose(streets.length, streets["length_m"])
    crossings = found["junctions"][found["junctions"]["state"] == "crossing"]
    assert all(len(text.split(", ")) == 2 for text in crossings["sub_regions"])


def test_layers_come_back_in_the_crs_of_the_municipality(city):
    town, roads = cross_town()
    degrees = divide_city(town.to_crs(4326), roads)
    plan = design_city(degrees, QUICK, design=towns.plain)
    for frame in city_layers(plan).values():
        assert frame.crs.to_epsg() == 4326
    joined = city_layers(plan)["sub_regions"].to_crs(32632).geometry.union_all()
    assert joined.area == pytest.approx(480_000, rel=1e-3)


def test_the_same_bit_for_bit_wherever(city, plan):
    there = design_city(city, QUICK, executor=processes())
    assert there.digest == plan.digest
    for name, frame in city_layers(plan).items():
        assert bytes_of(frame) == bytes_of(city_layers(there)[name]), name


def test_another_seed_is_another_task_and_seeds_follow_the_ground(city):
    keys = [task_of(city, r, QUICK).key for r in city.regions]
    assert len(set(keys)) == 4
    assert keys == [task_of(city, r, QUICK).key for r in city.regions]
    other = Specification(effort=8.0, seed=2)
    assert not set(keys) & {task_of(city, r, other).key for r in city.regions}
    seeds = {task_of(city, r, QUICK).specification.seed for r in city.regions}
    assert len(seeds) == 4


def test_a_change_elsewhere_leaves_the_other_tasks_as_they_are(city):
    town, roads = cross_town()
    more = towns.lines([("primary", [(600, 0), (600, 300)])])
    changed = divide_city(town, pd.concat([roads, more], ignore_index=True))
    before = {task_of(city, r, QUICK).key for r in city.regions}
    after = {task_of(changed, r, QUICK).key for r in changed.regions if r.state == "design"}
    north_west = next(r for r in city.regions if r.number == 1)
    assert len(changed.regions) == 5
    assert task_of(city, north_west, QUICK).key in before & after


def test_a_killed_worker_costs_nothing(city, tmp_path, monkeypatch):
    monkeypatch.setenv(MARK, str(tmp_path))
    found = design_city(city, QUICK, executor=processes(), design=towns.killed_once)
    expected = design_city(city, QUICK, design=towns.plain)
    assert found.count("done") == 4
    assert [o.attempts for o in found.outcomes.values()] == [2, 2, 2, 2]
    assert found.digest == expected.digest


@pytest.mark.parametrize("where", ["here", "processes"])
def test_a_poisoned_sub_region_fails_with_its_reason_and_the_rest_is_kept(city, where):
    executor = processes() if where == "processes" else None
    plan = design_city(city, QUICK, executor=executor, design=towns.poisoned)
    states = {number: own.state for number, own in plan.outcomes.items()}
    assert states == {1: "done", 2: "failed", 3: "done", 4: "done"}
    assert "poison" in plan.outcomes[2].reason
    assert plan.outcomes[2].attempts == 2
    found = city_layers(plan)
    rows = found["problems"]
    row = rows[rows["severity"] == "error"].iloc[0]
    assert (row["feature"], "poison" in row["problem"]) == ("2", True)
    assert set(found["streets"]["sub_region"].dropna()) == {1, 3, 4}
    assert found["sub_regions"]["state"].tolist() == ["done", "failed", "done", "done"]


def test_what_cannot_be_had_is_asked_for_once_more_with_less(city):
    plan = design_city(city, QUICK, design=towns.refused)
    assert [o.state for o in plan.outcomes.values()] == ["done"] * 4
    assert [o.attempts for o in plan.outcomes.values()] == [2] * 4


class Stop(Silent):
    """Cancels after some sub-regions."""

    def __init__(self, after):
        self.after, self.done = after, 0

    def stage(self, text, _fraction):
        if " of " in text:
            self.done = int(text.split()[0])

    def cancelled(self):
        return self.done >= self.after


def test_cancel_keeps_what_is_finished_and_a_later_run_goes_on(city, tmp_path):
    file = CityFile(tmp_path / "city.gpkg")
    part = design_city(city, QUICK, store=file, design=towns.plain, progress=Stop(2))
    assert part.cancelled
    assert (part.count("done"), part.count("not reached")) == (2, 2)
    assert len(file.finished()) == 2
    whole = design_city(city, QUICK, store=file, design=towns.plain)
    assert whole.resumed == 2
    assert whole.digest == design_city(city, QUICK, design=towns.plain).digest


def test_cancelled_before_anything_is_an_error(city):
    with pytest.raises(CancelledError):
        design_city(city, QUICK, design=towns.plain, progress=Stop(0))


def test_resumed_is_uninterrupted_with_real_streets(city, plan, tmp_path):
    file = CityFile(tmp_path / "city.gpkg")
    design_city(city, QUICK, store=file, progress=Stop(1))
    assert len(file.finished()) == 1
    resumed = design_city(city, QUICK, store=file)
    assert resumed.resumed == 1
    assert resumed.digest == plan.digest
    for name, frame in city_layers(plan).items():
        assert bytes_of(frame) == bytes_of(city_layers(resumed)[name]), name


KILLED = """
import sys
sys.path[:0] = {folders!r}
import conftest
import towns
from platwright.city import CityFile, design_city, divide_city
from platwright.network.specification import Specification
city = divide_city(*towns.cross_town())
store = CityFile({path!r})
design_city(city, Specification(effort=8.0), store=store, design=towns.killed_in_the_middle)
"""


def test_a_run_that_is_killed_is_resumed(city, tmp_path):
    path, marks = tmp_path / "city.gpkg", tmp_path / "marks"
    marks.mkdir()
    text = KILLED.format(folders=[str(HERE), str(HERE.parent)], path=str(path))
    ended = subprocess.run(
        [sys.executable, "-c", text], env={**os.environ, MARK: str(marks)}, check=False
    )
    assert ended.returncode == -signal.SIGKILL
    file = CityFile(path)
    assert len(file.finished()) == 2
    resumed = design_city(city, QUICK, store=file, design=towns.plain)
    assert resumed.resumed == 2
    assert resumed.digest == design_city(city, QUICK, design=towns.plain).digest


def test_the_file_is_a_geopackage_beside_other_layers(city, plan, tmp_path):
    file = CityFile(tmp_path / "city.gpkg")
    design_city(city, QUICK, store=file, design=towns.plain)
    city_layers(plan)["streets"].to_file(file.path, layer="streets", engine="pyogrio")
    names = {name for name, _ in pyogrio.list_layers(file.path)}
    assert names == {"streets", "finished_sub_regions"}
    assert len(file.finished()) == 4
    assert len(gpd.read_file(file.path, layer="streets")) == len(city_layers(plan)["streets"])


def test_a_file_that_cannot_be_used_is_refused_by_name(city, tmp_path):
    with pytest.raises(InputError, match=r"end.* in \.gpkg"):
        CityFile(tmp_path / "city.shp")
    with pytest.raises(InputError, match="folder"):
        CityFile(tmp_path / "nowhere" / "city.gpkg")
    bad = tmp_path / "bad.gpkg"
    bad.write_text("no database, though its name says so" * 100)
    with pytest.raises(InputError, match="could not be used"):
        design_city(city, QUICK, store=CityFile(bad), design=towns.plain)


def test_nothing_to_design_is_an_error():
    town, roads = cross_town()
    city = divide_city(town, roads, rules=CityRules(least_ha=20.0, most_ha=60.0))
    with pytest.raises(InputError, match="No sub-region"):
        design_city(city)


def street(*xy):
    """Return a street of a sub-region's result."""
    course = [[X + x, Y + y] for x, y in xy]
    return {"level": 3, "status": "new", "length_m": LineString(course).length, "xy": course}


@pytest.mark.parametrize(
    ("gap", "states", "share"),
    [(8.0, ["crossing"], 1.0), (23.0, ["staggered"] * 2, 0.0), (60.0, ["T-junction"] * 2, 1.0)],
)
def test_ends_agree_are_staggered_or_keep_their_distance(city, gap, states, share):
    # 60 m from any planned junction, so that only the two ends count
    assert all(abs(xy[0] - X - 60) > 45 or abs(xy[1] - Y - 300) > 1
               for j in city.junctions for xy in j.sides.values())  # fmt: skip
    above, below = street((50, 450), (50, 300)), street((50 + gap, 150), (50 + gap, 300))
    agreed = settle(city, {1: [above], 3: [below]})
    used = [m for m in agreed.meetings if m.state != "not used"]
    assert [m.state for m in used] == states
    assert agreed.share == share
    ends = [tuple(agreed.streets[n][0]["xy"][-1]) for n in (1, 3)]
    assert (ends[0] == ends[1]) == (states == ["crossing"])
    if states != ["crossing"]:
        assert [m.offset for m in used] == pytest.approx([gap, gap])
        assert agreed.streets == {1: [above], 3: [below]}


def test_a_moved_end_takes_the_street_along_only_near_it(city):
    far = street((217, 560), (217, 440), (217, 330), (217, 300))
    moved = settle(city, {1: [far]}).streets[1][0]
    xy = np.array(moved["xy"]) - (X, Y)
    assert xy[:2].tolist() == [[217, 560], [217, 440]]
    assert 210 < xy[2][0] < 217
    assert xy[3] == pytest.approx((210, 300))
    assert moved["length_m"] == pytest.approx(LineString(xy).length)


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_streets(city, plan, root, tmp_path, monkeypatch):
    distributed = pytest.importorskip(
        "distributed", reason="the Python package distributed is not installed"
    )
    (tmp_path / "platwright").symlink_to(root / "algorithms", target_is_directory=True)
    # its processes have the path of this one
    monkeypatch.syspath_prepend(str(tmp_path))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as made:
        there = design_city(city, QUICK, executor=Cluster(made.scheduler_address))
    assert there.count("done") == 4
    assert there.digest == plan.digest


@pytest.mark.slow
def test_a_real_town(shared_data):
    path = shared_data / "town" / "vaduz_li.gpkg"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    roads = gpd.read_file(path, layer="streets")
    west, south, east, north = roads.total_bounds
    middle = shapely.box(west + 600, south + 600, east - 600, north - 600)
    town = gpd.GeoDataFrame(geometry=[middle], crs=roads.crs)
    water = gpd.read_file(path, layer="water")
    city = divide_city(town, roads, water)
    plan = design_city(city, Specification(effort=5.0))
    assert plan.count("done") >= 3
    assert plan.count("failed") <= 1
    assert plan.agreement.share >= 0.9
    found = city_layers(plan)
    new = found["streets"][found["streets"]["sub_region"].notna()]
    wet = shapely.intersection(new.geometry.to_numpy(), water.geometry.union_all())
    assert shapely.length(wet).sum() < 0.01 * new.length.sum()


def none_at_all(item, _progress):
    raise InputError("No place for a street.", "Give another.")


def test_a_city_of_which_nothing_could_be_designed_is_no_perfect_city(city):
    with pytest.raises(InputError, match=r"None of the 4 sub-regions.*No place for a street"):
        design_city(city, design=none_at_all)


def test_new_collectors_count_as_new_streets():
    city = divide_city(*_wide_town(), rules=CityRules(most_ha=10.0))
    made = design_city(city, design=plain)
    collectors = [road.line.length for road in city.roads if road.new]
    assert collectors
    frame = city_layers(made)["streets"]
    told = frame[frame["sub_region"].isna() & (frame["status"] == "new")].length.sum()
    assert told == pytest.approx(sum(collectors), rel=0.01)
    assert made.numbers["TOTAL_LENGTH"] == pytest.approx(
        made.count("done") + sum(collectors)
    )  # every plain result says 1 m


def _wide_town():
    roads = lines([("primary", [(0, 300), (800, 300)])])
    return ground(800, 600), roads


def test_ends_across_two_carriageways_are_linked_and_not_drawn_over_one():
    """The carriageways are 14 m apart, and no junction was planned where the ends are."""
    roads = lines([
        ("primary", [(0, 300), (800, 300)]),
        ("primary", [(0, 314), (800, 314)]),
    ])  # fmt: skip
    city = divide_city(ground(800, 600), roads, rules=CityRules())
    north, south = (
        next(r.number for r in city.to_design if r.polygon.centroid.y * sign > sign * (Y + 307))
        for sign in (1, -1)
    )
    free = dataclasses.replace(city, junctions=())
    above, below = street((50, 450), (50, 314)), street((50, 150), (50, 300))
    agreed = settle(free, {north: [above], south: [below]})
    assert agreed.streets == {north: [above], south: [below]}
    (meeting,) = (m for m in agreed.meetings if m.state != "not used")
    assert meeting.state == "crossing"
    ((link, _),) = agreed.links
    assert link.length == pytest.approx(14.0)
    aside = street((60, 150), (60, 300))
    apart = settle(free, {north: [above], south: [aside]})
    assert apart.links == ()
    assert apart.streets == {north: [above], south: [aside]}
