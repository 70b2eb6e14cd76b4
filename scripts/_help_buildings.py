"""The picture of the help of `layoutresidential`."""

from __future__ import annotations

import functools

import geopandas as gpd
from matplotlib.axes import Axes
from platwright.buildings.corridors import zone_of_site
from platwright.buildings.design import lay_out
from platwright.buildings.layers import zone_layers
from platwright.buildings.rules import LayoutRules
from platwright.buildings.tables import shipped_types
from platwright.buildings.tables.patches import PatchChoice
from platwright.buildings.types import ENCLOSED

from _help_drawing import BOLD, INK, designed, ground, prepared, show

#: As the style of the layer has them.
STREET, GREEN, PATH, TREE, BAY = "#e2ded6", "#d9e6c3", "#f6efdd", "#93b67d", "#c9c6cf"
USES = {"residence": "#e29a6b", "facility": "#7f9fc4"}


def _new() -> gpd.GeoDataFrame:
    streets = designed()["streets"]
    return streets[streets["status"] != "existing"]


@functools.cache
def laid() -> dict[str, gpd.GeoDataFrame]:
    """Lay buildings out between the designed streets."""
    rules = LayoutRules(far=1.2, density=0.3, method="staged")
    (site,) = prepared().sites
    choice = PatchChoice(residences=ENCLOSED)
    zone, _ = zone_of_site(site, corridors=_new(), choice=choice)
    found: dict[str, gpd.GeoDataFrame] = zone_layers(
        [lay_out(zone, shipped_types("mixed"), rules)], rules
    )
    return found


def layoutresidential(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the zone with its corridors, and the buildings between them."""
    ground(left)
    show(left, _new(), color="#c8442c", linewidth=2.2, zorder=3)
    ground(right)
    found = laid()
    for row in found["corridors"].itertuples():
        show(right, gpd.GeoDataFrame(geometry=[row.geometry.buffer(row.width_m / 2)]),
             facecolor=STREET, zorder=1)  # fmt: skip
    show(right, found["green"], facecolor=GREEN, zorder=2)
    show(right, found["paths"], color=PATH, linewidth=1.6, zorder=3)
    show(right, found["parking"], facecolor=BAY, zorder=3)
    show(right, found["shadows"], facecolor="#4a445b2e", zorder=4)
    show(right, found["trees"], color=TREE, markersize=5 / BOLD, zorder=5)
    for use, colour in USES.items():
        own = found["buildings"][found["buildings"]["use"] == use]
        show(right, own, facecolor=colour, edgecolor=INK, linewidth=0.5, zorder=6)
    return "zone, corridors", "buildings"
