"""How many places new streets may leave a site by, shared by levels, blocks and sub-regions.

The number that a planner gives is of the whole site. An exit is a place where a new street meets
an existing one or another sink at the edge of the site; where it meets a street that lies deep
inside, kept or given, it does not leave.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import shapely
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..levels import CUL_DE_SAC
from ..network.problem import BoolArray, NetworkProblem
from ..network.requirements.base import Requirement
from ..network.requirements.exits import ExitCount
from ..network.requirements.links import Link
from ..network.requirements.reach import MaxDistance
from ..network.specification import Specification
from .adopt import existing_lines
from .survey import Ground

#: A street that passes a vertex of the mesh within this distance runs through it (metres).
AT_VERTEX = 1.0
#: A road within this distance of a vertex on the outline is met there (metres).
NEAR = 12.0


def touched(problem: NetworkProblem, edges: BoolArray) -> BoolArray:
    """Mark the vertices of edges, shape (n,)."""
    mark = np.zeros(len(problem.mesh.vertices), dtype=np.bool_)
    mark[problem.mesh.edges[edges].ravel()] = True
    return mark


def doors(ground: Ground) -> tuple[BoolArray, BoolArray]:
    """Tell where new streets leave the site, and where they start from a street inside it.

    Parameters
    ----------
    ground
        The site, or a sub-region of it, and its mesh.

    Returns
    -------
    doors, inner : numpy.ndarray
        Shape (n,) each; no vertex is in both. What lies within the snap distance of the edge of
        the whole site is at the edge.
    """
    mesh = ground.mesh
    old = np.zeros(len(mesh.vertices), dtype=np.bool_)
    old[mesh.edges[ground.street].ravel()] = True
    whole = ground.whole
    edge = ground.site.polygon.boundary if whole is None else whole.edge
    inner = old & (
        shapely.distance(shapely.points(mesh.vertices), edge) > ground.site.snap_distance
    )
    return (old | ground.sinks) & ~inner, inner


def across_streets(ground: Ground) -> BoolArray:
    """Mark edges that cross an existing street between two vertices, shape (e,).

    At the edge of a site a road may run a little inside it: a new street that crosses it there
    meets it, and leaves the site, where the mesh has no vertex that could be counted. Edges to the
    outline are left alone where the street on them ends at the road: it does where it comes
    alone, and near enough where the road is near.
    """
    mesh = ground.mesh
    mark = np.zeros(len(mesh.edges), dtype=np.bool_)
    able = np.flatnonzero(~mesh.boundary_edges & ~ground.street)
    lines = shapely.linestrings(mesh.vertices[mesh.edges[able]])
    meeting = shapely.intersection(lines, existing_lines(ground.site))
    points, which = shapely.get_coordinates(meeting, return_index=True)
    if not len(points):
        return mark
    along = shapely.line_locate_point(lines[which], shapely.points(points))
    size = shapely.length(lines[which])
    between = (along > AT_VERTEX) & (along < size - AT_VERTEX)
    inner = np.bincount(mesh.edges[able].ravel(), minlength=len(mesh.vertices))
    for end, gap in ((0, along), (1, size - along)):
        v = mesh.edges[able[which], end]
        between &= ~(mesh.boundary_vertices[v] & ((gap <= NEAR) | (inner[v] == 1)))
    mark[able[which[between]]] = True
    return mark


def exits_used(ground: Ground, active: BoolArray) -> int:
    """Count the exits that streets use.

    Parameters
    ----------
    ground
        The site, or a sub-region of it, and its mesh.
    active
        Shape (e,). New streets.
    """
    mark = np.zeros(len(ground.mesh.vertices), dtype=np.bool_)
    mark[ground.mesh.edges[active].ravel()] = True
    return int((doors(ground)[0] & mark).sum())


def exits_allowed(ground: Ground, spec: Specification) -> int | None:
    """Return how many exits the site, or this sub-region of it, may have; None for any."""
    if spec.exits is None or ground.whole is None or ground.whole.exits is None:
        return spec.exits
    return ground.whole.exits


def with_exits_left(
    problem: NetworkProblem, ground: Ground, most: int, level: int, above: BoolArray
) -> NetworkProblem:
    """Make every place where new streets can leave the site a place that counts.

    Streets of the levels above, and streets inside the site, are free to start from. Culs-de-sac
    have no exits of their own.

    Parameters
    ----------
    problem
        The problem of the level.
    ground
        The site and its mesh.
    most
        How many exits the levels down to this one may have together.
    level
        The level.
    above
        Shape (e,). Streets designed already.
    """
    outer, _ = doors(ground)
    begun = touched(problem, above)
    uncounted = across_streets(ground) & ~problem.required
    problem = dataclasses.replace(problem, candidate=problem.candidate & ~uncounted)
    left = max(0, most - int((outer & begun).sum())) if level != CUL_DE_SAC else 0
    options = np.flatnonzero(outer & ~begun & touched(problem, problem.candidate))
    if not len(options):
        return problem
    demanded = bool(touched(problem, problem.required)[options].any())
    if left or demanded:
        # what must be built may need more exits than there are: then there is no design
        count = ExitCount(tuple(options.tolist()), left, least=0)
        sinks = problem.sinks.copy()
        sinks[options] = True
        wanted = (*problem.requirements, count)
        return dataclasses.replace(problem, sinks=sinks, requirements=wanted)
    shut = np.zeros(len(outer), dtype=np.bool_)
    shut[options] = True
    candidate = problem.candidate & ~shut[problem.mesh.edges].any(axis=1)
    return dataclasses.replace(problem, candidate=candidate)


def without_exits(problem: NetworkProblem) -> NetworkProblem | None:
    """Return the problem in which nothing leaves by a place that counts; None where that is vain.

    Its designs are designs of the problem, and far quicker to find.
    """
    counts = [r for r in problem.requirements if isinstance(r, ExitCount)]
    if not counts or any(r.least for r in counts):
        return None
    if any(isinstance(r, Link) and r.hard for r in problem.requirements):
        return None  # a route from exit to exit cannot be made without them
    shut = np.zeros(len(problem.mesh.vertices), dtype=np.bool_)
    for count in counts:
        shut[list(count.options)] = True
    candidate = problem.candidate & ~shut[problem.mesh.edges].any(axis=1)
    starts = touched(problem, candidate) & (problem.sinks | touched(problem, problem.existing))
    if not starts.any() or (problem.required & ~candidate).any():
        return None
    rest = tuple(r for r in problem.requirements if not isinstance(r, ExitCount))
    return dataclasses.replace(problem, candidate=candidate, requirements=rest)


def exits_demanded(problem: NetworkProblem) -> int:
    """Count the exits that required streets need."""
    counts = [r for r in problem.requirements if isinstance(r, ExitCount)]
    needed = touched(problem, problem.required)
    return sum(int(needed[list(count.options)].sum()) for count in counts)


def share_of_exits(problem: NetworkProblem, share: float, elsewhere: int = 0) -> NetworkProblem:
    """Return the problem of a block that may use a share of the exits that are left, rounded up.

    It may use as many as its own required streets need, and leaves those that are needed
    elsewhere.
    """
    needed = exits_demanded(problem)
    found: list[Requirement] = []
    for r in problem.requirements:
        if isinstance(r, ExitCount) and r.most > 0:
            most = min(math.ceil(r.most * share - 1e-9), r.most - elsewhere)
            found.append(dataclasses.replace(r, most=min(r.most, max(0, most, needed))))
        else:
            found.append(r)
    return dataclasses.replace(problem, requirements=tuple(found))


def out_of_reach(problem: NetworkProblem) -> int:
    """Count the places that no street can come near any more, whatever is built.

    A street comes near if it can be joined to a sink, no farther from one than is asked. Cheap:
    nothing is solved, and some of the places left out of the count may be out of reach, too.

    Parameters
    ----------
    problem
        The problem of a level with its requirements.
    """
    mesh = problem.mesh
    streets = problem.candidate | problem.existing
    ends = mesh.edges[streets]
    shape = (len(mesh.vertices),) * 2
    links = csr_matrix((np.maximum(problem.length[streets], 1e-9), ends.T), shape=shape)
    sinks = np.flatnonzero(problem.sinks)
    if not len(sinks):
        return len(problem.cover)
    away = dijkstra(links, directed=False, indices=sinks, min_only=True)
    limits = [r.most for r in problem.requirements if isinstance(r, MaxDistance)]
    able = touched(problem, problem.candidate) & (away <= min(limits, default=np.inf) + 1e-6)
    able &= np.isfinite(away)
    return sum(not able[list(ball)].any() for ball in problem.cover.values())
