"""Where everything is: positions of vertices and cut ends, and the outlines of plots from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from .mesh import Flags, Floats, Ints, Mesh, following, starts
from .rails import Rails

#: Cut ends nearer than this to a bend of their rail are put onto it (metres).
SNAP = 1e-3
#: Where a green is narrower than this, it falls apart (metres).
NECK = 3.0


@dataclass
class State:
    """What moves.

    Attributes
    ----------
    xy
        Vertices from the middle of their block, of which only free ones count, shape (n, 2),
        metres.
    s
        Stops on rails, of which only the cut ends move, shape (s + 2 r,), metres.
    """

    xy: Floats
    s: Floats


@dataclass(frozen=True)
class Placed:
    """What follows from a state, found once.

    Attributes
    ----------
    state
        The state, not to be changed from now on.
    xy
        Positions of all vertices from the middle of their block, shape (n, 2), metres.
    segment
        Bend before each stop, shape (s + 2 r,).
    way
        Unit direction of the rail at each stop, shape (s + 2 r, 2).
    until
        Area swept along the rail up to each stop, shape (s + 2 r,), m2.
    """

    state: State
    xy: Floats
    segment: Ints
    way: Floats
    until: Floats


@dataclass(frozen=True)
class Layout:
    """Outlines of plots without the bends of rails, which are put back between cut ends.

    Attributes
    ----------
    mesh, rails
        What it was made from.
    vertex, face, ring
        Of each corner of an outline, shape (c,), those of a ring one after the other.
    before, after
        The corners before and after it in the ring, shape (c,).
    rail
        Rail that the edge after the corner runs along, -1 for none, shape (c,).
    tail, head
        Stops at both ends of that edge, -1 for none, shape (c,).
    """

    mesh: Mesh
    rails: Rails
    vertex: Ints
    face: Ints
    ring: Ints
    before: Ints
    after: Ints
    rail: Ints
    tail: Ints
    head: Ints

    @classmethod
    def of(cls, mesh: Mesh, rails: Rails) -> Layout:
        """Make the layout of a mesh with its rails."""
        kept = np.flatnonzero(~rails.drop[mesh.vertex])
        after = following(mesh.ring[kept])
        before = np.empty_like(after)
        before[after] = np.arange(len(kept))
        place_before = np.empty_like(mesh.after)
        place_before[mesh.after] = np.arange(len(mesh.after))
        return cls(
            mesh,
            rails,
            mesh.vertex[kept],
            mesh.face[kept],
            mesh.ring[kept],
            before,
            after,
            rails.rail_of_place[kept],
            rails.tail[kept],
            rails.head[place_before[kept[after]]],
        )

    def begin(self) -> State:
        """Give the state that the plots came in."""
        return State(self.mesh.local.copy(), self.rails.start.copy())

    def midway(self, state: State) -> State:
        """Give the state halfway between that in which the plots came and another."""
        begin = self.begin()
        return State(0.5 * (begin.xy + state.xy), 0.5 * (begin.s + state.s))

    def place(self, state: State) -> Placed:
        """Find where everything is in a state."""
        rails = self.rails
        point, way, k = rails.point(rails.rail, state.s)
        xy = state.xy.copy()
        xy[rails.slider] = point[: len(rails.slider)]
        return Placed(state, xy, k, way, rails.area(point, k))

    def snapped(self, s: Floats) -> Floats:
        """Put stops that almost are at a bend of their rail onto it."""
        k = self.rails.segment(self.rails.rail, s)
        for bend in (k, k + 1):
            at = self.rails.at[bend]
            s = np.where(np.abs(s - at) < SNAP, at, s)
        return s

    def bends(self, placed: Placed, tail: Ints, head: Ints) -> tuple[Ints, Ints, Flags]:
        """Find the bends of rails between stops.

        Parameters
        ----------
        placed
            Where things are.
        tail, head
            Stops on the same rails, shape (k,).

        Returns
        -------
        begin, end
            First and last bend from the one nearer to the begin of the rail, the last before the
            first if there is none, shape (k,).
        ahead
            Whether the tail is that one, shape (k,).
        """
        s, segment = placed.state.s, placed.segment
        ahead = s[tail] < s[head]
        low, high = np.where(ahead, tail, head), np.where(ahead, head, tail)
        end = segment[high]
        return segment[low] + 1, np.asarray(end - (self.rails.at[end] >= s[high])), ahead

    def outlines(self, placed: Placed, faces: Flags, *, exact: bool) -> tuple[Floats, Ints, Ints]:
        """Coordinates of the rings of faces, with the bends of rails.

        Parameters
        ----------
        placed
            Where things are.
        faces
            Which faces, shape (f,).
        exact
            Whether in the coordinates of the plots, where what has not moved keeps its
            coordinates to the last bit; else from the middle of each block.

        Returns
        -------
        xy
            Coordinates, each ring closed, shape (k, 2), metres.
        ring
            Number of the ring of each from 0, shape (k,).
        face
            Face of each ring, the exterior before the holes, shape (rings,).
        """
        chosen = np.flatnonzero(faces[self.face])
        along = self.rail[chosen] >= 0
        on = chosen[along]
        begin, end, ahead = self.bends(placed, self.tail[on], self.head[on])
        bends = np.zeros(len(chosen), int)
        bends[along] = np.maximum(end - begin + 1, 0)
        # a corner, then the bends up to the next
        place = np.repeat(np.arange(len(chosen)), bends + 1)
        step = np.arange(len(place)) - (np.cumsum(bends + 1) - bends - 1)[place]
        one = np.ones(len(chosen), int)
        one[along] = np.where(ahead, 1, -1)
        from_bend = np.zeros(len(chosen), int)
        from_bend[along] = np.where(ahead, begin, end)
        at_corner = step == 0
        bend = np.where(at_corner, 0, (from_bend - one)[place] + one[place] * step)
        corners = self.exact(placed) if exact else placed.xy
        curve = self.mesh.xy[self.rails.bend] if exact else self.rails.xy
        xy = np.where(
            at_corner[:, None],
            corners[self.vertex[chosen][place]],
            curve[bend] if len(curve) else 0.0,
        )
        ring = self.ring[chosen][place]
        begins = starts(ring)
        first = np.flatnonzero(begins)
        number = np.cumsum(begins) - 1
        # room for one more at the end of each ring, which closes it
        to = np.arange(len(ring)) + number
        whole, rings = np.empty((len(ring) + len(first), 2)), np.zeros(len(ring) + len(first), int)
        whole[to], rings[to] = xy, number
        close = np.append(to[first[1:]], len(whole)) - 1
        whole[close], rings[close] = xy[first], np.arange(len(first))
        return whole, rings, self.face[chosen][place][first]

    def exact(self, placed: Placed) -> Floats:
        """Coordinates of all vertices as plots have them, shape (n, 2), metres."""
        mesh, rails, state = self.mesh, self.rails, placed.state
        xy = placed.xy + mesh.origin[mesh.block]
        count = len(rails.slider)
        still = (state.xy == mesh.local).all(axis=1)
        still[rails.slider] = state.s[:count] == rails.start[:count]
        xy[still] = mesh.xy[still]
        k = placed.segment[:count]
        for bend in (k, k + 1):
            on = rails.at[bend] == state.s[:count]
            xy[rails.slider[on]] = mesh.xy[rails.bend[bend[on]]]
        return xy

    def polygons(self, placed: Placed, faces: Flags, *, exact: bool) -> npt.NDArray[Any]:
        """Polygons of the faces that are chosen, in their order.

        Parameters
        ----------
        placed, faces, exact
            See `outlines`.
        """
        if not faces[self.face].any():
            return np.zeros(0, dtype=object)
        xy, number, face = self.outlines(placed, faces, exact=exact)
        rings = shapely.linearrings(xy, indices=number)
        return _with_holes(rings, face)


def parts_of(polygons: npt.NDArray[Any], chosen: Flags) -> Ints:
    """Count the parts of plots without their necks, shape (n,), 0 for those not chosen.

    Parameters
    ----------
    polygons
        The plots, shape (n,), metres.
    chosen
        Which to look at, shape (n,).
    """
    found = np.zeros(len(polygons), int)
    inner = shapely.buffer(polygons[chosen], -NECK / 2, quad_segs=2)
    found[chosen] = shapely.get_num_geometries(inner)
    return found


def _with_holes(rings: npt.NDArray[Any], face: Ints) -> npt.NDArray[Any]:
    """Polygons of rings, the first of each face is its exterior."""
    first = starts(face)
    if first.all():
        return np.asarray(shapely.polygons(rings))
    found = shapely.polygons(rings[first])
    for one in np.unique(face[~first]).tolist():
        mine = np.flatnonzero(face == one)
        found[np.searchsorted(face[first], one)] = shapely.Polygon(
            rings[mine[0]], list(rings[mine[1:]])
        )
    return np.asarray(found)
