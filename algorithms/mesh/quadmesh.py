"""The candidate mesh: quads with edges, half-edges, fans, strips and continuations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..errors import InputError

BoolArray = npt.NDArray[np.bool_]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


def _empty_bool() -> BoolArray:
    return np.zeros(0, dtype=np.bool_)


def _empty_int() -> IntArray:
    return np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class QuadMesh:
    """A planar, conforming, all-quad mesh with n vertices, m faces and e edges.

    Half-edge ``4 * f + k`` runs along side k of face f, from ``faces[f, k]`` to
    ``faces[f, (k + 1) % 4]``, with the face on its left. All arrays are read-only; derived
    arrays are computed once, on first use.

    Parameters
    ----------
    vertices
        Shape (n, 2), metres. Every vertex belongs to a face.
    faces
        Shape (m, 4), vertex indices, counter-clockwise.
    edge_length
        The length that was asked of the edges, metres, greater than 0.
    boundary_arcs
        True geometry of boundary edges: edge index -> points (k, 2), metres, from
        ``edges[i, 0]`` to ``edges[i, 1]``. Edges that are not listed are straight.
    fixed
        Shape (n,). Vertices kept in place: corners of the site and given points.
    foreign
        Shape (e,). Edges that cross ground outside the site: no street may run there.
    parent_edges
        Shape (e,). Edge of the coarser mesh of which the edge is one half, or -1.
    parent_vertices
        Shape (n,). The same vertex in the coarser mesh, or -1.
    attracted
        Vertices pulled onto a given point: vertex -> index of the point.

    Raises
    ------
    InputError
        If shapes or indices are wrong, or the faces do not form a manifold with
        consistently counter-clockwise faces.

    Examples
    --------
    >>> mesh = QuadMesh(np.array([[0, 0], [2, 0], [2, 1], [0, 1]]), np.array([[0, 1, 2, 3]]), 1.0)
    >>> mesh.edges.tolist()
    [[0, 1], [0, 3], [1, 2], [2, 3]]
    >>> mesh.lengths.tolist()
    [2.0, 1.0, 1.0, 2.0]
    >>> [strip.tolist() for strip in mesh.strips()]
    [[0, 3], [1, 2]]
    """

    vertices: FloatArray
    faces: IntArray
    edge_length: float
    boundary_arcs: Mapping[int, FloatArray] = field(default_factory=dict)
    fixed: BoolArray = field(default_factory=_empty_bool)
    foreign: BoolArray = field(default_factory=_empty_bool)
    parent_edges: IntArray = field(default_factory=_empty_int)
    parent_vertices: IntArray = field(default_factory=_empty_int)
    attracted: Mapping[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Convert and check the arrays, fill in defaults."""
        self._store("vertices", np.array(self.vertices, dtype=np.float64))
        self._store("faces", np.array(self.faces, dtype=np.int64))
        _check_arrays(self.vertices, self.faces, self.edge_length)
        n, e = len(self.vertices), len(self.edges)
        _check_half_edges(self.faces, self.edge_faces, self._edge_uses)
        self._store("fixed", _filled(self.fixed, n, False, np.bool_, "fixed"))
        self._store("foreign", _filled(self.foreign, e, False, np.bool_, "foreign"))
        self._store("parent_edges", _filled(self.parent_edges, e, -1, np.int64, "parent_edges"))
        self._store(
            "parent_vertices",
            _filled(self.parent_vertices, n, -1, np.int64, "parent_vertices"),
        )
        arcs = {int(i): np.array(a, dtype=np.float64) for i, a in self.boundary_arcs.items()}
        _check_arcs(arcs, self.boundary_edges)
        for arc in arcs.values():
            arc.setflags(write=False)
        object.__setattr__(self, "boundary_arcs", arcs)
        object.__setattr__(
            self, "attracted", {int(v): int(p) for v, p in dict(self.attracted).items()}
        )
        fans = np.array([len(fan) for fan in self.vertex_edges], dtype=np.int64)
        bad = np.flatnonzero(fans != self.valences)
        if len(bad):
            raise InputError(
                f"The mesh is not a manifold: parts touch only at vertex {int(bad[0])} "
                f"({len(bad)} such vertices).",
                "Separate the parts or join them along an edge.",
            )

    def _store(self, name: str, array: npt.NDArray[np.generic]) -> None:
        array.setflags(write=False)
        object.__setattr__(self, name, array)

    # ------------------------------------------------------------------ topology
    @cached_property
    def _edge_table(self) -> tuple[IntArray, IntArray, IntArray]:
        """Sorted keys u * n + v of the edges, edge per half-edge, uses per edge."""
        start = self.faces.ravel()
        end = np.roll(self.faces, -1, axis=1).ravel()
        keys = np.minimum(start, end) * len(self.vertices) + np.maximum(start, end)
        unique, inverse, counts = np.unique(keys, return_inverse=True, return_counts=True)
        return unique, inverse.reshape(-1).astype(np.int64), counts.astype(np.int64)

    @property
    def _edge_uses(self) -> IntArray:
        return self._edge_table[2]

    @cached_property
    def edges(self) -> IntArray:
        """Shape (e, 2): vertices u < v of each edge, in lexicographic order."""
        keys = self._edge_table[0]
        n = len(self.vertices)
        return np.column_stack([keys // n, keys % n])

    @cached_property
    def directed_edges(self) -> tuple[IntArray, IntArray, IntArray]:
        """Start, end and edge of every edge in both directions, (2 e,) each, by start and end."""
        start, end = np.vstack([self.edges, self.edges[:, ::-1]]).T
        order = np.lexsort((end, start))
        edge = np.tile(np.arange(len(self.edges)), 2)
        return start[order], end[order], edge[order]

    @cached_property
    def face_edges(self) -> IntArray:
        """Shape (m, 4): the edge on each side; the side opposite to k is (k + 2) % 4."""
        return self._edge_table[1].reshape(-1, 4)

    @cached_property
    def _edge_half_edges(self) -> IntArray:
        """Shape (e, 2): the one or two half-edges of each edge, -1 where missing."""
        order = np.argsort(self._edge_table[1], kind="stable")
        first = np.cumsum(self._edge_uses) - self._edge_uses
        pair = np.full((len(first), 2), -1, dtype=np.int64)
        pair[:, 0] = order[first]
        double = self._edge_uses > 1
        pair[double, 1] = order[first[double] + 1]
        return pair

    @cached_property
    def edge_faces(self) -> IntArray:
        """Shape (e, 2): the faces at each edge, the second -1 on the boundary."""
        half = self._edge_half_edges
        return np.where(half < 0, -1, half // 4)

    @cached_property
    def twins(self) -> IntArray:
        """Shape (4 m,): the opposite half-edge of each half-edge, -1 on the boundary."""
        twin = np.full(4 * len(self.faces), -1, dtype=np.int64)
        pair = self._edge_half_edges[self._edge_half_edges[:, 1] >= 0]
        twin[pair[:, 0]] = pair[:, 1]
        twin[pair[:, 1]] = pair[:, 0]
        return twin

    @cached_property
    def boundary_edges(self) -> BoolArray:
        """Shape (e,): edges with a face on one side only."""
        return np.asarray(self.edge_faces[:, 1] < 0)

    @cached_property
    def boundary_vertices(self) -> BoolArray:
        """Shape (n,): ends of boundary edges."""
        mark = np.zeros(len(self.vertices), dtype=np.bool_)
        mark[self.edges[self.boundary_edges].ravel()] = True
        return mark

    @cached_property
    def valences(self) -> IntArray:
        """Shape (n,): number of edges at each vertex."""
        return np.bincount(self.edges.ravel(), minlength=len(self.vertices)).astype(np.int64)

    @cached_property
    def vertex_edges(self) -> tuple[IntArray, ...]:
        """Edges at each vertex, counter-clockwise.

        At a boundary vertex the fan begins and ends with a boundary edge and the ground
        outside lies between the last and the first.
        """
        n, h = len(self.vertices), 4 * len(self.faces)
        edge_of = self.face_edges.ravel()
        tail = self.faces.ravel()
        half = np.arange(h)
        start = np.full(n, -1, dtype=np.int64)
        start[tail[::-1]] = half[::-1]
        out = self.twins < 0
        start[tail[out]] = half[out]
        columns = []
        current = start.copy()
        while (current >= 0).any():
            going = np.flatnonzero(current >= 0)
            column = np.full(n, -1, dtype=np.int64)
            column[going] = edge_of[current[going]]
            columns.append(column)
            before = current[going] // 4 * 4 + (current[going] + 3) % 4
            following = self.twins[before]
            # the fan of a boundary vertex ends with the edge that runs into it
            last = np.full(n, -1, dtype=np.int64)
            ends = following < 0
            last[going[ends]] = edge_of[before[ends]]
            columns.append(last)
            following = np.where(following == start[going], -1, following)
            current = np.full(n, -1, dtype=np.int64)
            current[going] = following
        table = np.column_stack(columns)
        return tuple(row[row >= 0] for row in table)

    # ------------------------------------------------------------------ geometry
    @cached_property
    def lengths(self) -> FloatArray:
        """Shape (e,): length of each edge along its true geometry, metres."""
        ends = self.vertices[self.edges]
        length: FloatArray = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        for i, arc in self.boundary_arcs.items():
            length[i] = np.hypot(*np.diff(arc, axis=0).T).sum()
        return length

    def edge_line(self, edge: int) -> FloatArray:
        """Return the points (k, 2) of an edge: its boundary arc where given, else its chord."""
        arc = self.boundary_arcs.get(edge)
        return self.vertices[self.edges[edge]] if arc is None else arc

    # ------------------------------------------------------------------ walks
    def edge_between(self, u: int, v: int) -> int:
        """Return the edge that joins vertices u and v, or -1."""
        keys = self._edge_table[0]
        key = min(u, v) * len(self.vertices) + max(u, v)
        i = int(np.searchsorted(keys, key))
        return i if i < len(keys) and keys[i] == key else -1

    def opposite_pairs(self) -> IntArray:
        """Return the pairs (2 m, 2) of opposite sides of all faces, two for each face."""
        sides = self.face_edges
        pairs: IntArray = np.stack([sides[:, [0, 2]], sides[:, [1, 3]]], axis=1).reshape(-1, 2)
        return pairs

    def strips(self) -> list[IntArray]:
        """Return the maximal strips of quads, each as the sequence of its rungs.

        A strip goes from quad to quad through opposite sides; its rungs are the edges that
        it crosses. Every edge is a rung of exactly one strip, every quad lies in two (or
        twice in one). The first rung of a closed strip is repeated at its end.
        """
        seen = np.zeros(len(self.edges), dtype=np.bool_)
        boundary = np.flatnonzero(self.boundary_edges)
        inner = np.flatnonzero(~self.boundary_edges)
        half, edge_of, twins = self._edge_half_edges, self.face_edges.ravel(), self.twins
        found = []
        for begin in np.concatenate([boundary, inner]).tolist():
            if seen[begin]:
                continue
            rungs, current = [begin], int(half[begin, 0])
            seen[begin] = True
            while current >= 0:
                across = current // 4 * 4 + (current + 2) % 4
                rung = int(edge_of[across])
                rungs.append(rung)
                if rung == begin:
                    break
                seen[rung] = True
                current = int(twins[across])
            found.append(np.array(rungs, dtype=np.int64))
        return found

    def continuation(self, vertex: int, edge: int) -> int:
        """Return the edge that goes straight on through a vertex, or -1.

        That is the edge two quads away: the opposite one at an inner vertex of valence 4;
        along the boundary or into the mesh at a boundary vertex of valence 3 or 4. Elsewhere
        (corners, irregular vertices) nothing continues.
        """
        fan = self.vertex_edges[vertex].tolist()
        if edge not in fan:
            raise InputError(f"Edge {edge} does not touch vertex {vertex}.")
        i = fan.index(edge)
        if not self.boundary_vertices[vertex]:
            return int(fan[(i + 2) % 4]) if len(fan) == 4 else -1
        if len(fan) not in (3, 4):
            return -1
        ahead = [j for j in (i + 2, i - 2) if 0 <= j < len(fan)]
        return int(fan[ahead[0]]) if ahead else -1


def _filled(
    array: npt.ArrayLike, count: int, default: bool | int, kind: type[np.generic], name: str
) -> npt.NDArray[np.generic]:
    """Copy an optional array, or make it of the default where it is empty."""
    given = np.array(array, dtype=kind)
    if given.size == 0:
        return np.full(count, default, dtype=kind)
    if given.shape != (count,):
        raise InputError(f"'{name}' has shape {given.shape}, expected ({count},).")
    return given


def _check_arrays(vertices: FloatArray, faces: IntArray, edge_length: float) -> None:
    """Refuse arrays that cannot be a mesh."""
    if vertices.ndim != 2 or vertices.shape[1] != 2 or not np.isfinite(vertices).all():
        raise InputError("Mesh vertices must be an array of shape (n, 2) of finite numbers.")
    if faces.ndim != 2 or faces.shape[1] != 4 or len(faces) == 0:
        raise InputError("Mesh faces must be an array of shape (m, 4) with at least one face.")
    if not edge_length > 0:
        raise InputError("The edge length of a mesh must be greater than 0.")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError("Mesh faces name vertices that do not exist.")
    ordered = np.sort(faces, axis=1)
    double = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if len(double):
        raise InputError(f"Face {int(double[0])} of the mesh names a vertex twice.")
    unused = np.setdiff1d(np.arange(len(vertices)), ordered)
    if len(unused):
        raise InputError(
            f"Vertex {int(unused[0])} of the mesh belongs to no face ({len(unused)} in all).",
            "Leave such vertices out.",
        )


def _check_half_edges(faces: IntArray, edge_faces: IntArray, uses: IntArray) -> None:
    """Refuse edges with three faces and neighbours of opposite orientation."""
    many = np.flatnonzero(uses > 2)
    if len(many):
        raise InputError(
            f"The mesh is not a manifold: more than two faces share an edge of face "
            f"{int(edge_faces[many[0], 0])}.",
            "Remove doubled or overlapping faces.",
        )
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    directed = start * (int(faces.max()) + 1) + end
    values, first, counts = np.unique(directed, return_index=True, return_counts=True)
    if len(values) < len(directed):
        raise InputError(
            f"Face {int(first[counts > 1][0]) // 4} of the mesh and one of its neighbours run "
            "in opposite directions.",
            "List the vertices of every face counter-clockwise.",
        )


def _check_arcs(arcs: Mapping[int, FloatArray], boundary: BoolArray) -> None:
    """Refuse arcs that do not belong to boundary edges."""
    for i, arc in arcs.items():
        if not 0 <= i < len(boundary) or not boundary[i]:
            raise InputError(f"A boundary arc is given for edge {i}, which is not on the boundary.")
        if arc.ndim != 2 or arc.shape[1] != 2 or len(arc) < 2:
            raise InputError(f"The boundary arc of edge {i} needs at least two points (x, y).")
