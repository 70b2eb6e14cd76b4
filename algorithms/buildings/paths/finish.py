"""From a grown net to paths: ways of buildings, straightened and rounded lines, costs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import LineString, Point
from shapely.ops import nearest_points

from ..layout import Path
from ..types import Floats
from .ground import Ground
from .grow import corners_of
from .lane import Lane
from .net import GROUP, ROUTE, Net, nearest

#: A change of direction over this is a turn, degrees.
TURN_DEG = 20.0
#: Radius of rounded corners, metres, tried in this order.
RADII_M = (3.0, 2.0, 1.0)
#: So many corners one after another are stairs, drawn straight where there is room.
STAIRS = 3
#: A corner next to a piece shorter than this is left out where that makes a way smoother, metres.
SHORT_M = 4.0


@dataclass(eq=False)
class _Chain:
    """Edges between two forks."""

    nodes: list[int]
    kind: int
    line: Floats
    users: list[int] = field(default_factory=list)
    between: bool = False  # from one row to another


@dataclass(frozen=True, eq=False)
class Finished:
    """The paths of a patch and what they cost its buildings.

    Attributes
    ----------
    paths
        The paths, members as indices within the patch.
    reached, length_m, turns, roomy
        Per building, shape (n,).
    exit
        Number of the exit that a building uses, -1 for none, shape (n,).
    """

    paths: list[Path]
    reached: list[bool]
    length_m: list[float]
    turns: list[int]
    roomy: list[float]
    exit: list[int]


def bends(line: Floats) -> int:
    """Count the turns of a line (k, 2).

    Parameters
    ----------
    line
        Shape (k, 2), metres.
    """
    step = np.diff(line, axis=0)
    step = step[np.hypot(*step.T) > 1e-6]
    if len(step) < 2:
        return 0
    angle = np.degrees(np.arctan2(step[:, 1], step[:, 0]))
    turn = np.abs((np.diff(angle) + 180.0) % 360.0 - 180.0)
    return int((turn > TURN_DEG).sum())


def finish(
    lane: Lane, net: Net, ground: Ground, doors: Sequence[int], patch: int, entrance: Floats
) -> Finished:
    """Give the paths of a patch in the grid's coordinates.

    Parameters
    ----------
    lane
        The patch with its buildings.
    net
        What has grown.
    ground
        Says how roomy a place is.
    doors
        Node of each building's entrance, shape (n,).
    patch
        Index of the patch.
    entrance
        Entrances in the grid's coordinates, shape (n, 2).
    """
    chains = _chains(net, set(doors))
    for chain in chains:
        chain.line = _straightened(lane, chain, chains)
        chain.line = _eased(lane, chain, chains, set(doors))
    length = [float(np.hypot(*np.diff(chain.line, axis=0).T).sum()) for chain in chains]
    far, walks, exits = _walks(net, chains, length, doors)
    kept = _without_loose_ends(chains, far)
    cost = [_rough(ground, chain.line) for chain in chains]
    world = _world(lane, net, doors, entrance)
    paths = [_path(lane, net, chains[k], patch, world) for k in kept]
    total = [sum(length[k] for k, _ in walk) for walk in walks]
    return Finished(
        paths=paths,
        reached=[door in far for door in doors],
        length_m=total,
        turns=[_turns(chains, walk) for walk in walks],
        roomy=[
            sum(cost[k] * length[k] for k, _ in walk) / max(whole, 1e-9)
            for walk, whole in zip(walks, total)
        ],
        exit=exits,
    )


def _walks(
    net: Net, chains: list[_Chain], length: list[float], doors: Sequence[int]
) -> tuple[dict[int, float], list[list[tuple[int, bool]]], list[int]]:
    """Find the way of each door: its chains with their direction, and its exit (-1 for none)."""
    between: dict[tuple[int, int], int] = {}
    for k, chain in enumerate(chains):
        ends = chain.nodes[0], chain.nodes[-1]
        for pair in (ends, ends[::-1]):
            if pair not in between or length[k] < length[between[pair]]:
                between[pair] = k
    near: dict[int, list[tuple[int, float]]] = {}
    for (i, j), k in between.items():
        near.setdefault(i, []).append((j, length[k]))
    # Doors and exits that nothing touches are alone.
    for i in (*doors, *net.exits):
        near.setdefault(i, [])
    far, towards = nearest(near, net.exits)
    walks, exits = [], []
    for i, door in enumerate(doors):
        node = door
        walk: list[tuple[int, bool]] = []
        while node in towards:
            ahead = towards[node]
            k = between[node, ahead]
            walk.append((k, chains[k].nodes[0] == node))
            chains[k].users.append(i)
            node = ahead
        walks.append(walk)
        exits.append(net.exits.index(node) if door in far else -1)
    return far, walks, exits


def _world(lane: Lane, net: Net, doors: Sequence[int], entrance: Floats) -> Floats:
    """Give the nodes in the grid's coordinates; doors and exits exactly where they belong."""
    world = lane.frame.outward(np.asarray(net.points).reshape(-1, 2))
    for door, point in zip(doors, entrance):
        world[door] = point
    # A node may have been within the snapping distance of an exit before that was made.
    for node in net.exits:
        world[node] = nearest_points(lane.street, Point(world[node]))[0].coords[0]
    return world


