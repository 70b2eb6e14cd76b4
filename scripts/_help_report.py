"""The picture of the help of `designreport`."""

from __future__ import annotations

import geopandas as gpd
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from _help_drawing import GREY, INK, WINDOW, designed, given, show, streets

#: Parts of the sheet: share of its width and height, from its lower left corner.
MAP = (0.07, 0.44, 0.86, 0.42)
ROWS = (0.35, 0.27, 0.19, 0.11)


def designreport(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw the layers of a design, and the sheet about them with its own figures."""
    blocks, ways = designed()["blocks"], designed()["streets"]
    for ax in (left, right):
        show(ax, given("streets"), color="#ddd8ce", linewidth=1.2, zorder=0)
        show(ax, blocks, facecolor="#e4ecd2", edgecolor="none", zorder=1)
        streets(ax, ways)
    west, south, east, north = WINDOW
    wide, high = east - west, north - south
    right.clear()
    page = _Sheet(right, west + 0.07 * wide, south + 0.05 * high, 0.86 * wide, 0.9 * high)
    page.box(0, 0, 1, 1, facecolor="white", edgecolor=GREY, linewidth=1.6)
    page.text(0.07, 0.925, "Report", fontsize=23, fontweight="bold")
    page.box(*MAP, facecolor="#f5f1e8", edgecolor=GREY, linewidth=1.2)
    for frame, style in ((blocks, {"facecolor": "#cfdfae", "edgecolor": "none"}), *_lines(ways)):
        small = page.fitted(frame, given("site").total_bounds, MAP)
        small.plot(ax=right, zorder=3, **style)
    new = ways[ways["status"] != "existing"]
    rows = (
        ("streets", f"{new.length.sum() / 1000:.1f} km"),
        ("blocks", f"{len(blocks)}"),
        ("way out", f"{ways['dist_to_sink_m'].mean():.0f} m"),
        ("dead ends", f"{(designed()['junctions']['kind'] == 'dead end').sum()}"),
    )
    for y, (what, figure) in zip(ROWS, rows):
        page.text(0.07, y, what, fontsize=20)
        page.text(0.93, y, figure, fontsize=20, ha="right")
        page.box(0.07, y - 0.025, 0.86, 0.0, facecolor="none", edgecolor="#ddd8ce", linewidth=1.2)
    return "layers", "one page"


def _lines(ways: gpd.GeoDataFrame) -> list[tuple[gpd.GeoDataFrame, dict[str, object]]]:
    old = ways["status"] == "existing"
    return [
        (ways[old], {"color": GREY, "linewidth": 1.6}),
        (ways[~old], {"color": "#c8442c", "linewidth": 2.0}),
    ]


class _Sheet:
    """A sheet of paper on a map, drawn in shares of its width and height."""

    def __init__(self, ax: Axes, x: float, y: float, width: float, height: float) -> None:
        self.ax, self.x, self.y, self.width, self.height = ax, x, y, width, height

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return a place of the sheet as a place of the map."""
        return self.x + x * self.width, self.y + y * self.height

    def box(self, x: float, y: float, width: float, height: float, **style: object) -> None:
        """Draw a box."""
        size = (width * self.width, height * self.height)
        self.ax.add_patch(Rectangle(self.at(x, y), *size, **style))

    def text(self, x: float, y: float, text: str, **style: object) -> None:
        """Write a text, its lower left corner at a place."""
        self.ax.text(*self.at(x, y), text, **{"color": INK, **style})

    def fitted(
        self,
        frame: gpd.GeoDataFrame,
        bounds: tuple[float, float, float, float],
        part: tuple[float, float, float, float],
    ) -> gpd.GeoSeries:
        """Return features of which those bounds fill a part of the sheet, with a margin."""
        west, south, east, north = bounds
        (x, y), (wide, high) = self.at(*part[:2]), (part[2] * self.width, part[3] * self.height)
        scale = 0.92 * min(wide / (east - west), high / (north - south))
        middle = ((west + east) / 2, (south + north) / 2)
        moved = frame.geometry.translate(x + wide / 2 - middle[0], y + high / 2 - middle[1])
        return moved.scale(scale, scale, origin=(x + wide / 2, y + high / 2))
