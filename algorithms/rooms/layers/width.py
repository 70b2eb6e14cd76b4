"""Corridors of a given width, and rooms that give up the ground for them.

CND section 5.2 leaves corridors as lines between rooms. Here they are widened, and rooms,
corridors and obstacles tile the footprint exactly: they are put together from the pieces of one
arrangement of lines, so that neighbours share every vertex.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Polygon

from ...errors import InputError
from ...mesh.quadmesh import BoolArray, IntArray, QuadMesh
from ..floors.fit import face_polygons
from ..types import RoomPlan, RoomProblem
from .strips import dents

GRID = 2.0**-30
"""Metres to which shared vertices are rounded: what a double holds at a northing of 6,000 km."""
CHIP = 0.05
"""Share of a room that a corridor may cut off and keep."""
NARROW = 0.3
"""Least clear width of a room, metres."""
STEP = 0.05
"""Widths are proposed in steps of this many metres."""
AREA = 1e-6
"""Accepted error of the footprint's area, as a share."""

_ROOM, _CORRIDOR = 0, 1


@dataclass(frozen=True, eq=False)
class Ground:
    """What lies on a storey; metres in the CRS of the mesh.

    Attributes
    ----------
    rooms
        Ground of each room, in the order of `RoomPlan.rooms`.
    corridors
        Ground of each connected corridor.
    obstacles
        Ground of each connected obstacle.
    corridor
        Shape (e,). Corridor of each active edge, else -1.
    """

    rooms: tuple[Polygon, ...]
    corridors: tuple[Polygon, ...]
    obstacles: tuple[Polygon, ...]
    corridor: IntArray


def corridor_edges(problem: RoomProblem, plan: RoomPlan) -> BoolArray:
    """Return the edges along which corridors run, shape (e,)."""
    return np.asarray(plan.active | problem.network.existing)


def rooms_of_faces(problem: RoomProblem, plan: RoomPlan) -> IntArray:
    """Return the place in `RoomPlan.rooms` of the room on each face, shape (m,); -1 for obstacles.

    Raises
    ------
    InputError
        If a face of the floor is in no room or in two, or an obstacle is in one (CND eq. 15).
    """
    room = np.full(len(problem.floor), -1, dtype=np.int64)
    for k, placement in enumerate(plan.rooms):
        faces = list(problem.placements.faces[placement])
        double = [f for f in faces if room[f] >= 0 or not problem.floor[f]]
        if double:
            raise InputError(f"Room {k + 1} lies on face {double[0]}, which is not free.")
        room[faces] = k
    bare = np.flatnonzero(problem.floor & (room < 0))
    if len(bare):
        raise InputError(f"Face {int(bare[0])} is in no room ({len(bare)} in all).")
    return room


def widen(problem: RoomProblem, plan: RoomPlan, polygon: Polygon, width: float) -> Ground:
    """Widen the corridors of a plan and shrink its rooms.

    Each edge of a corridor is widened by half the width to both sides; along outer walls,
    courtyards and obstacles the corridor takes its whole width from the floor. Corners are
    mitred, dead ends are square, or end at the wall in front of them.

    Parameters
    ----------
    problem, plan
        A floor and its plan, metres.
    polygon
        The footprint that the mesh tiles, metres.
    width
        Of corridors, metres, greater than 0.

    Returns
    -------
    Ground
        Polygons that tile the footprint; neighbours share every vertex.

    Raises
    ------
    InputError
        If a corridor so wide cuts a room in two or leaves nothing of it (the text names the
        width that would do), if the plan is none, or if the mesh does not tile the footprint.
    """
    if not (math.isfinite(width) and width > 0):
        raise InputError(f"The corridor width is {width} m.", "It must be greater than 0.")
    room, active = rooms_of_faces(problem, plan), corridor_edges(problem, plan)
    mesh, origin = _near_zero(problem.network.mesh)
    faces = face_polygons(mesh)
    if abs(float(shapely.area(faces).sum()) - polygon.area) > AREA * polygon.area:
        raise InputError(
            f"The mesh covers {float(shapely.area(faces).sum()):.1f} m², the footprint "
            f"{polygon.area:.1f} m².",
            "Make the mesh of this footprint again.",
        )
    _check_inside(problem, room, active)
    rooms = [shapely.coverage_union_all(faces[room == k]) for k in range(len(plan.rooms))]
    taken = dents(mesh, room, rooms, active, width)
    broken = _broken(rooms, taken)
    if broken is not None:
        raise _too_wide(problem, plan, broken, width, (mesh, room, rooms, active))
    shafts = shapely.get_parts(shapely.coverage_union_all(faces[room < 0])).tolist()
    return _arranged(mesh, origin, rooms, taken, shafts, active)


def _near_zero(mesh: QuadMesh) -> tuple[QuadMesh, Any]:
    """Return a mesh moved to the middle of its coordinates, where doubles are finest."""
    origin = np.round(mesh.vertices.mean(axis=0))
    arcs = {edge: arc - origin for edge, arc in mesh.boundary_arcs.items()}
    return replace(mesh, vertices=mesh.vertices - origin, boundary_arcs=arcs), origin


def _check_inside(problem: RoomProblem, room: IntArray, active: BoolArray) -> None:
    """Refuse corridors inside a room or an obstacle (CND eq. 16)."""
    pairs = problem.network.mesh.edge_faces
    sides = np.where(pairs >= 0, room[pairs], -1)
    wrong = np.flatnonzero(active & (sides[:, 0] == sides[:, 1]))
    if len(wrong):
        raise InputError(f"A corridor runs inside a room or an obstacle at edge {int(wrong[0])}.")


