"""Pull boundary vertices onto the ends of existing streets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from .quadmesh import FloatArray
from .quality import score
from .rings import Ring
from .variants import EXACT, PartMesh

REACH = 0.4
SPACING = 0.5
FAR = 1e6
LEAST_JACOBIAN = 0.45


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
    spoil the mesh are taken back, the longest first.

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
            if _apply(part, pulls, points, h, area, guide):
                taken.update(p[1] for p in pulls)
                break
            pulls = pulls[:-1]


def _matches(
    part: PartMesh, points: FloatArray, h: float
) -> list[tuple[int, int, float, float]]:
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


def _spaced(
    part: PartMesh, pulls: Sequence[tuple[int, int, float, float]], h: float
) -> list[tuple[int, int, float, float]]:
    """Leave out pulls that bring a vertex too near to a held or pulled one, or past it."""
    held = {
        int(v): float(part.arc[v]) for v in np.flatnonzero(part.held & (part.draft.ring >= 0))
    }
    kept = []
    for pull in pulls:
        trial = {**held, pull[0]: pull[2]}
        ring_index = int(part.draft.ring[pull[0]])
        if _in_order(part.rings[ring_index], part.draft.loops[ring_index].tolist(), trial, h):
            held = trial
            kept.append(pull)
    return kept


def _in_order(ring: Ring, loop: Sequence[int], held: dict[int, float], h: float) -> bool:
    """Tell whether held vertices keep their order and room for those between them."""
    places = [(i, held[v]) for i, v in enumerate(loop) if v in held]
    if len(places) < 2:
        return True
    total = 0.0
    for (i, a), (j, b) in zip(places, [*places[1:], (places[0][0] + len(loop), places[0][1])]):
        room = float(np.mod(b - a, ring.length))
        total += room
        if room < SPACING * h * (j - i) and room < 0.999 * ring.length * (j - i) / len(loop):
            return False
    return total < 1.01 * ring.length


def _apply(
    part: PartMesh,
    pulls: Sequence[tuple[int, int, float, float]],
    points: FloatArray,
    h: float,
    area: float,
    guide: float | None,
) -> bool:
    """Hold the pulled vertices and smooth; take it over if the mesh stays good."""
    smoother = part.smoother
    vertices, arc, held = part.vertices.copy(), part.arc.copy(), part.held.copy()
    for vertex, point, place, _ in pulls:
        turns = np.round((arc[vertex] - place) / part.rings[part.draft.ring[vertex]].length)
        arc[vertex] = place + turns * part.rings[part.draft.ring[vertex]].length
        vertices[vertex] = points[point]
        held[vertex] = True
    vertices, arc = smoother.smooth(vertices, arc, held, rounds=3, steps=150)
    value = score(smoother.topology, vertices, h, area, guide)
    least = smoother.least_sine(vertices)
    before = smoother.least_sine(part.vertices)
    if value > part.score + 0.6 or least < min(LEAST_JACOBIAN, before - 0.05):
        return False
    if not _well_spaced(part, arc, [p[0] for p in pulls], h):
        return False
    part.vertices, part.arc, part.held, part.score = vertices, arc, held, value
    part.attracted = {v: p for v, p, _, _ in pulls}
    return True


def _well_spaced(part: PartMesh, arc: FloatArray, pulled: Sequence[int], h: float) -> bool:
    """Tell whether the neighbours of pulled vertices stay half an edge length away."""
    for ring, loop in zip(part.rings, part.draft.loops):
        order = loop.tolist()
        for v in set(pulled) & set(order):
            i = order.index(v)
            for a, b in ((order[i - 1], v), (v, order[(i + 1) % len(order)])):
                room = float(np.mod(arc[b] - arc[a], ring.length))
                if not SPACING * h <= room < 0.6 * ring.length:
                    return False
    return True
