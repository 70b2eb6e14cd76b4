"""Component inequalities: what covers a vertex is at least one piece, and pieces are trees.

Let U be a set of vertices without existing streets, y(U) the number of active ones and x(E(U))
the number of chosen edges with both ends in U. Inside U the streets form pieces, and

    number of pieces = y(U) - x(E(U)) + number of independent cycles.

There is a piece if a vertex u of U is active, or if U holds all vertices that may cover
something. So, where there is no cycle inside U, ``y(U) - x(E(U)) >= y_u``, and ``>= 1`` if U
contains the ball of a covered vertex. Sinks do not disturb, dead ends neither.

When is there no cycle? Let the faces inside U generate all cycles of U (Euler's formula tells),
and let close pairs be forbidden. A cycle of streets in U is then the edge of a disc of faces of
U. Let T be the vertices strictly inside the disc; all faces around each of them belong to U.

* T is empty: a disc of quads without inner vertex is a tree of quads. A leaf of it has three
  sides on the cycle, of which two are opposite: forbidden. So there is no such cycle.
* T = {v}: by Euler's formula the disc has as many faces as inner edges, so the graph of its
  faces holds one cycle. If it had a leaf, the same would follow. So it is the ring of faces
  around v, and the cycle is the ring of edges around v.

Hence, if v is the only vertex of U whose faces all belong to U, the ring around v is the only
possible cycle, and ``y(U) - x(E(U)) + r_v >= 1`` with ``r_v <= x_e`` for its edges. Further, of
all rings around a corner of a face that share one of its edges only one is closed: two of them
would contain two opposite edges of that face. So ``r_v + r_w <= x_e``.

For larger sets, with at most c faces inside a cycle and g the least length of one: every piece
of the plane that streets enclose has at least g edges, and so has the outside; every edge
borders two. So ``cycles <= x(E(U)) / h`` with ``h = g / 2 (1 + 1 / c)``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Optional

from ..structure import Structure
from .balls import closed_ring, generating_faces, is_forest, least_cycle


@dataclass(frozen=True)
class ComponentCut:
    """The inequality ``y(vertices) - share x(edges) + r + s >= 1``, or ``>= y(base)``.

    Attributes
    ----------
    vertices
        The set U.
    edges
        Usable edges with both ends in U.
    ring
        Vertex whose ring variable r counts, or -1.
    cover
        Vertex whose coverage slack s counts, or -1.
    base
        Vertex on the right-hand side, or -1 for 1.
    share
        Less than 1 where cycles are bounded by a share of the edges.
    """

    vertices: tuple[int, ...]
    edges: tuple[int, ...]
    ring: int = -1
    cover: int = -1
    base: int = -1
    share: float = 1.0


class Regions:
    """What the component inequalities of a problem need to know of its mesh.

    Attributes
    ----------
    index
        The problem.
    no_pairs
        Whether close pairs are forbidden.
    corners, around
        Vertices of each face, faces at each vertex.
    inner
        For each vertex, whether it can lie strictly inside a disc of faces.
    free
        For each vertex, whether it can belong to a set U.
    rings
        Edges of the ring of each vertex around which a ring may close.
    """

    def __init__(self, index: Structure) -> None:
        mesh = index.problem.mesh
        self.index = index
        self.no_pairs = math.isinf(index.problem.too_close)
        self.corners: list[tuple[int, ...]] = [tuple(face) for face in mesh.faces.tolist()]
        self.around: list[list[int]] = [[] for _ in range(len(mesh.vertices))]
        for f, corners in enumerate(self.corners):
            for v in corners:
                self.around[v].append(f)
        self.inner: list[bool] = (~mesh.boundary_vertices).tolist()
        self.neighbours: list[list[int]] = [
            [index.vertex_of(e, v) for e in edges.tolist()]
            for v, edges in enumerate(mesh.vertex_edges)
        ]
        self.free = [False] * len(self.around)
        for v in index.free:
            self.free[v] = True
        self.rings = {v: ring for v in index.free if (ring := closed_ring(index, v))}

    def inside(self, members: Iterable[int]) -> tuple[int, ...]:
        """Return the usable edges with both ends among the members."""
        within = set(members)
        index = self.index
        return tuple(
            sorted(
                {e for u in within for e in index.incident[u] if index.vertex_of(e, u) in within}
            )
        )


class Region:
    """A set U of which at most one vertex has all its faces inside; it can grow.

    Attributes
    ----------
    members
        The set.
    centre
        The vertex with all its faces inside, or -1.
    """

    def __init__(self, regions: Regions, members: Iterable[int], centre: int) -> None:
        self._regions = regions
        self.members = set(members)
        self.centre = centre
        self._count: dict[int, int] = {}
        for f in {f for u in self.members for f in regions.around[u]}:
            if self.members.issuperset(regions.corners[f]):
                self._note(f)

    def _note(self, face: int) -> None:
        """Take note of a face that lies inside."""
        for v in self._regions.corners[face]:
            self._count[v] = self._count.get(v, 0) + 1

    def copy(self) -> Region:
        """Return a copy that grows by itself."""
        found = Region.__new__(Region)
        found._regions, found.centre = self._regions, self.centre
        found.members, found._count = set(self.members), dict(self._count)
        return found

    def add(self, w: int) -> bool:
        """Add a vertex beside the set if what was said of cycles stays true; return whether."""
        regions = self._regions
        if not regions.free[w]:
            return False
        links = sum(u in self.members for u in regions.neighbours[w])
        inside = self.members
        new = [
            f for f in regions.around[w] if all(u in inside or u == w for u in regions.corners[f])
        ]
        # every new cycle has to be one of faces
        if links - 1 != len(new):
            return False
        more: dict[int, int] = {}
        for f in new:
            for v in regions.corners[f]:
                more[v] = more.get(v, 0) + 1
        for v, count in more.items():
            full = self._count.get(v, 0) + count == len(regions.around[v])
            if full and regions.inner[v] and v != self.centre:
                return False
        self.members.add(w)
        for f in new:
            self._note(f)
        return True


def region_of(regions: Regions, members: Iterable[int]) -> Optional[Region]:
    """Return the region of a set if its faces generate its cycles and one star at most is full.

    Parameters
    ----------
    regions
        The problem.
    members
        Free vertices.

    Returns
    -------
    Region or None
        None also where close pairs are allowed and there is a face inside.
    """
    within = set(members)
    faces = generating_faces(regions.index, within)
    if faces is None or (faces and not regions.no_pairs):
        return None
    full = [v for v in within if regions.inner[v] and faces.issuperset(regions.around[v])]
    if len(full) > 1 or not all(regions.free[v] for v in within):
        return None
    return Region(regions, within, full[0] if full else -1)


def cover_cut(regions: Regions, v: int, ball: tuple[int, ...]) -> Optional[ComponentCut]:
    """Return the component inequality of a covered vertex, or None where none holds.

    Parameters
    ----------
    regions
        The problem.
    v, ball
        The vertex and those that may cover it.
    """
    within = set(ball)
    if not all(regions.free[u] for u in within):
        return None
    edges = regions.inside(within)
    region = region_of(regions, within)
    if region is not None:
        ring = region.centre if region.centre in regions.rings else -1
        return ComponentCut(ball, edges, ring, v)
    if is_forest(regions.index, within, list(edges)):
        return ComponentCut(ball, edges, cover=v)
    faces = generating_faces(regions.index, within)
    if faces is None:
        return None
    least = least_cycle(regions.index, within, faces)
    # where close pairs are forbidden every quad has two neighbours that no street parts from it
    most = max(1, len(faces) // 2) if regions.no_pairs else len(faces)
    return ComponentCut(ball, edges, cover=v, share=1.0 - 2.0 / (least * (1.0 + 1.0 / most)))
