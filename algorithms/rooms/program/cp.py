"""Rooms in a CP-SAT model of a network: of the whole plan, or of a window of it.

Instead of the paper's equation 16 (no corridor inside a room, one row per placement) there is one
row per edge: at most one of the edge itself and the placements that have it inside. It implies
equation 16 and relaxes better, since no two placements over an edge can be chosen anyway.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from ...network.cp.model import CpNetwork, whole_scale
from ...network.problem import BoolArray
from ..types import CountRule, IntArray
from .index import RoomIndex
from .parts import touched_by
from .treasures import add_treasures

#: Areas of rooms in counts become multiples of this part of a unit, where they are not whole.
FINEST_COUNT = 1_000_000
#: What limits of such sums may be missed by, from rounding alone.
ROUNDING = 1e-6


def add_rooms(network: CpNetwork, index: RoomIndex, faces: Iterable[int], kept: BoolArray) -> None:
    """Add the rooms of some faces to a model whose other rooms stay.

    Parameters
    ----------
    network
        The model. Free edges of it lie at the given faces.
    index
        The rooms.
    faces
        Faces to be tiled anew; all that are to be tiled, for the whole plan.
    kept
        Shape (r,). Chosen placements; those on the given faces are chosen anew.
    """
    free_faces = list(faces)
    network.tail = kept.copy()
    for r in index.within(free_faces):
        network.tail[r] = False
    for r in index.within(free_faces):
        if not _barred(network, index, r):
            network.further[r] = network.model.new_bool_var("")
    for f in free_faces:
        network.check()
        rooms = [network.further[r] for r in index.by_face[f] if r in network.further]
        network.model.add_exactly_one(rooms)
    if index.problem.kind == "floor":
        _add_floor(network, index)
    else:
        _add_level(network, index)
    _add_counts(network, index)
    add_treasures(network, index)


def _barred(network: CpNetwork, index: RoomIndex, room: int) -> bool:
    """Tell whether edges that are fixed already forbid a placement."""
    placements = index.problem.placements
    floor = index.problem.kind == "floor"
    against = placements.inner[room] if floor else placements.rim[room]
    return any(network.literal(e) is True for e in against)


def _add_floor(network: CpNetwork, index: RoomIndex) -> None:
    """Allow no corridor inside a room (CND eq. 16), demand one along each (eq. 17)."""
    placements, rooms = index.problem.placements, network.further
    for e in network.free:
        inside = [rooms[r].index for r in index.by_inner[e] if r in rooms]
        if inside:
            network.write.at_most_one([network.number[e], *inside])
    for r, literal in rooms.items():
        network.clause([~literal, *(network.literal(e) for e in placements.rim[r])])
    # rooms that stay may lose the corridor that they had
    stay = {r for e in network.free for r in index.by_rim[e] if network.tail[r]}
    for r in sorted(stay):
        network.clause([network.literal(e) for e in placements.rim[r]])


def _add_level(network: CpNetwork, index: RoomIndex) -> None:
    """Demand a route through each block (CND-x eq. 19), none along its borders (eq. 20)."""
    placements, rooms = index.problem.placements, network.further
    for e in network.free:
        inside = [r for r in index.by_inner[e] if r in rooms]
        stays = any(network.tail[r] for r in index.by_inner[e])
        if not stays:
            # every face has one block: an edge lies inside a block or on a border
            network.clause([~network.edge[e], *(rooms[r] for r in inside)])
    for r, literal in rooms.items():
        network.clause([~literal, *(network.literal(e) for e in placements.inner[r])])
    _add_parts(network, index)


def _add_parts(network: CpNetwork, index: RoomIndex) -> None:
    """Let the route touch at most one vertex more than it has edges in a block; see `parts`."""
    touched: dict[tuple[int, ...], int] = {}
    for r, literal in network.further.items():
        network.check()
        at = touched_by(index, r)
        edges = {e: network.number[e] for mine in at.values() for e in mine if e in network.number}
        vertices = []
        for mine in at.values():
            open_ = tuple(edges[e] for e in mine if e in edges)
            if len(open_) > 1 and open_ not in touched:
                touched[open_] = network.write.whole(1)
                for x in open_:
                    network.write.implies(x, touched[open_])
            if open_:
                vertices.append(touched[open_] if len(open_) > 1 else open_[0])
        variables = [*edges.values(), *vertices]
        weights = [1] * len(edges) + [-1] * len(vertices)
        if vertices:
            network.write.at_least(variables, weights, -1, only_if=(literal.index,))


def _add_counts(network: CpNetwork, index: RoomIndex) -> None:
    """Keep the limits of numbers and areas; rooms that stay count, too."""
    for rule in index.problem.counts:
        for weight, low, high in whole_limits(rule):
            already = int(weight[network.tail].sum())
            rooms = [(x, int(weight[r])) for r, x in network.further.items() if weight[r]]
            total = network.expression.weighted_sum([x for x, _ in rooms], [w for _, w in rooms])
            if low is not None:
                network.model.add(total >= low - already)
            if high is not None:
                network.model.add(total <= high - already)


def whole_limits(rule: CountRule) -> list[tuple[IntArray, int | None, int | None]]:
    """Return a limit in whole numbers, rounded so that no plan that keeps it is lost.

    Returns
    -------
    list of tuple
        Weights, shape (r,), with the least or the largest sum.
    """
    scale = whole_scale(rule.weight.tolist(), FINEST_COUNT)
    scaled = rule.weight * scale
    found: list[tuple[IntArray, int | None, int | None]] = []
    if math.isfinite(rule.least) and rule.least > 0:
        up = np.ceil(scaled - ROUNDING).astype(np.int64)
        found.append((up, math.ceil(rule.least * scale - ROUNDING * scale), None))
    if math.isfinite(rule.most):
        down = np.floor(scaled + ROUNDING).astype(np.int64)
        found.append((down, None, math.floor(rule.most * scale + ROUNDING * scale)))
    return found
