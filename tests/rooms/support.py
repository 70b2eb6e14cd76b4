"""Small room problems, made by coordinates: independent of the library's own enumeration."""

from __future__ import annotations

import collections
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from platwright.mesh.quadmesh import QuadMesh
from platwright.network.problem import NetworkProblem
from platwright.rooms.types import CountRule, Placements, RoomProblem, Template

SHAPES = {
    "1x2": ["##"],
    "2x2": ["##", "##"],
    "3x2": ["###", "###"],
    "3x3": ["###", "###", "###"],
    "4x2": ["####", "####"],
    "L": ["##", "#."],
    "T": ["###", ".#."],
}


def cells_of(rows: Sequence[str]) -> frozenset[tuple[int, int]]:
    """Return the squares of a drawing, rows from the top."""
    return frozenset(
        (i, j) for j, row in enumerate(reversed(rows)) for i, mark in enumerate(row) if mark == "#"
    )


def turned(cells: frozenset[tuple[int, int]]) -> set[frozenset[tuple[int, int]]]:
    """Return all rotations and mirrorings of a shape, moved to the origin."""
    found = set()
    for sign in (1, -1):
        shape = {(sign * i, j) for i, j in cells}
        for _ in range(4):
            shape = {(-j, i) for i, j in shape}
            a, b = min(i for i, _ in shape), min(j for _, j in shape)
            found.add(frozenset((i - a, j - b) for i, j in shape))
    return found


def placed(mesh: QuadMesh, names: Sequence[str]) -> Placements:
    """Enumerate placements on a mesh of unit squares by their coordinates."""
    corner = np.round(mesh.vertices[mesh.faces].min(axis=1)).astype(int)
    at = {(int(x), int(y)): f for f, (x, y) in enumerate(corner)}
    found: dict[tuple[int, ...], int] = {}
    for t, name in enumerate(names):
        for shape in turned(cells_of(SHAPES[name])):
            for a, b in at:
                faces = [at.get((a + i, b + j)) for i, j in shape]
                if None not in faces:
                    found.setdefault(tuple(sorted(f for f in faces if f is not None)), t)
    order = sorted(found)
    sides = [collections.Counter(mesh.face_edges[list(fs)].ravel().tolist()) for fs in order]
    return Placements(
        np.array([found[fs] for fs in order]),
        tuple(order),
        tuple(tuple(sorted(e for e, k in own.items() if k == 2)) for own in sides),
        tuple(tuple(sorted(e for e, k in own.items() if k == 1)) for own in sides),
    )


def room_problem(
    mesh: QuadMesh,
    names: Sequence[str],
    kind: Any = "floor",
    *,
    sinks: Sequence[int] | None = None,
    outer: bool = False,
    counts: tuple[CountRule, ...] = (),
    placements: Placements | None = None,
    **rules: Any,
) -> RoomProblem:
    """Make a problem on a mesh of unit squares; its sink is the middle of the upper side."""
    count, size = len(mesh.edges), len(mesh.vertices)
    at = np.zeros(size, dtype=bool)
    if sinks is None:
        top = np.flatnonzero(mesh.vertices[:, 1] == mesh.vertices[:, 1].max())
        sinks = [int(top[np.argsort(mesh.vertices[top, 0])][len(top) // 2])]
    at[list(sinks)] = True
    fields: dict[str, Any] = {"dead_ends": math.inf, "too_close": math.inf, "zigzags": 5.0}
    fields.update(rules)
    network = NetworkProblem(
        mesh=mesh,
        existing=np.zeros(count, dtype=bool),
        candidate=np.ones(count, dtype=bool) if outer else ~mesh.boundary_edges,
        sinks=at,
        length=np.ones(count),
        required=np.zeros(count, dtype=bool),
        edge_factor=np.ones(count),
        **fields,
    )
    templates = tuple(Template(name, cells_of(SHAPES[name])) for name in names)
    where = placed(mesh, names) if placements is None else placements
    return RoomProblem(kind, network, templates, where, np.ones(len(mesh.faces), bool), counts)
