"""Layers of what really grew, in open ground, in a domain and on real sites."""

from __future__ import annotations

from functools import lru_cache

import geopandas as gpd
import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.growth.grammars.shipped import GRAMMARS, shipped_grammar
from platwright.growth.grow import grow
from platwright.growth.land.ground import RealGround, ground_of_sites, open_ground
from platwright.growth.layers import growth_layers
from platwright.growth.layers.graph import to_networkx
from platwright.growth.layers.prune import without_dead_ends
from platwright.growth.rules import GrowthRules
from platwright.growth.types import Ground, Start
from platwright.site import prepare_sites
from scipy.sparse.csgraph import connected_components

from .hand_made import ORIGIN, UTM, no_problems


def grown_rules(name, seed, segments, *, as_published=False):
    return GrowthRules(
        shipped_grammar(name), max_segments=segments, seed=seed, as_published=as_published
    )


@lru_cache(maxsize=64)
def in_a_disc(name, seed):
    """Grow into a disc of 1.5 km with a pond, until nothing is left or 400 streets are there."""
    middle = shapely.Point(ORIGIN)
    pond = shapely.Point(ORIGIN + np.array([600.0, 100.0])).buffer(220, quad_segs=3)
    domain = middle.buffer(1500, quad_segs=5).difference(pond)
    grammar = shipped_grammar(name)
    start = Start((float(ORIGIN[0]), float(ORIGIN[1])), (0.0, 1.0), grammar.start)
    real = RealGround(Ground((start,), domain), UTM, UTM, (), no_problems(UTM))
    rules = grown_rules(name, seed, 400)
    growth = grow(real.ground, rules)
    return growth, real, rules


seeds = st.integers(0, 999)
some = settings(max_examples=6)


@pytest.mark.parametrize("name", GRAMMARS)
@some
@given(seeds)
def test_layers_agree_with_each_other_and_the_growth(name, seed):
    growth, real, rules = in_a_disc(name, seed)
    layers = growth_layers(growth, real, rules)
    streets, nodes, blocks = layers["streets"], layers["nodes"], layers["blocks"]
    total = growth.steps[-1].length
    assert streets["length_m"].sum() == pytest.approx(total)
    assert layers["roads"]["length_m"].sum() == pytest.approx(total)
    assert len(streets) == growth.steps[-1].segments
    assert layers["steps"]["segments"].iloc[-1] == len(streets)
    assert streets["iteration"].max() <= len(growth.steps)
    # every end of a street is a node of as many streets as it says
    graph = nx.MultiGraph()
    for line in streets.geometry:
        graph.add_edge(line.coords[0], line.coords[-1])
    degree = {(point.x, point.y): d for point, d in zip(nodes.geometry, nodes["degree"])}
    assert dict(graph.degree()) == degree
    # the domain is tiled
    domain = real.ground.domain
    assert blocks["area_m2"].sum() == pytest.approx(domain.area, rel=1e-5)
    assert shapely.coverage_is_valid(blocks.geometry.to_numpy())
    # blocks that streets enclose are the inner faces of what is left without dead ends
    left = to_networkx(without_dead_ends(growth, real))
    core = nx.k_core(left, 2) if len(left) else left
    faces = core.number_of_edges() - core.number_of_nodes() + nx.number_connected_components(core)
    assert (blocks["enclosed"] == "streets").sum() <= faces


@pytest.mark.parametrize("name", GRAMMARS)
@some
@given(seeds)
def test_the_way_out_is_that_of_networkx(name, seed):
    growth, real, rules = in_a_disc(name, seed)
    streets = growth_layers(growth, real, rules)["streets"]
    graph = to_networkx(growth)
    outer = shapely.Polygon(real.ground.domain.exterior).boundary
    gap = shapely.distance(shapely.points(growth.xy), outer)
    sinks = set(np.flatnonzero(gap < 0.05).tolist())
    if not sinks:
        assert streets["dist_to_sink_m"].isna().all()
        return
    found = nx.multi_source_dijkstra_path_length(graph, sinks, weight="length")
    start = np.array([found.get(u, np.nan) for u in growth.ends[:, 0].tolist()])
    end = np.array([found.get(v, np.nan) for v in growth.ends[:, 1].tolist()])
    np.testing.assert_allclose(streets["dist_start_m"], start, atol=1e-6)
    np.testing.assert_allclose(streets["dist_end_m"], end, atol=1e-6)
    np.testing.assert_allclose(streets["dist_to_sink_m"], (start + end) / 2, atol=1e-6)


