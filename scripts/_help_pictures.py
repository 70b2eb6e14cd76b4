"""Draw the pictures of the tools' help from real results on the shipped samples.

Usage: _help_pictures.py [TOOL ...]. Each picture shows what a tool is given and what it makes of
it, in the colours that the plugin gives its layers: `<tool>.png` in plugin/pictures, as wide as the
help panel of a dialog, and large in docs/images/tools.
"""

from __future__ import annotations

import functools
import io
import sys
from collections.abc import Callable

import geopandas as gpd
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from PIL import Image
from platwright.measure import validate_network
from platwright.mesh import mesh_layers
from platwright.network.specification import Specification
from platwright.parcels.blocks import blocks_from_streets
from platwright.parcels.fill import fill_blocks
from platwright.parcels.layers import parcel_layers
from platwright.parcels.rules import ParcelRules
from platwright.parcels.split import SplitRules, lay_out_sites
from platwright.parcels.split import site_layers as layout_layers
from platwright.parcels.split.improved import Given, improve_layout
from platwright.parcels.split.redo import Around, Asked, covered, redo_parcels
from platwright.site import site_layers
from platwright.streets import (
    Smoothing,
    arriving_streets,
    design_streets,
    plan_layers,
    site_mesh,
    smooth_streets,
)
from shapely.geometry import LineString, box

from _help_buildings import layoutresidential
from _help_city import CITY_WINDOW, designcity
from _help_drawing import (
    DPI,
    GREEN,
    GREY,
    HEIGHT,
    INK,
    LARGE_FOLDER,
    LEVELS,
    MOST,
    PANEL,
    PAPER,
    PLACE,
    SEVERITY,
    SMALL_FOLDER,
    TEAL,
    WIDTH,
    WIDTHS,
    WINDOW,
    designed,
    given,
    ground,
    mapped,
    places,
    prepared,
    raw,
    show,
    streets,
)
from _help_growth import growstreets
from _help_report import designreport
from _help_rooms import designfloor, designgamelevel
from _help_streets import assigntraffic, exploretradeoffs, measurestreets, simulatetraffic


def window(name: str) -> tuple[float, float, float, float]:
    """Return the ground that the picture of a tool shows: west, south, east, north."""
    if not name.startswith(("osm", "measure")):
        return WINDOW
    west, south, east, north = places().geometry.iloc[0].bounds
    high = 1.06 * (north - south)
    wide = high * (WINDOW[2] - WINDOW[0]) / (WINDOW[3] - WINDOW[1])
    x, y = (west + east) / 2, (south + north) / 2
    return (x - wide / 2, y - high / 2, x + wide / 2, y + high / 2)


