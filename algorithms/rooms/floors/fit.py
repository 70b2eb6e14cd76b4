"""Make a mesh tile a footprint exactly: its boundary takes the course of the footprint's rings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon

from ...mesh.quadmesh import BoolArray, FloatArray, IntArray, QuadMesh
from ...mesh.quality import scaled_jacobians
from .rings import NOISE, outlines

CORNER = np.radians(30.0)
"""Where a ring turns by more, a vertex should lie."""
REACH = 0.6
"""A vertex may be moved this many modules along a ring to a corner."""
LEAST_SINE = 0.3
"""Worst angle that such a move may leave."""
LEAST_STEP = 0.1
"""Least distance of neighbouring vertices along a ring, in modules."""
MOST_BAD = 6
"""With more faces than this that cross others, no vertex is moved to help."""
AREA = 1e-7
"""Accepted error of the area, as a share."""


@dataclass(eq=False)
class _Side:
    """A loop of boundary vertices (k,), their places (k,) along a ring, and the closed ring."""

    loop: IntArray
    arc: FloatArray
    ring: FloatArray


def fitted(mesh: QuadMesh, polygon: Polygon) -> QuadMesh | None:
    """Put the boundary of a mesh on the rings of a footprint.

    Parameters
    ----------
    mesh
        A mesh that covers the footprint nearly.
    polygon
        The footprint, metres.

    Returns
    -------
    QuadMesh or None
        With the true course of the rings as boundary arcs; its faces tile the footprint. None
        where it cannot be done.
    """
    rings = outlines(polygon)
    loops = boundary_loops(mesh)
    which = _matched(mesh, loops, rings)
    if which is None:
        return None
    vertices = mesh.vertices.copy()
    fixed = np.zeros(len(vertices), dtype=np.bool_)
    sides: list[_Side] = []
    for loop, k in zip(loops, which):
        arc = _on_ring(vertices[loop], rings[k])
        if arc is None:
            return None
        _to_corners(mesh, loop, arc, rings[k], vertices, fixed)
        sides.append(_Side(loop, arc, rings[k]))
    made = _mended(mesh, sides, vertices, fixed)
    if made is None or scaled_jacobians(made.vertices, made.faces).min() <= 0:
        return None
    return made if tiles(made, polygon) else None


def face_polygons(mesh: QuadMesh) -> Any:
    """Return each face with its true sides, array (m,) of polygons."""
    plain = shapely.polygons(mesh.vertices[mesh.faces])
    bent = np.zeros(len(mesh.edges), dtype=np.bool_)
    bent[list(mesh.boundary_arcs)] = True
    for f in np.flatnonzero(bent[mesh.face_edges].any(axis=1)).tolist():
        sides = []
        for edge, start in zip(mesh.face_edges[f].tolist(), mesh.faces[f].tolist()):
            line = mesh.edge_line(edge)
            sides.append((line if mesh.edges[edge, 0] == start else line[::-1])[:-1])
        plain[f] = Polygon(np.vstack(sides))
    return plain


def tiles(mesh: QuadMesh, polygon: Polygon) -> bool:
    """Tell whether the faces of a mesh, with their true sides, tile a polygon."""
    faces = face_polygons(mesh)
    if not shapely.is_valid(faces).all():
        return False
    union, limit = shapely.union_all(faces), AREA * polygon.area
    # as much ground in the faces as in their union: no overlaps; neighbours share vertices anyway
    total = float(shapely.area(faces).sum())
    if abs(total - polygon.area) > limit or abs(total - union.area) > limit:
        return False
    return bool(shapely.difference(union, polygon).area <= limit)


def boundary_loops(mesh: QuadMesh) -> list[IntArray]:
    """Return the boundary of a mesh as loops of vertices with the faces on their left."""
    start, end = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    outside = mesh.boundary_edges[mesh.face_edges.ravel()]
    following = dict(zip(start[outside].tolist(), end[outside].tolist()))
    loops = []
    while following:
        first = min(following)
        loop = [first]
        current = following.pop(first)
        while current != first:
            loop.append(current)
            current = following.pop(current)
        loops.append(np.array(loop, dtype=np.int64))
    return loops


def corner_places(ring: FloatArray, module: float) -> tuple[FloatArray, FloatArray]:
    """Return where along a closed ring it turns sharply, metres, and by how much, radians."""
    line = LineString(ring)
    plain = np.asarray(shapely.simplify(line, NOISE * module).coords)
    step = np.diff(plain, axis=0)
    heading = np.arctan2(step[:, 1], step[:, 0])
    turn = np.abs((heading - np.roll(heading, 1) + np.pi) % (2 * np.pi) - np.pi)
    sharp = np.flatnonzero(turn > CORNER)
    return shapely.line_locate_point(line, shapely.points(plain[sharp])), turn[sharp]


def _matched(mesh: QuadMesh, loops: list[IntArray], rings: list[FloatArray]) -> list[int] | None:
    """Return the ring of each loop."""
    if len(loops) != len(rings):
        return None
    lines = [LineString(ring) for ring in rings]
    far = np.array(
        [
            [
                float(shapely.distance(line, shapely.points(mesh.vertices[loop])).mean())
                for line in lines
            ]
            for loop in loops
        ]
    )
    which: list[int] = far.argmin(axis=1).tolist()
    return which if sorted(which) == list(range(len(rings))) else None


def _on_ring(points: FloatArray, ring: FloatArray) -> FloatArray | None:
    """Return the places (k,) of points along a ring, metres, in its order, or None."""
    line = LineString(ring)
    whole = line.length
    at = shapely.line_locate_point(line, shapely.points(points))
    for _ in range(4):
        step = (np.roll(at, -1) - at) % whole
        back = (step > whole / 2) | (step < 1e-6)
        if not back.any():
            break
        # vertices that go back along the ring are spread between those that do not
        loose = back | np.roll(back, 1)
        sure = np.flatnonzero(~loose)
        if len(sure) < 3:
            return None
        rise = (
            at[sure[0]] + np.concatenate([[0], np.cumsum(np.diff(at[sure]) % whole), [whole]])[:-1]
        )
        index = np.concatenate([sure, [sure[0] + len(at)]])
        place = np.interp(
            (np.arange(len(at)) - sure[0]) % len(at) + sure[0],
            index,
            np.concatenate([rise, [at[sure[0]] + whole]]),
        )
        at = place % whole
    step = (np.roll(at, -1) - at) % whole
    return at if abs(step.sum() - whole) < 1e-6 * whole and step.min() > 1e-6 else None


def _to_corners(
    mesh: QuadMesh,
    loop: IntArray,
    arc: FloatArray,
    ring: FloatArray,
    vertices: FloatArray,
    fixed: BoolArray,
) -> None:
    """Move vertices onto a ring, and those next to a sharp corner into it; changes the arrays."""
    line, h = LineString(ring), mesh.edge_length
    whole = line.length
    vertices[loop] = shapely.get_coordinates(shapely.line_interpolate_point(line, arc))
    at, turn = corner_places(ring, h)
    off = np.abs((arc[None] - at[:, None] + whole / 2) % whole - whole / 2)
    for c in np.lexsort((np.round(-turn, 2), np.round(off.min(axis=1), 6))).tolist():
        for v in np.argsort(off[c], kind="stable")[:2].tolist():
            if off[c, v] > REACH * h or fixed[loop[v]]:
                continue
            before = (at[c] - arc[v - 1]) % whole
            after = (arc[(v + 1) % len(arc)] - at[c]) % whole
            span = (arc[(v + 1) % len(arc)] - arc[v - 1]) % whole
            if abs(before + after - span) > 1e-6 or min(before, after) < LEAST_STEP * h:
                continue
            around = mesh.faces[(mesh.faces == loop[v]).any(axis=1)]
            held = vertices[loop[v]].copy()
            worst = scaled_jacobians(vertices, around).min()
            vertices[loop[v]] = _exact(line, ring, float(at[c]))
            if scaled_jacobians(vertices, around).min() < min(LEAST_SINE, worst - 1e-9):
                vertices[loop[v]] = held
                continue
            arc[v] = at[c]
            fixed[loop[v]] = True
            break


def _exact(line: LineString, ring: FloatArray, at: float) -> FloatArray:
    """Return the vertex of a ring at a place, as it was given."""
    point = line.interpolate(at)
    nearest = int(np.hypot(*(ring - (point.x, point.y)).T).argmin())
    return np.asarray(ring[nearest])


def _arcs(
    mesh: QuadMesh, loop: IntArray, arc: FloatArray, ring: FloatArray, vertices: FloatArray
) -> dict[int, FloatArray]:
    """Return the course of the ring between neighbouring vertices where it bends."""
    whole = LineString(ring).length
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ring, axis=0).T))])[:-1]
    found = {}
    for i in range(len(loop)):
        u, v = int(loop[i]), int(loop[(i + 1) % len(loop)])
        step = float((arc[(i + 1) % len(loop)] - arc[i]) % whole)
        ahead = (at - arc[i]) % whole
        between = np.flatnonzero((ahead > 1e-6) & (ahead < step - 1e-6))
        if not len(between):
            continue
        points = ring[between[np.argsort(ahead[between], kind="stable")]]
        course = np.vstack([vertices[u], points, vertices[v]])
        found[mesh.edge_between(u, v)] = course if u < v else course[::-1]
    return found


def _drawn(
    mesh: QuadMesh, sides: list[_Side], vertices: FloatArray, fixed: BoolArray
) -> tuple[QuadMesh, IntArray]:
    """Return the mesh with its true boundary, and the faces that cross themselves or others."""
    arcs: dict[int, FloatArray] = {}
    for side in sides:
        arcs.update(_arcs(mesh, side.loop, side.arc, side.ring, vertices))
    made = QuadMesh(vertices, mesh.faces, mesh.edge_length, boundary_arcs=arcs, fixed=fixed)
    faces = face_polygons(made)
    bad = ~shapely.is_valid(faces)
    if not bad.any():
        bent = np.flatnonzero(np.isin(mesh.face_edges, list(arcs)).any(axis=1))
        first, second = shapely.STRtree(faces).query(faces[bent], predicate="intersects")
        shared = shapely.area(shapely.intersection(faces[bent[first]], faces[second]))
        over = (shared > AREA * mesh.edge_length**2) & (bent[first] != second)
        bad[bent[first[over]]] = True
        bad[second[over]] = True
    return made, np.flatnonzero(bad)


def _mended(
    mesh: QuadMesh, sides: list[_Side], vertices: FloatArray, fixed: BoolArray
) -> QuadMesh | None:
    """Draw the mesh; where a jog cuts through a face, take its other corner for the vertex."""
    made, bad = _drawn(mesh, sides, vertices, fixed)
    while 0 < len(bad) <= MOST_BAD:
        best: tuple[int, float, QuadMesh, IntArray, _Side, FloatArray] | None = None
        for v in np.unique(mesh.faces[bad]).tolist():
            for side in sides:
                at = np.flatnonzero(side.loop == v)
                for place, xy in _beside(side, int(at[0])) if len(at) else ():
                    arc, moved = side.arc.copy(), made.vertices.copy()
                    arc[at[0]], moved[v] = place, xy
                    others = [
                        own if own is not side else _Side(own.loop, arc, own.ring) for own in sides
                    ]
                    trial, left = _drawn(mesh, others, moved, fixed)
                    far = float(np.hypot(*(xy - made.vertices[v])))
                    if len(left) < len(bad) and (best is None or (len(left), far) < best[:2]):
                        best = (len(left), far, trial, left, side, arc)
        if best is None:
            return None
        made, bad = best[2], best[3]
        best[4].arc = best[5]
    return None if len(bad) else made


def _beside(side: _Side, i: int) -> list[tuple[float, FloatArray]]:
    """Return places and positions of the ring's points between the neighbours of a vertex."""
    along = np.hypot(*np.diff(side.ring, axis=0).T)
    at, whole = np.concatenate([[0.0], np.cumsum(along)])[:-1], float(along.sum())
    begin, end = side.arc[i - 1], side.arc[(i + 1) % len(side.arc)]
    ahead = (at - begin) % whole
    between = (ahead > 1e-3) & (ahead < (end - begin) % whole - 1e-3)
    between &= np.abs(at - side.arc[i]) > 1e-3
    return [(float(at[k]), side.ring[k]) for k in np.flatnonzero(between).tolist()]


def near(point: Point, vertices: FloatArray) -> IntArray:
    """Return vertices from the nearest to the farthest from a point."""
    return np.argsort(np.round(np.hypot(*(vertices - (point.x, point.y)).T), 6), kind="stable")
