"""Rooms in a mixed-integer program, for machines without CP-SAT."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...network.mip.model import NetworkModel
from ...network.problem import BoolArray
from .index import RoomIndex
from .parts import PartCut, touched_by
from .treasures import add_linear_treasures


@dataclass(eq=False)
class LinearRooms:
    """Adds rooms to a linear model of a network (CND eq. 15-17, CND-x eq. 19-20).

    Attributes
    ----------
    index
        The rooms.
    fixed
        Whether a placement is chosen, for those that are decided already.
    cuts
        What forbids blocks that the route crosses in several parts.
    room
        Variable of each placement, filled by `add`.
    """

    index: RoomIndex
    fixed: dict[int, bool] = field(default_factory=dict)
    cuts: list[PartCut] = field(default_factory=list)
    room: list[Any] = field(default_factory=list)

    def add(self, model: NetworkModel) -> None:
        """Add variables and rows; to be called once, before the model is finished."""
        problem, linear = self.index.problem, model.linear
        self.room = [linear.binary() for _ in problem.placements.faces]
        for r, value in self.fixed.items():
            linear.row([(self.room[r], 1.0)], low=float(value), high=float(value))
        for f in np.flatnonzero(problem.floor).tolist():
            linear.row([(self.room[r], 1.0) for r in self.index.by_face[f]], low=1.0, high=1.0)
        if problem.kind == "floor":
            self._floor(model)
        else:
            self._level(model)
        for cut in self.cuts:
            row = [(self.room[cut.room], 1.0), *((model.edge[e], 1.0) for e in cut.on)]
            linear.row([*row, *((model.edge[e], -1.0) for e in cut.out)], high=2.0)
        for rule in problem.counts:
            row = [(self.room[r], float(rule.weight[r])) for r in np.flatnonzero(rule.weight)]
            if row and (rule.least > 0 or math.isfinite(rule.most)):
                linear.row(row, low=rule.least if rule.least > 0 else -math.inf, high=rule.most)
        add_linear_treasures(model, self.index, self.room)

    def _floor(self, model: NetworkModel) -> None:
        """At most one of an edge and the rooms around it; a corridor along each room."""
        for e, x in model.edge.items():
            row = [(self.room[r], 1.0) for r in self.index.by_inner[e]]
            if row:
                model.linear.row([*row, (x, 1.0)], high=1.0)
        for r, rim in enumerate(self.index.problem.placements.rim):
            along = [(model.edge[e], 1.0) for e in rim if e in model.edge]
            model.linear.row([*along, (self.room[r], -1.0)], low=0.0)

    def _level(self, model: NetworkModel) -> None:
        """Demand a route through each block, and only inside blocks."""
        for e, x in model.edge.items():
            row = [(self.room[r], 1.0) for r in self.index.by_inner[e]]
            model.linear.row([*row, (x, -1.0)], low=0.0)
        for r, inner in enumerate(self.index.problem.placements.inner):
            inside = [(model.edge[e], 1.0) for e in inner if e in model.edge]
            model.linear.row([*inside, (self.room[r], -1.0)], low=0.0)
        self._parts(model)

    def _parts(self, model: NetworkModel) -> None:
        """Let the route touch at most one vertex more than it has edges in a block."""
        touched: dict[tuple[int, ...], Any] = {}
        for r, room in enumerate(self.room):
            at = touched_by(self.index, r)
            inner = {e for mine in at.values() for e in mine if e in model.edge}
            row = [(model.edge[e], -1.0) for e in sorted(inner)]
            for mine in at.values():
                key = tuple(e for e in mine if e in model.edge)
                if not key:
                    continue
                if len(key) == 1:
                    row.append((model.edge[key[0]], 1.0))
                    continue
                if key not in touched:
                    touched[key] = model.linear.real(1.0)
                    for e in key:
                        parts = [(touched[key], 1.0), (model.edge[e], -1.0)]
                        model.linear.row(parts, low=0.0)
                row.append((touched[key], 1.0))
            if at:
                most = float(len(at))
                model.linear.row([*row, (room, most)], high=1.0 + most)

    def design(self, model: NetworkModel, values: dict[str, float]) -> BoolArray:
        """Return the design (edges, then placements) of a solution, given by name of variable."""
        rooms = [values.get(x.name, 0.0) > 0.5 for x in self.room]
        return np.concatenate([model.chosen(values), np.array(rooms, dtype=bool)])
