"""Small valid levels: drawn by hand, at random, or from a small program of the tests' own."""

from __future__ import annotations

import math
from collections.abc import Iterable

import networkx as nx
import numpy as np
from platwright.mesh.grids import fan, grid
from platwright.mesh.quadmesh import QuadMesh
from platwright.network.cp.ortools_access import cp_model
from platwright.network.problem import NetworkProblem
from platwright.rooms.types import Placements, RoomPlan, RoomProblem, Template

SQUARE = Template("square", frozenset({(0, 0), (1, 0), (0, 1), (1, 1)}), colour="#88aacc")
SLAB = Template("slab", frozenset((i, j) for i in range(3) for j in range(2)), colour="#ccaa88")
ELL = Template("ell", frozenset({(0, 0), (1, 0), (2, 0), (0, 1)}), colour="#88ccaa")
BAR = Template("bar", frozenset({(0, 0), (1, 0)}), colour="#cc88aa")


def between(mesh: QuadMesh, faces: Iterable[int]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return inner edges and rim of some faces, by counting."""
    sides = [e for f in faces for e in mesh.face_edges[f].tolist()]
    inner = tuple(sorted({e for e in sides if sides.count(e) == 2}))
    return inner, tuple(sorted({e for e in sides if sides.count(e) == 1}))


def level_problem(
    mesh: QuadMesh,
    rooms: list[tuple[int, tuple[int, ...]]],
    sinks: Iterable[int],
    *,
    branches: float = math.inf,
    dead_ends: float = math.inf,
    templates: tuple[Template, ...] = (SQUARE, SLAB, ELL, BAR),
) -> RoomProblem:
    """Make a problem of placements (template, faces) on a mesh."""
    parts = [between(mesh, faces) for _, faces in rooms]
    e = len(mesh.edges)
    sink = np.zeros(len(mesh.vertices), dtype=bool)
    sink[list(sinks)] = True
    network = NetworkProblem(
        mesh,
        existing=np.zeros(e, dtype=bool),
        candidate=~mesh.boundary_edges,
        sinks=sink,
        length=mesh.lengths / mesh.edge_length,
        required=np.zeros(e, dtype=bool),
        edge_factor=np.ones(e),
        branches=branches,
        dead_ends=dead_ends,
    )
    placements = Placements(
        np.array([t for t, _ in rooms]),
        tuple(tuple(sorted(faces)) for _, faces in rooms),
        tuple(inner for inner, _ in parts),
        tuple(rim for _, rim in parts),
    )
    floor = np.ones(len(mesh.faces), dtype=bool)
    return RoomProblem("level", network, templates, placements, floor)


def plan_of(problem: RoomProblem, rooms: Iterable[int], edges: Iterable[int]) -> RoomPlan:
    active = np.zeros(len(problem.network.mesh.edges), dtype=bool)
    active[list(edges)] = True
    away = np.full(len(problem.network.mesh.vertices), math.inf)
    return RoomPlan(tuple(rooms), active, 0.0, 0.0, 0.0, "optimal", away)


def walk(mesh: QuadMesh, points: Iterable[tuple[float, float]]) -> list[int]:
    """Return the edges along straight legs between points of a grid of unit squares."""
    at = {tuple(np.rint(p).astype(int)): v for v, p in enumerate(mesh.vertices)}
    found, points = [], list(points)
    for (x, y), (u, v) in zip(points, points[1:]):
        steps = int(max(abs(u - x), abs(v - y)))
        dx, dy = np.sign(u - x), np.sign(v - y)
        for k in range(steps):
            a, b = at[x + k * dx, y + k * dy], at[x + (k + 1) * dx, y + (k + 1) * dy]
            found.append(mesh.edge_between(a, b))
    return found


def vertex(mesh: QuadMesh, x: int, y: int) -> int:
    return int(np.argmin(np.hypot(*(mesh.vertices - (x, y)).T)))


def squares(nx_: int, ny: int) -> tuple[QuadMesh, list[tuple[int, tuple[int, ...]]]]:
    """Blocks of 2 by 2 on a grid, row by row; the middle of block (i, j) is (2i + 1, 2j + 1)."""
    mesh = grid(2 * nx_, 2 * ny)
    rooms = []
    for j in range(ny):
        for i in range(nx_):
            first = 2 * j * 2 * nx_ + 2 * i
            rooms.append((0, (first, first + 1, first + 2 * nx_, first + 2 * nx_ + 1)))
    return mesh, rooms


def linear() -> tuple[RoomProblem, RoomPlan]:
    """Return three blocks in a row, from the west wall to the east wall."""
    mesh, rooms = squares(3, 1)
    problem = level_problem(mesh, rooms, [vertex(mesh, 0, 1), vertex(mesh, 6, 1)])
    return problem, plan_of(problem, range(3), walk(mesh, [(0, 1), (6, 1)]))


def circular() -> tuple[RoomProblem, RoomPlan]:
    """Return four blocks around a point, the sink in the middle of the first."""
    mesh, rooms = squares(2, 2)
    problem = level_problem(mesh, rooms, [vertex(mesh, 1, 1)])
    edges = walk(mesh, [(1, 1), (3, 1), (3, 3), (1, 3), (1, 1)])
    return problem, plan_of(problem, range(4), edges)


def star() -> tuple[RoomProblem, RoomPlan]:
    """Return three blocks of two quads that meet at a vertex of valence 6, sinks at two ends."""
    mesh = fan(6, 1, 10.0)
    spokes = np.flatnonzero((mesh.edges == 0).any(axis=1)).tolist()
    faces = [set(mesh.edge_faces[e].tolist()) for e in spokes]
    chosen = [0]
    for k in range(1, 6):
        if all(not faces[k] & faces[c] for c in chosen):
            chosen.append(k)
    rooms = [(3, tuple(sorted(faces[k]))) for k in chosen]
    ends = [int(mesh.edges[spokes[k]].max()) for k in chosen]
    problem = level_problem(mesh, rooms, ends[:2], branches=0.0, dead_ends=0.0)
    return problem, plan_of(problem, range(3), [spokes[k] for k in chosen])


def random_tree(columns: int, rows: int, seed: int) -> tuple[RoomProblem, RoomPlan, nx.Graph]:
    """Return a branching level of 2 by 2 blocks, and the tree that its blocks form."""
    rng = np.random.default_rng(seed)
    whole = nx.grid_2d_graph(columns, rows)
    for edge in sorted(whole.edges):
        whole.edges[edge]["weight"] = rng.random()
    tree = nx.minimum_spanning_tree(whole)
    mesh, rooms = squares(columns, rows)
    legs = [
        e
        for (a, b), (c, d) in tree.edges
        for e in walk(mesh, [(2 * a + 1, 2 * b + 1), (2 * c + 1, 2 * d + 1)])
    ]
    # in from the west wall
    legs += walk(mesh, [(0, 1), (1, 1)])
    sink = [vertex(mesh, 0, 1)]
    problem = level_problem(mesh, rooms, sink, branches=0.0, dead_ends=0.0)
    numbered = nx.relabel_nodes(tree, {(i, j): j * columns + i for i, j in tree})
    return problem, plan_of(problem, range(columns * rows), sorted(set(legs))), numbered


def moved(problem: RoomProblem, move) -> RoomProblem:
    """Return the same level on a mesh whose vertices are moved by a function of (n, 2)."""
    import dataclasses

    old = problem.network.mesh
    mesh = QuadMesh(move(old.vertices), old.faces, old.edge_length)
    network = dataclasses.replace(problem.network, mesh=mesh)
    return dataclasses.replace(problem, network=network)


def solved(
    columns: int, rows: int, sinks: list[tuple[int, int]], *, seconds: float = 20.0
) -> tuple[RoomProblem, RoomPlan]:
    """Return a level without branches, each block crossed once, by a small program."""
    mesh = grid(columns, rows)
    rooms = {
        (t, tuple(sorted((y + j) * columns + x + i for i, j in cells)))
        for t, template in enumerate((SQUARE, SLAB, ELL, BAR))
        for cells in shapes(template.cells)
        for x in range(columns)
        for y in range(rows)
        if all(x + i < columns and y + j < rows for i, j in cells)
    }
    listed = sorted(rooms)
    problem = level_problem(mesh, listed, [vertex(mesh, x, y) for x, y in sinks])
    cp = cp_model()
    model = cp.CpModel()
    room = [model.NewBoolVar("") for _ in listed]
    edge = [model.NewBoolVar("") for _ in mesh.edges]
    for f in range(len(mesh.faces)):
        model.AddExactlyOne(room[r] for r, (_, faces) in enumerate(listed) if f in faces)
    # long blocks, since bars alone would make every plan easy
    model.Add(sum(room[r] for r, (t, _) in enumerate(listed) if t == 3) <= 2)
    for r in range(len(listed)):
        model.AddBoolOr([edge[e] for e in problem.placements.inner[r]] + [room[r].Not()])
        for e in problem.placements.rim[r]:
            model.AddImplication(room[r], edge[e].Not())
    arcs = []
    for e, (u, v) in enumerate(mesh.edges.tolist()):
        there, back = model.NewBoolVar(""), model.NewBoolVar("")
        model.Add(there + back == edge[e])
        arcs += [(u, v, there), (v, u, back)]
    ends = np.flatnonzero(problem.network.sinks).tolist()
    if len(ends) == 2:
        arcs.append((ends[1], ends[0], model.NewConstant(1)))
    arcs += [(v, v, model.NewBoolVar("")) for v in range(len(mesh.vertices)) if v not in ends]
    model.AddCircuit(arcs)
    while True:
        solver = cp.CpSolver()
        solver.parameters.max_time_in_seconds = seconds
        solver.parameters.num_workers = 1
        solver.parameters.random_seed = 3
        status = solver.Solve(model)
        assert status in (cp.OPTIMAL, cp.FEASIBLE), "the example has no level"
        taken = [r for r in range(len(listed)) if solver.Value(room[r])]
        on = {e for e in range(len(edge)) if solver.Value(edge[e])}
        torn = [
            r
            for r in taken
            if not nx.is_connected(
                nx.Graph(mesh.edges[sorted(on & set(problem.placements.inner[r]))].tolist())
            )
        ]
        if not torn:
            return problem, plan_of(problem, taken, sorted(on))
        for r in torn:
            inner = problem.placements.inner[r]
            other = [edge[e].Not() if e in on else edge[e] for e in inner]
            model.AddBoolOr([room[r].Not(), *other])


def shapes(cells) -> set[frozenset[tuple[int, int]]]:
    """Return a shape in all turns and mirrored, each at the origin."""
    found, now = set(), set(cells)
    for _ in range(2):
        for _ in range(4):
            low = min(i for i, _ in now), min(j for _, j in now)
            found.add(frozenset((i - low[0], j - low[1]) for i, j in now))
            now = {(-j, i) for i, j in now}
        now = {(-i, j) for i, j in now}
    return found
