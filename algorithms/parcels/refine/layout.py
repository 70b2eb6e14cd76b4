"""Where everything is: positions of vertices and cut ends, and the outlines of plots from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from .mesh import Flags, Floats, Ints, Mesh, following
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

    def positions(self, state: State) -> Floats:
        """Give the positions of all vertices, shape (n, 2), metres from the middle of the block."""
        xy = state.xy.copy()
        count = len(self.rails.slider)
        xy[self.rails.slider] = self.rails.point(self.rails.rail[:count], state.s[:count])[0]
        return xy

    def snapped(self, s: Floats) -> Floats:
        """Put stops that almost are at a bend of their rail onto it."""
        k = self.rails.segment(self.rails.rail, s)
        for bend in (k, k + 1):
            at = self.rails.at[bend]
            s = np.where(np.abs(s - at) < SNAP, at, s)
        return s

    def outlines(self, state: State, faces: Flags, *, exact: bool) -> tuple[Floats, Ints, Ints]:
        """Coordinates of the rings of faces, with the bends of rails.

        Parameters
        ----------
        state
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
        rail, tail, head = self.rail[chosen], self.tail[chosen], self.head[chosen]
        along = rail >= 0
        ends = np.stack([state.s[tail[along]], state.s[head[along]]])
        low, high = ends.min(axis=0), ends.max(axis=0)
        begin = self.rails.segment(rail[along], low) + 1
        end = self.rails.segment(rail[along], high)
        end = end - (self.rails.at[end] >= high)
        bends = np.zeros(len(chosen), int)
        bends[along] = np.maximum(end - begin + 1, 0)
        # a corner, then the bends up to the next
        place = np.repeat(np.arange(len(chosen)), bends + 1)
        step = np.arange(len(place)) - (np.cumsum(bends + 1) - bends - 1)[place]
        one = np.ones(len(chosen), int)
        one[along] = np.where(ends[0] < ends[1], 1, -1)
        from_bend = np.zeros(len(chosen), int)
        from_bend[along] = np.where(ends[0] < ends[1], begin, end)
        at_corner = step == 0
        bend = np.where(at_corner, 0, (from_bend - one)[place] + one[place] * step)
        corners = self.exact(state) if exact else self.positions(state)
        curve = self.mesh.xy[self.rails.bend] if exact else self.rails.xy
        xy = np.where(
            at_corner[:, None],
            corners[self.vertex[chosen][place]],
            curve[bend] if len(curve) else 0.0,
        )
        ring = self.ring[chosen][place]
        first = np.flatnonzero(np.r_[True, ring[1:] != ring[:-1]]) if len(ring) else ring
        last = np.r_[first[1:], len(ring)]
        number = np.repeat(np.arange(len(first)), last - first)
        xy = np.insert(xy, last, xy[first], axis=0)
        number = np.insert(number, last, np.arange(len(first)))
        return xy, number, self.face[chosen][place][first]

    def exact(self, state: State) -> Floats:
        """Coordinates of all vertices as plots have them, shape (n, 2), metres."""
        mesh, rails = self.mesh, self.rails
        moved = self.positions(state)
        xy = moved + mesh.origin[mesh.block]
        count = len(rails.slider)
        still = (state.xy == mesh.local).all(axis=1)
        still[rails.slider] = state.s[:count] == rails.start[:count]
        xy[still] = mesh.xy[still]
        k = rails.segment(rails.rail[:count], state.s[:count])
        for bend in (k, k + 1):
            on = rails.at[bend] == state.s[:count]
            xy[rails.slider[on]] = mesh.xy[rails.bend[bend[on]]]
        return xy

    def polygons(self, state: State, faces: Flags, *, exact: bool) -> npt.NDArray[Any]:
        """Polygons of the faces that are chosen, in their order.

        Parameters
        ----------
        state, faces, exact
            See `outlines`.
        """
        if not faces[self.face].any():
            return np.zeros(0, dtype=object)
        xy, number, face = self.outlines(state, faces, exact=exact)
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
    first = np.r_[True, face[1:] != face[:-1]]
    found = shapely.polygons(rings[first])
    for one in np.unique(face[~first]).tolist():
        mine = np.flatnonzero(face == one)
        found[np.searchsorted(face[first], one)] = shapely.Polygon(
            rings[mine[0]], list(rings[mine[1:]])
        )
    return np.asarray(found)
