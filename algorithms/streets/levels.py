"""Streets level by level: collectors, locals inside each of their blocks, then culs-de-sac."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import networkx as nx
import numpy as np
import numpy.typing as npt

from ..errors import CancelledError, InfeasibleError
from ..network.problem import BoolArray, Clause, Design, IntArray, NetworkProblem
from ..network.solve import solve
from ..network.specification import FORBID, Specification
from ..progress import Deadline, Progress, SearchState, Silent
from .earlier import UNKNOWN
from .program import COLLECTOR, CUL_DE_SAC, LOCAL, asked_at, level_problem
from .requirements import share_of_budget, with_requirements
from .survey import Ground
from .why_not import located

#: Rounds in which rings on stems are cut off.
LOLLIPOP_ROUNDS = 4
#: What a ring on a stem may cost, in mesh edge lengths.
LOLLIPOP_PENALTY = 6.0
#: Share of the time that is left when a level begins; what it leaves over goes to the next.
TIME_SHARES = {COLLECTOR: 0.65, LOCAL: 0.75, CUL_DE_SAC: 1.0}

#: What is built in the blocks, for messages.
BUILT = {LOCAL: "local streets", CUL_DE_SAC: "culs-de-sac"}

Refine = Callable[[Ground, IntArray], tuple[Ground, IntArray]]


@dataclass(frozen=True, eq=False)
class Solved:
    """One solved network problem of a street level."""

    name: str
    problem: NetworkProblem
    design: Design
    level: int = LOCAL


@dataclass(frozen=True, eq=False)
class LevelledNetwork:
    """Chosen edges of a mesh and the level of each.

    Attributes
    ----------
    ground
        The ground on which the streets lie; for the rules as in the paper its mesh is the
        subdivided one.
    level
        Shape (e,). Street level of each edge, 0 where there is no new street.
    solved
        The problems in the order in which they were solved.
    cancelled
        Whether blocks were left without local streets because the run was cancelled.
    """

    ground: Ground
    level: npt.NDArray[np.int64]
    solved: tuple[Solved, ...] = field(default=())
    cancelled: bool = False

    @property
    def objective(self) -> float:
        """Sum of the objectives of all programs that were solved."""
        return float(sum(s.design.objective for s in self.solved))

    @property
    def bound(self) -> float:
        """Sum of the proven bounds: each program takes the levels above as given."""
        return float(sum(s.design.bound for s in self.solved))

    @property
    def stopped(self) -> str:
        """Why the search ended, the least final reason of all programs."""
        reasons = [s.design.stopped for s in self.solved] or ["optimal"]
        if self.cancelled:
            reasons.append("cancelled")
        order = ("cancelled", "time", "gap", "optimal")
        return min(reasons, key=order.index)


def design_levels(
    ground: Ground,
    spec: Specification,
    *,
    seconds: float,
    refine: Refine | None = None,
    progress: Progress | None = None,
) -> LevelledNetwork:
    """Design the streets of one site level by level (CND section 5.1).

    With the planner's rules culs-de-sac are no mesh lines: they are drawn later.

    Parameters
    ----------
    ground
        The site and its mesh.
    spec
        What the planner asks.
    seconds
        Time for all solving.
    refine
        Function from a ground and the streets on it to the finer ground and the same streets
        there, for the rules as in the paper; None keeps the mesh.
    progress
        Told of stages and incumbents; asked for cancellation.
    """
    told = _Sum(progress or Silent())
    deadline = Deadline(seconds, told)
    level = np.zeros(len(ground.mesh.edges), dtype=np.int64)
    solved: list[Solved] = []
    if spec.levels == 2:
        told.stage("Collectors", 0.35)
        problem = _asked(ground, spec, COLLECTOR, level > 0)
        seconds = time_share(spec, COLLECTOR) * deadline.left
        at = asked_at(spec, COLLECTOR)
        begin = _begin(ground, COLLECTOR)
        first = solve_level(problem, at, seconds, told, "collectors", begin)
        solved.append(dataclasses.replace(first, level=COLLECTOR))
        told.add(first.design)
        level[solved[-1].design.active] = COLLECTOR
        if refine is not None:
            ground, level = refine(ground, level)
    blind = spec.cul_de_sacs and refine is not None
    share = time_share(spec, LOCAL) if blind else 1.0
    told.stage("Local streets", 0.6)
    within = Deadline(share * deadline.left, told)
    found, cancelled = _by_block(ground, spec, LOCAL, level, within, told, bool(solved))
    solved += found
    if blind and refine is not None and not cancelled:
        told.stage("Culs-de-sac", 0.8)
        ground, level = refine(ground, level)
        within = Deadline(time_share(spec, CUL_DE_SAC) * deadline.left, told)
        found, cancelled = _by_block(ground, spec, CUL_DE_SAC, level, within, told, bool(solved))
        solved += found
    return LevelledNetwork(ground, level, tuple(solved), cancelled)


def time_share(spec: Specification, level: int) -> float:
    """Share of the time that is left when a level begins, above 0 and at most 1."""
    own = spec.level_settings.get(level)
    return TIME_SHARES[level] if own is None or own.time_share is None else own.time_share


class _Sum:
    """Adds what is solved already to what a part of the search reports.

    A planner wants one price that falls, not one for each block.
    """

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.price = self.proven = 0.0
        self.start = time.monotonic()

    def add(self, design: Design) -> None:
        """Count a finished part."""
        self.price += design.objective
        self.proven += design.bound

    def stage(self, text: str, fraction: float) -> None:
        """Pass the stage on."""
        self.progress.stage(text, fraction)

    def search(self, state: SearchState) -> None:
        """Pass the state on with what is solved already."""
        incumbent = None if state.incumbent is None else state.incumbent + self.price
        bound = None if state.bound is None else state.bound + self.proven
        self.progress.search(SearchState(incumbent, bound, time.monotonic() - self.start))

    def info(self, text: str) -> None:
        """Pass the remark on."""
        self.progress.info(text)

    def warn(self, text: str) -> None:
        """Pass the warning on."""
        self.progress.warn(text)

    def cancelled(self) -> bool:
        """Ask the caller."""
        return self.progress.cancelled()


def _by_block(
    ground: Ground,
    spec: Specification,
    which: int,
    level: npt.NDArray[np.int64],
    deadline: Deadline,
    progress: _Sum,
    in_hand: bool,
) -> tuple[list[Solved], bool]:
    """Solve one level block by block, the largest first; `level` is filled in.

    Returns
    -------
    solved
        What was solved.
    cancelled
        Whether blocks were left out. A cancelled run keeps what it has: the collectors, and
        every block that is finished, stand on their own.
    """
    groups = face_groups(ground, level > 0)
    groups.sort(key=lambda group: (-len(group), min(group)))
    sizes = [len(group) for group in groups]
    width = 0.2 if spec.cul_de_sacs and spec.rules == "paper" else 0.3
    solved: list[Solved] = []
    # culs-de-sac of one block are nothing to those of another
    whole = _asked(ground, spec, which, level > 0) if which == CUL_DE_SAC else None
    for i, group in enumerate(groups):
        if progress.cancelled() and (in_hand or solved):
            progress.warn(f"Cancelled: the blocks that were not reached have no {BUILT[which]}.")
            return solved, True
        problem = restrict(whole or _asked(ground, spec, which, level > 0), group)
        if not problem.candidate.any() or (whole is not None and not problem.cover):
            continue
        name = f"{BUILT[which].capitalize()}, block {i + 1} of {len(groups)}"
        progress.stage(name, (0.6 if which == LOCAL else 0.8) + width * i / len(groups))
        part = sizes[i] / max(1, sum(sizes[i:]))
        problem = share_of_budget(problem, part)
        share = max(1.0, deadline.left * part)
        try:
            at = asked_at(spec, which)
            one = solve_level(problem, at, share, progress, name, _begin(ground, which))
        except CancelledError:
            if not (in_hand or solved):
                raise
            return solved, True
        progress.add(one.design)
        level[one.design.active] = which
        solved.append(dataclasses.replace(one, level=which))
    return solved, False


def _asked(ground: Ground, spec: Specification, which: int, above: BoolArray) -> NetworkProblem:
    """Build the problem of a level with all that is asked of it."""
    problem = level_problem(ground, spec, which, above)
    return with_requirements(problem, ground, spec, which, above)


def _begin(ground: Ground, which: int) -> BoolArray | None:
    """Return the streets of an earlier design with which a level begins, shape (e,).

    Collectors begin with those of old; the levels below may take up any street.
    """
    if ground.start is None:
        return None
    old = (COLLECTOR, UNKNOWN) if which == COLLECTOR else (COLLECTOR, LOCAL, CUL_DE_SAC, UNKNOWN)
    return np.asarray(np.isin(ground.start, old))


def solve_level(
    problem: NetworkProblem,
    spec: Specification,
    seconds: float,
    progress: Progress,
    name: str,
    start: BoolArray | None = None,
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
    """
    deadline = Deadline(seconds, progress)
    try:
        design = solve(
            problem,
            time_limit=deadline.left,
            gap=spec.gap,
            seed=spec.seed,
            solver=spec.solver,
            start=None if start is None else start & problem.candidate,
            progress=progress,
        )
    except InfeasibleError as error:
        raise located(error, problem) from error
    if spec.rules != "planner" or spec.dead_ends != FORBID:
        return Solved(name, problem, design)
    for _ in range(LOLLIPOP_ROUNDS):
        cuts = lollipop_cuts(problem, design)
        if not cuts or deadline.passed():
            break
        problem = dataclasses.replace(problem, clauses=(*problem.clauses, *cuts))
        design = solve(
            problem,
            time_limit=max(0.5, deadline.left),
            gap=spec.gap,
            seed=spec.seed,
            solver=spec.solver,
            start=design.active,
            progress=progress,
        )
    return Solved(name, problem, design)


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


