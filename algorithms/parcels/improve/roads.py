"""Streets through their junctions: where they should be fair, and where square."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..roadmesh import StreetMesh
from ..roadmesh.ranks import THROUGH

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
#: Directions at junctions are measured between vertices at least so far away (metres).
REACH = 30.0
#: Streets bend by less than this at vertices that are no junctions (degrees).
BEND = 75.0


@dataclass(frozen=True)
class Roads:
    """Vertices of streets and the ones to compare them with.

    Attributes
    ----------
    fair
        Vertex before, vertex, vertex after, shape (n, 3): three of one street in a row.
    square
        Junction, a vertex on the street that ends (or crosses) there, and two on the street or
        edge that it meets, before and after the junction, shape (m, 4).
    share
        How much each row of `square` counts: 1, at crossings one half, shape (m,).
    """

    fair: Ints
    square: Ints
    share: Floats

    def renewed(self, mesh: StreetMesh, junctions: Collection[int]) -> Roads:
        """Look anew at what some junctions at the edge should be square to.

        Parameters
        ----------
        mesh
            The mesh, in which these junctions have slid on.
        junctions
            Their vertices.
        """
        new = roads_of(mesh)
        which = np.array(sorted(junctions), dtype=np.int64)
        old = ~np.isin(self.square[:, 0], which)
        more = np.isin(new.square[:, 0], which)
        return Roads(
            self.fair,
            np.concatenate([self.square[old], new.square[more]]),
            np.concatenate([self.share[old], new.share[more]]),
        )

    def bends(self, xy: Floats) -> Floats:
        """Where on the way from the vertex before to the one after the middle one belongs.

        Shape (n,), 0 to 1, by the lengths that the two pieces have.
        """
        a, v, b = self.fair.T
        first, second = np.hypot(*(xy[v] - xy[a]).T), np.hypot(*(xy[b] - xy[v]).T)
        return np.asarray(first / np.maximum(first + second, 1e-9))

    def ways(self, xy: Floats) -> Floats:
        """Directions that the ends of streets should be square to, unit vectors, shape (m, 2)."""
        way = xy[self.square[:, 3]] - xy[self.square[:, 2]]
        return np.asarray(way / np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-9)[:, None])

    def scale(self, xy: Floats) -> Floats:
        """Make angles at the junctions metres: as far off as at `REACH`, shape (m,)."""
        stem = np.hypot(*(xy[self.square[:, 1]] - xy[self.square[:, 0]]).T)
        return np.asarray(REACH / np.maximum(stem, 1.0))


def roads_of(mesh: StreetMesh) -> Roads:
    """Find the streets of a mesh through their junctions.

    Parameters
    ----------
    mesh
        The mesh. At a junction those two pieces are one street that turn least, if by less than
        30 degrees (see `roadmesh.ranks`).
    """
    around: dict[int, list[int]] = {}
    outer: dict[int, list[int]] = {}
    for (a, b), edge in mesh.edges.items():
        into = around if edge.street >= 0 else outer
        into.setdefault(a, []).append(b)
        into.setdefault(b, []).append(a)
    walk = _Walk(mesh.xy, around, outer)
    fair: list[tuple[int, int, int]] = []
    square: list[tuple[int, int, int, int]] = []
    share: list[float] = []
    for v in sorted(around):
        pairs = walk.pairs(v)
        fair += [(a, v, b) for a, b in pairs]
        if v in outer:
            pairs = [(outer[v][0], outer[v][-1])] if len(outer[v]) == 2 else []
        elif len(around[v]) < 3:
            continue
        for a, b in pairs:
            stems = [c for c in around[v] if c not in (a, b)]
            for c in stems:
                square.append((v, walk.far(v, c), walk.far(v, a), walk.far(v, b)))
                share.append(0.5 if len(pairs) > 1 else 1.0)
    return Roads(
        np.array(fair, dtype=np.int64).reshape(-1, 3),
        np.array(square, dtype=np.int64).reshape(-1, 4),
        np.array(share),
    )


class _Walk:
    """Ways along streets, on over junctions."""

    def __init__(
        self, xy: Floats, around: dict[int, list[int]], outer: dict[int, list[int]]
    ) -> None:
        self._xy = xy
        self._around = around
        self._outer = outer
        self._pairs: dict[int, list[tuple[int, int]]] = {}

    def pairs(self, v: int) -> list[tuple[int, int]]:
        """Pairs of neighbours between which a street goes on over v."""
        if v not in self._pairs:
            self._pairs[v] = self._find(v)
        return self._pairs[v]

    def far(self, v: int, first: int) -> int:
        """Go from v by way of a neighbour until `REACH` is behind; return the vertex there."""
        before, here = v, first
        gone = self._length(before, here)
        while gone < REACH:
            after = self._after(before, here)
            if after is None or after == v:
                break
            before, here = here, after
            gone += self._length(before, here)
        return here

    def _after(self, before: int, here: int) -> int | None:
        """Go on over a vertex; None where the street ends."""
        if before in self._outer.get(here, ()):
            others = [w for w in self._outer[here] if w != before]
            straight = len(others) == 1 and self._turn(here, before, others[0]) < THROUGH
            return others[0] if straight else None
        for a, b in self.pairs(here):
            if before in (a, b):
                return b if before == a else a
        return None

    def _find(self, v: int) -> list[tuple[int, int]]:
        meeting = self._around.get(v, [])
        limit = BEND if len(meeting) == 2 and v not in self._outer else THROUGH
        turns = sorted(
            (self._turn(v, a, b), a, b) for k, a in enumerate(meeting) for b in meeting[k + 1 :]
        )
        found: list[tuple[int, int]] = []
        taken: set[int] = set()
        for turn, a, b in turns:
            if turn < limit and not taken & {a, b}:
                taken |= {a, b}
                found.append((a, b))
        return found

    def _length(self, a: int, b: int) -> float:
        return float(np.hypot(*(self._xy[b] - self._xy[a])))

    def _turn(self, v: int, a: int, b: int) -> float:
        """By how much the way from a over v to b turns, degrees."""
        back, on = self._xy[v] - self._xy[a], self._xy[b] - self._xy[v]
        cross = back[0] * on[1] - back[1] * on[0]
        return float(np.degrees(np.arctan2(abs(cross), back @ on)))
