"""Ends of lines and the streets that end there already: continuity (UP section 5)."""

from __future__ import annotations

import dataclasses

import numpy as np

from .outline import Bools, Floats, NearestEdge, Outline, on_edges, to_segments
from .region import CLOSED, Region
from .samples import ends, outward
from .streamlines import Streamlines

#: An end continues a street that ends within this distance at this angle (UP).
CONTINUE, IN_LINE = 4.0, 20.0
#: Junctions nearer than this to each other are unsafe, unless they are one (metres).
APART = 45.0
#: The boundary has a corner where it turns by more (radians).
CORNER = np.radians(35.0)
#: Over this length at most a line is bent to meet a street exactly (metres).
BEND = 60.0


def _off(lines: Streamlines, region: Region) -> tuple[Floats, Bools]:
    """Distances of ends to junctions and whether they are in line, shape (n, 2, j) each."""
    off = np.linalg.norm(ends(lines)[:, :, None] - region.junctions, axis=-1)
    size = np.maximum(np.linalg.norm(region.directions, axis=1, keepdims=True), 1e-12)
    cosine = np.abs(np.einsum("nex,jx->nej", outward(lines), region.directions / size))
    return off, cosine >= np.cos(np.radians(IN_LINE))


def continuity(lines: Streamlines, region: Region, edges: Outline) -> tuple[Floats, Floats]:
    """How few ends continue a street, and how many are near one without doing so.

    Parameters
    ----------
    lines
        Lines across the region.
    region, edges
        Its junctions and its boundary, whose corners are junctions, too, where streets meet.

    Returns
    -------
    ct
        1, 0.5 and 0 where none, one and two ends continue a street (UP), shape (n,).
    offset
        Share of the other ends that have a junction at 4 to 45 m, shape (n,).
    """
    on = np.zeros((len(lines), 2), bool)
    near = np.zeros((len(lines), 2), bool)
    if len(region.junctions):
        off, in_line = _off(lines, region)
        on = ((off <= CONTINUE) & in_line).any(axis=2)
        near = ((off > CONTINUE) & (off < APART)).any(axis=2)
    bends = corners(region, edges)
    if len(bends):
        off = np.linalg.norm(ends(lines)[:, :, None] - bends, axis=-1)
        near |= ((off > CONTINUE) & (off < APART)).any(axis=2)
    return 1.0 - 0.5 * on.sum(axis=1), (near & ~on).mean(axis=1)


def corners(region: Region, edges: Outline) -> Floats:
    """Places where two streets along the boundary meet at a corner, shape (k, 2), metres."""
    way = (edges.end - edges.start) @ [1, 1j]
    turn = np.abs(np.angle(way * way[edges.before].conj()))
    street = region.kinds != CLOSED
    return np.asarray(edges.start[(turn > CORNER) & street & street[edges.before]])


def meet_streets(lines: Streamlines, region: Region, edges: Outline) -> Streamlines:
    """Move ends that continue a street onto its end, so that it is one straight crossing.

    Parameters
    ----------
    lines
        Lines across the region.
    region, edges
        Its junctions and its boundary.

    Returns
    -------
    lines
        The same, where ends within 4 m and 20 degrees of a junction lie on it; the line is bent
        evenly over 60 m at most, or half its length.
    """
    if not len(region.junctions) or not len(lines):
        return lines
    off, in_line = _off(lines, region)
    far, number = NearestEdge(edges, 2.0)(region.junctions)
    off = np.where(in_line & (far < 0.5), off, np.inf)
    nearest = off.argmin(axis=2)
    moved = off.min(axis=2) <= CONTINUE
    if not moved.any():
        return lines
    _, t = to_segments(region.junctions, edges.start[number], edges.end[number])
    on_edge = on_edges(edges, number, t)
    shift = np.where(moved[..., None], on_edge[nearest] - ends(lines), 0.0)
    owner = np.repeat(np.arange(len(lines)), np.diff(lines.first))
    step = np.hypot(*np.diff(lines.points, axis=0, prepend=lines.points[:1]).T)
    passed = np.cumsum(step)
    arc = passed - passed[lines.first[:-1]][owner]
    ramp = np.minimum(BEND, 0.5 * lines.length)[owner]
    left = lines.length[owner] - arc
    points = lines.points + (
        np.clip(1.0 - arc / ramp, 0.0, 1.0)[:, None] * shift[owner, 0]
        + np.clip(1.0 - left / ramp, 0.0, 1.0)[:, None] * shift[owner, 1]
    )
    row, end = np.nonzero(moved)
    places = np.where(end == 0, lines.first[row], lines.first[row + 1] - 1)
    points[places] = on_edge[nearest[row, end]]
    ring, edge, at = lines.ring.copy(), lines.edge.copy(), lines.t.copy()
    edge_there = number[nearest[row, end]]
    ring[row, end] = edges.ring[edge_there]
    edge[row, end] = edge_there - edges.first[edges.ring[edge_there]]
    at[row, end] = t[nearest[row, end]]
    step = np.hypot(*np.diff(points, axis=0, prepend=points[:1]).T)
    step[lines.first[:-1]] = 0.0
    length = np.asarray(np.bincount(owner, step, minlength=len(lines)), np.float64)
    return dataclasses.replace(lines, points=points, ring=ring, edge=edge, t=at, length=length)
