"""A block as a mosaic of faces that share their vertices: cuts and joins never open a gap.

Vertices are numbered once; faces are rings of numbers. A vertex that a cut puts on an edge is
noted for that edge, so that the face on its other side takes it over too. Hence faces tile the
block exactly whatever is cut, without any comparison of coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Optional

import numpy as np
import shapely
from shapely.geometry import MultiLineString, Polygon

from .rings import Edge, Face, Floats, Loop, area_of, loop_area, pairs, trace

#: Cuts that pass a vertex within this distance go through it (metres).
SNAP = 0.02
#: Edges within this distance of a closed line give no access (metres).
ON_LINE = 0.02


def _key(start: int, end: int) -> Edge:
    return (start, end) if start < end else (end, start)


class Mosaic:
    """A block and the faces that tile it.

    Parameters
    ----------
    polygon
        The block, valid; metres.
    closed
        Parts of its rings without access.

    Attributes
    ----------
    xy
        Places of the vertices, metres.
    faces
        Rings of each face by its number: the exterior first, counter-clockwise, then holes,
        clockwise. Face 0 is the whole block at first.
    fronts
        Edges, as (smaller, larger) vertex, that give access.
    """

    def __init__(self, polygon: Polygon, closed: Optional[MultiLineString] = None) -> None:
        self._begin()
        whole = shapely.normalize(polygon)
        rings = [whole.exterior, *whole.interiors]
        self.add([self.ring(ring, ccw=number == 0) for number, ring in enumerate(rings)])
        self.fronts.update(_key(*edge) for edge in self.edges(0))
        if closed is not None and not closed.is_empty:
            self._close(closed)

    @classmethod
    def of_faces(
        cls, polygons: Sequence[Polygon], closed: Optional[MultiLineString] = None
    ) -> Mosaic:
        """Take over polygons that tile a block and share their vertices exactly.

        Parameters
        ----------
        polygons
            Face i becomes polygon i; metres.
        closed
            As above.
        """
        self = cls.__new__(cls)
        self._begin()
        number: dict[tuple[float, float], int] = {}
        for polygon in polygons:
            face = []
            for i, ring in enumerate([polygon.exterior, *polygon.interiors]):
                xy = shapely.get_coordinates(ring)[:-1]
                xy = xy if (area_of(xy) > 0) == (i == 0) else xy[::-1]
                loop = [number.setdefault((x, y), len(number)) for x, y in xy.tolist()]
                face.append(loop)
            self.add(face)
        self.xy = list(number)
        edges = {edge for face in self.faces for edge in self.edges(face)}
        self.fronts = {_key(a, b) for a, b in edges if (b, a) not in edges}
        if closed is not None and not closed.is_empty:
            self._close(closed)
        return self

    def _begin(self) -> None:
        self.xy: list[tuple[float, float]] = []
        self.faces: dict[int, Face] = {}
        self.fronts: set[Edge] = set()
        self._middle: dict[Edge, int] = {}
        self._last: tuple[int, Face, int, list[Edge]] = (0, [], 0, [])
        self._count = 0

    def save(self) -> tuple[Any, ...]:
        """Return all there is, for `restore`."""
        return len(self.xy), dict(self.faces), set(self.fronts), dict(self._middle), self._count

    def restore(self, saved: tuple[Any, ...]) -> None:
        """Go back to what `save` returned, once.

        Parameters
        ----------
        saved
            What `save` returned; only vertices and faces were added since.
        """
        count, self.faces, self.fronts, self._middle, self._count = saved
        del self.xy[count:]

    def _close(self, closed: MultiLineString) -> None:
        """Take the edges along closed lines out of the fronts; edges are split where these end."""
        ends = shapely.get_coordinates(
            [line.boundary for line in getattr(closed, "geoms", [closed])]
        )
        for x, y in ends.tolist():
            for start, end in sorted(self.fronts):
                if (start, end) in self._middle:
                    continue
                (sx, sy), (ex, ey) = self.xy[start], self.xy[end]
                size = math.dist((sx, sy), (ex, ey))
                if size == 0:
                    continue
                along = ((x - sx) * (ex - sx) + (y - sy) * (ey - sy)) / size
                off = abs((x - sx) * (ey - sy) - (y - sy) * (ex - sx)) / size
                if off < ON_LINE and SNAP < along < size - SNAP:
                    t = along / size
                    self.split_edge(start, end, sx + t * (ex - sx), sy + t * (ey - sy))
                    break
        edges = sorted(edge for edge in self.fronts if edge not in self._middle)
        xy = np.array([(self.xy[a], self.xy[b]) for a, b in edges])
        # the middle and the quarter points: an edge counts as closed where most of it is
        at = np.array([0.25, 0.5, 0.75])[:, None, None]
        places = shapely.points(xy[:, 0] * (1 - at) + xy[:, 1] * at)
        near = (shapely.distance(places, closed) < ON_LINE).sum(axis=0) >= 2
        self.fronts -= {_key(*edge) for edge, no in zip(edges, near) if no}

    def ring(self, line: Any, ccw: bool) -> Loop:
        """Give numbers to the vertices of a closed line, counter-clockwise or clockwise."""
        xy = shapely.get_coordinates(line)[:-1]
        if (area_of(xy) > 0) != ccw:
            xy = xy[::-1]
        start = len(self.xy)
        self.xy.extend(map(tuple, xy.tolist()))
        return list(range(start, len(self.xy)))

    def vertex(self, x: float, y: float) -> int:
        """Add a vertex and return its number."""
        self.xy.append((x, y))
        return len(self.xy) - 1

    def add(self, face: Face) -> int:
        """Add a face and return its number."""
        self.faces[self._count] = face
        self._count += 1
        return self._count - 1

    def refine(self, face: int) -> Face:
        """Return the rings of a face with all vertices that others put on its edges."""
        rings = [self._refined(loop) for loop in self.faces[face]]
        self.faces[face] = rings
        return rings

    def _refined(self, loop: Loop) -> Loop:
        if not self._middle:
            return loop
        found: Loop = []
        for edge in pairs(loop):
            todo = [edge]
            while todo:
                start, end = todo.pop()
                middle = self._middle.get(_key(start, end))
                if middle is None:
                    found.append(start)
                else:
                    todo += [(middle, end), (start, middle)]
        return found

    def descend(self, edges: Iterable[Edge]) -> set[Edge]:
        """Return edges together with the parts that they were split into.

        Parameters
        ----------
        edges
            As (smaller, larger) vertex.
        """
        found: set[Edge] = set()
        todo = list(edges)
        while todo:
            edge = todo.pop()
            found.add(edge)
            middle = self._middle.get(edge)
            if middle is not None:
                todo += [_key(edge[0], middle), _key(middle, edge[1])]
        return found

    def split_edge(self, start: int, end: int, x: float, y: float) -> int:
        """Put a vertex on an edge that has none yet, and return its number."""
        new = self.vertex(x, y)
        key = _key(start, end)
        self._middle[key] = new
        self._last[3].append(key)
        if key in self.fronts:
            self.fronts |= {_key(start, new), _key(new, end)}
        return new

    def cut(
        self,
        face: int,
        place: tuple[float, float],
        way: tuple[float, float],
        *,
        only_at: bool = False,
    ) -> list[int]:
        """Cut a face along a straight line.

        Parameters
        ----------
        face
            Number of the face; it is gone if the line cuts it.
        place, way
            A place on the line and its direction of length 1.
        only_at
            Cut only along the part of the line that begins nearest to `place`; everywhere else.

        Returns
        -------
        list of int
            The parts; the face itself if the line does not cut it.
        """
        rings = self.refine(face)
        self._last = (face, rings, len(self.xy), [])
        chords = self._chords(rings, place, way)
        if only_at and chords:
            chords = [
                min(chords, key=lambda c: min(self._far(c[0], place), self._far(c[1], place)))
            ]
        if not chords:
            return [face]
        edges = [edge for loop in self.refine(face) for edge in pairs(loop)]
        known = {_key(*edge) for edge in edges}
        edges += [edge for a, b in chords if _key(a, b) not in known for edge in ((a, b), (b, a))]
        parts = self.trace(edges)
        if len(parts) < 2:
            self.undo([])
            return [face]
        del self.faces[face]
        return [self.add(part) for part in parts]

    def undo(self, parts: Iterable[int]) -> None:
        """Take the last cut back; nothing else may have been done since.

        Parameters
        ----------
        parts
            What `cut` returned.
        """
        face, rings, vertices, keys = self._last
        for part in parts:
            self.faces.pop(part, None)
        for key in keys:
            middle = self._middle.pop(key)
            self.fronts -= {_key(key[0], middle), _key(middle, key[1])}
        del self.xy[vertices:]
        self.faces[face] = rings

    def _far(self, vertex: int, place: tuple[float, float]) -> float:
        x, y = self.xy[vertex]
        return math.hypot(x - place[0], y - place[1])

    def _chords(
        self, rings: Face, place: tuple[float, float], way: tuple[float, float]
    ) -> list[Edge]:
        """Put vertices where a line crosses rings, and pair those that face inside."""
        (px, py), (wx, wy) = place, way
        found: list[tuple[float, int]] = []
        for loop in rings:
            xy = np.array([self.xy[v] for v in loop]) - (px, py)
            off = xy[:, 1] * wx - xy[:, 0] * wy
            off[np.abs(off) < SNAP] = 0.0
            up = off >= 0
            for i in np.flatnonzero(up != np.r_[up[1:], up[:1]]).tolist():
                j = (i + 1) % len(loop)
                t = float(off[i] / (off[i] - off[j]))
                size = math.hypot(xy[j, 0] - xy[i, 0], xy[j, 1] - xy[i, 1])
                x, y = (xy[i] + t * (xy[j] - xy[i])).tolist()
                if t * size < SNAP:
                    vertex = loop[i]
                elif (1 - t) * size < SNAP:
                    vertex = loop[j]
                else:
                    vertex = self.split_edge(loop[i], loop[j], x + px, y + py)
                found.append((x * wx + y * wy, vertex))
        found.sort()
        return [(a, b) for (_, a), (_, b) in zip(found[::2], found[1::2]) if a != b]

    def trace(self, edges: Iterable[Edge]) -> list[Face]:
        """Return the faces on the left of directed edges; none if they are no mosaic.

        Parameters
        ----------
        edges
            As vertices.
        """
        return trace(self.xy, edges)

    def join(self, faces: Sequence[int]) -> Optional[int]:
        """Join faces that touch along edges into one; None if they are not one piece.

        Parameters
        ----------
        faces
            Their numbers; they are gone afterwards, unless they cannot be joined.
        """
        edges = [edge for face in faces for loop in self.refine(face) for edge in pairs(loop)]
        kept = set(edges)
        kept = {(a, b) for a, b in kept if (b, a) not in kept}
        parts = self.trace(sorted(kept))
        if len(parts) != 1:
            return None
        for face in faces:
            del self.faces[face]
        return self.add(parts[0])

    def divide(self, face: int, parts: Sequence[Face]) -> list[int]:
        """Put faces in the place of one that they tile, and return their numbers.

        Parameters
        ----------
        face
            Number of the face; it is gone afterwards.
        parts
            Rings of vertices, as in `faces`.
        """
        del self.faces[face]
        return [self.add(part) for part in parts]

    def edges(self, face: int) -> list[Edge]:
        """Return the directed edges of a face, land on their left."""
        return [edge for loop in self.refine(face) for edge in pairs(loop)]

    def length(self, edges: Iterable[Edge]) -> float:
        """Return the length of edges, metres."""
        return sum(math.dist(self.xy[a], self.xy[b]) for a, b in edges)

    def frontage(self, face: int) -> float:
        """Return the length of a face along street space, metres."""
        return self.length(edge for edge in self.edges(face) if _key(*edge) in self.fronts)

    def is_front(self, edge: Edge) -> bool:
        """Tell whether an edge lies along street space."""
        return _key(*edge) in self.fronts

    def neighbours(self, face: int, others: Iterable[int]) -> dict[int, float]:
        """Return the length of the edge that a face shares with each other that touches it."""
        mine = {(b, a) for a, b in self.edges(face)}
        found = {}
        for other in others:
            shared = mine.intersection(self.edges(other)) if other != face else set()
            if shared:
                found[other] = self.length(shared)
        return found

    def places(self, face: int) -> Floats:
        """Return the vertices of the exterior of a face, shape (n, 2), not closed."""
        return np.array([self.xy[v] for v in self.refine(face)[0]])

    def area(self, face: int) -> float:
        """Return the area of a face, square metres."""
        return sum(loop_area(self.xy, loop) for loop in self.faces[face])

    def polygons(self, faces: Sequence[int]) -> list[Polygon]:
        """Return faces as polygons with all their shared vertices."""
        return [
            Polygon(
                [self.xy[v] for v in rings[0]], [[self.xy[v] for v in loop] for loop in rings[1:]]
            )
            for rings in map(self.refine, faces)
        ]
