"""What a planner asks of the network as a whole, said about the mesh of one site and level.

Links and routes belong to the first level that is designed (CND section 5.1, figure 6d-e: the
collectors), and to all its blocks together; exits, budget, ways out, spacing and one-way streets to
every level.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from shapely.geometry import LineString, Point

from ..errors import InputError
from ..levels import COLLECTOR, CUL_DE_SAC, LOCAL
from ..network.partition import face_areas, patches, point_to_point
from ..network.problem import BoolArray, IntArray, NetworkProblem
from ..network.requirements.base import Requirement
from ..network.requirements.budget import LengthBudget
from ..network.requirements.corridor import corridor
from ..network.requirements.links import Link
from ..network.requirements.reach import MaxDistance
from ..network.requirements.spacing import junction_spacing
from ..network.requirements.twoways import TwoWays
from ..network.specification import FORBID, Specification
from .exits import exits_allowed, share_of_exits, touched, with_exits_left
from .partition import patches_from_polygons
from .survey import Ground

#: Side of patches where none is given, in block lengths.
PATCH = 3.0
#: Prices of what the planner's rules would rather report than refuse, in mesh edge lengths: a
#: missing link or route, a junction too far from an exit, a pair of junctions too near, a
#: street that is the only way to a place.
LINK, FAR, NEAR, BRIDGE = 40.0, 10.0, 8.0, 6.0
#: The end of a route this near to the edge of the site belongs to it (block widths).
AT_EDGE = 1.0
#: The end of a route is moved no farther than this to where streets can leave (mesh edges).
FARTHEST_MOVE = 3.0
#: So many pairs of places are tried for a route where none is drawn.
TRIED = 200


def is_first(spec: Specification, level: int) -> bool:
    """Whether a level is the first that is designed."""
    return level == COLLECTOR or (level == LOCAL and spec.levels == 1)


def joins_blocks(spec: Specification, level: int) -> bool:
    """Whether a level is asked for ways from one block to another, so that none stands alone."""
    return is_first(spec, level) and spec.traffic != "out"


def with_requirements(
    problem: NetworkProblem,
    ground: Ground,
    spec: Specification,
    level: int,
    above: BoolArray,
    kept_exits: int = 0,
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
    kept_exits
        How many exits are kept for the levels below.
    """
    soft = spec.rules == "planner"
    mesh = ground.mesh
    if spec.max_distance is not None:
        # the way out leads through the streets above, it does not end there
        problem = dataclasses.replace(problem, sinks=ground.sinks.copy())
    exits = exits_allowed(ground, spec)
    if exits is not None:
        problem = with_exits_left(problem, ground, exits - kept_exits, level, above)
    found: list[Requirement] = list(problem.requirements)
    if is_first(spec, level):
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


def share_of_limits(problem: NetworkProblem, share: float, elsewhere: int = 0) -> NetworkProblem:
    """Return a problem that may spend a share of the metres and exits that are left.

    Parameters
    ----------
    problem
        The problem of a block.
    share
        Its part of what is left, above 0 and at most 1.
    elsewhere
        Exits that required streets of other blocks need.
    """
    problem = share_of_exits(problem, share, elsewhere)
    found = [
        dataclasses.replace(r, most=r.most * share) if isinstance(r, LengthBudget) else r
        for r in problem.requirements
    ]
    return dataclasses.replace(problem, requirements=tuple(found))


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
    able = touched(problem, problem.candidate) & mesh.boundary_vertices
    able &= problem.sinks | touched(problem, problem.existing)
    doors = np.flatnonzero(able)
    if len(doors) < 2:
        raise InputError(
            "No route can lead through this site: streets can leave it in fewer than two places.",
            "Add roads at its edge, or ask for other traffic.",
            layer=ground.site.name,
            feature=ground.site.feature,
        )
    drawn = [_ends(ground, doors, line, i, spec) for line, i in ground.preferences.routes]
    found = []
    for a, b in drawn:
        one = _route(problem, a, b, spec.detour, penalty)
        if one is None:
            raise InputError(
                "No route can lead from one end to the other: obstacles, walls, streets or "
                "forbidden places cut the site.",
                "Give other ends, or take obstacles out that may be crossed.",
                layer=ground.preferences.route_layer,
            )
        found.append(one)
    return found or [_longest(problem, ground, doors, spec.detour, penalty)]


def _route(problem: NetworkProblem, a: int, b: int, detour: float, penalty: float) -> Link | None:
    """Return the route from one vertex to another, None where there can be none."""
    anyhow = Link(a, b, 1e9, hops=True, private=True)
    shortest = corridor(problem, anyhow).shortest
    if math.isinf(shortest):
        return None
    return dataclasses.replace(anyhow, limit=shortest + detour, penalty=penalty)


def _longest(
    problem: NetworkProblem, ground: Ground, doors: IntArray, detour: float, penalty: float
) -> Link:
    """Return the route between the places farthest apart that one can join.

    Arriving streets come first.
    """
    arriving = np.array([v for v in doors.tolist() if v in ground.arrivals], dtype=np.int64)
    for among in (arriving, doors):
        places = ground.mesh.vertices[among]
        i, j = np.triu_indices(len(among), 1)
        gaps = np.hypot(*(places[i] - places[j]).T)
        for k in np.argsort(-gaps, kind="stable")[:TRIED].tolist():
            one = _route(problem, int(among[i[k]]), int(among[j[k]]), detour, penalty)
            if one is not None:
                return one
    raise InputError(
        "No route can lead through this site: obstacles, walls, streets or forbidden places cut "
        "it everywhere.",
        "Take obstacles out that may be crossed, or ask for other traffic.",
        layer=ground.site.name,
        feature=ground.site.feature,
    )


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
        if gaps.min() > FARTHEST_MOVE * mesh.edge_length:
            raise InputError(
                f"One of its ends lies {gaps.min():.0f} m from the nearest place where streets "
                "can leave the site.",
                "Draw it from and to roads along the edge of the site, add the roads that are "
                "missing, or let the whole boundary be the exit.",
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
