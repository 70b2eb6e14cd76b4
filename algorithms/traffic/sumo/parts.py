"""Pieces of street cut at the places where trips begin and end, so that each place is a node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.ops import substring

from ...errors import InputError
from ..types import FloatArray, IntArray, Places, TrafficNetwork

#: A place that is nearer to a junction than this (m) is moved away from it, or to its node where
#: the piece has no room: junctions reach so far into streets, and a vehicle needs room to start.
MARGIN = 15.0
#: Places of one piece that are nearer to each other than this (m) share a node.
TOGETHER = 10.0
#: Parts of a piece that begins and ends at the same node; SUMO knows no edge of that kind.
_LOOP = 3


@dataclass(frozen=True, eq=False)
class Parts:
    """The k parts of the pieces of a network, and where on them the p places are.

    Attributes
    ----------
    nodes
        Shape (n, 2). Those of the network first, then places; metres from `origin`.
    origin
        Shape (2,). In the working CRS.
    piece
        Shape (k,). Piece that each part is of.
    ends
        Shape (k, 2). Nodes at its start and its end.
    lines
        Shape (k,). From start to end, metres from `origin`.
    stops
        Shape (p,). Node of each place.
    """

    nodes: FloatArray
    origin: FloatArray
    piece: IntArray
    ends: IntArray
    lines: npt.NDArray[np.object_]
    stops: IntArray


def cut(network: TrafficNetwork, places: Places) -> Parts:
    """Cut pieces at places.

    Parameters
    ----------
    network, places
        The streets, and where trips begin and end on them.

    Raises
    ------
    InputError
        A piece has no length, or a place lies on none.
    """
    length = network.length
    _check(network, places, length)
    stops = places.node.astype(np.int64).copy()
    cuts, shares = _cuts(network, places, length, stops)
    corner = network.nodes.min(axis=0) if len(network.nodes) else np.zeros(2)
    # whole metres, so that nothing is rounded twice
    origin = np.floor(np.asarray(corner, dtype=np.float64))
    nodes = [tuple(point) for point in network.nodes - origin]
    piece: list[int] = []
    ends: list[tuple[int, int]] = []
    lines: list[shapely.LineString] = []
    for number, line in enumerate(shapely.transform(network.lines, lambda xy: xy - origin)):
        first, last = (int(node) for node in network.ends[number])
        edges = [0.0, *cuts[number], float(length[number])]
        at = [first, *range(len(nodes), len(nodes) + len(cuts[number])), last]
        for place, which in shares[number]:
            stops[place] = at[which + 1]
        for begin, end, one, other in zip(edges[:-1], edges[1:], at[:-1], at[1:]):
            piece.append(number)
            ends.append((one, other))
            lines.append(substring(line, begin, end))
        nodes.extend(line.interpolate(along).coords[0] for along in cuts[number])
    found = np.empty(len(lines), dtype=np.object_)
    found[:] = lines
    return Parts(
        nodes=np.asarray(nodes, dtype=np.float64).reshape(-1, 2),
        origin=origin,
        piece=np.asarray(piece, dtype=np.int64),
        ends=np.asarray(ends, dtype=np.int64).reshape(-1, 2),
        lines=found,
        stops=stops,
    )


def _check(network: TrafficNetwork, places: Places, length: FloatArray) -> None:
    if not len(length):
        raise InputError("There are no streets to simulate.", "Give a layer with streets.")
    for number in np.flatnonzero(~(length > 0)):
        raise InputError(
            "The street has a part without length.",
            "Remove it, for instance with the tool 'Remove null geometries' of QGIS.",
            feature=int(network.feature[number]),
        )
    interior = places.node < 0
    wrong = (places.piece < 0) | (places.piece >= len(length))
    if bool((wrong & interior).any()) or bool((places.node >= len(network.nodes)).any()):
        raise InputError(
            "A place where trips begin lies on no street.", "Make the places from these streets."
        )


def _cuts(
    network: TrafficNetwork, places: Places, length: FloatArray, stops: IntArray
) -> tuple[list[list[float]], list[list[tuple[int, int]]]]:
    """Return where each piece is cut, and which place is at which cut; fill in other stops."""
    cuts: list[list[float]] = [[] for _ in range(len(length))]
    shares: list[list[tuple[int, int]]] = [[] for _ in range(len(length))]
    for place in sorted(np.flatnonzero(places.node < 0), key=lambda p: places.along[p]):
        number = int(places.piece[place])
        whole = float(length[number])
        loop = network.ends[number, 0] == network.ends[number, 1]
        along = float(np.clip(places.along[place], 0.0, whole))
        if whole < 2.0 * MARGIN and not loop:
            stops[place] = network.ends[number, 0 if along <= whole / 2.0 else 1]
            continue
        least = min(MARGIN, whole / 4.0)
        along = float(np.clip(along, least, whole - least))
        if not cuts[number] or along - cuts[number][-1] > TOGETHER:
            cuts[number].append(along)
        shares[number].append((int(place), len(cuts[number]) - 1))
    for number in np.flatnonzero(network.ends[:, 0] == network.ends[:, 1]):
        _cut_loop(cuts[number], shares[number], float(length[number]))
    return cuts, shares


def _cut_loop(cuts: list[float], shares: list[tuple[int, int]], whole: float) -> None:
    """Cut a loop where its longest part is, until it has enough parts."""
    while len(cuts) + 1 < _LOOP:
        edges = [0.0, *cuts, whole]
        widest = int(np.argmax(np.diff(edges)))
        cuts.insert(widest, (edges[widest] + edges[widest + 1]) / 2.0)
        shares[:] = [(place, at + (at >= widest)) for place, at in shares]
