"""Streets level by level: collectors, locals inside each of their blocks, then culs-de-sac."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import networkx as nx
import numpy as np
import numpy.typing as npt
import shapely

from ..errors import CancelledError, InfeasibleError, InputError, MeshError
from ..levels import COLLECTOR, CUL_DE_SAC, LOCAL
from ..network.problem import STOPS, BoolArray, Design, IntArray, NetworkProblem
from ..network.specification import Specification
from ..progress import Deadline, Progress, SearchState, Silent
from .earlier import UNKNOWN
from .exits import exits_allowed, exits_demanded, out_of_reach
from .program import asked_at, level_problem
from .requirements import joins_blocks, share_of_limits, with_requirements
from .solving import Solved, solve_level
from .survey import Ground

#: Share of the time that is left when a level begins; what it leaves over goes to the next.
TIME_SHARES = {COLLECTOR: 0.65, LOCAL: 0.75, CUL_DE_SAC: 1.0}

#: What is built in the blocks, for messages.
BUILT = {LOCAL: "local streets", CUL_DE_SAC: "culs-de-sac"}

Refine = Callable[[Ground, IntArray], tuple[Ground, IntArray]]


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
    left
        Places of blocks that were left without culs-de-sac, since none could be found.
    """

    ground: Ground
    level: npt.NDArray[np.int64]
    solved: tuple[Solved, ...] = field(default=())
    cancelled: bool = False
    left: tuple[shapely.Point, ...] = ()

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
        return min(reasons, key=STOPS.index)


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
        first = _collectors(ground, spec, deadline, told)
        if first is None:
            spec = dataclasses.replace(spec, levels=1)
        else:
            solved.append(first)
            told.add(first.design)
            level[first.design.active] = COLLECTOR
        if refine is not None:
            ground, level = refine(ground, level)
    blind = spec.cul_de_sacs and refine is not None
    share = time_share(spec, LOCAL) if blind else 1.0
    told.stage("Local streets", 0.6)
    within = Deadline(share * deadline.left, told)
    found = _by_block(ground, spec, LOCAL, level, within, told, bool(solved))
    solved += found.solved
    if blind and refine is not None and not found.cancelled:
        told.stage("Culs-de-sac", 0.8)
        try:
            ground, level = refine(ground, level)
        except (InputError, MeshError) as error:
            told.warn(f"{ground.site.name}: there are no culs-de-sac: {error}")
            return LevelledNetwork(ground, level, tuple(solved))
        within = Deadline(time_share(spec, CUL_DE_SAC) * deadline.left, told)
        found = _by_block(ground, spec, CUL_DE_SAC, level, within, told, bool(solved))
        solved += found.solved
    return LevelledNetwork(ground, level, tuple(solved), found.cancelled, tuple(found.left))