def _chains(net: Net, doors: set[int]) -> list[_Chain]:
    """Cut the net at forks, doors, exits and where its kind changes."""
    near: dict[int, list[int]] = {}
    for i, j in sorted(net.edges):
        near.setdefault(i, []).append(j)
        near.setdefault(j, []).append(i)

    def kind(i: int, j: int) -> int:
        return net.edges[min(i, j), max(i, j)]

    stops = doors | set(net.exits)
    for i, ends in near.items():
        if len(ends) != 2 or (kind(i, ends[0]) == GROUP) != (kind(i, ends[1]) == GROUP):
            stops.add(i)
    used: set[tuple[int, int]] = set()
    chains = []
    # Rings without a stop begin anywhere.
    for i in [*sorted(s for s in stops if s in near), *sorted(near)]:
        for j in near[i]:
            if (min(i, j), max(i, j)) in used:
                continue
            nodes = [i, j]
            used.add((min(i, j), max(i, j)))
            while nodes[-1] not in stops and nodes[-1] != nodes[0]:
                a, b = near[nodes[-1]]
                nodes.append(b if a == nodes[-2] else a)
                used.add((min(nodes[-2:]), max(nodes[-2:])))
            line = corners_of(np.asarray([net.points[n] for n in nodes]))
            chains.append(_Chain(nodes, kind(i, j), line))
    rows = {n for c in chains if c.kind == GROUP for n in c.nodes}
    for c in chains:
        c.between = c.nodes[0] in rows and c.nodes[-1] in rows
    return chains


def _without_loose_ends(chains: list[_Chain], far: dict[int, float]) -> list[int]:
    """Drop what nobody uses and leads nowhere; keep links of loops."""
    kept = [k for k, c in enumerate(chains) if c.nodes[0] in far]
    while True:
        degree: dict[int, int] = {}
        for k in kept:
            for end in (chains[k].nodes[0], chains[k].nodes[-1]):
                degree[end] = degree.get(end, 0) + 1
        loose = {
            k
            for k in kept
            if not chains[k].users
            and any(degree[end] == 1 for end in (chains[k].nodes[0], chains[k].nodes[-1]))
        }
        if not loose:
            return kept
        kept = [k for k in kept if k not in loose]


def _straightened(lane: Lane, chain: _Chain, chains: list[_Chain]) -> Floats:
    """Draw stairs as one straight line where there is room and no other path is in the way."""
    line = chain.line
    i = 0
    while i < len(line) - STAIRS - 1:
        for j in range(len(line) - 1, i + STAIRS, -1):
            piece = line[[i, j]]
            if lane.allows(piece) and not _meets(piece, chain, chains):
                line = np.concatenate([line[: i + 1], line[j:]])
                break
        i += 1
    return line


