"""A game level as a graph: its blocks, and the places where the route passes between them.

The route runs through blocks and never along their borders (CND-x eq. 19-20), so it gets from
one block into another only at vertices. At a vertex of valence 4 it then runs straight on,
between two blocks; at irregular vertices more blocks may meet.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from ...errors import InputError
from ...network.problem import BoolArray, FloatArray
from ..types import IntArray, RoomPlan, RoomProblem
from .trails import Trail, trails


@dataclass(frozen=True)
class Passage:
    """A vertex where the route gets from block to block.

    Attributes
    ----------
    vertex
        Mesh vertex.
    blocks
        The blocks that meet there, two or more, ascending.
    """

    vertex: int
    blocks: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Level:
    """A game level with b blocks on a mesh with n vertices, m faces and e edges.

    Blocks are numbered from 0 in the order of `RoomPlan.rooms`.

    Attributes
    ----------
    problem, plan
        What was asked, and what was found.
    face_block
        Shape (m,). Block of each face, -1 where there is none.
    edge_block
        Shape (e,). Block of each edge of the route, -1 for edges without route.
    passages
        Places where the route gets from block to block, by vertex.
    along
        Shape (n,). Distance from the start along the route, metres, infinite off the route.
    start
        Vertex where the route begins.
    goal
        Vertex where it should end: a sink, or a vertex of the block that is farthest from the
        start, where treasure rooms are counted of the dead end that is.
    start_block, goal_block
        The blocks there.
    order
        Rank of each block along the route from the start, from 1; breadth first where the
        route branches.
    """

    problem: RoomProblem
    plan: RoomPlan
    face_block: IntArray
    edge_block: IntArray
    passages: tuple[Passage, ...]
    along: FloatArray
    start: int
    goal: int
    start_block: int
    goal_block: int
    order: tuple[int, ...]

    @property
    def count(self) -> int:
        """Number of blocks."""
        return len(self.plan.rooms)

    @property
    def route(self) -> BoolArray:
        """Shape (e,): edges of the route."""
        return np.asarray(self.edge_block >= 0)

    @property
    def roles(self) -> tuple[str, ...]:
        """Of each block: "start", "goal", "treasure" for other dead ends, or "" .

        No dead end in which the route begins or ends is a treasure, although where two blocks meet
        there only one of them is the start.
        """
        dead = set(dead_ends(self.count, self.passages))
        dead -= _blocks_of((self.start, self.goal), self.problem, self.edge_block)
        names = ["treasure" if block in dead else "" for block in range(self.count)]
        names[self.goal_block] = "goal"
        names[self.start_block] = "start"
        return tuple(names)

    def template(self, block: int) -> int:
        """Return the template of a block."""
        return int(self.problem.placements.template[self.plan.rooms[block]])


def read_level(
    problem: RoomProblem, plan: RoomPlan, *, start: int | None = None, goal: int | None = None
) -> Level:
    """Read a level from a plan.

    Parameters
    ----------
    problem, plan
        A level and its plan.
    start
        Vertex of the route where it begins; None for the sink of the lowest number there.
    goal
        Vertex of the route where it ends; None for the next sink, or where there is none for a
        vertex of the block that is farthest from the start. Where the problem asks for a number
        of treasure rooms it is the dead end that is farthest.

    Raises
    ------
    InputError
        If there is no sink and no start, the start or the goal is not on the route, or the plan
        is no level: rooms overlap, or the route runs along a border or leaves a block out.
    """
    mesh = problem.network.mesh
    face_block = _block_of_faces(problem, plan)
    edge_block = _block_of_edges(problem, plan, face_block)
    passages = find_passages(mesh.edges, edge_block)
    degree = np.bincount(mesh.edges[edge_block >= 0].ravel(), minlength=len(mesh.vertices))
    sinks = [int(v) for v in np.flatnonzero(problem.network.sinks & (degree > 0))]
    if start is None:
        if not sinks:
            raise InputError("No sink is on the route of the level.", "Give it a start.")
        start = sinks[0]
    rest = [v for v in sinks if v != start]
    for name, vertex in (("start", start), ("goal", goal if goal is not None else start)):
        if not 0 <= vertex < len(degree) or not degree[vertex]:
            raise InputError(
                f"The {name} of the level, mesh vertex {vertex}, is not on its route.",
                "Choose a vertex where the route passes.",
            )
    along = _distances(mesh.edges[edge_block >= 0], mesh.lengths[edge_block >= 0], degree, start)
    if goal is None and rest:
        goal = rest[0]
    touching = _blocks_at(mesh.edges, edge_block)
    if goal is None:
        able = list(range(len(plan.rooms)))
        if problem.treasures is not None:
            away = set(dead_ends(len(plan.rooms), passages))
            able = sorted(away - _blocks_of((start,), problem, edge_block)) or able
        goal_block, goal = _farthest(along, touching, passages, able)
    else:
        goal_block = min(touching[goal]) if goal in touching else -1
    if goal_block < 0 or not np.isfinite(along[mesh.edges[edge_block >= 0]]).all():
        raise InputError(
            "Parts of the level cannot be reached from its start.", "Solve the level again."
        )
    start_block = min(touching[start])
    pieces = trails(mesh.edges, edge_block >= 0, along, stops=(start,))
    order = _order(pieces, edge_block, along, passages, start_block, len(plan.rooms))
    return Level(
        problem, plan, face_block, edge_block, passages, along, start, goal, start_block,
        goal_block, order,
    )  # fmt: skip


def find_passages(edges: IntArray, edge_block: IntArray) -> tuple[Passage, ...]:
    """Find the vertices where edges of several blocks meet.

    Parameters
    ----------
    edges
        Shape (e, 2). Vertices of each edge.
    edge_block
        Shape (e,). Block of each edge of the route, -1 for the others.
    """
    at = _blocks_at(edges, edge_block)
    return tuple(Passage(v, tuple(sorted(at[v]))) for v in sorted(at) if len(at[v]) > 1)


def neighbours(count: int, passages: Sequence[Passage]) -> tuple[tuple[int, ...], ...]:
    """Return for each of `count` blocks those that share a passage with it, ascending."""
    found: list[set[int]] = [set() for _ in range(count)]
    for passage in passages:
        for block in passage.blocks:
            found[block].update(passage.blocks)
    return tuple(tuple(sorted(others - {block})) for block, others in enumerate(found))


def dead_ends(count: int, passages: Sequence[Passage]) -> tuple[int, ...]:
    """Return the blocks, of `count`, that have one passage only, ascending."""
    number = np.bincount([b for p in passages for b in p.blocks], minlength=count)
    return tuple(int(b) for b in np.flatnonzero(number == 1))


def meeting_graph(count: int, passages: Sequence[Passage]) -> nx.Graph:
    """Give blocks and passages as one graph.

    Returns
    -------
    networkx.Graph
        Nodes ("block", index) and ("passage", vertex), joined where a block is at a passage, so
        that two passages between the same blocks count as a cycle and a place where three
        blocks meet does not.
    """
    graph = nx.Graph()
    graph.add_nodes_from(("block", block) for block in range(count))
    for passage in passages:
        graph.add_edges_from(
            (("block", block), ("passage", passage.vertex)) for block in passage.blocks
        )
    return graph


def is_path(count: int, passages: Sequence[Passage]) -> bool:
    """Tell whether blocks lie one behind the other."""
    graph = meeting_graph(count, passages)
    return bool(nx.is_tree(graph)) and all(degree <= 2 for _, degree in graph.degree)


def is_cycle(count: int, passages: Sequence[Passage]) -> bool:
    """Tell whether blocks form one ring."""
    graph = meeting_graph(count, passages)
    return bool(nx.is_connected(graph)) and all(degree == 2 for _, degree in graph.degree)


def _block_of_faces(problem: RoomProblem, plan: RoomPlan) -> IntArray:
    """Return the block of each face; refuse blocks that overlap."""
    found = np.full(len(problem.network.mesh.faces), -1, dtype=np.int64)
    for block, room in enumerate(plan.rooms):
        faces = np.array(problem.placements.faces[room], dtype=np.int64)
        if (found[faces] >= 0).any():
            raise InputError(
                f"Blocks {int(found[faces].max()) + 1} and {block + 1} of the level overlap.",
                "Solve the level again.",
            )
        found[faces] = block
    return found


def _block_of_edges(problem: RoomProblem, plan: RoomPlan, face_block: IntArray) -> IntArray:
    """Return the block of each edge of the route; refuse routes along borders."""
    route = plan.active | problem.network.existing
    sides = problem.network.mesh.edge_faces
    one = face_block[sides[:, 0]]
    other = np.where(sides[:, 1] < 0, -1, face_block[sides[:, 1]])
    wrong = np.flatnonzero(route & ((one != other) | (one < 0)))
    if len(wrong):
        raise InputError(
            f"The route runs along the border of a block at mesh edge {int(wrong[0])} "
            f"({len(wrong)} such edges).",
            "Solve the level again.",
        )
    found: IntArray = np.where(route, one, -1)
    missing = np.setdiff1d(np.arange(len(plan.rooms)), found)
    if len(missing):
        raise InputError(
            f"The route leaves out block {int(missing[0]) + 1} ({len(missing)} such blocks).",
            "Solve the level again.",
        )
    return found


def _blocks_at(edges: IntArray, edge_block: IntArray) -> dict[int, set[int]]:
    """Return the blocks whose edges of the route meet at each vertex of the route."""
    found: dict[int, set[int]] = {}
    for e in np.flatnonzero(edge_block >= 0).tolist():
        for v in edges[e].tolist():
            found.setdefault(v, set()).add(int(edge_block[e]))
    return found


def _blocks_of(vertices: Sequence[int], problem: RoomProblem, edge_block: IntArray) -> set[int]:
    """Return the blocks in which the route touches one of some vertices."""
    ends = problem.network.mesh.edges
    at = (edge_block >= 0) & np.isin(ends, list(vertices)).any(axis=1)
    return set(edge_block[at].tolist())


def _distances(ends: IntArray, length: FloatArray, degree: IntArray, start: int) -> FloatArray:
    """Return the distance of each vertex from the start along the route."""
    n = len(degree)
    matrix = coo_array((length, (ends[:, 0], ends[:, 1])), shape=(n, n)).tocsr()
    found: FloatArray = dijkstra(matrix, directed=False, indices=start)
    return found


def _farthest(
    along: FloatArray,
    touching: dict[int, set[int]],
    passages: Sequence[Passage],
    able: Sequence[int],
) -> tuple[int, int]:
    """Return the block of some that is entered last, and its vertex that is farthest inside."""
    doors = {p.vertex for p in passages}
    entered = dict.fromkeys(able, math.inf)
    for v, blocks in touching.items():
        for block in blocks.intersection(entered):
            entered[block] = min(entered[block], along[v])
    block = max(entered, key=lambda b: (entered[b], -b))
    own = sorted(v for v, blocks in touching.items() if block in blocks)
    return block, max(own, key=lambda v: (v not in doors, along[v]))


def _order(
    pieces: Sequence[Trail],
    edge_block: IntArray,
    along: FloatArray,
    passages: Sequence[Passage],
    first: int,
    count: int,
) -> tuple[int, ...]:
    """Rank the blocks: along a route without branches, else breadth first."""
    if len(pieces) == 1:
        passed = [int(edge_block[e]) for e in pieces[0].edges]
        # a ring may begin where two blocks meet, in the other one
        queue = list(dict.fromkeys(passed if passed[0] == first else passed[::-1]))
    else:
        at: dict[int, list[Passage]] = {}
        for passage in sorted(passages, key=lambda p: (along[p.vertex], p.vertex)):
            for block in passage.blocks:
                at.setdefault(block, []).append(passage)
        queue, waiting = [first], deque([first])
        while waiting:
            for passage in at.get(waiting.popleft(), ()):
                for block in passage.blocks:
                    if block not in queue:
                        queue.append(block)
                        waiting.append(block)
        # what only another part of the same block leads to is reached through the route anyway
        queue += [block for block in range(count) if block not in queue]
    rank = {block: i + 1 for i, block in enumerate(queue)}
    return tuple(rank[block] for block in range(count))
