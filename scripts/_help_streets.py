"""The pictures of the help of `measurestreets` and `exploretradeoffs`."""

from __future__ import annotations

from matplotlib.axes import Axes
from platwright.explore import explore, grid
from platwright.measure import measure_streets
from platwright.network.specification import Specification

from _help_drawing import GREY, INK, TEAL, ground, mapped, prepared, show, streets

#: Shares of the largest betweenness from which on a street has a colour and a width.
CLASSES = (
    (-1.0, "#3b6ea5", 1.0), (0.01, "#7fb0c9", 1.3), (0.05, "#c9d6b0", 1.7), (0.15, "#f0c572", 2.2),
    (0.3, "#e0803f", 2.8), (0.6, "#b5302a", 3.4),
)  # fmt: skip


def measurestreets(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw streets as they come, and how much runs through them, with junctions and dead ends."""
    streets = mapped()["streets"]
    show(left, streets, color=GREY, linewidth=1.4)
    report = measure_streets(streets)
    share = report.streets["betweenness"] / report.streets["betweenness"].max()
    for at, (low, colour, width) in enumerate(CLASSES):
        show(right, report.streets[share >= low], color=colour, linewidth=width, zorder=at + 1)
    blind = report.nodes["degree"] == 1
    show(right, report.nodes[~blind], color=INK, markersize=4, zorder=9)
    show(right, report.nodes[blind], color=TEAL, marker="s", markersize=9, zorder=9)
    return "streets", "betweenness"


def exploretradeoffs(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw a design with few streets, and one with short ways out."""
    base = Specification(rules="paper", levels=1, edge_length=45.0)
    found = explore(prepared(), grid(base, {"weight_distance": [0.0, 2.0]}))
    for axes, design in zip((left, right), found.designs):
        ground(axes)
        streets(axes, design.layers["streets"])
    return "short streets", "short ways"