def _eased(lane: Lane, chain: _Chain, chains: list[_Chain], doors: set[int]) -> Floats:
    """Leave out corners beside short pieces; the step out of a door stays as it is."""
    line = chain.line
    i = 1
    while i < len(line) - 1:
        at_door = (i == 1 and chain.nodes[0] in doors) or (
            i == len(line) - 2 and chain.nodes[-1] in doors
        )
        piece = line[[i - 1, i + 1]]
        short = min(math.dist(line[i], line[i - 1]), math.dist(line[i], line[i + 1])) < SHORT_M
        less = np.delete(line, i, axis=0)
        if (
            short
            and not at_door
            and _turning(less) < _turning(line) - 1.0
            and lane.allows(piece)
            and not _meets(piece, chain, chains)
        ):
            line, i = less, 1
        else:
            i += 1
    return line


def _turning(line: Floats) -> float:
    """Add up how far a line turns, degrees."""
    step = np.diff(line, axis=0)
    angle = np.degrees(np.arctan2(step[:, 1], step[:, 0]))
    return float(np.abs((np.diff(angle) + 180.0) % 360.0 - 180.0).sum())


def _meets(piece: Floats, chain: _Chain, chains: list[_Chain]) -> bool:
    """Tell whether a straight piece touches another path but at its ends."""
    straight = LineString(piece)
    inner = shapely.line_interpolate_point(straight, [0.1, max(straight.length - 0.1, 0.1)])
    short = LineString(inner)
    return any(
        other is not chain and len(other.line) > 1 and short.intersects(LineString(other.line))
        for other in chains
    )


def _rough(ground: Ground, line: Floats) -> float:
    """Give the mean roominess E along a line, 0 to 2."""
    total = length = 0.0
    for a, b in zip(line[:-1], line[1:]):
        far = math.dist(a, b)
        at = a + (np.arange(max(1, round(far))) + 0.5)[:, None] / max(1, round(far)) * (b - a)
        axis = 0 if abs(b[0] - a[0]) >= abs(b[1] - a[1]) else 1
        column = np.searchsorted((ground.xs[1:] + ground.xs[:-1]) / 2, at[:, 0])
        row = np.searchsorted((ground.ys[1:] + ground.ys[:-1]) / 2, at[:, 1])
        total += far * float(ground.rough[axis, row, column].mean())
        length += far
    return total / length if length else 0.0


def _turns(chains: list[_Chain], walk: list[tuple[int, bool]]) -> int:
    """Count the turns of a way."""
    if not walk:
        return 0
    parts = [chains[k].line if forward else chains[k].line[::-1] for k, forward in walk]
    return bends(np.concatenate(parts))


def _path(lane: Lane, net: Net, chain: _Chain, patch: int, world: Floats) -> Path:
    """Give a chain as a path, corners rounded."""
    line = lane.frame.outward(rounded(lane, chain.line))
    line[0], line[-1] = world[chain.nodes[0]], world[chain.nodes[-1]]
    end = next((n for n in (chain.nodes[-1], chain.nodes[0]) if n in net.exits), None)
    users = tuple(sorted(set(chain.users)))
    alone = len(users) == 1 and not (chain.kind == ROUTE and chain.between)
    kind = "group" if chain.kind == GROUP else "entrance" if alone else "shared"
    out = None if end is None else Point(world[end])
    return Path(LineString(line), kind, users, out, bends(chain.line), patch)


def rounded(lane: Lane, line: Floats) -> Floats:
    """Round the corners of a line where there is room.

    Parameters
    ----------
    lane
        Says where there is room.
    line
        Shape (k, 2), metres.
    """
    made = [line[0]]
    for before, corner, after in zip(line[:-2], line[1:-1], line[2:]):
        u, v = before - corner, after - corner
        a, b = math.hypot(*u), math.hypot(*v)
        u, v = u / a, v / b
        angle = math.acos(max(-1.0, min(1.0, float(u @ v))))
        for radius in RADII_M if math.pi - angle > math.radians(TURN_DEG) else ():
            cut = radius / math.tan(angle / 2)
            if cut > 0.5 * min(a, b):
                continue
            t = np.linspace(0.0, 1.0, 7)[:, None]
            # A quadratic curve that leaves and meets the straight lines smoothly.
            arc = (1 - t) ** 2 * (corner + u * cut) + 2 * t * (1 - t) * corner
            arc = arc + t**2 * (corner + v * cut)
            if lane.allows(arc):
                made.extend(arc)
                break
        else:
            made.append(corner)
    made.append(line[-1])
    return np.asarray(made)
