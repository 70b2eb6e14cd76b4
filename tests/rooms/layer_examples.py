"""Small valid floor plans: by hand, or at random from a tiny program of the tests' own."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterable, Sequence

import networkx as nx
import numpy as np
import shapely
from platwright.mesh.grids import fan, grid
from platwright.mesh.quadmesh import QuadMesh
from platwright.network.cp.ortools_access import cp_model
from platwright.network.problem import NetworkProblem
from platwright.rooms.types import Placements, RoomPlan, RoomProblem, Template

ROOM = Template("room", frozenset({(0, 0), (1, 0)}), colour="#88aacc", use="office")
HALL = Template("hall", frozenset(itertools.product(range(2), range(2))), colour="#ccaa88")
SMALL = Template("small", frozenset({(0, 0)}), colour="#aaccaa")
TEMPLATES = (ROOM, HALL, SMALL)


def sides(mesh: QuadMesh, faces: Iterable[int]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return inner edges and rim of some faces, by counting."""
    own = [e for f in faces for e in mesh.face_edges[f].tolist()]
    inner = tuple(sorted({e for e in own if own.count(e) == 2}))
    return inner, tuple(sorted({e for e in own if own.count(e) == 1}))


def floor_plan(
    mesh: QuadMesh,
    rooms: Sequence[tuple[int, ...]],
    edges: Iterable[int],
    sinks: Iterable[int],
) -> tuple[RoomProblem, RoomPlan]:
    """Give rooms as sets of faces and corridors as edges the form of a problem and its plan."""
    parts = [sides(mesh, faces) for faces in rooms]
    count = len(mesh.edges)
    sink = np.zeros(len(mesh.vertices), dtype=bool)
    sink[list(sinks)] = True
    network = NetworkProblem(
        mesh,
        existing=np.zeros(count, dtype=bool),
        candidate=np.ones(count, dtype=bool),
        sinks=sink,
        length=mesh.lengths / mesh.edge_length,
        required=np.zeros(count, dtype=bool),
        edge_factor=np.ones(count),
    )
    kind = {1: 2, 2: 0}
    placements = Placements(
        np.array([kind.get(len(faces), 1) for faces in rooms]),
        tuple(tuple(sorted(faces)) for faces in rooms),
        tuple(inner for inner, _ in parts),
        tuple(rim for _, rim in parts),
    )
    floor = np.zeros(len(mesh.faces), dtype=bool)
    floor[[f for faces in rooms for f in faces]] = True
    active = np.zeros(count, dtype=bool)
    active[list(edges)] = True
    away = np.full(len(mesh.vertices), math.inf)
    problem = RoomProblem("floor", network, TEMPLATES, placements, floor)
    return problem, RoomPlan(tuple(range(len(rooms))), active, 0, 0, 0, "optimal", away)


def vertex(mesh: QuadMesh, x: float, y: float) -> int:
    return int(np.argmin(np.hypot(*(mesh.vertices - (x, y)).T)))


def walk(mesh: QuadMesh, points: Iterable[tuple[float, float]]) -> list[int]:
    """Return the edges along straight legs between vertices of a grid."""
    h, found, points = mesh.edge_length, [], list(points)
    for (x, y), (u, v) in zip(points, points[1:]):
        steps = round(max(abs(u - x), abs(v - y)) / h)
        legs = np.linspace((x, y), (u, v), steps + 1)
        at = [vertex(mesh, *p) for p in legs]
        found += [mesh.edge_between(a, b) for a, b in zip(at, at[1:])]
    return found


def moved(problem: RoomProblem, move: Callable[[np.ndarray], np.ndarray]) -> RoomProblem:
    """Return the same floor on a mesh whose vertices are moved by a function of (n, 2)."""
    old = problem.network.mesh
    mesh = QuadMesh(move(old.vertices), old.faces, old.edge_length)
    return dataclasses.replace(problem, network=dataclasses.replace(problem.network, mesh=mesh))


def outline(problem: RoomProblem) -> shapely.Polygon:
    mesh = problem.network.mesh
    faces = shapely.polygons(mesh.vertices[mesh.faces])
    return shapely.coverage_union_all(faces)


def groups(mesh: QuadMesh, free: np.ndarray) -> list[tuple[int, ...]]:
    """Return rooms that may be: two faces at an edge, all faces around a vertex."""
    pairs = mesh.edge_faces[~mesh.boundary_edges]
    found = {tuple(sorted(pair)) for pair in pairs.tolist()}
    for v in np.flatnonzero(~mesh.boundary_vertices).tolist():
        found.add(tuple(np.flatnonzero((mesh.faces == v).any(axis=1)).tolist()))
    return sorted(g for g in found if free[list(g)].all())


def random_plan(
    mesh: QuadMesh, seed: int, *, blocked: Iterable[int] = (), outer: bool = False, spare: int = 0
) -> tuple[RoomProblem, RoomPlan]:
    """Tile a mesh at random and let corridors grow from a sink until they reach every room.

    `spare` further edges are kept where corridors could have been shorter.
    """
    rng = np.random.default_rng(seed)
    free = np.ones(len(mesh.faces), dtype=bool)
    free[list(blocked)] = False
    may = groups(mesh, free) + [(f,) for f in np.flatnonzero(free).tolist()]
    cp = cp_model()
    model = cp.CpModel()
    chosen = [model.NewBoolVar("") for _ in may]
    for f in np.flatnonzero(free).tolist():
        model.AddExactlyOne(chosen[k] for k, g in enumerate(may) if f in g)
    cost = [200 if len(g) == 1 else int(rng.integers(0, 60)) for g in may]
    model.Minimize(sum(c * x for c, x in zip(cost, chosen)))
    solver = cp.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.max_deterministic_time = 2.0
    assert solver.Solve(model) in (cp.OPTIMAL, cp.FEASIBLE)
    rooms = [g for k, g in enumerate(may) if solver.Value(chosen[k])]
    edges, sink = _corridors(mesh, rooms, free, rng, outer, spare)
    return floor_plan(mesh, rooms, edges, [sink])


