"""Grounds to grow on, and what must hold of a growth, by code that knows nothing of growing."""

from __future__ import annotations

import hashlib
import math

import numpy as np
import shapely
from platwright.growth.grammar import Grammar, State
from platwright.growth.grammars.shipped import shipped_grammar
from platwright.growth.grow import grow
from platwright.growth.rules import GrowthRules
from platwright.growth.types import Ground, Growth, Start

START = State("m", "Start")
AHEAD = (0.0, 1.0)

#: An organic piece of land with a park and a square building, about 2.3 km wide, off the origin.
TURNS = np.linspace(0, 2 * math.pi, 60, endpoint=False)
RADII = 900 + 150 * np.sin(3 * TURNS + 1) + 100 * np.cos(5 * TURNS)
CENTRE = (500_000.0, 5_400_000.0)
LAND = shapely.Polygon(
    np.c_[CENTRE[0] + 1.3 * RADII * np.cos(TURNS), CENTRE[1] + RADII * np.sin(TURNS)]
)
SITE = LAND - shapely.Point(CENTRE[0] + 400, CENTRE[1] + 300).buffer(150)
SITE = SITE - shapely.box(CENTRE[0] - 600, CENTRE[1] - 300, CENTRE[0] - 350, CENTRE[1] + 100)
#: A road that bends its way through the land, crossed by another in its fifth vertex.
ROAD = CENTRE + np.array(
    [(-700, -420), (-500, -400), (-300, -380), (-100, -400), (100, -300), (104, -296), (400, -100)]
)
CROSS = CENTRE + np.array([(200, -700), (100, -300), (0, 300)])


def open_ground(xy: tuple[float, float] = (0.0, 0.0)) -> Ground:
    """Nothing but a start."""
    return Ground((Start(xy, AHEAD, START),))


def site_ground() -> Ground:
    """An organic site with holes."""
    return Ground((Start(CENTRE, AHEAD, START),), SITE)


def street_ground(grammar: Grammar, *, domain: bool, edge: bool = False) -> Ground:
    """Two crossing streets; growth begins at two loose ends.

    With `edge` a street runs along the whole outer edge of the site.
    """
    nodes = [*map(tuple, ROAD), tuple(CROSS[0]), tuple(CROSS[2])]
    ends = [(k, k + 1) for k in range(len(ROAD) - 1)] + [(7, 4), (4, 8)]
    street = [0] * (len(ROAD) - 1) + [1, 1]
    if edge:
        ring = np.asarray(LAND.exterior.coords)[:-1]
        first = len(nodes)
        nodes += list(map(tuple, ring))
        count = len(ring)
        ends += [(first + k, first + (k + 1) % count) for k in range(count)]
        street += [2] * count
    bends = np.bincount(np.ravel(ends)) == 2
    last = CROSS[2] - CROSS[1]
    starts = (
        Start(nodes[8], tuple(last / np.hypot(*last)), grammar.leaf, 8),
        Start(nodes[0], tuple(ROAD[0] - ROAD[1]), grammar.leaf, 0),
    )
    return Ground(
        starts,
        SITE if domain else None,
        np.array(nodes),
        np.array(ends),
        np.array(street),
        bends,
    )


def a_ground(kind: str, grammar: Grammar) -> Ground:
    """Return a ground by its name."""
    if kind == "open":
        return open_ground()
    if kind == "site":
        return site_ground()
    return street_ground(grammar, domain=kind != "streets", edge=kind == "edge")


GROUNDS = ("open", "site", "streets", "both", "edge")
SCALES = {"open": 100.0, "site": 60.0, "streets": 80.0, "both": 60.0, "edge": 60.0}
FOUR = {name: shipped_grammar(name) for name in ("organic", "grid", "hex", "line")}


def lines_of(growth: Growth) -> np.ndarray:
    """Return the edges as lines."""
    return shapely.linestrings(growth.xy[growth.ends])


def faults(growth: Growth, apart: float = 1e-4) -> list[str]:
    """Return where a growth is not planar: pairs of edges that meet outside of shared nodes.

    Edges without a shared node must be `apart` metres from each other; those with one must form
    an angle of at least half a degree there, which for straight edges rules out any other touch.
    """
    lines = lines_of(growth)
    found = [f"edge {e} is {d:.2e} m long" for e, d in enumerate(growth.lengths) if d < apart]
    first, second = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=apart)
    pairs = np.c_[first, second][first < second]
    for one, two in pairs.tolist():
        shared = set(growth.ends[one]) & set(growth.ends[two])
        if not shared:
            found.append(f"edges {one} and {two} touch")
        elif len(shared) == 2:
            found.append(f"edges {one} and {two} are the same")
        elif angle(growth, one, two, shared.pop()) < 0.5:
            found.append(f"edges {one} and {two} overlap")
    used = np.unique(growth.ends)
    tree = shapely.STRtree(shapely.points(growth.xy[used]))
    a, b = tree.query(shapely.points(growth.xy[used]), predicate="dwithin", distance=1e-3)
    found += [f"nodes {used[i]} and {used[j]} are one" for i, j in zip(a, b) if i < j]
    return found


def angle(growth: Growth, one: int, two: int, node: int) -> float:
    """Return the angle between two edges at a node, degrees."""
    ways = []
    for edge in (one, two):
        a, b = growth.ends[edge]
        ways.append(growth.xy[b if a == node else a] - growth.xy[node])
    turn = math.atan2(np.cross(*ways), np.dot(*ways))
    return abs(math.degrees(turn))


def least_angle(growth: Growth) -> float:
    """Return the least angle that a grown edge forms with any other, degrees."""
    at: dict[int, list[int]] = {}
    for edge, ends in enumerate(growth.ends.tolist()):
        for node in ends:
            at.setdefault(node, []).append(edge)
    return min(
        angle(growth, one, two, node)
        for node, edges in at.items()
        for k, one in enumerate(edges)
        for two in edges[:k]
        if growth.grown[one] or growth.grown[two]
    )


def as_bytes(growth: Growth) -> bytes:
    """Return all columns of a growth, not its seconds."""
    columns = (
        growth.xy, growth.road_type, growth.node_type, growth.born, growth.incoming_road,
        growth.incoming, growth.bends, growth.ends, growth.road, growth.edge_type, growth.step,
        growth.street,
    )  # fmt: skip
    return b"".join(column.tobytes() for column in columns) + growth.stopped.encode()


def digest() -> str:
    """Return a digest of one growth of each grammar."""
    found = hashlib.sha256()
    for grammar in FOUR.values():
        ground = a_ground("both", grammar)
        found.update(as_bytes(grow(ground, GrowthRules(grammar, scale=60.0, max_segments=250))))
    return found.hexdigest()
