"""One program of a street level: solved, and once more as long as rings hang on stems."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import networkx as nx
import numpy as np

from ..errors import InfeasibleError
from ..levels import LOCAL
from ..network.evaluate import Evaluator
from ..network.problem import BoolArray, Clause, Design, NetworkProblem
from ..network.solve import solve
from ..network.specification import FORBID, Specification
from ..progress import Deadline, Progress, SearchState, Share
from .exits import without_exits
from .why_not import located

#: Rounds in which rings on stems are cut off.
LOLLIPOP_ROUNDS = 4
#: What a ring on a stem may cost, in mesh edge lengths.
LOLLIPOP_PENALTY = 6.0
#: Where nothing is found in time, what must be built is built on for this share of the time, and
#: for so many seconds at least.
AGAIN, AGAIN_SECONDS = 0.3, 1.0
#: Share of the time in which streets are designed without the exits that are left, to begin with.
SHUT = 0.4
#: Windows of a search that ends by its work.
LEAST_WINDOWS = 4


@dataclass(frozen=True, eq=False)
class Solved:
    """One solved network problem of a street level."""

    name: str
    problem: NetworkProblem
    design: Design
    level: int = LOCAL


def solve_level(
    problem: NetworkProblem,
    spec: Specification,
    seconds: float,
    progress: Progress,
    name: str,
    start: BoolArray | None = None,
    *,
    explain: bool = True,
) -> Solved:
    """Solve one problem, then again as long as rings on stems can be avoided.

    Parameters
    ----------
    problem
        The problem of a level, or of one block of it.
    spec
        What the planner asks at that level.
    seconds
        Time for it.
    progress
        Told of incumbents; asked for cancellation.
    name
        What is designed, for reports.
    start
        Shape (e,). Streets of an earlier design, to begin with.
    explain
        Whether an error is to say why there is no design.

    Raises
    ------
    InfeasibleError
        If there is no design, or none was found in time and what must be built alone is none.
    """
    deadline = Deadline(seconds, progress)
    begin = None if start is None else start & problem.candidate
    try:
        if begin is None:
            begin = _without_exits(problem, spec, SHUT * seconds, progress)
        design = _solved(problem, spec, deadline.left, progress, begin, explain=explain)
    except InfeasibleError as error:
        if not explain:
            raise
        bare = problem.required & problem.candidate
        if error.diagnosis is not None or math.isinf(Evaluator(problem).objective(bare)):
            raise located(error, problem) from error
        # a hard rule keeps the search from a start; where nothing is demanded, little will do
        more = max(AGAIN_SECONDS, AGAIN * seconds)
        design = _solved(problem, spec, more, progress, bare)
        if design.uncovered:
            progress.warn(
                f"{name}: in {seconds:.0f} s only a few streets were found that keep to what is "
                "asked; allow more time."
            )
    if spec.rules != "planner" or spec.dead_ends != FORBID:
        return Solved(name, problem, design)
    for _ in range(LOLLIPOP_ROUNDS):
        cuts = lollipop_cuts(problem, design)
        if not cuts or deadline.passed():
            break
        problem = dataclasses.replace(problem, clauses=(*problem.clauses, *cuts))
        left = max(0.5, deadline.left)
        design = _solved(problem, spec, left, progress, design.active)
    return Solved(name, problem, design)


class _NoBounds(Share):
    """Tells designs of a narrower problem, whose bounds prove nothing of the wider one."""

    def search(self, state: SearchState) -> None:
        """Pass the state on without its bound."""
        super().search(dataclasses.replace(state, bound=None))


def _without_exits(
    problem: NetworkProblem, spec: Specification, seconds: float, progress: Progress
) -> BoolArray | None:
    """Find a design that uses none of the exits that are counted; None where there is none."""
    shut = without_exits(problem)
    if shut is None:
        return None
    try:
        # its bound is not that of the problem
        told = _NoBounds(progress, 0.0, 1.0)
        return _solved(shut, spec, seconds, told, None, explain=False).active
    except InfeasibleError:
        return None


def _solved(
    problem: NetworkProblem,
    spec: Specification,
    seconds: float,
    progress: Progress,
    start: BoolArray | None,
    *,
    explain: bool = True,
) -> Design:
    """Solve a problem as the specification says."""
    windows = None
    if spec.effort is not None:
        windows = max(LEAST_WINDOWS, round(spec.effort * int(problem.candidate.sum()) / 100))
    return solve(
        problem,
        time_limit=seconds,
        gap=spec.gap,
        seed=spec.seed,
        solver=spec.solver,
        start=start,
        iterations=windows,
        threads=None if windows is None else 1,
        progress=progress,
        explain=explain,
    )


def lollipop_cuts(problem: NetworkProblem, design: Design) -> list[Clause]:
    """Ask for a second exit of every part that hangs on a single street.

    A part of the network behind a bridge has no dead end when it is a ring, and yet is one
    for everybody who lives there. The clause asks for one more edge out of the part's
    vertices; it is soft, since some corners of a site have one way in only.
    """
    mesh = problem.mesh
    graph: nx.Graph = nx.Graph()
    hub = -1
    streets = np.flatnonzero(design.active | problem.existing)
    for e in streets.tolist():
        u, v = mesh.edges[e].tolist()
        graph.add_edge(u, v)
    for v in np.flatnonzero(problem.sinks).tolist():
        # two strands, so that an edge between a sink and the hub is never a bridge
        graph.add_edges_from([(v, ("out", v)), (("out", v), hub), (v, hub)])
    if hub not in graph:
        return []
    cuts = []
    for u, v in list(nx.bridges(graph)):
        bridge = mesh.edge_between(u, v) if isinstance(u, int) and isinstance(v, int) else -1
        if bridge < 0 or not design.active[bridge]:
            continue
        graph.remove_edge(u, v)
        side = nx.node_connected_component(graph, u)
        if hub in side:
            side = nx.node_connected_component(graph, v)
        graph.add_edge(u, v)
        part = np.zeros(len(mesh.vertices), dtype=np.bool_)
        part[[w for w in side if isinstance(w, int) and w >= 0]] = True
        leaving = part[mesh.edges].sum(axis=1) == 1
        others = np.flatnonzero(leaving & problem.candidate)
        exits = tuple(int(e) for e in others if e != bridge)
        if exits and part.sum() > 1:
            cuts.append(Clause(exits, LOLLIPOP_PENALTY, "second exit"))
    return cuts
