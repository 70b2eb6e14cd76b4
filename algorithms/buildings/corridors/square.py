"""Corridors carried into a zone are drawn straight again, and square to the street they meet."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry import LineString, Point
from shapely.ops import nearest_points

from ...site import Site
from ..types import Floats
from .outline import Outline
from .register import CLEAR, Registration
from .samples import Sample
from .turning import turns

#: Nodes between two others that lie on one line in the sample stay so: angle (radians), and how
#: much more that counts than that nodes stay where they fall.
IN_LINE, HOLD = math.radians(12.0), 8.0
#: An entry slides along the edge of the zone so far to meet it squarely (metres).
SLIDE = 70.0
#: One at an access point stays there unless it is further than this from square (radians).
OBLIQUE = math.radians(33.0)
#: How much sliding counts (radians per metre).
PULL = math.radians(0.25)
#: Where the edge turns by more it has a corner, at which no street comes in (radians).
CORNER = math.radians(30.0)
#: Length of the edge that gives its direction at an entry (metres).
WINDOW = 15.0


def squared(
    sample: Sample, nodes: Floats, registration: Registration, outline: Outline, site: Site
) -> Floats:
    """Straighten streets and make them meet the edge squarely.

    Parameters
    ----------
    sample, registration, outline, site
        See `adapt.adapt`.
    nodes
        Entries, nan for lost ones, and inner nodes in the zone, metres, shape (k, 2).

    Returns
    -------
    numpy.ndarray
        The nodes, moved, shape (k, 2).
    """
    nodes = straightened(sample, nodes)
    nodes = _slid(sample, nodes, registration, outline, site)
    return straightened(sample, nodes)


def triples(sample: Sample) -> list[tuple[int, int, int]]:
    """Return the nodes that lie in line between two others in a sample, in the middle of each."""
    found = []
    for street in sample.streets:
        for a, b, c in zip(street.nodes, street.nodes[1:], street.nodes[2:]):
            first, second = sample.nodes[b] - sample.nodes[a], sample.nodes[c] - sample.nodes[b]
            cross = first[0] * second[1] - first[1] * second[0]
            if abs(math.atan2(cross, float(first @ second))) <= IN_LINE:
                found.append((a, b, c))
    return found


def straightened(sample: Sample, nodes: Floats) -> Floats:
    """Keep nodes in line that are in line in the sample, by least squares; entries stay.

    Parameters
    ----------
    sample
        The sample.
    nodes
        Shape (k, 2); nan for what is lost.

    Returns
    -------
    numpy.ndarray
        Shape (k, 2).
    """
    lines = [own for own in triples(sample) if np.isfinite(nodes[list(own)]).all()]
    free = np.arange(sample.entries, len(nodes))
    if not lines or not len(free):
        return nodes
    now = nodes.copy()
    for _ in range(4):
        rows, right = [np.eye(2 * len(free))], [nodes[free].ravel()]
        for a, b, c in lines:
            way = now[c] - now[a]
            size = math.hypot(*way)
            if size < 1e-6 or b < sample.entries:
                continue
            normal = np.array([-way[1], way[0]]) / size
            share = float(np.clip((now[b] - now[a]) @ way / size**2, 0.0, 1.0))
            row, value = np.zeros(2 * len(free)), 0.0
            for at, weight in ((b, 1.0), (a, share - 1.0), (c, -share)):
                if at >= sample.entries:
                    column = 2 * (at - sample.entries)
                    row[column : column + 2] += HOLD * weight * normal
                else:
                    value -= HOLD * weight * float(normal @ nodes[at])
            rows.append(row[None])
            right.append(np.array([value]))
        solved = np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=None)[0]
        now[free] = solved.reshape(-1, 2)
    return now


def obliqueness(xy: Floats, toward: Floats, edge: LineString) -> Floats:
    """Measure by how much ways off an edge are not square to it, radians, 0 to pi / 2.

    Parameters
    ----------
    xy
        Where they begin, near the edge, shape (n, 2), metres.
    toward
        Where they go, shape (n, 2) or (2,).
    edge
        A closed line.

    Returns
    -------
    numpy.ndarray
        Shape (n,).
    """
    length = edge.length
    place = shapely.line_locate_point(edge, shapely.points(xy))
    before = shapely.line_interpolate_point(edge, (place - WINDOW) % length)
    after = shapely.line_interpolate_point(edge, (place + WINDOW) % length)
    along = shapely.get_coordinates(after) - shapely.get_coordinates(before)
    way = toward - xy
    size = np.maximum(np.hypot(*along.T) * np.hypot(*way.T), 1e-9)
    return np.asarray(np.arcsin(np.minimum(np.abs(np.sum(along * way, axis=1)) / size, 1.0)))


def _slid(
    sample: Sample, nodes: Floats, registration: Registration, outline: Outline, site: Site
) -> Floats:
    """Move entries along the edge of the zone to where their streets meet it squarely."""
    nodes = nodes.copy()
    beyond: dict[int, list[int]] = {}
    for street in sample.streets:
        for a, b in zip(street.nodes[:-1], street.nodes[1:]):
            beyond.setdefault(a, []).append(b)
            beyond.setdefault(b, []).append(a)
    front = site.street_frontage if not site.street_frontage.is_empty else site.polygon.boundary
    corners = outline.ring[np.abs(turns(outline.ring)) > CORNER]
    gates = np.array(registration.gate)
    for at in range(sample.entries):
        others = beyond.get(at, [])
        if len(others) != 1 or not np.isfinite(nodes[[at, others[0]]]).all():
            continue
        toward = nodes[others[0]]
        now = float(obliqueness(nodes[at][None], toward, outline.line)[0])
        if gates[at] >= 0 and now < OBLIQUE:
            continue
        # a street from edge to edge may slide until it is the shortest one
        slide = math.dist(nodes[at], toward) if others[0] < sample.entries else SLIDE
        place = outline.line.project(Point(nodes[at]), normalized=True)
        gap = (outline.fronts - place + 0.5) % 1.0 - 0.5
        near = outline.at(outline.fronts[np.abs(gap) * outline.length <= slide])
        away = math.inf * np.ones(len(near))
        others_xy = np.delete(nodes[: sample.entries], at, axis=0)
        for taken in (others_xy[np.isfinite(others_xy[:, 0])], outline.gate_xy, corners):
            if len(taken) and len(near):
                gaps = np.hypot(*np.moveaxis(near[:, None] - taken[None], 2, 0))
                away = np.minimum(away, gaps.min(axis=1))
        near = near[away >= CLEAR]
        if not len(near):
            continue
        cost = obliqueness(near, toward, outline.line)
        cost = cost + PULL * SLIDE / slide * np.hypot(*(near - nodes[at]).T)
        best = int(np.argmin(np.round(cost, 9)))
        if cost[best] < now - 1e-9:
            nodes[at] = nearest_points(front, Point(near[best]))[0].coords[0]
    return nodes
