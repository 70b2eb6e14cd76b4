"""The layers of floor plans."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from shapely.geometry import Polygon

from ...errors import InputError
from ...mesh.quadmesh import FloatArray
from ..floors.fit import face_polygons
from ..types import RoomPlan, RoomProblem
from .distance import edge_distances, point_distances, vertex_distances
from .doors import Door, place_doors
from .width import Ground, corridor_edges, rooms_of_faces, widen

#: Fields of each layer.
COLUMNS = {
    "rooms": (
        "room_id", "floor", "template", "use", "colour", "count_index", "area_m2", "net_width_m",
        "distance_m", "door_side",
    ),
    "corridors": ("corridor_id", "floor", "area_m2"),
    "corridor_lines": (
        "line_id", "floor", "corridor_id", "length_m", "distance_m", "from_m", "to_m", "width_m",
    ),
    "doors": (
        "door_id", "floor", "room_id", "corridor_id", "width_m", "rotation_deg", "distance_m",
    ),
    "faces": ("face_id", "floor", "room_id", "obstacle"),
    "obstacles": ("obstacle_id", "floor", "area_m2"),
}  # fmt: skip
#: Fields that count through all storeys.
_IDS = ("room_id", "corridor_id", "line_id", "door_id", "face_id", "obstacle_id")


class StoreyPlan(NamedTuple):
    """A plan and where it lies.

    Attributes
    ----------
    problem, plan
        A floor and its plan, metres.
    polygon
        Footprint that the mesh tiles, metres.
    storey
        Number of the storey.
    """

    problem: RoomProblem
    plan: RoomPlan
    polygon: Polygon
    storey: int


def floor_layers(
    plans: Sequence[StoreyPlan | tuple[RoomProblem, RoomPlan, Polygon, int]],
    crs: Any,
    corridor_width: float,
    source_crs: Any = None,
    *,
    door_width: float = 0.9,
) -> dict[str, gpd.GeoDataFrame]:
    """Write floor plans as layers.

    Parameters
    ----------
    plans
        A plan for each storey, metres in `crs`; at least one.
    crs, source_crs
        Working CRS and the CRS of the layers, None for the same.
    corridor_width, door_width
        Metres.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        Fields as in `COLUMNS`; lengths and areas are taken in the working CRS, ids count from 1
        through all storeys.
        "rooms": polygons beside the corridors; `count_index` counts the rooms of a template on
        the storey, `net_width_m` is the widest circle that fits in, `distance_m` that of the door,
        `door_side` a point of the compass.
        "corridors": one polygon for each connected corridor.
        "corridor_lines": the edges of the mesh along which corridors run; `from_m`, `to_m` are the
        distances of their ends to the nearest sink, `distance_m` that of the middle.
        "doors": lines as wide as the door; `rotation_deg` points into the corridor, clockwise from
        north; `distance_m` is the way along corridors to the nearest sink.
        "faces": cells; `room_id` is -1 on obstacles.
        "obstacles": polygons that are neither.

    Raises
    ------
    InputError
        If there is no plan, or as `widen` and `place_doors`; the text names the storey.
    """
    if not plans:
        raise InputError("There is no floor plan to write.", "Find a plan of a storey first.")
    tables: dict[str, list[gpd.GeoDataFrame]] = {name: [] for name in COLUMNS}
    shift = dict.fromkeys(_IDS, 0)
    for storey in plans:
        own = StoreyPlan(*storey)
        try:
            made = _storey(own, crs, corridor_width, door_width)
        except InputError as error:
            text = f"Storey {own.storey}: {error.problem}"
            raise InputError(
                text, error.remedy, layer=error.layer, feature=error.feature
            ) from error
        counts = {f"{name[:-1]}_id": len(table) for name, table in made.items()}
        counts["line_id"] = len(made["corridor_lines"])
        for name, table in made.items():
            for key in set(_IDS) & set(table.columns):
                table[key] = np.where(table[key] > 0, table[key] + shift[key], table[key])
            tables[name].append(table)
        shift = {key: number + counts[key] for key, number in shift.items()}
    layers = {name: _joined(parts, crs) for name, parts in tables.items()}
    if source_crs is not None:
        layers = {name: layer.to_crs(source_crs) for name, layer in layers.items()}
    return layers


def _joined(parts: list[gpd.GeoDataFrame], crs: Any) -> gpd.GeoDataFrame:
    """Return the tables of all storeys as one; empty ones only where all are."""
    full = [part for part in parts if len(part)] or parts[:1]
    return gpd.GeoDataFrame(pd.concat(full, ignore_index=True), geometry="geometry", crs=crs)


def _frame(
    name: str, storey: int, columns: dict[str, Any], geometry: Any, crs: Any
) -> gpd.GeoDataFrame:
    """Give columns as a layer; ids count from 1."""
    ids = {COLUMNS[name][0]: np.arange(1, len(geometry) + 1)}
    floor = {"floor": np.full(len(geometry), storey, dtype=np.int64)}
    columns = {**ids, **floor, **columns}
    data = {column: columns[column] for column in COLUMNS[name]}
    return gpd.GeoDataFrame(data, geometry=gpd.GeoSeries(list(geometry), crs=crs), crs=crs)


def _storey(own: StoreyPlan, crs: Any, width: float, door_width: float) -> dict[str, Any]:
    """Write one storey."""
    problem, plan, storey = own.problem, own.plan, own.storey
    mesh = problem.network.mesh
    ground = widen(problem, plan, own.polygon, width)
    far = vertex_distances(mesh, corridor_edges(problem, plan), problem.network.sinks)
    doors = place_doors(problem, plan, ground, far, door_width)
    walked = _walked(problem, plan, doors, far)
    room = rooms_of_faces(problem, plan)
    cells = {"room_id": np.where(room < 0, -1, room + 1), "obstacle": room < 0}
    return {
        "rooms": _rooms(own, ground, doors, walked, crs),
        "corridors": _areas("corridors", storey, ground.corridors, crs),
        "corridor_lines": _lines(own, ground, far, width, crs),
        "doors": _doors(storey, doors, walked, crs),
        "faces": _frame("faces", storey, cells, face_polygons(mesh), crs),
        "obstacles": _areas("obstacles", storey, ground.obstacles, crs),
    }


def _walked(
    problem: RoomProblem, plan: RoomPlan, doors: Sequence[Door], far: FloatArray
) -> FloatArray:
    """Return the distance of each door to the nearest sink, metres."""
    active = corridor_edges(problem, plan)
    rims = [np.array(problem.placements.rim[p], dtype=np.int64) for p in plan.rooms]
    return np.array(
        [
            point_distances(problem.network.mesh, far, d.middle[None], rim[active[rim]])[0]
            for d, rim in zip(doors, rims)
        ],
        dtype=np.float64,
    )


def _rooms(
    own: StoreyPlan, ground: Ground, doors: Sequence[Door], walked: FloatArray, crs: Any
) -> gpd.GeoDataFrame:
    """Write the rooms."""
    kinds = own.problem.placements.template[list(own.plan.rooms)]
    templates = [own.problem.templates[int(kind)] for kind in kinds]
    seen: Counter[int] = Counter()
    index = []
    for kind in kinds.tolist():
        seen[kind] += 1
        index.append(seen[kind])
    columns = {
        "template": [template.name for template in templates],
        "use": [template.use for template in templates],
        "colour": [template.colour for template in templates],
        "count_index": index,
        "area_m2": shapely.area(ground.rooms),
        "net_width_m": [2 * shapely.maximum_inscribed_circle(r).length for r in ground.rooms],
        "distance_m": walked,
        "door_side": [door.side for door in doors],
    }
    return _frame("rooms", own.storey, columns, ground.rooms, crs)


def _areas(name: str, storey: int, polygons: Sequence[Polygon], crs: Any) -> gpd.GeoDataFrame:
    """Write polygons with their areas."""
    areas = np.array([polygon.area for polygon in polygons], dtype=np.float64)
    return _frame(name, storey, {"area_m2": areas}, polygons, crs)


def _lines(
    own: StoreyPlan, ground: Ground, far: FloatArray, width: float, crs: Any
) -> gpd.GeoDataFrame:
    """Write the centre lines."""
    mesh = own.problem.network.mesh
    edges = np.flatnonzero(corridor_edges(own.problem, own.plan))
    columns = {
        "corridor_id": ground.corridor[edges] + 1,
        "length_m": mesh.lengths[edges],
        "distance_m": edge_distances(mesh, far)[edges],
        "from_m": far[mesh.edges[edges, 0]],
        "to_m": far[mesh.edges[edges, 1]],
        "width_m": np.full(len(edges), float(width)),
    }
    lines = [shapely.LineString(mesh.edge_line(int(edge))) for edge in edges]
    return _frame("corridor_lines", own.storey, columns, lines, crs)


def _doors(storey: int, doors: Sequence[Door], walked: FloatArray, crs: Any) -> gpd.GeoDataFrame:
    """Write the doors."""
    columns = {
        "room_id": np.array([door.room + 1 for door in doors], dtype=np.int64),
        "corridor_id": np.array([door.corridor + 1 for door in doors], dtype=np.int64),
        "width_m": np.array([door.width for door in doors], dtype=np.float64),
        "rotation_deg": np.array([door.rotation for door in doors], dtype=np.float64),
        "distance_m": walked,
    }
    return _frame("doors", storey, columns, [shapely.LineString(d.line) for d in doors], crs)
