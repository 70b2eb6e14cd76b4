"""Zones and control lines by hand, and a slow judge of placements that knows no room of place."""

from __future__ import annotations

import itertools
import math

import numpy as np
import shapely
from platwright.buildings.rules import LayoutRules, SunRule
from platwright.buildings.types import EMPTY, ROWS, BuildingType, Placements
from platwright.buildings.zone import ControlLine, Corridor, Patch, Zone
from pyproj import CRS
from shapely import affinity
from shapely.geometry import LineString, MultiLineString, Polygon, box

from .sun_checks import outline

UTM = CRS.from_epsg(25832)
SLAB = BuildingType("slab", 24.0, 12.0, 15.0, 5, dwellings=20)
HOUSE = BuildingType("house", 14.0, 11.0, 9.0, 3, dwellings=6)
TOWER = BuildingType("tower", 18.0, 16.0, 33.0, 11, dwellings=44)
SHOP = BuildingType("shop", 20.0, 14.0, 5.0, 1, use="facility", entrance="same")
TYPES = (SLAB, HOUSE, TOWER, SHOP)
#: South-west corner of zones.
ORIGIN = np.array([500_000.0, 5_300_000.0])


def zone(
    width: float,
    depth: float,
    street: str = "south",
    *,
    latitude: float = 48.0,
    cut: tuple[float, float] = (0.0, 0.0),
    turn: float = 0.0,
    hole: Polygon | None = None,
    facilities: int = EMPTY,
    parts: int = 1,
) -> Zone:
    """A rectangle, or an L where a corner is cut out, with streets along the named sides.

    `turn` turns everything clockwise about the origin, in degrees; `parts` cuts it by streets of
    10 m from south to north; a hole is an obstacle, in metres from the origin.
    """
    sides = {
        "south": LineString([(0, 0), (width, 0)]),
        "north": LineString([(0, depth), (width, depth)]),
        "west": LineString([(0, 0), (0, depth)]),
        "east": LineString([(width, 0), (width, depth)]),
    }
    whole = box(0, 0, width, depth)
    ground = whole.difference(box(width - cut[0], depth - cut[1], width, depth))
    middle = [
        LineString([(width * k / parts, -1), (width * k / parts, depth + 1)])
        for k in range(1, parts)
    ]
    streets = [
        side.buffer(0.01, cap_style="flat") for name, side in sides.items() if name in street
    ]
    inner = shapely.union_all([line.buffer(5.0, cap_style="flat") for line in middle])
    space = shapely.union_all([*streets, inner.buffer(0.01)])
    free = ground.difference(inner) if hole is None else ground.difference(inner).difference(hole)
    patches = []
    for part in shapely.get_parts(free):
        near = shapely.get_parts(shapely.line_merge(part.exterior.intersection(space)))
        access = [line for line in near if line.geom_type == "LineString" and line.length > 0.5]
        patches.append(
            Patch(placed_on_earth(part, turn), placed_on_earth(MultiLineString(access), turn),
                  residences=ROWS, facilities=facilities)
        )  # fmt: skip
    corridors = [Corridor(placed_on_earth(line, turn), 10.0, 3) for line in middle]
    stones = () if hole is None else (placed_on_earth(hole, turn),)
    return Zone(
        "zone", 1, placed_on_earth(ground, turn), UTM, UTM, latitude, 9.0, 0.0, tuple(corridors),
        tuple(patches), stones,
    )  # fmt: skip


def placed_on_earth(shape, turn: float):
    """The shape turned clockwise about the origin and moved to where zones are."""
    return affinity.translate(affinity.rotate(shape, -turn, origin=(0, 0)), *ORIGIN)


def rows(
    ground: Zone,
    types,
    rules: LayoutRules,
    *,
    facing: float = 180.0,
    lean: float = 0.0,
    pitch: float | None = None,
    spacing: float = 0.0,
) -> tuple[ControlLine, ...]:
    """Straight lines from edge to edge of each patch, the first one as near as the setback lets.

    Façades look to `facing`; lines run along them, turned by `lean` degrees.
    """
    home = [kind for kind in types if kind.use == "residence"]
    deep = max(kind.width_m for kind in types)
    step = pitch or max(k.width_m + rules.sun.coefficient * k.height_m for k in home)
    lines = []
    for number, patch in enumerate(ground.patches):
        level = affinity.rotate(patch.polygon, facing - 180.0 + lean, origin=(0, 0))
        x0, y0, x1, y1 = level.bounds
        order = 0
        uses = ["facility"] if patch.facilities != EMPTY else []
        for use in [*uses, "residence"]:
            y = y0 + rules.setback_m + deep / 2
            while y < y1 - rules.setback_m:
                row = LineString([(x0, y), (x1, y)]).intersection(level)
                for part in shapely.get_parts(row):
                    back = affinity.rotate(part, 180.0 - facing - lean, origin=(0, 0))
                    lines.append(
                        ControlLine(back.coords[0], back.coords[-1], facing % 360.0, number, use,
                                    spacing_m=spacing, order=order)
                    )  # fmt: skip
                    order += 1
                y += step if use == "residence" else 1e9
    return tuple(lines)


def standing(*buildings: tuple) -> Placements:
    """Buildings from (type, x, y, facing, patch), x and y from the origin."""
    table = np.array(
        [(*row, 180.0, 0)[:5] if len(row) == 3 else (*row, 0)[:5] for row in buildings]
    )
    table = table.reshape(-1, 5).astype(float)
    return Placements(
        table[:, 0].astype(np.int64), table[:, 1:3] + ORIGIN, table[:, 3],
        table[:, 4].astype(np.int64), np.zeros(len(table), dtype=np.int64),
    )  # fmt: skip


