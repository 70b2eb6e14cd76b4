"""What was asked of the network as a whole and could not be had, place by place."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import shapely

from ..mesh import QuadMesh
from ..network.checks.facts import Violation, facts_of
from ..network.checks.requirements import check_requirements
from ..network.requirements.links import Link
from .levels import LevelledNetwork
from .why_not import Place

#: What is wrong, for a planner, by the kind of requirement.
TEXTS: Mapping[str, str] = {
    "link": "There is no short way from this part of the site to one next to it.",
    "through route": "No route without side streets leads through the site from here.",
    "distance to a sink": "From here the way out is longer than asked.",
    "junction spacing": "Two junctions are nearer to each other here than asked.",
    "two ways": "This street is the only way to a place: it cannot be one-way.",
}


def unmet_requirements(network: LevelledNetwork) -> list[Place]:
    """List where soft requirements are broken, as the independent check sees it.

    Ends of through routes that were moved by more than a mesh edge are listed, too, and blocks
    for which the last level found nothing.

    Parameters
    ----------
    network
        Chosen mesh edges and the problems that they were chosen for.

    Returns
    -------
    list of Place
        Each once.
    """
    found: dict[tuple[float, float, str], Place] = {}
    for remark in (*_broken(network), *_moved(network), *_left(network)):
        found.setdefault((remark.point.x, remark.point.y, remark.problem), remark)
    return list(found.values())


def _broken(network: LevelledNetwork) -> Iterator[Place]:
    """Yield the violations of requirements."""
    for solved in network.solved:
        problem = solved.problem
        if not problem.requirements:
            continue
        for broken in check_requirements(problem, facts_of(problem, solved.design.active)):
            yield Place(
                _place(broken, problem.mesh),
                TEXTS.get(broken.kind, broken.text),
                "left so: it would cost more than it is worth, or cannot be had",
            )


def _moved(network: LevelledNetwork) -> Iterator[Place]:
    """Yield the ends of drawn routes that begin or end elsewhere."""
    routes = [
        (link, solved.problem.mesh)
        for solved in network.solved
        for link in solved.problem.requirements
        if isinstance(link, Link) and link.private
    ]
    for line, feature in network.ground.preferences.routes:
        ends = [shapely.Point(line.coords[i][:2]) for i in (0, -1)]
        pairs = []
        for link, mesh in routes:
            goals = [shapely.Point(mesh.vertices[v]) for v in (link.start, link.end)]
            pairs.append(([a.distance(b) for a, b in zip(ends, goals)], mesh.edge_length))
        gaps, cell = min(pairs, key=lambda pair: sum(pair[0]), default=([0.0, 0.0], math.inf))
        for end, gap in zip(ends, gaps):
            if gap > cell:
                yield Place(
                    end,
                    f"Through route {feature} begins or ends {gap:.0f} m from here, where it was "
                    "drawn.",
                    "moved to the nearest place where streets can leave the site; draw its end at "
                    "a road, or add the road that is missing",
                )


def _left(network: LevelledNetwork) -> Iterator[Place]:
    """Yield the blocks for which the last level found nothing."""
    for place in network.left:
        yield Place(
            place,
            "No culs-de-sac could be found for this block.",
            "left with the streets of the levels above; allow more time, or give the rules that "
            "are in the way a price",
        )


def _place(broken: Violation, mesh: QuadMesh) -> shapely.Point:
    """Return the middle of the first edge, or the first vertex, that a violation is about."""
    if broken.edges:
        return shapely.Point(mesh.vertices[mesh.edges[broken.edges[0]]].mean(axis=0))
    if broken.vertices:
        return shapely.Point(mesh.vertices[broken.vertices[0]])
    return shapely.Point(mesh.vertices.mean(axis=0))
