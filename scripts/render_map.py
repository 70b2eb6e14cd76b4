"""Draw the map of a designed site and print its figures.

Takes the folder with the layers that scripts/demo leaves, and the GeoPackage of the site.
"""

from __future__ import annotations

import json
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path

import geopandas as gpd
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from platwright.measure import PlanMetrics, measure_plan

BLOCK_WIDTH = 72.0
HEADING = "Block width, share of the asked"
INK = "#2b2b2b"
PAPER = "#fbfaf7"
GROUND = "#f1eee6"
LEVELS = {1: ("#7a1f1f", 4.2, "Major street"), 2: ("#b5402c", 3.4, "Collector"),
          3: ("#2d6a9f", 2.1, "Local street"), 4: ("#5b9a8b", 1.8, "Cul-de-sac")}  # fmt: skip
#: Limits of width by height of the mapped ground.
SLIMMEST, WIDEST = 0.72, 1.5
#: Sizes on the sheet in inches.
HIGH, SIDEBAR, EDGE = 10.5, 4.3, 0.35
#: Share of the asked width up to which a block has this colour.
WIDTHS = (
    (0.62, "#f2b8a5", "under 62 %"),
    (0.76, "#f9e2b0", "62 to 76 %"),
    (1.11, "#d9e8bf", "76 to 111 %"),
    (np.inf, "#bcd7e6", "over 111 %"),
)


@dataclass(frozen=True)
class Sheet:
    """The layers of a map, all in one CRS in metres."""

    site: gpd.GeoDataFrame
    surroundings: gpd.GeoDataFrame
    obstacles: gpd.GeoDataFrame
    streets: gpd.GeoDataFrame
    blocks: gpd.GeoDataFrame
    access_points: gpd.GeoDataFrame
    numbers: dict[str, float]
    metrics: PlanMetrics


def load(folder: Path, data: Path) -> Sheet:
    """Read the layers that the demo left."""
    site = read_layer(folder, "site")
    read = {
        name: read_layer(folder, name).to_crs(site.crs)
        for name in ("streets", "blocks", "access_points")
    }
    design, check = (results(folder / f"{t}.json") for t in ("designstreets", "validatenetwork"))
    obstacles = gpd.read_file(data, layer="obstacles").to_crs(site.crs)
    inside = read_layer(folder, "site_obstacles").to_crs(site.crs)
    metrics = measure_plan(
        read["streets"],
        site,
        block_width=BLOCK_WIDTH,
        access_points=read["access_points"],
        obstacles=inside if len(inside) else None,
    )
    numbers = {k: v for k, v in design.items() if isinstance(v, (int, float))}
    numbers["PROBLEMS_FOUND_BY_CHECK"] = check.get("VIOLATIONS", float("nan"))
    return Sheet(
        site=site,
        surroundings=gpd.read_file(data, layer="streets").to_crs(site.crs),
        obstacles=obstacles,
        numbers=numbers,
        metrics=metrics,
        **read,
    )


def read_layer(folder: Path, name: str) -> gpd.GeoDataFrame:
    """Read a layer from the GeoPackage of its name, which holds its style as well."""
    return gpd.read_file(folder / f"{name}.gpkg", layer=name)


def results(path: Path) -> dict[str, float]:
    """Read what qgis_process reported."""
    text = path.read_text(encoding="utf-8")
    return dict(json.loads(text[text.index("{") :]).get("results", {}))


def table(sheet: Sheet) -> list[tuple[str, str]]:
    """Give the figures as pairs of text."""
    m, n = sheet.metrics, sheet.numbers
    rows = [
        ("Site area", f"{m.area:.1f} ha"),
        ("New streets", f"{m.length:.0f} m, {m.length_per_hectare:.0f} m/ha"),
        ("Existing streets continued", f"{m.continued} of {m.arriving}"),
        ("Bends / T-junctions / crossings", f"{m.bends} / {m.t_junctions} / {m.crossings}"),
        ("Blocks, median area", f"{m.blocks}, {m.block_area:.2f} ha"),
        ("Median block width", f"{m.block_width:.0f} m (asked {BLOCK_WIDTH:.0f} m)"),
        ("Blocks 76-111 % of asked width", f"{100 * m.share_wide_enough:.0f} %"),
        ("Blocks under 62 % of asked width", f"{100 * m.share_too_thin:.0f} %"),
        ("Longest block side", f"{m.block_length:.0f} m"),
    ]
    if {"MEAN_DISTANCE", "MAX_DISTANCE"} <= set(n):
        ways = f"{n['MEAN_DISTANCE']:.0f} / {n['MAX_DISTANCE']:.0f} m"
        rows.append(("Way out of the site, mean / longest", ways))
    if "ACHIEVED_GAP" in n:
        rows.append(("Objective, proven bound", f"{n['OBJECTIVE']:.1f}, {n['BOUND']:.1f}"))
        rows.append(("Gap", f"{100 * n['ACHIEVED_GAP']:.1f} %"))
    if "SECONDS" in n:
        rows.append(("Seconds", f"{n['SECONDS']:.1f}"))
    rows.append(("Problems found by the check", f"{n['PROBLEMS_FOUND_BY_CHECK']:.0f}"))
    return rows


