"""The linear relaxation of a problem with all inequalities of balls and components."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Optional

import numpy as np

from ..cuts.balls import ball_cuts
from ..cuts.components import ComponentCut, Regions
from ..cuts.connection import ConnectionCut, Connector
from ..cuts.separation import Point, Separator
from ..mip.model import NetworkModel, add_rules, start_model
from ..mip.sparse import LpResult, LpSolver, SparseModel
from ..problem import BoolArray, FloatArray
from ..structure import Structure
from .detours import add_detours

#: Above this many usable edges the interior point method solves the relaxation.
INTERIOR = 3000


class Relaxation:
    """A lower bound of a network problem that rises round by round.

    Connection is demanded only where it was found missing, and a distance counts as the least
    possible one plus the least detour where the way is barred. The rest are degrees, coverage,
    local rules, requirements and the inequalities of `balls`, `components` and `connection`.

    Parameters
    ----------
    index
        The problem.
    check
        Called often while the model is built; may raise an error to end that.

    Attributes
    ----------
    cuts, connections
        All inequalities of components and connection found so far.
    model
        The program.
    """

    def __init__(self, index: Structure, check: Optional[Callable[[], None]] = None) -> None:
        self.linear = SparseModel(check)
        self.model: NetworkModel = start_model(index, check, self.linear)
        self.model.exact = False
        self._index = index
        self._rings: dict[int, Any] = {}
        self.cuts: list[ComponentCut] = []
        self.connections: list[ConnectionCut] = []
        self._regions = Regions(index)
        self._separator = Separator(self._regions, check)
        self._connector = Connector(index, check)
        add_rules(self.model)
        if index.with_distance:
            add_detours(self.model, check)
        self._add_rings()
        self._add_exits(check)
        self.add(self._separator.first)
        self.linear.finish()
        self._solver = LpSolver(self.linear, interior=len(index.edges) > INTERIOR)
        self._values: Optional[FloatArray] = None

    def _add_rings(self) -> None:
        """Add a variable for each ring that may close, at most the value of each edge."""
        regions, mesh = self._regions, self._index.problem.mesh
        if not regions.no_pairs:
            return
        beside: dict[tuple[int, int], list[Any]] = {}
        for v, ring in regions.rings.items():
            self._rings[v] = self.linear.real(1.0)
            star = set(regions.around[v])
            for e in ring:
                for f in star.intersection(mesh.edge_faces[e].tolist()):
                    beside.setdefault((e, f), []).append(self._rings[v])
        for (e, _), rings in beside.items():
            # rings that share an edge and a face exclude each other
            row = [(r, 1.0) for r in rings]
            self.linear.row([*row, (self.model.edge[e], -1.0)], high=0.0)

    def _add_exits(self, check: Optional[Callable[[], None]]) -> None:
        """Add the ball-exit inequalities."""
        model = self.model
        for cut in ball_cuts(self._index, check):
            row = [(model.edge[e], float(cut.weight)) for e in cut.exits]
            row += [(model.edge[e], 1.0) for e in cut.inside]
            if cut.ring:
                row.append((self._rings[cut.vertex], float(cut.weight)))
            if cut.vertex in model.slack:
                row.append((model.slack[cut.vertex], float(cut.rhs)))
            self.linear.row(row, low=float(cut.rhs))

    def add(self, cuts: list[ComponentCut]) -> None:
        """Add component inequalities."""
        self.cuts += cuts
        for cut in cuts:
            self.linear.row(self.row_of(cut), low=1.0 if cut.base < 0 else 0.0)

    def connect(self, cuts: list[ConnectionCut]) -> None:
        """Add connection inequalities."""
        self.connections += cuts
        for cut in cuts:
            row = [(self.model.edge[e], 1.0) for e in cut.exits]
            if cut.cover in self.model.slack:
                row.append((self.model.slack[cut.cover], 1.0))
            self.linear.row(row, low=1.0)

    def row_of(self, cut: ComponentCut) -> list[tuple[Any, float]]:
        """Return the left-hand side of a component inequality, less y(base)."""
        model = self.model
        row = [(model.vertex[u], 1.0) for u in cut.vertices]
        row += [(model.edge[e], -cut.share) for e in cut.edges]
        if cut.ring >= 0:
            row.append((self._rings[cut.ring], 1.0))
        if cut.cover in model.slack:
            row.append((model.slack[cut.cover], 1.0))
        if cut.base >= 0:
            row.append((model.vertex[cut.base], -1.0))
        return row

    def solve(self, stop: Callable[[], bool]) -> LpResult:
        """Find the optimum of the relaxation as it is; see `LpSolver.solve`."""
        result = self._solver.solve(stop)
        self._values = result.values
        return result

    def solve_whole(self, stop: Callable[[], bool], tell: Callable[[float], None]) -> LpResult:
        """Find the optimum in whole numbers; see `LpSolver.solve_whole`."""
        whole = [*self.model.edge.values(), *self.model.vertex.values()]
        result = self._solver.solve_whole(whole, stop, tell)
        self._values = result.values
        return result

    def chosen(self) -> Optional[BoolArray]:
        """Return the edges that the last optimum chooses, or None if there was none."""
        if self._values is None:
            return None
        active = np.zeros(len(self._index.ends), dtype=bool)
        for e, j in self.model.edge.items():
            active[e] = self._values[j] > 0.5
        return active

    def tighten(self) -> int:
        """Add inequalities that the last optimum violates; return their number."""
        if self._values is None:
            return 0
        point = self._point(self._values)
        found = self._separator.find(point)
        self.add(found)
        islands = self._connector.find(point)
        self.connect(islands)
        return len(found) + len(islands)

    def _point(self, values: FloatArray) -> Point:
        """Sort the values of the variables."""
        edge = [0.0] * len(self._index.ends)
        vertex = [0.0] * len(self._index.incident)
        for e, j in self.model.edge.items():
            edge[e] = float(values[j])
        for v, j in self.model.vertex.items():
            vertex[v] = float(values[j])
        ring = {v: float(values[j]) for v, j in self._rings.items()}
        slack = {v: float(values[j]) for v, j in self.model.slack.items()}
        return Point(edge, vertex, ring, slack)


def raise_by_rounds(
    relaxation: Relaxation,
    tell: Callable[[float], None],
    stop: Callable[[], bool],
    *,
    patience: int = 3,
    least: float = 5e-4,
) -> bool:
    """Solve and tighten the relaxation until that pays no more.

    Parameters
    ----------
    relaxation
        Its inequalities and their values stay in it.
    tell
        Told each bound.
    stop
        Asked about 20 times a second.
    patience, least
        End after so many rounds that raise the bound by less than this part.

    Returns
    -------
    bool
        False if the relaxation has no solution, so that there is no valid design.
    """
    before, idle = -math.inf, 0
    while idle < patience and not stop():
        result = relaxation.solve(stop)
        if result.infeasible:
            return False
        if result.values is None:
            return True
        tell(result.bound)
        gained = result.bound - before > least * max(1.0, abs(result.bound))
        idle, before = (0 if gained else idle + 1), result.bound
        if not relaxation.tighten():
            return True
    return True
