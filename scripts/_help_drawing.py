"""What the pictures of the help share: the samples, what is made of them, and how it is drawn."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import geopandas as gpd
from matplotlib.axes import Axes
from platwright.network.specification import Specification
from platwright.osm import boundaries, osm_layers
from platwright.site import prepare_sites, site_layers
from platwright.streets import design_streets, plan_layers

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "data" / "helsinki" / "helsinki_yard.gpkg"
#: The part of the sample that is shown: west, south, east, north in EPSG:3067.
WINDOW = (385628.0, 6672430.0, 385938.0, 6673000.0)
#: The land of the pictures about OpenStreetMap, in a CRS in metres, and the part that is shown.
EXTRACT = ROOT / "data" / "osm" / "monaco.osm.pbf"
PLACE = "Monte-Carlo"
UTM = "EPSG:32632"
#: Size on paper in inches and dots per inch.
WIDTH, HEIGHT, DPI = 7.2, 7.4, 100
#: Width in the help panel (pixels): what fits in one that was not made wider.
PANEL = 216
#: Lines are this much wider than they would be on a map, to be seen when small.
BOLD = 1.7
LARGE_FOLDER, SMALL_FOLDER = ROOT / "docs" / "images" / "tools", ROOT / "plugin" / "pictures"
#: No picture is larger (bytes), so that the plugin stays small.
MOST = 60_000
PAPER, INK, GREY, GREEN, TEAL = "#fbfaf7", "#4a443b", "#a39d93", "#6f9440", "#2f6f73"
LEVELS = {2: ("#c8442c", 3.6), 3: ("#e58a3a", 2.2), 4: ("#f0b56a", 1.8)}
WIDTHS = ((40, "#f6d7c8"), (60, "#f5ecd2"), (80, "#dfe8c9"), (110, "#c2dbc6"), (1e9, "#a6c8cc"))
SEVERITY = {"error": ("X", "#c00000"), "warning": ("^", "#f0a000"), "info": ("o", "#4f7fb5")}


@functools.cache
def given(name: str) -> gpd.GeoDataFrame:
    """Read a layer of the sample."""
    return gpd.read_file(SAMPLE, layer=name)


@functools.cache
def prepared() -> Any:
    """Prepare the site."""
    return prepare_sites(given("site"), given("streets"), given("obstacles"), snap_distance=60.0)


@functools.cache
def designed() -> dict[str, Any]:
    """Design its streets."""
    specification = Specification(time_limit=20.0)
    return plan_layers(design_streets(prepared().sites, specification))


@functools.cache
def places() -> gpd.GeoDataFrame:
    """Look the place up in the extract."""
    return boundaries(PLACE, source=EXTRACT).to_crs(UTM)


@functools.cache
def mapped() -> dict[str, gpd.GeoDataFrame]:
    """Read the layers around the place from the extract."""
    polygon = places().to_crs("EPSG:4326").geometry.iloc[0]
    layers = osm_layers(polygon, source=EXTRACT)
    return {name: frame.to_crs(UTM) for name, frame in layers.items()}


def show(ax: Axes, frame: gpd.GeoDataFrame, **style: Any) -> None:
    """Draw a layer; nothing where it is empty."""
    for name in ("linewidth", "lw"):
        if name in style:
            style[name] *= BOLD
    if "markersize" in style:
        style["markersize"] *= 2 * BOLD
    if len(frame):
        frame.plot(ax=ax, **style)


def raw(ax: Axes) -> None:
    """Draw the layers as they come."""
    show(ax, given("site"), facecolor="#eee9dc", edgecolor=INK, linewidth=1.2, zorder=1)
    buildings = given("obstacles")
    show(ax, buildings, facecolor="#9b3a2f33", edgecolor="#9b3a2f", hatch="////", lw=0.6, zorder=2)
    show(ax, given("streets"), color=GREY, linewidth=1.4, zorder=3)


def ground(ax: Axes) -> None:
    """Draw the prepared site, pale."""
    show(ax, given("streets"), color="#ddd8ce", linewidth=1.2, zorder=0)
    show(ax, site_layers(prepared())["site"], facecolor="#f5f1e8", edgecolor=GREEN, lw=1.4)


def streets(ax: Axes, frame: gpd.GeoDataFrame) -> None:
    """Draw streets by level, existing ones grey."""
    show(ax, frame[frame["status"] == "existing"], color=GREY, linewidth=2.2, zorder=3)
    for level, (colour, width) in sorted(LEVELS.items(), reverse=True):
        own = frame[(frame["status"] != "existing") & (frame["level"] == level)]
        show(ax, own, color=colour, linewidth=width, zorder=4, capstyle="round")
