"""The street mesh: regions that tile the ground, and the streets between them (UP sections 3, 6).

Splitting a region adds vertices and edges to it; since neighbours share vertices by number, the
regions tile the ground whatever is split or moved afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from ..edges import EdgeKind

Ring = tuple[int, ...]


@dataclass(frozen=True)
class MeshEdge:
    """What an edge of the mesh is.

    Attributes
    ----------
    kind
        What lies along it.
    street
        Number of the street that it is part of, or -1.
    width
        Width of that street, metres; 0 where it is none.
    fixed
        Whether its vertices must keep their place (the site's edge, what was given).
    """

    kind: EdgeKind
    street: int = -1
    width: float = 0.0
    fixed: bool = False


@dataclass(frozen=True)
class Region:
    """A face of the mesh, as rings of numbers of vertices, the outer one first.

    The ground lies to the left of every ring: the outer one goes counter-clockwise. Rings do
    not repeat their first vertex.
    """

    rings: tuple[Ring, ...]

    def edges(self) -> Iterator[tuple[int, int]]:
        """Yield the half-edges, ring by ring."""
        for ring in self.rings:
            yield from zip(ring, (*ring[1:], ring[0]))

    @cached_property
    def halves(self) -> npt.NDArray[np.int64]:
        """The half-edges in the same order, shape (e, 2); not to be changed."""
        return np.array(list(self.edges()), dtype=np.int64)


class StreetMesh:
    """Regions and streets as one planar structure.

    Attributes
    ----------
    xy
        Coordinates of the vertices, shape (n, 2), metres.
    regions
        The regions by number.
    edges
        What the edges are, by their vertices, the lower number first; changed by `set_edge` and
        `drop_edge` alone.
    parents
        From which region each was split, also of regions that are no more.
    labels
        Names that were given to regions, such as the template that they get.
    """

    def __init__(self) -> None:
        self.xy: npt.NDArray[np.float64] = np.zeros((0, 2))
        self.regions: dict[int, Region] = {}
        self.edges: dict[tuple[int, int], MeshEdge] = {}
        self.parents: dict[int, int] = {}
        self.labels: dict[int, str] = {}
        self._left: dict[tuple[int, int], int] = {}
        self._around: dict[int, tuple[int, ...]] = {}
        self._next = 1

    def copy(self) -> StreetMesh:
        """Return a mesh of its own with the same content."""
        other = StreetMesh()
        other.xy = self.xy.copy()
        other.regions = dict(self.regions)
        other.edges = dict(self.edges)
        other.parents = dict(self.parents)
        other.labels = dict(self.labels)
        other._left = dict(self._left)
        other._around = dict(self._around)
        other._next = self._next
        return other

    # Reading.

    def edge(self, a: int, b: int) -> MeshEdge:
        """Return what the edge between two vertices is."""
        return self.edges[(a, b) if a < b else (b, a)]

    def left_of(self, a: int, b: int) -> int | None:
        """Return the region to the left of a half-edge, or None."""
        return self._left.get((a, b))

    def neighbours(self, v: int) -> tuple[int, ...]:
        """Return the vertices with an edge to v."""
        return self._around.get(v, ())

    def polygon(self, region: int) -> Polygon:
        """Return the outline of a region, metres."""
        outer, *holes = (self.xy[list(ring)] for ring in self.regions[region].rings)
        return Polygon(outer, holes)

    def kinds(self, region: int) -> npt.NDArray[np.int64]:
        """Return the kinds of the edges of a region, ring by ring, in the order of its vertices."""
        return np.array([self.edge(a, b).kind for a, b in self.regions[region].edges()], dtype=int)

    def degrees(self) -> npt.NDArray[np.int64]:
        """Return with how many edges each vertex meets, shape (n,)."""
        ends = np.array(list(self.edges), dtype=int).reshape(-1, 2)
        return np.bincount(ends.ravel(), minlength=len(self.xy))

    # Building.

    def add_vertices(self, xy: npt.ArrayLike) -> list[int]:
        """Add vertices, shape (k, 2), and return their numbers."""
        more = np.asarray(xy, dtype=float).reshape(-1, 2)
        first = len(self.xy)
        self.xy = np.vstack([self.xy, more])
        return list(range(first, len(self.xy)))

    def add_region(self, rings: Iterable[Sequence[int]]) -> int:
        """Add a region by its rings and return its number; its edges must be told apart."""
        region = Region(tuple(tuple(ring) for ring in rings))
        number, self._next = self._next, self._next + 1
        self.regions[number] = region
        for half in region.edges():
            self._left[half] = number
        return number

    def set_edge(self, a: int, b: int, edge: MeshEdge) -> None:
        """Say what the edge between two vertices is."""
        key = (a, b) if a < b else (b, a)
        if key not in self.edges:
            self._around[a] = (*self._around.get(a, ()), b)
            self._around[b] = (*self._around.get(b, ()), a)
        self.edges[key] = edge

    def drop_edge(self, a: int, b: int) -> MeshEdge:
        """Forget the edge between two vertices, and return what it was."""
        edge = self.edges.pop((a, b) if a < b else (b, a))
        for v, other in ((a, b), (b, a)):
            self._around[v] = tuple(w for w in self._around[v] if w != other)
        return edge

    def insert(self, a: int, b: int, xy: tuple[float, float]) -> int:
        """Put a vertex on an edge, in the regions on both sides, and return its number.

        Parameters
        ----------
        a, b
            The edge.
        xy
            Place, metres; on the edge, else the regions change.
        """
        (v,) = self.add_vertices([xy])
        edge = self.drop_edge(a, b)
        self.set_edge(a, v, edge)
        self.set_edge(v, b, edge)
        for start, end in ((a, b), (b, a)):
            number = self._left.pop((start, end), None)
            if number is None:
                continue
            region = self.regions[number]
            self.regions[number] = Region(
                tuple(_with(ring, start, end, v) for ring in region.rings)
            )
            self._left[(start, v)] = self._left[(v, end)] = number
        return v

    def move_halves(
        self, gone: Iterable[tuple[int, int]], come: dict[tuple[int, int], int]
    ) -> None:
        """Forget the regions to the left of half-edges, and take note of others."""
        for half in gone:
            self._left.pop(half, None)
        self._left.update(come)

    def split(
        self, region: int, chains: Sequence[Sequence[int]], edges: Sequence[MeshEdge]
    ) -> list[int]:
        """Split a region along chains of vertices and return the numbers of its parts.

        Parameters
        ----------
        region
            Its number; it is no region of the mesh afterwards.
        chains
            Each a line inside the region, as numbers of vertices, that begins and ends on its
            rings (or on another chain).
        edges
            What the edges of each chain are.
        """
        old = self.regions.pop(region)
        halves = list(old.edges())
        for chain, edge in zip(chains, edges):
            for a, b in zip(chain[:-1], chain[1:]):
                halves += [(a, b), (b, a)]
                self.set_edge(a, b, edge)
        for half in old.edges():
            self._left.pop(half, None)
        parts = [self.add_region(rings) for rings in _faces(halves, self.xy)]
        self.parents.update(dict.fromkeys(parts, region))
        return parts

    def families(self, most: int) -> list[tuple[int, tuple[int, ...]]]:
        """Find the regions of the past that have up to so many parts now, the smallest first.

        Parameters
        ----------
        most
            Number of parts; regions that are still whole are left out.

        Returns
        -------
        list of (int, tuple of int)
            Number of the region of the past, and of its parts.
        """
        parts: dict[int, list[int]] = {}
        for region in self.regions:
            above = self.parents.get(region)
            while above is not None:
                parts.setdefault(above, []).append(region)
                above = self.parents.get(above)
        few = [(k, tuple(sorted(own))) for k, own in parts.items() if 2 <= len(own) <= most]
        return sorted(few, key=lambda own: (len(own[1]), own))

    def merge(self, region: int, parts: Sequence[int]) -> int:
        """Put the parts of a region together again, and return its new number.

        Parameters
        ----------
        region
            Its old number, see `families`.
        parts
            All its parts; the edges between them go.

        Raises
        ------
        ValueError
            If they are not one face.
        """
        halves = [half for number in parts for half in self.regions[number].edges()]
        every = set(halves)
        outline = [(a, b) for a, b in halves if (b, a) not in every]
        faces = _faces(outline, self.xy)
        if len(faces) != 1:
            msg = f"{len(parts)} regions make {len(faces)} faces"
            raise ValueError(msg)
        for a, b in halves:
            del self._left[(a, b)]
            if a < b and (b, a) in every:
                self.drop_edge(a, b)
        for number in parts:
            del self.regions[number]
            self.labels.pop(number, None)
        whole = self.add_region(faces[0])
        if region in self.parents:
            self.parents[whole] = self.parents[region]
        return whole


def _with(ring: Ring, a: int, b: int, v: int) -> Ring:
    """Put v between a and b where they follow each other in a ring."""
    found: list[int] = []
    for at, here in enumerate(ring):
        found.append(here)
        if here == a and ring[(at + 1) % len(ring)] == b:
            found.append(v)
    return tuple(found)


def _faces(halves: Sequence[tuple[int, int]], xy: npt.NDArray[np.float64]) -> list[list[Ring]]:
    """Trace the faces to the left of half-edges; each as its outer ring and its holes."""
    out: dict[int, list[tuple[float, int]]] = {}
    for a, b in halves:
        way = xy[b] - xy[a]
        out.setdefault(a, []).append((math.atan2(way[1], way[0]), b))
    following = {}
    for a, b in halves:
        way = xy[a] - xy[b]
        back = math.atan2(way[1], way[0])
        # the first way clockwise of the one back keeps the face to the left
        following[(a, b)] = min(out[b], key=lambda turn: _clockwise(back, turn[0], turn[1] == a))[1]
    rings: list[Ring] = []
    left = dict.fromkeys(halves)
    while left:
        start = half = next(iter(left))
        ring = []
        while half in left:
            del left[half]
            ring.append(half[0])
            half = (half[1], following[half])
        if half != start:
            msg = "the chains do not make faces"
            raise ValueError(msg)
        rings.append(tuple(ring))
    return _nest(rings, xy)


def _clockwise(back: float, angle: float, is_back: bool) -> float:
    """Angle from the way back to another, clockwise, in (0, 2 pi]; the way back comes last."""
    turn = (back - angle) % (2 * math.pi)
    return 2 * math.pi if is_back or turn < 1e-12 else turn


def signed_area(xy: npt.NDArray[np.float64]) -> float:
    """Signed area of a ring of shape (n, 2), positive if counter-clockwise.

    Examples
    --------
    >>> signed_area(np.array([(0, 0), (2, 0), (2, 1), (0, 1)]))
    2.0
    """
    x, y = (xy - xy[0]).T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) / 2


def _nest(rings: Sequence[Ring], xy: npt.NDArray[np.float64]) -> list[list[Ring]]:
    """Give the clockwise rings as holes to the smallest ring around them."""
    areas = [signed_area(xy[list(ring)]) for ring in rings]
    outer = sorted((k for k, area in enumerate(areas) if area > 0), key=lambda k: areas[k])
    found = {k: [rings[k]] for k in outer}
    shapes = {k: Polygon(xy[list(rings[k])]) for k in outer} if len(outer) < len(rings) else {}
    for k, area in enumerate(areas):
        if area > 0:
            continue
        inside = shapely.Point(xy[rings[k][0]])
        home = next(
            (j for j in outer if shapes[j].intersects(inside)), outer[-1] if outer else None
        )
        if home is not None:
            found[home].append(rings[k])
    return [found[k] for k in sorted(found)]
