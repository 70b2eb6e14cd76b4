"""Paths of a zone: from every entrance to street space (RZ sections 3.3 and 4.2)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ...errors import CancelledError
from ...progress import Progress
from ..layout import Path, PathPlan
from ..rules import LayoutRules
from ..shape import entrances, frames
from ..types import CIRCLE, BuildingType, Floats, Placements
from ..zone import ControlLine, Patch, Zone
from .finish import Finished, finish
from .ground import Prices
from .grow import Grower
from .lane import Lane, lane_of
from .layered import Layered
from .meshwork import exits_of, grid_of
from .net import Net
from .style import style_of
from .terminals import Terminal, terminals_of

#: Distance of rows and columns of the grid, metres; where someone is not reached, the finer one.
STEP_M, FINE_M = 1.5, 0.4


def plan_paths(
    zone: Zone,
    types: Sequence[BuildingType],
    rules: LayoutRules,
    lines: Sequence[ControlLine],
    placed: Placements,
    progress: Progress | None = None,
) -> PathPlan:
    """Plan the paths of a zone.

    Entrances of a row are joined by a path along them; rows are joined to the street or to a path
    that leads there, whichever costs less by G = L + N + E (RZ section 3.3), so that exits are
    shared. The path pattern of a patch says how: direct ways, a spine with branches that end at
    buildings, or loops.

    Parameters
    ----------
    zone
        The ground.
    types
        Kinds of buildings.
    rules
        `path_m` is the width of paths.
    lines
        Control lines; those that are not leaves are followed where that is hardly longer.
    placed
        Where buildings stand.
    progress
        Asked for cancellation many times a second.

    Returns
    -------
    PathPlan

    Raises
    ------
    CancelledError
        If the caller cancels.
    """

    def watch() -> None:
        if progress is not None and progress.cancelled():
            raise CancelledError("Cancelled while paths were planned.")

    n = len(placed)
    reached, length = np.zeros(n, dtype=bool), np.zeros(n)
    turns, roomy, share = np.zeros(n), np.zeros(n), np.zeros(n)
    paths: list[Path] = []
    for patch in np.unique(placed.patch):
        watch()
        here = np.flatnonzero(placed.patch == patch)
        done = _planned(zone, types, rules, lines, placed.take(here), int(patch), watch)
        paths += [
            dataclasses.replace(p, buildings=tuple(int(here[i]) for i in p.buildings))
            for p in done.paths
        ]
        reached[here], length[here] = done.reached, done.length_m
        turns[here], roomy[here] = done.turns, done.roomy
        out = np.asarray(done.exit)
        users = np.bincount(out[out >= 0], minlength=1)
        share[here] = [1.0 / users[e] if e >= 0 else 0.0 for e in out]
    return PathPlan(tuple(paths), reached, length, turns, roomy, share)


def _planned(
    zone: Zone,
    types: Sequence[BuildingType],
    rules: LayoutRules,
    lines: Sequence[ControlLine],
    placed: Placements,
    index: int,
    watch: Callable[[], None],
) -> Finished:
    """Plan the paths of one patch."""
    patch = zone.patches[index]
    lane = lane_of(patch, types, rules, placed)
    terminals = terminals_of(lane)
    ahead = [_ahead(lane, patch, lines, placed, t) for t in terminals]
    guides = [
        lane.frame.inward(np.array([line.start, line.end]))
        for line in lines
        if line.patch == index and not line.leaf
    ]
    prices = Prices()
    style = style_of(patch.paths, prices)
    net = Net()
    todo = list(range(len(terminals)))
    first = None
    # No step may be so long that it passes through the corner of a building.
    for step in (min(STEP_M, max(rules.path_m / 2, FINE_M)), FINE_M):
        watch()
        ground = grid_of(lane, terminals, step, narrow=step == FINE_M)
        graph = Layered(ground, prices)
        exits = exits_of(lane, graph, step)
        grower = Grower(lane, graph, exits, style, step, net, watch)
        inside = bool(patch.path_direction) if patch.paths == CIRCLE else None
        grower.prepare(terminals, guides, inside)
        grower.grow([terminals[k] for k in todo], [ahead[k] for k in todo])
        if first is None:
            first = ground
        todo = [k for k in todo if not grower.connected(terminals[k])]
        if style.loops:
            grower.close_loops(terminals)
        if not todo:
            break
    doors = np.zeros(len(placed), dtype=int)
    for t in terminals:
        for member, stub in zip(t.members, t.stubs):
            doors[member] = net.node(stub[0])
    point, _ = entrances(types, placed)
    return finish(lane, net, first or ground, [int(d) for d in doors], index, point)


def _ahead(
    lane: Lane, patch: Patch, lines: Sequence[ControlLine], placed: Placements, terminal: Terminal
) -> Floats:
    """Give the side on which a row likes its exit: along its control line, or against it."""
    member = terminal.members[0]
    sign = 1.0 if patch.path_direction else -1.0
    k = int(placed.line[member])
    if 0 <= k < len(lines) and lines[k].length > 0:
        along = np.subtract(lines[k].end, lines[k].start) / lines[k].length
    else:
        along = frames(placed.take([member]))[0][0]
    return np.asarray(lane.frame.turned(sign * along))
