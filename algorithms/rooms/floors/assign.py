"""What obstacles, exits and given corridors are on a mesh: faces, vertices and edges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from shapely.geometry import LineString, Polygon

from ...errors import InputError
from ...mesh.quadmesh import BoolArray, IntArray, QuadMesh
from .fit import boundary_loops, near
from .read import LinePart, PointPart, PolygonPart
from .types import Remark

BLOCKED = 0.5
"""An obstacle takes a face of which it covers more than this share."""
CLOSE = 1.5
"""An exit or corridor may be this many modules off the floor."""
CHEAP = 0.02
"""Cost per metre on a given line; a module off it costs 1 more."""


def pieces(mesh: QuadMesh, keep: BoolArray) -> IntArray:
    """Return a number for each face (m,), equal where faces are joined by sides; -1 if not kept."""
    pair = mesh.edge_faces[~mesh.boundary_edges]
    pair = pair[keep[pair].all(axis=1)]
    size = len(mesh.faces)
    graph = coo_matrix((np.ones(len(pair)), (pair[:, 0], pair[:, 1])), shape=(size, size))
    label = connected_components(graph, directed=False)[1].astype(np.int64)
    number = np.full(size, -1, dtype=np.int64)
    number[keep] = np.unique(label[keep], return_inverse=True)[1].reshape(-1)
    return number


def open_faces(
    mesh: QuadMesh,
    faces: Any,
    obstacles: Sequence[PolygonPart],
    layer: str,
    remarks: list[Remark],
) -> BoolArray:
    """Return the faces (m,) that obstacles leave.

    Parameters
    ----------
    mesh
        The mesh.
    faces
        Its faces as polygons, shape (m,).
    obstacles
        Obstacles of the storey.
    layer
        Name of their layer.
    remarks
        Takes obstacles without effect, and floors in pieces.

    Raises
    ------
    InputError
        If nothing is left.
    """
    free = np.ones(len(faces), dtype=np.bool_)
    if not obstacles:
        return free
    shapes = np.array([part.shape for part in obstacles], dtype=object)
    union = shapely.union_all(shapes)
    covered = shapely.area(shapely.intersection(faces, union))
    free = np.asarray(covered <= BLOCKED * shapely.area(faces), dtype=np.bool_)
    if not free.any():
        raise InputError(
            "The obstacles cover the whole floor.",
            "Draw them smaller or give them another storey.",
            layer=layer,
            feature=obstacles[0].feature,
        )
    for part in obstacles:
        shared = shapely.area(shapely.intersection(faces, part.shape))
        if shared.sum() > 0 and not (shared[~free] > 0).any():
            remarks.append(
                Remark(
                    f"Layer '{layer}', feature {part.feature} covers no square by more than half.",
                    "It takes no square and stands in a room. Set a smaller module to keep it "
                    "free.",
                    "info",
                    part.shape,
                )
            )
    count = int(pieces(mesh, free).max()) + 1
    if count > 1:
        remarks.append(
            Remark(
                f"The obstacles cut the floor into {count} pieces.",
                "Each needs an exit, or corridors that run between the obstacles.",
                "warning",
                union,
            )
        )
    return free


def sink_vertices(
    mesh: QuadMesh,
    faces: Any,
    free: BoolArray,
    points: Sequence[PointPart],
    obstacles: Sequence[PolygonPart],
    layer: str,
) -> BoolArray:
    """Return the vertices (n,) at which ways out begin.

    A point snaps to the nearest vertex of a face that is free; one inside an obstacle, such as
    a lift, makes all corners of the obstacle's faces sinks.

    Parameters
    ----------
    mesh, faces, free
        The mesh, its faces as polygons, the faces that are free.
    points, obstacles
        Exits and obstacles of the storey.
    layer
        Name of the layer of exits.

    Raises
    ------
    InputError
        If no free vertex is near a point.
    """
    usable = np.zeros(len(mesh.vertices), dtype=np.bool_)
    usable[np.unique(mesh.faces[free])] = True
    sinks = np.zeros_like(usable)
    for part in points:
        inside = [own.shape for own in obstacles if own.shape.intersects(part.shape)]
        if inside:
            shared = shapely.area(shapely.intersection(faces, shapely.union_all(inside)))
            corners = np.unique(mesh.faces[~free & (shared > 0)])
            corners = corners[usable[corners]]
            if len(corners):
                sinks[corners] = True
                continue
        order = near(part.shape, mesh.vertices)
        nearest = int(order[usable[order]][0])
        far = float(np.hypot(*(mesh.vertices[nearest] - (part.shape.x, part.shape.y))))
        if far > (CLOSE + 1.0) * mesh.edge_length:
            raise InputError(
                f"It lies {far:.1f} m from the next free corner of a square.",
                "Move it to the floor or out of the obstacle.",
                layer=layer,
                feature=part.feature,
            )
        sinks[nearest] = True
    return sinks


def usual_sinks(
    mesh: QuadMesh,
    faces: Any,
    free: BoolArray,
    polygon: Polygon,
    shafts: Sequence[PolygonPart],
) -> tuple[BoolArray, Remark]:
    """Choose exits where none is given.

    Parameters
    ----------
    mesh, faces, free, polygon
        The mesh, its faces as polygons, the faces that are free, the outline.
    shafts
        Obstacles in which stairs or a lift may be; none for the storey that one enters.

    Returns
    -------
    array of bool, shape (n,)
        The corners of the largest shaft; without shafts the middle of the longest outer side.
    Remark
        Which it was.
    """
    for shaft in sorted(shafts, key=lambda own: -own.shape.area):
        taken = ~free & (shapely.area(shapely.intersection(faces, shaft.shape)) > 0)
        corners = np.intersect1d(mesh.faces[taken], mesh.faces[free])
        if len(corners):
            sinks = np.zeros(len(mesh.vertices), dtype=np.bool_)
            sinks[corners] = True
            return sinks, Remark(
                "No exit is given for an upper storey.",
                "The largest shaft of all storeys is taken for the stairs. Draw exits to place "
                "them.",
                "info",
                shaft.shape.representative_point(),
            )
    return _in_longest_side(mesh, free, polygon)


def _in_longest_side(mesh: QuadMesh, free: BoolArray, polygon: Polygon) -> tuple[BoolArray, Remark]:
    outline = np.asarray(shapely.simplify(polygon.exterior, 0.1 * mesh.edge_length).coords)
    length = np.hypot(*np.diff(outline, axis=0).T)
    side = int(np.argmax(np.round(length, 3)))
    middle = shapely.Point((outline[side] + outline[side + 1]) / 2)
    usable = np.zeros(len(mesh.vertices), dtype=np.bool_)
    usable[np.unique(mesh.faces[free])] = True
    loops = boundary_loops(mesh)
    outer = np.zeros_like(usable)
    outer[max(loops, key=lambda loop: Polygon(mesh.vertices[loop]).area)] = True
    for allowed in (usable & outer, usable):
        order = near(middle, mesh.vertices)
        order = order[allowed[order]]
        if len(order):
            break
    sinks = np.zeros_like(usable)
    sinks[order[0]] = True
    return sinks, Remark(
        "No exit is given for this floor.",
        "One was put in the middle of its longest outer side. Draw exits to place them.",
        "info",
        shapely.Point(mesh.vertices[order[0]]),
    )


def corridor_edges(
    mesh: QuadMesh, polygon: Polygon, free: BoolArray, lines: Sequence[LinePart], layer: str
) -> BoolArray:
    """Return the edges (e,) along which given corridors run.

    Each straight piece of a line becomes the path of edges that lies closest to it.

    Parameters
    ----------
    mesh, polygon, free
        The mesh, the footprint, the faces that are free.
    lines
        Corridors of the storey, those near the footprint only.
    layer
        Name of their layer.

    Raises
    ------
    InputError
        If no path of edges follows a line.
    """
    required = np.zeros(len(mesh.edges), dtype=np.bool_)
    if not lines:
        return required
    sides = mesh.edge_faces
    allowed = free[sides[:, 0]] | ((sides[:, 1] >= 0) & free[sides[:, 1]])
    usable = np.zeros(len(mesh.vertices), dtype=np.bool_)
    usable[np.unique(mesh.edges[allowed])] = True
    ends = mesh.vertices[mesh.edges]
    samples = ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * np.linspace(0, 1, 5)[:, None]
    reach = polygon.buffer(CLOSE * mesh.edge_length)
    for part in lines:
        before = int(required.sum())
        for piece in shapely.get_parts(shapely.intersection(part.shape, reach)):
            if piece.length < 0.5 * mesh.edge_length or piece.geom_type != "LineString":
                continue
            corners = np.asarray(shapely.simplify(piece, 0.1 * mesh.edge_length).coords)
            for a, b in zip(corners[:-1], corners[1:]):
                straight = LineString([a, b])
                far = shapely.distance(straight, shapely.points(samples)).mean(axis=1)
                cost = mesh.lengths * (CHEAP + (far / mesh.edge_length) ** 2)
                stops = [_nearest(mesh, usable, point) for point in (a, b)]
                _walk(mesh, np.where(allowed, cost, np.inf), stops[0], stops[1], required)
        if int(required.sum()) == before and not _along(mesh, required, part.shape):
            raise InputError(
                "It is too short or no squares lie along it.",
                "Draw it along the floor, at least one module long, or delete it.",
                layer=layer,
                feature=part.feature,
            )
    return required


def _nearest(mesh: QuadMesh, usable: BoolArray, point: Any) -> int:
    """Return the nearest usable vertex."""
    order = near(shapely.Point(point), mesh.vertices)
    return int(order[usable[order]][0])


def _along(mesh: QuadMesh, required: BoolArray, line: LineString) -> bool:
    """Tell whether edges that are required already run along a line."""
    chosen = shapely.linestrings(mesh.vertices[mesh.edges[required]])
    return bool(len(chosen)) and bool(
        (shapely.distance(line, chosen) < 0.5 * mesh.edge_length).any()
    )


def _walk(mesh: QuadMesh, cost: Any, start: int, end: int, required: BoolArray) -> None:
    """Mark the cheapest path of edges between two vertices, where there is one."""
    size = len(mesh.vertices)
    able = np.isfinite(cost)
    u, v = mesh.edges[able].T
    graph = coo_matrix((cost[able], (u, v)), shape=(size, size)).tocsr()
    _, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    while end != start and before[end] >= 0:
        required[mesh.edge_between(int(before[end]), end)] = True
        end = int(before[end])