def slow_groups(types, placed: Placements) -> list[set[int]]:
    """Sets of buildings that share side walls, by the walls' ends alone."""
    groups = [{at} for at in range(len(placed))]
    for a, b in itertools.combinations(range(len(placed)), 2):
        if share_wall(types, placed, a, b):
            one = next(g for g in groups if a in g)
            two = next(g for g in groups if b in g)
            if one is not two:
                groups.remove(two)
                one |= two
    return groups


def share_wall(types, placed: Placements, a: int, b: int) -> bool:
    """Whether side walls coincide within 5 cm over more than half the smaller depth."""
    turn = (placed.facing[a] - placed.facing[b]) % 360.0
    if min(turn, 360.0 - turn) >= 0.1:
        return False
    # Both seen with the façades of `a` to the south.
    seen = [
        affinity.rotate(outline(types, placed, at), placed.facing[a] - 180.0, origin=(0, 0)).bounds
        for at in (a, b)
    ]
    (x0, y0, x1, y1), (u0, v0, u1, v1) = seen
    beside = min(abs(x1 - u0), abs(u1 - x0)) < 0.05
    shared = min(y1, v1) - max(y0, v0)
    return beside and shared > min(y1 - y0, v1 - v0) / 2


def shadow(types, placed: Placements, at: int, coefficient: float) -> Polygon:
    """The rectangle behind a building, drawn to the north and turned."""
    kind = types[placed.type[at]]
    back, deep = kind.width_m / 2, coefficient * kind.height_m
    flat = box(-kind.length_m / 2, back, kind.length_m / 2, back + deep)
    turned = affinity.rotate(flat, 180.0 - placed.facing[at], origin=(0, 0))
    return affinity.translate(turned, *placed.xy[at])


def middle_line(types, placed: Placements, at: int) -> LineString:
    """The line through a building along its façade."""
    half = types[placed.type[at]].length_m / 2
    angle = math.radians(placed.facing[at])
    dx, dy = half * math.cos(angle), -half * math.sin(angle)
    x, y = placed.xy[at]
    return LineString([(x - dx, y - dy), (x + dx, y + dy)])


def breaches(ground: Zone, types, rules: LayoutRules, placed: Placements) -> set[str]:
    """Which constraints are broken: edge, overlap, gap, group, far, density, count or shade.

    Everything is looked at pair by pair, and only the coefficient rule of the sun is known.
    """
    found = set()
    shapes = [outline(types, placed, at) for at in range(len(placed))]
    for at, shape in enumerate(shapes):
        room = ground.patches[placed.patch[at]].polygon
        if not room.contains(shape.buffer(rules.setback_m - 0.03)):
            found.add("edge")
    groups = slow_groups(types, placed)
    for a, b in itertools.combinations(range(len(placed)), 2):
        together = any(a in group and b in group for group in groups)
        if shapes[a].intersection(shapes[b]).area > 0.05:
            found.add("overlap")
        elif not together and shapes[a].distance(shapes[b]) < rules.gap_m - 0.03:
            found.add("gap")
    for group in groups:
        if len(group) > 1:
            long = sum(types[placed.type[at]].length_m for at in group)
            if long > rules.group_m + 0.05 * len(group):
                found.add("group")
    kinds = [types[k] for k in placed.type]
    area = ground.polygon.area
    if sum(k.length_m * k.width_m * k.storeys for k in kinds) > rules.most_far * area * (1 + 1e-5):
        found.add("far")
    if sum(k.length_m * k.width_m for k in kinds) > rules.most_density * area * (1 + 1e-5):
        found.add("density")
    if any(k.count is not None and kinds.count(k) > k.count for k in types):
        found.add("count")
    if rules.sun.hours is None:
        for a, b in itertools.permutations(range(len(placed)), 2):
            if kinds[b].use == "residence":
                dark = shadow(types, placed, a, rules.sun.coefficient).buffer(-0.02)
                if dark.intersects(middle_line(types, placed, b)):
                    found.add("shade")
    return found


def ways_out(
    ground: Zone, types, rules: LayoutRules, placed: Placements, cell: float = 0.5
) -> bool:
    """Whether a path a bit narrower than asked leads from each entrance to the street."""
    for number, patch in enumerate(ground.patches):
        here = np.flatnonzero(placed.patch == number)
        if not len(here):
            continue
        shapes = shapely.union_all([outline(types, placed, at) for at in here])
        keep = 0.45 * rules.path_m
        walls = patch.polygon.boundary.difference(patch.access.buffer(0.1))
        free = patch.polygon.difference(shapes.buffer(keep)).difference(walls.buffer(keep * 0.9))
        reach = [p for p in shapely.get_parts(free) if p.distance(patch.access) < cell]
        for at in here:
            kind = types[placed.type[at]]
            side = 1.0 if kind.entrance == "same" else -1.0
            angle = math.radians(placed.facing[at])
            off = side * (kind.width_m / 2 + keep + cell)
            out = np.array([math.sin(angle), math.cos(angle)])
            door = placed.xy[at] + side * kind.width_m / 2 * out
            step = LineString([door, door + side * (keep + 6 * cell) * out])
            if step.intersects(patch.access):  # straight into the street
                continue
            ahead = shapely.Point(placed.xy[at] + off * out)
            if not any(p.distance(ahead) < 2 * cell for p in reach):
                return False
    return True


def sunny(coefficient: float = 1.0, hours: float | None = None) -> SunRule:
    """A sun rule."""
    return SunRule(coefficient=coefficient, hours=hours)