def face_groups(ground: Ground, streets: BoolArray) -> list[frozenset[int]]:
    """Group the faces of the mesh into the areas that streets enclose."""
    mesh = ground.mesh
    graph: nx.Graph = nx.Graph()
    graph.add_nodes_from(range(len(mesh.faces)))
    open_edges = ~mesh.boundary_edges & ~streets & ~ground.street
    graph.add_edges_from(mesh.edge_faces[open_edges].tolist())
    return [frozenset(part) for part in nx.connected_components(graph)]


def restrict(problem: NetworkProblem, faces: frozenset[int]) -> NetworkProblem:
    """Cut a problem down to the edges inside a group of faces."""
    mesh = problem.mesh
    inside = np.zeros(len(mesh.edges), dtype=np.bool_)
    inside[mesh.face_edges[sorted(faces)].ravel()] = True
    candidate = problem.candidate & inside
    corner = set(mesh.faces[sorted(faces)].ravel().tolist())
    able = candidate | problem.existing
    clauses = []
    for clause in problem.clauses:
        own = tuple(e for e in clause.edges if candidate[e])
        if own:
            clauses.append(dataclasses.replace(clause, edges=own))
    patterns = [
        dataclasses.replace(p, off=tuple(e for e in p.off if able[e]))
        for p in problem.patterns
        if all(able[e] for e in p.on) and any(candidate[e] for e in (*p.on, *p.off))
    ]
    touched = np.zeros(len(mesh.vertices), dtype=np.bool_)
    touched[mesh.edges[candidate].ravel()] = True
    cover = {
        v: tuple(u for u in ball if touched[u])
        for v, ball in problem.cover.items()
        if v in corner and any(touched[u] for u in ball)
    }
    part = dataclasses.replace(
        problem,
        candidate=candidate,
        required=problem.required & candidate,
        clauses=tuple(clauses),
        patterns=tuple(patterns),
        cover=cover,
    )
    kept = [requirement.without(part) for requirement in problem.requirements]
    return dataclasses.replace(part, requirements=tuple(r for r in kept if r is not None))
