"""Whether a placement keeps the constraints of RZ section 4.1, by plain geometry.

Of the ways of placing nothing is used here: it is their judge.
"""

from __future__ import annotations

from collections.abc import Sequence

import networkx as nx
import numpy as np
import shapely

from ..rules import LayoutRules
from ..shape import Shapes, footprints, residences
from ..sun import shaded
from ..types import EMPTY, BuildingType, Placements
from ..zone import Zone

#: Rounding that no rule minds: metres, square metres, and as a share.
METRES, METRES_2, SHARE = 0.02, 0.05, 1e-6
#: Walls nearer than this are one (metres), façades that differ by less parallel (degrees).
WALL, PARALLEL = 0.05, 0.1


def fits(
    zone: Zone, types: Sequence[BuildingType], rules: LayoutRules, placed: Placements
) -> list[str]:
    """Say which constraints a placement breaks.

    Parameters
    ----------
    zone, types, rules
        The ground, the kinds of buildings, what is asked.
    placed
        The buildings.

    Returns
    -------
    list of str
        A sentence for each breach; empty for a valid placement. Ways out are not looked at here.
    """
    shapes = footprints(types, placed)
    pairs = _pairs(shapes, max(rules.gap_m, METRES))
    beside = [pair for pair in pairs if _border_upon(placed, shapes, *pair)]
    joined: nx.Graph = nx.Graph(beside)
    joined.add_nodes_from(range(len(placed)))
    groups = [sorted(group) for group in nx.connected_components(joined)]
    return [
        *_inside(zone, types, rules, placed, shapes),
        *_apart(rules, shapes, pairs, groups),
        *_lengths(rules, placed, shapes, groups),
        *_amounts(zone, types, rules, placed),
        *_sun(zone, types, rules, placed),
    ]


def _pairs(shapes: Shapes, within: float) -> list[tuple[int, int]]:
    """Return pairs of buildings no further apart than this."""
    found = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=within).T
    return [(int(a), int(b)) for a, b in found if a < b]


def _border_upon(placed: Placements, shapes: Shapes, a: int, b: int) -> bool:
    """Tell whether two buildings share more than half of the smaller side wall."""
    turn = (placed.facing[a] - placed.facing[b] + 180.0) % 360.0 - 180.0
    if abs(turn) >= PARALLEL:
        return False
    walls = [_side_walls(shapes[at]) for at in (a, b)]
    depth = min(wall.length for pair in walls for wall in pair)
    return any(
        one.intersection(two.buffer(WALL, cap_style="flat")).length > depth / 2
        for one in walls[0]
        for two in walls[1]
    )


def _side_walls(shape: shapely.Polygon) -> tuple[shapely.LineString, shapely.LineString]:
    """Return the walls left and right of the façade, which is the first side of a footprint."""
    ring = shape.exterior.coords
    return shapely.LineString(ring[1:3]), shapely.LineString(ring[3:5])


def _inside(
    zone: Zone,
    types: Sequence[BuildingType],
    rules: LayoutRules,
    placed: Placements,
    shapes: Shapes,
) -> list[str]:
    said = []
    home = residences(types, placed)
    for number, patch in enumerate(zone.patches):
        ground = patch.polygon.buffer(METRES)
        for at in np.flatnonzero(placed.patch == number):
            if (patch.residences if home[at] else patch.facilities) == EMPTY:
                use = types[placed.type[at]].use
                said.append(f"building {at} is a {use} in a patch without any")
            if not ground.covers(shapes[at]):
                said.append(f"building {at} is not within its patch")
            elif patch.polygon.boundary.distance(shapes[at]) < rules.setback_m - METRES:
                said.append(f"building {at} is nearer than the setback to the edge of its patch")
            if any(shapes[at].intersection(stone).area > METRES_2 for stone in zone.obstacles):
                said.append(f"building {at} stands on an obstacle")
    return said


def _apart(
    rules: LayoutRules, shapes: Shapes, pairs: list[tuple[int, int]], groups: list[list[int]]
) -> list[str]:
    group = {at: number for number, members in enumerate(groups) for at in members}
    said = []
    for a, b in pairs:
        if shapes[a].intersection(shapes[b]).area > METRES_2:
            said.append(f"buildings {a} and {b} overlap")
        elif group[a] != group[b] and shapes[a].distance(shapes[b]) < rules.gap_m - METRES:
            said.append(f"buildings {a} and {b} are nearer than the gap")
    return said


def _lengths(
    rules: LayoutRules, placed: Placements, shapes: Shapes, groups: list[list[int]]
) -> list[str]:
    """Measure each group along its façades from end to end."""
    said = []
    for members in groups:
        angle = np.radians(placed.facing[members[0]])
        along = shapely.get_coordinates(shapes[members]) @ (np.cos(angle), -np.sin(angle))
        if len(members) > 1 and np.ptp(along) > rules.group_m + METRES * len(members):
            said.append(f"the group of building {members[0]} is {np.ptp(along):.1f} m long")
    return said


def _amounts(
    zone: Zone, types: Sequence[BuildingType], rules: LayoutRules, placed: Placements
) -> list[str]:
    area = zone.polygon.area
    kinds = [types[at] for at in placed.type]
    far = sum(kind.floor_area_m2 for kind in kinds) / area
    density = sum(kind.footprint_m2 for kind in kinds) / area
    said = []
    if far > rules.most_far + SHARE:
        said.append(f"the floor area ratio is {far:.4f}, over its limit")
    if density > rules.most_density + SHARE:
        said.append(f"the density is {density:.4f}, over its limit")
    for at, kind in enumerate(types):
        number = int((placed.type == at).sum())
        if kind.count is not None and number > kind.count:
            said.append(f"there are {number} buildings of type '{kind.name}'")
    return said


def _sun(
    zone: Zone, types: Sequence[BuildingType], rules: LayoutRules, placed: Placements
) -> list[str]:
    dark = shaded(zone, types, placed, rules.sun) & residences(types, placed)
    return [f"residence {at} is in the shade" for at in np.nonzero(dark)[0]]
