"""Platwright's own grammars make what they say."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
import shapely
from platwright.growth.grammar import STATES
from platwright.growth.grammars.shipped import shipped_grammar
from platwright.growth.grow import grow
from platwright.growth.rules import GrowthRules
from platwright.growth.types import Ground, Start

NORTH = (0.0, 1.0)
SEEDS = range(8)


def grown(name, starts, seed, **limits):
    return grow(Ground(tuple(starts)), GrowthRules(shipped_grammar(name), seed=seed, **limits))


def graph_of(growth):
    return nx.Graph(growth.ends.tolist())


@pytest.mark.parametrize("seed", SEEDS)
def test_a_village_has_a_centre_spokes_and_rings(seed):
    village = grown("radial", [Start((0.0, 0.0), NORTH, STATES["mStart"])], seed, max_segments=999)
    assert "nothing is left" in village.stopped
    assert 80 <= village.grown.sum() <= 130
    assert village.degrees[0] == 6
    graph = graph_of(village)
    away = np.hypot(*village.xy.T) / 100
    # Streets lie around the centre within 2, 4 and 6 units: whoever leaves crosses each ring.
    lines = shapely.linestrings(village.xy[village.ends])
    middle = shapely.Point(0, 0)
    for low, high in ((1.7, 2.3), (3.3, 4.5), (5.1, 6.8)):
        band = middle.buffer(high * 100).difference(middle.buffer(low * 100))
        inside = np.flatnonzero(shapely.covered_by(lines, band.buffer(5)))
        ring = nx.Graph(village.ends[inside].tolist())
        angles = [np.arctan2(*village.xy[node][::-1]) for node in ring]
        gaps = np.diff(np.sort([*angles, min(angles) + 2 * np.pi]))
        assert gaps.max() < np.radians(66), (low, high)
    assert away.max() < 10
    assert nx.is_connected(graph)
    # Blocks: lanes subdivide what rings and spokes make.
    assert graph.number_of_edges() - graph.number_of_nodes() + 1 >= 28


def test_a_village_at_an_existing_road_is_reached_by_a_road():
    leaf = shipped_grammar("radial").leaf
    starts = [Start((0.0, 0.0), NORTH, leaf), Start((1000.0, 0.0), NORTH, leaf)]
    village = grown("radial", starts, 1, max_segments=999)
    # The second start is too near to the first for a village of its own.
    assert village.degrees[1] == 0
    centre = np.flatnonzero(np.hypot(*(village.xy - (0, 700)).T) < 1)
    assert len(centre) == 1
    # The six spokes, and the road that leads in, which is part of nothing else.
    assert village.degrees[centre[0]] == 7
    assert graph_of(village).number_of_nodes() > 50


@pytest.mark.parametrize("seed", SEEDS)
def test_a_suburb_has_collectors_and_culs_de_sac(seed):
    suburb = grown("suburb", [Start((0.0, 0.0), NORTH, STATES["mStart"])], seed, max_segments=600)
    graph = graph_of(suburb)
    assert nx.is_connected(graph)
    used = suburb.degrees[np.unique(suburb.ends)]
    assert 0.12 <= (used == 1).mean() <= 0.35
    # T-junctions are far more than crossings, and there are loops.
    assert (used == 3).sum() > 1.5 * (used >= 4).sum()
    assert graph.number_of_edges() - graph.number_of_nodes() + 1 >= 50
    shares = [suburb.lengths[suburb.edge_type == kind].sum() for kind in "mls"]
    assert shares[0] < shares[1]
    assert shares[0] < shares[2]
    # Small roads are short: no way along them is longer than three streets and what joined them.
    small = suburb.edge_type == "s"
    assert suburb.lengths[small].max() < 240
    for road in np.unique(suburb.road[small]):
        assert (small & (suburb.road == road)).sum() <= 6
