"""The grid of a patch: rows and columns through entrances and spines, and nodes at the street."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..types import Floats, Ints
from .frame import Mask, covered
from .ground import Ground, roughness
from .lane import Lane
from .layered import Layered
from .net import SNAP_M
from .terminals import Terminal

#: What an oblique meeting with the street costs more, metres.
OBLIQUE = 6.0
#: Nodes this near to street space cost more, since the pavement is there, metres; by this factor.
PAVEMENT_M, PAVEMENT = 3.0, 1.5
#: Nodes this much nearer to buildings than they must be cost more, metres; by this factor.
TIGHT_M, TIGHT = 1.0, 1.1


@dataclass(frozen=True, eq=False)
class Exits:
    """States that lead into the street.

    Attributes
    ----------
    state
        Node * 2 + axis, shape (k,).
    point
        Where the path meets street space, metres, shape (k, 2).
    cost
        What the last step costs without the price of an exit, metres, shape (k,).
    """

    state: Ints
    point: Floats
    cost: Floats


def _filled(wanted: Sequence[float], low: float, high: float, step: float) -> Floats:
    """Give coordinates from low to high, the wanted ones among them, at most a step apart."""
    fixed = np.unique(np.round([v for v in wanted if low < v < high], 6))
    if len(fixed):
        fixed = fixed[np.r_[True, np.diff(fixed) > 1e-3]]
    ends = np.r_[low, fixed, high]
    parts = [
        np.linspace(a, b, max(2, int(np.ceil((b - a) / step)) + 1))[:-1]
        for a, b in zip(ends, ends[1:])
        if b - a > 1e-3
    ]
    return np.concatenate([*parts, [high]])


def _beside(lane: Lane) -> Floats:
    """Give corners just over the clearance outside the bounds of each building."""
    across = np.column_stack([-lane.along[:, 1], lane.along[:, 0]])
    reach = np.abs(lane.along) * lane.half[:, :1] + np.abs(across) * lane.half[:, 1:]
    reach = reach + lane.clearance_m + 0.01
    return np.concatenate([lane.centre - reach, lane.centre + reach])


def _gaps(terminals: Sequence[Terminal]) -> list[Floats]:
    """Give points half-way between neighbours in rows: the middle of gaps between like ones."""
    feet = [[stub[1] for stub in t.stubs] for t in terminals if t.square and len(t.stubs) > 1]
    return [(np.array(row[1:]) + np.array(row[:-1])) / 2 for row in feet]


def grid_of(
    lane: Lane, terminals: Sequence[Terminal], step_m: float, *, narrow: bool = False
) -> Ground:
    """Lay a grid over a patch.

    Parameters
    ----------
    lane
        The patch with its buildings.
    terminals
        Where ways begin: rows and columns pass through their ends.
    step_m
        Largest distance of rows and columns, metres.
    narrow
        Whether rows and columns also run as near as they may beside each building, so that no
        passage between square ones is missed.
    """
    want = [line for t in terminals if t.square for line in t.stubs]
    if narrow:
        want.append(_beside(lane))
    want += [t.spine for t in terminals if t.square and t.spine is not None]
    points = np.concatenate([*want, *_gaps(terminals)]) if want else np.zeros((0, 2))
    x0, y0, x1, y1 = lane.polygon.bounds
    xs = _filled(points[:, 0].tolist(), x0 - 0.01, x1 + 0.01, step_m)
    ys = _filled(points[:, 1].tolist(), y0 - 0.01, y1 + 0.01, step_m)
    grid_x, grid_y = np.meshgrid(xs, ys)
    shapely.prepare(lane.ground)
    shapely.prepare(lane.polygon)
    free = shapely.contains_xy(lane.ground, grid_x, grid_y)
    free &= ~covered(xs, ys, lane.centre, lane.along, lane.half, lane.clearance_m)
    # A node that nearly is an exit would be one with it.
    edge = lane.access.buffer(2 * SNAP_M)
    shapely.prepare(edge)
    free[free] = ~shapely.contains_xy(edge, grid_x[free], grid_y[free])
    inside = shapely.contains_xy(lane.polygon, grid_x, grid_y)
    closed = ~inside | covered(xs, ys, lane.centre, lane.along, lane.half)
    strip = lane.access.buffer(3 * step_m, cap_style="flat")
    shapely.prepare(strip)
    street = ~inside
    street[street] = shapely.contains_xy(strip, grid_x[street], grid_y[street])
    return Ground(xs, ys, free, roughness(xs, ys, closed, street), _cut(lane, xs, ys, free, step_m))


def _cut(lane: Lane, xs: Floats, ys: Floats, free: Mask, step_m: float) -> tuple[Mask, Mask]:
    """Find steps that leave the patch round a corner of the street; walls keep their distance."""
    strip = lane.access.buffer(step_m)
    shapely.prepare(strip)
    row, column = np.nonzero(free)
    near = np.zeros_like(free)
    near[row, column] = shapely.contains_xy(strip, xs[column], ys[row])
    cut = np.zeros((len(ys), len(xs) - 1), dtype=bool), np.zeros((len(ys) - 1, len(xs)), dtype=bool)
    for axis, doubt in enumerate((near[:, :-1] & near[:, 1:], near[:-1] & near[1:])):
        r, c = np.nonzero(doubt)
        ahead = (r, c + 1) if axis == 0 else (r + 1, c)
        ends = [np.column_stack([xs[j], ys[i]]) for i, j in ((r, c), ahead)]
        if len(r):
            steps = shapely.linestrings(np.stack(ends, axis=1))
            cut[axis][r, c] = ~shapely.covers(lane.polygon, steps)
    return cut


def exits_of(lane: Lane, graph: Layered, step_m: float) -> Exits:
    """Find the states that lead into the street, RZ's exit grids.

    A way leaves along its own direction; a last turn is paid by reaching the node along the
    other axis.

    Parameters
    ----------
    lane
        The patch.
    graph
        Its states.
    step_m
        Largest distance of rows and columns, metres.
    """
    reach = 1.55 * step_m
    strip = lane.access.buffer(reach)
    shapely.prepare(strip)
    near = np.flatnonzero(shapely.contains_xy(strip, graph.at[:, 0], graph.at[:, 1]))
    at = graph.at[near]
    ground = graph.ground
    tight = covered(
        ground.xs, ground.ys, lane.centre, lane.along, lane.half, lane.clearance_m + TIGHT_M
    )
    graph.factor[tight[ground.free]] *= TIGHT
    if not len(near):
        return Exits(np.zeros(0, dtype=np.int64), np.zeros((0, 2)), np.zeros(0))
    square = shapely.distance(shapely.points(at), lane.access)
    graph.factor[near[square < PAVEMENT_M]] *= PAVEMENT
    states, points, costs = [], [], []
    for axis in (0, 1):
        for sign in (-1.0, 1.0):
            ray = np.zeros(2)
            ray[axis] = sign * reach
            step = shapely.linestrings(np.stack([at, at + ray], axis=1))
            hit = shapely.shortest_line(shapely.points(at), shapely.intersection(step, lane.access))
            # An empty meeting gives no line.
            met = np.array([h is not None and not h.is_empty for h in hit])
            if not met.any():
                continue
            end = shapely.get_coordinates(hit[met]).reshape(-1, 2, 2)[:, 1]
            length = np.hypot(*(end - at[met]).T)
            lean = 1 - np.minimum(1.0, square[met] / np.maximum(length, 1e-9))
            states.append(near[met] * 2 + axis)
            points.append(end)
            costs.append(length + OBLIQUE * np.where(length > 0.05, lean, 0.0))
    state, point, cost = np.concatenate(states), np.concatenate(points), np.concatenate(costs)
    order = np.lexsort([cost, state])
    first = order[np.r_[True, np.diff(state[order]) != 0]]
    return Exits(state[first], point[first], cost[first])
