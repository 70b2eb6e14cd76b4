"""The exact value of a plan, checked without any solver."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ...network.evaluate import Evaluation, Evaluator
from ...network.problem import BoolArray
from .index import RoomIndex
from .parts import part_cuts
from .treasures import treasure_count

#: Limits of areas may be missed by this share, which is what rounding may do.
SLACK = 2e-3


@dataclass(eq=False)
class RoomEvaluator:
    """Evaluates plans; takes the place of `network.evaluate.Evaluator` in a search.

    Attributes
    ----------
    index
        The problem.
    """

    index: RoomIndex
    _network: Evaluator = field(init=False)

    def __post_init__(self) -> None:
        """Prepare the evaluation of corridors."""
        self._network = Evaluator(self.index.problem.network)

    def objective(self, design: BoolArray) -> float:
        """Return the objective of a design (edges, then placements); infinite if not valid."""
        return self.evaluate(design).objective

    def evaluate(self, design: BoolArray) -> Evaluation:
        """Return the objective of a design and its parts; see `Evaluator.evaluate`."""
        active = design[: self.index.edges]
        found = self._network.evaluate(active)
        rooms = self.index.rooms_of(design)
        if found.valid and faults(self.index, active, rooms):
            return replace(found, objective=math.inf)
        return found


def faults(index: RoomIndex, active: BoolArray, rooms: list[int]) -> list[str]:
    """Return what is wrong with rooms, given the active edges.

    Parameters
    ----------
    index
        The problem.
    active
        Shape (e,). Edges of corridors or of the route.
    rooms
        Placements.

    Returns
    -------
    list of str
        One sentence for each equation of CND 5.2 or CND-x 5.3 that does not hold.
    """
    problem = index.problem
    on = (active | problem.network.existing).tolist()
    placements, wrong = problem.placements, []
    times = np.zeros(len(problem.floor), dtype=np.int64)
    for r in rooms:
        times[list(placements.faces[r])] += 1
    missed = np.flatnonzero(times != problem.floor)
    if len(missed):
        wrong.append(f"{len(missed)} faces are not covered by exactly one room (eq. 15)")
    for r in rooms:
        inside = any(on[e] for e in placements.inner[r])
        along = any(on[e] for e in placements.rim[r])
        if problem.kind == "floor" and inside:
            wrong.append(f"a corridor runs inside placement {r} (eq. 16)")
        if problem.kind == "floor" and not along:
            wrong.append(f"no corridor touches placement {r} (eq. 17)")
        if problem.kind == "level" and not inside:
            wrong.append(f"no route runs through placement {r} (eq. 19)")
        if problem.kind == "level" and along:
            wrong.append(f"the route runs along the border of placement {r} (eq. 20)")
    if problem.kind == "level" and any(part_cuts(index, active | problem.network.existing, rooms)):
        wrong.append("the route crosses a block in several parts")
    asked = problem.treasures
    if asked is not None and not asked.least <= treasure_count(index, on, rooms) <= asked.most:
        wrong.append("the number of treasure rooms is another")
    for rule in problem.counts:
        total = float(rule.weight[rooms].sum())
        slack = SLACK * max(1.0, abs(total)) if rule.weight.max(initial=0.0) != 1.0 else 1e-9
        if not rule.least - slack <= total <= rule.most + slack:
            wrong.append(f"{rule.text}: {total:g}")
    return wrong
