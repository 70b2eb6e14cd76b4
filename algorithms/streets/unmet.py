"""What was asked of the network as a whole and could not be had, place by place."""

from __future__ import annotations

from collections.abc import Mapping

import shapely

from ..mesh import QuadMesh
from ..network.checks.facts import Violation, facts_of
from ..network.checks.requirements import check_requirements
from .levels import LevelledNetwork

#: What is wrong, for a planner, by the kind of requirement.
TEXTS: Mapping[str, str] = {
    "link": "There is no short way from this part of the site to one next to it.",
    "through route": "No route without side streets leads through the site from here.",
    "distance to a sink": "From here the way out is longer than asked.",
    "junction spacing": "Two junctions are nearer to each other here than asked.",
    "two ways": "This street is the only way to a place: it cannot be one-way.",
}


def unmet_requirements(network: LevelledNetwork) -> list[tuple[shapely.Point, str]]:
    """List where soft requirements are broken, as the independent check sees it.

    Parameters
    ----------
    network
        Chosen mesh edges and the problems that they were chosen for.

    Returns
    -------
    list of tuple
        Place in the working CRS, and what is wrong there; each once.
    """
    found: dict[tuple[float, float, str], shapely.Point] = {}
    for solved in network.solved:
        problem = solved.problem
        if not problem.requirements:
            continue
        for broken in check_requirements(problem, facts_of(problem, solved.design.active)):
            place = _place(broken, problem.mesh)
            found[place.x, place.y, TEXTS.get(broken.kind, broken.text)] = place
    return [(place, text) for (_, _, text), place in found.items()]


def _place(broken: Violation, mesh: QuadMesh) -> shapely.Point:
    """Return the middle of the first edge, or the first vertex, that a violation is about."""
    if broken.edges:
        return shapely.Point(mesh.vertices[mesh.edges[broken.edges[0]]].mean(axis=0))
    if broken.vertices:
        return shapely.Point(mesh.vertices[broken.vertices[0]])
    return shapely.Point(mesh.vertices.mean(axis=0))
