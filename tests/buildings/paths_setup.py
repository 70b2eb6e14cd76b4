"""Zones and rows of buildings for tests of paths, and checks that know nothing of how they grew."""

from __future__ import annotations

import dataclasses

import networkx as nx
import numpy as np
import shapely
from platwright.buildings.shape import entrances, footprints
from platwright.buildings.types import BuildingType, Placements
from platwright.buildings.zone import Patch, Zone
from pyproj import CRS
from shapely.affinity import rotate
from shapely.geometry import LineString, MultiLineString, Point, Polygon, box

UTM = CRS.from_epsg(32633)
SLAB = BuildingType("slab", 18.0, 10.0, 12.0, 4, entrance="opposite")
TOWER = BuildingType("tower", 20.0, 18.0, 30.0, 10)
FRONT = BuildingType("front", 24.0, 12.0, 15.0, 5, entrance="same")
TYPES = (SLAB, TOWER, FRONT)


def make_zone(*grounds: Polygon, access=None, paths: int = 2, direction: int = 1) -> Zone:
    """A zone of some patches; `access` lists the street sides of each, all around by default."""
    patches = []
    for k, ground in enumerate(grounds):
        sides = [LineString(ground.exterior.coords)] if access is None else access[k]
        patches.append(
            Patch(ground, MultiLineString(sides), paths=paths, path_direction=direction)
        )  # fmt: skip
    whole = shapely.union_all([g.buffer(6, join_style="mitre") for g in grounds]).convex_hull
    return Zone("Zone", 1, whole, UTM, UTM, 50.0, 15.0, 0.0, (), tuple(patches))


def with_paths(zone: Zone, paths: int, direction: int = 1) -> Zone:
    """The same zone in another path pattern."""
    patches = tuple(
        dataclasses.replace(p, paths=paths, path_direction=direction) for p in zone.patches
    )
    return dataclasses.replace(zone, patches=patches)


def make_placed(rows) -> Placements:
    """Placements from (type, x, y, facing, patch) tuples."""
    table = np.array([(*row, 0)[:6] for row in rows], dtype=float).reshape(-1, 6)
    return Placements(
        table[:, 0].astype(np.int64), table[:, 1:3].copy(), table[:, 3].copy(),
        table[:, 4].astype(np.int64), table[:, 5].astype(np.int64),
    )  # fmt: skip


def in_rows(ground: Polygon, kind=0, *, pitch=24.0, facing=180.0, touch=3, patch=0, setback=5.0):
    """Rows of buildings that fill a patch, some of them touching, as tuples for `make_placed`."""
    size = TYPES[kind]
    centre = ground.centroid
    inner = rotate(ground.buffer(-setback), facing - 180.0, origin=centre)
    x0, y0, x1, y1 = inner.bounds
    rows = []
    y = y0 + size.width_m / 2
    while y < y1:
        x, done = x0 + size.length_m / 2, 0
        while x < x1:
            half = size.length_m / 2, size.width_m / 2
            if inner.contains(box(x - half[0], y - half[1], x + half[0], y + half[1])):
                at = rotate(Point(x, y), 180.0 - facing, origin=centre)
                rows.append((kind, at.x, at.y, facing, patch))
                done += 1
                x += size.length_m + (0.0 if done % touch else 6.0)
            else:
                x += 1.0
        y += pitch
    return rows


def small_town(paths: int = 2, direction: int = 1) -> tuple[Zone, Placements]:
    """Six patches on 11 ha with 96 buildings of three types, one pair of them turned."""
    grounds, rows = [], []
    for i, (kind, touch, pitch, facing) in enumerate(
        [(0, 3, 24.0, 180.0), (2, 2, 28.0, 180.0), (1, 1, 50.0, 195.0)]
    ):
        for j in range(2):
            ground = box(i * 115, j * 160, i * 115 + 105, j * 160 + 150)
            rows += in_rows(
                ground, kind, touch=touch, pitch=pitch, facing=facing, patch=len(grounds)
            )  # fmt: skip
            grounds.append(ground)
    return make_zone(*grounds, paths=paths, direction=direction), make_placed(rows)


def check_plan(zone: Zone, types, placed: Placements, plan, width: float = 3.0) -> None:
    """Check every promise of a plan by its geometry alone."""
    point, _ = entrances(types, placed)
    shapes = footprints(types, placed)
    graph = nx.MultiGraph()
    for path in plan.paths:
        coords = path.line.coords
        graph.add_edge(coords[0], coords[-1], weight=path.line.length)
        patch = zone.patches[path.patch]
        assert patch.polygon.buffer(1e-6).covers(path.line)
        walls = patch.polygon.boundary.difference(patch.access.buffer(0.1))
        # Next to the street a wall may be beside the end of a path; elsewhere a path has room.
        inner = path.line.difference(patch.access.buffer(width))
        own = shapely.MultiPoint(point[list(path.buildings)]).buffer(width)
        assert inner.is_empty or walls.is_empty or inner.distance(walls) > 0.4 * width
        for shape in shapes[placed.patch == path.patch]:
            within = path.line.intersection(shape.buffer(-1e-6))
            assert within.is_empty, f"a path runs {within.length:.2f} m through a building"
            # Own doors apart, half the path's width is kept.
            assert path.line.difference(own).intersection(shape.buffer(0.4 * width)).is_empty
        if path.exit is not None:
            assert path.exit.distance(patch.access) < 1e-6
            assert path.exit.coords[0] in (coords[0], coords[-1])
    for k in range(len(placed)):
        door = next((n for n in graph if np.hypot(*(np.array(n) - point[k])) < 1e-6), None)
        if not plan.reached[k]:
            assert door is None or not any(
                path.exit is not None
                and path.exit.coords[0] in nx.node_connected_component(graph, door)
                for path in plan.paths
            )
            continue
        assert door is not None, f"no path begins at the entrance of building {k}"
        out = {
            path.exit.coords[0]
            for path in plan.paths
            if path.exit is not None and path.patch == placed.patch[k]
        }
        far = nx.single_source_dijkstra_path_length(graph, door, weight="weight")
        least = min((far[n] for n in out if n in far), default=np.inf)
        assert np.isfinite(least), f"building {k} is not connected to a street"
        # Rounded corners are a little shorter than the corners.
        assert least <= plan.length_m[k] + 1e-6
        assert plan.length_m[k] <= 1.2 * least + 6.0


def overlap(plan) -> float:
    """Metres that are drawn twice or nearly (closer than 20 cm) by different paths."""
    total = 0.0
    lines = [p.line for p in plan.paths]
    for i, line in enumerate(lines):
        for other in lines[i + 1 :]:
            if line.distance(other) < 0.2:
                total += max(0.0, line.intersection(other.buffer(0.2)).length - 1.5)
    return total
