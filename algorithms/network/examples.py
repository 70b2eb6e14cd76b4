"""The scenarios of the paper (CND figure 2 and table 1) on any mesh, for tests and benchmarks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np

from ..mesh.grids import grid
from ..mesh.quadmesh import QuadMesh
from .problem import BoolArray, NetworkProblem

Scenario = Literal["boundary", "one sink", "inner"]


def cut_grid(nx: int, ny: int, corners: Sequence[tuple[int, int]]) -> QuadMesh:
    """Return a grid of unit squares without a block of squares at each of its corners.

    Parameters
    ----------
    nx, ny
        Squares in x and y.
    corners
        Columns and rows that are cut away at the lower left, upper right, lower right and upper
        left corner.
    """

    def keep(i: int, j: int) -> bool:
        places = ((i, j), (nx - 1 - i, ny - 1 - j), (nx - 1 - i, j), (i, ny - 1 - j))
        return not any(a < c and b < r for (a, b), (c, r) in zip(places, corners))

    return grid(nx, ny, keep=keep)


def _keep_660(i: int, j: int) -> bool:
    """Tell whether a square belongs to the mesh of 660 edges."""
    corners = (i < 5 and j < 3) or (i >= 16 and j >= 15) or (i >= 18 and j < 5)
    return not (corners or (i < 2 and j >= 13) or (8 <= i < 11 and j >= 16))


#: Meshes of the sizes that the paper reports times for, by that size (660 has 654 edges).
PAPER_MESHES: dict[int, Callable[[], QuadMesh]] = {
    312: lambda: grid(12, 12),
    535: lambda: cut_grid(18, 17, ((4, 3), (3, 2), (4, 5), (3, 6))),
    543: lambda: cut_grid(18, 17, ((4, 3), (3, 2), (4, 4), (3, 6))),
    657: lambda: cut_grid(21, 18, ((4, 3), (5, 3), (4, 6), (3, 6))),
    660: lambda: grid(20, 18, keep=_keep_660),
    662: lambda: cut_grid(20, 18, ((4, 3), (3, 2), (2, 6), (3, 6))),
    1012: lambda: grid(22, 22),
    1200: lambda: grid(24, 24),
}


def hop_ball(mesh: QuadMesh, vertex: int, radius: int) -> tuple[int, ...]:
    """Return the vertices at most `radius` edges from a vertex, ascending."""
    ball = {vertex}
    ring = {vertex}
    for _ in range(radius):
        around = (e for u in ring for e in mesh.vertex_edges[u].tolist())
        ring = {int(w) for e in around for w in mesh.edges[e]} - ball
        ball |= ring
    return tuple(sorted(ball))


def paper_problem(
    mesh: QuadMesh,
    scenario: Scenario = "boundary",
    *,
    coverage: int = 2,
    exits: Sequence[int] | None = None,
    **rules: Any,
) -> NetworkProblem:
    """Make one of the paper's problems: no dead ends, no close pairs, zigzags cost 5.

    Parameters
    ----------
    mesh
        The mesh; every edge counts as long as its neighbours.
    scenario
        "boundary": the boundary is an existing street and all of it a sink (figure 2a-c);
        "one sink": the boundary is a wall but for one sink at its top (2d); "inner": four
        sinks inside, all edges may be streets (2e-g).
    coverage
        Coverage range in edges.
    exits
        Vertices that are the sinks instead: for "one sink" the gaps in the wall, otherwise the
        places where traffic leaves the boundary street or the mesh.
    **rules
        Other fields of `NetworkProblem`, for instance ``weight_distance=1.0``.

    Returns
    -------
    NetworkProblem
    """
    rim, on_rim = mesh.boundary_edges, mesh.boundary_vertices
    existing = np.zeros(len(mesh.edges), dtype=bool)
    candidate = np.ones(len(mesh.edges), dtype=bool)
    sinks = np.zeros(len(mesh.vertices), dtype=bool)
    required = np.ones(len(mesh.vertices), dtype=bool)
    if scenario == "boundary":
        existing, candidate, sinks = rim.copy(), ~rim, on_rim.copy()
    elif scenario == "one sink":
        sinks[_top(mesh) if exits is None else list(exits)] = True
        reachable = ~on_rim | sinks
        candidate = ~rim & reachable[mesh.edges].all(axis=1)
        required = ~on_rim
    else:
        sinks = _four_inside(mesh)
    if exits is not None:
        sinks = np.zeros(len(mesh.vertices), dtype=bool)
        sinks[list(exits)] = True
    fields: dict[str, Any] = {
        "cover": _cover(mesh, existing, required, coverage),
        "cover_radius": coverage,
        "zigzags": 5.0,
        "too_close": math.inf,
    }
    fields.update(rules)
    return NetworkProblem(
        mesh=mesh,
        existing=existing,
        candidate=candidate,
        sinks=sinks,
        length=np.ones(len(mesh.edges)),
        required=np.zeros(len(mesh.edges), dtype=bool),
        edge_factor=np.ones(len(mesh.edges)),
        **fields,
    )


def _cover(
    mesh: QuadMesh, existing: BoolArray, required: BoolArray, coverage: int
) -> dict[int, tuple[int, ...]]:
    """Return the balls of the vertices that no existing street covers."""
    street = np.zeros(len(required), dtype=bool)
    street[mesh.edges[existing].ravel()] = True
    balls = {v: hop_ball(mesh, v, coverage) for v in np.flatnonzero(required).tolist()}
    return {v: ball for v, ball in balls.items() if not street[list(ball)].any()}


def _top(mesh: QuadMesh) -> int:
    """Return the middle of the top boundary, at a vertex with an inner edge."""
    x, y = mesh.vertices.T
    inner = np.zeros(len(x), dtype=bool)
    inner[mesh.edges[~mesh.boundary_edges].ravel()] = True
    able = np.flatnonzero(mesh.boundary_vertices & inner)
    order = np.lexsort((np.abs(x[able] - x.mean()), np.round(y.max() - y[able], 6)))
    return int(able[order[0]])


def _four_inside(mesh: QuadMesh) -> BoolArray:
    """Return the vertices nearest to the quarter points of the bounding box."""
    sinks = np.zeros(len(mesh.vertices), dtype=bool)
    quarter = np.ptp(mesh.vertices, axis=0) / 4
    for side in ((-1, -1), (1, 1), (1, -1), (-1, 1)):
        target = mesh.vertices.mean(axis=0) + quarter * side
        sinks[np.argmin(((mesh.vertices - target) ** 2).sum(axis=1))] = True
    return sinks
