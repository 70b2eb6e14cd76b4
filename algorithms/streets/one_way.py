"""Which way one-way streets lead: from the chosen mesh edges to the streets as drawn."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import shapely
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from shapely.geometry import LineString

from ..levels import LOCAL
from ..network.oneway.orientation import orient
from ..network.problem import BoolArray, IntArray, NetworkProblem
from ..network.specification import Specification
from ..progress import Progress
from .align import Alignment
from .levels import LevelledNetwork
from .pieces import Piece
from .survey import Ground

#: A piece of street lies on a mesh edge that is drawn this near to its middle (metres).
ON = 1.0
#: Seconds for the search of directions.
SECONDS = 5.0


def directed_pieces(
    network: LevelledNetwork,
    spec: Specification,
    alignment: Alignment,
    pieces: Sequence[Piece],
    progress: Progress | None = None,
) -> list[Piece]:
    """Turn the pieces of one-way streets into their direction, where one-way streets are asked.

    Streets that are no mesh lines, and those that are the only way to a place, stay two-way, and
    so do those without which ways out were longer than the planner asks.

    Parameters
    ----------
    network
        The chosen mesh edges.
    spec
        What the planner asks; without one-way streets the pieces are returned as they are.
    alignment
        Where the mesh edges are drawn.
    pieces
        The designed streets between junctions.
    progress
        Asked for cancellation, which takes the best directions so far; told what stays two-way.
    """
    if spec.one_way == "none" or not pieces:
        return list(pieces)
    ground, active = network.ground, network.level > 0
    single = active if spec.one_way == "all" else network.level == LOCAL
    problem = _problem(network, spec)
    found = orient(
        problem,
        active,
        single,
        seed=spec.seed,
        time_limit=SECONDS,
        progress=progress,
    )
    if found.kept_two_way and progress is not None:
        length = ground.mesh.lengths[list(found.kept_two_way)].sum()
        progress.warn(
            f"{ground.site.name}: {length:.0f} m of new streets stay two-way, since each is the "
            "only way to a place."
        )
    direction = found.direction
    if spec.max_distance is not None:
        direction = _kept_near(
            problem, active, direction, spec.max_distance / ground.mesh.edge_length
        )
        opened = (found.direction != 0) & (direction == 0)
        if opened.any() and progress is not None:
            progress.warn(
                f"{ground.site.name}: {ground.mesh.lengths[opened].sum():.0f} m of new streets "
                f"stay two-way, so that no way out is longer than {spec.max_distance:g} m."
            )
    return _along(pieces, alignment, direction)


def _kept_near(
    problem: NetworkProblem, active: BoolArray, direction: IntArray, most: float
) -> IntArray:
    """Open the shortest ways out of places that directions have put too far from a sink.

    Each is as near as with two-way streets then, which is near enough where the network is; no
    other place comes to be farther, since a two-way street leads wherever a one-way street does.
    """
    found = direction.copy()
    streets = np.flatnonzero(active | problem.existing)
    ends, size = problem.mesh.edges[streets], np.maximum(problem.length[streets], 1e-9)
    shape = (len(problem.mesh.vertices),) * 2
    sinks = np.flatnonzero(problem.sinks)
    edge = {frozenset(pair): e for pair, e in zip(ends.tolist(), streets.tolist())}
    both = csr_matrix((size, ends.T), shape=shape)
    nearest, before, _ = dijkstra(
        both, directed=False, indices=sinks, min_only=True, return_predecessors=True
    )
    able = np.zeros(len(nearest), dtype=np.bool_)
    able[problem.mesh.edges[active].ravel()] = True
    able &= nearest <= most
    while True:
        ahead, back = found[streets] >= 0, found[streets] <= 0
        # the search starts at the sinks, against the traffic
        pairs = np.concatenate([ends[ahead][:, ::-1], ends[back]])
        links = csr_matrix((np.concatenate([size[ahead], size[back]]), pairs.T), shape=shape)
        far = np.flatnonzero(able & (dijkstra(links, indices=sinks, min_only=True) > most + 1e-6))
        if not len(far):
            return found
        v = int(far[nearest[far].argmax()])
        while before[v] >= 0:
            found[edge[frozenset((v, int(before[v])))]] = 0
            v = int(before[v])


def _problem(network: LevelledNetwork, spec: Specification) -> NetworkProblem:
    """Return the network of all levels as one problem: sinks, existing streets and lengths."""
    ground: Ground = network.ground
    mesh = ground.mesh
    existing = ground.street.copy()
    nothing: BoolArray = np.zeros(len(mesh.edges), dtype=np.bool_)
    return NetworkProblem(
        mesh=mesh,
        existing=existing,
        candidate=~existing,
        sinks=ground.sinks,
        length=mesh.lengths / mesh.edge_length,
        required=nothing,
        edge_factor=np.ones(len(mesh.edges)),
        weight_distance=max(spec.weight_distance, 1.0),
    )


def _along(pieces: Sequence[Piece], alignment: Alignment, direction: IntArray) -> list[Piece]:
    """Give each piece the direction of the mesh edge on which its middle lies."""
    edges = sorted(alignment.lines)
    if not edges:  # of a sub-region that has cross streets or culs-de-sac only
        return list(pieces)
    lines = np.array([LineString(alignment.lines[e]) for e in edges], dtype=object)
    tree = shapely.STRtree(lines)
    turned = []
    for piece in pieces:
        middle = piece.line.interpolate(0.5, normalized=True)
        i = int(tree.nearest(middle))
        sign = int(direction[edges[i]])
        if sign == 0 or lines[i].distance(middle) > ON:
            turned.append(piece)
            continue
        ahead = piece.line.interpolate(piece.line.length / 2 + min(ON, piece.line.length / 4))
        same = lines[i].project(ahead) > lines[i].project(middle)
        turned.append(_turned(piece, forward=same == (sign > 0)))
    return turned


def _turned(piece: Piece, *, forward: bool) -> Piece:
    """Return a piece as a one-way street that leads from its start to its end."""
    if forward:
        return dataclasses.replace(piece, one_way=True)
    return dataclasses.replace(
        piece,
        line=shapely.reverse(piece.line),
        start=piece.end,
        end=piece.start,
        one_way=True,
    )