def block_colours(blocks: gpd.GeoDataFrame) -> list[str]:
    """Give each block the colour of its width class."""
    width = blocks["width_m"].to_numpy(dtype=float)
    share = width / BLOCK_WIDTH
    return [next(colour for most, colour, _ in WIDTHS if s < most) for s in share]


def draw(ax: Axes, sheet: Sheet) -> None:
    """Draw the layers."""
    window = window_of(sheet)
    around = sheet.surroundings.clip(window)
    around.plot(ax=ax, color="#ffffff", linewidth=5.0, zorder=1, capstyle="round")
    around.plot(ax=ax, color="#b9b5ad", linewidth=2.4, zorder=1.1, capstyle="round")
    sheet.obstacles.clip(window).plot(
        ax=ax, facecolor="#cfe3c0", edgecolor="#8fb37a", linewidth=0.5, zorder=0.5
    )
    if len(sheet.blocks):
        sheet.blocks.plot(
            ax=ax, color=block_colours(sheet.blocks), edgecolor="none", zorder=2, alpha=0.95
        )
    # where an obstacle only touches the site, clipping leaves a point or a line
    sheet.obstacles.clip(sheet.site, keep_geom_type=True).plot(
        ax=ax, facecolor="#a8cd93", edgecolor="#6f9a5a", linewidth=0.6, zorder=2.5
    )
    sheet.site.boundary.plot(ax=ax, color=INK, linewidth=1.4, zorder=3)
    draw_streets(ax, sheet.streets)
    if len(sheet.access_points):
        sheet.access_points.plot(
            ax=ax, color="#f4a300", edgecolor=INK, linewidth=0.7, markersize=34, zorder=6
        )
    ax.set_xlim(window[0], window[2])
    ax.set_ylim(window[1], window[3])
    ax.set_aspect("equal")
    ax.set_facecolor(GROUND)
    ax.set(xticks=[], yticks=[])
    for side in ax.spines.values():
        side.set(color="#c9c4b8", linewidth=0.8)


def window_of(sheet: Sheet) -> tuple[float, float, float, float]:
    """Give the part of the ground to show: the site with a margin, not too slim a sheet."""
    x0, y0, x1, y1 = sheet.site.total_bounds
    margin = 0.08 * max(x1 - x0, y1 - y0)
    wide, high = x1 - x0 + 2 * margin, y1 - y0 + 2 * margin
    wide, high = max(wide, SLIMMEST * high), max(high, wide / WIDEST)
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    return (x - wide / 2, y - high / 2, x + wide / 2, y + high / 2)


def draw_streets(ax: Axes, streets: gpd.GeoDataFrame) -> None:
    """Draw new streets by level, with a light casing."""
    new = streets[streets["status"] != "existing"]
    for number, (colour, width, _) in sorted(LEVELS.items(), reverse=True):
        chosen = new[new["level"] == number]
        if len(chosen):
            chosen.plot(ax=ax, color="white", linewidth=width + 1.8, zorder=4, capstyle="round")
            chosen.plot(ax=ax, color=colour, linewidth=width, zorder=5, capstyle="round")


