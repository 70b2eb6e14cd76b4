"""Regions that templates are warped into: outline by arc length, corners, sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import MultiLineString, Point

from ..templates.mesh import Points, ahead, coordinates
from ..types import Block

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
#: Directions at a vertex are taken over this length, so that rounded corners are corners; metres.
CHORD = 5.0
#: A vertex that turns by less is never a corner; one that turns by more always is; degrees.
BLUNT, SHARP = 22.0, 58.0
#: How near a closed line lies to the outline (metres).
NEAR = 0.01
#: End points of closed lines nearer than this to a vertex are taken to be it (metres).
APART = 0.05
#: Points in which the sides are sampled.
SAMPLES = 65
STEPS = np.linspace(0.0, 1.0, SAMPLES)


@dataclass(frozen=True)
class Outline:
    """The outline of a region, counter-clockwise.

    Attributes
    ----------
    points
        Vertices, shape (n,), x + iy in metres.
    at
        Arc length at each vertex, and the whole at the end, shape (n + 1,).
    shut
        Length that gives no access up to each vertex, shape (n + 1,), metres.
    turn
        Angle by which the outline turns near each vertex, positive where it is convex; 0 where a
        neighbour turns more. Shape (n,), degrees.
    """

    points: Points
    at: Floats
    shut: Floats
    turn: Floats


def outline(block: Block, marks: Sequence[tuple[Point, str]] = ()) -> Outline:
    """Describe the outline of a block; holes are not looked at.

    Parameters
    ----------
    block
        The block. End points of its closed lines become vertices.
    marks
        Vertices that are corners of a kind ("convex", "concave") or none ("regular"), whatever
        their angle.
    """
    z = coordinates(block.polygon)
    z = z[z != np.concatenate([z[-1:], z[:-1]])]
    if not block.closed.is_empty:
        z = _with_ends(z, block.closed)
    loop = np.append(z, z[0])
    at = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(loop)))])
    turn = _turns(z, at)
    for point, kind in marks:
        turn[int(np.argmin(np.abs(z - complex(point.x, point.y))))] = {
            "convex": 180.0,
            "concave": -180.0,
        }.get(kind, 0.0)
    return Outline(z, at, _shut(loop, block.closed), turn)


def _with_ends(z: Points, closed: MultiLineString) -> Points:
    """Insert the end points of closed lines into the edges that they lie on."""
    parts = shapely.line_merge(closed)
    xy = shapely.get_coordinates(shapely.get_parts(shapely.boundary(parts)))
    ends = xy[:, 0] + 1j * xy[:, 1]
    to = ahead(z) - z
    size = np.abs(to)[:, None]
    local = (ends - z[:, None]) * (to.conj() / np.abs(to))[:, None]
    on = (np.abs(local.imag) < 2 * NEAR) & (local.real > APART) & (local.real < size - APART)
    edge, which = np.nonzero(on)
    if not len(edge):
        return z
    along = local.real[edge, which]
    order = np.lexsort((along, edge))
    edge, along = edge[order], along[order]
    keep = np.append(True, (np.diff(edge) > 0) | (np.diff(along) > APART))
    edge, along = edge[keep], along[keep]
    return np.asarray(np.insert(z, edge + 1, z[edge] + to[edge] / np.abs(to[edge]) * along))


def _turns(z: Points, at: Floats) -> Floats:
    """Measure turns over a short chord and keep the sharpest of those close by."""
    n, whole = len(z), at[-1]
    chord = min(CHORD, whole / 25.0)
    three = np.concatenate([at[:-1] - whole, at[:-1], at[:-1] + whole])
    thrice = np.concatenate([z, z, z])
    back = np.interp(at[:-1] - chord, three, thrice)
    on = np.interp(at[:-1] + chord, three, thrice)
    turn = np.degrees(np.angle((on - z) * (z - back).conj()))
    strong = np.flatnonzero(np.abs(turn) >= BLUNT)
    found = np.zeros(n)
    for vertex in strong[np.argsort(-np.abs(turn[strong]), kind="stable")]:
        apart = np.abs(at[:-1] - at[vertex])
        close = np.minimum(apart, whole - apart) < 1.3 * chord
        if not (found[close] * turn[vertex] > 0).any():
            found[vertex] = turn[vertex]
    return found


def _shut(loop: Points, closed: MultiLineString) -> Floats:
    """Add up the length of each edge that lies along the closed lines."""
    shut = np.zeros(len(loop))
    if closed.is_empty:
        return shut
    edges = shapely.linestrings(
        np.stack([loop[:-1], loop[1:]], axis=1).view(float).reshape(-1, 2, 2)
    )
    near = shapely.buffer(closed, 2 * NEAR, cap_style="flat")
    length = shapely.length(shapely.intersection(edges, near))
    whole = shapely.length(edges)
    length = np.where(length > whole - 6 * NEAR, whole, np.where(length < 6 * NEAR, 0.0, length))
    shut[1:] = np.cumsum(length)
    return shut


def choose_corners(region: Outline, convex: int, concave: int) -> Ints | None:
    """Choose as many corners of each kind as a template has.

    Parameters
    ----------
    region
        The region.
    convex, concave
        How many of each.

    Returns
    -------
    ndarray or None
        Vertices in order along the outline; None where the region has fewer corners, or sharp
        ones too many.
    """
    chosen = []
    for sign, count in ((1, convex), (-1, concave)):
        strength = sign * region.turn
        order = np.argsort(-strength, kind="stable")
        if count > len(order) or (count and strength[order[count - 1]] < BLUNT):
            return None
        if count < len(order) and strength[order[count]] > SHARP:
            return None
        chosen.append(order[:count])
    return np.sort(np.concatenate(chosen))


@dataclass(frozen=True)
class Sides:
    """A region whose corners were chosen; its arc lengths begin at the first of them.

    Attributes
    ----------
    points, at, shut
        As of `Outline`, first vertex repeated at the end, shape (n + 1,).
    corners
        Arc lengths of the corners, and the whole at the end, shape (k + 1,).
    signs
        1 convex, -1 concave, shape (k,).
    table
        Each side sampled at equal arc lengths, shape (k, SAMPLES).
    shut_table
        Length without access up to each sample of a side, from its start; shape (k, SAMPLES).
    """

    points: Points
    at: Floats
    shut: Floats
    corners: Floats
    signs: Ints
    table: Points
    shut_table: Floats

    @property
    def lengths(self) -> Floats:
        """Length of each side, shape (k,), metres."""
        return np.diff(self.corners)


def sides(region: Outline, corners: Ints) -> Sides:
    """Cut an outline into sides.

    Parameters
    ----------
    region
        The region.
    corners
        Vertices, ascending, shape (k,); k is 1 or more.
    """
    points, at, shut = _from(region, int(corners[0]))
    marks = np.append(region.at[corners] - region.at[corners[0]], at[-1])
    where = marks[:-1, None] + (marks[1:] - marks[:-1])[:, None] * STEPS
    table = np.interp(where, at, points)
    lengths = np.interp(where, at, shut)
    signs = np.sign(region.turn[corners]).astype(np.int64)
    return Sides(points, at, shut, marks, signs, table, lengths - lengths[:, :1])


def _rolled(a: Any, first: int) -> Any:
    """Let a closed sequence begin at another place."""
    return a if first == 0 else np.concatenate([a[first:], a[:first]])


def _running(steps: Floats, first: int) -> Floats:
    """Add up steps that begin at another place."""
    total = np.zeros(len(steps) + 1)
    np.cumsum(_rolled(steps, first), out=total[1:])
    return total


def _from(region: Outline, first: int) -> tuple[Points, Floats, Floats]:
    """Let the outline begin at another vertex."""
    points = _rolled(region.points, first)
    return (
        np.append(points, points[0]),
        _running(np.diff(region.at), first),
        _running(np.diff(region.shut), first),
    )


def turned(of: Sides, shift: int) -> Sides:
    """Let the first side be another one.

    Parameters
    ----------
    of
        The sides.
    shift
        Which is to be the first.
    """
    if shift == 0:
        return of
    # corners are vertices, and must stay so to the last bit
    index = np.searchsorted(of.at, of.corners[:-1] - 1e-9)
    begin = int(index[shift])
    points = _rolled(of.points[:-1], begin)
    at = _running(np.diff(of.at), begin)
    places = np.sort((index - begin) % len(points))
    return Sides(
        np.append(points, points[0]),
        at,
        _running(np.diff(of.shut), begin),
        np.append(at[places], at[-1]),
        _rolled(of.signs, shift),
        _rolled(of.table, shift),
        _rolled(of.shut_table, shift),
    )
