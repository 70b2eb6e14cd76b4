"""Where growth begins: the starts become nodes."""

from __future__ import annotations

from math import hypot

from ...errors import InputError
from ...progress import Progress
from ..rules import GrowthRules
from ..types import Ground, Start
from .builder import Builder
from .choose import CODE, NO_STATE


def begin(ground: Ground, rules: GrowthRules, builder: Builder, progress: Progress) -> None:
    """Give the nodes where growth begins their states.

    A start that lies on a street of the ground becomes a node of it. Of several starts at one
    place the first counts.

    Parameters
    ----------
    ground
        With the starts.
    rules
        For the length of streets.
    builder
        Its `fresh` holds the nodes afterwards.
    progress
        Told of starts that cannot be used, and of a domain that is very small.

    Raises
    ------
    InputError
        If there is no start, or all lie outside of the domain.
    """
    if not ground.starts:
        raise InputError(
            "There is no place where growth begins.",
            "Give a point, or streets with loose ends or junctions inside the ground.",
        )
    inside = [start for start in ground.starts if builder.walls.inside(*start.xy)]
    outside = [start for start in ground.starts if not builder.walls.inside(*start.xy)]
    if not inside:
        raise InputError(
            f"{_named(outside)} outside of the ground that streets may grow into.",
            "Move it inside, or choose another polygon.",
        )
    if outside:
        progress.warn(
            f"{_named(outside)} outside of the ground that streets may grow into; "
            f"growth begins at the other {len(inside):,}."
        )
    if ground.domain is not None:
        left, bottom, right, top = ground.domain.bounds
        longest, size = rules.grammar.longest * rules.scale, hypot(right - left, top - bottom)
        if longest > size:
            progress.warn(
                f"The ground is {size:,.0f} m across, but streets of the grammar are up to "
                f"{longest:,.0f} m long. Choose a smaller scale."
            )
    for start in inside:
        _settle(start, builder)


def _settle(start: Start, builder: Builder) -> None:
    """Make a node of a start, unless growth begins there already."""
    columns = builder.columns
    x, y = start.xy
    node = start.node
    if node < 0:
        node = columns.nearest(x, y, builder.tolerance, but=-1, bends=True)
    if node < 0:
        foot = columns.foot(x, y, builder.tolerance, but=-1)
        if foot is None:
            node = columns.add_node(x, y, 0)
        else:
            node = columns.add_node(foot[1], foot[2], 0)
            columns.split(foot[0], node)
    if columns.state[node] != NO_STATE:
        return
    length = hypot(*start.direction)
    way = (start.direction[0] / length, start.direction[1] / length)
    columns.bend[node] = False
    builder.live(node, CODE[start.state], way, 0)


def _named(starts: list[Start]) -> str:
    """Name some starts by their positions, as the beginning of a sentence."""
    places = ", ".join(f"({x:,.1f}, {y:,.1f})" for x, y in (s.xy for s in starts[:3]))
    more = f" and {len(starts) - 3:,} more" if len(starts) > 3 else ""
    return f"The starts at {places}{more} lie" if len(starts) > 1 else f"The start at {places} lies"
