"""The ground that corridors take: edges widened to strips, corners filled by mitres."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Polygon

from ...mesh.quadmesh import BoolArray, FloatArray, IntArray, QuadMesh

STRAIGHT_ON = math.radians(150.0)
"""A wall that leaves a corridor at less than this is where the strip ends; else it ends square."""
SHARP = math.radians(300.0)
"""Round an outer angle above this a corner is cut square, since a mitre would be a spike."""
NOISE = 1e-10
"""Metres; points of an outline this near to a straight line are left out."""
GRIDS = (2.0**-30, 2.0**-26, 2.0**-23)
"""Metres; grids on which strips are united where rounding is in the way, the finest first."""


def strip_depths(mesh: QuadMesh, room: IntArray, width: float) -> FloatArray:
    """Return how deep a corridor lies beside each half-edge, shape (4 m,), metres.

    Half the width where there are rooms to both sides of the edge; all of it along an outer wall,
    a courtyard or an obstacle; 0 on an obstacle.

    Parameters
    ----------
    mesh
        A mesh of m faces.
    room
        Shape (m,). Room of each face, -1 for obstacles.
    width
        Of corridors, metres.
    """
    own = np.repeat(room, 4)
    across = np.where(mesh.twins >= 0, own[mesh.twins], -1)
    depth: FloatArray = np.where(own < 0, 0.0, np.where(across < 0, width, width / 2.0))
    return depth


def dents(
    mesh: QuadMesh, room: IntArray, grounds: list[Polygon], active: BoolArray, width: float
) -> list[Any]:
    """Return the part of each room's ground that corridors take.

    Parameters
    ----------
    mesh
        A mesh, metres; coordinates near 0 keep the most digits.
    room
        Shape (m,). Room of each face, -1 for obstacles.
    grounds
        Union of the faces of each room.
    active
        Shape (e,). Edges of corridors, none inside a room.
    width
        Of corridors, metres.
    """
    depth = strip_depths(mesh, room, width)
    parts: list[list[Polygon]] = [[] for _ in grounds]
    for half in np.flatnonzero(active[mesh.face_edges.ravel()] & (depth > 0)).tolist():
        parts[int(room[half // 4])] += _strip(mesh, room, active, depth, half)
    for vertex in np.unique(mesh.edges[active]).tolist():
        wedge = _wedges(mesh, active, depth, vertex)
        if wedge:
            for own in np.unique(room[_faces_at(mesh, vertex)]).tolist():
                if own >= 0:
                    parts[own] += wedge
    return [
        shapely.simplify(shapely.intersection(_united(own), ground), NOISE)
        for own, ground in zip(parts, grounds)
    ]


def _united(strips: list[Polygon]) -> Any:
    """Return the union of strips that meet within rounding, which some unions do not survive."""
    for grid in (None, *GRIDS):
        with contextlib.suppress(shapely.errors.GEOSException):
            return shapely.union_all(strips, grid_size=grid)
    # a little wider they overlap instead of meeting
    return shapely.union_all(shapely.buffer(strips, GRIDS[0], join_style="mitre"))


def half_edge_line(mesh: QuadMesh, half: int) -> FloatArray:
    """Return the points (k, 2) of a half-edge, its face on the left."""
    edge = int(mesh.face_edges[half // 4, half % 4])
    line = mesh.edge_line(edge)
    return line if mesh.edges[edge, 0] == mesh.faces[half // 4, half % 4] else line[::-1]


def _faces_at(mesh: QuadMesh, vertex: int) -> IntArray:
    """Return the faces around a vertex."""
    found: IntArray = np.flatnonzero((mesh.faces == vertex).any(axis=1))
    return found


def _strip(
    mesh: QuadMesh, room: IntArray, active: BoolArray, depth: FloatArray, half: int
) -> list[Polygon]:
    """Return the strip to the left of a half-edge, as a quadrilateral for each straight piece."""
    line, deep = half_edge_line(mesh, half), float(depth[half])
    along = np.diff(line, axis=0)
    along /= np.hypot(*along.T)[:, None]
    aside = deep * np.column_stack([-along[:, 1], along[:, 0]])
    before, after = (_overshoot(mesh, room, active, half, ahead) for ahead in (False, True))
    quads = []
    for k, (a, b) in enumerate(zip(line, line[1:])):
        far_a, far_b = a + aside[k], b + aside[k]
        if k == 0:
            far_a = far_a - before * deep * along[k]
        if k == len(line) - 2:
            far_b = far_b + after * deep * along[k]
        quads.append(Polygon([a, b, far_b, far_a]))
    for k in range(len(along) - 1):
        quads += _corner(line[k + 1], along[k + 1], -along[k], deep, deep)
    return quads


def _overshoot(mesh: QuadMesh, room: IntArray, active: BoolArray, half: int, ahead: bool) -> float:
    """Return how far a strip goes beyond the end of its edge, as a multiple of its depth.

    It runs up to the wall that leaves the end of the edge at an obtuse angle, so that no spike of
    the room stays between them.
    """
    turn = 1 if ahead else 3
    now = half // 4 * 4 + (half + turn) % 4
    while True:
        edge, twin = int(mesh.face_edges[now // 4, now % 4]), int(mesh.twins[now])
        if active[edge]:
            return 0.0
        if twin < 0 or room[twin // 4] != room[half // 4]:
            break
        now = twin // 4 * 4 + (twin + turn) % 4
        if now == half:
            return 0.0
    own, wall = half_edge_line(mesh, half), half_edge_line(mesh, now)
    if ahead:
        angle = _bearing(own[-2] - own[-1]) - _bearing(wall[1] - wall[0])
    else:
        angle = _bearing(wall[-2] - wall[-1]) - _bearing(own[1] - own[0])
    angle %= 2 * math.pi
    return math.tan(angle - math.pi / 2) if math.pi / 2 < angle < STRAIGHT_ON else 0.0


def _wedges(mesh: QuadMesh, active: BoolArray, depth: FloatArray, vertex: int) -> list[Polygon]:
    """Return what fills the outer corners where corridors turn at a vertex."""
    rays = []
    for edge in mesh.vertex_edges[vertex].tolist():
        if active[edge]:
            line = mesh.edge_line(edge)
            line = line if mesh.edges[edge, 0] == vertex else line[::-1]
            way = (line[1] - line[0]) / np.hypot(*(line[1] - line[0]))
            sides = (_depth(mesh, depth, edge, vertex, left) for left in (True, False))
            rays.append((_bearing(way), way, *sides))
    rays.sort(key=lambda ray: ray[0])
    # a corridor round the corner of an obstacle goes on where another one leaves it
    walls = [ray for ray in rays if not (ray[2] and ray[3])]
    found: list[Polygon] = []
    for some in (rays, walls) if len(walls) < len(rays) else (rays,):
        if len(some) < 2:
            continue
        for (_, a, left, _), (_, b, _, right) in zip(some, some[1:] + some[:1]):
            if left and right:
                found += _corner(mesh.vertices[vertex], a, b, left, right)
    return found


def _depth(mesh: QuadMesh, depth: FloatArray, edge: int, vertex: int, left: bool) -> float:
    """Return the depth to the left or right of an edge seen from one of its ends."""
    for face in mesh.edge_faces[edge].tolist():
        if face >= 0:
            k = mesh.face_edges[face].tolist().index(edge)
            if (mesh.faces[face, k] == vertex) == left:
                return float(depth[4 * face + k])
    return 0.0


def _corner(
    at: FloatArray, a: FloatArray, b: FloatArray, left: float, right: float
) -> list[Polygon]:
    """Return the mitre between the left side of ray a and the right side of ray b, both from `at`.

    Nothing where the angle from a to b, counter-clockwise, is no outer one.
    """
    angle = (_bearing(b) - _bearing(a)) % (2 * math.pi)
    if angle <= math.pi + 1e-9:
        return []
    p = left * np.array([-a[1], a[0]])
    q = right * np.array([b[1], -b[0]])
    if angle > SHARP:
        return [Polygon([at, at + p, at + p - left * a, at + q - right * b, at + q])]
    # p + s a = q + t b
    s, t = np.linalg.solve(np.column_stack([a, -b]), q - p)
    if max(s, t) > 0 or min(s, t) < -2 * max(left, right):
        # nearly straight on with another depth: a step
        return [Polygon([at, at + p, at + q])]
    return [Polygon([at, at + p, at + p + s * a, at + q])]


def _bearing(way: FloatArray) -> float:
    return math.atan2(float(way[1]), float(way[0]))