def _collectors(
    ground: Ground, spec: Specification, deadline: Deadline, told: _Sum
) -> Solved | None:
    """Design the collectors so that no place is out of reach of the streets below them.

    Where they spend so many of the exits that some place is, they are designed again with fewer.

    Returns
    -------
    Solved or None
        None where there are none that keep to the limits; the local streets then do without.
    """
    at, begin = asked_at(spec, COLLECTOR), _begin(ground, COLLECTOR)
    nothing = np.zeros(len(ground.mesh.edges), dtype=np.bool_)
    exits = exits_allowed(ground, spec)
    best: tuple[int, Solved] | None = None
    usual = 0
    if exits is not None:
        usual = out_of_reach(_asked(ground, spec, LOCAL, nothing))
    for kept in dict.fromkeys((0, ((exits or 0) + 1) // 2)):
        problem = _asked(ground, spec, COLLECTOR, nothing, kept)
        seconds = time_share(spec, COLLECTOR) * deadline.left
        try:
            found = solve_level(problem, at, seconds, told, "collectors", begin)
        except CancelledError:
            if best is None:
                raise
            break
        except InfeasibleError as error:
            limited = exits is not None or spec.max_distance is not None
            if best is None and (not limited or at.traffic != "out" or told.cancelled()):
                raise
            if error.diagnosis is not None:
                break  # with fewer exits there is none either
            continue
        found = dataclasses.replace(found, level=COLLECTOR)
        lost = 0
        if exits is not None:
            lost = out_of_reach(_asked(ground, spec, LOCAL, found.design.active))
        if best is None or lost < best[0]:
            best = lost, found
        if lost <= usual or told.cancelled():
            break
    if best is None:
        told.warn(
            f"{ground.site.name}: no collectors keep to the number of exits and the longest way "
            "out; all its new streets are local streets."
        )
        return None
    return best[1]


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


@dataclass
class _Blocks:
    """What came of the blocks of one level.

    Attributes
    ----------
    solved
        What was solved.
    cancelled
        Whether blocks were left out. A cancelled run keeps what it has: the collectors, and
        every block that is finished, stand on their own.
    left
        Places of blocks for which nothing was found.
    """

    solved: list[Solved] = field(default_factory=list)
    cancelled: bool = False
    left: list[shapely.Point] = field(default_factory=list)


def _by_block(
    ground: Ground,
    spec: Specification,
    which: int,
    level: npt.NDArray[np.int64],
    deadline: Deadline,
    progress: _Sum,
    in_hand: bool,
) -> _Blocks:
    """Solve one level block by block, the largest first; `level` is filled in."""
    groups = face_groups(ground, level > 0)
    groups.sort(key=lambda group: (-len(group), min(group)))
    if joins_blocks(spec, which):
        groups = [frozenset().union(*groups)]
    sizes = [len(group) for group in groups]
    width = 0.2 if spec.cul_de_sacs and spec.rules == "paper" else 0.3
    done = _Blocks()
    # culs-de-sac of one block are nothing to those of another
    whole = _asked(ground, spec, which, level > 0) if which == CUL_DE_SAC else None
    for i, group in enumerate(groups):
        if progress.cancelled() and (in_hand or done.solved):
            progress.warn(f"Cancelled: the blocks that were not reached have no {BUILT[which]}.")
            done.cancelled = True
            break
        asked = whole or _asked(ground, spec, which, level > 0)
        problem = restrict(asked, group)
        if not problem.candidate.any() or (whole is not None and not problem.cover):
            continue
        if which == CUL_DE_SAC and deadline.passed():
            done.left.append(_middle(ground, group))
            progress.warn(_without(ground, done.left[-1], "There was no time left."))
            continue
        name = f"{BUILT[which].capitalize()}, block {i + 1} of {len(groups)}"
        progress.stage(name, (0.6 if which == LOCAL else 0.8) + width * i / len(groups))
        part = sizes[i] / max(1, sum(sizes[i:]))
        elsewhere = exits_demanded(asked) - exits_demanded(problem)
        problem = share_of_limits(problem, part, elsewhere)
        share = max(1.0, deadline.left * part)
        try:
            at = asked_at(spec, which)
            begin = _begin(ground, which)
            explain = which != CUL_DE_SAC
            one = solve_level(problem, at, share, progress, name, begin, explain=explain)
        except CancelledError:
            if not (in_hand or done.solved):
                raise
            done.cancelled = True
            break
        except InfeasibleError as error:
            if which != CUL_DE_SAC:
                raise
            # what is missing at the last level must not cost the streets above it
            done.left.append(_middle(ground, group))
            progress.warn(_without(ground, done.left[-1], error))
            continue
        progress.add(one.design)
        level[one.design.active] = which
        done.solved.append(dataclasses.replace(one, level=which))
    return done


def _middle(ground: Ground, faces: frozenset[int]) -> shapely.Point:
    """Return a place inside a block."""
    cells = shapely.polygons(ground.mesh.vertices[ground.mesh.faces[sorted(faces)]])
    return shapely.point_on_surface(shapely.union_all(cells))


def _without(ground: Ground, place: shapely.Point, error: InfeasibleError | str) -> str:
    """Say that a block has no culs-de-sac, and why."""
    return (
        f"{ground.site.name}: no culs-de-sac could be found for the block at x {place.x:.0f}, "
        f"y {place.y:.0f} ({ground.site.crs.name}); it keeps the streets above them. {error}"
    )


def _asked(
    ground: Ground, spec: Specification, which: int, above: BoolArray, kept_exits: int = 0
) -> NetworkProblem:
    """Build the problem of a level with all that is asked of it."""
    problem = level_problem(ground, spec, which, above)
    return with_requirements(problem, ground, spec, which, above, kept_exits)


def _begin(ground: Ground, which: int) -> BoolArray | None:
    """Return the streets of an earlier design with which a level begins, shape (e,).

    Collectors begin with those of old; the levels below may take up any street.
    """
    if ground.start is None:
        return None
    old = (COLLECTOR, UNKNOWN) if which == COLLECTOR else (COLLECTOR, LOCAL, CUL_DE_SAC, UNKNOWN)
    return np.asarray(np.isin(ground.start, old))


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
