"""The corridors of a sample are carried into a zone (RZ section 2: V_g' = M_p V_p')."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Point
from shapely.ops import nearest_points

from ...site import Site
from ..types import Floats
from .meanvalue import mean_value_coordinates
from .outline import Outline
from .register import Registration
from .samples import Sample
from .square import squared
from .ways import Ways

#: Further than this no node is moved to get it into the zone (metres).
MOST_MOVED = 60.0
#: Dead ends shorter than this are no streets (metres).
STUB = 22.0


@dataclass(frozen=True, eq=False)
class Edge:
    """A piece of corridor between two nodes.

    Attributes
    ----------
    street
        Index of the street of the sample.
    start, end
        Indices of the nodes.
    xy
        Vertices, shape (n, 2), metres.
    """

    street: int
    start: int
    end: int
    xy: Floats

    @property
    def length(self) -> float:
        """Length, metres."""
        return float(np.hypot(*np.diff(self.xy, axis=0).T).sum())


@dataclass(frozen=True, eq=False)
class Adapted:
    """A sample as it comes out in a zone.

    Attributes
    ----------
    sample
        The sample.
    nodes
        Entries and inner nodes in the zone, metres, shape (k, 2).
    edges
        Pieces of corridor that are left.
    places
        Places in its patches, shape (p, 2), metres.
    lost, bent
        Share of the sample's corridors, by length, that was given up, or led around something.
    """

    sample: Sample
    nodes: Floats
    edges: tuple[Edge, ...]
    places: Floats
    lost: float
    bent: float


def adapt(
    sample: Sample, outline: Outline, registration: Registration, site: Site, ways: Ways
) -> Adapted:
    """Carry the corridors of a sample into a zone, and mend what does not fit.

    Nodes follow the boundary by mean value coordinates. Nodes outside the zone are moved in,
    corridors that leave it are led around, and what then leads nowhere is given up.

    Parameters
    ----------
    sample, outline, registration
        See `register.register`.
    site
        The zone.
    ways
        Where corridors may run.

    Returns
    -------
    Adapted
    """
    ring, there = registration.rings(sample, outline)
    spots = np.array([at for at, _ in sample.patches], dtype=float).reshape(-1, 2)
    inner = np.vstack([sample.nodes[sample.entries :], spots])
    carried = mean_value_coordinates(inner, ring) @ there
    count = len(sample.nodes) - sample.entries
    entries = _entries(registration, outline, site)
    nodes = np.vstack([entries, carried[:count]])
    nodes = squared(sample, nodes, registration, outline, site)
    use = np.isfinite(nodes[:, 0])
    for at in range(sample.entries, len(nodes)):
        moved = ways.nearest(nodes[at])
        use[at] = math.dist(moved, nodes[at]) <= MOST_MOVED
        nodes[at] = moved
    edges: list[Edge] = []
    whole = bent = 0.0
    for number, street in enumerate(sample.streets):
        for a, b in zip(street.nodes[:-1], street.nodes[1:]):
            size = math.dist(sample.nodes[a], sample.nodes[b])
            whole += size
            if not (use[a] and use[b]):
                continue
            mouths = [nodes[at] for at in (a, b) if at < sample.entries]
            xy = ways.way(nodes[a], nodes[b], mouths)
            if xy is not None:
                edges.append(Edge(number, a, b, xy))
                bent += size * (len(xy) > 2)
    kept = pruned(edges, sample.entries)
    left = sum(math.dist(sample.nodes[own.start], sample.nodes[own.end]) for own in kept)
    return Adapted(sample, nodes, tuple(kept), carried[count:], 1.0 - left / whole, bent / whole)


def pruned(edges: list[Edge], entries: int) -> list[Edge]:
    """Give up what no entry leads to, and dead ends too short for a street.

    Parameters
    ----------
    edges
        Pieces of corridor.
    entries
        Nodes with a smaller index are entries.
    """
    reached = set(range(entries))
    size = -1
    while size != len(reached):
        size = len(reached)
        for own in edges:
            if own.start in reached or own.end in reached:
                reached |= {own.start, own.end}
    kept = [own for own in edges if own.start in reached]
    while True:
        count: dict[int, int] = {}
        for own in kept:
            count[own.start] = count.get(own.start, 0) + 1
            count[own.end] = count.get(own.end, 0) + 1
        stubs = [
            own
            for own in kept
            if own.length < STUB
            and any(count[at] == 1 and at >= entries for at in (own.start, own.end))
        ]
        if not stubs:
            return kept
        kept = [own for own in kept if own not in stubs]


def _entries(registration: Registration, outline: Outline, site: Site) -> Floats:
    """Return the entries on the boundary of the zone, nan where there is none, shape (e, 2)."""
    found = np.full((len(registration.entries), 2), np.nan)
    boundary = site.street_frontage if not site.street_frontage.is_empty else site.polygon.boundary
    for at, (place, gate) in enumerate(zip(registration.entries, registration.gate)):
        if gate >= 0:
            found[at] = outline.gate_xy[gate]
        elif np.isfinite(place):
            near = nearest_points(boundary, Point(outline.at(np.array([place]))[0]))[0]
            found[at] = near.coords[0]
    return found


def lines_of(edges: tuple[Edge, ...]) -> list[LineString]:
    """Return the edges as lines."""
    return [shapely.LineString(own.xy) for own in edges]
