"""The picture of the help of `growstreets`."""

from __future__ import annotations

import functools

import geopandas as gpd
from matplotlib.axes import Axes
from platwright.growth.grammars.shipped import shipped_grammar
from platwright.growth.land.ground import RealGround, ground_of_sites
from platwright.growth.layers import growth_layers
from platwright.growth.onward import grow_on
from platwright.growth.rules import GrowthRules
from platwright.site import prepare_sites

from _help_drawing import given, ground, raw, show

#: What is asked: a unit of the grammar in metres, the largest block (square metres), and the seed.
SCALE, LARGEST, SEED = 50.0, 10_000.0, 5
#: Main, large and small streets in the colours of their style.
TYPES = (("small", "#e58a3a", 2.4), ("large", "#c8442c", 3.2), ("main", "#8e2b1d", 4.0))
GREY = "#a39d93"


@functools.cache
def grown() -> gpd.GeoDataFrame:
    """Let streets grow into the site."""
    grammar = shipped_grammar("organic")
    rules = GrowthRules(grammar, scale=SCALE, iterations=100, seed=SEED)
    layers = (given(name) for name in ("site", "streets", "obstacles"))
    sites = prepare_sites(*layers, snap_distance=60.0, inner_roads="keep").sites
    real: RealGround = ground_of_sites(sites, grammar, scale=SCALE, spacing=0.4 * SCALE)
    return growth_layers(grow_on(real, rules, LARGEST), real, rules)["streets"]


def growstreets(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the layers as they come, and the streets that grew."""
    raw(left)
    ground(right)
    streets = grown()
    show(right, streets[streets["status"] == "existing"], color=GREY, linewidth=2.2, zorder=3)
    for kind, colour, width in TYPES:
        own = streets[streets["road_type"] == kind]
        show(right, own, color=colour, linewidth=width, zorder=4, capstyle="round")
    return "site, roads", "grown streets"
