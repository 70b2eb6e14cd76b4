"""The picture of the help of `designcity`."""

from __future__ import annotations

import geopandas as gpd
from matplotlib.axes import Axes
from platwright.city import city_layers, design_city, divide_city
from platwright.network.specification import Specification
from shapely.geometry import LineString, Polygon, box

from _help_drawing import BOLD, INK, show

#: A corner where EPSG:32632 is true to scale; the ground of the picture from there.
X, Y, WIDE, HIGH = 500_000.0, 5_200_000.0, 1000.0, 1838.0
CITY_WINDOW = (X, Y, X + WIDE, Y + HIGH)
#: Major roads of an invented town, and its lake.
ROADS = (
    ("primary", [(-50, 640), (380, 700), (640, 860), (1050, 930)]),
    ("primary", [(-50, 662), (372, 723), (632, 882), (1050, 953)]),
    ("secondary", [(430, -50), (400, 300), (378, 700), (370, 722), (470, 1250), (430, 1900)]),
    ("tertiary", [(-50, 1230), (470, 1250), (1050, 1330)]),
    ("residential", [(180, 680), (160, 760)]),
    ("residential", [(180, 660), (190, 560)]),
)
LAKE = [(640, 180), (760, 120), (900, 200), (880, 340), (760, 400), (650, 320)]
NEW = {2: ("#c8442c", 2.4), 3: ("#e58a3a", 1.5), 4: ("#f0b56a", 1.2)}


def designcity(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw major roads with the junctions planned along them, and the streets between them."""
    lines = [LineString([(X + x, Y + y) for x, y in xy]) for _, xy in ROADS]
    roads = gpd.GeoDataFrame({"highway": [k for k, _ in ROADS]}, geometry=lines, crs=32632)
    lake = gpd.GeoDataFrame(geometry=[Polygon([(X + x, Y + y) for x, y in LAKE])], crs=32632)
    town = gpd.GeoDataFrame(geometry=[box(*CITY_WINDOW).buffer(40)], crs=32632)
    city = divide_city(town, roads, lake)
    found = city_layers(design_city(city, Specification()))
    major = roads[roads["highway"] != "residential"]
    for ax in (left, right):
        show(ax, found["sub_regions"], facecolor="#f6f1e6", edgecolor="none")
        show(ax, lake, facecolor="#a9cbdc", edgecolor="#4f86a5")
        show(ax, major, color=INK, linewidth=3.0, zorder=3)
    show(left, found["junctions"], color="#2f6f73", markersize=34 / BOLD, zorder=4)
    streets = found["streets"][found["streets"]["status"] != "existing"]
    for level, (colour, width) in NEW.items():
        show(right, streets[streets["level"] == level], color=colour, linewidth=width, zorder=2)
    return "roads, junctions", "streets"
