"""Draw the designs of a figure as a small picture."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from _figures_design import Abstract, Planned, sampled
from _small_pictures import saved

#: Height of a panel that is alone, and of several, in inches; dots per inch.
PANEL, SMALL, DPI = 4.6, 2.4, 100
#: No picture is larger (bytes).
MOST = 60_000
INK, PAPER, GRID, STREET = "#2b2b2b", "#fbfaf7", "#dedad0", "#b9b5ad"
SINK, SAMPLE, OBSTACLE, GREEN = "#d01c1c", "#f4c20d", "#9a958c", "#dfe8cf"
LEVELS = {2: ("#b5402c", 3.4), 3: ("#e58a3a", 2.1), 4: ("#5b9a8b", 1.8)}
#: From near to far from a sink.
DISTANCE = plt.get_cmap("viridis_r")


def draw(name: str, designs: list[Abstract | Planned], folder: Path) -> Path:
    """Draw the designs of a figure beside each other; return the picture's path."""
    high = PANEL if len(designs) == 1 else SMALL
    first = designs[0]
    west, south, east, north = (0, 0, 1, 1) if isinstance(first, Abstract) else box_of(first)
    wide = high * (east - west) / (north - south)
    figure, axes = plt.subplots(
        1, len(designs), figsize=(wide * len(designs), high + 0.3), squeeze=False, facecolor=PAPER
    )
    figure.subplots_adjust(left=0.01, right=0.99, bottom=0.02, top=0.91, wspace=0.04)
    farthest = max(d.numbers["farthest"] for d in designs)
    for ax, own in zip(axes[0], designs):
        if isinstance(own, Abstract):
            _abstract(ax, own, farthest)
        else:
            _planned(ax, own)
        ax.set(xticks=[], yticks=[], aspect="equal")
        for side in ax.spines.values():
            side.set(color="#c9c4b8", linewidth=0.8)
    return saved(figure, folder / f"{name}.png", MOST, DPI)


def _abstract(ax: Axes, own: Abstract, farthest: float) -> None:
    """Draw a network on its mesh, coloured by the distance to the nearest sink."""
    mesh, problem = own.problem.mesh, own.problem
    ends = mesh.vertices[mesh.edges]
    ax.add_collection(LineCollection(ends, colors=GRID, linewidths=0.7, zorder=1))
    ax.add_collection(LineCollection(ends[problem.existing], colors=STREET, linewidths=2.2))
    far = own.design.distance[mesh.edges[own.design.active]].max(axis=1)
    colours = DISTANCE(0.1 + 0.9 * far / max(farthest, 1.0))
    ax.add_collection(
        LineCollection(
            ends[own.design.active], colors=colours, linewidths=3.2, capstyle="round", zorder=3
        )
    )
    # with single sinks they are the subject
    size = 9 if problem.sinks.sum() > 10 else 45
    ax.scatter(*mesh.vertices[problem.sinks].T, s=size, color=SINK, zorder=5)
    places = mesh.vertices[sampled(problem)]
    if len(places):
        ax.scatter(*places.T, s=85, color=SAMPLE, edgecolor=INK, linewidth=0.6, zorder=4)
    ax.margins(0.04)
    n = own.numbers
    lead = f"{own.title}   " if own.title else ""
    ax.set_title(
        f"{lead}{n['length']:.0f} edges, mean way {n['mean']:.2f}",
        fontsize=11 if not own.title else 7.5, color=INK,
    )  # fmt: skip


def box_of(own: Planned) -> tuple[float, float, float, float]:
    """Return the ground to show: west, south, east, north."""
    x0, y0, x1, y1 = own.ground["site"].total_bounds
    high = 0.56 * max(x1 - x0, y1 - y0)
    wide = max(0.56 * (x1 - x0), 0.62 * high)
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    return (x - wide, y - high, x + wide, y + high)


def _planned(ax: Axes, own: Planned) -> None:
    """Draw a plan on its ground."""
    box = box_of(own)
    _show(ax, own.given["streets"].clip(box), color=STREET, linewidth=1.6, zorder=1)
    _show(ax, own.ground["site"], facecolor="white", edgecolor=INK, linewidth=0.9, zorder=2)
    _show(ax, own.ground["site_obstacles"], facecolor=OBSTACLE, edgecolor="none", zorder=3)
    streets = own.layers["streets"]
    _show(ax, streets[streets["status"] == "existing"], color=STREET, linewidth=2.4, zorder=3.5)
    new = streets[streets["status"] != "existing"]
    if own.colour == "distance":
        far = new[["dist_start_m", "dist_end_m"]].mean(axis=1)
        _show(ax, new, color=DISTANCE(0.1 + 0.9 * far / own.numbers["farthest"]), linewidth=3.2,
              zorder=5, capstyle="round")  # fmt: skip
        new = new.iloc[:0]
    for level, (colour, width) in sorted(LEVELS.items(), reverse=True):
        chosen = new[new["level"] == level]
        _show(ax, chosen, color="white", linewidth=width + 1.4, zorder=4, capstyle="round")
        _show(ax, chosen, color=colour, linewidth=width, zorder=5, capstyle="round")
    for ring in own.wishes.get("partition", []):
        ax.plot(*np.array([*ring, ring[0]]).T, color="#6a8fb5", linewidth=1.0, linestyle="--",
                zorder=5.5)  # fmt: skip
    for line in own.wishes.get("routes", []):
        ax.scatter(*np.array([line[0], line[-1]]).T, s=60, color="#3d9140", edgecolor="white",
                   zorder=7)  # fmt: skip
    sinks = own.layers["junctions"].query("is_sink")
    if own.wishes.get("sinks"):
        ax.scatter(*np.array(own.wishes["sinks"]).T, s=42, color=SINK, edgecolor="white", zorder=7)
    else:
        _show(ax, sinks, color=SINK, markersize=9, zorder=6)
    ax.set(xlim=(box[0], box[2]), ylim=(box[1], box[3]), facecolor="#f1eee6")
    n = own.numbers
    ax.set_title(f"{n['length']:.0f} m, mean way out {n['mean']:.0f} m", fontsize=9.5, color=INK)
    ax.text(0.99, 0.008, "© OpenStreetMap contributors", fontsize=6, ha="right",
            transform=ax.transAxes, color="#6b6459", zorder=9)  # fmt: skip


def _show(ax: Axes, frame: gpd.GeoDataFrame, **style: object) -> None:
    """Draw a layer unless it is empty."""
    if len(frame):
        frame.plot(ax=ax, **style)