def preparesite(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the layers as they come, and the site with its boundary streets and access points."""
    raw(left)
    made = site_layers(prepared())
    show(right, made["site"], facecolor="#e4ecd2", edgecolor="#55702f", linewidth=1.6, zorder=1)
    show(right, made["site_obstacles"], facecolor="#9b3a2f33", edgecolor="#9b3a2f", hatch="////",
         lw=0.6, zorder=2)  # fmt: skip
    show(right, made["boundary_streets"], color=INK, linewidth=2.6, zorder=3)
    show(right, made["access_points"], color=TEAL, marker="^", markersize=90, zorder=5)
    return "parcels, roads", "site, access"


def candidatemesh(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the prepared site, and its mesh."""
    (site,) = prepared().sites
    arrivals = arriving_streets(site, 36.0)
    ground(left)
    show(left, site_layers(prepared())["access_points"], color=TEAL, marker="^", markersize=90)
    found = mesh_layers(site_mesh(site, Specification(), arrivals), site.crs, site.source_crs)
    ground(right)
    show(right, found["faces"], facecolor="#f5f1e8", edgecolor="none", zorder=1)
    show(right, found["edges"], color=INK, linewidth=1.1, zorder=2)
    inner = found["vertices"]
    show(right, inner, color=TEAL, markersize=14, zorder=3)
    return "site, access", "candidate mesh"


def designstreets(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the layers as they come, and the streets and blocks."""
    raw(left)
    show(right, given("streets"), color="#ddd8ce", linewidth=1.2, zorder=0)
    low = 0.0
    blocks = designed()["blocks"]
    for high, colour in WIDTHS:
        own = blocks[(blocks["width_m"] >= low) & (blocks["width_m"] < high)]
        show(right, own, facecolor=colour, edgecolor=GREY, linewidth=0.5, zorder=1)
        low = high
    streets(right, designed()["streets"])
    exits = designed()["junctions"]
    show(right, exits[exits["is_sink"]], color=TEAL, edgecolor="white", markersize=44, zorder=6)
    return "site, roads", "streets, blocks"


def smoothstreets(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw a design by the rules of the paper, which is crooked, and the same streets smoothed."""
    crooked = plan_layers(
        design_streets(prepared().sites, Specification(rules="paper", time_limit=20.0))
    )["streets"]
    made = site_layers(prepared())
    smooth = smooth_streets(
        crooked,
        Smoothing(fillet_radius=15.0),
        site=made["site"],
        obstacles=made["site_obstacles"],
    ).streets
    for ax, frame in ((left, crooked), (right, smooth)):
        ground(ax)
        show(ax, made["site_obstacles"], facecolor="#9b3a2f33", edgecolor="#9b3a2f", hatch="////",
             lw=0.6, zorder=2)  # fmt: skip
        old = frame["status"] == "existing"
        show(ax, frame[old], color=GREY, linewidth=2.2, zorder=3)
        show(ax, frame[~old], color=LEVELS[2][0], linewidth=3.0, zorder=4, capstyle="round")
    show(right, crooked[crooked["status"] != "existing"], color="#d9b86a", linewidth=1.2, zorder=3)
    return "crooked streets", "smoothed"


def validatenetwork(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw a design from which a street was taken and to which one was drawn, and the findings."""
    full = designed()["streets"]
    new = full[(full["status"] == "new") & (full["level"] == LOCAL)]
    middle = new.geometry.interpolate(0.5, normalized=True).y.sort_values()
    taken = middle.index[len(middle) // 2]
    lone = new.loc[[new.geometry.length.idxmax()]]
    drawn = lone.assign(geometry=lone.geometry.scale(0.6, 0.6).translate(26.0, 0.0))
    spoilt = pd.concat([full.drop(index=taken), drawn], ignore_index=True)
    made = site_layers(prepared())
    report = validate_network(
        spoilt, site=made["site"], boundary_streets=made["boundary_streets"], coverage_m=75.0
    )
    for ax in (left, right):
        ground(ax)
        streets(ax, spoilt)
    for severity, (marker, colour) in SEVERITY.items():
        own = report.problems[report.problems["severity"] == severity]
        places = own.set_geometry(own.geometry.representative_point())
        show(right, places, color=colour, marker=marker, markersize=110, edgecolor="white",
             linewidth=0.8, zorder=8)  # fmt: skip
    return "any streets", "broken rules"


def parcelblocks(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the streets of a design, and the parcels between them."""
    made = designed()
    blocks = blocks_from_streets(prepared(), made["streets"], snap_distance=60.0)
    plots = blocks.with_thin(fill_blocks(blocks.blocks, ParcelRules()).plots)
    layers = parcel_layers(
        blocks.all_blocks, plots, blocks.all_places, blocks.source_crs, space=blocks.space
    )
    ground(left)
    streets(left, made["streets"])
    show(right, layers["street_space"], color="#e6e2da", zorder=1)
    by_use(right, layers["parcels"])
    return "streets", "parcels"


def by_use(ax: Axes, parcels: gpd.GeoDataFrame) -> None:
    """Draw parcels by what they are."""
    show(ax, given("streets"), color="#ddd8ce", linewidth=1.2, zorder=0)
    for use, colour in USES.items():
        own = parcels[parcels["land_use"] == use]
        show(ax, own, facecolor=colour, edgecolor="#8c867c", linewidth=0.6, zorder=2)


@functools.cache
def laid_out() -> dict[str, gpd.GeoDataFrame]:
    """Lay out streets and parcels of the site together."""
    sites = prepared().sites
    return layout_layers(
        lay_out_sites(sites, ParcelRules(), SplitRules()), sites[0].source_crs, turning=9.0
    )


def splitsite(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the layers as they come, and streets and parcels."""
    raw(left)
    by_use(right, laid_out()["parcels"])
    streets(right, laid_out()["streets"])
    return "site, roads", "streets, parcels"


def resplitlayout(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw a layout with what is chosen, and the same with that made anew."""
    made = laid_out()
    blocks = made["parcel_blocks"]
    low, high = WINDOW[1] + 200, WINDOW[3] - 110
    whole = blocks[blocks.geometry.centroid.y.between(low, high)]
    chosen = covered(made["parcels"], whole)
    asked = Asked("streets", ParcelRules(width=14.0), SplitRules(), seed=2)
    after = redo_parcels(made["parcels"], chosen, asked, Around(streets=made["streets"]))
    for ax, parcels, lines in (
        (left, made["parcels"], made["streets"]), (right, after.parcels, after.streets)
    ):  # fmt: skip
        by_use(ax, parcels)
        streets(ax, lines)
    gone = made["parcels"].loc[chosen]
    new = after.parcels[after.parcels["change"] == "new"]
    for ax, own in ((left, gone), (right, new)):
        show(ax, own, facecolor="#c8442c33", edgecolor="#c8442c", linewidth=0.8, zorder=3)
    return "chosen", "made anew"


def optimiselayout(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw streets as a planner might draw them, with their parcels, and the same improved."""
    west, south, east, _ = WINDOW
    lines = [
        LineString(
            [(west, south + y), ((west + east) / 2, south + y + bow), (east, south + y + rise)]
        )
        for y, bow, rise in DRAWN
    ]
    own = gpd.GeoDataFrame(
        {"level": 3, "status": "new", "width_m": 15.0}, geometry=lines, crs=given("site").crs,
        index=range(len(lines)),
    )  # fmt: skip
    land = gpd.GeoDataFrame(
        geometry=given("site").clip(box(west, south + 40, east, south + 555)).geometry
    )
    own = own.clip(land).explode(ignore_index=True)
    blocks = blocks_from_streets(land, own, edge="open")
    plots = blocks.with_thin(fill_blocks(blocks.blocks, ParcelRules()).plots)
    before = parcel_layers(blocks.all_blocks, plots, blocks.all_places, blocks.source_crs)
    after = improve_layout(Given(own, None, land, edge="open"), ParcelRules())
    pairs = ((left, before["parcels"], own), (right, after.parcels, after.streets))
    for ax, parcels, lines in pairs:
        by_use(ax, parcels[parcels["land_use"] != "parcel"])
        lots = parcels[parcels["land_use"] == "parcel"]
        bad = np.maximum(
            lots["p_angle"].astype(float) / 15, (lots["p_area"].astype(float) - 1) / 0.2
        )
        for low, high, colour in QUALITY:
            some = lots[(bad >= low) & (bad < high)]
            show(ax, some, facecolor=colour, edgecolor="white", linewidth=0.4, zorder=2)
        streets(ax, lines)
    return "before", "improved"


def osmboundary(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the ground, and the boundaries that fit the name by their rank."""
    for ax in (left, right):
        show(ax, mapped()["streets"], color="#ddd8ce", linewidth=1.2, zorder=0)
    own = places()
    show(right, own.iloc[1:], facecolor="#d9b86a55", edgecolor="#b8862b", linewidth=1.4)
    show(right, own.iloc[:1], facecolor="#6f944022", edgecolor="#55702f", linewidth=2.2)
    west, south, east, north = window("osmboundary")
    for rank, point in zip(own["rank"], own.geometry.representative_point()):
        if west < point.x < east and south < point.y < north:
            right.annotate(str(rank), (point.x, point.y), fontsize=24, fontweight="bold",
                           color=INK, ha="center", va="center", zorder=9)  # fmt: skip
    left.text(0.5, 0.5, f"“{PLACE}”", transform=left.transAxes, fontsize=25, ha="center",
              color=INK, bbox={"facecolor": PAPER, "edgecolor": GREY, "pad": 10})  # fmt: skip
    return "a place name", "all that fit"


def osmlayers(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the polygon, and what is mapped around it."""
    area = places().iloc[:1]
    show(left, area, facecolor="#eee9dc", edgecolor=INK, linewidth=1.4)
    found = mapped()
    water = found["obstacles"]["kind"].isin(["water", "sea"])
    show(right, found["obstacles"][water], facecolor="#8fbad1", edgecolor="#4f86a5", linewidth=0.5)
    green = found["obstacles"][~water]
    show(right, green, facecolor="#b3d195", edgecolor=GREEN, linewidth=0.5, zorder=2)
    show(right, found["buildings"], facecolor="#cfc8bd", edgecolor="#8c867c", lw=0.3, zorder=3)
    for level, width in ((4, 0.7), (3, 1.3), (2, 2.0), (1, 2.8)):
        own = found["streets"][found["streets"]["level"] == level]
        show(right, own, color="#6b6459", linewidth=width, zorder=4)
    show(right, found["intersections"], color=INK, markersize=3, zorder=5)
    show(right, area.boundary, color="#c8442c", linewidth=1.2, linestyle="--", zorder=6)
    return "a polygon", "what is mapped"


LOCAL = 3
#: Streets drawn by hand from side to side: height above the lower edge of the picture, how much
#: higher they are in the middle, and in the east (metres).
DRAWN = (
    (105, 6, -4), (185, -5, 3), (252, 4, 9), (332, -3, -8), (398, 8, 4), (470, 0, 12),
)  # fmt: skip
QUALITY = (
    (0, 0.25, "#2b5c9e"), (0.25, 0.5, "#6b9bc9"), (0.5, 0.75, "#c4d8e6"), (0.75, 1, "#f3c9ae"),
    (1, 2, "#dd7f62"), (2, 1e9, "#b5302a"),
)  # fmt: skip
USES = {"parcel": "#f3e3bf", "green": "#b3d195", "court": "#cfe2b4", "lane": "#ddd8ce"}
PICTURES: dict[str, Callable[[Axes, Axes], tuple[str, str]]] = {
    "osmboundary": osmboundary,
    "osmlayers": osmlayers,
    "preparesite": preparesite,
    "candidatemesh": candidatemesh,
    "designstreets": designstreets,
    "exploretradeoffs": exploretradeoffs,
    "designcity": designcity,
    "growstreets": growstreets,
    "smoothstreets": smoothstreets,
    "splitsite": splitsite,
    "parcelblocks": parcelblocks,
    "optimiselayout": optimiselayout,
    "resplitlayout": resplitlayout,
    "layoutresidential": layoutresidential,
    "designfloor": designfloor,
    "designgamelevel": designgamelevel,
    "validatenetwork": validatenetwork,
    "measurestreets": measurestreets,
    "assigntraffic": assigntraffic,
    "simulatetraffic": simulatetraffic,
    "designreport": designreport,
}


#: Pictures of invented ground, with their windows.
OWN = dict.fromkeys(("designfloor", "designgamelevel"), (-5.0, -41.1, 75.0, 106.0))
OWN["designcity"] = CITY_WINDOW


def draw(name: str) -> None:
    """Draw the picture of a tool in both sizes."""
    figure, axes = plt.subplots(1, 2, figsize=(WIDTH, HEIGHT), facecolor=PAPER)
    figure.subplots_adjust(left=0.008, right=0.992, bottom=0.055, top=0.925, wspace=0.025)
    titles = PICTURES[name](*axes)
    west, south, east, north = OWN.get(name) or window(name)
    for ax, title in zip(axes, titles):
        ax.set(xlim=(west, east), ylim=(south, north), xticks=[], yticks=[], facecolor="#ffffff")
        ax.set_aspect("equal")
        ax.set_title(title, fontsize=24, color=INK, pad=9)
        for side in ax.spines.values():
            side.set(color="#c9c4b8", linewidth=1.6)
    if name not in OWN:
        figure.text(0.992, 0.014, "© OpenStreetMap contributors", ha="right", fontsize=17,
                    color="#6b6459")  # fmt: skip
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=DPI, facecolor=PAPER)
    plt.close(figure)
    large = Image.open(buffer).convert("RGB")
    size = (PANEL, round(large.height * PANEL / large.width))
    for folder, image in (
        (LARGE_FOLDER, large),
        (SMALL_FOLDER, large.resize(size, Image.Resampling.LANCZOS)),
    ):
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{name}.png"
        image.save(path, optimize=True)
        if folder == SMALL_FOLDER and path.stat().st_size > MOST:
            sys.exit(f"{path} has {path.stat().st_size} bytes, more than {MOST}")


def main() -> None:
    """Draw all pictures, or those of the tools that are named."""
    for name in sys.argv[1:] or PICTURES:
        draw(name)


if __name__ == "__main__":
    main()
