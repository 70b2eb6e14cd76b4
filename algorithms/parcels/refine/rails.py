"""Lines that hold still and that cut ends slide along: outlines of blocks, courts and lanes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...measure.parcel_shape import STRAIGHT
from .mesh import Flags, Floats, Ints, Mesh

#: Off the line of their neighbours by more than this, cut ends are bends of a rail (metres).
BEND = 1e-4


@dataclass(frozen=True)
class Rails:
    """Polylines between corners, with the cut ends that slide along them.

    Places along rails are told by their distance `s` from the rail's begin (metres). *Stops* are
    those of all sliding cut ends, then those of the begins of all rails, then of their ends.

    Attributes
    ----------
    first
        Bends of rail r are those from ``first[r]`` to ``first[r + 1]``, its ends included,
        shape (r + 1,).
    bend
        Mesh vertex of each bend, shape (k,).
    xy
        Their coordinates from the middle of the block, shape (k, 2), metres.
    at
        Their distance from the begin of the rail, shape (k,), metres.
    way
        Unit direction of the rail after each bend, that of the last of a rail is not used,
        shape (k, 2).
    shift, key
        What to add to places on each rail so that they grow over all of them, shape (r,), and `at`
        with it, shape (k,), metres.
    swept
        Area swept from the middle of the block along the rail up to there, shape (k,), m2.
    slider
        Mesh vertices that slide, sorted by rail and place, shape (s,).
    rail
        Rail of each stop, shape (s + 2 r,).
    start
        Where the stops are at first, shape (s + 2 r,), metres.
    free, drop
        Mesh vertices that may move freely; bends of rails at which nothing ends. Shape (n,).
    tail, head
        For each place of the mesh whose edge lies on a rail, the stops of the rail at the edge's
        begin and end if they are stops; else -1. Shape (p,).
    rail_of_place
        Rail of the edge that begins at the place, -1 for none, shape (p,).
    """

    first: Ints
    bend: Ints
    xy: Floats
    at: Floats
    way: Floats
    shift: Floats
    key: Floats
    swept: Floats
    slider: Ints
    rail: Ints
    start: Floats
    free: Flags
    drop: Flags
    tail: Ints
    head: Ints
    rail_of_place: Ints

    def segment(self, rail: Ints, s: Floats) -> Ints:
        """Bend at or before which the places `s` are on their rails, shape like `s`."""
        low, high = self.first[rail], self.first[rail + 1] - 2
        found = self.key.searchsorted(s + self.shift[rail], side="right") - 1
        found = np.minimum(np.maximum(found, low), high)
        # the shift may have rounded a place across a bend
        found -= (self.at[found] > s) & (found > low)
        found += (self.at[found + 1] <= s) & (found < high)
        return np.asarray(found)

    def point(self, rail: Ints, s: Floats) -> tuple[Floats, Floats, Ints]:
        """Points at places on rails, the unit direction of the rail there, and the segment."""
        k = self.segment(rail, s)
        way = self.way[k]
        return self.xy[k] + (s - self.at[k])[:, None] * way, way, k

    def area(self, point: Floats, k: Ints) -> Floats:
        """Area swept from the middle of the block along the rail up to points on segments, m2."""
        base = self.xy[k]
        return self.swept[k] + 0.5 * (base[:, 0] * point[:, 1] - base[:, 1] * point[:, 0])


@dataclass
class _Paths:
    """Rails as they are collected."""

    path: list[list[int]] = field(default_factory=list)
    #: directed edge -> rail, place in the path, whether it runs along the path
    edges: dict[tuple[int, int], tuple[int, int, bool]] = field(default_factory=dict)

    def add(self, path: list[int]) -> None:
        for i, (a, b) in enumerate(zip(path[:-1], path[1:])):
            self.edges[a, b] = (len(self.path), i, True)
            self.edges[b, a] = (len(self.path), i, False)
        self.path.append(path)


def find_rails(mesh: Mesh, held: Flags) -> Rails:
    """Find the rails of a mesh.

    Parameters
    ----------
    mesh
        The plots.
    held
        Faces whose outline holds still, what is outside the blocks among them, shape (f,).
    """
    tail, head = mesh.vertex, mesh.vertex[mesh.after]
    # `across` is never -1 in a sound block
    still = held[mesh.face] | held[mesh.across]
    count = len(mesh.xy)
    degree = np.bincount(tail, minlength=count)
    on = np.bincount(tail[still], minlength=count)
    cut = degree > on
    two = on == 2
    way = mesh.local[head[still]] - mesh.local[tail[still]]
    way /= np.hypot(way[:, 0], way[:, 1])[:, None]
    # the unit vectors to both neighbours cancel where the line is straight
    bow = np.column_stack([np.bincount(tail[still], w, minlength=count) for w in way.T])
    straight = np.hypot(bow[:, 0], bow[:, 1]) < 2 * np.sin(np.radians(STRAIGHT / 2))
    fixed = (on > 0) & ~(two & straight)
    paths = _walk(tail[still], head[still], fixed, mesh.own & ~cut)
    slide = (on > 0) & ~fixed & cut
    drop = (on > 0) & ~fixed & ~cut
    return _assemble(mesh, paths, held, slide, drop, on == 0)


def _walk(tail: Ints, head: Ints, fixed: Flags, liked: Flags) -> _Paths:
    """Follow still edges from fixed vertex to fixed vertex; loops without one get one."""
    ways: dict[int, list[int]] = {}
    for a, b in zip(tail.tolist(), head.tolist()):
        ways.setdefault(a, []).append(b)
    paths = _Paths()

    def follow(a: int, b: int) -> None:
        path = [a, b]
        while not fixed[path[-1]]:
            one, other = ways[path[-1]]
            path.append(other if one == path[-2] else one)
        paths.add(path)

    def follow_all(vertices: list[int]) -> None:
        for a in vertices:
            for b in ways[a]:
                if (a, b) not in paths.edges:
                    follow(a, b)

    on = np.array(sorted(ways), dtype=int)
    follow_all(on[fixed[on]].tolist())
    # round outlines without corners: a bend of their own is taken for one
    for vertices in (on[liked[on]], on):
        for a in vertices.tolist():
            if not fixed[a] and (a, ways[a][0]) not in paths.edges:
                fixed[a] = True
                follow_all([a])
    return paths


def _assemble(
    mesh: Mesh, paths: _Paths, held: Flags, slide: Flags, drop: Flags, free: Flags
) -> Rails:
    """Put the rails that were found into arrays."""
    inner = ~np.isin(np.arange(len(mesh.xy)), mesh.vertex[_outside(mesh, held)])
    first, bends, at, way, swept = [0], [], [], [], []
    sliders: list[int] = []
    rail: list[int] = []
    start: list[float] = []
    stop_of: dict[int, int] = {}
    for number, path in enumerate(paths.path):
        ids = np.array(path)
        xy = mesh.local[ids]
        keep = _bends(xy, slide[ids], mesh.own[ids], bool(inner[ids[1]]))
        line = xy[keep]
        edge = line[1:] - line[:-1]
        steps = np.sqrt(edge[:, 0] ** 2 + edge[:, 1] ** 2)
        along, area = np.zeros(len(line)), np.zeros(len(line))
        steps.cumsum(out=along[1:])
        cross = 0.5 * (line[:-1, 0] * line[1:, 1] - line[:-1, 1] * line[1:, 0])
        cross.cumsum(out=area[1:])
        ahead = edge / np.maximum(along[1:] - along[:-1], 1e-12)[:, None]
        before = (np.cumsum(keep) - 1).tolist()
        for i in slide[ids].nonzero()[0].tolist():
            k = before[i]
            stop_of[path[i]] = len(sliders)
            sliders.append(path[i])
            rail.append(number)
            if keep[i]:
                start.append(float(along[k]))
            else:
                off = xy[i] - line[k]
                start.append(float(along[k] + off[0] * ahead[k, 0] + off[1] * ahead[k, 1]))
        first.append(first[-1] + len(line))
        bends.append(ids[keep])
        at.append(along)
        way += [ahead, ahead[-1:]]
        swept.append(area)
    count, ends = len(paths.path), np.array([a[-1] for a in at])
    shift = np.append(0.0, np.cumsum(ends + 1.0))[:-1]
    bend = np.concatenate([np.zeros(0, int), *bends])
    tail, head, rail_of_place = _stops(mesh, paths, stop_of, drop)
    return Rails(
        np.array(first),
        bend,
        mesh.local[bend],
        np.concatenate([np.zeros(0), *at]),
        np.concatenate([np.zeros((0, 2)), *way]),
        shift,
        np.concatenate([np.zeros(0), *(a + b for a, b in zip(at, shift))]),
        np.concatenate([np.zeros(0), *swept]),
        np.array(sliders, dtype=int),
        np.r_[np.array(rail, dtype=int), np.arange(count), np.arange(count)],
        np.r_[np.array(start, dtype=float), np.zeros(count), ends],
        free,
        drop,
        tail,
        head,
        rail_of_place,
    )


def _outside(mesh: Mesh, held: Flags) -> Flags:
    """Places in rings of what is outside the blocks, shape (p,)."""
    return mesh.face >= len(held) - len(mesh.sound)


def _bends(xy: Floats, slide: Flags, own: Flags, inner: bool) -> Flags:
    """Which vertices of a path shape it: all but cut ends that only lie on it."""
    keep = ~slide | own
    if not inner:
        return keep
    a, b, c = xy[:-2], xy[1:-1], xy[2:]
    chord, off = c - a, b - a
    length = np.maximum(np.hypot(chord[:, 0], chord[:, 1]), 1e-12)
    beside = np.abs(chord[:, 0] * off[:, 1] - chord[:, 1] * off[:, 0]) / length
    keep[1:-1] |= beside > BEND
    return keep


def _stops(
    mesh: Mesh, paths: _Paths, stop_of: dict[int, int], drop: Flags
) -> tuple[Ints, Ints, Ints]:
    """Find the stops at both ends of each edge on a rail, see `Rails`."""
    count = len(paths.path)
    tail = np.full(len(mesh.vertex), -1)
    head = np.full(len(mesh.vertex), -1)
    rail = np.full(len(mesh.vertex), -1)
    ends = zip(mesh.vertex.tolist(), mesh.vertex[mesh.after].tolist())
    for place, edge in enumerate(ends):
        found = paths.edges.get(edge)
        if found is None:
            continue
        rail[place] = found[0]
        begin, end = len(stop_of) + found[0], len(stop_of) + count + found[0]
        if not found[2]:
            begin, end = end, begin
        if not drop[edge[0]]:
            tail[place] = stop_of.get(edge[0], begin)
        if not drop[edge[1]]:
            head[place] = stop_of.get(edge[1], end)
    return tail, head, rail