def _broken(rooms: list[Polygon], taken: list[Any]) -> tuple[int, str] | None:
    """Return the first room of which corridors leave too little, and what becomes of it."""
    for k, (room, dent) in enumerate(zip(rooms, taken)):
        rest = shapely.get_parts(shapely.difference(room, dent))
        kept = rest[shapely.area(rest) > CHIP * room.area]
        if len(kept) > 1:
            return k, f"cuts room {k + 1} ('{{}}') into {len(kept)} parts"
        if not len(kept) or shapely.buffer(kept[0], -NARROW / 2).is_empty:
            return k, f"leaves nothing of room {k + 1} ('{{}}')"
    return None


def _too_wide(
    problem: RoomProblem,
    plan: RoomPlan,
    broken: tuple[int, str],
    width: float,
    state: tuple[QuadMesh, IntArray, list[Polygon], BoolArray],
) -> InputError:
    """Return the error, with the largest width in steps that would do."""
    mesh, room, rooms, active = state
    low, high = 0, math.ceil(width / STEP - 1e-9)
    while high - low > 1:
        middle = (low + high) // 2
        fits = _broken(rooms, dents(mesh, room, rooms, active, middle * STEP)) is None
        low, high = (middle, high) if fits else (low, middle)
    name = problem.templates[int(problem.placements.template[plan.rooms[broken[0]]])].name
    remedy = (
        f"A width of {low * STEP:.2f} m would do; or take a larger module."
        if low
        else "Take a larger module."
    )
    return InputError(f"A corridor {width:g} m wide {broken[1].format(name)}.", remedy)


def _arranged(
    mesh: QuadMesh,
    origin: Any,
    rooms: list[Polygon],
    taken: list[Any],
    shafts: list[Polygon],
    active: BoolArray,
) -> Ground:
    """Put rooms, corridors and obstacles together from pieces between noded lines."""
    grounds = [*rooms, *shafts]
    lines = [shapely.boundary(g) for g in [*grounds, *(d for d in taken if not d.is_empty)]]
    noded = shapely.union_all(np.array(lines, dtype=object), grid_size=GRID)
    pieces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    inner = shapely.point_on_surface(pieces)
    which, ground = shapely.STRtree(grounds).query(inner, predicate="intersects")
    own = np.full(len(pieces), -1, dtype=np.int64)
    own[which] = ground
    # courtyards are between lines, too
    pieces, inner, own = pieces[own >= 0], inner[own >= 0], own[own >= 0]
    dent = np.array([*taken, *[Polygon()] * len(shafts)], dtype=object)
    kind = np.where(shapely.intersects(dent[own], inner), _CORRIDOR, _ROOM)
    middles = shapely.line_interpolate_point(_lines(mesh), 0.5, normalized=True)
    _give_back(pieces, kind, middles[active])
    _take_chips(pieces, kind, own, len(rooms))
    corridors = _parts(pieces[kind == _CORRIDOR])
    free = kind == _ROOM
    shrunk = [_parts(pieces[free & (own == k)])[0] for k in range(len(rooms))]
    of_edge = np.full(len(active), -1, dtype=np.int64)
    if len(corridors):
        of_edge[active] = shapely.STRtree(corridors).nearest(middles[active])
    others = [_parts(pieces[own == len(rooms) + k])[0] for k in range(len(shafts))]
    back = [_moved(polygons, origin) for polygons in (shrunk, corridors, others)]
    return Ground(back[0], back[1], back[2], of_edge)


def _parts(pieces: Any) -> list[Polygon]:
    """Return the connected unions of pieces, the largest first."""
    merged = shapely.coverage_union_all(pieces)
    if not shapely.is_valid(merged):
        # rings that touch themselves: the slower union divides them
        merged = shapely.union_all(pieces)
    parts = shapely.get_parts(merged).tolist()
    return sorted(parts, key=lambda part: -float(part.area))


def _lines(mesh: QuadMesh) -> Any:
    """Return the edges of a mesh as lines, shape (e,)."""
    lines = shapely.linestrings(mesh.vertices[mesh.edges])
    for edge, arc in mesh.boundary_arcs.items():
        lines[edge] = shapely.linestrings(arc)
    return lines


def _give_back(pieces: Any, kind: IntArray, middles: Any) -> None:
    """Turn pieces of corridor that hang together with no edge of a corridor back into rooms."""
    there = np.flatnonzero(kind == _CORRIDOR)
    parts = np.array(_parts(pieces[there]), dtype=object)
    if len(parts) < 2:
        return
    used = np.zeros(len(parts), dtype=np.bool_)
    used[shapely.STRtree(parts).query(middles, predicate="dwithin", distance=1e-6)[1]] = True
    for part in parts[~used]:
        kind[there[shapely.intersects(part, shapely.point_on_surface(pieces[there]))]] = _ROOM


def _take_chips(pieces: Any, kind: IntArray, own: IntArray, count: int) -> None:
    """Give the corridor what it cuts off a room."""
    for k in range(count):
        here = np.flatnonzero((own == k) & (kind == _ROOM))
        chips = _parts(pieces[here])[1:]
        if chips:
            points = shapely.point_on_surface(pieces[here])
            for chip in chips:
                kind[here[shapely.intersects(chip, points)]] = _CORRIDOR


def _moved(polygons: list[Polygon], origin: Any) -> tuple[Polygon, ...]:
    """Return polygons moved back to where they belong."""
    if not polygons:
        return ()
    moved = shapely.transform(np.array(polygons, dtype=object), lambda xy: xy + origin)
    return tuple(moved.tolist())
