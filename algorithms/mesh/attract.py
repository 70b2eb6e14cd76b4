"""Pull boundary vertices onto the ends of existing streets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from .quadmesh import FloatArray
from .quality import scaled_jacobians, score
from .rings import Ring
from .variants import EXACT, PartMesh

REACH = 0.4
SPACING = 0.5
FAR = 1e6
LEAST_JACOBIAN = 0.45
WORSE = 0.6
"""Rise of the score up to which pulls are worth it."""

Pull = tuple[int, int, float, float]
"""Vertex, point, arc length of the point, way along the ring in metres."""


def attract(
    parts: Sequence[PartMesh],
    points: FloatArray,
    h: float,
    areas: Sequence[float],
    guide: float | None,
) -> None:
    """Pull the nearest free boundary vertex onto each point, one to one, and smooth again.

    A vertex is free if it is neither a corner nor fixed. It must lie within 0.4 h of the
    point along the ring, and neighbours on the boundary stay at least 0.5 h apart. Pulls that
    spoil the mesh are taken back, the worst first.

    Parameters
    ----------
    parts
        Meshes of the parts of a site; changed in place, `attracted` is filled.
    points
        Shape (k, 2), metres.
    h
        Edge length, metres.
    areas
        Area of each part.
    guide
        As for `quality.score`.
    """
    taken: set[int] = set()
    for part, area in zip(parts, areas):
        pulls = [p for p in _matches(part, points, h) if p[1] not in taken]
        pulls = _spaced(part, pulls, h)
        while pulls:
            spoiled = _apply(part, pulls, points, h, area, guide)
            if spoiled is None:
                taken.update(p[1] for p in pulls)
                break
            pulls.remove(spoiled)


def _matches(part: PartMesh, points: FloatArray, h: float) -> list[Pull]:
    """Return (vertex, point, arc length, way) of the best matching, shortest way first."""
    projections = [ring.project(points) for ring in part.rings]
    nearest = np.argmin(np.array([d for _, d in projections]), axis=0)
    found = []
    for r, ring in enumerate(part.rings):
        arc, distance = projections[r]
        here = np.flatnonzero((nearest == r) & (distance <= EXACT * h))
        free = (part.draft.ring == r) & ~part.held & (part.smoother.topology.valences == 3)
        members = np.flatnonzero(free)
        if not len(here) or not len(members):
            continue
        gap = ring.gap(part.arc[members][:, None], arc[here][None])
        # a convex cost keeps the order along the ring
        cost = np.where(gap <= REACH * h, (gap / h) ** 2, FAR)
        rows, columns = linear_sum_assignment(cost)
        for i, j in zip(rows.tolist(), columns.tolist()):
            if cost[i, j] < FAR:
                point = int(here[j])
                found.append((int(members[i]), point, float(arc[point]), float(gap[i, j])))
    return sorted(found, key=lambda p: (p[3], p[1]))


def _spaced(part: PartMesh, pulls: Sequence[Pull], h: float) -> list[Pull]:
    """Leave out pulls that bring a vertex too near to a held or pulled one, or past it."""
    held = {int(v): float(part.arc[v]) for v in np.flatnonzero(part.held & (part.draft.ring >= 0))}
    kept = []
    for pull in pulls:
        ring_index = int(part.draft.ring[pull[0]])
        loop = part.draft.loops[ring_index].tolist()
        if _has_room(part.rings[ring_index], loop, held, pull, h):
            held[pull[0]] = pull[2]
            kept.append(pull)
    return kept


def _has_room(
    ring: Ring, loop: Sequence[int], held: dict[int, float], pull: Pull, h: float
) -> bool:
    """Tell whether a pulled vertex stays between the held ones, with room for all between."""
    size, here = len(loop), loop.index(pull[0])
    for step in (1, -1):
        count = next((k for k in range(1, size) if loop[(here + step * k) % size] in held), 0)
        if count:
            other = held[loop[(here + step * count) % size]]
            room = float(np.mod(step * (other - pull[2]), ring.length))
            if room < SPACING * h * count or room > 0.9 * ring.length:
                return False
    return True


def _apply(
    part: PartMesh,
    pulls: Sequence[Pull],
    points: FloatArray,
    h: float,
    area: float,
    guide: float | None,
) -> Pull | None:
    """Hold the pulled vertices, smooth, and take it over if the mesh stays good.

    Returns
    -------
    tuple or None
        The pull that spoils the mesh most, or None where it was taken over.
    """
    smoother = part.smoother
    vertices, arc, held = part.vertices.copy(), part.arc.copy(), part.held.copy()
    for vertex, point, place, _ in pulls:
        length = part.rings[part.draft.ring[vertex]].length
        arc[vertex] = place + np.round((arc[vertex] - place) / length) * length
        vertices[vertex] = points[point]
        held[vertex] = True
    vertices, arc = smoother.smooth(vertices, arc, held, rounds=3, steps=150)
    for pull in pulls:
        if not _well_spaced(part, arc, pull[0], h):
            return pull
    jacobian = scaled_jacobians(vertices, smoother.faces)
    least = float(scaled_jacobians(part.vertices, smoother.faces).min())
    if jacobian.min() < min(LEAST_JACOBIAN, least - 0.05):
        worst = vertices[smoother.faces[int(jacobian.argmin())]].mean(axis=0)
        return min(pulls, key=lambda p: float(np.hypot(*(vertices[p[0]] - worst))))
    value = score(smoother.topology, vertices, h, area, guide)
    if value > part.score + WORSE:
        return max(pulls, key=lambda p: (p[3], p[1]))
    part.vertices, part.arc, part.held, part.score = vertices, arc, held, value
    part.attracted = {v: p for v, p, _, _ in pulls}
    return None


def _well_spaced(part: PartMesh, arc: FloatArray, vertex: int, h: float) -> bool:
    """Tell whether the neighbours of a pulled vertex stay half an edge length away."""
    r = int(part.draft.ring[vertex])
    ring, loop = part.rings[r], part.draft.loops[r].tolist()
    i = loop.index(vertex)
    rooms = [
        float(np.mod(arc[b] - arc[a], ring.length))
        for a, b in ((loop[i - 1], vertex), (vertex, loop[(i + 1) % len(loop)]))
    ]
    return all(SPACING * h <= room < 0.6 * ring.length for room in rooms)
