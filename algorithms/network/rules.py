"""Rules beyond the paper that make a design look like a planner's, as patterns and clauses.

CND's formulation, taken literally on real sites, gives crooked streets and rings on stems.
The rules here are all linear: straight streets, blocks of one cell's width and limited
length, and the continuation of existing streets. See docs/method.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
import shapely

from ..mesh.quadmesh import QuadMesh
from .problem import BoolArray, Clause, FloatArray, IntArray, Pattern

#: A street goes straight on where it turns by less than this (degrees).
STRAIGHT_LIMIT = 45.0
#: Turns smaller than this are not kinks (degrees).
KINK_FREE = 8.0
#: An inner edge continues an existing street if it turns from it by less than this (degrees).
CONTINUE_LIMIT = 45.0


def straight_continuations(mesh: QuadMesh) -> dict[tuple[int, int], tuple[int, float]]:
    """Find the edge that goes straight on through a vertex, for every edge end.

    Two edges continue each other when each is the straightest partner of the other and the
    street turns by at most `STRAIGHT_LIMIT` degrees.

    Returns
    -------
    dict
        (vertex, edge) -> (continuing edge, turn in degrees); missing where nothing continues.

    Examples
    --------
    >>> from platwright.mesh import grid
    >>> mesh = grid(2, 2)
    >>> onward = straight_continuations(mesh)
    >>> sorted({turn for _, turn in onward.values()})
    [0.0]
    """
    found: dict[tuple[int, int], tuple[int, float]] = {}
    for v, fan in enumerate(mesh.vertex_edges):
        if len(fan) < 2:
            continue
        away = _directions_from(mesh, v, fan)
        cosine = -(away @ away.T)
        np.fill_diagonal(cosine, -2.0)
        best = cosine.argmax(axis=1)
        for i, j in enumerate(best.tolist()):
            turn = math.degrees(math.acos(float(np.clip(cosine[i, j], -1.0, 1.0))))
            if best[j] == i and turn <= STRAIGHT_LIMIT:
                found[v, int(fan[i])] = (int(fan[j]), round(turn, 6))
    return found


def straightness(
    mesh: QuadMesh,
    usable: BoolArray,
    candidate: BoolArray,
    *,
    end_weight: float,
    bend_weight: float = 0.0,
    kink_weight: float = 0.0,
) -> list[Pattern]:
    """Price street ends that do not go straight on at inner vertices.

    Parameters
    ----------
    mesh
        The candidate mesh.
    usable
        Shape (e,). Edges that are or may become streets.
    candidate
        Shape (e,). Edges that may be chosen; only their ends are priced.
    end_weight
        Cost of an end without an active straight continuation: a bend costs two, a
        T-junction one, a crossing none.
    bend_weight
        Further cost of a bend: two edges that meet at an angle while nothing else is active.
    kink_weight
        Cost of a continuation that turns by t degrees: kink_weight * (t / 30)².
    """
    onward = straight_continuations(mesh)
    patterns: list[Pattern] = []
    for v in np.flatnonzero(~mesh.boundary_vertices).tolist():
        fan = [int(e) for e in mesh.vertex_edges[v]]
        for e in fan:
            if not candidate[e]:
                continue
            partner, turn = onward.get((v, e), (-1, 0.0))
            goes_on = partner >= 0 and bool(usable[partner])
            if end_weight > 0:
                patterns.append(
                    Pattern((e,), (partner,) if goes_on else (), end_weight, "street end")
                )
            twice = goes_on and bool(candidate[partner]) and partner < e
            if kink_weight > 0 and goes_on and turn > KINK_FREE and not twice:
                patterns.append(Pattern((e, partner), (), kink_weight * (turn / 30) ** 2, "kink"))
        if bend_weight > 0:
            patterns += _bends(v, fan, onward, usable, candidate, bend_weight)
    return patterns


def _bends(
    v: int,
    fan: list[int],
    onward: Mapping[tuple[int, int], tuple[int, float]],
    usable: BoolArray,
    candidate: BoolArray,
    weight: float,
) -> list[Pattern]:
    """Price each pair of edges at a vertex that bends while the others are off."""
    found = []
    for i, a in enumerate(fan):
        for b in fan[i + 1 :]:
            if not (usable[a] and usable[b] and (candidate[a] or candidate[b])):
                continue
            if onward.get((v, a), (-1, 0.0))[0] == b:
                continue
            others = tuple(g for g in fan if g not in (a, b) and usable[g])
            found.append(Pattern((a, b), others, weight, "bend"))
    return found


def block_length_windows(
    mesh: QuadMesh, usable: BoolArray, length_limit: float, penalty: float
) -> list[Clause]:
    """Bound the length of blocks along every strip of quads.

    A strip crosses its rungs; wherever two rungs lie further apart than the limit, one of
    the rungs between them must be a street. Minimal windows only: they imply the rest.

    Parameters
    ----------
    mesh
        The candidate mesh.
    usable
        Shape (e,). Edges that are or may become streets; other rungs cannot help.
    length_limit
        Longest block in metres.
    penalty
        Cost of a window without a street.
    """
    clauses: list[Clause] = []
    middles = mesh.vertices[mesh.edges].mean(axis=1)
    seen: set[tuple[int, ...]] = set()
    for strip in mesh.strips():
        closed = len(strip) > 1 and strip[0] == strip[-1]
        if closed:
            # twice round, so that windows reach over the seam
            strip = np.concatenate([strip, strip[1:]])
        steps = np.hypot(*np.diff(middles[strip], axis=0).T)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        for i in range(len(strip)):
            j = int(np.searchsorted(along, along[i] + length_limit, side="right"))
            if j >= len(strip) or (closed and j - i > len(strip) // 2):
                break
            window = tuple(sorted({int(e) for e in strip[i + 1 : j] if usable[e]}))
            if window and window not in seen:
                seen.add(window)
                clauses.append(Clause(window, penalty, "block length"))
    return clauses


def block_width_corners(
    mesh: QuadMesh,
    usable: BoolArray,
    closed: BoolArray,
    width: float,
    penalty: float,
    skip_faces: Iterable[int] = (),
) -> list[Clause]:
    """Bound the width of blocks to one cell, for meshes whose cells are as wide as a block.

    If at every corner of every quad one of the two sides is a street, then every block is a
    row of cells: its width is that of one cell. Cells much narrower than a block may join in
    both directions and are left out.

    Parameters
    ----------
    mesh
        The candidate mesh; its edge length is the block width.
    usable
        Shape (e,). Edges that are or may become streets.
    closed
        Shape (e,). Edges where a block ends without a street: walls, water, obstacles.
    width
        Wished block width in metres.
    penalty
        Cost of a corner without a street.
    skip_faces
        Faces that need no street, such as those in a park.
    """
    clauses: list[Clause] = []
    leave = set(skip_faces)
    sides = mesh.lengths[mesh.face_edges]
    areas = shapely.area(shapely.polygons(mesh.vertices[mesh.faces]))
    for f, edges in enumerate(mesh.face_edges.tolist()):
        if f in leave:
            continue
        across = (sides[f, 0] + sides[f, 2]) / 2, (sides[f, 1] + sides[f, 3]) / 2
        if min(across) < 0.6 * width or areas[f] < 0.5 * width**2:
            continue
        for k in range(4):
            pair = edges[k - 1], edges[k]
            if any(closed[e] for e in pair):
                continue
            able = tuple(sorted(e for e in pair if usable[e]))
            if able:
                clauses.append(Clause(able, penalty, "block width"))
    return clauses


def small_blocks(
    mesh: QuadMesh, usable: BoolArray, candidate: BoolArray, width: float, weight: float
) -> list[Pattern]:
    """Price blocks of one small cell: thinner than 0.62 widths, or of two thirds of the usual area.

    Parameters
    ----------
    mesh
        The candidate mesh; its edge length is the block width.
    usable
        Shape (e,). Edges that are or may become streets.
    candidate
        Shape (e,). Edges that may be chosen. A cell with two existing sides is left out: in
        an arm of the site that is narrower than a block, small blocks are what there can be.
    width
        Wished block width in metres.
    weight
        Cost of a small cell with streets on all its sides.
    """
    sides = mesh.lengths[mesh.face_edges]
    across = (sides[:, :2] + sides[:, 2:]) / 2
    areas = shapely.area(shapely.polygons(mesh.vertices[mesh.faces]))
    small = (across.min(axis=1) < 0.62 * width) | (areas < 0.66 * width**2)
    small &= usable[mesh.face_edges].all(axis=1) & (candidate[mesh.face_edges].sum(axis=1) > 2)
    return [
        Pattern(tuple(sorted(mesh.face_edges[f].tolist())), (), weight, "small block")
        for f in np.flatnonzero(small).tolist()
    ]


def continuations(
    mesh: QuadMesh,
    arrivals: Mapping[int, tuple[float, float]],
    candidate: BoolArray,
    penalty: float,
) -> list[Clause]:
    """Ask that existing streets that arrive at boundary vertices go on into the site.

    Parameters
    ----------
    mesh
        The candidate mesh.
    arrivals
        Boundary vertex -> unit direction of the arriving street, into the site.
    candidate
        Shape (e,). Edges that may be chosen.
    penalty
        Cost of a street that is not continued.
    """
    clauses = []
    for v, direction in arrivals.items():
        fan = mesh.vertex_edges[v]
        inner = [int(e) for e in fan if candidate[e] and not mesh.boundary_edges[e]]
        if not inner:
            continue
        cosine = _directions_from(mesh, v, np.array(inner)) @ np.asarray(direction)
        i = int(cosine.argmax())
        if cosine[i] > math.cos(math.radians(CONTINUE_LIMIT)):
            clauses.append(Clause((inner[i],), penalty, "continue street"))
    return clauses


def _directions_from(mesh: QuadMesh, vertex: int, edges: IntArray) -> FloatArray:
    """Give unit vectors (k, 2) in which edges leave a vertex, along the first stretch of arcs."""
    rows = []
    for e in edges.tolist():
        line = mesh.edge_line(e)
        if mesh.edges[e, 1] == vertex:
            line = line[::-1]
        step = line[-1] - line[0]
        rows.append(step / (np.hypot(*step) or 1.0))
    return np.array(rows).reshape(-1, 2)
