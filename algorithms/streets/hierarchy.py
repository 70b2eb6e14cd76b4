"""The hierarchy of streets: design speeds that were asked for, and which streets end blind."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence

import networkx as nx

from ..levels import CUL_DE_SAC, LOCAL, SPEEDS
from ..network.specification import Specification
from .pieces import Piece
from .survey import Ground


def speed_kmh(spec: Specification, level: int) -> float:
    """Give the design speed of a level in km/h.

    Examples
    --------
    >>> speed_kmh(Specification(), 2)
    50.0
    """
    own = spec.level_settings.get(level)
    return SPEEDS[level] if own is None or own.speed_kmh is None else float(own.speed_kmh)


def blind_ends(ground: Ground, pieces: Sequence[Piece]) -> set[int]:
    """Junctions at which a street ends blind: neither a sink nor on an existing street."""
    meeting = Counter(v for p in pieces for v in (p.start, p.end))
    kept = set(ground.mesh.edges[ground.street].ravel().tolist())

    def blind(v: int) -> bool:
        if v < 0 or meeting[v] != 1 or v in kept:
            return False
        return v >= len(ground.sinks) or not ground.sinks[v]

    return {v for v in meeting if blind(v)}


def with_culs_de_sac(ground: Ground, pieces: Sequence[Piece]) -> list[Piece]:
    """Give level 4 to streets that end blind, and level 3 to those of level 4 that lead through.

    A street leads through where it can be left at both ends.
    """
    blind = blind_ends(ground, pieces)
    through = _through(ground, pieces) if any(p.level == CUL_DE_SAC for p in pieces) else set()
    found = []
    for i, piece in enumerate(pieces):
        level = piece.level
        if piece.start in blind or piece.end in blind:
            level = CUL_DE_SAC
        elif level == CUL_DE_SAC and i in through:
            level = LOCAL
        found.append(dataclasses.replace(piece, level=level) if level != piece.level else piece)
    return found


def _through(ground: Ground, pieces: Sequence[Piece]) -> set[int]:
    """Numbers of the pieces that lie on a ring of streets, existing ones included."""
    kept = set(ground.mesh.edges[ground.street].ravel().tolist())
    out = ("out", 0)

    def node(v: int) -> tuple[str, int]:
        at_sink = 0 <= v < len(ground.sinks) and bool(ground.sinks[v])
        return out if v < 0 or v in kept or at_sink else ("junction", v)

    graph: nx.Graph = nx.Graph()
    for i, piece in enumerate(pieces):
        # a node in the middle of each, and two at rings, tells parallel streets apart
        ends = (node(piece.start), node(piece.end))
        graph.add_edge(ends[0], ("first", i))
        graph.add_edge(("first", i), ("second", i))
        graph.add_edge(("second", i), ends[1])
    bridges = {frozenset(edge) for edge in nx.bridges(graph)}
    middle = [frozenset((("first", i), ("second", i))) for i in range(len(pieces))]
    return {i for i in range(len(pieces)) if middle[i] not in bridges}
