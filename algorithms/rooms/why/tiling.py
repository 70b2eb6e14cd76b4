"""Tilings without corridors: whether there are any, and what is left over if not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...mip.linear import LinearModel
from ...mip.solvers import solve_mip
from ...network.cp.ortools_access import cp_model
from ...network.cp.sat import watched
from ..program.cp import whole_limits
from ..program.index import RoomIndex


@dataclass(frozen=True)
class Tiling:
    """What was found of tilings without corridors.

    Attributes
    ----------
    status
        "feasible", "infeasible" or "unknown".
    rooms
        Placements of one tiling.
    gaps
        Faces that it leaves over, where that was allowed.
    broken
        Counts that it breaks, where that was allowed.
    """

    status: str
    rooms: tuple[int, ...] = ()
    gaps: tuple[int, ...] = ()
    broken: tuple[int, ...] = ()


def tile(
    index: RoomIndex,
    *,
    seconds: float,
    by_cp: bool = True,
    counts: bool = True,
    soft_counts: bool = False,
    gaps: bool = False,
    stop: Callable[[], bool] = lambda: False,
) -> Tiling:
    """Tile the floor with rooms (CND eq. 15) without regard to corridors.

    Parameters
    ----------
    index
        The problem.
    seconds
        Limit of time.
    by_cp
        Whether CP-SAT solves it; HiGHS otherwise.
    counts
        Whether limits of numbers and areas hold.
    soft_counts
        Whether they may be broken, as few as possible.
    gaps
        Whether faces may be left over, as few as possible.
    stop
        Asked whether to stop.
    """
    if by_cp:
        return _by_cp(index, seconds, counts, soft_counts, gaps, stop)
    return _by_mip(index, seconds, counts, soft_counts, gaps, stop)


def _by_cp(
    index: RoomIndex,
    seconds: float,
    counts: bool,
    soft_counts: bool,
    gaps: bool,
    stop: Callable[[], bool],
) -> Tiling:
    """Let CP-SAT tile the floor."""
    cp = cp_model()
    model: Any = cp.CpModel()
    room = [model.new_bool_var("") for _ in index.problem.placements.faces]
    spare: dict[int, Any] = {}
    for f in np.flatnonzero(index.problem.floor).tolist():
        row = [room[r] for r in index.by_face[f]]
        if gaps:
            spare[f] = model.new_bool_var("")
            row.append(spare[f])
        model.add_exactly_one(row)
    broken: dict[int, Any] = {}
    for i, rule in enumerate(index.problem.counts if counts or soft_counts else ()):
        rows = []
        for weight, low, high in whole_limits(rule):
            total = cp.LinearExpr.weighted_sum(room, weight.tolist())
            rows.append(model.add(total >= low) if low is not None else model.add(total <= high))
        if soft_counts:
            broken[i] = model.new_bool_var("")
            for row in rows:
                row.only_enforce_if(~broken[i])
    if gaps or soft_counts:
        model.minimize(sum(spare.values()) + sum(broken.values()))
    solver = cp.CpSolver()
    solver.parameters.max_time_in_seconds = seconds
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = 1
    solver.parameters.catch_sigint_signal = False
    status = watched(solver, model, stop)
    if status == cp.INFEASIBLE:
        return Tiling("infeasible")
    if status not in (cp.OPTIMAL, cp.FEASIBLE):
        return Tiling("unknown")
    on = solver.boolean_value
    return Tiling(
        "feasible",
        tuple(r for r, x in enumerate(room) if on(x)),
        tuple(f for f, x in spare.items() if on(x)),
        tuple(i for i, x in broken.items() if on(x)),
    )


def _by_mip(
    index: RoomIndex,
    seconds: float,
    counts: bool,
    soft_counts: bool,
    gaps: bool,
    stop: Callable[[], bool],
) -> Tiling:
    """Let HiGHS tile the floor."""
    model = LinearModel("tiling")
    room = [model.binary() for _ in index.problem.placements.faces]
    spare: dict[int, Any] = {}
    for f in np.flatnonzero(index.problem.floor).tolist():
        row = [(room[r], 1.0) for r in index.by_face[f]]
        if gaps:
            spare[f] = model.binary(1.0)
            row.append((spare[f], 1.0))
        model.row(row, low=1.0, high=1.0)
    broken: dict[int, Any] = {}
    for i, rule in enumerate(index.problem.counts if counts or soft_counts else ()):
        row = [(room[r], float(rule.weight[r])) for r in np.flatnonzero(rule.weight)]
        big = float(rule.weight.sum()) + max(rule.least, 0.0)
        if soft_counts:
            broken[i] = model.binary(1.0)
        if row and math.isfinite(rule.most):
            extra = [(broken[i], -big)] if soft_counts else []
            model.row([*row, *extra], high=rule.most)
        if row and rule.least > 0:
            extra = [(broken[i], big)] if soft_counts else []
            model.row([*row, *extra], low=rule.least)
    model.finish()
    found = solve_mip(model, time_limit=seconds, cancelled=stop)
    if found.values is None:
        return Tiling("infeasible" if found.status == "infeasible" else "unknown")
    values = found.values

    def on(variable: Any) -> bool:
        return values.get(variable.name, 0.0) > 0.5

    return Tiling(
        "feasible",
        tuple(r for r, x in enumerate(room) if on(x)),
        tuple(f for f, x in spare.items() if on(x)),
        tuple(i for i, x in broken.items() if on(x)),
    )
