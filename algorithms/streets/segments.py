"""Street segments between junctions, with their distances to the sinks."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from shapely.geometry import LineString

from .distances import node_distances
from .joints import Connector
from .pieces import Piece
from .survey import Ground

#: Level of a street that ends blind.
CUL_DE_SAC = 4


@dataclass(frozen=True)
class Segment:
    """A designed street between two junctions.

    Attributes
    ----------
    line
        Its course, metres.
    level
        1 major, 2 collector, 3 local, 4 cul-de-sac.
    start, end
        Junctions at its ends, numbered as in `Piece`.
    dist_start, dist_end
        Network distance from each end to the nearest sink, metres.
    """

    line: LineString
    level: int
    start: int
    end: int
    dist_start: float
    dist_end: float

    @property
    def distance(self) -> float:
        """Distance from the middle of the segment to the nearest sink, metres."""
        return min(self.dist_start, self.dist_end) + float(self.line.length) / 2

    @property
    def furthest(self) -> float:
        """Distance to the nearest sink from the segment's least favoured point, metres."""
        return (self.dist_start + self.dist_end + float(self.line.length)) / 2

    @property
    def mean_distance(self) -> float:
        """Mean distance over all points of the segment, metres.

        From one end the way out grows linearly up to the divide, from the other likewise.
        """
        length = float(self.line.length)
        if length == 0:
            return self.dist_start
        divide = min(max((self.dist_end - self.dist_start + length) / 2, 0.0), length)
        rest = length - divide
        total = divide * (self.dist_start + divide / 2) + rest * (self.dist_end + rest / 2)
        return total / length

    @property
    def direction(self) -> int:
        """1 where traffic descends along the line, -1 against it, 0 where it parts."""
        if abs(self.dist_start - self.dist_end) < 1e-6:
            return 0
        return 1 if self.dist_end < self.dist_start else -1


def segments(
    ground: Ground,
    pieces: Sequence[Piece],
    connectors: Sequence[Connector] = (),
    exits: frozenset[int] = frozenset(),
) -> list[Segment]:
    """Measure how far it is from every street to the sinks.

    Distances are measured along the final courses, and along existing streets.

    Parameters
    ----------
    ground
        The site and its mesh.
    pieces
        The streets.
    connectors
        What carries them on to the centre lines of existing ones.
    exits
        Junctions besides those of the mesh where traffic leaves.
    """
    distance = node_distances(ground, pieces, connectors, exits)
    return [
        Segment(p.line, p.level, p.start, p.end, distance[p.start], distance[p.end])
        for p in _culs_de_sac(ground, pieces)
    ]


def _culs_de_sac(ground: Ground, pieces: Sequence[Piece]) -> list[Piece]:
    """Give level 4 to streets that end blind."""
    meeting = Counter(v for p in pieces for v in (p.start, p.end))
    kept = set(ground.mesh.edges[ground.street].ravel().tolist())

    def blind(v: int) -> bool:
        if v < 0 or meeting[v] != 1 or v in kept:
            return False
        return v >= len(ground.sinks) or not ground.sinks[v]

    return [
        dataclasses.replace(p, level=CUL_DE_SAC) if blind(p.start) or blind(p.end) else p
        for p in pieces
    ]
