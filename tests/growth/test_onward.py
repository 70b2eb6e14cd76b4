"""Growth that goes on in blocks that are too large."""

from __future__ import annotations

from dataclasses import replace

import geopandas as gpd
import numpy as np
import pytest
import shapely
from platwright.errors import InputError
from platwright.growth.grammars.shipped import GRAMMARS, shipped_grammar
from platwright.growth.grow import grow
from platwright.growth.land.entries import entries
from platwright.growth.land.given import GivenNetwork, GivenStreet
from platwright.growth.land.ground import RealGround, ground_of_sites
from platwright.growth.land.legs import Sight
from platwright.growth.layers import growth_layers
from platwright.growth.layers.blocks import block_faces, grown_blocks
from platwright.growth.onward import grow_on
from platwright.growth.rules import GrowthRules
from platwright.growth.types import Ground, Start
from platwright.progress import Silent
from platwright.site import prepare_sites
from platwright.site.repair import Problems
from pyproj import CRS
from shapely.geometry import LineString, box

METRES = CRS.from_epsg(25832)
SIDE = 600.0


def square(grammar):
    """Return a field with a street around it, from the south of which one grows."""
    corners = np.array([[0, 0], [300, 0], [SIDE, 0], [SIDE, SIDE], [0, SIDE]], dtype=float)
    ends = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 0]])
    street = GivenStreet(LineString([*corners, corners[0]]), "Ring", "", False, 2)
    start = Start((300.0, 0.0), (0.0, 1.0), grammar.leaf, 1)
    ground = Ground(
        (start,), box(-0.1, -0.1, SIDE + 0.1, SIDE + 0.1), corners, ends,
        np.zeros(5, dtype=np.int64), np.array([True, False, True, True, True]),
    )  # fmt: skip
    return RealGround(ground, METRES, METRES, (street,), Problems().to_frame(METRES))


def rules(name, **options):
    return GrowthRules(shipped_grammar(name), **{"scale": 50.0, "iterations": 200, **options})


class Ear(Silent):
    """Hears what is told, and counts the questions."""

    def __init__(self):
        self.asked, self.fractions, self.warnings = 0, [], []

    def stage(self, _text, fraction):
        self.fractions.append(fraction)

    def warn(self, text):
        self.warnings.append(text)

    def cancelled(self):
        self.asked += 1
        return False


def remotest(growth):
    """Return how far it is at most from a place in the field to a street."""
    spots = shapely.points(*(axis.ravel() for axis in np.mgrid[5:SIDE:10, 5:SIDE:10]))
    streets = shapely.union_all(shapely.linestrings(growth.xy[growth.ends]))
    return shapely.distance(spots, streets).max()


def largest(growth, real):
    return shapely.area(grown_blocks(growth, real).polygons).max()


@pytest.mark.parametrize("name", GRAMMARS)
def test_no_place_stays_bare(name):
    real, asked = square(shipped_grammar(name)), rules(name)
    growth = grow_on(real, asked, 12_000.0)
    assert remotest(growth) < 75
    assert remotest(grow(real.ground, asked)) > remotest(growth)
    # culs-de-sac do not part blocks
    if name != "suburb":
        assert largest(growth, real) < 20_000


