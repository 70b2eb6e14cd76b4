"""Branches, and short ways within a storey: judged on the corridors themselves."""

from __future__ import annotations

import dataclasses
import itertools
import math

import geopandas as gpd
import networkx as nx
import numpy as np
import pytest
import shapely
from platwright.errors import CancelledError, InputError
from platwright.progress import Silent
from platwright.rooms.design import design_floors, room_problem
from platwright.rooms.floors import floors_of
from platwright.rooms.rules import RoomRules
from platwright.rooms.shapes import shipped_templates

EAST, NORTH = 500_000.0, 5_000_000.0
#: The first plan will do where only what is forbidden is judged.
QUICK = RoomRules(time_limit=20.0, gap=1.0, dead_ends=3.0)


@pytest.fixture(scope="module")
def floor():
    outline = shapely.box(EAST, NORTH, EAST + 40, NORTH + 28)
    (made,) = floors_of(gpd.GeoDataFrame(geometry=[outline], crs=32632), module=4.0)
    return made


def degrees(floor, active):
    return np.bincount(floor.mesh.edges[active].ravel(), minlength=len(floor.mesh.vertices))


def test_no_corridor_forks_where_that_is_forbidden(floor):
    rules = dataclasses.replace(QUICK, branches=math.inf)
    (storey,) = design_floors([floor], shipped_templates("basic"), rules)
    assert storey.plan is not None
    assert degrees(floor, storey.plan.active).max() == 2


@pytest.mark.slow
def test_forks_that_cost_are_not_more_than_those_that_do_not(floor):
    counts = []
    for cost in (0.0, 50.0):
        rules = dataclasses.replace(QUICK, gap=0.0, time_limit=5.0, branches=cost)
        (storey,) = design_floors([floor], shipped_templates("basic"), rules)
        counts.append(int((degrees(floor, storey.plan.active) > 2).sum()))
    assert counts[1] <= counts[0]


@pytest.mark.slow
def test_ways_between_parts_are_short_or_counted(floor):
    """Each way is sought anew in the corridors, by their graph alone."""
    rules = dataclasses.replace(QUICK, gap=0.0, time_limit=12.0, links=6.0, part_size=16.0)
    templates = shipped_templates("basic")
    (linked,) = design_floors([floor], templates, rules)
    wanted = linked.problem.network.requirements
    assert linked.links == len(wanted) >= 3
    able = nx.Graph(floor.mesh.edges[linked.problem.network.candidate].tolist())

    def missing(storey):
        graph = nx.Graph(floor.mesh.edges[storey.plan.active].tolist())
        count = 0
        for link in wanted:
            least = nx.shortest_path_length(able, link.start, link.end)
            try:
                count += nx.shortest_path_length(graph, link.start, link.end) > least + 2
            except (nx.NodeNotFound, nx.NetworkXNoPath):
                count += 1
        return count

    assert missing(linked) == linked.links_missing
    (plain,) = design_floors([floor], templates, dataclasses.replace(rules, links=0.0))
    assert plain.links == 0
    assert missing(linked) < missing(plain)


def test_parts_leave_out_what_no_room_covers(floor):
    covered = np.ones(len(floor.mesh.faces), dtype=bool)
    covered[:12] = False
    part = dataclasses.replace(floor, floor=covered)
    rules = dataclasses.replace(QUICK, links=6.0, part_size=16.0)
    network = room_problem(part, shipped_templates("basic"), rules).network
    ends = set(itertools.chain.from_iterable((own.start, own.end) for own in network.requirements))
    bare = set(range(len(floor.mesh.vertices))) - set(floor.mesh.faces[covered].ravel().tolist())
    assert ends
    assert not ends & bare


@pytest.mark.parametrize("wrong", [{"links": -1.0}, {"part_size": 0.0}, {"detour": -1.0}])
def test_values_out_of_range_are_refused_by_name(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        RoomRules(**wrong)


def test_cancel_is_asked_before_the_shapes_of_each_storey(floor):
    """Shapes of many storeys take their time: nobody waits for all of them."""
    asked = []

    class Impatient(Silent):
        def cancelled(self):
            asked.append(len(asked))
            return len(asked) > 2

    with pytest.raises(CancelledError):
        design_floors([floor] * 50, shipped_templates("basic"), QUICK, Impatient())
    assert len(asked) == 3
