"""Are the layers of a floor plan right? Worked out from geometry, apart from what made them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Union

import geopandas as gpd
import networkx as nx
import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from ..types import Template
from .figures import corridor_graph

#: Metres, or square metres, that rounding may cost.
SLACK = 1e-6
#: Least width of a door, metres.
DOOR = 0.6
#: A door may be this far from a wall that bends, metres.
BEND = 0.03
#: A door in a mitred corner lies at most this many widths from its centre line.
REACH = 2.2
#: Error of distances that bent centre lines may bring, metres.
LENGTH = 1e-3

_Layers = Mapping[str, gpd.GeoDataFrame]
Footprint = Union[BaseGeometry, Mapping[int, BaseGeometry]]


def faults(layers: _Layers, footprint: Footprint, templates: Sequence[Template] = ()) -> list[str]:
    """List what is wrong with floor plans, as sentences; an empty list means that they are right.

    Parameters
    ----------
    layers
        As `collect.floor_layers` gives them, in a CRS in metres.
    footprint
        Footprint of all storeys, or of each by its number, metres.
    templates
        Shapes of rooms, where their numbers and sizes are to be checked, too.

    Returns
    -------
    list of str
        Gaps, overlaps, corridors inside rooms (CND eq. 16), rooms without a door to a corridor
        with a way out (eq. 17), corridors that are too narrow, wrong areas, distances, numbers.
    """
    for name in ("rooms", "doors", "corridors"):
        if layers[name][f"{name[:-1]}_id"].duplicated().any():
            return [f"Two features of '{name}' have one id."]
    storeys = sorted({int(k) for name in ("rooms", "faces") for k in layers[name]["floor"]})
    found = [] if storeys else ["There is no storey."]
    for storey in storeys:
        own = {name: layer[layer["floor"] == storey] for name, layer in layers.items()}
        shape = footprint[storey] if isinstance(footprint, Mapping) else footprint
        wrong = _tiling(own, shape) + _cells(own, shape, templates) + _corridors(own, shape)
        wrong += _doors(own) + _counts(own, templates)
        found += [f"Storey {storey}: {text}" for text in wrong]
    return found


def _tiling(own: _Layers, shape: BaseGeometry) -> list[str]:
    """Check that rooms, corridors and obstacles tile the footprint."""
    found, parts = [], []
    for name in ("rooms", "corridors", "obstacles"):
        layer = own[name]
        parts.append(layer.geometry.to_numpy())
        for identity, polygon, area in zip(layer.iloc[:, 0], layer.geometry, layer["area_m2"]):
            what = f"{name[:-1]} {identity}"
            if polygon.geom_type != "Polygon" or not polygon.is_valid or polygon.area <= SLACK:
                found.append(f"The ground of {what} is no polygon.")
            if abs(polygon.area - area) > SLACK * max(1.0, area):
                found.append(f"The area of {what} is {polygon.area:.6f} m², not {area:.6f} m².")
    every = np.concatenate(parts)
    if not shapely.coverage_is_valid(every):
        found.append("Rooms, corridors and obstacles do not share their borders.")
    i, j = shapely.STRtree(every).query(every, predicate="intersects")
    common = shapely.area(shapely.intersection(every[i[i < j]], every[j[i < j]]))
    if (common > SLACK).any():
        found.append(f"{int((common > SLACK).sum())} pairs of them overlap.")
    total = float(shapely.area(every).sum())
    if abs(total - shape.area) > SLACK * shape.area:
        found.append(f"Together they cover {total:.6f} m², the footprint {shape.area:.6f} m².")
    outside = float(shapely.difference(shapely.union_all(every), shape).area)
    if outside > SLACK * shape.area:
        found.append(f"{outside:.6f} m² of them lie outside the footprint.")
    return found


def _cells(own: _Layers, shape: BaseGeometry, templates: Sequence[Template]) -> list[str]:
    """Check that each cell is in one room or an obstacle (CND eq. 15)."""
    faces, rooms = own["faces"], own["rooms"]
    found = []
    if abs(float(faces.area.sum()) - shape.area) > SLACK * shape.area:
        found.append("The cells do not cover the footprint.")
    if ((faces["room_id"] == -1) != faces["obstacle"]).any():
        found.append("A cell is neither in a room nor an obstacle, or both.")
    if set(faces["room_id"]) - {-1} != set(rooms["room_id"]):
        found.append("Cells and rooms do not name the same rooms.")
    cells = {template.name: len(template.cells) for template in templates}
    wholes = faces.groupby("room_id").geometry
    for identity, name, room in zip(rooms["room_id"], rooms["template"], rooms.geometry):
        if identity not in wholes.groups:
            continue
        members = wholes.get_group(identity)
        if room.difference(shapely.union_all(members.to_numpy())).area > SLACK:
            found.append(f"Room {identity} is larger than its cells.")
        if cells and len(members) != cells.get(name):
            found.append(f"Room {identity} has not the size of template '{name}'.")
    return found


def _corridors(own: _Layers, shape: BaseGeometry) -> list[str]:
    """Check that corridors lie between rooms (CND eq. 16) and have their width."""
    found = []
    lines, faces = own["corridor_lines"], own["faces"]
    for identity, members in faces[~faces["obstacle"]].groupby("room_id").geometry:
        inside = shapely.buffer(shapely.union_all(members.to_numpy()), -10 * SLACK)
        within = shapely.length(shapely.intersection(lines.geometry.to_numpy(), inside))
        if (within > SLACK).any():
            found.append(f"A corridor runs inside room {identity}.")
    corridors = own["corridors"].set_index("corridor_id").geometry
    blocked = shapely.union_all(own["obstacles"].geometry.to_numpy())
    for identity, corridor, line, width in zip(
        lines["line_id"], lines["corridor_id"], lines.geometry, lines["width_m"]
    ):
        if corridor not in corridors.index:
            found.append(f"Line {identity} is in no corridor.")
            continue
        ground = corridors[corridor]
        if line.difference(shapely.buffer(ground, SLACK)).length > SLACK:
            found.append(f"Line {identity} leaves its corridor.")
        # at its ends a strip may stop at a slanting wall
        middle = substring(line, 0.45, 0.55, normalized=True)
        strip = shapely.buffer(middle, width / 2 - SLACK, cap_style="flat")
        free = shapely.difference(shapely.intersection(strip, shape), blocked)
        if shapely.difference(free, ground).area > 10 * SLACK:
            found.append(f"The corridor is narrower than {width:g} m at line {identity}.")
    return found


def _doors(own: _Layers) -> list[str]:
    """Check that each room has one door to a corridor with a way out (CND eq. 17)."""
    doors, rooms, lines = own["doors"], own["rooms"], own["corridor_lines"]
    found = []
    number = doors["room_id"].value_counts()
    for identity in rooms["room_id"]:
        if number.get(identity, 0) != 1:
            found.append(f"Room {identity} has {number.get(identity, 0)} doors.")
    grounds = rooms.set_index("room_id").geometry
    corridors = own["corridors"].set_index("corridor_id").geometry
    away, wrong = _away(own)
    found += wrong
    columns = [doors[c] for c in ("door_id", "room_id", "corridor_id", "width_m", "distance_m")]
    for line, identity, room, corridor, width, distance in zip(doors.geometry, *columns):
        if room not in grounds.index or corridor not in corridors.index:
            found.append(f"Door {identity} leads from or to nowhere.")
            continue
        for ground, what in ((grounds[room], "its room"), (corridors[corridor], "its corridor")):
            rim = shapely.buffer(shapely.boundary(ground), BEND)
            if not shapely.covers(rim, line):
                found.append(f"Door {identity} is not in a wall of {what}.")
        if width < DOOR or abs(line.length - width) > SLACK:
            found.append(f"Door {identity} is {line.length:.2f} m wide, its field says {width:g}.")
        middle = shapely.line_interpolate_point(line, 0.5, normalized=True)
        near = lines[lines["corridor_id"] == corridor]
        near = near[near.distance(middle) <= REACH * near["width_m"]]
        ways = [
            w for key, own_line in near.geometry.items() for w in _ways(away[key], own_line, middle)
        ]
        if not any(abs(w - distance) <= LENGTH for w in ways):
            found.append(f"Door {identity} is not {distance:g} m from a sink.")
    return found


def _away(own: _Layers) -> tuple[dict[object, tuple[float, float]], list[str]]:
    """Return how far the ends of each line are from a sink, and lines that say otherwise."""
    lines = own["corridor_lines"]
    graph = corridor_graph(lines)
    sinks = {node for node, sink in graph.nodes(data="sink") if sink}
    if not sinks:
        return dict.fromkeys(lines.index, (np.inf, np.inf)), ["No corridor has a way out."]
    far = nx.multi_source_dijkstra_path_length(graph, sinks, weight="length")
    found, away = [], {}
    for key, line in lines.geometry.items():
        part = corridor_graph(lines.loc[[key]])
        ends = list(part.nodes)
        away[key] = (far.get(ends[0], np.inf), far.get(ends[-1], np.inf))
        told = (lines.at[key, "from_m"], lines.at[key, "to_m"])
        name = lines.at[key, "line_id"]
        if abs(line.length - lines.at[key, "length_m"]) > LENGTH:
            found.append(f"Line {name} is {line.length:.3f} m long, its field says otherwise.")
        if not np.isfinite(away[key]).all():
            found.append(f"Line {name} leads to no sink.")
        elif not np.allclose(away[key], told, rtol=0, atol=LENGTH):
            found.append(f"Line {name} is not as far from a sink as its fields say.")
    return away, found


def _ways(away: tuple[float, float], line: BaseGeometry, point: BaseGeometry) -> list[float]:
    """Return the way from the place on a line next to a point to the nearest sink."""
    along = float(shapely.line_locate_point(line, point))
    return [min(away[0] + along, away[1] + line.length - along)]


def _counts(own: _Layers, templates: Sequence[Template]) -> list[str]:
    """Check numbers of rooms, in all and one by one."""
    found = []
    rooms = own["rooms"]
    for name, index in rooms.groupby("template")["count_index"]:
        if sorted(index) != list(range(1, len(index) + 1)):
            found.append(f"The rooms of template '{name}' are not counted from 1.")
    number = rooms["template"].value_counts()
    for template in templates:
        have = int(number.get(template.name, 0))
        if have < template.least or (template.most is not None and have > template.most):
            found.append(f"There are {have} rooms of template '{template.name}'.")
    return found
