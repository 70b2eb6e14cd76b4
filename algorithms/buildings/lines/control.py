"""The tree of control lines of each patch, by its patterns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import LineString

from ..rules import LayoutRules
from ..types import (
    CENTRIC,
    DOTTED,
    EMPTY,
    ENCLOSED,
    FACILITY,
    RESIDENCE,
    ROWS,
    SYMMETRICAL,
    BuildingType,
)
from ..zone import ControlLine, Zone
from .centric import centric_lines
from .dotted import dotted_lines
from .draft import Draft, pair, with_room
from .enclosed import enclosed_lines, wished_azimuth
from .facilities import facility_lines
from .need import Need, need_of, turn_between
from .rows import row_lines
from .sides import outward_azimuth, sides_of
from .spines import spine_lines
from .symmetrical import symmetrical_lines

PATTERNS: dict[int, Callable[[Need], list[Draft]]] = {
    ROWS: row_lines,
    CENTRIC: centric_lines,
    ENCLOSED: enclosed_lines,
    SYMMETRICAL: symmetrical_lines,
    DOTTED: dotted_lines,
}


def control_lines(
    zone: Zone, types: Sequence[BuildingType], rules: LayoutRules
) -> tuple[ControlLine, ...]:
    """Draw the control lines of all patches and both uses (RZ section 3.2).

    Each patch with room has one tree: its root and perhaps more lines without buildings say how
    paths run; the leaves carry buildings. Centres may stand anywhere on a leaf, as long as the
    footprint keeps to the patch inset by the setback.

    Parameters
    ----------
    zone
        The ground with its patches and their patterns.
    types
        Kinds of buildings.
    rules
        Sun, setback, distances and steps.

    Returns
    -------
    tuple of ControlLine
        Patch by patch, parents before children; of the leaves, those of facilities have the
        smallest `order`. Wherever a building of a use fits at all, a line is offered to it.
    """
    lines: list[ControlLine] = []
    for number, patch in enumerate(zone.patches):
        drafts: dict[str, list[Draft]] = {}
        need: Need | None = None
        for use, pattern in ((RESIDENCE, patch.residences), (FACILITY, patch.facilities)):
            own = None if pattern == EMPTY else need_of(zone, number, types, rules, use)
            if own is not None:
                draw = facility_lines if use == FACILITY else PATTERNS[pattern]
                drafts[use] = with_room(own, draw(own)) or anywhere(own)
                need = own if need is None else need
        if need is not None and any(drafts.values()):
            lines += _tree(need, drafts, len(lines))
    return tuple(lines)


def anywhere(need: Need) -> list[Draft]:
    """Draw lines where the pattern leaves none: rows, if need be turned to a side of the patch.

    Parameters
    ----------
    need
        The patch and what is asked of it.

    Returns
    -------
    list of Draft
        None only if no building fits with any of those azimuths.
    """
    sun = wished_azimuth(need)
    turned = [
        (azimuth + more) % 360.0
        for part in need.parts
        for side in sides_of(part.exterior)
        for azimuth in [outward_azimuth(side)]
        for more in (0.0, 180.0)
    ]
    ways = [need.facing_deg, *sorted(turned, key=lambda a: round(turn_between(a, sun), 3))]
    needs = [replace(need, facing_deg=way) for way in dict.fromkeys(ways)]
    for each in needs:
        found = row_lines(each)
        if found:
            return found
    for each in needs:
        for size in need.sizes:
            free = each.room.centres(*size)
            if not free.is_empty:
                uv = each.room.local(shapely.get_coordinates(free.representative_point()))
                half = np.array([[-size[0] / 2, 0.0], [size[0] / 2, 0.0]])
                ends = each.room.world(uv + half)
                return [Draft(pair(ends[0]), pair(ends[1]), each.facing_deg)]
    return []


def _tree(need: Need, drafts: dict[str, list[Draft]], root: int) -> list[ControlLine]:
    """Make the tree of a patch whose root gets the given index."""
    spines = spine_lines(need, drafts.get(RESIDENCE, []))
    tree = [
        ControlLine(
            line.start, line.end, line.facing_deg, need.number,
            parent=root if k else -1, leaf=False,
        )
        for k, line in enumerate(spines)
    ]  # fmt: skip
    shapes = np.array([LineString([line.start, line.end]) for line in spines])
    order = 0
    for use in (FACILITY, RESIDENCE):
        own = drafts.get(use, [])
        first = root + len(tree)
        rank = _places(own)
        for k, line in enumerate(own):
            middle = LineString([line.start, line.end]).interpolate(0.5, normalized=True)
            near = int(np.argmin(shapely.distance(shapes, middle)))
            tree.append(
                ControlLine(
                    line.start, line.end, line.facing_deg, need.number, use,
                    parent=root + near, spacing_m=line.spacing_m, order=order + rank[k],
                    mirror=first + line.mirror if line.mirror >= 0 else -1,
                )
            )  # fmt: skip
        order += len(own)
    return tree


def _places(drafts: Sequence[Draft]) -> list[int]:
    """Give each line its number in the order of ranks."""
    order = sorted(range(len(drafts)), key=lambda k: (drafts[k].rank, k))
    place = [0] * len(drafts)
    for at, k in enumerate(order):
        place[k] = at
    return place