@pytest.mark.parametrize("name", GRAMMARS)
@some
@given(seeds)
def test_without_dead_ends_every_end_is_at_the_outer_edge(name, seed):
    growth, real, rules = in_a_disc(name, seed)
    left = without_dead_ends(growth, real)
    outer = shapely.Polygon(real.ground.domain.exterior).boundary
    ends = left.xy[left.degrees == 1]
    assert shapely.distance(shapely.points(ends), outer).max(initial=0.0) < 0.05
    # what streets enclose is not touched; nothing hangs together less than before
    parts = [
        connected_components(nx.to_scipy_sparse_array(to_networkx(g)))[0] if len(g.xy) else 0
        for g in (growth, left)
    ]
    assert parts[1] <= parts[0]
    before, after = (growth_layers(g, real, rules)["blocks"] for g in (growth, left))
    closed = [
        set(shapely.normalize(b.geometry[b["enclosed"] == "streets"].to_numpy()).tolist())
        for b in (before, after)
    ]
    assert closed[0] == closed[1]


def test_a_growth_as_published_has_layers_though_it_is_not_planar():
    rules = grown_rules("line", 42, 1500, as_published=True)
    real = open_ground(rules.grammar, UTM)
    growth = grow(real.ground, rules)
    layers = growth_layers(growth, real, rules)
    assert len(layers["streets"]) == len(growth.ends)
    blocks = layers["blocks"].geometry.to_numpy()
    assert len(blocks) > 300
    assert shapely.coverage_is_valid(blocks)
    # no street crosses a block, whether it has a node there or not, but where it ends in it
    lines = shapely.linestrings(growth.xy[growth.ends])
    pairs = shapely.STRtree(blocks).query(lines, predicate="intersects")
    inner = shapely.buffer(blocks[pairs[1]], -0.05)
    parts = shapely.get_num_geometries(shapely.difference(inner, lines[pairs[0]]))
    assert (parts <= 1).all()


SITES = [
    ("02_organic_triesen_li", "organic", 40.0, "stop"),
    ("12_hole_baths_li", "hex", 40.0, "join"),
    ("09_rail_lands_alewife_1km", "grid", 60.0, "stop"),
]


@pytest.mark.parametrize(("file", "name", "scale", "edge"), SITES)
def test_real_sites(shared_data, file, name, scale, edge):
    path = shared_data / "sites" / f"{file}.gpkg"
    site, roads = gpd.read_file(path, layer="site"), gpd.read_file(path, layer="streets")
    sites = prepare_sites(site, roads).sites
    grammar = shipped_grammar(name)
    real = ground_of_sites(sites, grammar, edge=edge, scale=scale)
    rules = GrowthRules(grammar, scale=scale, iterations=40)
    growth = grow(real.ground, rules)
    layers = growth_layers(growth, real, rules)
    streets, blocks = layers["streets"], layers["blocks"]
    there = streets[streets["status"] == "existing"]
    planned = sum(street.line.length for street in real.streets if street.edge)
    given_length = sum(street.line.length for street in real.streets)
    assert there["length_m"].sum() == pytest.approx(given_length - planned)
    new = streets[streets["status"] == "new"]
    assert new["length_m"].sum() == pytest.approx(growth.steps[-1].length + planned)
    # existing streets lie where they were
    lines = shapely.union_all([street.line for street in real.streets])
    assert (
        shapely.distance(lines, shapely.points(shapely.get_coordinates(there.geometry))).max()
        < 1e-6
    )
    # the domain but for its rim beyond the streets
    domain = real.ground.domain
    missing = domain.area - blocks["area_m2"].sum()
    assert -1.0 < missing < 0.25 * domain.length
    assert shapely.coverage_is_valid(blocks.geometry.to_numpy())
    assert blocks["width_m"].min() > 3.0
    # no block has a tail along the rim: it is hardly shorter when that is cut off
    cut = shapely.buffer(blocks.geometry.to_numpy(), -0.2, join_style="mitre")
    cut = shapely.buffer(cut, 0.2, join_style="mitre")
    assert (shapely.length(cut) > 0.97 * shapely.length(blocks.geometry.to_numpy())).all()
    # what leads nowhere is told
    inner = new["dist_to_sink_m"].isna()
    alone = layers["problems"]["problem"].astype(str).str.contains("not connected")
    assert inner.any() == alone.any()