def scale_bar(ax: Axes) -> None:
    """Draw a scale bar and a north arrow in the lower corners."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    length = max(v for v in (20, 50, 100, 200, 500, 1000) if v <= (x1 - x0) / 4)
    x, y, thick = x0 + 0.03 * (x1 - x0), y0 + 0.035 * (y1 - y0), 0.008 * (y1 - y0)
    for k in range(4):
        corner = x + k * length / 4
        ax.add_patch(
            plt.Rectangle(
                (corner, y), length / 4, thick,
                facecolor=INK if k % 2 == 0 else "white", edgecolor=INK, linewidth=0.8, zorder=9,
            )
        )  # fmt: skip
    for share, unit in ((0, ""), (0.5, ""), (1, " m")):
        ax.text(x + share * length, y + 1.6 * thick, f"{share * length:g}{unit}", ha="center",
                fontsize=9, color=INK, zorder=9)  # fmt: skip
    size = 0.03 * (y1 - y0)
    nx, ny = x1 - 0.05 * (x1 - x0), y1 - 0.1 * (y1 - y0)
    ax.add_patch(
        Polygon([(nx, ny + size), (nx - size / 2.4, ny - size), (nx, ny - size / 2),
                 (nx + size / 2.4, ny - size)], facecolor=INK, zorder=9)
    )  # fmt: skip
    ax.text(nx, ny + 1.25 * size, "N", ha="center", fontsize=12, fontweight="bold", color=INK)


def legend(ax: Axes, sheet: Sheet) -> None:
    """Explain what the colours mean."""
    designed = sheet.streets[sheet.streets["status"] != "existing"]
    present = set(designed["level"])
    handles = [
        Line2D([], [], color=colour, linewidth=width, label=label)
        for number, (colour, width, label) in LEVELS.items()
        if number in present
    ]
    handles += [
        Line2D([], [], color="#b9b5ad", linewidth=2.4, label="Existing street"),
        Line2D([], [], color=INK, linewidth=1.4, label="Site"),
        Line2D([], [], marker="o", color="none", markerfacecolor="#f4a300", markeredgecolor=INK,
               markersize=7, label="Access point"),
        Patch(facecolor="#a8cd93", edgecolor="#6f9a5a", label="Obstacle, stays free"),
        Line2D([], [], color="none", label=HEADING),
    ]  # fmt: skip
    handles += [Patch(facecolor=colour, label=label) for _, colour, label in WIDTHS]
    box = ax.legend(handles=handles, loc="upper left", frameon=False, fontsize=9.5, labelcolor=INK,
              bbox_to_anchor=(0.0, 0.61), handlelength=2.2, labelspacing=0.65)  # fmt: skip
    for text in box.get_texts():
        if text.get_text() == HEADING:
            text.set(weight="bold", x=-30)


def sidebar(ax: Axes, sheet: Sheet, title: str) -> None:
    """Write title, figures and legend beside the map."""
    ax.set_axis_off()
    ax.text(0, 1.0, title, fontsize=19, fontweight="bold", va="top", color=INK)
    m = sheet.metrics
    lead = (
        f"{m.length / 1000:.1f} km of new streets on {m.area:.1f} hectares, chosen by an integer "
        f"program: {m.blocks} blocks, median width {m.block_width:.0f} m."
    )
    ax.text(0, 0.945, textwrap.fill(lead, 52), fontsize=10, va="top", color="#555555")
    for k, (name, value) in enumerate(table(sheet)):
        y = 0.875 - 0.018 * k
        ax.text(0, y, name, fontsize=8.6, color="#555555", va="top")
        ax.text(1, y, value, fontsize=8.6, color=INK, va="top", ha="right", fontweight="bold")
    legend(ax, sheet)
    ax.text(0, 0.0, "Streets and land: © OpenStreetMap contributors (ODbL).\nDesign: Platwright.",
            fontsize=8, color="#777777", va="bottom")  # fmt: skip


def main() -> None:
    """Draw map.png into the folder and print the figures."""
    folder, data = Path(sys.argv[1]), Path(sys.argv[2])
    sheet = load(folder, data)
    names = sheet.site.get("name")
    title = str(names.iloc[0]) if names is not None and names.iloc[0] else "Designed streets"
    x0, y0, x1, y1 = window_of(sheet)
    inner = HIGH - 2 * EDGE
    across = inner * (x1 - x0) / (y1 - y0)
    wide = across + SIDEBAR + 3 * EDGE
    figure = plt.figure(figsize=(wide, HIGH), facecolor=PAPER)
    area = figure.add_axes((EDGE / wide, EDGE / HIGH, across / wide, inner / HIGH))
    draw(area, sheet)
    scale_bar(area)
    side = ((across + 2 * EDGE) / wide, EDGE / HIGH, SIDEBAR / wide, inner / HIGH)
    sidebar(figure.add_axes(side), sheet, title)
    figure.savefig(folder / "map.png", dpi=130, facecolor=PAPER)
    rows = table(sheet)
    width = max(len(name) for name, _ in rows)
    print("\n".join(f"{name:<{width}}  {value}" for name, value in rows))


if __name__ == "__main__":
    main()