def _corridors(mesh, rooms, free, rng, outer, spare) -> tuple[list[int], int]:
    """Return edges of a tree of walls that touches every room, and its sink."""
    rims = [set(sides(mesh, g)[1]) for g in rooms]
    walls = nx.Graph()
    for e in sorted(set().union(*rims)):
        if outer or (not mesh.boundary_edges[e] and free[mesh.edge_faces[e]].any()):
            walls.add_edge(*mesh.edges[e].tolist(), edge=e, weight=float(rng.uniform(0.5, 1.5)))
    part = max(nx.connected_components(walls), key=len)
    near = [e for e, pair in enumerate(mesh.edges.tolist()) if part.issuperset(pair)]
    if not outer and not all(rim & set(near) for rim in rims):
        return _corridors(mesh, rooms, free, rng, True, spare)
    ends = sorted(part & set(np.flatnonzero(mesh.boundary_vertices).tolist())) or sorted(part)
    sink = ends[int(rng.integers(len(ends)))]
    tree, on = {sink}, set()
    for k in rng.permutation(len(rooms)).tolist():
        if rims[k] & on:
            continue
        own = [e for e in sorted(rims[k]) if walls.has_edge(*mesh.edges[e])]
        far, ways = nx.multi_source_dijkstra(walls, tree)
        best = min(own, key=lambda e: min(far.get(v, 1e9) for v in mesh.edges[e].tolist()))
        u, v = sorted(mesh.edges[best].tolist(), key=lambda w: far.get(w, 1e9))
        path = [*ways[u], v]
        on |= {walls.edges[a, b]["edge"] for a, b in zip(path, path[1:])}
        tree |= set(path)
    for _ in range(spare):
        a, b = rng.choice(sorted(part), 2, replace=False).tolist()
        path = nx.shortest_path(walls, a, b, weight="weight")
        if tree & set(path):
            first = min(k for k, w in enumerate(path) if w in tree)
            on |= {walls.edges[p, q]["edge"] for p, q in zip(path[first:], path[first + 1 :])}
            tree |= set(path[first:])
    assert all(rim & on for rim in rims)
    return sorted(on), sink


def hand() -> tuple[RoomProblem, RoomPlan]:
    """Return 24 m by 20 m with a ring of corridor around a core of two by three cells."""
    mesh = grid(6, 5, 4.0)
    at = {(i, j): 6 * j + i for i in range(6) for j in range(5)}
    pairs = [
        [(0, 0), (0, 1)], [(0, 2), (0, 3)], [(5, 0), (5, 1)], [(5, 2), (5, 3)],
        [(1, 0), (2, 0)], [(3, 0), (4, 0)], [(0, 4), (1, 4)], [(2, 4), (3, 4)], [(4, 4), (5, 4)],
        [(1, 1), (2, 1), (1, 2), (2, 2)], [(3, 1), (4, 1), (3, 2), (4, 2)],
        [(1, 3), (2, 3)], [(3, 3), (4, 3)],
    ]  # fmt: skip
    rooms = [tuple(sorted(at[c] for c in cells)) for cells in pairs]
    ring = walk(mesh, [(4, 4), (20, 4), (20, 16), (4, 16), (4, 4)])
    out = walk(mesh, [(12, 4), (12, 0)])
    return floor_plan(mesh, rooms, ring + out, [vertex(mesh, 12, 0)])


def bend(points: np.ndarray) -> np.ndarray:
    """Bend a grid into a part of a ring, about 90 degrees around (0, -40)."""
    angle = points[:, 0] / 40.0
    radius = 40.0 + points[:, 1]
    return np.column_stack([radius * np.sin(angle), radius * np.cos(angle) - 40.0])


def swell(points: np.ndarray) -> np.ndarray:
    x, y = points.T
    return np.column_stack([x + 0.9 * np.sin(y / 5.0), y + 0.9 * np.sin(x / 6.0)])


MESHES: dict[str, Callable[[], QuadMesh]] = {
    "grid": lambda: grid(6, 5, 4.0),
    "bend": lambda: _mapped(grid(8, 5, 4.0), bend),
    "swell": lambda: _mapped(grid(6, 6, 4.0), swell),
    "fan3": lambda: fan(3, 3, 4.0),
    "fan5": lambda: fan(5, 2, 4.0),
    "fan6": lambda: fan(6, 2, 4.0),
    "ell": lambda: grid(7, 6, 4.0, keep=lambda i, j: i < 3 or j < 3),
    "court": lambda: grid(7, 6, 4.0, keep=lambda i, j: not (2 <= i <= 3 and 2 <= j <= 3)),
}


def _mapped(mesh: QuadMesh, move: Callable[[np.ndarray], np.ndarray]) -> QuadMesh:
    points = move(mesh.vertices)
    a, b, c = (points[mesh.faces[0, k]] for k in range(3))
    turned = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0] < 0
    return QuadMesh(points, mesh.faces[:, ::-1] if turned else mesh.faces, mesh.edge_length)
