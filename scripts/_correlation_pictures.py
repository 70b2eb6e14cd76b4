"""Plans of scenarios coloured by their traffic (CND figure 8), and the plot of what agrees."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

from _correlation_study import Row
from _small_pictures import saved

#: Vehicles per hour from which on streets have a colour and a width.
CLASSES = (
    (0.02, "#3f6ea6", 0.9), (2.0, "#7fb0cf", 1.1), (5.0, "#c9d6ae", 1.4), (10.0, "#f0c46c", 1.8),
    (20.0, "#e0803e", 2.3), (40.0, "#b5302a", 2.9),
)  # fmt: skip
QUIET, GROUND, INK, PAPER = "#cdc8be", "#f2eee4", "#2b2b2b", "#fbfaf7"
OUT, WITHIN = "#3f6ea6", "#b5302a"
#: Metres around the site that plans show; panels in a row; most bytes of a picture.
AROUND, COLUMNS, MOST = 60.0, 3, 300_000


def plans(found: list[Row], asked: dict[str, Any], path: Path) -> None:
    """Draw the plan of each scenario with the trips within it."""
    designs = [row for row in found if row.has_exits]
    west, south, east, north = designs[0].ground.total_bounds
    window = (west - AROUND, south - AROUND, east + AROUND, north + AROUND)
    wide, high = window[2] - window[0], window[3] - window[1]
    across = COLUMNS if wide < 2 * high else 2
    down = math.ceil(len(designs) / across)
    panel = 11.4 / across
    figure, axes = plt.subplots(
        down, across, figsize=(11.6, down * (panel * high / wide + 0.52) + 0.6), facecolor=PAPER
    )
    for axis, row in zip(axes.ravel(), designs):
        _plan(axis, row, window)
    names = [*(f"{low:g}" for low, _, _ in CLASSES[1:])]
    labels = [
        f"under {names[0]}", *(f"{a} to {b}" for a, b in zip(names, names[1:])),
        f"{names[-1]} and more",
    ]  # fmt: skip
    handles = [Line2D([], [], color=c, linewidth=w * 1.5) for _, c, w in CLASSES]
    figure.legend(
        handles,
        labels,
        ncols=len(labels),
        loc="lower center",
        frameon=False,
        fontsize=9,
        title_fontsize=9,
        title="vehicles per hour, trips within",
    )
    figure.text(0.994, 0.004, asked["credit"], ha="right", fontsize=7, color="#6b6459")
    figure.tight_layout(rect=(0, 0.55 / figure.get_figheight(), 1, 1), h_pad=1.2)
    saved(figure, path, MOST)


def _plan(axis: Axes, row: Row, window: tuple[float, float, float, float]) -> None:
    """Draw one scenario."""
    row.ground.plot(ax=axis, color=GROUND)
    row.streets.plot(ax=axis, color=QUIET, linewidth=0.8)
    for at, (low, colour, width) in enumerate(CLASSES):
        own = row.streets[row.streets["flow_veh_h"] >= low]
        if len(own):
            own.plot(ax=axis, color=colour, linewidth=width, zorder=3 + at)
    out, within = row.kinds["out"], row.kinds["within"]
    axis.set(xlim=window[::2], ylim=window[1::2], xticks=[], yticks=[], aspect="equal")
    axis.set_title(
        f"{row.name}: {row.says}\nL {row.length:,.0f} m, out {out.driven_metres:.0f} m, "
        f"within {within.driven_metres:.0f} m",
        fontsize=9, color=INK,
    )  # fmt: skip
    for side in axis.spines.values():
        side.set(color="#c9c4b8", linewidth=0.8)


def scatter(found: list[Row], asked: dict[str, Any], path: Path) -> None:
    """Draw what was promised against what SUMO measured."""
    designs = [row for row in found if row.has_exits]
    figure, axes = plt.subplots(1, 2, figsize=(9.0, 4.2), facecolor=PAPER)
    pairs = (
        ("Ways out", "d of the program, m", OUT, [
            (row.name, row.distance, row.kinds["out"].driven_metres) for row in designs
        ]),
        ("Ways within", "as assigned, m", WITHIN, [
            (row.name, row.kinds["within"].metres, row.kinds["within"].driven_metres)
            for row in found
        ]),
    )  # fmt: skip
    for axis, (title, label, colour, points) in zip(axes, pairs):
        xy = np.array([point[1:] for point in points])
        low, high = 0.9 * xy.min(), 1.06 * xy.max()
        axis.plot([low, high], [low, high], color=QUIET, linewidth=1.0, zorder=0)
        axis.scatter(*xy.T, color=colour, s=34)
        for name, x, y in points:
            axis.annotate(name, (x, y), (6, -3), textcoords="offset points", fontsize=10, color=INK)
        axis.set(title=title, xlabel=label, ylabel="in SUMO, m", xscale="log", yscale="log",
                 xlim=(low, high), ylim=(low, high), facecolor=PAPER)  # fmt: skip
        for one in (axis.xaxis, axis.yaxis):
            one.set_major_formatter("{x:.0f}")
            one.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 5.0, 7.0)))
            one.set_minor_locator(NullLocator())
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
    figure.suptitle(asked["says"].partition(":")[0], fontsize=11, color=INK)
    figure.tight_layout()
    saved(figure, path, MOST)