@pytest.mark.parametrize("name", GRAMMARS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_it_stays_planar_and_joins_up(name, seed):
    real, asked = square(shipped_grammar(name)), rules(name, seed=seed)
    growth = grow_on(real, asked, 10_000.0)
    lines = shapely.linestrings(growth.xy[growth.ends])
    one, other = shapely.STRtree(lines).query(lines, predicate="intersects")
    for i, j in zip(one, other):
        if i < j:
            shared = set(growth.ends[i]) & set(growth.ends[j])
            assert len(shared) == 1, (lines[i], lines[j])
            met = shapely.intersection(lines[i], lines[j])
            assert met.distance(shapely.Point(growth.xy[shared.pop()])) < 1e-6
            assert met.length < 1e-6
    assert len(np.unique(np.sort(growth.ends, axis=1), axis=0)) == len(growth.ends)
    whole = shapely.get_parts(shapely.union_all(shapely.buffer(lines, 0.01)))
    assert len(whole) == 1


def test_what_was_there_stays():
    real, asked = square(shipped_grammar("organic")), rules("organic")
    first, growth = grow(real.ground, asked), grow_on(real, asked, 10_000.0)
    assert len(growth.ends) > len(first.ends)
    count = len(first.xy)
    assert np.array_equal(growth.xy[:count], first.xy)
    assert np.array_equal(growth.born[:count], first.born)
    # the streets of the first growth are still there, whole or in parts, with all they had
    for edge in range(len(first.ends)):
        line = LineString(first.xy[first.ends[edge]]).buffer(0.001)
        parts = [
            k for k in range(len(growth.ends))
            if line.contains(LineString(growth.xy[growth.ends[k]]))
        ]  # fmt: skip
        assert growth.lengths[parts].sum() == pytest.approx(first.lengths[edge])
        for column in ("road", "edge_type", "step", "street"):
            assert (getattr(growth, column)[parts] == getattr(first, column)[edge]).all()
    ring = growth.lengths[growth.street == 0].sum()
    assert ring == pytest.approx(4 * SIDE)
    # roads that begin later are others, and later
    new = growth.step > len(first.steps)
    assert growth.road[new].min() > first.road.max()
    assert (growth.step[new] <= len(growth.steps)).all()
    assert (growth.born <= len(growth.steps)).all()


def test_a_node_is_there_no_later_than_its_streets():
    real = square(shipped_grammar("organic"))
    growth = grow_on(real, rules("organic"), 8_000.0)
    grown = growth.grown
    last = np.full(len(growth.xy), -1)
    np.maximum.at(last, growth.ends[grown].ravel(), np.repeat(growth.step[grown], 2))
    ended = last >= 0
    assert (growth.born[ended] <= last[ended]).all()


@pytest.mark.parametrize("seed", [1, 2])
def test_every_node_that_grew_has_a_state(seed):
    real, asked = square(shipped_grammar("grid")), rules("grid", seed=seed)
    growth = grow_on(real, asked, 6_000.0)
    ended = np.unique(growth.ends[growth.grown])
    assert (growth.road_type[ended] != "").all()
    assert (growth.node_type[ended] != "").all()


def test_the_record_goes_on():
    real, asked = square(shipped_grammar("organic")), rules("organic")
    growth = grow_on(real, asked, 10_000.0)
    assert [step.iteration for step in growth.steps] == list(range(1, len(growth.steps) + 1))
    for name in ("nodes", "segments", "length", "population"):
        values = [getattr(step, name) for step in growth.steps]
        assert values == sorted(values), name
    last = growth.steps[-1]
    assert last.segments == growth.grown.sum()
    assert last.length == pytest.approx(growth.lengths[growth.grown].sum())
    assert last.nodes == len(growth.xy) - len(real.ground.nodes)
    found = growth_layers(growth, real, asked)
    assert found["steps"]["iteration"].max() == len(growth.steps)
    assert found["streets"]["iteration"].max() <= len(growth.steps)


def test_limits_count_for_all_of_it():
    real = square(shipped_grammar("organic"))
    free = grow_on(real, rules("organic"), 8_000.0)
    alone = grow(real.ground, rules("organic"))
    most = (int(alone.grown.sum()) + int(free.grown.sum())) // 2
    held = grow_on(real, rules("organic", max_segments=most), 8_000.0)
    assert most <= held.grown.sum() <= most + 12
    metres = 0.5 * (alone.lengths[alone.grown].sum() + free.lengths[free.grown].sum())
    held = grow_on(real, rules("organic", max_length=metres), 8_000.0)
    assert metres <= held.lengths[held.grown].sum() <= metres + 200
    short = grow_on(real, rules("organic", iterations=len(alone.steps) + 2), 8_000.0)
    assert len(short.steps) <= len(alone.steps) + 2


def test_the_same_seed_gives_the_same():
    real, asked = square(shipped_grammar("line")), rules("line", seed=5)
    one, other = (grow_on(real, asked, 10_000.0) for _ in range(2))
    for name in ("xy", "ends", "road", "step", "street", "born"):
        assert np.array_equal(getattr(one, name), getattr(other, name))


def test_blocks_that_are_small_enough_are_left_alone():
    real, asked = square(shipped_grammar("grid")), rules("grid")
    assert np.array_equal(grow_on(real, asked, 1e9).xy, grow(real.ground, asked).xy)
    with pytest.raises(InputError, match="largest block"):
        grow_on(real, asked, 0.0)


def test_cancelling_keeps_what_has_grown():
    class Count(Silent):
        """Is cancelled after so many questions."""

        def __init__(self, most):
            self.most, self.asked = most, 0

        def cancelled(self):
            self.asked += 1
            return self.asked > self.most

    real, asked = square(shipped_grammar("organic")), rules("organic")
    every = Count(10**9)
    full = grow_on(real, asked, 8_000.0, every)
    for share in (0.2, 0.5, 0.9):
        kept = grow_on(real, asked, 8_000.0, Count(int(share * every.asked)))
        assert 5 < len(kept.ends) < len(full.ends)
        assert kept.stopped == "it was cancelled"


def test_it_asks_at_every_block_whether_to_go_on():
    real, asked = square(shipped_grammar("organic")), rules("organic")
    alone, both = Ear(), Ear()
    blocks = grown_blocks(grow(real.ground, asked, alone), real).polygons
    grow_on(real, asked, 3_000.0, both)
    assert both.asked >= alone.asked + (shapely.area(blocks) > 3_000).sum()


def test_progress_rises_and_a_warning_is_told_once():
    # streets of the grammar are longer than the field
    real, ear = square(shipped_grammar("line")), Ear()
    growth = grow_on(real, rules("line", scale=200.0, max_segments=500), 5_000.0, ear)
    assert len(growth.steps) > 10
    assert len(ear.warnings) == 1
    assert "Choose a smaller scale" in ear.warnings[0]
    assert ear.fractions == sorted(ear.fractions)
    assert ear.fractions[-1] <= 1


@pytest.mark.parametrize("name", GRAMMARS)
def test_existing_streets_bend_where_they_did(name):
    # the four corners of the ring are no junctions unless a street joins them
    real, asked = square(shipped_grammar(name)), rules(name)
    growth = grow_on(real, asked, 8_000.0)
    for node in range(len(growth.xy)):
        own = growth.street[(growth.ends == node).any(axis=1)]
        assert growth.bends[node] == (len(own) == 2 and own[0] == own[1] >= 0), node
    assert growth.bends.any()


def test_a_bend_that_is_joined_later_tells_its_road():
    # a round field: streets are led to the bends of the ring
    real = square(shipped_grammar("organic"))
    turns = np.linspace(0, 2 * np.pi, 200, endpoint=False) - np.pi / 2
    ring = SIDE / 2 + SIDE / 2 * np.c_[np.cos(turns), np.sin(turns)]
    bends = np.arange(200) > 0
    start = replace(real.ground.starts[0], xy=tuple(ring[0].tolist()), node=0)
    ends = np.c_[np.arange(200), np.roll(np.arange(200), -1)]
    ground = Ground(
        (start,), shapely.Polygon(ring).buffer(0.1), ring, ends, np.zeros(200, dtype=int), bends
    )
    asked = rules("organic", seed=4)
    first = grow(ground, asked)
    growth = grow_on(replace(real, ground=ground), asked, 6_000.0)
    late = growth.grown & (growth.step > len(first.steps))
    reached = np.setdiff1d(growth.ends[late, 1], np.unique(first.ends[first.grown]))
    reached = reached[reached < 200]
    assert len(reached) >= 3
    for node in reached:
        at = (growth.ends == node).any(axis=1)
        assert growth.incoming_road[node] in growth.road[at & growth.grown]
        assert np.hypot(*growth.incoming[node]) == pytest.approx(1)


@pytest.mark.parametrize("seed", [1, 2])
def test_only_blocks_that_were_too_large_are_looked_at_again(seed):
    # what became of some blocks is what lies in them of all blocks
    real, asked = square(shipped_grammar("organic")), rules("organic", seed=seed)
    before = grown_blocks(grow(real.ground, asked), real).polygons
    large = before[shapely.area(before) > 15_000]
    growth = grow_on(real, asked, 15_000.0)
    every = grown_blocks(growth, real).polygons
    area = shapely.union_all(large)
    expected = every[shapely.covers(area.buffer(0.01), every)]
    found = block_faces(growth, real.ground.domain, None, within=large)
    assert 0 < len(found) < len(every)
    assert shapely.equals_exact(found, expected, 1e-9).all()


def test_long_streets_are_looked_at_in_steps_that_fit_the_scale():
    class Counting(Sight):
        places = 0

        def from_places(self, xy, way):
            self.places += len(xy)
            return super().from_places(xy, way)

    # a street of 100 km beside ground in which streets are 10 km long
    ends = np.array([[0.0, 0.0], [100_000.0, 0.0]])
    none = np.zeros(2, dtype=bool)
    street = GivenStreet(LineString(ends), "", "", False, 2)
    net = GivenNetwork((street,), ends, np.array([[0, 1]]), np.zeros(1, dtype=np.int64), none)
    part = box(0, 0, 100_000, 50_000)
    sight = Counting(part, net, 50_000.0)
    found = entries(net, part, shipped_grammar("grid"), sight, scale=10_000.0, room=4_000.0)
    assert len(found) >= 2
    assert sight.places < 1_000


@pytest.mark.parametrize("seed", [3, 5, 8])
def test_where_nothing_comes_of_one_place_it_begins_at_another(root, seed):
    file = root / "data" / "helsinki" / "helsinki_yard.gpkg"
    site, roads, barred = (
        gpd.read_file(file, layer=layer) for layer in ("site", "streets", "obstacles")
    )
    sites = prepare_sites(site, roads, barred, snap_distance=60, inner_roads="keep").sites
    grid = shipped_grammar("grid")
    real = ground_of_sites(sites, grid, roads=roads, obstacles=barred, scale=60)
    growth = grow_on(real, GrowthRules(grid, scale=60, seed=seed, iterations=100), 15_000.0)
    # from the first place that is tried in the yard no street fits in between the others
    assert shapely.area(block_faces(growth, real.ground.domain, None)).max() < 40_000
    assert growth.grown.sum() > 30
