"""The picture of the help of `designgamelevel`."""

from __future__ import annotations

import geopandas as gpd
from matplotlib.axes import Axes
from platwright.rooms.floors import floors_of
from platwright.rooms.level import design_level
from platwright.rooms.levels import level_layers
from platwright.rooms.rules import RoomRules
from platwright.rooms.shapes import shipped_templates
from shapely.geometry import Polygon

from _help_drawing import BOLD, INK, show

#: An outline with a court.
OUTLINE = Polygon(
    [(0, -35), (70, -35), (70, 60), (45, 60), (45, 100), (0, 100)],
    [[(20, 20), (30, 20), (30, 30), (20, 30)]],
)
ROUTE = "#7d3b2f"


def designgamelevel(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the outline, and the blocks that fill it with the route through them."""
    outline = gpd.GeoDataFrame(geometry=[OUTLINE], crs=32632)
    show(left, outline, facecolor="#efe9dc", edgecolor=INK, linewidth=1.5)
    (floor,) = floors_of(outline, module=5.0)
    rules = RoomRules(time_limit=10.0)
    level = design_level(floor, shipped_templates("caves"), rules, "linear")
    ends = {"start": level.start, "goal": level.goal}
    found = level_layers(level.problem, level.plan, floor.crs, outline.crs, **ends)
    blocks = found["blocks"]
    show(right, blocks, facecolor=blocks["colour"], edgecolor=INK, linewidth=1.2)
    show(right, found["route"], color=ROUTE, linewidth=2.0, zorder=3)
    show(right, found["sinks"], color=ROUTE, markersize=40 / BOLD, zorder=4)
    return "outline", "blocks, route"
