"""One part of the route in each block: what equations 19 and 20 of CND-x leave open.

CND-x section 5.3 assumes "that a block is traversed by at most one connected part of the network",
and no equation says so. The edges of a route in a block without rings have one vertex more than
edges in each part; so the vertices that they touch are at most one more than the edges. Rings
inside large blocks can hide a part from that. Then, where a solution has several parts all the
same: whoever has two edges on in one block that were in different parts needs one on that leaves
the part of the first.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from ...network.cp.model import CpNetwork
from ...network.problem import BoolArray
from .index import RoomIndex


def touched_by(index: RoomIndex, room: int) -> dict[int, list[int]]:
    """Return the inner edges of a placement at each vertex; nothing if one part is certain."""
    ends = index.problem.network.mesh.edges
    at: dict[int, list[int]] = {}
    inner = index.problem.placements.inner[room]
    for e in inner:
        for v in ends[e].tolist():
            at.setdefault(v, []).append(e)
    return {} if any(len(mine) == len(inner) for mine in at.values()) else at


@dataclass(frozen=True)
class PartCut:
    """Both of `on` only with one of `out`, if placement `room` is chosen."""

    room: int
    on: tuple[int, int]
    out: tuple[int, ...]


def parts_of(index: RoomIndex, on: Iterable[int]) -> list[set[int]]:
    """Return the connected parts of some edges, as sets of edges."""
    ends = index.problem.network.mesh.edges
    parts: list[tuple[set[int], set[int]]] = []
    for e in on:
        edges, vertices = {e}, set(ends[e].tolist())
        rest = []
        for other, touched in parts:
            if touched & vertices:
                edges |= other
                vertices |= touched
            else:
                rest.append((other, touched))
        parts = [*rest, (edges, vertices)]
    return [edges for edges, _ in parts]


def part_cuts(index: RoomIndex, active: BoolArray, rooms: Iterable[int]) -> Iterator[PartCut]:
    """Yield what forbids blocks with several parts of the route.

    Parameters
    ----------
    index
        The problem, of kind "level".
    active
        Shape (e,) or longer. The route.
    rooms
        Its blocks.
    """
    ends = index.problem.network.mesh.edges
    for r in rooms:
        inner = index.problem.placements.inner[r]
        parts = parts_of(index, (e for e in inner if active[e]))
        if len(parts) < 2:
            continue
        for at, part in enumerate(parts):
            other = parts[at - 1]
            touched = {v for e in part for v in ends[e].tolist()}
            out = tuple(e for e in inner if len(touched.intersection(ends[e].tolist())) == 1)
            yield PartCut(r, (min(part), min(other)), out)


def cut_parts(network: CpNetwork, index: RoomIndex, design: BoolArray) -> bool:
    """Forbid blocks of a solution that the route crosses twice; return whether there are any."""
    if index.problem.kind != "level":
        return False
    found = False
    for cut in part_cuts(index, design, index.rooms_of(design)):
        literals = [network.literal(e) for e in cut.out]
        literals += [network.negated(network.literal(e)) for e in cut.on]
        room = network.further.get(cut.room)
        if room is not None:
            literals.append(~room)
        network.clause(literals)
        found = True
    return found
