"""Pieces of street between junctions: the course of the network, and what cuts it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.ops import substring

from ..levels import CUL_DE_SAC, LOCAL
from ..mesh import QuadMesh
from ..network.problem import FloatArray, IntArray
from ..site.types import Site
from .adopt import existing_lines
from .align import Alignment
from .cross_streets import CrossStreet
from .joints import split_at
from .survey import Ground

XY = tuple[float, float]

#: Pieces shorter than this are not cut off (metres).
SHORTEST = 0.5
#: Ends nearer than this are one junction (metres).
SAME = 0.1


@dataclass(frozen=True)
class Piece:
    """A designed street between two junctions.

    Attributes
    ----------
    line
        Its course, metres.
    level
        2 collector, 3 local, 4 cul-de-sac.
    start, end
        The junctions at its ends: vertices of the mesh; negative numbers for other junctions
        with existing streets; numbers beyond the last vertex for those of cross streets.
    one_way
        Whether traffic runs from start to end only.
    """

    line: LineString
    level: int
    start: int
    end: int
    one_way: bool = False


def street_pieces(ground: Ground, level: IntArray, alignment: Alignment) -> list[Piece]:
    """Cut streets at junctions, where they cross existing streets, and at changes of level."""
    return _cut_at_existing(ground.site, _pieces(ground, level, alignment))


def add_cross_streets(
    pieces: Sequence[Piece], cross: Sequence[CrossStreet], first: int
) -> tuple[list[Piece], list[Piece]]:
    """Let cross streets meet the others.

    Parameters
    ----------
    pieces
        Streets so far.
    cross
        Cross streets, each from street to street, and culs-de-sac.
    first
        Number of the first new junction between designed streets.

    Returns
    -------
    cut : list of Piece
        The streets so far, cut where cross streets meet them.
    added : list of Piece
        The cross streets in their order.
    """
    joints = _Joints(pieces, first)
    added = [joints.meet(street) for street in cross]
    cut = [part for piece in pieces for part in _cut_at(piece, joints.made)]
    return cut, [part for piece in added for part in _cut_at(piece, joints.made)]


class _Joints:
    """Gives the ends of cross streets their junctions, in the order of the streets."""

    def __init__(self, pieces: Sequence[Piece], first: int) -> None:
        self.known = [end for piece in pieces for end in _ends(piece)]
        self.lines = [piece.line for piece in pieces]
        self.made: list[tuple[XY, int]] = []
        self.first = first
        self.lowest = min([0, *(v for _, v in self.known)])

    def meet(self, street: CrossStreet) -> Piece:
        """Make a piece of a street; it ends exactly at junctions that are there already."""
        places = [(float(x), float(y)) for x, y in street.line.coords]
        ends = [self._junction(places[0])]
        ends.append(self._new(places[1]) if street.blind else self._junction(places[1]))
        line = LineString([xy for xy, _ in ends])
        self.lines.append(line)
        return Piece(line, CUL_DE_SAC if street.blind else LOCAL, ends[0][1], ends[1][1])

    def _junction(self, xy: XY) -> tuple[XY, int]:
        found = next((end for end in self.known if math.dist(end[0], xy) <= SAME), None)
        if found is not None:
            return found
        lines = np.array(self.lines, dtype=object)
        if len(lines) and (shapely.distance(lines, shapely.Point(xy)) <= SAME).any():
            return self._new(xy)
        self.lowest -= 1
        self.known.append((xy, self.lowest))
        return self.known[-1]

    def _new(self, xy: XY) -> tuple[XY, int]:
        """Make a junction between designed streets, or the blind end of one."""
        self.made.append((xy, self.first + len(self.made)))
        self.known.append(self.made[-1])
        return self.made[-1]


def _ends(piece: Piece) -> list[tuple[XY, int]]:
    """Position and number of the junctions at both ends."""
    (x0, y0), (x1, y1) = piece.line.coords[0], piece.line.coords[-1]
    return [((float(x0), float(y0)), piece.start), ((float(x1), float(y1)), piece.end)]


def _cut_at(piece: Piece, joints: Sequence[tuple[XY, int]]) -> list[Piece]:
    """Cut a street at the junctions on it, which become vertices of its course."""
    own = {v for _, v in _ends(piece)}
    on = sorted(
        (float(piece.line.project(shapely.Point(xy))), v, xy)
        for xy, v in joints
        if v not in own and piece.line.distance(shapely.Point(xy)) <= SAME
    )
    found = []
    begin, start, before = 0.0, piece.start, piece.line.coords[0]
    for at, v, xy in [*on, (float(piece.line.length), piece.end, piece.line.coords[-1])]:
        course = shapely.get_coordinates(substring(piece.line, begin, at))
        course[0], course[-1] = before, xy
        found.append(dataclasses.replace(piece, line=LineString(course), start=start, end=v))
        begin, start, before = at, v, xy
    return found


def _pieces(ground: Ground, level: IntArray, alignment: Alignment) -> list[Piece]:
    """Cut streets at mesh vertices where others meet them."""
    mesh = ground.mesh
    streets = (level > 0) | ground.street
    ends = np.bincount(mesh.edges[streets].ravel(), minlength=len(mesh.vertices))
    node = (ends != 2) | mesh.boundary_vertices | ground.sinks
    found = []
    for way in alignment.chains:
        path = [way[0]]
        previous = 0
        for u, v in zip(way, way[1:]):
            own = int(level[mesh.edge_between(u, v)])
            if len(path) > 1 and (node[u] or own != previous):
                found.append(_piece(mesh, alignment, path, previous))
                path = [u]
            path.append(v)
            previous = own
        found.append(_piece(mesh, alignment, path, previous))
    return found


def _piece(mesh: QuadMesh, alignment: Alignment, path: Sequence[int], level: int) -> Piece:
    """Join the lines along a path of vertices."""
    points: list[FloatArray] = []
    for u, v in zip(path, path[1:]):
        edge = mesh.edge_between(u, v)
        line = alignment.lines[edge]
        line = line if mesh.edges[edge, 0] == u else line[::-1]
        points.append(line if not points else line[1:])
    return Piece(LineString(np.vstack(points)), level, path[0], path[-1])


def _cut_at_existing(site: Site, pieces: Sequence[Piece]) -> list[Piece]:
    """Make a junction wherever a new street crosses an existing one."""
    beside = existing_lines(site)
    on = shapely.buffer(beside, SAME)
    tips = shapely.get_coordinates(shapely.boundary(shapely.line_merge(beside)))
    found = []
    count = 0
    for piece in pieces:
        crossings = shapely.get_coordinates(shapely.intersection(piece.line, beside))
        places = [(x, y) for x, y in np.vstack([crossings, tips]).tolist()]
        parts = split_at(piece.line, places, SHORTEST)
        start = piece.start
        for i, part in enumerate(parts):
            count += i < len(parts) - 1
            end = piece.end if i == len(parts) - 1 else -count
            # the end of an existing street may lie between two vertices of the mesh
            if len(parts) == 1 or not on.covers(part):
                found.append(Piece(part, piece.level, start, end))
            start = end
    return found
