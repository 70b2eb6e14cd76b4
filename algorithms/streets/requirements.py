"""What a planner asks of the network as a whole, said about the mesh of one site and level.

Links and routes belong to the first level that is designed (CND section 5.1, figure 6d-e: the
collectors); exits, budget, ways out, spacing and one-way streets to every level.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from shapely.geometry import LineString, Point

from ..errors import InputError
from ..network.partition import face_areas, patches, point_to_point
from ..network.problem import BoolArray, IntArray, NetworkProblem
from ..network.requirements.base import Requirement
from ..network.requirements.budget import LengthBudget
from ..network.requirements.corridor import corridor
from ..network.requirements.exits import ExitCount
from ..network.requirements.links import Link
from ..network.requirements.reach import MaxDistance
from ..network.requirements.spacing import junction_spacing
from ..network.requirements.twoways import TwoWays
from ..network.specification import FORBID, Specification
from .partition import patches_from_polygons
from .program import COLLECTOR, CUL_DE_SAC, LOCAL
from .survey import Ground

#: Side of patches where none is given, in block lengths.
PATCH = 3.0
#: Prices of what the planner's rules would rather report than refuse, in mesh edge lengths: a
#: missing link or route, a junction too far from an exit, a pair of junctions too near, a
#: street that is the only way to a place.
LINK, FAR, NEAR, BRIDGE = 40.0, 10.0, 8.0, 6.0
#: The end of a route this near to the edge of the site belongs to it (block widths).
AT_EDGE = 1.0


def with_requirements(
    problem: NetworkProblem, ground: Ground, spec: Specification, level: int, above: BoolArray
) -> NetworkProblem:
    """Add to the problem of a level what is asked of the network as a whole.

    Parameters
    ----------
    problem
        The problem of the level.
    ground
        The site and its mesh.
    spec
        What the planner asks.
    level
        `COLLECTOR` or `LOCAL`, or a level below.
    above
        Shape (e,). Streets designed already.
    """
    first = level == COLLECTOR or (level == LOCAL and spec.levels == 1)
    soft = spec.rules == "planner"
    mesh = ground.mesh
    if spec.max_distance is not None:
        # the way out leads through the streets above, it does not end there
        problem = dataclasses.replace(problem, sinks=ground.sinks.copy())
    if spec.exits is not None:
        problem = _few_exits(problem, spec.exits, first, above)
    found: list[Requirement] = list(problem.requirements)
    # a link that an earlier block made is dropped; of routes the first block decides
    if first and (spec.traffic == "within" or not above.any()):
        found += _links(problem, ground, spec, soft)
    if spec.length_budget is not None:
        left = max(0.0, spec.length_budget - float(mesh.lengths[above].sum()))
        found.append(LengthBudget(mesh.lengths, left, mesh.edge_length))
    if spec.max_distance is not None:
        most = spec.max_distance / mesh.edge_length
        found.append(MaxDistance(most, FAR if soft else FORBID))
    if spec.junction_spacing is not None:
        weight = NEAR if soft else FORBID
        found.append(junction_spacing(problem, mesh.lengths, spec.junction_spacing, weight))
    # a cul-de-sac is the only way to its end, and stays two-way
    single = level == LOCAL if spec.one_way == "local" else level != CUL_DE_SAC
    if spec.one_way != "none" and single:
        found.append(TwoWays(BRIDGE if soft else FORBID))
    return dataclasses.replace(problem, requirements=tuple(found))


def share_of_budget(problem: NetworkProblem, share: float) -> NetworkProblem:
    """Return a problem that may spend a share of what its length budget allows."""
    found = [
        dataclasses.replace(r, most=r.most * share) if isinstance(r, LengthBudget) else r
        for r in problem.requirements
    ]
    return dataclasses.replace(problem, requirements=tuple(found))


def _touched(problem: NetworkProblem, edges: BoolArray) -> BoolArray:
    """Mark the vertices of edges."""
    mark = np.zeros(len(problem.mesh.vertices), dtype=np.bool_)
    mark[problem.mesh.edges[edges].ravel()] = True
    return mark


def _few_exits(problem: NetworkProblem, most: int, first: bool, above: BoolArray) -> NetworkProblem:
    """Make every place where new streets can meet existing ones a place that counts.

    The exits that the first level leaves over may be used by it in the next block; later levels
    use those of the first.
    """
    doors = problem.sinks | _touched(problem, problem.existing & ~above)
    inside = _touched(problem, above)
    used = doors & inside
    left = max(0, most - int(used.sum()))
    options = np.flatnonzero(doors & ~inside & _touched(problem, problem.candidate))
    if first and left and len(options):
        count = ExitCount(tuple(options.tolist()), left, least=int(not used.any()))
        sinks = problem.sinks.copy()
        sinks[options] = True
        return dataclasses.replace(
            problem, sinks=sinks, requirements=(*problem.requirements, count)
        )
    shut = np.zeros(len(doors), dtype=np.bool_)
    shut[options] = True
    candidate = problem.candidate & ~shut[problem.mesh.edges].any(axis=1)
    return dataclasses.replace(problem, candidate=candidate, required=problem.required & candidate)


def _links(
    problem: NetworkProblem, ground: Ground, spec: Specification, soft: bool
) -> Sequence[Requirement]:
    """Return the links within the site or the routes through it."""
    penalty = (LINK if soft else FORBID) if spec.links is None else spec.links
    if spec.traffic == "within":
        return _within(problem, ground, spec, penalty)
    if spec.traffic == "through":
        return _through(problem, ground, spec, penalty)
    return ()


def _within(
    problem: NetworkProblem, ground: Ground, spec: Specification, penalty: float
) -> list[Link]:
    """Link neighbouring patches (CND section 4.2 L1)."""
    given = ground.preferences.partition
    if given:
        patch = patches_from_polygons(ground.mesh, ground.site, ground.preferences)
    else:
        side = spec.patch_size or PATCH * spec.block_length
        patch = patches(ground.mesh, side**2, weight=face_areas(ground.mesh), seed=spec.seed)
    return point_to_point(problem, patch, tolerance=spec.detour, penalty=penalty, seed=spec.seed)


def _through(
    problem: NetworkProblem, ground: Ground, spec: Specification, penalty: float
) -> list[Link]:
    """Lead a route without branches from edge to edge (CND figure 6d)."""
    mesh = ground.mesh
    able = _touched(problem, problem.candidate) & mesh.boundary_vertices
    able &= problem.sinks | _touched(problem, problem.existing)
    doors = np.flatnonzero(able)
    if len(doors) < 2:
        raise InputError(
            "No route can lead through this site: streets can leave it in fewer than two places.",
            "Add roads at its edge, or ask for other traffic.",
            layer=ground.site.name,
            feature=ground.site.feature,
        )
    pairs = [_ends(ground, doors, line, i, spec) for line, i in ground.preferences.routes]
    pairs = pairs or [_farthest(ground, doors)]
    found = []
    for a, b in pairs:
        anyhow = Link(a, b, 1e9, hops=True, private=True)
        shortest = corridor(problem, anyhow).shortest
        if math.isinf(shortest):
            raise InputError(
                "No route can lead from one end to the other: obstacles, walls or forbidden "
                "places cut the site.",
                "Give other ends, or take obstacles out that may be crossed.",
                layer=ground.preferences.route_layer if ground.preferences.routes else "",
            )
        limit = shortest + spec.detour
        found.append(dataclasses.replace(anyhow, limit=limit, penalty=penalty))
    return found


def _ends(
    ground: Ground, doors: IntArray, line: LineString, feature: int | str, spec: Specification
) -> tuple[int, int]:
    """Return the two vertices at the edge of the site between which a drawn route leads."""
    mesh, layer = ground.mesh, ground.preferences.route_layer
    found = []
    for xy in (line.coords[0], line.coords[-1]):
        gaps = np.hypot(*(mesh.vertices[doors] - xy[:2]).T)
        off = ground.site.polygon.boundary.distance(Point(xy))
        if off > AT_EDGE * spec.block_width and gaps.min() > AT_EDGE * spec.block_width:
            raise InputError(
                f"One of its ends lies {off:.0f} m from the edge of the site.",
                "Draw the route from where traffic comes in to where it leaves.",
                layer=layer,
                feature=feature,
            )
        found.append(int(doors[gaps.argmin()]))
    if found[0] == found[1]:
        raise InputError(
            "Both its ends are nearest to the same place where streets can leave the site.",
            "Draw its ends farther apart.",
            layer=layer,
            feature=feature,
        )
    return found[0], found[1]


def _farthest(ground: Ground, doors: IntArray) -> tuple[int, int]:
    """Return the two arriving streets farthest apart, or any two such places."""
    arriving = np.array([v for v in doors.tolist() if v in ground.arrivals], dtype=np.int64)
    among = arriving if len(arriving) > 1 else doors
    places = ground.mesh.vertices[among]
    gaps = np.hypot(*(places[:, None, :] - places[None, :, :]).transpose(2, 0, 1))
    i, j = np.unravel_index(gaps.argmax(), gaps.shape)
    return int(among[min(i, j)]), int(among[max(i, j)])
