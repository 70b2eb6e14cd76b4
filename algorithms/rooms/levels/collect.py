"""The layers of a game level."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from shapely.geometry import MultiPolygon, Polygon

from ...mesh.layers import mesh_layers
from ...mesh.quadmesh import QuadMesh
from ..types import RoomPlan, RoomProblem
from .graph import Level, neighbours, read_level
from .trails import trail_points, trails

#: Fields of each layer; "adjacency" has no geometry.
COLUMNS = {
    "blocks": (
        "block_id", "template", "colour", "use", "order", "role", "degree", "area_m2",
        "from_start_m",
    ),
    "route": ("route_id", "block_id", "length_m", "from_start_m"),
    "doors": ("door_id", "block_a", "block_b", "from_start_m"),
    "adjacency": ("block_a", "block_b", "door_id", "x", "y"),
    "sinks": ("sink_id", "role", "block_id", "from_start_m", "is_sink"),
}  # fmt: skip


def level_layers(
    problem: RoomProblem,
    plan: RoomPlan,
    crs: Any,
    source_crs: Any = None,
    *,
    start: int | None = None,
    goal: int | None = None,
) -> dict[str, Any]:
    """Write a level as layers.

    Parameters
    ----------
    problem, plan
        A level and its plan, metres in `crs`.
    crs, source_crs
        Working CRS and the CRS of the layers, None for the same.
    start, goal
        As of `read_level`.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        Fields as in `COLUMNS`; lengths and areas are taken in the working CRS.
        "blocks": one polygon each; `order` counts from 1 at the start along the route, breadth
        first where it branches; `role` is "start", "goal", "treasure" (other blocks with one
        passage only) or ""; `degree` is the number of blocks that a passage leads to.
        "route": lines between passages, branches and ends, drawn away from the start;
        `from_start_m` is the distance along the route at which each begins.
        "doors": points where the route gets from one block into another.
        "adjacency": the same as a pandas.DataFrame, x and y in the CRS of the layers.
        "sinks": sinks on the route, and the goal where it is none.

    Raises
    ------
    InputError
        As `read_level`.
    """
    level = read_level(problem, plan, start=start, goal=goal)
    frames = {
        "blocks": _blocks(level, crs),
        "route": _route(level, crs),
        "doors": _doors(level, crs),
        "sinks": _sinks(level, crs),
    }
    if source_crs is not None:
        frames = {name: frame.to_crs(source_crs) for name, frame in frames.items()}
    doors = frames["doors"]
    adjacency = pd.DataFrame(doors[["block_a", "block_b", "door_id"]])
    adjacency["x"], adjacency["y"] = doors.geometry.x, doors.geometry.y
    return {**frames, "adjacency": adjacency}


def empty_layers(crs: Any) -> dict[str, Any]:
    """Return the layers of a level that could not be had, without features.

    Parameters
    ----------
    crs
        CRS of the layers.
    """
    frames: dict[str, Any] = {}
    for name, columns in COLUMNS.items():
        data: dict[str, list[Any]] = {column: [] for column in columns}
        bare = name == "adjacency"
        frames[name] = pd.DataFrame(data) if bare else gpd.GeoDataFrame(data, geometry=[], crs=crs)
    return frames


def block_polygons(level: Level) -> list[Polygon | MultiPolygon]:
    """Return the ground of each block, metres in the working CRS.

    Neighbours share every vertex of their common border. A block whose squares surround ground
    has a hole.
    """
    faces = _face_polygons(level.problem.network.mesh)
    return [
        shapely.coverage_union_all(faces[level.face_block == block]) for block in range(level.count)
    ]


def _face_polygons(mesh: QuadMesh) -> Any:
    """Return each face as a polygon with its true sides."""
    layers: Any = mesh_layers(mesh, _ANY_CRS, _ANY_CRS)
    return layers["faces"].geometry.to_numpy()


#: Stands for the working CRS where only coordinates are wanted.
_ANY_CRS = 3857


def _frame(name: str, columns: dict[str, Any], geometry: Any, crs: Any) -> gpd.GeoDataFrame:
    """Give columns as a layer."""
    data = {column: columns[column] for column in COLUMNS[name]}
    return gpd.GeoDataFrame(data, geometry=gpd.GeoSeries(list(geometry), crs=crs), crs=crs)


def _blocks(level: Level, crs: Any) -> gpd.GeoDataFrame:
    """Write the blocks."""
    templates = [level.problem.templates[level.template(b)] for b in range(level.count)]
    ground = block_polygons(level)
    ends = level.problem.network.mesh.edges
    entered = [float(level.along[ends[level.edge_block == b]].min()) for b in range(level.count)]
    columns = {
        "block_id": np.arange(1, level.count + 1),
        "template": [template.name for template in templates],
        "colour": [template.colour for template in templates],
        "use": [template.use for template in templates],
        "order": list(level.order),
        "role": list(level.roles),
        "degree": [len(others) for others in neighbours(level.count, level.passages)],
        "area_m2": shapely.area(ground),
        "from_start_m": entered,
    }
    return _frame("blocks", columns, ground, crs)


def _route(level: Level, crs: Any) -> gpd.GeoDataFrame:
    """Write the route, cut at its doors."""
    mesh = level.problem.network.mesh
    stops = {p.vertex for p in level.passages} | {level.start, level.goal}
    pieces = trails(mesh.edges, level.route, level.along, stops=stops)
    columns = {
        "route_id": np.arange(1, len(pieces) + 1),
        "block_id": [int(level.edge_block[piece.edges[0]]) + 1 for piece in pieces],
        "length_m": [float(mesh.lengths[list(piece.edges)].sum()) for piece in pieces],
        "from_start_m": [float(level.along[piece.vertices[0]]) for piece in pieces],
    }
    lines = [shapely.LineString(trail_points(mesh, piece)) for piece in pieces]
    return _frame("route", columns, lines, crs)


def _doors(level: Level, crs: Any) -> gpd.GeoDataFrame:
    """Write the places where the route gets from block to block, one for each two blocks."""
    found = [(p.vertex, *pair) for p in level.passages for pair in combinations(p.blocks, 2)]
    found.sort(key=lambda door: (level.along[door[0]], door))
    columns = {
        "door_id": np.arange(1, len(found) + 1),
        "block_a": np.array([a + 1 for _, a, _ in found], dtype=np.int64),
        "block_b": np.array([b + 1 for _, _, b in found], dtype=np.int64),
        "from_start_m": np.array([level.along[v] for v, _, _ in found], dtype=np.float64),
    }
    points = shapely.points(level.problem.network.mesh.vertices[[v for v, _, _ in found]])
    return _frame("doors", columns, points if found else [], crs)


def _sinks(level: Level, crs: Any) -> gpd.GeoDataFrame:
    """Write the sinks on the route, the start and the goal."""
    network = level.problem.network
    on = network.sinks & np.isfinite(level.along)
    rest = set(np.flatnonzero(on).tolist()) - {level.start, level.goal}
    found = list(dict.fromkeys([level.start, level.goal])) + sorted(rest)
    names = {level.goal: "goal", level.start: "start"}
    at: dict[int, int] = {}
    for e in np.flatnonzero(level.route)[::-1].tolist():
        for v in network.mesh.edges[e].tolist():
            at[v] = min(at.get(v, level.count), int(level.edge_block[e]))
    at.update({level.start: level.start_block, level.goal: level.goal_block})
    columns = {
        "sink_id": np.arange(1, len(found) + 1),
        "role": [names.get(v, "") for v in found],
        "block_id": [at[v] + 1 for v in found],
        "from_start_m": [float(level.along[v]) for v in found],
        "is_sink": [bool(network.sinks[v]) for v in found],
    }
    return _frame("sinks", columns, shapely.points(network.mesh.vertices[found]), crs)
