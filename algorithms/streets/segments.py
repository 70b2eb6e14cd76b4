"""Street segments between junctions, with their distances to the sinks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from shapely.geometry import LineString

from .distances import node_distances
from .hierarchy import blind_ends, with_culs_de_sac
from .joints import Connector
from .pieces import Piece
from .survey import Ground


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
    blind
        Whether it ends blind.
    one_way
        Whether traffic runs from start to end only; then only that end leads out.
    """

    line: LineString
    level: int
    start: int
    end: int
    dist_start: float
    dist_end: float
    blind: bool = False
    one_way: bool = False

    @property
    def distance(self) -> float:
        """Distance from the middle of the segment to the nearest sink, metres."""
        if self.one_way:
            return self.dist_end + float(self.line.length) / 2
        return min(self.dist_start, self.dist_end) + float(self.line.length) / 2

    @property
    def furthest(self) -> float:
        """Distance to the nearest sink from the segment's least favoured point, metres."""
        if self.one_way:
            return self.dist_end + float(self.line.length)
        return (self.dist_start + self.dist_end + float(self.line.length)) / 2

    @property
    def mean_distance(self) -> float:
        """Mean distance over all points of the segment, metres.

        From one end the way out grows linearly up to the divide, from the other likewise.
        """
        length = float(self.line.length)
        if self.one_way:
            return self.dist_end + length / 2
        if length == 0:
            return self.dist_start
        divide = min(max((self.dist_end - self.dist_start + length) / 2, 0.0), length)
        rest = length - divide
        total = divide * (self.dist_start + divide / 2) + rest * (self.dist_end + rest / 2)
        return total / length

    @property
    def direction(self) -> int:
        """1 where traffic descends along the line, -1 against it, 0 where it parts."""
        if self.one_way:
            return 1
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
    blind = blind_ends(ground, pieces)
    return [
        Segment(
            p.line,
            p.level,
            p.start,
            p.end,
            distance[p.start],
            distance[p.end],
            not blind.isdisjoint((p.start, p.end)),
            p.one_way,
        )
        for p in with_culs_de_sac(ground, pieces)
    ]
