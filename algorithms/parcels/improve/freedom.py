"""What may move, and whereto: junctions slide along what is fixed, all else is free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from ..roadmesh import StreetMesh

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
#: A vertex this near to the line of its neighbours lies on it (metres).
ON_LINE = 1e-6
#: Junctions keep this far from corners and from each other as they slide (metres).
APART = 6.0
#: Where an edge turns by less there is no corner: junctions pass (degrees).
SOFT = 25.0
#: They pass once they are this near (metres).
NEAR = 0.5
#: Edges that are no longer have no direction to slide along (metres).
SHORT = 1e-3


@dataclass(frozen=True)
class Freedom:
    """What may move.

    Attributes
    ----------
    free
        Vertices that may go anywhere, shape (f,).
    sliders
        Junctions that slide along a straight edge, shape (s,).
    before, after
        Their neighbours along that edge, shape (s,).
    apart
        How near they may come to these, shape (s, 2), metres.
    """

    free: Ints
    sliders: Ints
    before: Ints
    after: Ints
    apart: Floats

    @property
    def size(self) -> int:
        """Number of the unknowns."""
        return 2 * len(self.free) + len(self.sliders)

    def ways(self, xy: Floats) -> Floats:
        """Directions in which the junctions slide, unit vectors, shape (s, 2)."""
        way = xy[self.after] - xy[self.before]
        return np.asarray(way / np.hypot(way[:, 0], way[:, 1])[:, None])

    def room(self, xy: Floats) -> tuple[Floats, Floats]:
        """How far each junction may slide back and on, shape (s,) each, metres, both >= 0.

        Two junctions that slide on one edge each get half of the room between them.
        """
        moving = np.zeros(len(xy), dtype=bool)
        moving[self.sliders] = True
        found = []
        for k, other in enumerate((self.before, self.after)):
            gap = np.hypot(*(xy[other] - xy[self.sliders]).T)
            found.append(
                np.maximum(0.0, gap - self.apart[:, k]) * np.where(moving[other], 0.5, 1.0)
            )
        return found[0], found[1]

    def matrix(self, xy: Floats) -> csr_array:
        """Matrix P, shape (2n, 2f + s): a step q of what is free moves all by P q.

        Rows are the x of all vertices, then their y; columns the x of the free ones, their y,
        then the way along its edge of each that slides.
        """
        n, f, s = len(xy), len(self.free), len(self.sliders)
        ways = self.ways(xy)
        slide = 2 * f + np.arange(s)
        rows = np.r_[self.free, self.free + n, self.sliders, self.sliders + n]
        columns = np.r_[np.arange(2 * f), slide, slide]
        values = np.r_[np.ones(2 * f), ways[:, 0], ways[:, 1]]
        return csr_array((values, (rows, columns)), shape=(2 * n, 2 * f + s))


def freedom_of(mesh: StreetMesh) -> Freedom:
    """Find what may move.

    A vertex that no fixed edge meets is free. One on two fixed edges that are alike and go
    straight on slides along them if a street that may move meets it there. All else stays.

    Parameters
    ----------
    mesh
        The mesh.
    """
    held: dict[int, list[int]] = {}
    loose: set[int] = set()
    for (a, b), edge in mesh.edges.items():
        if edge.fixed:
            held.setdefault(a, []).append(b)
            held.setdefault(b, []).append(a)
        else:
            loose |= {a, b}
    free = sorted(loose - held.keys())
    sliding = [
        (v, *sorted(held[v])) for v in sorted(loose & held.keys()) if _slides(mesh, v, held[v])
    ]
    found = np.array(sliding, dtype=np.int64).reshape(-1, 3)
    apart = [
        [NEAR if _passable(mesh, held, loose, v, w) else APART for w in (a, b)]
        for v, a, b in sliding
    ]
    return Freedom(
        np.array(free, dtype=np.int64),
        found[:, 0],
        found[:, 1],
        found[:, 2],
        np.array(apart, dtype=float).reshape(-1, 2),
    )


def _passable(
    mesh: StreetMesh, held: dict[int, list[int]], loose: set[int], v: int, b: int
) -> bool:
    """Tell whether a junction may pass the next vertex: no corner, and nothing meets there."""
    if b in loose or len(held[b]) != 2:
        return False
    c = held[b][0] if held[b][1] == v else held[b][1]
    if mesh.edge(v, b) != mesh.edge(b, c):
        return False
    return turn(mesh.xy[b] - mesh.xy[v], mesh.xy[c] - mesh.xy[b]) < SOFT


def turn(first: Floats, second: Floats) -> float:
    """Angle between two directions, 0 to 180 degrees.

    Examples
    --------
    >>> round(turn(np.array([1.0, 0.0]), np.array([0.0, -3.0])), 6)
    90.0
    """
    cross = float(first[0] * second[1] - first[1] * second[0])
    return float(np.degrees(np.arctan2(abs(cross), float(first @ second))))


def _slides(mesh: StreetMesh, v: int, along: list[int]) -> bool:
    """Tell whether a vertex lies within a straight fixed edge, not at one of its ends."""
    if len(along) != 2:
        return False
    a, b = along
    if mesh.edge(a, v) != mesh.edge(v, b):
        return False
    back, on = mesh.xy[v] - mesh.xy[a], mesh.xy[b] - mesh.xy[v]
    way = back + on
    length = float(np.hypot(*way))
    if length < SHORT or float(back @ on) <= 0:
        return False
    return abs(float(back[0] * way[1] - back[1] * way[0])) < ON_LINE * length
