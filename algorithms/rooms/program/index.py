"""Which placements touch which faces and edges of a mesh."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...network.problem import BoolArray, NetworkProblem
from ..types import RoomProblem

#: A vertex where a block may have a passage, its edges inside the block, and those beyond it.
Gate = tuple[int, tuple[int, ...], tuple[int, ...]]


@dataclass(eq=False)
class RoomIndex:
    """Index of a `RoomProblem` with m faces, e edges and r placements, in plain lists.

    A design is an array of e + r truth values: edges first, then placements.

    Attributes
    ----------
    problem
        The problem.
    by_face
        For each face, the placements that cover it.
    by_inner, by_rim
        For each edge, the placements that have it inside, and on their rim.
    face_sides
        For each face, its four edges.
    edge_faces
        For each edge, its one or two faces.
    """

    problem: RoomProblem
    by_face: list[list[int]] = field(init=False)
    by_inner: list[list[int]] = field(init=False)
    by_rim: list[list[int]] = field(init=False)
    face_sides: list[list[int]] = field(init=False)
    edge_faces: list[list[int]] = field(init=False)
    _gates: dict[int, list[Gate]] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Turn the lists of placements round."""
        mesh, placements = self.problem.network.mesh, self.problem.placements
        self.by_face = _turned(placements.faces, len(mesh.faces))
        self.by_inner = _turned(placements.inner, len(mesh.edges))
        self.by_rim = _turned(placements.rim, len(mesh.edges))
        self.face_sides = mesh.face_edges.tolist()
        self.edge_faces = [[f for f in pair if f >= 0] for pair in mesh.edge_faces.tolist()]

    @property
    def edges(self) -> int:
        """Number of edges, e."""
        return len(self.by_inner)

    def rooms_of(self, design: BoolArray) -> list[int]:
        """Return the placements of a design, ascending."""
        chosen: list[int] = np.flatnonzero(design[self.edges :]).tolist()
        return chosen

    def room_at(self, rooms: Iterable[int]) -> list[int]:
        """Return the placement on each face, -1 where there is none."""
        at = [-1] * len(self.face_sides)
        for r in rooms:
            for f in self.problem.placements.faces[r]:
                at[f] = r
        return at

    def gates(self, room: int) -> list[Gate]:
        """Return the places where a route may get into or out of a placement.

        Each is a vertex of its rim, the candidate edges there that lie inside the placement, and
        those that lie beyond it; none of either is empty.
        """
        if room not in self._gates:
            self._gates[room] = _gates(self.problem, room)
        return self._gates[room]

    def within(self, faces: Iterable[int]) -> list[int]:
        """Return the placements that lie wholly on the given faces, ascending."""
        inside = set(faces)
        touching = {r for f in inside for r in self.by_face[f]}
        return sorted(r for r in touching if inside.issuperset(self.problem.placements.faces[r]))


def _gates(problem: RoomProblem, room: int) -> list[Gate]:
    """Return the gates of a placement; see `RoomIndex.gates`."""
    mesh, may = problem.network.mesh, problem.network.candidate
    inner = set(problem.placements.inner[room])
    rim = set(problem.placements.rim[room])
    found: list[Gate] = []
    for v in sorted({v for e in rim for v in mesh.edges[e].tolist()}):
        own = [e for e in mesh.vertex_edges[v].tolist() if may[e] and e not in rim]
        inside = tuple(e for e in own if e in inner)
        beyond = tuple(e for e in own if e not in inner)
        if inside and beyond:
            found.append((v, inside, beyond))
    return found


def _turned(rows: Sequence[Sequence[int]], count: int) -> list[list[int]]:
    """Return, for each of `count` things, the rows that name it."""
    found: list[list[int]] = [[] for _ in range(count)]
    for r, row in enumerate(rows):
        for item in row:
            found[item].append(r)
    return found


def covered_problem(index: RoomIndex) -> NetworkProblem:
    """Return a network problem without rooms that every plan solves: a relaxation.

    Whatever room covers a face has a corridor on its rim (a route inside, CND-x eq. 19), so that
    one vertex of all rims of the placements there is active. That is coverage as streets have it
    (CND eq. 6), and what is known of bounds of streets holds for rooms, too.
    """
    problem = index.problem
    mesh = problem.network.mesh
    edges, faces = mesh.edges, mesh.faces.tolist()
    lists = problem.placements.rim if problem.kind == "floor" else problem.placements.inner
    candidate = problem.network.candidate | problem.network.existing
    cover: dict[int, tuple[int, ...]] = {}
    for f in np.flatnonzero(problem.floor).tolist():
        used = {e for r in index.by_face[f] for e in lists[r] if candidate[e]}
        ball = tuple(sorted({int(v) for e in used for v in edges[e]}))
        if any(problem.network.existing[e] for e in used):
            continue
        for v in faces[f]:
            if v not in cover or len(ball) < len(cover[v]):
                cover[v] = ball
    return replace(problem.network, cover=cover, cover_radius=None, cover_penalty=np.inf)
