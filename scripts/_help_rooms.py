"""The pictures of the help of `designfloor` and `designgamelevel`."""

from __future__ import annotations

import geopandas as gpd
from matplotlib.axes import Axes
from platwright.rooms.design import design_floors
from platwright.rooms.floors import floors_of
from platwright.rooms.level import design_level
from platwright.rooms.levels import level_layers
from platwright.rooms.rules import RoomRules
from platwright.rooms.shapes import shipped_templates
from platwright.rooms.storeys import floor_frames
from shapely.geometry import Point, Polygon, box

from _help_drawing import BOLD, INK, show

#: An outline with a court.
OUTLINE = Polygon(
    [(0, -35), (70, -35), (70, 60), (45, 60), (45, 100), (0, 100)],
    [[(20, 20), (30, 20), (30, 30), (20, 30)]],
)
ROUTE = "#7d3b2f"
#: A house with a shaft and an entrance.
HOUSE = Polygon([(0, -35), (40, -35), (40, 40), (68, 40), (68, 98), (20, 98), (20, 62), (0, 62)])
SHAFT, ENTRANCE = box(20, 2, 28, 10), Point(20, -35)


def designfloor(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw a footprint, and the rooms in it with their corridors and doors."""
    house, shaft, entrance = (
        gpd.GeoDataFrame(geometry=[own], crs=32632) for own in (HOUSE, SHAFT, ENTRANCE)
    )
    show(left, house, facecolor="#efe9dc", edgecolor=INK, linewidth=1.5)
    show(left, shaft, facecolor="#8a857c", edgecolor=INK)
    show(left, entrance, color=ROUTE, markersize=60 / BOLD, zorder=4)
    floors = floors_of(house, module=4.0, obstacles=shaft, sinks=entrance)
    rules = RoomRules(time_limit=15.0, dead_ends=3.0, corridor_width=1.8)
    made = design_floors(floors, shipped_templates("office"), rules)
    found, _ = floor_frames(made, rules.corridor_width, "house")
    rooms = found["rooms"]
    show(right, rooms, facecolor=rooms["colour"], edgecolor=INK, linewidth=0.9)
    show(right, found["obstacles"], facecolor="#8a857c", edgecolor=INK)
    show(right, found["corridors"], facecolor="#ffffff", edgecolor=INK, linewidth=0.5, zorder=2)
    show(right, found["doors"], color=ROUTE, linewidth=2.0, zorder=3)
    show(right, entrance, color=ROUTE, markersize=60 / BOLD, zorder=4)
    return "footprint", "rooms, corridors"


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
